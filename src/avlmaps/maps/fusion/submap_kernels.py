"""The compiled loops of submaps: where in its voxel a surface lies, and voxels that move with their frames.

A voxel of a submap has the mean and the spread of its points within it, and the mean number of the frames that saw
it. When poses are corrected, it moves with the correction of that frame, as a small lattice of samples that has the
same mean and spread; each sample carries its part of the sums into the voxel where it falls. Samples stay within their
voxel, so that a shift by whole voxels moves voxels, and no shift changes nothing.
"""

import numpy as np
from jaxtyping import Float32, Float64, Int8, Int32, Int64, UInt16
from numba import njit

from avlmaps.core.kernel_types import Real, Whole
from avlmaps.maps.fusion.voxel_kernels import OPTIONS, find_or_insert, find_row

# Columns of the sums over a voxel's points: offsets from its middle, their products, the number of the frame.
X, Y, Z, XX, XY, XZ, YY, YZ, ZZ, NUMBER = range(10)
SPREAD_COLUMNS = 10
STEPS = 4  # samples along each axis, at most
MOST_SAMPLES = STEPS**3
EVEN = 12.0**0.5  # an even spread over a length has a standard deviation of the length over this
WITHIN = 0.4999  # voxels: samples go no farther from the middle
HIDDEN = np.float32(1.0 / 254.0)  # of a voxel's weight: as much as a feature in 254 steps is rounded by
MOSTLY = np.float32(0.9)  # of a voxel's weight: where the other looks hold less, the faint ones are many
LEAST_HITS = 0.5  # a voxel gets less than this part of a hit from one that moves: it has none
# Where each sample lies on an axis that has 0 to 4 of them, lengths of the axis from its middle.
PLACES = np.array([[(sample + 0.5) / max(steps, 1) - 0.5 for sample in range(STEPS)] for steps in range(STEPS + 1)])
OF_HALF = np.float32(2.0**112)  # a half's exponent counts from 112 later than a float32's; Numba has no halves

Pairs = tuple[np.ndarray, np.ndarray, np.ndarray]
Bricks = tuple[np.ndarray, np.ndarray, np.ndarray]
# Columns of the sums over what moves into a voxel, which lie side by side: one line of the cache for each.
RED, GREEN, BLUE, RGB_WEIGHT, WEIGHT, SHARP, HITS, LAST_SEEN = range(8)
SUM_COLUMNS = 8
# Columns of the counts of a voxel: frames, the last submap that added to it from 1, and how many frames that added.
VIEWS, LAST_SUBMAP, ITS_VIEWS = range(3)
COUNT_COLUMNS = 3
BRICK_SHIFT = 3  # the rows of the voxels of a cube of 2 to the power of this lie side by side
BRICK_VOXELS = 512
MOST_BRICKS = 8  # that a voxel moves to
_CELLS = 64  # a voxel that moves meets at most three along each axis; four are counted, as a power of two


@njit(**OPTIONS)
def add_spread(
    depth: Float32[np.ndarray, "h w"],
    rays: tuple[np.ndarray, np.ndarray],
    pose: tuple[np.ndarray, np.ndarray, np.ndarray],
    limits: tuple[float, float, float],
    number: Real,
    slots: Int32[np.ndarray, " slots"],
    index: Int32[np.ndarray, "rows 3"],
    spread: Float64[np.ndarray, "rows columns"],
):
    """Add where the points of a frame lie within their voxels, which the table has already.

    Args:
        depth: metres, as `measure_kernels.trace` took it.
        rays: (x (w,), y (h,)) as there.
        pose: likewise.
        limits: (voxel size, least and greatest depth), metres.
        number: of the frame in its submap, from 0.
        slots: hash table of the rows.
        index: (rows, 3) of the table.
        spread: (rows, SPREAD_COLUMNS), added to.
    """
    rotation, translation, _ = pose
    size, nearest, farthest = limits
    last_i = last_j = last_k = np.int64(-(1 << 40))
    row = np.int32(-1)
    for v in range(depth.shape[0]):
        y = rays[1][v]
        bx = rotation[0, 1] * y + rotation[0, 2]
        by = rotation[1, 1] * y + rotation[1, 2]
        bz = rotation[2, 1] * y + rotation[2, 2]
        for u in range(depth.shape[1]):
            z = np.float64(depth[v, u])
            if not ((z >= nearest) & (z <= farthest)):
                continue
            x = rays[0][u]
            px = (translation[0] + z * (rotation[0, 0] * x + bx)) / size
            py = (translation[1] + z * (rotation[1, 0] * x + by)) / size
            pz = (translation[2] + z * (rotation[2, 0] * x + bz)) / size
            i, j, k = np.int64(np.floor(px)), np.int64(np.floor(py)), np.int64(np.floor(pz))
            if i != last_i or j != last_j or k != last_k:
                row = find_row(i, j, k, slots, index)
                last_i, last_j, last_k = i, j, k
            if row < 0:
                continue
            a, b, c = px - i - 0.5, py - j - 0.5, pz - k - 0.5
            spread[row, X] += a
            spread[row, Y] += b
            spread[row, Z] += c
            spread[row, XX] += a * a
            spread[row, XY] += a * b
            spread[row, XZ] += a * c
            spread[row, YY] += b * b
            spread[row, YZ] += b * c
            spread[row, ZZ] += c * c
            spread[row, NUMBER] += number


