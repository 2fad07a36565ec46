"""The compiled loops of submaps: where in its voxel a surface lies, and voxels that move with their frames.

A voxel of a submap has the mean and the spread of its points within it, and the mean number of the frames that saw
it. When poses are corrected, it moves with the correction of that frame, as a small lattice of samples that has the
same mean and spread; each sample carries its part of the sums into the voxel where it falls. Samples stay within their
voxel, so that a shift by whole voxels moves voxels, and no shift changes nothing.
"""

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64, UInt16
from numba import njit

from avlmaps.core.kernel_types import Real, Whole
from avlmaps.maps.fusion.voxel_kernels import OPTIONS, Geometry, find_or_insert, find_row

# Columns of the sums over a voxel's points: offsets from its middle, their products, the number of the frame.
X, Y, Z, XX, XY, XZ, YY, YZ, ZZ, NUMBER = range(10)
SPREAD_COLUMNS = 10
STEPS = 4  # samples along each axis, at most
MOST_SAMPLES = STEPS**3
EVEN = 12.0**0.5  # an even spread over a length has a standard deviation of the length over this
WITHIN = 0.4999  # voxels: samples go no farther from the middle
LEAST_HITS = 0.5  # a voxel gets less than this part of a hit from one that moves: it has none


Stay = tuple[np.ndarray, np.ndarray]
Pairs = tuple[np.ndarray, np.ndarray, np.ndarray]


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
    voxel: Int32[np.ndarray, "3"],
    where: Float32[np.ndarray, " columns"],
    to: Float64[np.ndarray, "3 4"],
    key: Int64[np.ndarray, "samples 3"],
    share: Int64[np.ndarray, " samples"],
):
    """Write in which voxels the samples of one that moves fall, and how many; return their count, and the samples'."""
    lxx, lyx, lyy = np.float64(where[3]), np.float64(where[4]), np.float64(where[5])
    lzx, lzy, lzz = np.float64(where[6]), np.float64(where[7]), np.float64(where[8])
    steps_a = _steps(np.sqrt(lxx * lxx + lyx * lyx + lzx * lzx))
    steps_b = _steps(np.sqrt(lyy * lyy + lzy * lzy))
    steps_c = _steps(lzz)
    found = 0
    for a in range(steps_a):
        ua = EVEN * ((a + 0.5) / steps_a - 0.5)
        for b in range(steps_b):
            ub = EVEN * ((b + 0.5) / steps_b - 0.5)
            for c in range(steps_c):
                uc = EVEN * ((c + 0.5) / steps_c - 0.5)
                x = voxel[0] + 0.5 + _within(where[0] + lxx * ua)
                y = voxel[1] + 0.5 + _within(where[1] + lyx * ua + lyy * ub)
                z = voxel[2] + 0.5 + _within(where[2] + lzx * ua + lzy * ub + lzz * uc)
                i = np.int64(np.floor(to[0, 0] * x + to[0, 1] * y + to[0, 2] * z + to[0, 3]))
                j = np.int64(np.floor(to[1, 0] * x + to[1, 1] * y + to[1, 2] * z + to[1, 3]))
                k = np.int64(np.floor(to[2, 0] * x + to[2, 1] * y + to[2, 2] * z + to[2, 3]))
                at = found - 1
                while at >= 0 and (key[at, 0] != i or key[at, 1] != j or key[at, 2] != k):
                    at -= 1
                if at < 0:
                    key[found, 0], key[found, 1], key[found, 2] = i, j, k
                    share[found] = 1
                    found += 1
                else:
                    share[at] += 1
    return found, steps_a * steps_b * steps_c


@njit(**OPTIONS)
def _without_slivers(
    found: Whole, samples: Whole, hits: Whole, key: Int64[np.ndarray, "samples 3"], share: Int64[np.ndarray, " samples"]
):
    """Leave out the voxels that get hardly a part of a hit, unless all do; return count and samples of the rest."""
    kept, total = 0, 0
    for at in range(found):
        if share[at] * hits >= LEAST_HITS * samples:
            key[kept, 0], key[kept, 1], key[kept, 2] = key[at, 0], key[at, 1], key[at, 2]
            share[kept] = share[at]
            total += share[at]
            kept += 1
    return (kept, total) if kept > 0 else (found, samples)


@njit(**OPTIONS)
def _add_views(row: Whole, seen: Whole, number: Whole, views: Int32[np.ndarray, " rows"], stay: Stay):
    """Add the frames of a submap that saw a voxel, which may come several times: the most count."""
    last_of, views_of = stay
    if last_of[row] != number:
        last_of[row], views_of[row] = number, 0
    if seen > views_of[row]:
        views[row] += seen - views_of[row]
        views_of[row] = seen


