"""The map that submaps add up to when their frames have moved: its surface first, features where they are wanted.

What is a sum of a few numbers is added at once. Features are long, and are summed at the end, for the voxels that are
a surface alone: until then a list says which of them go where, and how much they count.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from avlmaps.core.ahead import usable_cores
from avlmaps.core.arrays import Bool, Float32, Float64, Int32, Int64, UInt16
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse
from avlmaps.maps.fusion import submap_kernels as kernels
from avlmaps.maps.fusion.voxel_kernels import rehash, unit_rows
from avlmaps.maps.fusion.voxel_sums import VoxelTable, VoxelViews, blocks, sorted_rows, with_rows
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import Submaps, Voxels

FARTHEST = float((1 << 31) - (1 << 22))  # voxels; indices are int32
_PAIRS_PER_VOXEL = 3  # at first
_BRICKS = 1024
_FIELDS = ("index", "weight", "rgb_sum", "rgb_weight", "hits", "views", "sharp", "last_seen_s")

_Pairs = tuple[Int32[np.ndarray, " p"], Int32[np.ndarray, " p"], Float32[np.ndarray, " p"]]
_Take = Callable[[slice, np.ndarray], None]


class MovedSubmaps:
    """Submaps, added up at other poses of their frames."""

    def __init__(self, submaps: Submaps, pose: Float64[np.ndarray, "f 4 4"], grid: GridSpec) -> None:
        """Add up what is no feature.

        Raises:
            MapError: the poses lie too far from the world's origin for voxels.
        """
        self._feature, self._scale = submaps.feature, submaps.feature_scale
        moved = np.ascontiguousarray((pose @ inverse(np.asarray(submaps.fused_pose)))[:, :3], np.float64)
        moved[:, :, 3] /= grid.voxel_size_m
        middle = int(np.searchsorted(submaps.row_offsets[:-1], len(submaps.index) // 2))
        # Two halves however many cores there are: the same sums in the same order, everywhere.
        with ThreadPoolExecutor(2) as pool:
            halves = [pool.submit(_Sums, submaps, half, moved) for half in (range(middle), range(middle, len(submaps)))]
        sums, others = (half.result() for half in halves)
        sums.join(others)
        self._count, self._pairs = sums.count, sums.pairs()
        self._index, self._sums = sums.index[: sums.count], sums.sums[: sums.count]
        self._views = sums.counts[: sums.count, kernels.VIEWS]
        self._order = sorted_rows(self._index)

    def evidence(self) -> VoxelViews:
        """Return the evidence of each voxel's surface, sorted by index, for `free_space.clean`."""
        rows = self._order
        hits, sharp = (self._sums[rows, column].astype(np.int64) for column in (kernels.HITS, kernels.SHARP))
        return VoxelViews(self._index[rows], hits, self._views[rows], sharp)

    def voxels(self, kept: Bool[np.ndarray, " n"] | None = None) -> Voxels:
        """Return the means, sorted by index: features of unit length, colours.

        Args:
            kept: which voxels of `evidence` to return; all by default.
        """
        rows = self._order if kept is None else self._order[kept]
        sums, dim = self._sums[rows], self._feature.shape[1]
        feature = np.empty((len(rows), dim), np.float16)

        def finish(block: slice, summed: Float32[np.ndarray, "k d"]) -> None:
            unit_rows(summed, np.arange(len(summed)), feature.view(np.uint16)[block])

        if dim:
            self._features(rows, finish)
        rgb, rgb_weight = sums[:, : kernels.RGB_WEIGHT], sums[:, kernels.RGB_WEIGHT, None]
        colour = np.divide(rgb, rgb_weight, out=np.zeros((len(rows), 3)), where=rgb_weight > 0.0)
        return Voxels(
            index=self._index[rows],
            feature=feature,
            weight=sums[:, kernels.WEIGHT].astype(np.float32),
            rgb=np.rint(colour).astype(np.uint8),
            last_seen_s=sums[:, kernels.LAST_SEEN].copy(),
            hits=sums[:, kernels.HITS].astype(np.int64),
        )

    def table(self) -> VoxelTable:
        """Return the sums as a table, to which frames can be added."""
        table, sums, dim = VoxelTable(self._feature.shape[1]), self._sums, self._feature.shape[1]
        table.reserve(self._count)
        count = table.count = self._count
        table.index[:count] = self._index
        table.weight[:count] = sums[:, kernels.WEIGHT]
        table.rgb_sum[:count] = sums[:, : kernels.RGB_WEIGHT]
        table.rgb_weight[:count] = sums[:, kernels.RGB_WEIGHT]
        table.hits[:count] = sums[:, kernels.HITS]
        table.views[:count] = self._views
        table.sharp[:count] = sums[:, kernels.SHARP]
        table.last_seen_s[:count] = sums[:, kernels.LAST_SEEN]
        rehash(table.slots, table.index, count)

        def take(block: slice, summed: Float32[np.ndarray, "k d"]) -> None:
            table.feature_sum[block] = summed

        if dim:
            self._features(np.arange(count), take)
        return table

    def _features(self, rows: Int64[np.ndarray, " k"], take: _Take) -> None:
        """Give the sums of features of some voxels, block by block, from several threads."""
        target, row_of, weight_of = self._pairs
        start, row, weight = np.zeros(self._count + 1, np.int64), np.empty_like(row_of), np.empty_like(weight_of)
        kernels.group_pairs(target, row_of, weight_of, start, row, weight)
        feature, scale = _read_only(np.asarray(self._feature)), _read_only(np.asarray(self._scale))

        def work(block: slice) -> None:
            summed = np.empty((block.stop - block.start, feature.shape[1]), np.float32)
            kernels.sum_features(rows[block], start, row, weight, feature, scale, summed)
            take(block, summed)

        with ThreadPoolExecutor(usable_cores()) as pool:
            list(pool.map(work, blocks(len(rows), feature.shape[1])))


