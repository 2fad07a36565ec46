"""The map from above: which colour and which heat each column of voxels shows. Arrays only; ``plots`` draws them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.query.voxel_space import Space

# The view is cut this much over the highest place of the camera, so that a ceiling does not hide the room.
_HEADROOM_M = 0.3
# Colour is the mean of this many voxels from the top of a column.
_SKIN = 3
_MARGIN_CELLS = 6
# Along a side; a map that is wider is drawn in cells of several voxels, so that no map asks for gigabytes.
_MOST_CELLS = 2500


@dataclass(frozen=True, slots=True)
class TopDown:
    """A raster over the level frame; row 0 has the least y.

    Attributes:
        rgb: mean colour of the highest voxels of each column.
        seen: which columns have any.
        cell: (n, 2) row and column of each voxel of the map.
        extent: (left, right, bottom, top) in metres.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    seen: Bool[np.ndarray, "h w"]
    cell: Int[np.ndarray, "n 2"]
    extent: tuple[float, float, float, float]

    @classmethod
    def of(cls, space: Space) -> "TopDown":
        """Project a map top-down."""
        voxel_size_m = space.grid.voxel_size_m
        level = space.level(space.centres)
        if not len(space):
            empty = np.zeros((2 * _MARGIN_CELLS, 2 * _MARGIN_CELLS), bool)
            half = _MARGIN_CELLS * voxel_size_m
            extent = (-half, half, -half, half)
            return cls(np.zeros((*empty.shape, 3), np.uint8), empty, np.zeros((0, 2), np.int64), extent)
        places = np.concatenate([level[:, :2], camera_path(space)[:, :2]])
        sides = float(np.ptp(places, axis=0).max()) / voxel_size_m
        cell_m = voxel_size_m * max(1, int(np.ceil(sides / _MOST_CELLS)))
        shown = np.floor(places / cell_m).astype(np.int64)
        ground = shown[: len(level)]
        low, high = shown.min(axis=0) - _MARGIN_CELLS, shown.max(axis=0) + _MARGIN_CELLS + 1
        cell = (ground - low)[:, ::-1]
        shape = int(high[1] - low[1]), int(high[0] - low[0])
        visible = level[:, 2] <= _ceiling_m(space, level)
        rgb, seen = _highest_colours(space, cell, level[:, 2], visible, shape)
        left, bottom = low * cell_m
        right, top = high * cell_m
        return cls(rgb, seen, cell, (float(left), float(right), float(bottom), float(top)))

    def heat(self, values: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, "h w"]:
        """Return the highest heat of each column."""
        raster = np.zeros(self.seen.shape, np.float32)
        np.maximum.at(raster, (self.cell[:, 0], self.cell[:, 1]), values)
        return raster


def camera_path(space: Space) -> Float[np.ndarray, "k 3"]:
    """Return where the keyframes' cameras were, level frame, in the order of time."""
    if space.stored is None:
        return np.zeros((0, 3))
    return space.level(np.asarray(space.stored.keyframes.world_from_camera)[:, :3, 3])


def _ceiling_m(space: Space, level: Float[np.ndarray, "n 3"]) -> float:
    cameras = camera_path(space)
    return float(cameras[:, 2].max()) + _HEADROOM_M if len(cameras) else float(level[:, 2].max())


def _highest_colours(
    space: Space,
    cell: Int[np.ndarray, "n 2"],
    height_m: Float[np.ndarray, " n"],
    visible: Bool[np.ndarray, " n"],
    shape: tuple[int, int],
) -> tuple[UInt8[np.ndarray, "h w 3"], Bool[np.ndarray, "h w"]]:
    """Return the mean colour of the voxels at the top of each column, and which columns have any."""
    rows = np.flatnonzero(visible)
    column = cell[rows, 0] * shape[1] + cell[rows, 1]
    order = np.lexsort((-height_m[rows], column))
    rows, column = rows[order], column[order]
    first = np.r_[True, column[1:] != column[:-1]] if len(rows) else np.zeros(0, bool)
    place = np.arange(len(rows)) - np.maximum.accumulate(np.where(first, np.arange(len(rows)), 0))
    skin = place < _SKIN
    colours = (
        np.full((len(space), 3), 150, np.uint8) if space.stored is None else np.asarray(space.stored.voxels.rgb)
    )[rows[skin]]
    count = np.bincount(column[skin], minlength=shape[0] * shape[1])
    total = [np.bincount(column[skin], weights=colours[:, k], minlength=len(count)) for k in range(3)]
    mean = np.stack(total, axis=-1) / np.maximum(count, 1)[:, None]
    return mean.astype(np.uint8).reshape(*shape, 3), (count > 0).reshape(shape)