@njit(**OPTIONS)
def finish_spread(
    spread: Float64[np.ndarray, "n columns"], hits: Int64[np.ndarray, " n"], out: Float32[np.ndarray, "n columns"]
):
    """Write mean, Cholesky factor of the covariance (lower: xx, yx, yy, zx, zy, zz) and mean frame number."""
    for n in range(spread.shape[0]):
        count = max(hits[n], 1)
        mx, my, mz = spread[n, X] / count, spread[n, Y] / count, spread[n, Z] / count
        xx = max(spread[n, XX] / count - mx * mx, 0.0)
        xy = spread[n, XY] / count - mx * my
        xz = spread[n, XZ] / count - mx * mz
        yy = max(spread[n, YY] / count - my * my, 0.0)
        yz = spread[n, YZ] / count - my * mz
        zz = max(spread[n, ZZ] / count - mz * mz, 0.0)
        lxx = np.sqrt(xx)
        lyx = xy / lxx if lxx > 1e-6 else 0.0
        lzx = xz / lxx if lxx > 1e-6 else 0.0
        lyy = np.sqrt(max(yy - lyx * lyx, 0.0))
        lzy = (yz - lyx * lzx) / lyy if lyy > 1e-6 else 0.0
        lzz = np.sqrt(max(zz - lzx * lzx - lzy * lzy, 0.0))
        out[n, 0], out[n, 1], out[n, 2] = mx, my, mz
        out[n, 3], out[n, 4], out[n, 5] = lxx, lyx, lyy
        out[n, 6], out[n, 7], out[n, 8] = lzx, lzy, lzz
        out[n, 9] = spread[n, NUMBER] / count


@njit(**OPTIONS)
def _steps(sigma: Real):
    """Return how many samples an axis of this standard deviation gets: four for a whole voxel."""
    return np.int64(min(max(np.ceil(sigma * EVEN * STEPS - 0.2), 1.0), STEPS))


@njit(**OPTIONS)
def _within(value: Real):
    return min(max(value, -WITHIN), WITHIN)


