"""Submaps: the sums of some frames at a time, and the map that they add up to when their frames have moved.

A submap has its voxels in the world of the poses that its frames were fused with, and nothing changes them. Corrected
poses give each of its frames a motion; a voxel moves with the frame in the middle of those that saw it. What is merged
then are sums, so that a map follows any number of corrections, one after the other, and no error adds up.
"""

import numpy as np

from avlmaps.core.arrays import Float, Float32, Float64, Int8, UInt16
from avlmaps.maps.fusion.submap_kernels import round_to_steps
from avlmaps.maps.fusion.voxel_sums import VoxelSums
from avlmaps.maps.types import Submaps

_MOST = (1 << 31) - 1


def submap_of(
    sums: VoxelSums,
    spread: Float32[np.ndarray, "n 10"],
    stamps_s: Float64[np.ndarray, " f"],
    poses: Float64[np.ndarray, "f 4 4"],
    clear_mm: UInt16[np.ndarray, "f_or_0 rows columns"],
) -> Submaps:
    """Return one submap."""
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
        spread=spread.astype(np.float16),
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
    steps, scale = np.empty(feature_sum.shape, np.int8), np.empty(len(feature_sum), np.float32)
    round_to_steps(np.array(feature_sum, np.float32, order="C"), np.array(weight, np.float64), steps, scale)
    return steps, scale
