"""Sums over voxels: in a table that grows in place, and in a sorted form that can be stored."""

from dataclasses import dataclass, field, fields, replace

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, Int64

from avlmaps.core.errors import MapError
from avlmaps.maps.fusion.kernels import SPREAD_COLUMNS, Table, find_rows
from avlmaps.maps.types import Voxels

BLOCK_BYTES = 1 << 22  # merging and finishing go through features in blocks of this size, which stay in the cache
SMALLEST_ROOM = 4096  # rows


@dataclass(frozen=True, slots=True)
class VoxelSums:
    """The sums of one part of a recording, sorted by index (x, then y, then z); parts add up to the whole.

    The arrays may be memory-mapped.
    """

    index: Int32[np.ndarray, "n 3"]
    feature_sum: Float32[np.ndarray, "n d"]  # of weight times feature
    weight: Float64[np.ndarray, " n"]  # of the pixels with a feature
    rgb_sum: Float64[np.ndarray, "n 3"]  # of weight times colour (0 to 255)
    rgb_weight: Float64[np.ndarray, " n"]  # of the pixels with a colour
    hits: Int64[np.ndarray, " n"]  # how many pixels fell into it, with a feature and a colour or without
    views: Int32[np.ndarray, " n"]  # how many frames have a pixel in it
    # over its pixels how exact their depths are, 1 / (1 + (σ / half a voxel)²), in units of 1/256
    sharp: Int64[np.ndarray, " n"]
    last_seen_s: Float64[np.ndarray, " n"]  # when a pixel last fell into it
    # where its points lie in it, see `kernels.FrameVoxels`; no columns where that is not needed
    spread: Float64[np.ndarray, "n_or_0 s"] = field(default_factory=lambda: np.zeros((0, 0)))

    def __len__(self) -> int:
        return len(self.index)


def features_alone(sums: VoxelSums) -> VoxelSums:
    """Return sums of which the features alone are added where they are merged: all else is there already."""
    zero = {name: np.zeros_like(getattr(sums, name)) for name in ("rgb_sum", "rgb_weight", "hits", "views", "sharp")}
    return replace(sums, **zero, spread=np.zeros((len(sums), 0)))


@dataclass(frozen=True, slots=True)
class VoxelViews:
    """How well each voxel was seen; the fields are those of `VoxelSums`."""

    index: Int32[np.ndarray, "n 3"]
    hits: Int64[np.ndarray, " n"]
    views: Int32[np.ndarray, " n"]
    sharp: Int64[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.index)


