"""The verbs. Each field's docstring is its help; heavy imports happen when a verb runs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from tyro.conf import Positional, UseAppendAction, arg

from avlmaps.cli.output import UsageError, emit, ground_lines, place, size_of, table_lines
from avlmaps.cli.verb import ModelVerb, Verb

# Further names of a sound are shown from this score on.
_LIKELY = 0.1


@dataclass(frozen=True, kw_only=True)
class Demo(Verb):
    """Drive through a home, hear it, map it, ask it: the whole system in one command, with a report.html."""

    compiles: ClassVar[bool] = True

    out: Path = Path("demo_out")
    """Folder for the recording, the map, the pictures and report.html."""
    seed: int = 0
    """Another seed takes another home, another drive, other sounds and questions."""

    def run(self) -> None:
        """Run the demonstration."""
        from avlmaps.demo import run_demo

        report = run_demo(self.out, seed=self.seed)
        emit(report.to_json(), report.lines(), self.json)


@dataclass(frozen=True, kw_only=True)
class Record(Verb):
    """Drive a simulated robot through a building and record what it sees and hears, with the truth beside it.

    The same scene, settings and seed give the same bytes. Example:

    avlmaps record --scene house:7 --out REC --hearing acoustic
    """

    compiles: ClassVar[bool] = True

    scene: str
    """house:SEED or office:SEED, made by rule, or a file: .glb, or Matterport3D's .glb with its _semantic.ply."""
    out: Path
    """Where the recording goes (our folder format)."""
    sounds: Path | None = None
    """Folder of sound files, as `avlmaps add-sounds` reads it. Default: sounds made by rule."""
    category: tuple[str, ...] = ()
    """Only sounds of these categories. Default: all that homes make."""
    sources: int | None = None
    """How many sounds are heard. Default: one for every 12 seconds of the walk, as far as there is room."""
    ambiguous: int = 0
    """How many kinds of sound are heard in two places."""
    hearing: Literal["overlay", "acoustic", "none"] = "overlay"
    """overlay: dry clips, as the paper mixed them; acoustic: distance, walls and reverberation follow the building."""
    sensor: Literal["clean", "kinect", "realsense"] = "clean"
    """Whose faults colour and depth have."""
    drift: bool = False
    """Let the poses stray as odometry does; true_poses.csv keeps the true ones."""
    seed: int = 0
    """Another seed drives another way and hears other sounds."""
    size: Annotated[str, arg(metavar="WxH")] = "320x240"
    """Columns and rows of the pictures."""
    fov_deg: float = 63.0
    """Horizontal field of view, degrees."""
    fps: float = 10.0
    """Frames a second."""
    max_frames: int | None = None
    """Keep so many frames of a longer walk, evenly."""
    semantic: bool = False
    """Write which object each pixel shows into semantic/ as well (16-bit PNG: instance + 1, 0 for nothing)."""
    colour: Literal["png", "jpg"] = "png"
    """File type of the colour pictures; jpg takes a tenth of the space."""
    workers: int = 0
    """Processes that draw. Default: as many as there are cores."""

    def run(self) -> None:
        """Record."""
        from avlmaps.cli.running import record

        answer = record(self)
        rows = [
            (f"{e['onset_s']:.2f}", f"{e['offset_s']:.2f}", e["category"], place(e["source"]), e["object"] or "-")
            for e in answer["events"]
        ]
        lines = table_lines(("onset_s", "offset_s", "category", "sounds at", "made by"), rows) if rows else []
        said = f"wrote {self.out}: {answer['frames']} frames, {answer['duration_s']:.1f} s"
        floor = answer["floor"]
        shares = ", ".join(f"{floor[f'{name}_share']:.0%} {name}" for name in ("reached", "driven", "seen"))
        lines.append(f"of {floor['walkable_m2']:.1f} m² of walkable floor: {shares}")
        emit(answer, [*lines, f"{said}, in {answer['elapsed_s']:.1f} s"], self.json)


