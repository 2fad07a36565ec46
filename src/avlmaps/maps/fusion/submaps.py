"""Submaps: the sums of some frames at a time, and the map that they add up to when their frames have moved.

A submap has its voxels in the world of the poses that its frames were fused with, and nothing changes them. Corrected
poses give each of its frames a motion; a voxel moves with the frame in the middle of those that saw it, as a small
lattice of samples that has the mean and the spread of its points; each sample carries its part of the sums into the
voxel where it falls. Samples stay within their voxel, so that a shift by whole voxels moves voxels, and no shift
changes nothing. What is merged are sums, so that a map follows any number of corrections, and no error adds up.
"""

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Float64, Int, Int8, Int32, UInt16
from avlmaps.core.columns import offsets_of
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse
from avlmaps.maps.fusion.kernels import fall_into_cells, sum_moved
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable, VoxelViews, blocks, unit_rows
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import Submaps, Voxels

FARTHEST = float((1 << 31) - (1 << 22))  # voxels; indices are int32
_MOST = (1 << 31) - 1
_LEAST_HITS = 0.5  # a voxel gets less than this part of a hit from one that moves: it has none
_CELLS = 64  # a voxel that moves meets at most three along each axis; four are counted, as a power of two
_CHUNK = 1 << 15  # voxels whose samples are in memory


def submap_of(
    sums: VoxelSums,
    stamps_s: Float64[np.ndarray, " f"],
    poses: Float64[np.ndarray, "f 4 4"],
    clear_mm: UInt16[np.ndarray, "f_or_0 rows columns"],
) -> Submaps:
    """Return one submap, of sums with a spread."""
    feature, scale = in_steps(np.asarray(sums.feature_sum), np.asarray(sums.weight))
    return Submaps(
        row_offsets=np.array([0, len(sums)], np.int64),
        index=np.asarray(sums.index),
        feature=feature,
        feature_scale=scale,
        weight=np.asarray(sums.weight).astype(np.float32),
        rgb_sum=np.asarray(sums.rgb_sum).astype(np.float32),
        rgb_weight=np.asarray(sums.rgb_weight).astype(np.float32),
        hits=np.minimum(sums.hits, _MOST).astype(np.int32),
        views=np.asarray(sums.views),
        sharp=np.minimum(sums.sharp, _MOST).astype(np.int32),
        last_seen_s=np.asarray(sums.last_seen_s),
        spread=_spread_of(sums).astype(np.float16),
        frame_offsets=np.array([0, len(stamps_s)], np.int64),
        stamp_s=np.asarray(stamps_s, np.float64),
        fused_pose=np.asarray(poses, np.float64),
        pose=np.asarray(poses, np.float64),
        clear_mm=clear_mm,
    )


def in_steps(
    feature_sum: Float[np.ndarray, "n d"], weight: Float64[np.ndarray, " n"]
) -> tuple[Int8[np.ndarray, "n d"], Float32[np.ndarray, " n"]]:
    """Return mean features in 254 steps from minus to plus their largest magnitude, and how large a step of each is.

    What is rounded is at most half a step, 1/254 of the largest number, and differs from submap to submap.

    Args:
        feature_sum: sums of weight times feature.
        weight: of each; a voxel without one has no feature.
    """
    most = np.abs(feature_sum).max(axis=1, initial=0.0).astype(np.float32)
    known = (most > 0.0) & (weight > 0.0)
    factor = np.divide(127.0, most, out=np.zeros_like(most), where=known)
    scale = np.divide(most, 127.0 * weight, out=np.zeros(len(most)), where=known)
    return np.rint(feature_sum * factor[:, None]).astype(np.int8), scale.astype(np.float32)


