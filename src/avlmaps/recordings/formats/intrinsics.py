"""Cameras that do not quite fit their pictures: focus that wanders, pictures that were resized."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError

# A focal length that wanders by more than this share is worth a notice.
_WANDERS = 0.01


def median_camera(
    file: Path, fx_fy_cx_cy: Float[np.ndarray, "n 4"], width: int, height: int
) -> tuple[Pinhole, tuple[str, ...]]:
    """Return the camera that stands for all frames', and a notice where they differ much.

    Raises:
        RecordingError: the numbers are of no camera.
    """
    try:
        fx, fy, cx, cy = (float(value) for value in np.median(fx_fy_cx_cy, axis=0))
        camera = Pinhole(fx, fy, cx, cy, width, height)
    except ValueError as error:
        raise RecordingError(f"{file} holds no camera: {error}; fix the file.") from None
    low, high = float(fx_fy_cx_cy[:, 0].min()), float(fx_fy_cx_cy[:, 0].max())
    if high > low * (1.0 + _WANDERS):
        return camera, (f"The focal length wanders between {low:.1f} and {high:.1f} pixels; {fx:.1f} is used for all.",)
    return camera, ()


def fitted(camera: Pinhole, size: tuple[int, int], file: Path, what: str) -> Pinhole:
    """Return the camera at the size (width, height) that the pictures have.

    Args:
        camera: as the file says.
        size: (width, height) of the pictures.
        file: the file of the intrinsics.
        what: which pictures, for the sentence.

    Raises:
        RecordingError: the pictures have another shape, so that they were cropped or turned.
    """
    width, height = size
    if abs(width * camera.height - height * camera.width) > max(width, height, camera.width, camera.height):
        raise RecordingError(
            f"{file} is of pictures of {camera.width}x{camera.height}, but the {what} pictures are {width}x{height}, "
            "of another shape: were they cropped or turned? Give the intrinsics of these pictures."
        )
    return camera.resized(width, height)


def resized_notice(camera: Pinhole, size: tuple[int, int]) -> tuple[str, ...]:
    """Return a notice where pictures have another size than their intrinsics, or nothing."""
    if size == (camera.width, camera.height):
        return ()
    return (
        f"The pictures are {size[0]}x{size[1]}; the intrinsics of {camera.width}x{camera.height} are scaled to them.",
    )
