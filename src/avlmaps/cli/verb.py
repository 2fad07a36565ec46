"""The options of every verb, of every verb that runs models or opens a recording, and what verbs of a map share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Optional, get_type_hints

from msgspec import Meta
from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from avlmaps.cli.output import UsageError, emit

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from avlmaps.perception.encoders import Encoders
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.settings import QuerySettings
    from avlmaps.recordings.corrections import Corrections


# The parser checks the default of a `str | None` with a package that takes longer to load than a question to answer;
# it knows these itself.
OptionalText = Optional[str]  # noqa: UP045
OptionalPath = Optional[Path]  # noqa: UP045
SHARE, COUNT, SIZE = Meta(ge=0.0, le=1.0), Meta(ge=1), Meta(gt=0.0)
PORT = Meta(ge=0, le=65535)


@dataclass(frozen=True, kw_only=True)
class Verb:
    """Options of every verb."""

    json: bool = False
    """Print one JSON object on standard output, and nothing else there."""

    compiles: ClassVar[bool] = False
    """Whether it runs compiled loops, which the first run on a machine compiles."""

    def run(self) -> None:
        """Do it."""
        raise NotImplementedError

    def require_bounds(self) -> None:
        """Refuse a number outside the bounds that stand beside its option."""
        for name, bounds in _bounds_of(type(self)):
            given = getattr(self, name)
            for value in given if isinstance(given, tuple) else () if given is None else (given,):
                _require_within(f"--{name.replace('_', '-')}", value, bounds)


@cache
def _bounds_of(verb: type[Verb]) -> tuple[tuple[str, Meta], ...]:
    hints = get_type_hints(verb, include_extras=True)
    return tuple(
        (name, note)
        for name, kind in hints.items()
        for note in getattr(kind, "__metadata__", ())
        if isinstance(note, Meta)
    )


def _require_within(option: str, value: float, bounds: Meta) -> None:
    low, over, high = bounds.ge, bounds.gt, bounds.le
    if (low is None or value >= low) and (over is None or value > over) and (high is None or value <= high):
        return
    least = f"over {over:g}" if low is None else f"from {low:g} on" if high is None else f"from {low:g}"
    most = "" if high is None else f" to {high:g}"
    raise UsageError(f"{option} takes a number {least}{most}, not {value:g}.")


def idle(options: "DataclassInstance", names: Sequence[str], why: str) -> list[str]:
    """Return a note for each option that was given and has no effect."""
    defaults = {each.name: each.default for each in fields(options)}
    given = [name for name in names if getattr(options, name) != defaults[name]]
    return [f"--{name.replace('_', '-')} has no effect: {why}." for name in given]


@dataclass(frozen=True, kw_only=True)
class ModelVerb(Verb):
    """Options of every verb that runs models; the small models that ship with the package ignore them."""

    models: Annotated[OptionalPath, arg(metavar="DIR")] = None
    """Folder of models, searched before the hub's cache. Default: AVLMAPS_MODELS."""
    device: Annotated[OptionalText, arg(metavar="DEVICE")] = None
    """Device of large models: auto, cpu, cuda, cuda:1, mps. Default: AVLMAPS_DEVICE, or a GPU if there is one."""
    precision: Annotated[
        Literal["auto", "float32", "float16", "bfloat16"] | None, arg(metavar="auto|float32|float16|bfloat16")
    ] = None
    """Precision of large models. Default: AVLMAPS_PRECISION, or float16 on CUDA and float32 elsewhere."""


