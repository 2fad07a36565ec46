"""The map's voxels, their places, which are connected, and the level frame: turned so that z is up."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int, Int64
from avlmaps.core.poses import from_rotation, rotation_to_level
from avlmaps.maps.grid import GridSpec, index_ends

if TYPE_CHECKING:
    from avlmaps.maps.store.map_data import MapData

# Pairs of a run and a neighbouring column that are compared at once: few voxels take one step, many little memory.
_MOST_AT_ONCE = 1 << 17


def linked(index: Int[np.ndarray, "n 3"], reach: int) -> Int64[np.ndarray, " n"]:
    """Label voxels so that those within ``reach`` along every axis share a label; labels rise by their first voxel.

    ``index``: sorted by x, then y, then z, without repeats.
    """
    # Voxels over one another make runs, and runs of columns within reach are joined where they overlap.
    if not len(index):
        return np.zeros(0, np.int64)
    voxels = np.asarray(index, np.int64)
    voxels = voxels - voxels.min(axis=0)
    x, y, z = voxels[:, 0], voxels[:, 1], voxels[:, 2]
    # Columns and heights are numbered with room between, so that no neighbour is one of another row.
    width, height = int(y.max()) + 1 + 2 * reach, int(z.max()) + 1 + 2 * reach
    column = x * width + y
    begins = np.append(True, column[1:] != column[:-1])
    first = np.flatnonzero(begins | np.append(True, np.diff(z) > reach))  # voxel of each run
    last = np.append(first[1:], len(z)) - 1
    columns, of_run = column[begins], np.asarray(np.cumsum(begins)[first] - 1, np.int64)
    bottom, top = of_run * height + z[first], of_run * height + z[last]
    root = np.arange(len(first))
    ways = [(dx, dy) for dx in range(reach + 1) for dy in range(-reach, reach + 1) if dx or dy > 0]
    steps = np.array([dx * width + dy for dx, dy in ways])
    at_once = max(1, _MOST_AT_ONCE // len(first))
    for start in range(0, len(steps), at_once):
        wanted = columns + steps[start : start + at_once, None]
        at = np.minimum(np.asarray(np.searchsorted(columns, wanted), np.int64), len(columns) - 1)
        way, run = np.nonzero((columns[at] == wanted)[:, of_run])
        lift = (at[way, of_run[run]] - of_run[run]) * height  # to the other column
        low = np.asarray(np.searchsorted(top, bottom[run] + lift - reach), np.int64)
        count = np.asarray(np.searchsorted(bottom, top[run] + lift + reach, side="right") - low, np.int64)
        ends = np.cumsum(count)
        other = np.repeat(low - ends + count, count) + np.arange(ends[-1] if len(ends) else 0)
        _join(root, np.repeat(run, count), other)
    return np.repeat(_numbered(root), last - first + 1)


def connected(count: int, a: Int[np.ndarray, " e"], b: Int[np.ndarray, " e"]) -> Int64[np.ndarray, " n"]:
    """Return the label of each of ``count`` nodes, equal for those that edges join; labels rise by their first node."""
    root = np.arange(count)
    _join(root, a, b)
    return _numbered(root)


def _join(root: Int64[np.ndarray, " n"], a: Int[np.ndarray, " e"], b: Int[np.ndarray, " e"]) -> None:
    while True:
        one, other = root[a], root[b]
        apart = one != other
        if not apart.any():
            return
        a, b, one, other = a[apart], b[apart], one[apart], other[apart]
        np.minimum.at(root, np.maximum(one, other), np.minimum(one, other))
        while not np.array_equal(above := root[root], root):
            root[:] = above


def _numbered(root: Int64[np.ndarray, " n"]) -> Int64[np.ndarray, " n"]:
    return (np.cumsum(root == np.arange(len(root))) - 1)[root]


def boxes(
    points: Float[np.ndarray, "n d"], owner: Int[np.ndarray, " n"], count: int
) -> tuple[Float[np.ndarray, "i d"], Float[np.ndarray, "i d"]]:
    """Return the lowest and the highest corner of each owner's points; infinite and turned round without any."""
    low, high = (np.full((count, points.shape[1]), end) for end in (np.inf, -np.inf))
    for axis in range(points.shape[1]):  # each by itself: NumPy is ten times as fast on numbers as on rows
        np.minimum.at(low[:, axis], owner, points[:, axis])
        np.maximum.at(high[:, axis], owner, points[:, axis])
    return low, high