class _Sums:
    """The sums of some submaps at other poses, without features; what goes where is in its pairs.

    Attributes:
        count: of voxels.
        index: which each is, with room for more.
        sums: `kernels.SUM_COLUMNS` of each.
        counts: `kernels.COUNT_COLUMNS` of each.
    """

    def __init__(self, submaps: Submaps, numbers: range, moved: Float64[np.ndarray, "f 3 4"]) -> None:
        """Add up these submaps, whose frames move so."""
        self.count, self._pair, self._brick = 0, 0, 0
        self._make_bricks(_BRICKS)
        own = int(submaps.row_offsets[numbers.stop] - submaps.row_offsets[numbers.start])
        self._make_room(kernels.MOST_SAMPLES + own // 2)
        self._make_pairs(kernels.MOST_SAMPLES + _PAIRS_PER_VOXEL * own)
        for number in numbers:
            rows = slice(*(int(at) for at in submaps.row_offsets[number : number + 2]))
            frames = slice(*(int(at) for at in submaps.frame_offsets[number : number + 2]))
            part = tuple(_read_only(np.ascontiguousarray(getattr(submaps, name)[rows])) for name in _FIELDS)
            _require_within(part[0], moved[frames])
            spread = _read_only(np.ascontiguousarray(submaps.spread[rows]).view(np.uint16))
            self._add(number + 1, rows.start, part, spread, np.ascontiguousarray(moved[frames]))

    def pairs(self) -> _Pairs:
        """Return the row here, the row of all submaps and the weight of each feature that counts."""
        target, row, weight = self._pairs
        return target[: self._pair], row[: self._pair], weight[: self._pair]

    def join(self, others: "_Sums") -> None:
        """Add the sums of submaps that come after these."""
        self._make_room(self.count + others.count)
        self._make_bricks(self._brick + others._brick)
        self._make_pairs(self._pair + others._pair)
        to, (_, bricks, rows) = np.empty(others.count, np.int32), others._bricks
        part = others.index[: others.count], others.sums, others.counts
        part_bricks = bricks[: others._brick], rows
        here = self._bricks, self.index, self.sums, self.counts
        count, brick = kernels.join_rows(part, part_bricks, *here, (self.count, self._brick), to)
        pairs = slice(self._pair, self._pair + others._pair)
        target, row, weight = others.pairs()
        self._pairs[0][pairs], self._pairs[1][pairs], self._pairs[2][pairs] = to[target], row, weight
        self.count, self._brick, self._pair = int(count), int(brick), pairs.stop

    def _add(
        self,
        number: int,
        first: int,
        part: tuple[np.ndarray, ...],
        spread: UInt16[np.ndarray, "n 10"],
        moved: Float64[np.ndarray, "f 3 4"],
    ) -> None:
        """Add one submap."""
        done = 0
        while done < len(spread):
            place = number, first, self.count, done, self._pair, self._brick
            count, done, pair, brick = kernels.move_rows(
                part, spread, moved, self._bricks, self.index, self.sums, self.counts, place, self._pairs
            )
            self.count, self._pair, self._brick = int(count), int(pair), int(brick)
            if done == len(spread):
                return
            if self.count > len(self.index) - kernels.MOST_SAMPLES:
                self._make_room(2 * len(self.index))
            if self._pair > len(self._pairs[0]) - kernels.MOST_SAMPLES:
                self._make_pairs(2 * len(self._pairs[0]))
            if self._brick > len(self._bricks[2]) - kernels.MOST_BRICKS:
                self._make_bricks(2 * len(self._bricks[2]))

    def _make_room(self, rows: int) -> None:
        """Make room for this many voxels; what is not touched takes no memory."""
        if self.count:
            self.index, self.sums = with_rows(self.index, rows), with_rows(self.sums, rows)
            self.counts = with_rows(self.counts, rows)
        else:
            self.index, self.sums = np.zeros((rows, 3), np.int32), np.zeros((rows, kernels.SUM_COLUMNS))
            self.counts = np.zeros((rows, kernels.COUNT_COLUMNS), np.int32)

    def _make_bricks(self, most: int) -> None:
        """Make room for this many bricks."""
        if self._brick and most <= len(self._bricks[2]):
            return
        rows = np.full((most, kernels.BRICK_VOXELS), -1, np.int32)
        index, slots = np.zeros((most, 3), np.int32), np.full(1 << (2 * most).bit_length(), -1, np.int32)
        if self._brick:
            _, known, held = self._bricks
            index[: self._brick], rows[: self._brick] = known[: self._brick], held[: self._brick]
        rehash(slots, index, self._brick)
        self._bricks: kernels.Bricks = slots, index, rows

    def _make_pairs(self, most: int) -> None:
        """Make room for this many pairs, whose rows are 32-bit: 2 billion voxels are half a terabyte of features."""
        if self._pair and most <= len(self._pairs[0]):
            return
        every = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.float32)
        for column, array in enumerate(every):
            array[: self._pair] = self._pairs[column][: self._pair] if self._pair else ()
        self._pairs: _Pairs = every


def _read_only(array: np.ndarray) -> np.ndarray:
    """Return an array as memory-mapped ones are, so that the kernel is compiled once."""
    view = array.view(np.ndarray)
    view.flags.writeable = False
    return view


def _require_within(index: Int32[np.ndarray, "n 3"], to: Float64[np.ndarray, "f 3 4"]) -> None:
    farthest = np.abs(to[:, :, :3]).sum(axis=2).max(initial=0.0) * np.abs(index).max(initial=0) + np.abs(
        to[:, :, 3]
    ).max(initial=0.0)
    if not farthest < FARTHEST:
        raise MapError(
            f"The poses move a part of the map by {farthest:.3g} voxels from the world's origin, more than "
            f"{FARTHEST:.3g}; move the world's origin nearer to the map."
        )
