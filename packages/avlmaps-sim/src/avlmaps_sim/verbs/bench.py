"""`avlmaps bench`: the quality figures, as JSON, Markdown and CSV."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from avlmaps.cli.output import UsageError, emit, table_lines
from avlmaps.cli.verb import ModelVerb

if TYPE_CHECKING:
    from avlmaps_sim.bench.harness.settings import SceneSettings
    from avlmaps_sim.bench.indexing.runs import IndexingSettings
    from avlmaps_sim.bench.live.suite import LiveBench
    from avlmaps_sim.bench.navigation.missions import NavigationSettings
    from avlmaps_sim.bench.sources.suite import SourcesBench

Suite = Literal[
    "words", "language", "sounds", "segmentation", "locate", "frames", "recordings", "objects", "indexing", "found",
    "rooms", "change", "live", "sources", "navigation",
]  # fmt: skip
Series = Literal["sounds-1", "sounds-2", "sounds-3", "images", "pairs", "commands", "spatial"]


@dataclass(frozen=True, kw_only=True)
class Indexing:
    """Scenes of the suites indexing, objects and navigation."""

    hearing: Literal["overlay", "acoustic"] = "overlay"
    """How sounds reach the microphone: mixed in as the paper did, or through rooms and doorways."""
    sensor: Literal["clean", "kinect", "realsense"] = "clean"
    """Camera whose faults colour and depth have."""
    rules: Literal["ours", "paper"] = "ours"
    """Rules of mapping and querying: ours, or the paper's throughout (docs/paper-models.md)."""
    sound_clips: Literal["unheard", "all"] = "unheard"
    """Clips of --sounds: those that the embedded sound encoder was not trained on, or all."""
    frames: Annotated[int, arg(metavar="N")] = 600
    """Maximum number of frames per scene, and of labelled frames."""
    tasks_a_scene: Annotated[int, arg(metavar="N")] = 20
    """Maximum number of tasks per scene and table (indexing)."""
    size: Literal["paper", "all"] = "paper"
    """Tasks per table, over all scenes (indexing): as many as the paper has (100, 119, 159), or all."""
    jobs: Annotated[int, arg(metavar="N")] = 0
    """Number of scenes in parallel. Default: one for each core."""
    tasks: Annotated[Path | None, arg(metavar="FILE")] = None
    """Use the tasks (or missions) of this file instead of new ones."""
    save_tasks: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write the tasks (or missions) and their truth into this file."""


@dataclass(frozen=True, kw_only=True)
class Navigation:
    """Commands of the suite navigation."""

    sequences: Annotated[int, arg(metavar="N")] = 200
    """Sequences of four sounds (at each range), and of an image and two objects; pairs are 119 for each 200."""
    series: tuple[Series, ...] = ()
    """Experiments to run. Default: all."""
    language: Literal["learned", "rules", "chat", "none"] = "learned"
    """Translator of sentences into programs; rules is the former name of learned, none gives robots the programs."""
    guess: bool = True
    """Let robots refuse what the map does not find; by default they drive to the best guess, as in the paper."""


@dataclass(frozen=True, kw_only=True)
class Bench(ModelVerb):
    """Measure the accuracy of the parts, with counts and 95 % intervals.

    Example: avlmaps bench indexing --scenes house:1000000:held-out --out bench_out

    words: household phrases that were not trained on; needs nothing.
    language: commands and questions written for this project before use; needs nothing.
    sounds, segmentation: need --sounds, a folder of clips with an index.csv.
    locate: needs --scenes, recordings with poses; half of the frames become the map, the others are located.
    frames: needs --nyuv2, labelled frames of NYU Depth V2 or of your own camera (docs/guides/train-eyes.md); kinds of
    pixels, without any map.
    recordings: mistakes of recordings (poses, units, axes, clocks, pictures) and right ones, and what is said of each;
    takes --scenes, recordings of a real camera.
    objects: positions of objects, in the scenes of indexing, whose maps it shares.
    indexing: the paper's Tables III to V, in twelve held-out homes, in --scenes, or in a recording with objects.json.
    found: is what is reported as found there? Brier scores and reliability, in the scenes of indexing.
    rooms: the rooms of a map against the true ones (overlap, names, count, area), in the scenes of indexing.
    live: a live map at the pace of a robot: frames, questions, memory, its end beside the build, kills; needs --scenes,
    recordings with poses.
    change: what is new, gone and moved over several days, in ten held-out homes or in --scenes.
    sources: where sounds came from: in ten held-out homes or in --scenes, with three arrays, a device that says
    directions and an array that is calibrated in place; in a measured room (--rooms); in one room, varied.
    navigation: the paper's Tables I, II and VI and its commands, in twelve held-out homes or in --scenes.
    """

    compiles: ClassVar[bool] = True

    suite: Positional[Suite]
    """Suite to run."""
    sounds: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder of sound clips with an index.csv (path, category, fold)."""
    clips: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder of clips with an index.csv: queries each by name, dry and in simulated rooms (sounds)."""
    scenes: Annotated[tuple[str, ...], arg(metavar="SCENE ...")] = ()
    """Recordings with poses (locate, recordings, live); house:1000000:held-out, .glb, or with objects.json (others)."""
    nyuv2: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder of labelled frames (frames.csv, NAME.color.jpg, NAME.depth.png, NAME.label.png, camera.json)."""
    profile: Annotated[str, arg(metavar="PROFILE")] = "embedded"
    """Models to measure (see `avlmaps profiles`)."""
    model: Annotated[tuple[tuple[str, ...], ...], arg(metavar="MODULE=NAME[@MODEL] ..."), UseAppendAction] = ()
    """Other backends or models than the profile's: pixels=clip-patches@openai/clip-vit-large-patch14 views=clip."""
    out: Annotated[Path, arg(metavar="DIR")] = Path("bench_out")
    """Folder for SUITE.json, SUITE.md and a CSV file for each table."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of all random choices."""
    days: Annotated[int | None, arg(metavar="N")] = None
    """Number of days of each home, the first included (change). Default: 5."""
    laps: Annotated[int, arg(metavar="N")] = 2
    """How often each recording is driven, forth and back; 0 for kills alone (live)."""
    rate: Annotated[float, arg(metavar="FACTOR")] = 1.0
    """Speed of these drives: at 4, an hour of laps takes a quarter of one, and more frames are late (live)."""
    rooms: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder with measured/S1R01.flac to S1R25.flac, impulse responses of a room (sources)."""
    trials: Annotated[int, arg(metavar="N")] = 12
    """Number of trials of each condition in the one room (sources)."""
    kills: Annotated[int, arg(metavar="N")] = 40
    """How many live maps are killed at a random moment; those in --out are not repeated (live)."""
    ends: bool = True
    """Do not compare a drive's end with the build, nor drive as fast as the map takes it (live)."""
    indexing: Annotated[Indexing, OmitArgPrefixes] = field(default_factory=Indexing)
    """Options of the suites indexing, objects and navigation."""
    navigation: Annotated[Navigation, OmitArgPrefixes] = field(default_factory=Navigation)
    """Options of the suite navigation."""

    def run(self) -> None:
        """Measure, write the tables, print them."""
        from avlmaps_sim.bench.suites import SuiteInputs, run_suite

        indexing = self.indexing_settings() if self.suite in ("indexing", "found", "rooms", "objects") else None
        navigation = self.navigation_settings() if self.suite == "navigation" else None
        change = self.change_settings() if self.suite == "change" else None
        scenes = () if indexing or navigation or change or self.suite == "sources" else tuple(map(Path, self.scenes))
        models = self.models_chosen
        inputs = SuiteInputs(
            self.sounds, self.clips, scenes, self.nyuv2, self.profile, models, self.seed, indexing, navigation,
            change, self.live_settings() if self.suite == "live" else None,
            self.sources_settings() if self.suite == "sources" else None, self.indexing.frames,
        )  # fmt: skip
        answer = run_suite(self.suite, inputs, self.out)
        lines: list[str] = []
        for name, table in answer["tables"].items():
            lines += [name, *["  " + line for line in table_lines(table["columns"], table["rows"])]]
        emit(answer, [*lines, f"wrote {self.out}"], self.json)

    @property
    def models_chosen(self) -> tuple[str, ...]:
        """The words of all --model."""
        return tuple(word for words in self.model for word in words)

    def _of_all_scenes(self) -> dict[str, Any]:
        chosen = self.indexing
        return {
            "profile": self.profile, "models": self.models_chosen, "hearing": chosen.hearing, "sounds": self.sounds,
            "clips": chosen.sound_clips, "sensor": chosen.sensor, "frames": chosen.frames, "jobs": chosen.jobs,
            "seed": self.seed,
        }  # fmt: skip

    def indexing_settings(self) -> "IndexingSettings":
        """Return the settings of the suites indexing and objects."""
        from avlmaps_sim.bench.indexing.runs import DEFAULT_SCENES, PAPER_SIZES, IndexingSettings

        chosen = self.indexing
        return IndexingSettings(
            scenes=self.scenes or DEFAULT_SCENES,
            rules=chosen.rules,
            tasks_a_scene=chosen.tasks_a_scene,
            sizes=PAPER_SIZES if chosen.size == "paper" else None,
            load=chosen.tasks,
            save=chosen.save_tasks,
            **self._of_all_scenes(),
        )

    def live_settings(self) -> "LiveBench":
        """Return the settings of the suite live."""
        from avlmaps_sim.bench.live.suite import LiveBench

        if min(self.laps, self.kills) < 0 or not self.laps + self.kills:
            raise UsageError(
                f"--laps is {self.laps} and --kills {self.kills}; choose 0 or more, and 1 or more of one of them."
            )
        if not self.rate > 0.0:
            raise UsageError(f"--rate is {self.rate:g}; choose a positive number.")
        return LiveBench(self.laps, self.kills, self.rate, self.ends)

    def sources_settings(self) -> "SourcesBench":
        """Return the settings of the suite sources."""
        from avlmaps_sim.bench.sources.suite import HOMES, SourcesBench

        if self.trials < 0:
            raise UsageError(f"--trials takes a number of 0 or more, not {self.trials}.")
        return SourcesBench(self.scenes or HOMES, self.rooms, self.trials, self.indexing.jobs, self.sounds)

    def change_settings(self) -> "tuple[SceneSettings, int]":
        """Return the settings of the suite change, and the number of days."""
        from avlmaps_sim.bench.change.suite import DAYS, SCENES
        from avlmaps_sim.bench.harness.settings import SceneSettings

        days = DAYS if self.days is None else self.days
        if days < 2:
            raise UsageError(f"--days takes a number from 2 on, not {days}.")
        return SceneSettings(scenes=self.scenes or SCENES, sources=3, ambiguous=0, **self._of_all_scenes()), days

    def navigation_settings(self) -> "NavigationSettings":
        """Return the settings of the suite navigation."""
        from avlmaps_sim.bench.navigation.missions import DEFAULT_SCENES, NavigationSettings, Series

        chosen, scenes = self.navigation, self.indexing
        return NavigationSettings(
            scenes=self.scenes or DEFAULT_SCENES,
            series=tuple(map(Series, chosen.series)) or tuple(Series),
            rules=scenes.rules,
            sequences=chosen.sequences,
            language=chosen.language,
            guess=chosen.guess,
            load=scenes.tasks,
            save=scenes.save_tasks,
            **self._of_all_scenes(),
        )