class VoxelTable:
    """Sums over an unbounded set of voxels, in the order in which they were first met, found by a hash of the index.

    Rows are added in place: the arrays grow by an eighth through ``realloc``, which moves pages, not bytes, so that
    memory stays at the size of the map. ``slots`` is a hash table of rows, -1 free, of a power of two that is at least
    twice ``count``.
    """

    def __init__(self, dim: int, *, with_spread: bool = False) -> None:
        self.dim, self.count = dim, 0
        self.slots = np.full(2 * SMALLEST_ROOM, -1, np.int32)
        self.feature_sum = np.zeros((SMALLEST_ROOM, dim), np.float32)
        self.weight = np.zeros(SMALLEST_ROOM)
        self.index = np.zeros((SMALLEST_ROOM, 3), np.int32)
        self.rgb_sum = np.zeros((SMALLEST_ROOM, 3))
        self.rgb_weight = np.zeros(SMALLEST_ROOM)
        self.hits = np.zeros(SMALLEST_ROOM, np.int64)
        self.views = np.zeros(SMALLEST_ROOM, np.int32)
        self.sharp = np.zeros(SMALLEST_ROOM, np.int64)
        self.last_seen_s = np.zeros(SMALLEST_ROOM)
        self.spread = np.zeros((SMALLEST_ROOM, SPREAD_COLUMNS if with_spread else 0))

    def __len__(self) -> int:
        """Return how many voxels there are."""
        return self.count

    def views_at(self, index: Int32[np.ndarray, "n 3"]) -> Int32[np.ndarray, " n"]:
        """Return how many frames have a pixel in each of some voxels."""
        row = np.empty(len(index), np.int32)
        find_rows(np.ascontiguousarray(index, np.int32), self.slots, self.index, self.count, False, row)
        return np.where(row >= 0, self.views[row], 0)

    def rows_of(self, index: Int32[np.ndarray, "n 3"]) -> Int32[np.ndarray, " n"]:
        """Return the row of each voxel; those that are new become the last, and were never seen."""
        self.reserve(len(index))
        found, known = np.empty(len(index), np.int32), self.count
        wanted = np.array(index, np.int32, order="C")  # never read-only, which would compile the loop again
        self.count = int(find_rows(wanted, self.slots, self.index, self.count, True, found))
        self.last_seen_s[known : self.count] = -np.inf
        return found

    @property
    def arrays(self) -> Table:
        """What `kernels.commit` adds to."""
        return (self.slots, self.index, *(getattr(self, name) for name in _FIELDS[_FIELDS.index("rgb_sum") :]))

    def reserve(self, extra: int) -> None:
        """Make room for more voxels."""
        needed = self.count + extra
        if needed > len(self.weight):
            rows = max(needed, len(self.weight) + len(self.weight) // 8, 2 * SMALLEST_ROOM)
            for name in _FIELDS:
                array = getattr(self, name)
                array.resize((rows, *array.shape[1:]), refcheck=False)
        if 2 * needed > len(self.slots):
            self.slots = hash_of(self.index[: self.count], 1 << (4 * needed - 1).bit_length())

    def merge(self, part: VoxelSums) -> None:
        """Add the sums of another part of the same recording, in any order; a memory-mapped part is streamed."""
        if part.feature_sum.shape[1] != self.dim:
            raise MapError(
                f"The part's features have {part.feature_sum.shape[1]} numbers and this map's {self.dim}; "
                "merge only maps that were built with the same profile."
            )
        summed = [name for name in _FIELDS if name not in ("index", "last_seen_s")]
        if not part.spread.shape[1] or not self.spread.shape[1]:
            summed.remove("spread")
        for block in blocks(len(part), self.dim):
            rows = self.rows_of(part.index[block])
            self.last_seen_s[rows] = np.maximum(self.last_seen_s[rows], part.last_seen_s[block])
            for name in summed:
                getattr(self, name)[rows] += getattr(part, name)[block]

    def sort_rows(self) -> Int64[np.ndarray, " n"]:
        """Return the rows in the order of their index (x, then y, then z)."""
        return sorted_rows(self.index[: self.count])

    def sums(self) -> VoxelSums:
        """Return a copy of the sums, sorted by index."""
        rows = self.sort_rows()
        return VoxelSums(**{name: getattr(self, name)[rows] for name in _FIELDS})

    def evidence(self) -> VoxelViews:
        """Return the evidence of each voxel's surface, sorted by index, for `free_space.clean`."""
        rows = self.sort_rows()
        return VoxelViews(self.index[rows], self.hits[rows], self.views[rows], self.sharp[rows])

    def voxels(self, kept: Bool[np.ndarray, " n"] | None = None) -> Voxels:
        """Return the means of the ``kept`` of `evidence`, sorted by index: features of unit length, colours."""
        rows = self.sort_rows()
        rows = rows if kept is None else rows[kept]
        feature = np.empty((len(rows), self.dim), np.float16)
        for block in blocks(len(rows), self.dim):
            feature[block] = unit_rows(self.feature_sum[rows[block]])
        rgb_weight = self.rgb_weight[rows, None]
        rgb = np.divide(self.rgb_sum[rows], rgb_weight, out=np.zeros((len(rows), 3)), where=rgb_weight > 0.0)
        return Voxels(
            index=self.index[rows],
            feature=feature,
            weight=self.weight[rows].astype(np.float32),
            rgb=np.rint(rgb).astype(np.uint8),
            last_seen_s=self.last_seen_s[rows],
            hits=self.hits[rows],
        )


_FIELDS = tuple(field.name for field in fields(VoxelSums))


def hash_of(index: Int32[np.ndarray, "n 3"], slots: int = 0) -> Int32[np.ndarray, " slots"]:
    """Return the hash table of voxels, which all differ; ``slots`` is its length if it is to have room for more."""
    table = np.full(slots or 1 << (2 * len(index) + 1).bit_length(), -1, np.int32)
    wanted = np.array(index, np.int32, order="C")
    find_rows(wanted, table, wanted.copy(), 0, True, np.empty(len(wanted), np.int32))
    return table


def unit_rows(sums: Float32[np.ndarray, "n d"]) -> Float32[np.ndarray, "n d"]:
    """Return rows scaled to length 1; a zero row stays zero."""
    square = np.einsum("ij,ij->i", sums, sums, dtype=np.float64)
    scale = np.divide(1.0, np.sqrt(square), out=np.zeros_like(square), where=square > 0.0)
    return sums * scale[:, None].astype(np.float32)


def sorted_rows(index: Int32[np.ndarray, "n 3"]) -> Int64[np.ndarray, " n"]:
    """Return the order of voxels by x, then y, then z."""
    if not len(index):
        return np.zeros(0, np.int64)
    wide = index.astype(np.int64)
    low = wide.min(axis=0)
    span = [int(size) for size in wide.max(axis=0) - low + 1]
    if span[0] * span[1] * span[2] >= 1 << 62:
        return np.lexsort(wide.T[::-1])
    i, j, k = (wide - low).T
    return np.argsort((i * span[1] + j) * span[2] + k)


def blocks(count: int, dim: int) -> list[slice]:
    """Return slices that cover ``count`` rows of ``dim`` float32 in blocks of `BLOCK_BYTES`."""
    step = max(1, BLOCK_BYTES // (4 * max(dim, 1)))
    return [slice(start, min(start + step, count)) for start in range(0, count, step)]
