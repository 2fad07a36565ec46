"""Submaps: the sums of some frames at a time, and the map that they add up to when their frames have moved.

A submap has its voxels in the world of the poses that its frames were fused with, and nothing changes them. Corrected
poses give each of its frames a motion; a voxel moves with the frame in the middle of those that saw it, as a small
lattice of samples that has the mean and the spread of its points; each sample carries its part of the sums into the
voxel where it falls. Samples stay within their voxel, so that a shift by whole voxels moves voxels, and no shift
changes nothing. What is merged are sums, so that a map follows any number of corrections, and no error adds up.
"""

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Float64, Int, Int8, UInt16
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse
from avlmaps.maps.fusion.kernels import fall_into_cells
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable, VoxelViews, blocks, unit_rows
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import Submaps, Voxels

FARTHEST = float((1 << 31) - (1 << 22))  # voxels; indices are int32
_MOST = (1 << 31) - 1
_CELLS = 27  # a voxel that moves meets at most three along each axis


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

    What is rounded is at most half a step, 1/254 of the largest number, and differs from submap to submap. A voxel
    without weight has no feature.
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
        """Add up what is no feature."""
        self._submaps, self._table = submaps, VoxelTable(0)
        moved = (pose @ inverse(np.asarray(submaps.fused_pose)))[:, :3]
        moved[:, :, 3] /= grid.voxel_size_m
        pairs = [self._move(number, moved) for number in range(len(submaps))]
        to, row, share, hits = (np.concatenate(column) for column in zip(*pairs, strict=True))
        self._pairs = to, row, share
        table, count = self._table, self._table.count

        def summed(values: np.ndarray) -> np.ndarray:
            return np.bincount(to, values, minlength=count)

        table.hits[:count] = summed(hits)
        table.sharp[:count] = summed(np.floor(share * np.asarray(submaps.sharp)[row] + 0.5))
        table.weight[:count] = summed(share * np.asarray(submaps.weight)[row])
        table.rgb_weight[:count] = summed(share * np.asarray(submaps.rgb_weight)[row])
        for colour in range(3):
            table.rgb_sum[:count, colour] = summed(share * np.asarray(submaps.rgb_sum)[row, colour])
        np.maximum.at(table.last_seen_s, to, np.asarray(submaps.last_seen_s)[row])
        self._order = table.sort_rows()

    def evidence(self) -> VoxelViews:
        """Return the evidence of each voxel's surface, sorted by index, for `free_space.clean`."""
        return self._table.evidence()

    def voxels(self, kept: Bool[np.ndarray, " n"] | None = None) -> Voxels:
        """Return the means of the ``kept`` of `evidence`, sorted by index: features of unit length, colours."""
        plain, rows = self._table.voxels(kept=kept), self._order if kept is None else self._order[kept]
        feature = np.empty((len(rows), self._submaps.feature.shape[1]), np.float16)
        for block in blocks(len(rows), feature.shape[1]):
            feature[block] = unit_rows(self._features(rows[block]))
        return Voxels(plain.index, feature, plain.weight, plain.rgb, plain.last_seen_s, plain.hits)

    def add_to(self, total: VoxelTable) -> None:
        """Add the sums to a table, to which frames can be added."""
        total.merge(replace(self._table.sums(), feature_sum=self._features(self._order)))

    def _move(self, number: int, moved: Float64[np.ndarray, "f 3 4"]) -> tuple[np.ndarray, ...]:
        submaps, table = self._submaps, self._table
        frames = slice(*(int(at) for at in submaps.frame_offsets[number : number + 2]))
        rows = slice(*(int(at) for at in submaps.row_offsets[number : number + 2]))
        index, hits = np.asarray(submaps.index[rows], np.float64), np.array(submaps.hits[rows])
        lies, motions = np.asarray(submaps.spread[rows], np.float64), moved[frames]
        motion = motions[np.clip(np.rint(lies[:, 9]).astype(np.int64), 0, len(motions) - 1)]
        middle = np.einsum("nij,nj->ni", motion[:, :, :3], index + 0.5) + motion[:, :, 3]
        farthest = np.abs(middle).max(initial=0.0)
        if not farthest < FARTHEST:
            raise MapError(
                f"The poses move a part of the map by {farthest:.3g} voxels from the world's origin, more than "
                f"{FARTHEST:.3g}; move the world's origin nearer to the map."
            )
        most = _CELLS * len(lies)
        cell, source, share = np.empty((most, 3), np.int32), np.empty(most, np.int32), np.empty(most, np.float32)
        turn = np.ascontiguousarray(motion[:, :, :3])
        count = int(fall_into_cells(lies, turn, middle, hits, cell, source, share))
        to, row, share = table.rows_of(cell[:count]), source[:count] + np.int32(rows.start), share[:count].copy()
        own = np.maximum((share * np.asarray(submaps.hits)[row] + 0.5).astype(np.int64), 1)
        seen = np.minimum(np.asarray(submaps.views)[row], own)  # no more frames than hits
        views = np.zeros(table.count, np.int32)
        np.maximum.at(views, to, seen.astype(np.int32))  # the frames of a submap count once in a voxel
        table.views[: table.count] += views
        return to, row, share, own

    @cached_property
    def _shares(self) -> Any:
        from scipy.sparse import csr_array

        submaps, (to, row, share) = self._submaps, self._pairs
        weight = share * np.asarray(submaps.weight)[row] * np.asarray(submaps.feature_scale)[row]
        return csr_array((weight.astype(np.float32), (to, row)), (self._table.count, len(submaps.weight)))

    def _features(self, rows: Int[np.ndarray, " k"]) -> Float32[np.ndarray, "k d"]:
        some = self._shares[rows]
        used, some.indices = np.unique(some.indices, return_inverse=True)
        some = type(some)((some.data, some.indices, some.indptr), (len(rows), len(used)))
        return some @ np.asarray(self._submaps.feature)[used].astype(np.float32)
