"""The compiled loops of a map: all that is done for every pixel, or for every pair of a voxel and a frame.

`trace` walks a depth picture, finds the voxel of every pixel and adds up, for each voxel that the frame touches, colour
and hits, and for each *pair* of a voxel and a cell of the feature map the weight. A frame of 300 thousand pixels has
some 3,400 voxels and 33 thousand pairs, so that `add_features` reads a feature once for a pair instead of for a pixel.
"""

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64, UInt8, UInt16
from numba import njit

from avlmaps.core.machine import Options, Real, Whole

# No "nnan" among them: NaN must stay visible. "reassoc" lets sums over a row be vectorised.
OPTIONS: Options = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "reassoc"}}

# A voxel within one frame is named by one integer: three offsets from the camera's voxel, 21 bits each.
OFFSET_BITS = 21
REACH_VOXELS = 1 << (OFFSET_BITS - 1)
# Remembers which pair was used last for a (voxel, cell). A miss costs a second pair and no error.
RECENT_PAIRS = 1 << 13
# Columns of what a frame adds to each voxel.
RED, GREEN, BLUE, RGB_WEIGHT, HITS, SHARP = range(6)
SUM_COLUMNS = 8  # one cache line
SPREAD_COLUMNS = 10  # the last one: the number of the frame in its submap
# How exact a hit is, from 0 to 1, is counted in these units: sums of whole numbers are the same in any order.
SHARP_UNITS = 256

# exp(-e) = table[n] · exp(-r) with n = floor(64 e) and r in [0, 1/64); five terms are right to 2e-14, and four
# times faster than a call of exp, because the loop is vectorised.
STEPS = 64
GREATEST_EXPONENT = 30.0 * np.log(10.0)
_EXPONENTIALS = np.exp(-np.arange(STEPS * (int(GREATEST_EXPONENT) + 1) + 1) / STEPS)

Pose = tuple[np.ndarray, np.ndarray, np.ndarray]
Limits = tuple[float, float, float, float, float, float]
Projection = tuple[bool, np.ndarray, tuple[float, float, float, float], tuple[int, int], tuple[int, int]]
# Of the pixels of a row: key (of its voxel), weight, sharp (how exact), picture (its colour pixel), cell.
Row = tuple[np.ndarray, ...]
# Of the frame's voxels: a hash table (key of each slot, its voxel), the key of each, its sums, and where its points lie
# in it: sums of x, y, z from its middle, in voxels, and of their products xx, xy, xz, yy, yz, zz (or no columns).
FrameVoxels = tuple[np.ndarray, ...]
# Of the map: slots, index, and the sums of `VoxelSums` but those of features.
Table = tuple[np.ndarray, ...]
# Of each pair as it was met: its cell, its weight, the pair of the same voxel before; the last of each voxel; the pairs
# that were used last, and the voxel and cell of each of these in one number.
Pairs = tuple[np.ndarray, ...]


@njit(**OPTIONS)
def _slot_of(i: Whole, j: Whole, k: Whole, slots: Int32[np.ndarray, " slots"], index: Int32[np.ndarray, "rows 3"]):
    mask = np.int64(slots.shape[0] - 1)
    mixed = i * np.int64(73856093) ^ j * np.int64(19349669) ^ k * np.int64(83492791)
    mixed = mixed * np.int64(-7046029254386353131)
    slot = (mixed ^ (mixed >> 29)) & mask
    row = np.int64(slots[slot])
    while row >= 0 and (index[row, 0] != i or index[row, 1] != j or index[row, 2] != k):
        slot = (slot + 1) & mask
        row = np.int64(slots[slot])
    return slot


@njit(**OPTIONS)
def find_rows(
    wanted: Int32[np.ndarray, "n 3"],
    slots: Int32[np.ndarray, " slots"],
    index: Int32[np.ndarray, "rows 3"],
    count: Whole,
    enter: bool,
    found: Int32[np.ndarray, " n"],
):
    """Write the row of each voxel into ``found``, -1 where it is not in the table; return how many voxels that has.

    ``slots`` is a hash table of rows, -1 free, of a power of two. With ``enter`` a voxel that is not there gets the
    next row; there is room.
    """
    count = np.int64(count)
    for n in range(wanted.shape[0]):
        i, j, k = np.int64(wanted[n, 0]), np.int64(wanted[n, 1]), np.int64(wanted[n, 2])
        slot = _slot_of(i, j, k, slots, index)
        if slots[slot] < 0 and enter:
            slots[slot] = count
            index[count, 0], index[count, 1], index[count, 2] = i, j, k
            count += 1
        found[n] = slots[slot]
    return count