@dataclass(frozen=True, kw_only=True)
class AddSounds(Verb):
    """Put recorded sounds into the track of a recording; events.csv tells where and when.

    Without options: as many sounds as the walk has room for, no two of them heard within 2 m of one another, as
    the paper did. In a place too small for three sounds by that rule the 2 m are counted along the walk, and where
    whole clips leave room for fewer than four, they are cut short (to 2 s at least); notes on standard error tell.
    The same seed gives the same track. Example:

    avlmaps add-sounds REC --clips sounds/ --category "dog bark" sneezing --out REC2
    """

    recording: Positional[Path]
    """A recording in any format that `avlmaps build` reads."""
    clips: Path
    """Folder of sound files: one subfolder a category, or an index.csv with the columns path and category."""
    out: Path
    """Where the new recording goes (our folder format)."""
    category: tuple[str, ...] = ()
    """Only clips of these categories. Default: all of them."""
    seed: int = 0
    """Which clips go where."""
    interval_s: Annotated[float, arg(name="interval", metavar="S")] = 2.0
    """Least silence between two sounds, seconds."""
    min_distance_m: float = 2.0
    """Least distance between the places where two sounds are heard, metres; 0 allows any."""
    loudness_db: float = -20.0
    """Loudness of each sound, dB relative to full scale (less for a clip whose peaks would be cut off)."""
    background: str | None = None
    """Background noise: white, pink, room, or a sound file."""
    snr_db: float | None = None
    """How much louder every sound is than the background, dB (20 if there is a background; white noise if only this
    is given)."""
    format: str = "auto"
    """Format of the recording."""

    def run(self) -> None:
        """Write the new recording."""
        from avlmaps.recordings.add_sounds import add_sounds
        from avlmaps.recordings.open import open_recording

        events = add_sounds(
            open_recording(self.recording, format=self.format),
            self.clips,
            self.out,
            categories=self.category or None,
            seed=self.seed,
            interval_s=self.interval_s,
            min_distance_m=self.min_distance_m,
            loudness_db=self.loudness_db,
            background=self.background,
            snr_db=self.snr_db,
        )
        rows = [(f"{e.onset_s:.2f}", f"{e.offset_s:.2f}", e.category, place(e.position)) for e in events]
        answer = {"recording": str(self.out), "sounds": len(events), "events": [e.to_json() for e in events]}
        emit(
            answer,
            [*table_lines(("onset_s", "offset_s", "category", "heard at"), rows), f"wrote {self.out}"],
            self.json,
        )


@dataclass(frozen=True, kw_only=True)
class Build(ModelVerb):
    """Build a map from a recording. A build that was stopped goes on where it ended, with the same map as result.

    Examples:
    avlmaps build REC --out kitchen.avlmap
    avlmaps build REC --out kitchen.avlmap --profile foundation --model pixels=clip-patches views=clip
    """

    compiles: ClassVar[bool] = True

    recording: Positional[Path]
    """Our folder, 7-Scenes/3DMatch, AVLMaps/VLMaps, TUM RGB-D, Replica, ScanNet, a ROS 1 or 2 bag, MCAP."""
    out: Path
    """The map's folder, by custom NAME.avlmap."""
    profile: str = "embedded"
    """Which models perceive (see `avlmaps profiles`)."""
    model: Annotated[tuple[tuple[str, ...], ...], arg(metavar="MODULE=NAME[@MODEL] ..."), UseAppendAction] = ()
    """Other backends or models than the profile's: pixels=clip-patches@openai/clip-vit-large-patch14 views=clip."""
    rules: Literal["ours", "paper"] = "ours"
    """Rules of mapping: ours, or the paper's with any models (docs/paper-models.md)."""
    batch: int | None = None
    """Frames that go through a large model at once. Default: AVLMAPS_BATCH, or as the model likes (1 on a CPU)."""
    feature_cache: Annotated[str, arg(metavar="auto|off|DIR")] = "auto"
    """Keep features, so that another build of the same frames encodes nothing again: auto for large models in the
    user's cache folder, off, or a folder for those of every model."""
    feature_cache_gb: float = 20.0
    """Room for them, GB; what was used longest ago goes first."""
    voxel_size_m: float = 0.05
    """Edge of a voxel, metres."""
    format: str = "auto"
    """Format of the recording, where it cannot be told from its files."""
    audio: Path | None = None
    """A sound file to use in place of the recording's own track."""
    topics: tuple[str, ...] = ()
    """Topics of a ROS bag that are not to be found by type: rgb=, depth=, pose= or audio=TOPIC."""
    frame_step: int = 1
    """Fuse every n-th frame."""
    max_bad_share: float = 0.05
    """Stop when more than this share of the frames cannot be read; fewer are left out and told."""
    max_depth_m: float = 10.0
    """Ignore depth beyond this, metres."""
    camera_height_m: Annotated[float | None, arg(aliases=("--floor-height",), metavar="METRES")] = None
    """Height of the depth camera over the floor in the first frame, metres. Default: found from the frames; give it
    where `build` reports the floor with a low confidence."""
    sensor: Literal["auto", "kinect", "realsense", "perfect", "none"] = "auto"
    """Depth camera: its error decides which depths are used. auto measures it; none uses all, as the paper does."""
    resume: bool = False
    """Go on with a stopped build. This is what happens anyway; the flag is for scripts that say so."""
    fresh: bool = False
    """Begin anew, whatever a stopped build had finished."""
    overwrite: bool = False
    """Replace a finished map at --out that was built from something else."""
    seed: int = 0
    """Seed of what is drawn at random (visual words, RANSAC)."""

    def run(self) -> None:
        """Build the map."""
        from avlmaps.cli.running import build

        answer = build(self)
        emit(answer, info_lines(answer), self.json)