@dataclass(frozen=True, kw_only=True)
class MapVerb(ModelVerb):
    """A verb of one map."""

    compiles: ClassVar[bool] = True

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder (NAME.avlmap)."""

    def run(self) -> None:
        """Answer, and print it."""
        answer = self.answer(self.opened())
        emit(answer, self.lines(answer), self.json)

    def settings(self) -> "QuerySettings | None":
        """Return the settings of its queries."""
        return None

    def opened(self) -> "AVLMap":
        """Return the map."""
        from avlmaps.query.avlmap import AVLMap

        return AVLMap.open(self.map, self.settings())

    def answer(self, avlmap: "AVLMap") -> Mapping[str, Any]:
        """Return the answer of an open map, as JSON has it."""
        raise NotImplementedError

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        """Lay out an answer for a person."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Asking:
    """Options of every verb that answers questions."""

    found_at: Annotated[float, SHARE, arg(metavar="PROBABILITY")] = 0.5
    """Call a query found, and drive to it, from this probability of its first goal on, 0 to 1."""
    at: Annotated[Literal["robot", "source"] | None, arg(metavar="robot|source")] = None
    """Place of a sound: where the robot was when it heard it, or its source. Default: as the words say, else robot."""

    def query_settings(self) -> "QuerySettings":
        """Return the settings behind them."""
        from avlmaps.query.settings import QuerySettings, SoundSettings

        return QuerySettings(found_at=self.found_at, sounds=SoundSettings(at=self.at))


@dataclass(frozen=True, kw_only=True)
class InFrame:
    """The option of every verb that prints places."""

    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the places: the recording's own, or the level one (z up)."""


def shown_in(answer: Mapping[str, Any], frame: str, avlmap: "AVLMap") -> dict[str, Any]:
    """Return an answer with its places in a frame."""
    from avlmaps.core.poses import FrameName
    from avlmaps.query.places import answer_in

    return dict(answer_in(answer, FrameName(frame), avlmap.space.level_from_recording))


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What you know better than the recording's files; docs/recordings.md has the same as keys of recording.json."""

    depth_unit: Annotated[float | None, arg(metavar="METRES")] = None
    """One unit of the depth as stored, metres: 0.001 for millimetres, 1 for floats in metres."""
    intrinsics: Annotated[tuple[str, ...], arg(metavar="FX,FY,CX,CY[@WxH] ...")] = ()
    """Intrinsics of colour and depth in pixels of the picture, or of a picture of W x H; twice (colour, depth) where
    depth has a camera of its own."""
    poses: Annotated[
        tuple[Literal["world-from-camera", "camera-from-world", "wxyz"], ...],
        arg(metavar="world-from-camera|camera-from-world|wxyz"),
    ] = ()
    """Meaning of the poses; wxyz: quaternions were written w first."""
    camera_axes: Annotated[str | None, arg(metavar="AXES")] = None
    """Axes of the camera that the poses are of: opencv, opengl, ros, or where x y z point, such as RDF."""
    pose_delay: Annotated[float | None, arg(metavar="SECONDS")] = None
    """Seconds by which the poses' stamps are later than the pictures'."""
    up: Annotated[str | None, arg(metavar="X,Y,Z")] = None
    """Direction against gravity in the poses' world, such as 0,0,1."""

    def corrections(self) -> "Corrections":
        """Return the value behind them, or raise ``UsageError`` where one is not of its form, or not possible."""
        from avlmaps.core.errors import RecordingError
        from avlmaps.recordings.corrections import Corrections, GivenCamera, PoseKind

        cameras: list[GivenCamera] = []
        for words in self.intrinsics:
            try:
                cameras.append(GivenCamera.parse(words))
            except ValueError:
                raise UsageError(
                    "--intrinsics takes fx,fy,cx,cy in pixels, such as 525,525,320,240 or 525,525,320,240@640x480; "
                    f"not {words!r}."
                ) from None
        try:
            return Corrections(
                depth_unit_m=self.depth_unit, intrinsics=tuple(cameras), poses=tuple(map(PoseKind, self.poses)),
                camera_axes=self.camera_axes, pose_delay_s=self.pose_delay,
                up_in_world=None if self.up is None else _direction(self.up),
            )  # fmt: skip
        except RecordingError as error:
            raise UsageError(str(error)) from None


