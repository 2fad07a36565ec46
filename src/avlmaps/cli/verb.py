"""The options of every verb, of every verb that runs models or opens a recording, and what verbs of a map share."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Optional

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit
from avlmaps.core.poses import FrameName

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.corrections import Corrections


# The parser checks the default of a `str | None` with a package that takes longer to load than a question to answer;
# it knows these itself.
OptionalText = Optional[str]  # noqa: UP045
OptionalPath = Optional[Path]  # noqa: UP045


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

    def opened(self) -> "AVLMap":
        """Return the map."""
        from avlmaps.query.avlmap import AVLMap

        return AVLMap.open(self.map)

    def answer(self, avlmap: "AVLMap") -> Mapping[str, Any]:
        """Return the answer of an open map, as JSON has it."""
        raise NotImplementedError

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        """Lay out an answer for a person."""
        raise NotImplementedError


def shown_in(answer: Mapping[str, Any], frame: str, avlmap: "AVLMap") -> dict[str, Any]:
    """Return an answer with its places in a frame."""
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
        """Return the value behind them.

        Raises:
            UsageError: one of them is not of its form.
            RecordingError: one of them is not possible.
        """
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
        return Corrections(
            depth_unit_m=self.depth_unit,
            intrinsics=tuple(cameras),
            poses=tuple(map(PoseKind, self.poses)),
            camera_axes=self.camera_axes,
            pose_delay_s=self.pose_delay,
            up_in_world=None if self.up is None else _direction(self.up),
        )


def topics_of(words: tuple[str, ...]) -> dict[str, str]:
    """Return what ``--topics`` says: names by what they are for.

    Raises:
        UsageError: a word is not of its form.
    """
    for word in words:
        if not all(word.partition("=")):
            raise UsageError(f"--topics takes words like rgb=/camera/color/image_raw, not {word!r}.")
    return dict(word.split("=", 1) for word in words)


def _direction(words: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in words.split(","))
    except ValueError:
        raise UsageError(f"--up takes x,y,z, such as 0,0,1; not {words!r}.") from None
    return x, y, z