@njit(**OPTIONS)
def _targets(
    n: Whole,
    index: Int32[np.ndarray, "n 3"],
    lies: Float32[np.ndarray, " columns"],
    frame: Whole,
    moved: Float64[np.ndarray, "frames 3 4"],
    cell: Int64[np.ndarray, " cells"],
    share: Int64[np.ndarray, " cells"],
):
    """Write the cells in which the samples of a voxel that moves fall, and how many fall into each.

    Returns:
        Count of cells, count of samples, and the voxel in which the middle falls; cell 21 is that one.
    """
    ax, ay, az, at = moved[frame, 0, 0], moved[frame, 0, 1], moved[frame, 0, 2], moved[frame, 0, 3]
    bx, by, bz, bt = moved[frame, 1, 0], moved[frame, 1, 1], moved[frame, 1, 2], moved[frame, 1, 3]
    cx, cy, cz, ct = moved[frame, 2, 0], moved[frame, 2, 1], moved[frame, 2, 2], moved[frame, 2, 3]
    mx, my, mz = np.float64(lies[0]), np.float64(lies[1]), np.float64(lies[2])
    lxx, lyx, lyy = np.float64(lies[3]), np.float64(lies[4]), np.float64(lies[5])
    lzx, lzy, lzz = np.float64(lies[6]), np.float64(lies[7]), np.float64(lies[8])
    x, y, z = index[n, 0] + 0.5, index[n, 1] + 0.5, index[n, 2] + 0.5
    middle_x = ax * x + ay * y + az * z + at
    middle_y = bx * x + by * y + bz * z + bt
    middle_z = cx * x + cy * y + cz * z + ct
    i, j, k = np.int64(np.floor(middle_x)), np.int64(np.floor(middle_y)), np.int64(np.floor(middle_z))
    from_x, from_y, from_z = middle_x - i + 1.0, middle_y - j + 1.0, middle_z - k + 1.0  # of the lowest cell
    steps_a = _steps(np.sqrt(lxx * lxx + lyx * lyx + lzx * lzx))
    steps_b = _steps(np.sqrt(lyy * lyy + lzy * lzy))
    steps_c = _steps(lzz)
    found = 0
    for a in range(steps_a):
        ua = EVEN * PLACES[steps_a, a]
        off_x = _within(mx + lxx * ua)
        for b in range(steps_b):
            ub = EVEN * PLACES[steps_b, b]
            off_y, along_z = _within(my + lyx * ua + lyy * ub), mz + lzx * ua + lzy * ub
            for c in range(steps_c):
                off_z = _within(along_z + lzz * EVEN * PLACES[steps_c, c])
                # as far from the middle as half the diagonal of a voxel: these are positive, and cut off as floored
                p = np.int64(from_x + ax * off_x + ay * off_y + az * off_z)
                q = np.int64(from_y + bx * off_x + by * off_y + bz * off_z)
                r = np.int64(from_z + cx * off_x + cy * off_y + cz * off_z)
                place = (p * 16 + q * 4 + r) & (_CELLS - 1)
                cell[found] = place  # written over unless it is new
                found += share[place] == 0
                share[place] += 1
    return found, steps_a * steps_b * steps_c, i, j, k


@njit(**OPTIONS)
def _without_slivers(
    found: Whole, samples: Whole, hits: Whole, cell: Int64[np.ndarray, " cells"], share: Int64[np.ndarray, " cells"]
):
    """Leave out the cells that get hardly a part of a hit, unless all do; return the samples of the rest."""
    kept = 0
    for at in range(found):
        if share[cell[at]] * hits >= LEAST_HITS * samples:
            kept += share[cell[at]]
    if kept == 0:
        return samples
    for at in range(found):
        if share[cell[at]] * hits < LEAST_HITS * samples:
            share[cell[at]] = 0
    return kept


