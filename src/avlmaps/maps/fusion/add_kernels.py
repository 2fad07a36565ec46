"""The second compiled step of fusion: adding a traced frame to the map.

`commit` adds colour and hits and finds the map's row of each of the frame's voxels; `flush` adds the features voxel by
voxel, each sum formed in the first-level cache before its row is touched: reading a frame's features from memory,
and reading and writing rows of 2 KB, is what limits fusion.
"""

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, Int64
from numba import njit

from avlmaps.core.kernel_types import Real, Whole
from avlmaps.maps.fusion.measure_kernels import (
    BLUE,
    GREEN,
    HITS,
    OFFSET_BITS,
    REACH_VOXELS,
    RED,
    RGB_WEIGHT,
    SHARP,
    Scratch,
)
from avlmaps.maps.fusion.voxel_kernels import OPTIONS, REASSOCIATING, Geometry, find_or_insert


@njit(**OPTIONS)
def commit(
    voxels: Whole,
    scratch: Scratch,
    origin: Int64[np.ndarray, "3"],
    stamp_s: Real,
    slots: Int32[np.ndarray, " slots"],
    geometry: Geometry,
    count: Whole,
):
    """Add colour and hits of a traced frame to the map, and find the map's row of each of the frame's voxels.

    Args:
        voxels: count of the frame's voxels.
        scratch: as `trace` left it; receives the rows.
        origin: (3,) the camera's voxel.
        stamp_s: when the frame was taken.
        slots: hash table of the map, with room.
        geometry: (index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s) of the map, added to.
        count: number of voxels in the map already.

    Returns:
        Count of voxels now.
    """
    index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s = geometry
    lowest = (1 << OFFSET_BITS) - 1
    for voxel in range(voxels):
        key = scratch.voxel_key[voxel]
        i = np.int32((key >> (2 * OFFSET_BITS)) - REACH_VOXELS + origin[0])
        j = np.int32(((key >> OFFSET_BITS) & lowest) - REACH_VOXELS + origin[1])
        k = np.int32((key & lowest) - REACH_VOXELS + origin[2])
        row = find_or_insert(i, j, k, slots, index, count)
        last_seen_s[row] = stamp_s if row == count else max(last_seen_s[row], stamp_s)
        if row == count:
            count += 1
        scratch.voxel_row[voxel] = row
        rgb_sum[row, 0] += scratch.voxel_sum[voxel, RED]
        rgb_sum[row, 1] += scratch.voxel_sum[voxel, GREEN]
        rgb_sum[row, 2] += scratch.voxel_sum[voxel, BLUE]
        rgb_weight[row] += scratch.voxel_sum[voxel, RGB_WEIGHT]
        hits[row] += np.int64(scratch.voxel_sum[voxel, HITS])
        views[row] += 1
        sharp[row] += np.int64(scratch.voxel_sum[voxel, SHARP])
    return count


@njit(**OPTIONS)
def _group_pairs(voxels: Whole, pairs: Whole, scratch: Scratch):
    """Sort pairs by voxel, by counting: those of v are ``voxel_start[v] : voxel_start[v + 1]``, as they were met."""
    start = scratch.voxel_start
    for voxel in range(voxels + 1):
        start[voxel] = 0
    for pair in range(pairs):
        start[scratch.pair_voxel[pair] + 1] += 1
    for voxel in range(voxels):
        start[voxel + 1] += start[voxel]
    for pair in range(pairs):
        voxel = scratch.pair_voxel[pair]
        place = start[voxel]
        scratch.grouped_cell[place] = scratch.pair_cell[pair]
        scratch.grouped_weight[place] = scratch.pair_weight[pair]
        start[voxel] = place + 1
    for voxel in range(voxels, 0, -1):
        start[voxel] = start[voxel - 1]
    start[0] = 0


