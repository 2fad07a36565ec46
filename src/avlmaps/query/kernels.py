"""The compiled inner loops of queries; threads share the blocks of voxels that they take."""

import numpy as np
from jaxtyping import Float64, Int, Int32, Int64
from numba import njit

from avlmaps.core.machine import Real, Whole
from avlmaps.core.progress import listen_for_compiling

listen_for_compiling()

# Blocks within this of the first of them look through the same cones, metres.
_WIDE_M = 1.6


@njit(cache=True, nogil=True)
def _cones_near(
    x: Real, y: Real, radius: Real, anchors: Float64[np.ndarray, "n 2"], score: Float64[np.ndarray, " n"],
    falloff_per_m: Real, among: Int64[np.ndarray, " n"], count: Whole, near: Int64[np.ndarray, " n"],
):  # fmt: skip
    # Writes which of ``count`` cones can be the highest somewhere within a circle, and returns how many. A cone whose
    # best in the circle stays below another's worst is not. Scores fall, so that both passes can stop early; squares
    # are compared to save roots.
    slack, worst, squared = falloff_per_m * (radius + 1e-9), 0.0, falloff_per_m * falloff_per_m
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
    points: Float64[np.ndarray, "m 2"], starts: Int64[np.ndarray, " edges"], anchors: Float64[np.ndarray, "n 2"],
    score: Float64[np.ndarray, " n"], falloff_per_m: Real, out: Float64[np.ndarray, " m"],
    winner: Int[np.ndarray, " m"], first_block: Whole, last_block: Whole,
):  # fmt: skip
    """Write max over anchors of s − ε·d, floored at 0, for horizontal points in blocks, and who won (−1: none).

    Anchors come in falling score. All cones are looked through for a wide circle about a block, and those that it
    leaves for each further block in it.
    """
    every, near, nearest = np.arange(len(score)), np.empty(len(score), np.int64), np.empty(len(score), np.int64)
    wide_x, wide_y, wide, wide_count = 0.0, 0.0, -1.0, 0
    for b in range(first_block, last_block):
        begin, end = starts[b], starts[b + 1]
        low_x, high_x = points[begin:end, 0].min(), points[begin:end, 0].max()
        low_y, high_y = points[begin:end, 1].min(), points[begin:end, 1].max()
        x, y = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
        radius = 0.5 * np.sqrt((high_x - low_x) ** 2 + (high_y - low_y) ** 2)
        if wide < 0.0 or np.sqrt((x - wide_x) ** 2 + (y - wide_y) ** 2) + radius > wide:
            wide_x, wide_y, wide = x, y, radius + _WIDE_M
            wide_count = _cones_near(x, y, wide, anchors, score, falloff_per_m, every, len(score), near)
        count = _cones_near(x, y, radius, anchors, score, falloff_per_m, near, wide_count, nearest)
        for i in range(begin, end):
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
def _things_near(
    box_low: Int64[np.ndarray, "3"], box_high: Int64[np.ndarray, "3"], low: Int64[np.ndarray, "t 3"],
    high: Int64[np.ndarray, "t 3"], first: Whole, last: Whole, limit: Whole, near: Int64[np.ndarray, " t"],
    gaps: Int64[np.ndarray, " t"],
):  # fmt: skip
    # Writes which blocks of things can hold the nearest to some voxel of a box, the nearest block first, and returns
    # how many: those whose least distance from the box is within the smallest of all largest distances.
    bound, count = np.int64(limit), 0
    for t in range(first, last):
        least, most = 0, 0
        for axis in range(3):
            least += max(low[t, axis] - box_high[axis], box_low[axis] - high[t, axis], 0) ** 2
            most += max(high[t, axis] - box_low[axis], box_high[axis] - low[t, axis]) ** 2
        gaps[t] = least
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
    voxels: Int32[np.ndarray, "3 n"], starts: Int64[np.ndarray, " edges"], low: Int64[np.ndarray, "b 3"],
    high: Int64[np.ndarray, "b 3"], things: Int32[np.ndarray, "3 m"], thing_starts: Int64[np.ndarray, " ends"],
    thing_low: Int64[np.ndarray, "t 3"], thing_high: Int64[np.ndarray, "t 3"], limit: Whole, out: Int[np.ndarray, " n"],
    nearest: Int[np.ndarray, " n"], first: Whole, last: Whole,
):  # fmt: skip
    """Write each voxel's squared distance, in voxels, to the nearest thing, and which it is; at most ``limit`` and −1.

    Voxels and things come in blocks: places ``starts[b]:starts[b + 1]`` of int32 indices (one row an axis, so that the
    inner loop is vectorised), in boxes from ``low`` to ``high``. Blocks of voxels from ``first`` to ``last`` are done.
    """
    near, gaps = np.empty(len(thing_low), np.int64), np.empty(len(thing_low), np.int64)
    # The highest x up to each block of things, and the lowest x from each on: only those within reach are looked at.
    high_before, low_after = thing_high[:, 0].copy(), thing_low[:, 0].copy()
    for t in range(1, len(high_before)):
        high_before[t] = max(high_before[t], high_before[t - 1])
        low_after[-t - 1] = min(low_after[-t - 1], low_after[-t])
    reach = np.int64(np.ceil(np.sqrt(limit)))
    for b in range(first, last):
        begin = np.searchsorted(high_before, np.int64(low[b, 0]) - reach)
        end = np.searchsorted(low_after, np.int64(high[b, 0]) + reach + 1)
        count = _things_near(low[b], high[b], thing_low, thing_high, begin, end, limit, near, gaps)
        for i in range(starts[b], starts[b + 1]):
            x, y, z = voxels[0, i], voxels[1, i], voxels[2, i]
            best, block = limit, -1
            for k in range(count):
                t = near[k]
                gap_x = max(thing_low[t, 0] - x, x - thing_high[t, 0], 0)
                gap_y = max(thing_low[t, 1] - y, y - thing_high[t, 1], 0)
                gap_z = max(thing_low[t, 2] - z, z - thing_high[t, 2], 0)
                if gap_x * gap_x + gap_y * gap_y + gap_z * gap_z >= best:
                    continue
                nearer, a, e = best, thing_starts[t], thing_starts[t + 1]
                xs, ys, zs = things[0, a:e], things[1, a:e], things[2, a:e]
                for m in range(len(xs)):
                    dx, dy, dz = xs[m] - x, ys[m] - y, zs[m] - z
                    nearer = min(nearer, dx * dx + dy * dy + dz * dz)
                if nearer < best:
                    best, block = nearer, t
            out[i], nearest[i] = best, -1
            if block >= 0:  # looked for only now: a search for the smallest alone is vectorised
                m = thing_starts[block]
                while (things[0, m] - x) ** 2 + (things[1, m] - y) ** 2 + (things[2, m] - z) ** 2 != best:
                    m += 1
                nearest[i] = m