@njit(**OPTIONS)
def move_rows(
    part: tuple[np.ndarray, ...],
    spread: UInt16[np.ndarray, "n columns"],
    moved: Float64[np.ndarray, "frames 3 4"],
    bricks: Bricks,
    index: Int32[np.ndarray, "rows 3"],
    sums: Float64[np.ndarray, "rows columns"],
    counts: Int32[np.ndarray, "rows few"],
    place: tuple[int, int, int, int, int, int],
    pairs: Pairs,
):
    """Add voxels of a submap to a map, each moved as its frame was, until there is no room for another.

    Features wait for `sum_features`: which of them go where, and how much they count, is written as pairs.

    Args:
        part: (index, weight, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s) of the submap.
        spread: of `finish_spread`, the bits of its halves.
        moved: (frames, 3, 4) corrected from uncorrected world of each of its frames, voxels.
        bricks: hash table of bricks, (b, 3) which each is, (b, BRICK_VOXELS) rows of its voxels or -1.
        index: (rows, 3), those that are new are written.
        sums: (rows, SUM_COLUMNS), added to.
        counts: (rows, COUNT_COLUMNS), added to.
        place: number of this submap from 1, its first row among those of all submaps, count of voxels in the map, row
            of the submap to begin with, count of pairs, count of bricks.
        pairs: (row of the map, row of all submaps, weight) of each feature that counts, written on.

    Returns:
        Count of voxels now, the row to resume with when there is room again, count of pairs, and of bricks.
    """
    part_index, part_weight, part_rgb, part_rgb_weight, part_hits, part_views, part_sharp, part_last_seen = part
    pair_target, pair_row, pair_weight = pairs
    table, brick_index, rows = bricks
    number, first, count, begin, pair, brick_count = place
    cell, share = np.empty(_CELLS + 1, np.int64), np.zeros(_CELLS, np.int64)
    room, brick_room = index.shape[0] - MOST_SAMPLES, rows.shape[0] - MOST_BRICKS
    last_i = last_j = last_k = np.int64(1 << 40)
    brick, bits = 0, np.empty(SPREAD_COLUMNS, np.uint32)
    lies = bits.view(np.float32)
    for n in range(begin, part_index.shape[0]):
        if count > room or pair > pair_target.shape[0] - MOST_SAMPLES or brick_count > brick_room:
            return count, n, pair, brick_count
        for column in range(SPREAD_COLUMNS):
            half = np.uint32(spread[n, column])
            bits[column] = (half & np.uint32(0x8000)) << np.uint32(16) | (half & np.uint32(0x7FFF)) << np.uint32(13)
        for column in range(SPREAD_COLUMNS):
            lies[column] *= OF_HALF
        frame = min(max(np.int64(lies[NUMBER] + 0.5), 0), moved.shape[0] - 1)
        found, samples, i, j, k = _targets(n, part_index, lies, frame, moved, cell, share)
        samples = _without_slivers(found, samples, part_hits[n], cell, share)
        for at in range(found):
            shared, to = share[cell[at]], cell[at]
            share[to] = 0
            if shared == 0:
                continue
            amount = shared / samples
            x, y, z = i + (to >> 4) - 1, j + ((to >> 2) & 3) - 1, k + (to & 3) - 1
            if x >> BRICK_SHIFT != last_i or y >> BRICK_SHIFT != last_j or z >> BRICK_SHIFT != last_k:
                last_i, last_j, last_k = x >> BRICK_SHIFT, y >> BRICK_SHIFT, z >> BRICK_SHIFT
                brick = int(find_or_insert(last_i, last_j, last_k, table, brick_index, brick_count))
                brick_count += brick == brick_count
            within = ((x & 7) << 6) | ((y & 7) << 3) | (z & 7)
            row = np.int64(rows[brick, within])
            if row < 0:
                row = count
                rows[brick, within] = row
                index[row, 0], index[row, 1], index[row, 2] = x, y, z
                sums[row, LAST_SEEN] = part_last_seen[n]
                count += 1
            hit = max(np.int64(amount * part_hits[n] + 0.5), 1)
            sums[row, RED] += amount * part_rgb[n, 0]
            sums[row, GREEN] += amount * part_rgb[n, 1]
            sums[row, BLUE] += amount * part_rgb[n, 2]
            sums[row, RGB_WEIGHT] += amount * part_rgb_weight[n]
            sums[row, WEIGHT] += amount * part_weight[n]
            sums[row, SHARP] += np.floor(amount * part_sharp[n] + 0.5)
            sums[row, HITS] += hit
            sums[row, LAST_SEEN] = max(sums[row, LAST_SEEN], part_last_seen[n])
            # The frames of a submap count once in a voxel that several of its voxels move to: the most of them.
            seen = np.int32(min(part_views[n], hit))  # no more frames than hits
            if counts[row, LAST_SUBMAP] != number:
                counts[row, LAST_SUBMAP], counts[row, ITS_VIEWS] = number, 0
            before = counts[row, ITS_VIEWS]
            counts[row, VIEWS] += max(seen - before, 0)
            counts[row, ITS_VIEWS] = max(seen, before)
            pair_target[pair], pair_row[pair] = row, first + n
            pair_weight[pair] = amount * part_weight[n]
            pair += 1
    return count, part_index.shape[0], pair, brick_count


@njit(**OPTIONS)
def join_rows(
    part: tuple[np.ndarray, np.ndarray, np.ndarray],
    part_bricks: tuple[np.ndarray, np.ndarray],
    bricks: Bricks,
    index: Int32[np.ndarray, "rows 3"],
    sums: Float64[np.ndarray, "rows columns"],
    counts: Int32[np.ndarray, "rows few"],
    place: tuple[int, int],
    to: Int32[np.ndarray, " n"],
):
    """Add the voxels of other submaps to a map, which has room for them, brick by brick.

    Args:
        part: (index, sums, counts) of the others, as those of `move_rows`.
        part_bricks: (b, 3) which each of their bricks is, (b, BRICK_VOXELS) rows of its voxels or -1.
        bricks: of the map, as those of `move_rows`.
        index: likewise.
        sums: likewise.
        counts: likewise; the submaps are others, so that their frames are, too.
        place: count of voxels in the map, and of bricks.
        to: filled in with the row of the map of each.

    Returns:
        Count of voxels now, and of bricks.
    """
    part_index, part_sums, part_counts = part
    table, brick_index, rows = bricks
    others, part_rows = part_bricks
    count, brick_count = place
    for one in range(others.shape[0]):
        brick = int(find_or_insert(others[one, 0], others[one, 1], others[one, 2], table, brick_index, brick_count))
        brick_count += brick == brick_count
        for within in range(BRICK_VOXELS):
            n = part_rows[one, within]
            if n < 0:
                continue
            row = np.int64(rows[brick, within])
            if row < 0:  # as in `move_rows`: one function for both makes that a third slower
                row = count
                rows[brick, within] = row
                index[row, 0], index[row, 1], index[row, 2] = part_index[n, 0], part_index[n, 1], part_index[n, 2]
                sums[row, LAST_SEEN] = part_sums[n, LAST_SEEN]
                count += 1
            for column in range(LAST_SEEN):
                sums[row, column] += part_sums[n, column]
            sums[row, LAST_SEEN] = max(sums[row, LAST_SEEN], part_sums[n, LAST_SEEN])
            counts[row, VIEWS] += part_counts[n, VIEWS]
            to[n] = row
    return count, brick_count


