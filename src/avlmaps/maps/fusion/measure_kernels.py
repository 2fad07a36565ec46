"""The first compiled step of fusion: measuring a frame.

`trace` walks the depth picture row by row, finds the voxel of every pixel and adds up, for each voxel that the
frame touches, colour and hits, and for each *pair* of a voxel and a cell of the feature map the weight. A frame
of 300 thousand pixels has some 3,400 voxels and 33 thousand pairs, so that features are read once for a pair
instead of once for a pixel. The second step is in `avlmaps.maps.fusion.add_kernels`.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64, UInt8
from numba import njit

from avlmaps.core.kernel_types import Real, Whole
from avlmaps.maps.fusion.voxel_kernels import OPTIONS

# A voxel within one frame is named by one integer: three offsets from the camera's voxel, 21 bits each.
OFFSET_BITS = 21
REACH_VOXELS = 1 << (OFFSET_BITS - 1)
# Remembers which pair was used last for a (voxel, cell). A miss costs a second pair and no error.
RECENT_PAIRS = 1 << 13
# The hash table of the frame's voxels begins with this many slots and doubles when it is half full.
FIRST_SLOTS = 1 << 11
# Columns of what a frame adds to each voxel.
RED, GREEN, BLUE, RGB_WEIGHT, HITS, SHARP = range(6)
SUM_COLUMNS = 8  # one cache line
# How exact a hit is, from 0 to 1, is counted in these units: sums of whole numbers are the same in any order.
SHARP_UNITS = 256

# exp(-e) = table[n] · exp(-r) with n = floor(64 e) and r in [0, 1/64); five terms are right to 2e-14, and four
# times faster than a call of exp, because the loop is vectorised.
STEPS = 64
GREATEST_EXPONENT = 30.0 * np.log(10.0)
_EXPONENTIALS = np.exp(-np.arange(STEPS * (int(GREATEST_EXPONENT) + 1) + 1) / STEPS)

# As `trace` takes them.
Pose = tuple[np.ndarray, np.ndarray, np.ndarray]
Limits = tuple[float, float, float, float, float, float]
Projection = tuple[bool, np.ndarray, tuple[float, float, float, float], tuple[int, int], tuple[int, int]]


class Scratch(NamedTuple):
    """Working memory of the kernels between their steps, for pictures of one size; only the touched part costs memory.

    Of each pixel of a row: ``key`` (of its voxel), ``weight``, ``sharp`` (how exact its depth is), ``picture``
    (its colour pixel), ``cell`` (its cell of the feature map), the latter two linear indices, -1 outside. Of the
    frame's voxels: a hash table (``slot_key``, ``slot_voxel``), ``voxel_key``, ``voxel_sum`` (what the frame
    adds), ``voxel_row`` (where in the map), ``voxel_start`` (where their pairs begin in ``grouped_cell`` and
    ``grouped_weight``). Of each pair, as they are met: ``pair_voxel``, ``pair_cell``, ``pair_weight``; ``recent``
    remembers those used last. Of one voxel: ``live_cell`` and ``live_weight``, the pairs that have a feature.
    """

    key: np.ndarray
    weight: np.ndarray
    sharp: np.ndarray
    picture: np.ndarray
    cell: np.ndarray
    slot_key: np.ndarray
    slot_voxel: np.ndarray
    voxel_key: np.ndarray
    voxel_sum: np.ndarray
    voxel_row: np.ndarray
    voxel_start: np.ndarray
    pair_voxel: np.ndarray
    pair_cell: np.ndarray
    pair_weight: np.ndarray
    grouped_cell: np.ndarray
    grouped_weight: np.ndarray
    recent: np.ndarray
    live_cell: np.ndarray
    live_weight: np.ndarray


def make_scratch(height: int, width: int) -> Scratch:
    """Allocate the scratch for depth pictures of one size: no frame has more voxels or pairs than pixels."""
    pixels = height * width
    slots = max(FIRST_SLOTS, 1 << (2 * pixels + 1).bit_length())
    return Scratch(
        key=np.empty(width, np.int64),
        weight=np.empty(width, np.float64),
        sharp=np.empty(width, np.int64),
        picture=np.empty(width, np.int32),
        cell=np.empty(width, np.int32),
        slot_key=np.empty(slots, np.int64),
        slot_voxel=np.empty(slots, np.int32),
        voxel_key=np.empty(pixels, np.int64),
        voxel_sum=np.empty((pixels, SUM_COLUMNS), np.float64),
        voxel_row=np.empty(pixels, np.int32),
        voxel_start=np.empty(pixels + 1, np.int64),
        pair_voxel=np.empty(pixels, np.int32),
        pair_cell=np.empty(pixels, np.int32),
        pair_weight=np.empty(pixels, np.float64),
        grouped_cell=np.empty(pixels, np.int32),
        grouped_weight=np.empty(pixels, np.float64),
        recent=np.empty(RECENT_PAIRS, np.int32),
        live_cell=np.empty(pixels + 4, np.int64),
        live_weight=np.empty(pixels + 4, np.float32),
    )


@njit(**OPTIONS)
def _measure_row(
    depth: Float32[np.ndarray, " w"],
    x: Float64[np.ndarray, " w"],
    y: Real,
    pose: Pose,
    limits: Limits,
    key: Int64[np.ndarray, " w"],
    weight: Float64[np.ndarray, " w"],
    sharp: Int64[np.ndarray, " w"],
):
    """Find the voxel (as an offset key, -1 without depth), the weight and the exactness of every pixel of a row."""
    rotation, translation, origin = pose
    voxel_size, nearest, farthest, falloff, noise, noise_growth = limits
    half = np.int64(REACH_VOXELS)
    bx = rotation[0, 1] * y + rotation[0, 2]
    by = rotation[1, 1] * y + rotation[1, 2]
    bz = rotation[2, 1] * y + rotation[2, 2]
    for u in range(depth.shape[0]):
        z = np.float64(depth[u])
        valid = (z >= nearest) & (z <= farthest)
        z = z if valid else 0.0
        px = translation[0] + z * (rotation[0, 0] * x[u] + bx)
        py = translation[1] + z * (rotation[1, 0] * x[u] + by)
        pz = translation[2] + z * (rotation[2, 0] * x[u] + bz)
        i = np.int64(np.floor(px / voxel_size)) - origin[0]
        j = np.int64(np.floor(py / voxel_size)) - origin[1]
        k = np.int64(np.floor(pz / voxel_size)) - origin[2]
        packed = ((i + half) << (2 * OFFSET_BITS)) | ((j + half) << OFFSET_BITS) | (k + half)
        key[u] = packed if valid else -1
        exponent = min(z * z * (x[u] * x[u] + y * y + 1.0) * falloff, GREATEST_EXPONENT)
        step = np.int32(exponent * STEPS)
        r = exponent - step * (1.0 / STEPS)
        series = 1.0 - r * (1.0 - r * (1 / 2 - r * (1 / 6 - r * (1 / 24 - r * (1 / 120)))))
        error = noise + noise_growth * z * z
        exact = 1.0 / (1.0 + error * error)
        weight[u] = _EXPONENTIALS[np.uint32(step)] * series * exact
        sharp[u] = np.int64(SHARP_UNITS * exact + 0.5)


@njit(**OPTIONS)
def _project_row(
    depth: Float32[np.ndarray, " w"],
    x: Float64[np.ndarray, " w"],
    y: Real,
    projection: Projection,
    picture: Int32[np.ndarray, " w"],
    cell: Int32[np.ndarray, " w"],
):
    """Find the colour pixel and the feature cell (linear, -1 outside) of every pixel of a row, by projection."""
    _, rgb_from_depth, (fx, fy, cx, cy), (height, width), (cell_rows, cell_columns) = projection
    rows_ratio, columns_ratio = cell_rows / height, cell_columns / width
    ax = rgb_from_depth[0, 1] * y + rgb_from_depth[0, 2]
    ay = rgb_from_depth[1, 1] * y + rgb_from_depth[1, 2]
    az = rgb_from_depth[2, 1] * y + rgb_from_depth[2, 2]
    for u in range(depth.shape[0]):
        z = np.float64(depth[u])
        px = z * (rgb_from_depth[0, 0] * x[u] + ax) + rgb_from_depth[0, 3]
        py = z * (rgb_from_depth[1, 0] * x[u] + ay) + rgb_from_depth[1, 3]
        pz = z * (rgb_from_depth[2, 0] * x[u] + az) + rgb_from_depth[2, 3]
        column, row = fx * px / pz + cx, fy * py / pz + cy
        inside = (pz > 0.0) & (column >= 0.0) & (column < width) & (row >= 0.0) & (row < height)
        column, row = (column, row) if inside else (0.0, 0.0)
        picture[u] = np.int32(row) * np.int32(width) + np.int32(column) if inside else -1
        linear = np.int32(row * rows_ratio) * np.int32(cell_columns) + np.int32(column * columns_ratio)
        cell[u] = linear if inside and cell_columns > 0 else -1


@njit(**OPTIONS)
def _combine_row(of_column: Int32[np.ndarray, " w"], of_row: Whole, out: Int32[np.ndarray, " w"]):
    """Write the linear index of a row of pixels from tables of their column and row, -1 outside."""
    for u in range(of_column.shape[0]):
        out[u] = of_column[u] + of_row if (of_column[u] >= 0) & (of_row >= 0) else -1


@njit(**OPTIONS)
def _find_slot(slot_key: Int64[np.ndarray, " slots"], mask: Whole, key: Whole):
    """Return the slot that holds the key, or the free one where it belongs."""
    slot = ((key * np.int64(-7046029254386353131)) >> 40) & mask
    while slot_key[slot] != key and slot_key[slot] != -1:
        slot = (slot + 1) & mask
    return slot


@njit(**OPTIONS)
def _enter_voxel(slot: Whole, key: Whole, scratch: Scratch, voxels: Whole, mask: Whole):
    """Number a voxel that the frame had not met, and double the table when it is half full; return its mask."""
    scratch.slot_key[slot] = key
    scratch.slot_voxel[slot] = voxels
    scratch.voxel_key[voxels] = key
    for column in range(SUM_COLUMNS):
        scratch.voxel_sum[voxels, column] = 0.0
    if 2 * (voxels + 1) <= mask:
        return mask
    mask = 2 * mask + 1
    for slot in range(mask + 1):
        scratch.slot_key[slot] = -1
    for voxel in range(voxels + 1):
        slot = _find_slot(scratch.slot_key, mask, scratch.voxel_key[voxel])
        scratch.slot_key[slot] = scratch.voxel_key[voxel]
        scratch.slot_voxel[slot] = voxel
    return mask


@njit(**OPTIONS)
def _add_pair(
    voxel: Whole,
    cell: Whole,
    amount: Real,
    recent: Int32[np.ndarray, " recent"],
    pair_voxel: Int32[np.ndarray, " pairs"],
    pair_cell: Int32[np.ndarray, " pairs"],
    pair_weight: Float64[np.ndarray, " pairs"],
    pairs: Whole,
):
    """Add weight to the pair (voxel, cell) if it was met lately, else begin a new one; return the count of pairs."""
    slot = (np.int64(cell) * 5 + np.int64(voxel) * 1237) & (RECENT_PAIRS - 1)
    pair = recent[slot]
    if pair >= 0 and pair_voxel[pair] == voxel and pair_cell[pair] == cell:
        pair_weight[pair] += amount
        return pairs
    recent[slot] = pairs
    pair_voxel[pairs] = voxel
    pair_cell[pairs] = cell
    pair_weight[pairs] = amount
    return pairs + 1


@njit(**OPTIONS)
def _add_run(
    u: Whole,
    keys: Int64[np.ndarray, " w"],
    cells: Int32[np.ndarray, " w"],
    weights: Float64[np.ndarray, " w"],
    sharp: Int64[np.ndarray, " w"],
    picture: Int32[np.ndarray, " w"],
    rgb: UInt8[np.ndarray, "pixels 3"],
    voxel: Whole,
    voxel_sum: Float64[np.ndarray, "voxels columns"],
):
    """Add the pixels from ``u`` on that share voxel and cell to the voxel; return where they end and their weight."""
    key, cell = keys[u], cells[u]
    start = u
    total = red = green = blue = seen = 0.0
    exact = np.int64(0)
    while u < keys.shape[0] and keys[u] == key and cells[u] == cell:
        weight = weights[u]
        total += weight
        exact += sharp[u]
        pixel = picture[u]
        if pixel >= 0:
            seen += weight
            red += weight * rgb[pixel, 0]
            green += weight * rgb[pixel, 1]
            blue += weight * rgb[pixel, 2]
        u += 1
    voxel_sum[voxel, RED] += red
    voxel_sum[voxel, GREEN] += green
    voxel_sum[voxel, BLUE] += blue
    voxel_sum[voxel, RGB_WEIGHT] += seen
    voxel_sum[voxel, HITS] += u - start
    voxel_sum[voxel, SHARP] += exact
    return u, total


@njit(**OPTIONS)
def trace(
    depth: Float32[np.ndarray, "h w"],
    rays: tuple[np.ndarray, np.ndarray],
    pose: Pose,
    limits: Limits,
    rgb: UInt8[np.ndarray, "pixels 3"],
    tables: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    projection: Projection,
    scratch: Scratch,
):
    """Measure one frame: its voxels, with what they get of colour and hits, and its pairs of voxel and cell.

    Args:
        depth: (h, w) float32, metres.
        rays: (x (w,), y (h,)), camera-frame direction of each column and row at z = 1.
        pose: (rotation (3, 3), translation (3,), origin (3,) int64: the camera's voxel).
        limits: (voxel size, least and greatest depth in metres, 1 / (2 variance), error of a depth in half voxels at
            0 m and its growth with the depth's square).
        rgb: (H * W, 3) uint8.
        tables: see `pixel_lookup.PixelLookup`.
        projection: likewise.
        scratch: receives the voxels and the pairs.

    Returns:
        Counts of points, of voxels and of pairs.
    """
    # Single arrays go to the innermost functions: a whole scratch would have each of its arrays counted as held.
    keys, cells, weights, picture = scratch.key, scratch.cell, scratch.weight, scratch.picture
    sharp = scratch.sharp
    slot_key, slot_voxel, voxel_sum = scratch.slot_key, scratch.slot_voxel, scratch.voxel_sum
    recent, pair_voxel, pair_cell, pair_weight = (
        scratch.recent,
        scratch.pair_voxel,
        scratch.pair_cell,
        scratch.pair_weight,
    )
    mask = np.int64(FIRST_SLOTS - 1)
    slot_key[:FIRST_SLOTS] = -1
    recent[:] = -1
    points = voxels = pairs = voxel = np.int64(0)
    last_key = np.int64(-1)
    for v in range(depth.shape[0]):
        _measure_row(depth[v], rays[0], rays[1][v], pose, limits, keys, weights, sharp)
        if projection[0]:
            _project_row(depth[v], rays[0], rays[1][v], projection, picture, cells)
        else:
            _combine_row(tables[0], tables[1][v], picture)
            _combine_row(tables[2], tables[3][v], cells)
        u = np.int64(0)
        while u < depth.shape[1]:
            key, cell = keys[u], cells[u]
            if key < 0:
                u += 1
                continue
            if key != last_key:
                last_key = key
                slot = _find_slot(slot_key, mask, key)
                if slot_key[slot] == key:
                    voxel = np.int64(slot_voxel[slot])
                else:
                    voxel = voxels
                    mask = _enter_voxel(slot, key, scratch, voxels, mask)
                    voxels += 1
            end, weight = _add_run(u, keys, cells, weights, sharp, picture, rgb, voxel, voxel_sum)
            points += end - u
            u = end
            if cell >= 0:
                pairs = _add_pair(voxel, cell, weight, recent, pair_voxel, pair_cell, pair_weight, pairs)
    return points, voxels, pairs
