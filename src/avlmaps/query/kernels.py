"""The compiled inner loops of queries. Each has a brute-force twin in the tests.

Loops over voxels take a range, so that threads can share them (they release the interpreter's lock); that
compiles in a fraction of the time of numba's own parallel mode.
"""

import numpy as np
from jaxtyping import Bool, Float64, Int, Int32, Int64
from numba import njit

from avlmaps.core.machine import Real, Whole

# Blocks within this of the first of them look through the same cones, metres.
_WIDE_M = 1.6


@njit(cache=True, nogil=True)
def undominated(horizontal: Float64[np.ndarray, "n 2"], score: Float64[np.ndarray, " n"], falloff_per_m: Real):
    """Mark the cones that stick out somewhere; rows must come in falling score.

    Cone j lies under cone i everywhere if s_j <= s_i − ε·d(i, j). That relation carries over, so it is enough
    to compare with the cones selected before.
    """
    keep = np.zeros(len(score), np.bool_)
    kept = np.empty(len(score), np.int64)
    count = 0
    for j in range(len(score)):
        if score[j] <= 0.0:
            break
        hidden = False
        for k in range(count):
            i = kept[k]
            dx, dy = horizontal[j, 0] - horizontal[i, 0], horizontal[j, 1] - horizontal[i, 1]
            lead = score[i] - score[j]
            if falloff_per_m * falloff_per_m * (dx * dx + dy * dy) <= lead * lead:
                hidden = True
                break
        if not hidden:
            keep[j] = True
            kept[count] = j
            count += 1
    return keep


@njit(cache=True, nogil=True)
def _circle(points: Float64[np.ndarray, "m 2"], first: Whole, last: Whole):
    low_x = high_x = points[first, 0]
    low_y = high_y = points[first, 1]
    for i in range(first + 1, last):
        low_x, high_x = min(low_x, points[i, 0]), max(high_x, points[i, 0])
        low_y, high_y = min(low_y, points[i, 1]), max(high_y, points[i, 1])
    radius = 0.5 * np.sqrt((high_x - low_x) ** 2 + (high_y - low_y) ** 2)
    return 0.5 * (low_x + high_x), 0.5 * (low_y + high_y), radius


@njit(cache=True, nogil=True)
def _cones_near(
    x: Real,
    y: Real,
    slack: Real,
    anchors: Float64[np.ndarray, "n 2"],
    score: Float64[np.ndarray, " n"],
    falloff_per_m: Real,
    among: Int64[np.ndarray, " n"],
    count: Whole,
    near: Int64[np.ndarray, " n"],
):
    """Write which of ``count`` cones can be the highest somewhere within a circle, and return how many.

    ``slack`` is the falloff times the circle's radius: a cone's heat in it lies that much round its middle's. A
    cone whose best in the circle stays below another's worst is not highest anywhere in it. Scores fall, so that
    both passes can stop early; squares are compared to save roots.
    """
    worst, squared = 0.0, falloff_per_m * falloff_per_m
    for k in range(count):
        a = among[k]
        above = score[a] - slack - worst
        if above <= 0.0:
            break
        d2 = (anchors[a, 0] - x) ** 2 + (anchors[a, 1] - y) ** 2
        if squared * d2 < above * above:
            worst += above - falloff_per_m * np.sqrt(d2)
    found = 0
    for k in range(count):
        a = among[k]
        above = score[a] + slack - worst
        if above < 0.0:
            break
        d2 = (anchors[a, 0] - x) ** 2 + (anchors[a, 1] - y) ** 2
        if squared * d2 <= above * above:
            near[found] = a
            found += 1
    return found