@njit(**OPTIONS)
def trace(
    depth: Float32[np.ndarray, "h w"],
    rays: tuple[np.ndarray, np.ndarray],
    pose: Pose,
    limits: Limits,
    rgb: UInt8[np.ndarray, "pixels 3"],
    tables: tuple[np.ndarray, ...],
    projection: Projection,
    row: Row,
    voxels: FrameVoxels,
    pairs: Pairs,
):
    """Measure one frame: its voxels, with what they get of colour and hits, and its pairs of voxel and cell.

    ``rays`` are the camera-frame directions of columns and rows at z = 1; ``pose`` is rotation, translation and the
    camera's voxel; ``limits`` are the voxel size, least and greatest depth in metres, 1 / (2 variance), and the error
    of a depth in half voxels at 0 m and its growth with the depth's square. For ``tables`` and ``projection`` see
    `accumulator.PixelLookup`. Voxels and pairs are filled in; returned are the counts of points, voxels and pairs, -1
    where there are too many voxels for the table.
    """
    keys, weights, sharp, picture, cells = row
    slot_key, slot_voxel, voxel_key, voxel_sum, voxel_spread = voxels
    pair_cell, pair_weight, pair_before, last_pair, recent, recent_name = pairs
    (x, y), (rotation, translation, origin) = rays, pose
    voxel_size, nearest, farthest, falloff, noise, noise_growth = limits
    projected, to_rgb, (fx, fy, cx, cy), (height, width), (cell_rows, cell_columns) = projection
    columns_of, rows_of, cell_columns_of, cell_rows_of = tables
    half, mask, last_key = np.int64(REACH_VOXELS), np.int64(slot_key.shape[0] - 1), np.int64(-1)
    lowest, middle, spreads = (np.int64(1) << OFFSET_BITS) - 1, np.zeros(3), voxel_spread.shape[1] > 0
    slot_key[:] = -1
    recent_name[:] = -1
    points = count = paired = voxel = np.int64(0)
    for v in range(depth.shape[0]):
        bx = rotation[0, 1] * y[v] + rotation[0, 2]
        by = rotation[1, 1] * y[v] + rotation[1, 2]
        bz = rotation[2, 1] * y[v] + rotation[2, 2]
        for u in range(depth.shape[1]):
            z = np.float64(depth[v, u])
            valid = (z >= nearest) & (z <= farthest)
            z = z if valid else 0.0
            px = translation[0] + z * (rotation[0, 0] * x[u] + bx)
            py = translation[1] + z * (rotation[1, 0] * x[u] + by)
            pz = translation[2] + z * (rotation[2, 0] * x[u] + bz)
            i = np.int64(np.floor(px / voxel_size)) - origin[0]
            j = np.int64(np.floor(py / voxel_size)) - origin[1]
            k = np.int64(np.floor(pz / voxel_size)) - origin[2]
            packed = ((i + half) << (2 * OFFSET_BITS)) | ((j + half) << OFFSET_BITS) | (k + half)
            keys[u] = packed if valid else -1
            exponent = min(z * z * (x[u] * x[u] + y[v] * y[v] + 1.0) * falloff, GREATEST_EXPONENT)
            step = np.int32(exponent * STEPS)
            r = exponent - step * (1.0 / STEPS)
            series = 1.0 - r * (1.0 - r * (1 / 2 - r * (1 / 6 - r * (1 / 24 - r * (1 / 120)))))
            error = noise + noise_growth * z * z
            exact = 1.0 / (1.0 + error * error)
            weights[u] = _EXPONENTIALS[np.uint32(step)] * series * exact
            sharp[u] = np.int64(SHARP_UNITS * exact + 0.5)
        for u in range(depth.shape[1]):
            if not projected:
                has = (columns_of[u] >= 0) & (rows_of[v] >= 0)
                picture[u] = columns_of[u] + rows_of[v] if has else -1
                has = (cell_columns_of[u] >= 0) & (cell_rows_of[v] >= 0)
                cells[u] = cell_columns_of[u] + cell_rows_of[v] if has else -1
                continue
            z = np.float64(depth[v, u])
            ahead = z * (to_rgb[2, 0] * x[u] + to_rgb[2, 1] * y[v] + to_rgb[2, 2]) + to_rgb[2, 3]
            across = z * (to_rgb[0, 0] * x[u] + to_rgb[0, 1] * y[v] + to_rgb[0, 2]) + to_rgb[0, 3]
            down = z * (to_rgb[1, 0] * x[u] + to_rgb[1, 1] * y[v] + to_rgb[1, 2]) + to_rgb[1, 3]
            column, line = fx * across / ahead + cx, fy * down / ahead + cy
            inside = (ahead > 0.0) & (column >= 0.0) & (column < width) & (line >= 0.0) & (line < height)
            column, line = (column, line) if inside else (0.0, 0.0)
            picture[u] = np.int32(line) * np.int32(width) + np.int32(column) if inside else -1
            cell_row, cell_column = np.int32(line * (cell_rows / height)), np.int32(column * (cell_columns / width))
            cells[u] = cell_row * np.int32(cell_columns) + cell_column if inside and cell_columns > 0 else -1
        u = np.int64(0)
        while u < depth.shape[1]:
            key = keys[u]
            if key < 0:
                u += 1
                continue
            if key != last_key:
                last_key = key
                slot = ((key * np.int64(-7046029254386353131)) >> 40) & mask
                while slot_key[slot] != key and slot_key[slot] != -1:
                    slot = (slot + 1) & mask
                if slot_key[slot] == -1:
                    if 2 * count >= mask:
                        return points, np.int64(0), np.int64(-1)
                    slot_key[slot], slot_voxel[slot], voxel_key[count], last_pair[count] = key, count, key, -1
                    voxel_sum[count] = 0.0
                    voxel_spread[count] = 0.0
                    count += 1
                voxel = np.int64(slot_voxel[slot])
                for axis in range(3):  # the middle of the voxel
                    middle[axis] = ((key >> (OFFSET_BITS * (2 - axis))) & lowest) - half + origin[axis] + 0.5
            first, exact_sum = u, np.int64(0)
            red = green = blue = seen = 0.0
            while u < depth.shape[1] and keys[u] == key:
                cell, total = cells[u], 0.0
                while u < depth.shape[1] and (keys[u] == key) & (cells[u] == cell):
                    weight, pixel = weights[u], picture[u]
                    total += weight
                    exact_sum += sharp[u]
                    if pixel >= 0:
                        seen += weight
                        red += weight * rgb[pixel, 0]
                        green += weight * rgb[pixel, 1]
                        blue += weight * rgb[pixel, 2]
                    if spreads:
                        z = np.float64(depth[v, u])
                        a = (translation[0] + z * (rotation[0, 0] * x[u] + bx)) / voxel_size - middle[0]
                        b = (translation[1] + z * (rotation[1, 0] * x[u] + by)) / voxel_size - middle[1]
                        c = (translation[2] + z * (rotation[2, 0] * x[u] + bz)) / voxel_size - middle[2]
                        for column, value in enumerate((a, b, c, a * a, a * b, a * c, b * b, b * c, c * c)):
                            voxel_spread[voxel, column] += value
                    u += 1
                if cell < 0:
                    continue
                place, name = (np.int64(cell) * 5 + voxel * 1237) & (RECENT_PAIRS - 1), voxel << 32 | np.int64(cell)
                if recent_name[place] == name:
                    pair_weight[recent[place]] += total
                    continue
                recent[place], recent_name[place], pair_cell[paired], pair_weight[paired] = paired, name, cell, total
                pair_before[paired], last_pair[voxel] = last_pair[voxel], paired
                paired += 1
            points += u - first
            voxel_sum[voxel, RED] += red
            voxel_sum[voxel, GREEN] += green
            voxel_sum[voxel, BLUE] += blue
            voxel_sum[voxel, RGB_WEIGHT] += seen
            voxel_sum[voxel, HITS] += u - first
            voxel_sum[voxel, SHARP] += exact_sum
    return points, count, paired