@njit(**OPTIONS)
def group_pairs(
    target: Int32[np.ndarray, " pairs"],
    row: Int32[np.ndarray, " pairs"],
    weight: Float32[np.ndarray, " pairs"],
    start: Int64[np.ndarray, " rows1"],
    rows: Int32[np.ndarray, " pairs"],
    weights: Float32[np.ndarray, " pairs"],
):
    """Write the rows and weights of pairs in the order of their targets, to be read one after the other.

    ``start`` gets where each target's begin, and is 0 before.
    """
    for pair in range(target.shape[0]):
        start[target[pair] + 1] += 1
    for to in range(start.shape[0] - 1):
        start[to + 1] += start[to]
    place = start.copy()
    for pair in range(target.shape[0]):
        at = place[target[pair]]
        rows[at], weights[at] = row[pair], weight[pair]
        place[target[pair]] += 1


@njit(**OPTIONS)
def round_to_steps(
    feature_sum: Float32[np.ndarray, "n d"],
    weight: Float64[np.ndarray, " n"],
    out: Int8[np.ndarray, "n d"],
    scale: Float32[np.ndarray, " n"],
):
    """Write sums over weights as whole numbers up to 127 times a scale."""
    for n in range(feature_sum.shape[0]):
        most = np.float32(0.0)
        for column in range(out.shape[1]):
            most = max(most, abs(feature_sum[n, column]))
        known = most > 0.0 and weight[n] > 0.0
        factor = np.float32(127.0) / most if known else np.float32(0.0)
        scale[n] = most / (127.0 * weight[n]) if known else 0.0
        for column in range(out.shape[1]):
            out[n, column] = np.int8(np.rint(feature_sum[n, column] * factor))


@njit(**OPTIONS)
def sum_features(
    rows: Int64[np.ndarray, " k"],
    start: Int64[np.ndarray, " rows1"],
    row: Int32[np.ndarray, " pairs"],
    weight: Float32[np.ndarray, " pairs"],
    feature: Int8[np.ndarray, "n d"],
    scale: Float32[np.ndarray, " n"],
    out: Float32[np.ndarray, "k d"],
):
    """Write the sums of the features that some rows of a map have pairs of, times their weights.

    A look that weighs less than half a step of the whole (from afar, where others were near) is not read: rounding
    hides it. The others weigh as much more. Where such looks hold a tenth of the weight together, all are read.

    Args:
        rows: of the map.
        start: where the pairs of each row begin.
        row: of the submaps' voxels, for each pair, as `group_pairs` puts them.
        weight: of each pair.
        feature: of the submaps' voxels, in steps.
        scale: how large a step is.
        out: filled in.
    """
    for n in range(rows.shape[0]):
        first, last = start[rows[n]], start[rows[n] + 1]
        whole = read = np.float32(0.0)
        for at in range(first, last):
            whole += weight[at]
        least = whole * HIDDEN
        for at in range(first, last):
            read += weight[at] if weight[at] >= least else np.float32(0.0)
        if read < MOSTLY * whole:
            least, read = np.float32(0.0), whole
        more = whole / read if read > 0.0 else np.float32(0.0)
        for column in range(out.shape[1]):
            out[n, column] = 0.0
        for at in range(first, last):
            if weight[at] < least:
                continue
            source = row[at]
            factor = more * weight[at] * scale[source]
            for column in range(out.shape[1]):
                out[n, column] += factor * np.float32(feature[source, column])