@njit(cache=True, nogil=True)
def cone_heat(
    points: Float64[np.ndarray, "m 2"],
    starts: Int64[np.ndarray, " edges"],
    anchors: Float64[np.ndarray, "n 2"],
    score: Float64[np.ndarray, " n"],
    falloff_per_m: Real,
    out: Float64[np.ndarray, " m"],
    winner: Int[np.ndarray, " m"],
    first_block: Whole,
    last_block: Whole,
):
    """Write max over anchors of s − ε·d, floored at 0, for horizontal points in blocks, and who won (−1: none).

    Anchors come in falling score. Blocks that follow each other lie near each other: all cones are looked through for
    a wide circle about the first of them, and those that it leaves for each block in it.
    """
    every, near, nearest = np.arange(len(score)), np.empty(len(score), np.int64), np.empty(len(score), np.int64)
    wide_x, wide_y, wide, wide_count = 0.0, 0.0, -1.0, 0
    for b in range(first_block, last_block):
        x, y, radius = _circle(points, starts[b], starts[b + 1])
        if wide < 0.0 or np.sqrt((x - wide_x) ** 2 + (y - wide_y) ** 2) + radius > wide:
            wide_x, wide_y, wide = x, y, radius + _WIDE_M
            slack = falloff_per_m * (wide + 1e-9)
            wide_count = _cones_near(x, y, slack, anchors, score, falloff_per_m, every, len(score), near)
        slack = falloff_per_m * (radius + 1e-9)
        count = _cones_near(x, y, slack, anchors, score, falloff_per_m, near, wide_count, nearest)
        for i in range(starts[b], starts[b + 1]):
            best, who = 0.0, -1
            for k in range(count):
                a = nearest[k]
                d = np.sqrt((anchors[a, 0] - points[i, 0]) ** 2 + (anchors[a, 1] - points[i, 1]) ** 2)
                heat = score[a] - falloff_per_m * d
                if heat > best:
                    best, who = heat, a
            out[i] = best
            winner[i] = who


@njit(cache=True, nogil=True)
def sorted_by_number(number: Int64[np.ndarray, " n"], count: Whole):
    """Return the order that sorts numbers from 0 to ``count``, each group in the order in which it comes."""
    start = np.zeros(count + 1, np.int64)
    for value in number:
        start[value + 1] += 1
    for k in range(count):
        start[k + 1] += start[k]
    order = np.empty(len(number), np.int64)
    for i in range(len(number)):
        order[start[number[i]]] = i
        start[number[i]] += 1
    return order


@njit(cache=True, nogil=True)
def first_of_blocks(
    index: Int32[np.ndarray, "n 3"],
    shift: Whole,
    low: Int64[np.ndarray, "3"],
    span: Int64[np.ndarray, "3"],
    chosen: Bool[np.ndarray, " n"],
    first: Int32[np.ndarray, " blocks"],
):
    """Write the first voxel of each block of 2^shift voxels a side, where none of its voxels is chosen.

    Args:
        index: of the voxels.
        shift: of the blocks.
        low: block of the lowest corner,
        span: and how many there are along each axis.
        chosen: of the voxels.
        first: -1 for every block; written.
    """
    for i in range(len(index)):
        x, y, z = (index[i, 0] >> shift) - low[0], (index[i, 1] >> shift) - low[1], (index[i, 2] >> shift) - low[2]
        block = (x * span[1] + y) * span[2] + z
        if chosen[i]:
            first[block] = -2
        elif first[block] == -1:
            first[block] = i


@njit(cache=True, nogil=True)
def _box_gap(
    low_a: Int64[np.ndarray, "3"],
    high_a: Int64[np.ndarray, "3"],
    low_b: Int64[np.ndarray, "3"],
    high_b: Int64[np.ndarray, "3"],
):
    least, most = 0, 0
    for k in range(3):
        gap = max(low_b[k] - high_a[k], low_a[k] - high_b[k], 0)
        span = max(high_b[k] - low_a[k], high_a[k] - low_b[k])
        least += gap * gap
        most += span * span
    return least, most


@njit(cache=True, nogil=True)
def _nearest_in(
    x: Whole,
    y: Whole,
    z: Whole,
    xs: Int32[np.ndarray, " k"],
    ys: Int32[np.ndarray, " k"],
    zs: Int32[np.ndarray, " k"],
    best: Whole,
):
    for k in range(len(xs)):
        dx, dy, dz = xs[k] - x, ys[k] - y, zs[k] - z
        best = min(best, dx * dx + dy * dy + dz * dz)
    return best


@njit(cache=True, nogil=True)
def _first_at(
    x: Whole,
    y: Whole,
    z: Whole,
    xs: Int32[np.ndarray, " k"],
    ys: Int32[np.ndarray, " k"],
    zs: Int32[np.ndarray, " k"],
    squared: Whole,
):
    k = 0
    while (xs[k] - x) ** 2 + (ys[k] - y) ** 2 + (zs[k] - z) ** 2 != squared:
        k += 1
    return k


