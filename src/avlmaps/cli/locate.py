"""`avlmaps locate`: find the camera pose of a photo."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit
from avlmaps.cli.verb import MapVerb
from avlmaps.core.frames import FrameName
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from avlmaps.core.camera import Pinhole
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.schema import LocateAnswer


@dataclass(frozen=True, kw_only=True)
class Locate(MapVerb):
    """Find the 6-DoF pose of a photo's camera in the map, or report that the photo cannot be located.

    Example: avlmaps locate home.avlmap photo.jpg
    """

    image: Annotated[Positional[Path], arg(metavar="PHOTO")]
    """Photo to locate."""
    intrinsics: Annotated[str | None, arg(metavar="FX,FY,CX,CY")] = None
    """Intrinsics of the photo's camera, fx,fy,cx,cy in pixels. Default: by its EXIF, else the map's own colour camera,
    with another focal length where that fits clearly better."""
    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the pose: the recording's own, or the level one (z up)."""

    def run(self) -> None:
        """Locate the photo."""
        answer = locate_photo(self.map, self.image, self.intrinsics, frame=FrameName(self.frame))
        emit(answer, locate_lines(answer), self.json)


def locate_photo(
    map_path: Path,
    picture: Path,
    intrinsics: str | None,
    opened: "AVLMap | None" = None,
    frame: FrameName = FrameName.RECORDING,
) -> "LocateAnswer":
    """Locate a photo."""
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.focal import focal_35mm_of
    from avlmaps.query.frames import answer_in
    from avlmaps.query.modalities.image import read_picture
    from avlmaps.query.schema import locate_answer

    rgb = read_picture(picture)
    given = None if intrinsics is None else camera_of(intrinsics, rgb.shape[1], rgb.shape[0])
    opened = AVLMap.open(map_path) if opened is None else opened
    found = opened.locate(rgb, given, None if given is not None else focal_35mm_of(picture))
    pose, camera = found.world_from_camera, found.camera
    if pose is not None and given is not None and camera != given:
        say(f"note: the focal length {given.fx:g} does not fit the photo; {camera.fx:.1f} was used.")
    return answer_in(locate_answer(found, opened.stored.info.doubts), frame, opened.space.level_from_recording)


def camera_of(intrinsics: str, width: int, height: int) -> "Pinhole":
    """Read ``fx,fy,cx,cy`` in pixels for a picture of this size."""
    from avlmaps.core.camera import Pinhole

    return Pinhole(*numbers_of(intrinsics), width=width, height=height)


def numbers_of(intrinsics: str) -> tuple[float, float, float, float]:
    """Read ``fx,fy,cx,cy`` in pixels."""
    from avlmaps.core.camera import Pinhole

    try:
        fx, fy, cx, cy = (float(word) for word in intrinsics.split(","))
        Pinhole(fx, fy, cx, cy, width=1, height=1)  # no camera has a focal length of 0, or NaN
    except ValueError:
        raise UsageError(
            f"--intrinsics takes fx,fy,cx,cy in pixels, such as 525,525,320,240; not {intrinsics!r}."
        ) from None
    return fx, fy, cx, cy


def locate_lines(answer: "LocateAnswer") -> list[str]:
    """Lay out the answer of `locate`."""
    pose, notes = answer["world_from_camera"], [f"note: {note}" for note in answer.get("notes", [])]
    if pose is None:
        few = f"not located: {answer['inliers']} points agree, too few to fix a place"
        return [*notes, few]
    rows = ["  " + " ".join(f"{value:9.4f}" for value in row) for row in pose]
    return [*notes, f"located, {answer['inliers']} points agree; world_from_camera (frame: {answer['frame']}):", *rows]