@dataclass(frozen=True, kw_only=True)
class Info(Verb):
    """Tell what is in a recording or a map, and every fault that is found in it."""

    path: Positional[Path]
    """A recording or a map."""
    format: str = "auto"
    """Format of the recording, where it cannot be told from its files."""
    verify: bool = False
    """Check every file of a map against its checksum, or every picture of a recording."""
    repair: bool = False
    """Check every file of a map, and build the damaged ones again from --recording."""
    recording: Path | None = None
    """The recording that the map was built from, for --repair."""
    audio: Path | None = None
    """The sound file that the map was built with, if it was given to `build --audio`; for --repair."""
    plot: Path | None = None
    """Draw the map from above, with the walk and the sounds, into this picture."""

    def run(self) -> None:
        """Describe it."""
        from avlmaps.cli.running import describe_path, repair

        if self.recording is not None and not self.repair:
            raise UsageError("--recording belongs to --repair.")
        repaired = repair(self) if self.repair else {}
        answer = describe_path(self.path, self.format, verify=self.verify, plot=self.plot) | repaired
        emit(answer, info_lines(answer), self.json)


@dataclass(frozen=True, kw_only=True)
class Query(ModelVerb):
    """Ask a map, in a sentence or part by part; the parts are fused into one heatmap.

    Examples:
    avlmaps query MAP "the red cabinet near the sound of a dog barking"
    avlmaps query MAP --object "red cabinet" --sound-clip bark.ogg --plot heat.png
    """

    compiles: ClassVar[bool] = True

    map: Positional[Path]
    """The map."""
    sentence: Positional[str] = ""
    """What is asked, in words; or leave it out and name the parts."""
    object: str | None = None
    """The object."""
    sound: str | None = None
    """The sound, in words."""
    sound_clip: Path | None = None
    """The sound, as a recording of one like it."""
    area: str | None = None
    """The area: a room, a part of the building."""
    image: Path | None = None
    """A photo taken there."""
    intrinsics: str | None = None
    """Intrinsics of the photo's camera, fx,fy,cx,cy in pixels. Default: the map's own colour camera."""
    primary: Literal["object", "sound", "image", "area"] | None = None
    """Which part is the goal itself; the others say where it is. Default: the first of object, image, sound, area."""
    rules: Literal["ours", "paper"] = "ours"
    """Rules of scores and heat: ours, or the paper's with any models (docs/paper-models.md)."""
    top: int = 3
    """How many goals to tell."""
    plot: Path | None = None
    """Draw the heat of each part and of the whole, with the goals numbered, into this picture."""

    def run(self) -> None:
        """Ask."""
        from avlmaps.cli.running import ask

        answer = ask(self)
        emit(answer, query_lines(answer), self.json)


@dataclass(frozen=True, kw_only=True)
class Locate(ModelVerb):
    """Tell where a photo was taken: the 6-DoF pose of its camera in the map, or that it was not taken there."""

    compiles: ClassVar[bool] = True

    map: Positional[Path]
    """The map."""
    image: Positional[Path]
    """The photo."""
    intrinsics: str | None = None
    """Intrinsics of the photo's camera, fx,fy,cx,cy in pixels. Default: the map's own colour camera."""

    def run(self) -> None:
        """Locate the photo."""
        from avlmaps.cli.running import locate_photo

        answer = locate_photo(self.map, self.image, self.intrinsics)
        emit(answer, locate_lines(answer), self.json)


