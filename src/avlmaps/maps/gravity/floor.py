"""The floors under a walk, so that encoders may know how high over the floor a pixel lies.

Level surfaces that face up are counted by height. The floor under a camera is the lowest such height, within a
storey below it, that holds a fair share of what is level there: table tops hold as much, but never lie lowest.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from avlmaps.core.poses import apply
from avlmaps.maps.gravity.up import MAX_DEPTH_M, NEAR_RAD
from avlmaps.recordings.subset import Subset
from avlmaps.recordings.types import Frame, Ground, Recording

BIN_M = 0.02
# A storey: the floor is looked for between so far and so little below the camera.
DEEPEST_M, HIGHEST_M = 2.6, 0.25
FAIR_SHARE = 0.08
# Where no floor is in view the camera is taken to be held as people and robots mostly do.
USUAL_HEIGHT_M = 1.3
_STEP_PIXELS = 5  # of a picture 320 wide


def find_ground(frames: Iterable[Frame], up_in_world: Float[np.ndarray, "3"]) -> Ground:
    """Find the floors that a recording's cameras stood over.

    Args:
        frames: spread over the recording; one after the other is held in memory.
        up_in_world: unit vector.

    Returns:
        For the height of each frame's camera the height of the floor under it, along up.
    """
    cameras, heights = [], []
    for frame in frames:
        cameras.append(float(frame.world_from_camera[:3, 3] @ up_in_world))
        heights.append(_level_heights(frame, up_in_world))
    every = np.concatenate(heights) if heights else np.zeros(0)
    camera = np.sort(np.array(cameras)) if cameras else np.zeros(1)
    return Ground(
        up_in_world=np.asarray(up_in_world, np.float64),
        camera_m=camera,
        floor_m=np.array([_floor_under(height, every) for height in camera]),
    )


def _floor_under(camera_m: float, heights: Float[np.ndarray, " n"]) -> float:
    lowest = camera_m - DEEPEST_M
    below = heights[(heights > lowest) & (heights < camera_m - HIGHEST_M)]
    if len(below) < 50:
        return camera_m - USUAL_HEIGHT_M
    count = np.bincount(np.floor((below - lowest) / BIN_M).astype(int))
    # A floor is hit within a few centimetres; so wide a window counts as one height.
    smooth = np.convolve(count, np.ones(3), "same")
    fair = np.flatnonzero((smooth >= FAIR_SHARE * count.sum()) & (smooth >= 0.15 * smooth.max()))
    first = int(fair[0]) if len(fair) else int(smooth.argmax())
    peak = first + int(np.argmax(smooth[first : first + 4]))
    near = below[np.abs(below - (lowest + (peak + 0.5) * BIN_M)) < 2 * BIN_M]
    return float(np.median(near))


def _level_heights(frame: Frame, up: Float[np.ndarray, "3"]) -> Float[np.ndarray, " n"]:
    """Return the heights along up of a grid of places on level surfaces that face up."""
    camera = frame.rig.depth
    step = max(1, round(_STEP_PIXELS * camera.width / 320))
    depth = np.where(np.isfinite(frame.depth_m) & (frame.depth_m < MAX_DEPTH_M), frame.depth_m, 0.0)
    points = camera.backproject(depth.astype(np.float64))[::step, ::step]
    z = points[..., 2]
    middle, right, below = z[:-1, :-1], z[:-1, 1:], z[1:, :-1]
    smooth = (middle > 0) & (right > 0) & (below > 0)
    smooth &= (np.abs(right - middle) < 0.1 * middle) & (np.abs(below - middle) < 0.1 * middle)
    normal = np.cross(points[1:, :-1] - points[:-1, :-1], points[:-1, 1:] - points[:-1, :-1])[smooth]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    up_in_camera = frame.world_from_camera[:3, :3].T @ up
    level = normal @ up_in_camera > np.cos(1.5 * NEAR_RAD)
    return apply(frame.world_from_camera, points[:-1, :-1][smooth][level]) @ up


class GroundedRecording(Subset):
    """A whole recording whose frames know which way is up and where the floor is."""

    def __init__(self, whole: Recording, ground: Ground) -> None:
        """Put a recording on its ground."""
        super().__init__(whole, range(len(whole)))
        self.ground = ground

    def frame(self, index: int) -> Frame:
        """Read one frame and tell it the ground."""
        return replace(self.whole.frame(index), ground=self.ground)

    @cached_property
    def fingerprint(self) -> str:
        """The recording's own: the ground follows from it."""
        return self.whole.fingerprint