def _direction(words: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in words.split(","))
    except ValueError:
        raise UsageError(f"--up takes x,y,z, such as 0,0,1; not {words!r}.") from None
    return x, y, z


@dataclass(frozen=True, kw_only=True)
class OfRecording:
    """Options of every verb that opens a recording: how it is read."""

    format: Annotated[str, arg(metavar="FORMAT")] = "auto"
    """Format of the recording, if its files do not show it."""
    audio: Annotated[Path | None, arg(metavar="FILE")] = None
    """Sound file to use instead of the recording's own track."""
    microphones: Annotated[Path | None, arg(metavar="FILE")] = None
    """Places of the microphones instead of the recording's own: a JSON file, as `avlmaps calibrate` writes it."""
    topics: Annotated[tuple[str, ...], arg(metavar="KIND=TOPIC ...")] = ()
    """Topics of ROS that their type does not identify: rgb=, depth=, pose= or audio=TOPIC; audio=none leaves the sound
    out; audio_pcm=16000,1 says how plain samples are coded; directions=TOPIC, azimuths that a device says of sounds;
    pose=FILE, a table of stamp tx ty tz qx qy qz qw."""
    reading: Annotated[Reading, OmitArgPrefixes] = field(default_factory=Reading)
    """What you know better than the recording's files."""

    def named_topics(self) -> dict[str, str]:
        """Return what ``--topics`` says: names by what they are for."""
        for word in self.topics:
            if not all(word.partition("=")):
                raise UsageError(f"--topics takes words like rgb=/camera/color/image_raw, not {word!r}.")
        return dict(word.split("=", 1) for word in self.topics)

    def opening(self) -> dict[str, Any]:
        """Return the arguments of ``open_recording`` behind them."""
        given = {"format": self.format, "audio": self.audio, "microphones": self.microphones}
        return {**given, "topics": self.named_topics(), "corrections": self.reading.corrections()}

    def opening_words(self) -> list[str]:
        """Return the options that were given, as another verb takes them."""
        words: list[str] = []
        for kind, options in ((OfRecording, self), (Reading, self.reading)):
            for each in fields(kind):
                given = getattr(options, each.name)
                if each.name != "reading" and given != each.default:
                    values = given if isinstance(given, tuple) else [given]
                    words += [f"--{each.name.replace('_', '-')}", *map(str, values)]
        return words


@dataclass(frozen=True, kw_only=True)
class Building(OfRecording, ModelVerb):
    """Options of every verb that makes a map."""

    compiles: ClassVar[bool] = True

    out: Annotated[Path, arg(metavar="MAP")]
    """Map folder to write, by custom NAME.avlmap."""
    profile: Annotated[str, arg(metavar="PROFILE")] = "embedded"
    """Set of models (see `avlmaps profiles`)."""
    model: Annotated[tuple[tuple[str, ...], ...], arg(metavar="MODULE=NAME[@MODEL] ..."), UseAppendAction] = ()
    """Other backends or models than the profile's: pixels=clip-patches@openai/clip-vit-large-patch14 views=clip."""
    voxel_size_m: Annotated[float, Meta(ge=0.001, le=10.0), arg(metavar="METRES")] = 0.05
    """Edge of a voxel, metres."""
    same_device: Annotated[Path | None, arg(metavar="MAP")] = None
    """Map of an earlier recording with the same device that says directions: its offset is known from there."""
    overwrite: bool = False
    """Replace a finished map at --out that was built from another recording or with other settings."""

    def encoders(self) -> "Encoders":
        """Return the encoders of the profile, with those of ``--model`` instead of some."""
        from avlmaps.perception.encoders import encoders_of, profile, read_choices

        try:
            choices = read_choices([word for words in self.model for word in words])
        except ValueError as problem:
            raise UsageError(f"--model {problem}") from None
        return encoders_of(profile(self.profile).choosing(choices))
