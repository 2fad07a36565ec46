"""A room that is all formula, seen by a camera on a short walk: what a format is tested against.

The room is 6 x 4 x 2.6 m with three boxes, z up, metres. No two walls, boxes or corners look alike, so that a picture
that is mirrored, shuffled or of other channels differs from the right one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from avlmaps.core.arrays import Float, UInt8
from avlmaps.core.camera import Pinhole, Rig

_ROOM = np.array([[0.0, 0.0, 0.0], [6.0, 4.0, 2.6]])
_BOXES = np.array([
    [[4.2, 1.2, 0.0], [5.2, 2.6, 0.75]],
    [[0.0, 3.4, 0.0], [2.0, 4.0, 0.9]],
    [[1.0, 0.0, 0.0], [1.6, 0.5, 1.8]],
])  # fmt: skip
_BOX_COLOURS = np.array([(150.0, 100.0, 60.0), (180.0, 40.0, 40.0), (60.0, 90.0, 170.0)])
_MORE_COLOUR = np.array([90.0, 70.0, 120.0])
# Walls across x, walls across y, floor, ceiling.
_ROOM_COLOURS = np.array([(205.0, 160.0, 150.0), (150.0, 200.0, 165.0), (120.0, 110.0, 100.0), (235.0, 235.0, 215.0)])
_TEXTURE = 30.0  # contrast, of 255
_PITCH_DOWN_RAD = 0.25


@dataclass(frozen=True, slots=True)
class Truth:
    """A recording as it is in truth: what goes into a format's files, and has to come out of its reader.

    Attributes:
        rig: the cameras; depth and colour are seen from one place.
        stamps_s: (n,) seconds from the first frame.
        world_from_camera: (n, 4, 4); z up, x right, y down, z forward.
        rgb: a colour picture a frame.
        depth_m: a picture of z-depth a frame, metres; 0 where nothing was measured.
    """

    rig: Rig
    stamps_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    rgb: tuple[UInt8[np.ndarray, "h w 3"], ...]
    depth_m: tuple[Float[np.ndarray, "hd wd"], ...]

    def __len__(self) -> int:
        return len(self.stamps_s)


def example_truth(
    rgb: Pinhole | None = None, depth: Pinhole | None = None, frames: int = 6, rate_hz: float = 10.0
) -> Truth:
    """Walk through the room.

    Args:
        rgb: the colour camera; by default one of 64x48.
        depth: the depth camera at the same place; by default the colour camera.
        frames: how many; the camera turns by 12 degrees and drives 6 cm from each to the next.
        rate_hz: frames a second.
    """
    rgb = rgb or Pinhole(52.0, 53.0, 31.0, 25.0, 64, 48)
    rig = Rig(rgb, depth or rgb)
    stamps_s = np.arange(frames) / rate_hz
    poses = np.stack([_pose(i) for i in range(frames)])
    depths = tuple(see(rig.depth, pose)[1] for pose in poses)
    for picture in depths:
        picture[:2, :3] = 0.0  # a corner where nothing was measured
    return Truth(rig, stamps_s, poses, tuple(see(rgb, pose)[0] for pose in poses), depths)


def _pose(index: int) -> Float[np.ndarray, "4 4"]:
    heading = np.deg2rad(20.0 + 12.0 * index)
    down = _PITCH_DOWN_RAD + 0.03 * index
    forward = np.array([np.cos(heading) * np.cos(down), np.sin(heading) * np.cos(down), -np.sin(down)])
    right = np.array([np.sin(heading), -np.cos(heading), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = (2.2 + 0.06 * index, 1.9 + 0.02 * np.sin(index), 1.2)
    return pose


def see(
    camera: Pinhole, pose: Float[np.ndarray, "4 4"], more: Sequence[Float[np.ndarray, "2 3"]] = ()
) -> tuple[Any, Any]:
    """Cast one ray a pixel; return colour (uint8) and z-depth (float32, metres).

    Args:
        camera: that sees.
        pose: its world_from_camera.
        more: lowest and highest corner of further boxes, such as a person who passes.
    """
    rays: Any = camera.rays() @ pose[:3, :3].T
    eye: Any = pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = np.maximum((_ROOM[0] - eye) / rays, (_ROOM[1] - eye) / rays)
    depth: Any = walls.min(axis=-1)
    axis: Any = walls.argmin(axis=-1)
    colour = _ROOM_COLOURS[np.where(axis < 2, axis, np.where(rays[..., 2] < 0.0, 2, 3))]
    colours = (*_BOX_COLOURS, *[_MORE_COLOUR] * len(more))
    for (low, high), own in zip((*_BOXES, *more), colours, strict=True):
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (low - eye) / rays, (high - eye) / rays
        near: Any = np.minimum(a, b)
        enter, leave = near.max(axis=-1), np.maximum(a, b).min(axis=-1)
        hit: Any = (enter < leave) & (enter > 0.0) & (enter < depth)
        depth = cast("Any", np.where(hit, enter, depth))
        colour = np.where(hit[..., None], own * (1.0 - 0.12 * near.argmax(axis=-1))[..., None], colour)
    points: Any = eye + rays * depth[..., None]
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    wave = np.sin(5.1 * x + 1.3 * z) + np.sin(4.3 * y - 1.7 * x) + np.sin(5.7 * z + 0.9 * y)
    return (colour + _TEXTURE / 2.0 * wave[..., None]).clip(0.0, 255.0).astype(np.uint8), depth.astype(np.float32)