@njit(cache=True, nogil=True)
def _before(rising: Int64[np.ndarray, " n"], value: Whole):
    low, high = 0, len(rising)
    while low < high:
        middle = (low + high) // 2
        if rising[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def _things_near(
    box_low: Int64[np.ndarray, "3"],
    box_high: Int64[np.ndarray, "3"],
    low: Int64[np.ndarray, "t 3"],
    high: Int64[np.ndarray, "t 3"],
    high_before: Int64[np.ndarray, " t"],
    low_after: Int64[np.ndarray, " t"],
    limit: Whole,
    near: Int64[np.ndarray, " t"],
    gaps: Int64[np.ndarray, " t"],
):
    """Write which blocks of things can hold the nearest to some voxel of a box, nearest block first.

    Those are the blocks whose least distance from the box is within the smallest of all largest distances. Only those
    within reach along x are looked at, between two places in ``high_before``, the highest x up to each block, and
    ``low_after``, the lowest x from each block on.
    """
    bound, count = np.int64(limit), 0
    reach = np.int64(np.ceil(np.sqrt(limit)))
    first = _before(high_before, box_low[0] - reach)
    last = _before(low_after, box_high[0] + reach + 1)
    for t in range(first, last):
        gaps[t], most = _box_gap(box_low, box_high, low[t], high[t])
        bound = min(bound, most)
    for t in range(first, last):
        if gaps[t] <= bound:
            k = count
            while k > 0 and gaps[near[k - 1]] > gaps[t]:
                near[k] = near[k - 1]
                k -= 1
            near[k] = t
            count += 1
    return count


@njit(cache=True, nogil=True)
def nearest_squared(
    voxels: Int32[np.ndarray, "3 n"],
    starts: Int64[np.ndarray, " edges"],
    low: Int64[np.ndarray, "b 3"],
    high: Int64[np.ndarray, "b 3"],
    things: Int32[np.ndarray, "3 m"],
    thing_starts: Int64[np.ndarray, " ends"],
    thing_low: Int64[np.ndarray, "t 3"],
    thing_high: Int64[np.ndarray, "t 3"],
    limit: Whole,
    out: Int[np.ndarray, " n"],
    nearest: Int[np.ndarray, " n"],
    which: Int64[np.ndarray, " k"],
    first: Whole,
    last: Whole,
):
    """Write each voxel's squared distance, in voxels, to the nearest thing, and which it is.

    Where that is ``limit`` or farther, ``limit`` and -1 are written.

    Voxels and things come in blocks: places ``starts[b]:starts[b + 1]`` of (3, n) int32 indices (one row an axis,
    so that the inner loop is vectorised), in boxes from ``low`` to ``high`` (b, 3) int64. ``which[first:last]``
    are the blocks of voxels to do.
    """
    near = np.empty(len(thing_low), np.int64)
    gaps = np.empty(len(thing_low), np.int64)
    high_before, low_after = thing_high[:, 0].copy(), thing_low[:, 0].copy()
    for t in range(1, len(high_before)):
        high_before[t] = max(high_before[t], high_before[t - 1])
        low_after[-t - 1] = min(low_after[-t - 1], low_after[-t])
    for c in range(first, last):
        b = which[c]
        count = _things_near(low[b], high[b], thing_low, thing_high, high_before, low_after, limit, near, gaps)
        for i in range(starts[b], starts[b + 1]):
            x, y, z = voxels[0, i], voxels[1, i], voxels[2, i]
            best, block = limit, -1
            for k in range(count):
                t = near[k]
                gap_x = max(thing_low[t, 0] - x, x - thing_high[t, 0], 0)
                gap_y = max(thing_low[t, 1] - y, y - thing_high[t, 1], 0)
                gap_z = max(thing_low[t, 2] - z, z - thing_high[t, 2], 0)
                if gap_x * gap_x + gap_y * gap_y + gap_z * gap_z < best:
                    a, e = thing_starts[t], thing_starts[t + 1]
                    nearer = _nearest_in(x, y, z, things[0, a:e], things[1, a:e], things[2, a:e], best)
                    if nearer < best:
                        best, block = nearer, t
            out[i], nearest[i] = best, -1
            if block >= 0:  # looked for only now: a search for the smallest alone is vectorised
                a, e = thing_starts[block], thing_starts[block + 1]
                nearest[i] = a + _first_at(x, y, z, things[0, a:e], things[1, a:e], things[2, a:e], best)