@njit(**OPTIONS)
def _find_speaking(features: Float32[np.ndarray, "cells d"], speaks: Bool[np.ndarray, " cells"]):
    """Note which cells have a feature that is not all zero; nearly always the first number decides."""
    for cell in range(features.shape[0]):
        speaks[cell] = features[cell, 0] != 0.0
    for cell in range(features.shape[0]):
        column = 1
        while not speaks[cell] and column < features.shape[1]:
            speaks[cell] = features[cell, column] != 0.0
            column += 1


@njit(**OPTIONS)
def _gather_pairs(
    first: Whole,
    last: Whole,
    cells: Int32[np.ndarray, " pairs"],
    weights: Float64[np.ndarray, " pairs"],
    speaks: Bool[np.ndarray, " cells"],
    live_cell: Int64[np.ndarray, " live"],
    live_weight: Float32[np.ndarray, " live"],
):
    """Collect a voxel's pairs whose cell has a feature, and pad to fours; return their count and weight."""
    count = 0
    amount = 0.0
    for n in range(first, last):
        live_cell[count] = cells[n]
        live_weight[count] = weights[n]
        if speaks[cells[n]]:
            amount += weights[n]
            count += 1
    while count % 4 != 0:
        live_cell[count] = live_cell[count - 1]
        live_weight[count] = 0.0
        count += 1
    return count, amount


@njit(**OPTIONS)
def _sum_features(
    count: Whole,
    cells: Int64[np.ndarray, " live"],
    weights: Float32[np.ndarray, " live"],
    features: Float32[np.ndarray, "cells d"],
    total: Float32[np.ndarray, " d"],
):
    """Set ``total`` to the weighted sum of the cells' features; the count is a multiple of four."""
    for column in range(total.shape[0]):
        total[column] = 0.0
    for n in range(0, count, 4):
        a, b, c, d = cells[n], cells[n + 1], cells[n + 2], cells[n + 3]
        wa, wb, wc, wd = weights[n], weights[n + 1], weights[n + 2], weights[n + 3]
        for column in range(total.shape[0]):
            ab = wa * features[a, column] + wb * features[b, column]
            total[column] += ab + wc * features[c, column] + wd * features[d, column]


@njit(**REASSOCIATING)
def _add_if_finite(row: Whole, total: Float32[np.ndarray, " d"], feature_sum: Float32[np.ndarray, "rows d"]):
    """Add the total to a row of the map, unless it holds NaN or infinity; return whether it was added."""
    size = np.float32(0.0)
    for column in range(total.shape[0]):
        size += abs(total[column])
    if not size < np.inf:
        return False
    for column in range(total.shape[0]):
        feature_sum[row, column] += total[column]
    return True


@njit(**OPTIONS)
def flush(
    voxels: Whole,
    pairs: Whole,
    scratch: Scratch,
    features: Float32[np.ndarray, "cells d"],
    feature_sum: Float32[np.ndarray, "rows d"],
    weight: Float64[np.ndarray, " rows"],
):
    """Add the features of a traced and committed frame to the map.

    Args:
        voxels: count of the frame's voxels.
        pairs: count of its pairs.
        scratch: as `commit` left it.
        features: (cells, d) float32; a feature that is all zero adds neither itself nor weight.
        feature_sum: (rows, d) float32, added to.
        weight: (rows,) float64, added to.

    Returns:
        How many voxels were passed over because their features are not finite.
    """
    _group_pairs(voxels, pairs, scratch)
    speaks = np.empty(features.shape[0], np.bool_)
    _find_speaking(features, speaks)
    start, cells, weights = scratch.voxel_start, scratch.grouped_cell, scratch.grouped_weight
    live_cell, live_weight, rows = scratch.live_cell, scratch.live_weight, scratch.voxel_row
    total = np.empty(features.shape[1], np.float32)
    faults = 0
    for voxel in range(voxels):
        count, amount = _gather_pairs(start[voxel], start[voxel + 1], cells, weights, speaks, live_cell, live_weight)
        if count > 0:
            _sum_features(count, live_cell, live_weight, features, total)
            if _add_if_finite(rows[voxel], total, feature_sum):
                weight[rows[voxel]] += amount
            else:
                faults += 1
    return faults