@njit(**OPTIONS)
def add_features(
    rows: Int32[np.ndarray, " voxels"],
    pairs: Pairs,
    features: Float32[np.ndarray, "cells d"],
    feature_sum: Float32[np.ndarray, "rows d"],
    weight: Float64[np.ndarray, " rows"],
):
    """Add the features of a traced frame to the map; return how many voxels were left out as theirs are not finite.

    ``rows`` are the map's for the frame's voxels, ``pairs`` as `trace` left them. A cell that is all zero adds neither
    itself nor weight. Each sum is formed in the first-level cache before its row is touched: reading a frame's features
    from memory, and reading and writing rows of 2 KB, is what limits fusion.
    """
    pair_cell, pair_weight, pair_before, last_pair = pairs[:4]
    dim, most, faults = features.shape[1], pair_cell.shape[0], 0
    total = np.empty(dim, np.float32)
    live, share = np.empty(most + 4, np.int64), np.empty(most + 4, np.float32)
    for voxel in range(rows.shape[0]):
        first, amount, pair = most, 0.0, last_pair[voxel]
        while pair >= 0:
            cell, column = pair_cell[pair], 0
            while column < dim and features[cell, column] == 0.0:  # nearly always the first number decides
                column += 1
            if column < dim:
                amount += pair_weight[pair]
                first -= 1  # from the back: pairs are met the last one first, and read as they lie in memory
                live[first], share[first] = cell, pair_weight[pair]
            pair = pair_before[pair]
        total[:] = 0.0
        live[most : most + 3], share[most : most + 3] = live[first], 0.0
        for n in range(first, most, 4):  # four at once: the sum is read and written a quarter as often
            a, b, c, d = live[n], live[n + 1], live[n + 2], live[n + 3]
            of_a, of_b, of_c, of_d = share[n], share[n + 1], share[n + 2], share[n + 3]
            for column in range(dim):
                ab = of_a * features[a, column] + of_b * features[b, column]
                total[column] += ab + of_c * features[c, column] + of_d * features[d, column]
        if amount == 0.0:
            continue
        size = np.float32(0.0)
        for column in range(dim):
            size += abs(total[column])
        if not size < np.inf:
            faults += 1
            continue
        row = np.int64(rows[voxel])  # looked up once, or the loop is not vectorised: sums might lie over rows
        weight[row] += amount
        for column in range(dim):
            feature_sum[row, column] += total[column]
    return faults


