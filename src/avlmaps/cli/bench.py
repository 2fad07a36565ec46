"""`avlmaps bench`: the quality figures, as JSON, Markdown and a picture."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tyro.conf import OmitArgPrefixes, Positional

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verb import ModelVerb

if TYPE_CHECKING:
    from avlmaps.bench.indexing import IndexingSettings
    from avlmaps.bench.navigation import NavigationSettings

Suite = Literal["words", "language", "sounds", "segmentation", "locate", "frames", "objects", "indexing", "navigation"]
Series = Literal["sounds-1", "sounds-2", "sounds-3", "images", "pairs", "commands", "spatial"]


@dataclass(frozen=True, kw_only=True)
class Indexing:
    """How the suites indexing, objects and navigation make, record and ask their scenes."""

    hearing: Literal["overlay", "acoustic"] = "overlay"
    """How sounds reach the microphone: mixed in as the paper did, or through rooms and doorways."""
    sensor: Literal["clean", "kinect", "realsense"] = "clean"
    """Whose faults colour and depth have."""
    frames: int = 600
    """At most so many frames a scene."""
    tasks_a_scene: int = 20
    """At most so many tasks a scene and table (indexing)."""
    jobs: int = 0
    """Scenes side by side; 0 takes as many as there are cores."""
    tasks: Path | None = None
    """Ask the tasks (or run the missions) of this file instead of making some."""
    save_tasks: Path | None = None
    """Write the tasks (or missions) and their truth into this file."""


@dataclass(frozen=True, kw_only=True)
class Navigation:
    """What robots are told in the suite navigation."""

    sequences: int = 200
    """Sequences of four sounds (at each range), and of an image and two objects; pairs are 119 for each 200."""
    series: tuple[Series, ...] = ()
    """Which experiments; all by default."""
    language: Literal["rules", "chat", "none"] = "rules"
    """What turns sentences into programs; none gives robots the programs themselves."""
    guess: bool = True
    """Let robots go to the best guess where the map is not sure, as the paper's always do."""


@dataclass(frozen=True, kw_only=True)
class Bench(ModelVerb):
    """Measure how good the parts are, with counts and 95 % intervals.

    words: household phrases kept out of training; needs nothing.
    language: commands and questions that strangers wrote; needs nothing.
    sounds, segmentation: need --sounds, a folder of clips with an index.csv.
    locate: needs --scenes, recordings with poses; half of the frames become the map, the others are asked.
    frames: needs --nyuv2, labelled frames in the layout of NYU Depth V2; kinds of pixels, without any map.
    objects: are things where the map says, in the same scenes as indexing, whose maps it shares.
    indexing: objects told apart by sounds, photos and areas, in twelve held-out homes or in --scenes by name.
    navigation: robots sent from sentence to place, in twelve held-out homes or in --scenes by name.
    """

    compiles: ClassVar[bool] = True

    suite: Positional[Suite]
    """What to measure."""
    sounds: Path | None = None
    """Folder of sound clips with an index.csv (path, category, fold)."""
    clips: Path | None = None
    """Folder of clips with an index.csv: asks for each by name, dry and in simulated rooms (sounds)."""
    scenes: tuple[str, ...] = ()
    """Recordings with poses (locate); names of scenes such as house:1000000:held-out (the others)."""
    nyuv2: Path | None = None
    """Folder of labelled frames (frames.csv, NNNN.color.jpg, NNNN.depth8.png, NNNN.label.png)."""
    profile: str = "embedded"
    """Which models are measured."""
    out: Path = Path("bench_out")
    """Folder for SUITE.json, SUITE.md, SUITE.png and a CSV file for each table."""
    seed: int = 0
    """Seed of what is drawn at random."""
    indexing: Annotated[Indexing, OmitArgPrefixes] = field(default_factory=Indexing)
    """Of the suites indexing, objects and navigation."""
    navigation: Annotated[Navigation, OmitArgPrefixes] = field(default_factory=Navigation)
    """Of the suite navigation."""

    def run(self) -> None:
        """Measure, write the tables, print them."""
        from avlmaps.bench.suites import Asked, run_suite

        indexing = self.indexing_settings() if self.suite in ("indexing", "objects") else None
        navigation = self.navigation_settings() if self.suite == "navigation" else None
        scenes = () if indexing or navigation else tuple(map(Path, self.scenes))
        asked = Asked(self.sounds, self.clips, scenes, self.nyuv2, self.profile, self.seed, indexing, navigation)
        answer = run_suite(self.suite, asked, self.out)
        lines: list[str] = []
        for name, table in answer["tables"].items():
            lines += [name, *["  " + line for line in table_lines(table["columns"], table["rows"])]]
        emit(answer, [*lines, f"wrote {self.out}"], self.json)

    def indexing_settings(self) -> "IndexingSettings":
        """Return what the suite indexing is run on."""
        from avlmaps.bench.indexing import DEFAULT_SCENES, IndexingSettings

        chosen = self.indexing
        return IndexingSettings(
            scenes=self.scenes or DEFAULT_SCENES,
            profile=self.profile,
            hearing=chosen.hearing,
            sounds=self.sounds,
            sensor=chosen.sensor,
            frames=chosen.frames,
            tasks_a_scene=chosen.tasks_a_scene,
            jobs=chosen.jobs,
            seed=self.seed,
            load=chosen.tasks,
            save=chosen.save_tasks,
        )

    def navigation_settings(self) -> "NavigationSettings":
        """Return what the suite navigation is run on."""
        from avlmaps.bench import navigation

        chosen, scenes = self.navigation, self.indexing
        return navigation.NavigationSettings(
            scenes=self.scenes or navigation.DEFAULT_SCENES,
            series=tuple(map(navigation.Series, chosen.series)) or tuple(navigation.Series),
            profile=self.profile,
            hearing=scenes.hearing,
            sounds=self.sounds,
            sensor=scenes.sensor,
            frames=scenes.frames,
            sequences=chosen.sequences,
            language=chosen.language,
            guess=chosen.guess,
            jobs=scenes.jobs,
            seed=self.seed,
            load=scenes.tasks,
            save=scenes.save_tasks,
        )
