"""Small patches of the surfaces that a depth camera saw, in axes whose third is up: what the floor is found from.

The inverse of a plane's depth is linear in pixel coordinates. A depth picture is therefore averaged as inverse depth
over blocks of pixels, which halves a sensor's noise and its steps, and a plane is fitted to three by three blocks.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import apply
from avlmaps.recordings.types import Frame

COLUMNS = 107  # blocks across a picture
MAX_RANGE_M = 6.0  # beyond, a depth camera's error is as large as a step
LEVEL_RAD = np.deg2rad(18.0)  # how far a patch may lean and still count as level
CELL_M, SLICE_M = 0.1, 0.05  # a voxel of the evidence: its width, and its height along up
_FULL = 0.6  # a block counts when this share of its pixels has a depth,
_STEP = 0.15  # and when they differ by less than this share of it
_BITS = 20  # of a voxel's number, for each axis
_BIAS = 1 << (_BITS - 1)
STEP_X, STEP_Y = 1 << _BITS, 1  # between the numbers of neighbouring columns


@dataclass(frozen=True, slots=True)
class Voxelised:
    """Points gathered into voxels of 0.1 x 0.1 x 0.05 m, so that a place counts once however long it is looked at.

    Attributes:
        key: (n,) rising number of each voxel.
        count: (n,) how many points fell into it.
        height_m: (n,) their mean height along up.
        range_m: (n,) their mean depth.
    """

    key: Int64[np.ndarray, " n"]
    count: Float[np.ndarray, " n"]
    height_m: Float[np.ndarray, " n"]
    range_m: Float[np.ndarray, " n"]

    @classmethod
    def of(cls, point_m: Float[np.ndarray, "n 3"], range_m: Float[np.ndarray, " n"]) -> "Voxelised":
        """Gather points, given in level axes."""
        index = np.floor(point_m / (CELL_M, CELL_M, SLICE_M)).astype(np.int64)
        index = np.clip(index + _BIAS, 0, (1 << _BITS) - 1)
        key = (index[:, 0] << 2 * _BITS) | (index[:, 1] << _BITS) | index[:, 2]
        return _gathered(key, np.ones(len(key)), point_m[:, 2], range_m)

    @classmethod
    def union(cls, parts: "list[Voxelised]") -> "Voxelised":
        """Gather the voxels of several frames."""
        if not parts:
            return _gathered(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))
        key, count, height_m, range_m = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("key", "count", "height_m", "range_m")
        )
        return _gathered(key, count, height_m, range_m)

    def __getitem__(self, chosen: Bool[np.ndarray, " n"]) -> "Voxelised":
        return Voxelised(self.key[chosen], self.count[chosen], self.height_m[chosen], self.range_m[chosen])

    def __len__(self) -> int:
        return len(self.key)

    def columns(self) -> Int64[np.ndarray, " n"]:
        """Return the number of the column of each voxel: of its x and y."""
        return self.key >> _BITS

    def middles_m(self) -> Float[np.ndarray, "n 2"]:
        """Return the middle of each voxel's column, level x and y."""
        column = self.columns()
        index = np.stack([column >> _BITS, column & ((1 << _BITS) - 1)], axis=-1) - _BIAS
        return (index + 0.5) * CELL_M


def _gathered(
    key: Int64[np.ndarray, " n"],
    count: Float[np.ndarray, " n"],
    height_m: Float[np.ndarray, " n"],
    range_m: Float[np.ndarray, " n"],
) -> Voxelised:
    unique, place = np.unique(key, return_inverse=True)
    place = place.reshape(-1)
    total = np.bincount(place, count, minlength=len(unique))
    sums = [np.bincount(place, count * value, minlength=len(unique)) for value in (height_m, range_m)]
    return Voxelised(unique, total, sums[0] / np.maximum(total, 1.0), sums[1] / np.maximum(total, 1.0))