@njit(**OPTIONS)
def commit(
    frame: tuple[Whole, Whole, Real],
    origin: Int64[np.ndarray, "3"],
    voxels: FrameVoxels,
    table: Table,
    count: Whole,
    rows: Int32[np.ndarray, " voxels"],
):
    """Add what a traced frame brings to its voxels to the map's table; return how many voxels that has then.

    ``frame`` is how many voxels it has, its number in its submap, and its stamp in seconds; ``origin`` the camera's
    voxel; ``voxels`` are as `trace` left them. The table has ``count`` voxels, and room. The row of each voxel is
    filled in.
    """
    _, _, voxel_key, voxel_sum, voxel_spread = voxels
    slots, index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s, spread = table
    (own, number, stamp_s), count = frame, np.int64(count)
    half, lowest = np.int64(REACH_VOXELS), (np.int64(1) << OFFSET_BITS) - 1
    for voxel in range(own):
        key = voxel_key[voxel]
        i = (key >> (2 * OFFSET_BITS)) - half + origin[0]
        j, k = ((key >> OFFSET_BITS) & lowest) - half + origin[1], (key & lowest) - half + origin[2]
        slot = _slot_of(i, j, k, slots, index)
        if slots[slot] < 0:
            slots[slot], last_seen_s[count] = count, stamp_s
            index[count, 0], index[count, 1], index[count, 2] = i, j, k
            count += 1
        row = np.int64(slots[slot])
        rows[voxel] = row
        for colour in range(3):
            rgb_sum[row, colour] += voxel_sum[voxel, colour]
        rgb_weight[row] += voxel_sum[voxel, RGB_WEIGHT]
        hits[row] += np.int64(voxel_sum[voxel, HITS])
        views[row] += 1
        sharp[row] += np.int64(voxel_sum[voxel, SHARP])
        last_seen_s[row] = max(last_seen_s[row], stamp_s)
        for column in range(voxel_spread.shape[1]):
            spread[row, column] += voxel_spread[voxel, column]
        if voxel_spread.shape[1] > 0:
            spread[row, SPREAD_COLUMNS - 1] += number * voxel_sum[voxel, HITS]
    return count


