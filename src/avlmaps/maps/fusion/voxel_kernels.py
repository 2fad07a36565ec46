"""The compiled loops over a table of voxels: finding rows by index, adding rows, finishing features."""

import numpy as np
from jaxtyping import Float32, Float64, Int, Int32, UInt16
from numba import njit

from avlmaps.core.kernel_types import Options, Whole

# (index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s) of a map's rows
Geometry = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]

# No "nnan" among them: NaN must stay visible. "reassoc" lets sums over a row be vectorised.
OPTIONS: Options = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}
REASSOCIATING: Options = {**OPTIONS, "fastmath": {"contract", "nsz", "reassoc"}}


@njit(**OPTIONS)
def _hash(i: Whole, j: Whole, k: Whole):
    mixed = np.int64(i) * np.int64(73856093) ^ np.int64(j) * np.int64(19349669) ^ np.int64(k) * np.int64(83492791)
    mixed = mixed * np.int64(-7046029254386353131)
    return mixed ^ (mixed >> 29)


@njit(**OPTIONS)
def find_or_insert(
    i: Whole, j: Whole, k: Whole, table: Int32[np.ndarray, " slots"], index: Int32[np.ndarray, "rows 3"], count: Whole
):
    """Return the row of a voxel, entering it as row ``count`` where it is new; the table must have room."""
    mask = table.shape[0] - 1
    slot = _hash(i, j, k) & mask
    while table[slot] >= 0:
        row = table[slot]
        if index[row, 0] == i and index[row, 1] == j and index[row, 2] == k:
            return row
        slot = (slot + 1) & mask
    table[slot] = count
    index[count, 0] = i
    index[count, 1] = j
    index[count, 2] = k
    return np.int32(count)


@njit(**OPTIONS)
def find_row(i: Whole, j: Whole, k: Whole, table: Int32[np.ndarray, " slots"], index: Int32[np.ndarray, "rows 3"]):
    """Return the row of a voxel, -1 where it is not in the table."""
    mask = table.shape[0] - 1
    slot = _hash(i, j, k) & mask
    while table[slot] >= 0:
        row = table[slot]
        if index[row, 0] == i and index[row, 1] == j and index[row, 2] == k:
            return row
        slot = (slot + 1) & mask
    return np.int32(-1)


@njit(**OPTIONS)
def look_up_views(
    wanted: Int32[np.ndarray, "n 3"],
    table: Int32[np.ndarray, " slots"],
    index: Int32[np.ndarray, "rows 3"],
    views: Int32[np.ndarray, " rows"],
    found: Int32[np.ndarray, " n"],
):
    """Write how many frames have a pixel in each of some voxels; 0 where one is not in the table."""
    for at in range(wanted.shape[0]):
        row = find_row(wanted[at, 0], wanted[at, 1], wanted[at, 2], table, index)
        found[at] = views[row] if row >= 0 else 0


@njit(**OPTIONS)
def rehash(table: Int32[np.ndarray, " slots"], index: Int32[np.ndarray, "rows 3"], count: Whole):
    """Enter the first ``count`` voxels into an empty (all -1) table."""
    mask = table.shape[0] - 1
    for row in range(count):
        slot = _hash(index[row, 0], index[row, 1], index[row, 2]) & mask
        while table[slot] >= 0:
            slot = (slot + 1) & mask
        table[slot] = row


@njit(**OPTIONS)
def add_rows(
    part: tuple[np.ndarray, ...],
    table: Int32[np.ndarray, " slots"],
    sums: Geometry,
    feature_sum: Float32[np.ndarray, "rows d"],
    weight: Float64[np.ndarray, " rows"],
    count: Whole,
):
    """Add voxels of another map to this one; the table and the sums must have room for all of them.

    Args:
        part: (index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s, feature_sum, weight) of the other's voxels.
        table: hash table of rows.
        sums: (index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s), added to.
        feature_sum: (rows, d), added to.
        weight: (rows,), added to.
        count: number of voxels in this map already.

    Returns:
        Count of voxels now.
    """
    index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s = sums
    part_index, part_rgb, part_rgb_weight, part_hits, part_views, part_sharp, part_last_seen = part[:7]
    part_feature, part_weight = part[7:]
    for n in range(part_index.shape[0]):
        row = find_or_insert(part_index[n, 0], part_index[n, 1], part_index[n, 2], table, index, count)
        last_seen_s[row] = part_last_seen[n] if row == count else max(last_seen_s[row], part_last_seen[n])
        if row == count:
            count += 1
        for colour in range(3):
            rgb_sum[row, colour] += part_rgb[n, colour]
        rgb_weight[row] += part_rgb_weight[n]
        hits[row] += part_hits[n]
        views[row] += part_views[n]
        sharp[row] += part_sharp[n]
        weight[row] += part_weight[n]
        for column in range(feature_sum.shape[1]):
            feature_sum[row, column] += part_feature[n, column]
    return count


@njit(**REASSOCIATING)
def _scale_of(feature_sum: Float32[np.ndarray, "rows d"], row: Whole):
    """Return what makes a row of length 1; 0 where it is zero."""
    square = 0.0
    for column in range(feature_sum.shape[1]):
        square += np.float64(feature_sum[row, column]) ** 2
    return 1.0 / np.sqrt(square) if square > 0.0 else 0.0


@njit(**OPTIONS)
def unit_rows(feature_sum: Float32[np.ndarray, "rows d"], rows: Int[np.ndarray, " n"], out: UInt16[np.ndarray, "n d"]):
    """Write rows of ``feature_sum`` scaled to length 1 (a zero row stays zero) as the bits of float16 numbers.

    They are rounded to the nearest, and to even where two are as near, as NumPy does; Numba has no numbers of that
    type. What is NaN stays NaN.
    """
    unit, dim = np.empty(out.shape[1], np.float32), out.shape[1]
    bits, shifted = unit.view(np.uint32), np.empty(dim, np.float32)
    small = shifted.view(np.uint32)
    for n in range(rows.shape[0]):
        scale = _scale_of(feature_sum, rows[n])
        for column in range(dim):
            unit[column] = feature_sum[rows[n], column] * scale
            shifted[column] = abs(unit[column]) + np.float32(0.5)  # what is below the least exponent ends in its bits
        for column in range(dim):
            size = bits[column] & np.uint32(0x7FFFFFFF)
            odd = (size >> np.uint32(13)) & np.uint32(1)
            half = (size - np.uint32(0x38000000) + np.uint32(0xFFF) + odd) >> np.uint32(13)
            half = small[column] - np.uint32(0x3F000000) if size < np.uint32(0x38800000) else half
            half = np.uint32(0x7E00) if size > np.uint32(0x477FE000) else half
            out[n, column] = np.uint16(half | ((bits[column] >> np.uint32(16)) & np.uint32(0x8000)))