def _spread_of(sums: VoxelSums) -> Float[np.ndarray, "n 10"]:
    mean = np.asarray(sums.spread) / np.maximum(sums.hits, 1)[:, None]
    x, y, z, xx, xy, xz, yy, yz, zz, number = mean.T
    lxx = np.sqrt(np.maximum(xx - x * x, 0.0))
    lyx, lzx = (_over(cross, lxx) for cross in (xy - x * y, xz - x * z))
    lyy = np.sqrt(np.maximum(yy - y * y - lyx * lyx, 0.0))
    lzy = _over(yz - y * z - lyx * lzx, lyy)
    lzz = np.sqrt(np.maximum(zz - z * z - lzx * lzx - lzy * lzy, 0.0))
    return np.stack([x, y, z, lxx, lyx, lyy, lzx, lzy, lzz, number], axis=1)


def _over(value: Float[np.ndarray, " n"], by: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return np.divide(value, by, out=np.zeros_like(value), where=by > 1e-6)


class MovedSubmaps:
    """Submaps, added up at other poses of their frames: their surface at once, features for the voxels that are asked.

    What goes where is in pairs: a row here, a row of all submaps, and the share of it that moves there.
    """

    def __init__(self, submaps: Submaps, pose: Float64[np.ndarray, "f 4 4"], grid: GridSpec) -> None:
        """Add up what is no feature.

        Raises:
            MapError: the poses lie too far from the world's origin for voxels.
        """
        self._submaps, self._table = submaps, VoxelTable(0)
        moved = (pose @ inverse(np.asarray(submaps.fused_pose)))[:, :3]
        moved[:, :, 3] /= grid.voxel_size_m
        pairs: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        for number in range(len(submaps)):
            frames = slice(*(int(at) for at in submaps.frame_offsets[number : number + 2]))
            rows = range(*(int(at) for at in submaps.row_offsets[number : number + 2]))
            views = np.zeros(0, np.int32)  # of this submap in each voxel
            for start in rows[::_CHUNK]:
                chunk = slice(start, min(start + _CHUNK, rows.stop))
                pairs.append(self._move(chunk, moved[frames]))
                to, row, share = pairs[-1]
                hit = np.maximum((share * submaps.hits[row] + 0.5).astype(np.int64), 1)
                seen = np.minimum(submaps.views[row], hit).astype(np.int32)  # no more frames than hits
                views = np.concatenate([views, np.zeros(self._table.count - len(views), np.int32)])
                np.maximum.at(views, to, seen)  # the frames of a submap count once in a voxel
                np.add.at(self._table.hits, to, hit)
            self._table.views[: len(views)] += views
        self._pairs = tuple(np.concatenate(column) for column in zip(*pairs, strict=True))
        self._order = self._table.sort_rows()

    def evidence(self) -> VoxelViews:
        """Return the evidence of each voxel's surface, sorted by index, for `free_space.clean`."""
        return self._table.evidence()

    def voxels(self, kept: Bool[np.ndarray, " n"] | None = None) -> Voxels:
        """Return the means, sorted by index: features of unit length, colours.

        Args:
            kept: which voxels of `evidence` to return; all by default.
        """
        plain, rows = self._table.voxels(kept=kept), self._order if kept is None else self._order[kept]
        feature = np.empty((len(rows), self._submaps.feature.shape[1]), np.float16)
        for block in blocks(len(rows), feature.shape[1]):
            feature[block] = unit_rows(self._features(rows[block]))
        return Voxels(plain.index, feature, plain.weight, plain.rgb, plain.last_seen_s, plain.hits)

    def table(self) -> VoxelTable:
        """Return the sums as a table, to which frames can be added."""
        sums = self._table.sums()
        made = VoxelTable(self._submaps.feature.shape[1])
        made.add(VoxelSums(**{**_fields(sums), "feature_sum": self._features(self._order)}))
        return made

    def _move(self, chunk: slice, moved: Float64[np.ndarray, "f 3 4"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Add some voxels of a submap, and return their pairs."""
        submaps, table = self._submaps, self._table
        index, hits = np.asarray(submaps.index[chunk], np.float64), np.asarray(submaps.hits[chunk])
        lies = np.asarray(submaps.spread[chunk], np.float64)
        motion = moved[np.clip(np.rint(lies[:, 9]).astype(np.int64), 0, len(moved) - 1)]
        middle = np.einsum("nij,nj->ni", motion[:, :, :3], index + 0.5) + motion[:, :, 3]
        farthest = np.abs(middle).max(initial=0.0)
        if not farthest < FARTHEST:
            raise MapError(
                f"The poses move a part of the map by {farthest:.3g} voxels from the world's origin, more than "
                f"{FARTHEST:.3g}; move the world's origin nearer to the map."
            )
        base = np.floor(middle).astype(np.int64)
        count = np.zeros((len(lies), _CELLS), np.int32)
        fall_into_cells(lies, np.ascontiguousarray(motion[:, :, :3]), middle - base, count)
        sliver = count * hits[:, None] < _LEAST_HITS * count.sum(axis=1)[:, None]
        some = np.any(~sliver & (count > 0), axis=1)
        count[sliver & some[:, None]] = 0
        source, cell = np.nonzero(count)
        share = count[source, cell] / count.sum(axis=1)[source]
        target = base[source] + np.stack([cell >> 4, (cell >> 2) & 3, cell & 3], axis=1) - 1
        distinct, of = _unique_rows(target)
        rows, row = table.enter(distinct, -np.inf), source + chunk.start

        def summed(values: np.ndarray) -> np.ndarray:
            return np.bincount(of, share * np.asarray(values)[source], minlength=len(distinct))

        last_seen_s = np.full(len(distinct), -np.inf)
        np.maximum.at(last_seen_s, of, np.asarray(submaps.last_seen_s)[row])
        table.last_seen_s[rows] = np.maximum(table.last_seen_s[rows], last_seen_s)
        table.weight[rows] += summed(submaps.weight[chunk])
        table.rgb_weight[rows] += summed(submaps.rgb_weight[chunk])
        for colour in range(3):
            table.rgb_sum[rows, colour] += summed(submaps.rgb_sum[chunk, colour])
        sharp = np.floor(share * np.asarray(submaps.sharp[chunk])[source] + 0.5)
        table.sharp[rows] += np.bincount(of, sharp, minlength=len(distinct)).astype(np.int64)
        to = rows[of]
        return to, row.astype(np.int32), share.astype(np.float32)

    def _features(self, rows: Int[np.ndarray, " k"]) -> Float32[np.ndarray, "k d"]:
        to, source, share = self._pairs
        place = np.full(self._table.count, -1)
        place[rows] = np.arange(len(rows))
        some = np.flatnonzero(place[to] >= 0) if len(rows) < self._table.count else np.arange(len(to))
        some = some[np.argsort(place[to[some]], kind="stable")]
        starts = offsets_of(np.bincount(place[to[some]], minlength=len(rows)))
        own = source[some]
        weight = share[some] * np.asarray(self._submaps.weight)[own] * np.asarray(self._submaps.feature_scale)[own]
        feature = np.asarray(self._submaps.feature).view(np.ndarray)
        feature.flags.writeable = False  # as memory-mapped ones are, so that the loop is compiled once
        summed = np.empty((len(rows), feature.shape[1]), np.float32)
        sum_moved(starts, np.ascontiguousarray(own), weight.astype(np.float32), feature, summed)
        return summed


def _unique_rows(index: Int[np.ndarray, "n 3"]) -> tuple[Int32[np.ndarray, "m 3"], Int[np.ndarray, " n"]]:
    low = index.min(axis=0, initial=0)
    span = [int(size) for size in index.max(axis=0, initial=0) - low + 1]
    if span[0] * span[1] * span[2] >= 1 << 62:
        distinct, of = np.unique(index, axis=0, return_inverse=True)
        return distinct.astype(np.int32), of.ravel()
    i, j, k = (index - low).T
    _, first, of = np.unique((i * span[1] + j) * span[2] + k, return_index=True, return_inverse=True)
    return index[first].astype(np.int32), of


def _fields(sums: VoxelSums) -> dict[str, np.ndarray]:
    return {name: getattr(sums, name) for name in VoxelSums.__dataclass_fields__}