@dataclass(frozen=True, kw_only=True)
class TeachSound(Verb):
    """Teach a new kind of sound from a few clips of it; it is kept in your own profile folder.

    Example: avlmaps teach-sound "our doorbell" bell1.wav bell2.wav bell3.wav
    """

    name: Positional[str]
    """What you will call it in a query."""
    clips: Positional[tuple[Path, ...]] = ()
    """Sound files, three or more for preference."""
    forget: bool = False
    """Forget the sound of this name."""

    def run(self) -> None:
        """Teach or forget."""
        from avlmaps.cli.running import teach

        if bool(self.clips) == self.forget:
            raise UsageError("teach-sound takes clips to learn from, or --forget, and not both.")
        answer = teach(self.name, self.clips)
        emit(answer, [f"{key}: {value}" for key, value in answer.items()], self.json)


def info_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `build` and `info` report; entries without a layout of their own are printed as they are."""
    lines: list[str] = []
    for key, value in answer.items():
        if value in (None, [], {}) and key != "sounds":
            continue
        if key in _LAYOUTS:
            lines += _LAYOUTS[key](value)
        elif isinstance(value, list) and isinstance(value[0], str):
            lines += [f"{key}:", *[f"  {line}" for line in value]]
        else:
            lines.append(f"{key.replace('_', ' ')}: {f'{value:.6g}' if isinstance(value, float) else value}")
    return lines


def _sound_lines(sounds: list[dict[str, Any]]) -> list[str]:
    rows = [f"  {s['onset_s']:8.2f} - {s['offset_s']:.2f} s at {place(s['position'])}{_names_of(s)}" for s in sounds]
    return [f"sounds: {len(sounds)}", *rows]


# How the entries of `info` are laid out, where a plain line would not do.
_LAYOUTS: dict[str, Callable[[Any], list[str]]] = {
    "sounds": _sound_lines,
    "topics": lambda topics: ["topics:", *[f"  {use}: {topic}" for use, topic in topics.items()]],
    "plot": lambda path: [f"wrote {path}"],
    "ground": ground_lines,
    "bytes": lambda count: [f"size: {size_of(count)}"],
    "voxels_removed": lambda removed: [
        "voxels removed: " + ", ".join(f"{count} {why.replace('_', ' ')}" for why, count in removed.items())
    ],
    "level_from_recording": lambda rows: [
        "level from recording:", *["  " + " ".join(f"{value:7.4f}" for value in row) for row in rows]
    ],
}  # fmt: skip


def _names_of(sound: dict[str, Any]) -> str:
    """Lay out the best names of a sound; those that are hardly likely only where there is no better one."""
    names = list(zip(sound.get("names", []), sound.get("confidences", []), strict=True))
    shown = [pair for pair in names if pair[1] >= _LIKELY] or names[:1]
    return ": " + ", ".join(f"{name} {confidence:.2f}" for name, confidence in shown) if shown else ""


def query_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `query` tells."""
    asked = ", ".join(f"{part['modality']} {part['query']!r} ({part['role']})" for part in answer["parts"])
    lines = [f"asked: {asked}"]
    lines += [f"note: {part['note']}" for part in answer["parts"] if part.get("note")]
    rows = [
        (i, place(goal["position"]), f"{goal['score']:.2f}", " x ".join(f"{side:.2f}" for side in goal["size"]))
        for i, goal in enumerate(answer["goals"], start=1)
    ]
    lines += [f"note: {note}" for note in answer.get("notes", [])]
    lines += [f"count: {answer['count']}"] if "count" in answer else []
    lines.append("found" if answer["found"] else "not found here" + (": the best guesses are" if rows else ""))
    lines += table_lines(("", f"place ({answer['frame']} frame)", "score", "size in m"), rows) if rows else []
    return [*lines, f"wrote {answer['plot']}"] if "plot" in answer else lines


def locate_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `locate` tells."""
    pose = answer["world_from_camera"]
    if pose is None:
        return [f"not located: {answer['inliers']} points agree, too few to tell a place"]
    rows = ["  " + " ".join(f"{value:9.4f}" for value in row) for row in pose]
    return [f"located, {answer['inliers']} points agree; world_from_camera (frame: {answer['frame']}):", *rows]