@dataclass(frozen=True, slots=True)
class Sight:
    """The surfaces of one frame, in level axes: x and y horizontal, the third along up; metres.

    Attributes:
        camera_m: (3,) where the camera was.
        surface: all that was seen.
        level: of it what is level and faces up.
    """

    camera_m: Float[np.ndarray, "3"]
    surface: Voxelised
    level: Voxelised


def sight_of(frame: Frame, up_in_world: Float[np.ndarray, "3"]) -> Sight:
    """Return the surfaces of a frame within 6 m, as voxels in level axes."""
    axes = level_axes(up_in_world)
    camera, inverse_depth = _blocks(frame)
    x = ((np.arange(camera.width) + 0.5) - camera.cx) / camera.fx
    y = ((np.arange(camera.height) + 0.5) - camera.cy) / camera.fy
    ray = np.stack([*np.meshgrid(x, y), np.ones((camera.height, camera.width))], axis=-1)
    smooth, normal = _planes(inverse_depth, x, y)
    level = normal @ (frame.world_from_camera[:3, :3].T @ up_in_world) < -np.cos(LEVEL_RAD)

    def gathered(inverse: Float[np.ndarray, "h w"], rays: Float[np.ndarray, "h w 3"]) -> Voxelised:
        known = np.isfinite(inverse)
        range_m = 1.0 / inverse[known]
        point_m = apply(frame.world_from_camera, rays[known] * range_m[:, None]) @ axes.T
        return Voxelised.of(point_m, range_m)

    return Sight(
        camera_m=axes @ frame.world_from_camera[:3, 3],
        surface=gathered(inverse_depth, ray),
        level=gathered(np.where(level, smooth, np.nan), ray[1:-1, 1:-1]),
    )


def level_axes(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return a rotation from the world into axes whose third is up; its rows are the axes."""
    away = np.eye(3)[int(np.argmin(np.abs(up)))]
    x = np.cross(up, away)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def _blocks(frame: Frame) -> tuple[Pinhole, Float[np.ndarray, "h w"]]:
    camera = frame.rig.depth
    size = max(1, round(camera.width / COLUMNS))
    h, w = camera.height // size, camera.width // size
    depth = frame.depth_m[: h * size, : w * size].astype(np.float64)
    depth = np.where(np.isfinite(depth) & (depth > 0.0), depth, 0.0).reshape(h, size, w, size)
    known = depth > 0.0
    count = known.sum(axis=(1, 3))
    mean = np.divide(1.0, depth, out=np.zeros_like(depth), where=known).sum(axis=(1, 3)) / np.maximum(count, 1)
    far_m = depth.max(axis=(1, 3))
    spread_m = far_m - np.where(known, depth, far_m[:, None, :, None]).min(axis=(1, 3))
    good = (count >= _FULL * size * size) & (mean * MAX_RANGE_M > 1.0) & (spread_m * mean < _STEP)
    small = Pinhole(camera.fx / size, camera.fy / size, camera.cx / size, camera.cy / size, w, h)
    return small, np.where(good, mean, np.nan)


def _planes(
    inverse_depth: Float[np.ndarray, "h w"], x: Float[np.ndarray, " w"], y: Float[np.ndarray, " h"]
) -> tuple[Float[np.ndarray, "hs ws"], Float[np.ndarray, "hs ws 3"]]:
    h, w = inverse_depth.shape
    if h < 3 or w < 3:
        return np.zeros((0, 0)), np.zeros((0, 0, 3))
    near = {(i, j): inverse_depth[1 + i : h - 1 + i, 1 + j : w - 1 + j] for i in (-1, 0, 1) for j in (-1, 0, 1)}
    middle = np.sum(list(near.values()), axis=0) / 9.0
    along_x = np.sum([j * value for (_, j), value in near.items()], axis=0) / (6.0 * (x[1] - x[0]))
    along_y = np.sum([i * value for (i, _), value in near.items()], axis=0) / (6.0 * (y[1] - y[0]))
    rest = middle - along_x * x[None, 1:-1] - along_y * y[1:-1, None]
    normal = np.stack([along_x, along_y, rest], axis=-1)
    return middle, normal / np.linalg.norm(normal, axis=-1, keepdims=True)
