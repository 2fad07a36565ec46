"""The space that heatmaps live in: the map's voxels, their places, and what is horizontal.

The recording's world need not be level, so the map knows the up direction. "Level frame" means the world turned
by the smallest rotation that makes up its z axis; it shares the world's origin.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.poses import rotation_to_level
from avlmaps.maps.grid import GridSpec

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap

# Voxels are worked on in cubes of this many a side: small enough that few objects or anchors are nearest to
# some voxel of a cube, large enough that asking for them costs little.
_BLOCK = 8


@dataclass(frozen=True, slots=True)
class Blocks:
    """Voxels in an order where those of one cube of space follow each other.

    Attributes:
        order: (n,) rows of the map's voxels.
        starts: (b + 1,) first place of each block in ``order``.
        index: (3, n) int32, the voxels in that order, one row an axis.
        low: (b, 3) least index of each block's voxels.
        high: (b, 3) largest index of each block's voxels.
    """

    order: Int[np.ndarray, " n"]
    starts: Int[np.ndarray, " b1"]
    index: Int[np.ndarray, "3 n"]
    low: Int[np.ndarray, "b 3"]
    high: Int[np.ndarray, "b 3"]

    def __len__(self) -> int:
        return len(self.starts) - 1

    @classmethod
    def of(cls, index: Int[np.ndarray, "n 3"]) -> "Blocks":
        """Sort voxels into blocks."""
        cube = np.floor_divide(index, _BLOCK)
        order = np.lexsort((cube[:, 2], cube[:, 1], cube[:, 0]))
        return cls._split(order, cube[order], index[order])

    @classmethod
    def _split(cls, order: Int[np.ndarray, " n"], cube: Int[np.ndarray, "n 3"], index: Int[np.ndarray, "n 3"]):
        n = len(order)
        first = np.flatnonzero(np.r_[True, (cube[1:] != cube[:-1]).any(axis=1)]) if n else np.zeros(0, np.int64)
        empty = np.zeros((0, 3), np.int64)
        low = np.minimum.reduceat(index, first).astype(np.int64) if n else empty
        high = np.maximum.reduceat(index, first).astype(np.int64) if n else empty
        return cls(order, np.append(first, n).astype(np.int64), np.ascontiguousarray(index.T, np.int32), low, high)

    def chosen(self, mask: Bool[np.ndarray, " n"]) -> "Blocks":
        """Return the blocks of some of the voxels only, without sorting again; blocks that have none are left out.

        Args:
            mask: in the map's order.
        """
        rows = np.flatnonzero(mask[self.order])
        block = np.searchsorted(self.starts, rows, side="right") - 1
        first = np.flatnonzero(np.r_[True, block[1:] != block[:-1]]) if len(rows) else np.zeros(0, np.int64)
        index = np.ascontiguousarray(self.index[:, rows])
        if not len(rows):
            return Blocks(self.order[rows], np.zeros(1, np.int64), index, self.low[:0], self.high[:0])
        low = np.minimum.reduceat(index, first, axis=1).T.astype(np.int64)
        high = np.maximum.reduceat(index, first, axis=1).T.astype(np.int64)
        starts = np.append(first, len(rows)).astype(np.int64)
        return Blocks(self.order[rows], starts, index, np.ascontiguousarray(low), np.ascontiguousarray(high))


class Space:
    """Where a map's voxels are. All heatmaps of one map share one; what costs time is computed once.

    Attributes:
        grid: turns metres into voxels.
        index: (n, 3) occupied voxels, sorted.
        level_from_world: 3x3 rotation.
        stored: the map, for its colours in pictures; None for a space without one.
    """

    def __init__(
        self,
        grid: GridSpec,
        index: Int[np.ndarray, "n 3"],
        up_in_world: Float[np.ndarray, "3"],
        stored: "StoredMap | None" = None,
    ) -> None:
        self.grid = grid
        self.index = index
        self.level_from_world = rotation_to_level(np.asarray(up_in_world, np.float64))
        self.stored = stored

    def __len__(self) -> int:
        return len(self.index)

    @cached_property
    def centres(self) -> Float[np.ndarray, "n 3"]:
        """The middles of the voxels, metres, world."""
        return self.grid.centre_of(np.asarray(self.index))

    def centres_of(self, voxels: Bool[np.ndarray, " n"] | Int[np.ndarray, " m"] | slice) -> Float[np.ndarray, "m 3"]:
        """Return the middles of some voxels, metres, world: of a mask, numbers or a slice; all are never computed."""
        return self.grid.centre_of(np.asarray(self.index)[voxels])

    @cached_property
    def blocks(self) -> Blocks:
        """The voxels in blocks."""
        return Blocks.of(np.asarray(self.index))

    @cached_property
    def _keys(self) -> tuple[Int[np.ndarray, "3"], Int[np.ndarray, "3"], Int[np.ndarray, " n"]]:
        """The lowest index, the extent in voxels, and one number for each voxel, ascending as the voxels are sorted."""
        index = np.asarray(self.index, np.int64)
        low = index.min(axis=0) if len(index) else np.zeros(3, np.int64)
        span = index.max(axis=0) - low + 1 if len(index) else np.zeros(3, np.int64)
        shifted = index - low
        return low, span, (shifted[:, 0] * span[1] + shifted[:, 1]) * span[2] + shifted[:, 2]

    def holds(self, cells: Int[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Return which cells of the grid are occupied voxels."""
        low, span, keys = self._keys
        shifted = np.asarray(cells, np.int64) - low
        held = np.all((shifted >= 0) & (shifted < span), axis=1)
        key: Int[np.ndarray, " k"] = (shifted[held, 0] * span[1] + shifted[held, 1]) * span[2] + shifted[held, 2]
        at = np.searchsorted(keys, key)
        held[held] = keys[np.minimum(at, len(keys) - 1)] == key
        return held

    @cached_property
    def horizontal(self) -> Float[np.ndarray, "n 2"]:
        """The middles of the voxels in the order of ``blocks``, horizontal coordinates of the level frame, metres."""
        return np.ascontiguousarray(self.level(self.centres[self.blocks.order])[:, :2])

    @cached_property
    def is_level(self) -> bool:
        """Whether the world is the level frame itself."""
        return np.array_equal(self.level_from_world, np.eye(3))

    @property
    def level_from_recording(self) -> Float[np.ndarray, "4 4"]:
        """The pose of the recording's world in the level frame: the rotation, about the same origin."""
        pose = np.eye(4)
        pose[:3, :3] = self.level_from_world
        return pose

    def level(self, points_world: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Turn points from the world into the level frame."""
        if self.is_level:
            return np.array(points_world, np.float64)
        return np.asarray(points_world, np.float64) @ self.level_from_world.T

    def world(self, points_level: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Turn points from the level frame into the world."""
        return points_level @ self.level_from_world
