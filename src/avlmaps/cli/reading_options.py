"""The options of every verb that opens a recording: what someone knows better than its files."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import arg

from avlmaps.cli.output import UsageError

if TYPE_CHECKING:
    from avlmaps.recordings.corrections import Corrections


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