@njit(**OPTIONS)
def drop_flying(
    depth: Float32[np.ndarray, "h w"],
    slope: tuple[float, float],
    noise: tuple[float, float],
    edge_sigmas: Real,
    out: Float32[np.ndarray, "h w"],
):
    """Copy a depth picture without the pixels that lie between a nearer and a farther surface; those become 0.

    ``slope`` is by how much the depth changes from one column, and from one row, to the next on the most grazing
    surface at 1 m; ``noise`` is σ at 0 m and its growth with z². A neighbour is on another surface when it is
    ``edge_sigmas`` σ off.
    """
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            out[v, u] = z
            sigma = edge_sigmas * (noise[0] + noise[1] * z * z)
            for axis in range(2 if z > 0.0 else 0):
                near_before = far_before = near_after = far_after = False
                for step in range(1, 3):
                    off = sigma + step * slope[axis] * z
                    if axis == 0:
                        before, after = depth[v, max(u - step, 0)], depth[v, min(u + step, width - 1)]
                    else:
                        before, after = depth[max(v - step, 0), u], depth[min(v + step, height - 1), u]
                    near_before |= (before > 0.0) & (before < z - off)
                    far_before |= before > z + off
                    near_after |= (after > 0.0) & (after < z - off)
                    far_after |= after > z + off
                if (near_before & far_after) | (near_after & far_before):
                    out[v, u] = 0.0