def middle_of(points: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "3"]:
    """Return the point nearest to the mean of some points."""
    return points[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]


def distinct(values: Int[np.ndarray, " n"]) -> Int[np.ndarray, " d"]:
    """Return the distinct values, ascending, as ``np.unique`` does; that loads ``numpy.ma`` to compare with."""
    ordered = np.sort(values)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])] if len(ordered) else ordered


# Voxels are worked on in cubes of this many a side: small enough that few objects or anchors are nearest to
# some voxel of a cube, large enough that asking for them costs little.
_SHIFT = 3
_BLOCK = 1 << _SHIFT
_CHUNK = 1 << 17  # voxels whose places are computed at once: they stay in the processor's cache
# Blocks in the box round a map, for each of its own, up to which a table of them is made.
_MOST_BLOCKS = 64


@dataclass(frozen=True, slots=True)
class Blocks:
    """Voxels in an order where those of one cube of space follow each other."""

    order: Int[np.ndarray, " n"]  # (n,) rows of the map's voxels
    starts: Int[np.ndarray, " b1"]  # (b + 1,) first place of each block in ``order``
    index: Int[np.ndarray, "3 n"]  # (3, n) int32, the voxels in that order, one row an axis
    low: Int[np.ndarray, "b 3"]  # (b, 3) least index of each block's voxels
    high: Int[np.ndarray, "b 3"]  # (b, 3) largest index of each block's voxels

    def __len__(self) -> int:
        return len(self.starts) - 1

    @classmethod
    def of(cls, index: Int[np.ndarray, "n 3"]) -> "Blocks":
        """Sort voxels into blocks."""
        if not len(index):
            return cls._of_runs(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((3, 0), np.int32))
        least, most = (end // _BLOCK for end in index_ends(index))
        span: Int[np.ndarray, " xyz"] = most - least + 1
        number = np.empty(len(index), np.int64)
        for a in range(0, len(index), _CHUNK):
            x, y, z = ((index[a : a + _CHUNK, axis] >> _SHIFT) - least[axis] for axis in range(3))
            number[a : a + _CHUNK] = (x * span[1] + y) * span[2] + z
        order = np.argsort(number, kind="stable")
        return cls._of_runs(order, number[order], np.ascontiguousarray(index[order].T, np.int32))

    @classmethod
    def _of_runs(
        cls, order: Int[np.ndarray, " n"], block: Int[np.ndarray, " n"], index: Int[np.ndarray, "3 n"]
    ) -> "Blocks":
        # Voxels of one block have its number and follow each other.
        if not len(order):
            return cls(order, np.zeros(1, np.int64), index, np.zeros((0, 3), np.int64), np.zeros((0, 3), np.int64))
        first = np.flatnonzero(np.append(True, block[1:] != block[:-1]))
        low, high = (
            np.ascontiguousarray(end.reduceat(index, first, axis=1).T, np.int64) for end in (np.minimum, np.maximum)
        )
        return cls(order, np.append(first, len(order)).astype(np.int64), index, low, high)

    def near(self, things: "Blocks", reach: int) -> Int[np.ndarray, " k"]:
        """Return the numbers of the blocks that come within some voxels of a block of things along every axis."""
        every = np.arange(len(self), dtype=np.int64)
        if not len(things) or not len(self):
            return every[:0]
        cube, thing, around = self.low // _BLOCK, things.low // _BLOCK, -(-reach // _BLOCK)
        least = np.minimum(cube.min(axis=0), thing.min(axis=0)) - around
        span: Int[np.ndarray, " xyz"] = np.maximum(cube.max(axis=0), thing.max(axis=0)) + around + 1 - least
        if int(span[0]) * int(span[1]) * int(span[2]) > _MOST_BLOCKS * len(self) + 4096:
            return every  # a few far voxels: a table of all blocks would be larger than the map
        held = np.zeros(tuple(span), bool)
        held[tuple((thing - least).T)] = True
        for axis in range(3):  # each axis in turn: a cube about each block of things
            steps = [np.roll(held, step, axis) for step in range(-around, around + 1)]
            held = np.logical_or.reduce(steps)
        return every[held[tuple((cube - least).T)]]

    def some(self, which: Int[np.ndarray, " k"]) -> "Blocks":
        """Return some of the blocks, by their numbers."""
        counts = np.diff(self.starts)[which]
        starts = np.append(0, np.cumsum(counts)).astype(np.int64)
        place = np.arange(int(starts[-1]), dtype=np.int64)
        place += np.repeat(self.starts[which] - starts[:-1], counts)
        index = np.ascontiguousarray(self.index[:, place])
        return Blocks(self.order[place], starts, index, self.low[which], self.high[which])

    def chosen(self, mask: Bool[np.ndarray, " n"]) -> "Blocks":
        """Return the blocks of some of the voxels only, without sorting again; blocks that have none are left out."""
        rows = np.flatnonzero(mask[self.order])
        block = np.searchsorted(self.starts, rows, side="right") - 1
        return Blocks._of_runs(self.order[rows], block, np.ascontiguousarray(self.index[:, rows]))


class Space:
    """Where a map's voxels are: ``index`` (n, 3), sorted. All heatmaps of one map share it."""

    def __init__(
        self, grid: GridSpec, index: Int[np.ndarray, "n 3"], up_in_world: Float[np.ndarray, "3"],
        data: "MapData | None" = None,
    ) -> None:  # fmt: skip
        self.grid, self.index, self.data = grid, index, data
        self.level_from_world = rotation_to_level(np.asarray(up_in_world, np.float64))

    def __len__(self) -> int:
        return len(self.index)

    @cached_property
    def centres(self) -> Float[np.ndarray, "n 3"]:
        """The middles of the voxels, metres, world."""
        return self.grid.centre_of(np.asarray(self.index))

    def centres_of(self, voxels: Bool[np.ndarray, " n"] | Int[np.ndarray, " m"] | slice) -> Float[np.ndarray, "m 3"]:
        """Return the middles of some voxels, metres, world: of a mask, numbers or a slice; all are never computed."""
        return self.grid.centre_of(np.asarray(self.index)[voxels])

    def level_centres(self) -> Float[np.ndarray, "n 3"]:
        """Return the middles of all voxels, metres, level frame."""
        out = np.empty((len(self), 3))
        for a in range(0, len(out), _CHUNK):
            out[a : a + _CHUNK] = self.level(self.centres_of(slice(a, a + _CHUNK)))
        return out

    @cached_property
    def blocks(self) -> Blocks:
        """The voxels in blocks."""
        return Blocks.of(np.asarray(self.index))

    @cached_property
    def _keys(self) -> tuple[Int[np.ndarray, "3"], Int[np.ndarray, "3"], Int[np.ndarray, " n"]]:
        index = np.asarray(self.index, np.int64)
        low = index.min(axis=0) if len(index) else np.zeros(3, np.int64)
        span = index.max(axis=0) - low + 1 if len(index) else np.zeros(3, np.int64)
        return low, span, (index - low) @ np.array([span[1] * span[2], span[2], 1])

    def rows_of(self, cells: Int[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the number of the voxel in each cell of the grid; −1 where there is none."""
        low, span, keys = self._keys
        shifted, rows = np.asarray(cells, np.int64) - low, np.full(len(cells), -1, np.int64)
        within = np.flatnonzero(np.all((shifted >= 0) & (shifted < span), axis=1))
        key: Int[np.ndarray, " k"] = shifted[within] @ np.array([span[1] * span[2], span[2], 1])
        at = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        rows[within] = np.where(keys[at] == key, at, -1)
        return rows

    @cached_property
    def horizontal(self) -> Float[np.ndarray, "n 2"]:
        """The middles of the voxels in the order of ``blocks``, horizontal coordinates of the level frame, metres."""
        return self.horizontal_of(self.blocks)

    def horizontal_of(self, blocks: Blocks) -> Float[np.ndarray, "m 2"]:
        """Return the middles of the voxels of some blocks, likewise."""
        out = np.empty((blocks.index.shape[1], 2))
        for a in range(0, len(out), _CHUNK):
            out[a : a + _CHUNK] = self.level(self.grid.centre_of(blocks.index[:, a : a + _CHUNK].T))[:, :2]
        return out

    @cached_property
    def is_level(self) -> bool:
        """Whether the world is the level frame itself."""
        return np.array_equal(self.level_from_world, np.eye(3))

    @property
    def level_from_recording(self) -> Float[np.ndarray, "4 4"]:
        """The pose of the recording's world in the level frame: the rotation, about the same origin."""
        return from_rotation(self.level_from_world)

    def level(self, points_world: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Turn points from the world into the level frame."""
        if self.is_level:
            return np.array(points_world, np.float64)
        return np.asarray(points_world, np.float64) @ self.level_from_world.T

    def world(self, points_level: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Turn points from the level frame into the world."""
        return points_level @ self.level_from_world