@njit(**OPTIONS)
def move_rows(
    part: tuple[np.ndarray, ...],
    spread: Float32[np.ndarray, "n columns"],
    moved: Float64[np.ndarray, "frames 3 4"],
    table: Int32[np.ndarray, " slots"],
    sums: Geometry,
    weight: Float64[np.ndarray, " rows"],
    stay: Stay,
    number: Whole,
    count: Whole,
    begin: Whole,
    pairs: Pairs,
    pair: Whole,
):
    """Add voxels of a submap to a map, each moved as its frame was, until there is no room for another.

    Features wait for `sum_features`: which of them go where, and how much they count, is written as pairs.

    Args:
        part: (index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s, weight) of the submap.
        spread: of `finish_spread`.
        moved: (frames, 3, 4) corrected from uncorrected world of each of its frames, voxels.
        table: hash table of rows.
        sums: (index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s), added to.
        weight: (rows,), added to.
        stay: (submap, views): of each row the last submap that added to it, and how many views it added.
        number: of this submap.
        count: number of voxels in this map already.
        begin: row of the submap to begin with.
        pairs: (row of the map, row of the submap, weight) of each feature that counts, written from ``pair`` on.
        pair: how many there are.

    Returns:
        Count of voxels now, count of pairs, and the row to resume with when there is room again.
    """
    index, rgb_sum, rgb_weight, hits, views, sharp, last_seen_s = sums
    part_index, part_rgb, part_rgb_weight, part_hits, part_views, part_sharp, part_last_seen = part[:7]
    part_weight = part[7]
    pair_target, pair_row, pair_weight = pairs
    key, share = np.empty((MOST_SAMPLES, 3), np.int64), np.empty(MOST_SAMPLES, np.int64)
    room = min(index.shape[0], table.shape[0] // 2) - MOST_SAMPLES
    for n in range(begin, part_index.shape[0]):
        if count > room or pair > pair_target.shape[0] - MOST_SAMPLES:
            return count, pair, n
        frame = min(max(np.int64(spread[n, NUMBER] + 0.5), 0), moved.shape[0] - 1)
        found, samples = _targets(part_index[n], spread[n], moved[frame], key, share)
        found, samples = _without_slivers(found, samples, part_hits[n], key, share)
        for at in range(found):
            amount = share[at] / samples
            row = int(find_or_insert(key[at, 0], key[at, 1], key[at, 2], table, index, count))
            last_seen_s[row] = part_last_seen[n] if row == count else max(last_seen_s[row], part_last_seen[n])
            count += row == count
            hit = max(np.int64(amount * part_hits[n] + 0.5), 1)
            hits[row] += hit
            sharp[row] += np.int64(amount * part_sharp[n] + 0.5)
            _add_views(row, np.int32(min(part_views[n], hit)), number, views, stay)  # no more frames than hits
            for colour in range(3):
                rgb_sum[row, colour] += amount * part_rgb[n, colour]
            rgb_weight[row] += amount * part_rgb_weight[n]
            weight[row] += amount * part_weight[n]
            pair_target[pair], pair_row[pair] = row, n
            pair_weight[pair] = amount * part_weight[n]
            pair += 1
    return count, pair, part_index.shape[0]


@njit(**OPTIONS)
def group_pairs(target: Int32[np.ndarray, " pairs"], start: Int64[np.ndarray, " rows1"]):
    """Return the pairs in the order of their targets; ``start`` gets where each target's begin, and is 0 before."""
    for pair in range(target.shape[0]):
        start[target[pair] + 1] += 1
    for row in range(start.shape[0] - 1):
        start[row + 1] += start[row]
    place = start.copy()
    order = np.empty(target.shape[0], np.int64)
    for pair in range(target.shape[0]):
        order[place[target[pair]]] = pair
        place[target[pair]] += 1
    return order


@njit(**OPTIONS)
def sum_features(
    begin: Whole,
    end: Whole,
    start: Int64[np.ndarray, " rows1"],
    order: Int64[np.ndarray, " pairs"],
    row: Int64[np.ndarray, " pairs"],
    weight: Float32[np.ndarray, " pairs"],
    halves: UInt16[np.ndarray, "n d"],
    feature_sum: Float32[np.ndarray, "rows d"],
):
    """Add to each of some rows of a map the features of its pairs, times their weights.

    Args:
        begin: first row of the map.
        end: one past the last.
        start: where the pairs of each row begin in ``order``.
        order: numbers of pairs.
        row: of the submaps' voxels, for each pair.
        weight: of each pair.
        halves: bits of float16 features; Numba has no numbers of that type.
        feature_sum: added to.
    """
    bits = np.empty(halves.shape[1], np.uint32)
    numbers = bits.view(np.float32)
    for target in range(begin, end):
        for at in range(start[target], start[target + 1]):
            pair = order[at]
            feature = halves[row[pair]]
            scale = weight[pair] * np.float32(2.0**112)  # the exponents of both types are 112 apart
            for column in range(bits.shape[0]):
                half = np.uint32(feature[column])
                bits[column] = ((half & np.uint32(0x8000)) << np.uint32(16)) | (
                    (half & np.uint32(0x7FFF)) << np.uint32(13)
                )
            for column in range(bits.shape[0]):
                feature_sum[target, column] += scale * numbers[column]