@njit(**OPTIONS)
def count_frames(
    index: Int32[np.ndarray, "n 3"],
    starts: Int64[np.ndarray, " cubes1"],
    visible: UInt8[np.ndarray, "k cubes"],
    voxel_size: Real,
    clear: UInt16[np.ndarray, "k rows columns"],
    size: Whole,
    camera: tuple[float, float, float, float, int, int],
    pose: Float64[np.ndarray, "k 4 4"],
    through: Int32[np.ndarray, " n"],
):
    """Add to each voxel how many views see through it: all rays that may meet it are free for an edge behind it.

    Voxels lie cube by cube: ``starts`` is where those of each cube begin, and where the last end; ``visible`` which
    cubes each view may see through. ``clear`` is millimetres up to which each block of ``size`` pixels is free;
    ``camera`` is fx, fy, cx, cy, width, height.
    """
    fx, fy, cx, cy, width, height = camera
    ball = 0.5 * np.sqrt(3.0) * voxel_size  # the sphere round a voxel
    behind = ball + voxel_size
    for frame in range(clear.shape[0]):
        x0, y0, z0, tx = pose[frame, 0, 0], pose[frame, 1, 0], pose[frame, 2, 0], pose[frame, 0, 3]
        x1, y1, z1, ty = pose[frame, 0, 1], pose[frame, 1, 1], pose[frame, 2, 1], pose[frame, 1, 3]
        x2, y2, z2, tz = pose[frame, 0, 2], pose[frame, 1, 2], pose[frame, 2, 2], pose[frame, 2, 3]
        for cube in range(visible.shape[1]):
            for n in range(starts[cube], starts[cube + 1] if visible[frame, cube] else starts[cube]):
                x = (index[n, 0] + 0.5) * voxel_size - tx
                y = (index[n, 1] + 0.5) * voxel_size - ty
                z = (index[n, 2] + 0.5) * voxel_size - tz
                depth = x2 * x + y2 * y + z2 * z
                if depth <= 2.0 * ball:
                    continue
                a, b = (x0 * x + y0 * y + z0 * z) / depth, (x1 * x + y1 * y + z1 * z) / depth
                u, v = fx * a + cx, fy * b + cy
                # a rectangle that holds the picture of the sphere round the voxel
                wide, high = fx * ball * (1.0 + abs(a)) / (depth - ball), fy * ball * (1.0 + abs(b)) / (depth - ball)
                if u - wide < 0.0 or v - high < 0.0 or u + wide >= width or v + high >= height:
                    continue
                far, free = np.int64((depth + behind) * 1000.0) + 1, True
                if clear[frame, np.int64(v) // size, np.int64(u) // size] < far:
                    continue
                for i in range(np.int64(v - high) // size, np.int64(v + high) // size + 1):
                    for j in range(np.int64(u - wide) // size, np.int64(u + wide) // size + 1):
                        free &= clear[frame, i, j] >= far
                through[n] += free


@njit(**OPTIONS)
def fall_into_cells(
    lies: Float64[np.ndarray, "n 10"],
    turn: Float64[np.ndarray, "n 3 3"],
    middle: Float64[np.ndarray, "n 3"],
    hits: Int32[np.ndarray, " n"],
    cell: Int32[np.ndarray, "pairs 3"],
    source: Int32[np.ndarray, " pairs"],
    share: Float32[np.ndarray, " pairs"],
):
    """Write into which voxels samples of voxels that move fall, in pairs; return how many pairs there are.

    ``lies`` is mean and factor of the covariance of the points within each voxel (see `submaps`), ``turn`` its
    rotation, ``middle`` where its middle falls, in voxels. What gets less than half a pixel of its ``hits`` gets
    nothing, unless all do. Of each pair are filled in the cell, the source, which has 27 at most, and the share of it.
    """
    even, within = 12.0**0.5, 0.4999  # an even spread over a length has a standard deviation of the length over this
    count, steps, pairs = np.zeros(64, np.int64), np.zeros(3, np.int64), np.int64(0)
    for n in range(lies.shape[0]):
        xx, yx, yy, zx, zy, zz = lies[n, 3], lies[n, 4], lies[n, 5], lies[n, 6], lies[n, 7], lies[n, 8]
        sigmas = np.sqrt(xx * xx + yx * yx + zx * zx), np.sqrt(yy * yy + zy * zy), zz
        for axis in range(3):
            steps[axis] = np.int64(min(max(np.ceil(sigmas[axis] * even * 4 - 0.2), 1.0), 4.0))
        first, second, third = steps[0], steps[1], steps[2]
        base = np.floor(middle[n, 0]), np.floor(middle[n, 1]), np.floor(middle[n, 2])
        u, v, w = middle[n, 0] - base[0], middle[n, 1] - base[1], middle[n, 2] - base[2]
        samples = first * second * third
        count[:] = 0
        for sample in range(samples):
            a = even * ((sample // (second * third) + 0.5) / first - 0.5)
            b = even * ((sample // third % second + 0.5) / second - 0.5)
            c = even * ((sample % third + 0.5) / third - 0.5)
            x = min(max(lies[n, 0] + xx * a, -within), within)
            y = min(max(lies[n, 1] + yx * a + yy * b, -within), within)
            z = min(max(lies[n, 2] + zx * a + zy * b + zz * c, -within), within)
            i = np.int64(np.floor(u + turn[n, 0, 0] * x + turn[n, 0, 1] * y + turn[n, 0, 2] * z)) + 1
            j = np.int64(np.floor(v + turn[n, 1, 0] * x + turn[n, 1, 1] * y + turn[n, 1, 2] * z)) + 1
            k = np.int64(np.floor(w + turn[n, 2, 0] * x + turn[n, 2, 1] * y + turn[n, 2, 2] * z)) + 1
            count[(i << 4 | j << 2 | k) & 63] += 1
        kept = np.int64(0)
        for number in range(64):
            kept += count[number] if 2 * count[number] * hits[n] >= samples else 0
        for number in range(64):
            if count[number] == 0 or (kept > 0 and 2 * count[number] * hits[n] < samples):
                continue
            cell[pairs, 0] = np.int32(base[0]) + (number >> 4) - 1
            cell[pairs, 1] = np.int32(base[1]) + (number >> 2 & 3) - 1
            cell[pairs, 2] = np.int32(base[2]) + (number & 3) - 1
            source[pairs], share[pairs] = n, count[number] / (kept if kept > 0 else samples)
            pairs += 1
    return pairs
