"""Instances larger than any thing of their name: several things that weak voxels link, or a name that spilled over.

In a real kitchen the chairs round a table made one instance of 1.7 m, and "chair" went on from a chair to the cabinets
and the wall behind it, 4.6 m long, with a confidence of 0.66.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.query.components import linked

# The log-odds fall by this times ln of how many times too long an instance is: twice what they rise by with its area.
_COST = 1.6
# The weakest parts of an instance's voxels without which it may fall to pieces, tried in turn.
_WITHOUT = np.arange(0.1, 0.75, 0.1)
# Fewer connected voxels are no piece of their own.
_FEWEST_VOXELS = 8
# A voxel left out belongs to a piece this near, metres.
_NEAR_M = 0.11


def longest_m(names: Sequence[str]) -> float:
    """Return how long things of these names are at most, top-down, metres: the diagonal of the largest.

    Infinity where the lexicon does not say it of all of them.
    """
    entries = [lexicon().find(name, EntryKind.THING) for name in names]
    sizes = [entry.size_m for entry in entries if entry is not None and entry.size_m is not None]
    if not sizes or len(sizes) < len(names):
        return float("inf")
    return max(float(np.hypot(width[1], depth[1])) for width, depth, _ in sizes)


def lengths_m(
    points_level: Float[np.ndarray, "a 3"], instance: Int[np.ndarray, " a"], count: int
) -> Float[np.ndarray, " i"]:
    """Return the longer horizontal side of the box round each of ``count`` instances, metres."""
    longest = np.zeros(count)
    for axis in range(2):  # each by itself: NumPy is ten times as fast on numbers as on rows
        low, high = np.full(count, np.inf), np.full(count, -np.inf)
        np.minimum.at(low, instance, points_level[:, axis])
        np.maximum.at(high, instance, points_level[:, axis])
        longest = np.maximum(longest, high - low)
    return longest


def less_likely(
    confidence: Float32[np.ndarray, " i"], length_m: Float[np.ndarray, " i"], longest: float
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of instances after what their lengths say: those that are not too long keep theirs."""
    odds = np.maximum(length_m / longest, 1.0) ** _COST
    return (confidence / (confidence + (1.0 - confidence) * odds)).astype(np.float32)


def cut(
    index: Int[np.ndarray, "a 3"],
    points_level: Float[np.ndarray, "a 3"],
    score: Float[np.ndarray, " a"],
    instance: Int[np.ndarray, " a"],
    longest: float,
    reach: int,
) -> tuple[Int[np.ndarray, " a"], Int[np.ndarray, " j"]]:
    """Cut instances that are too long where their voxels score least.

    Args:
        index: of the voxels, in the order of a map's.
        points_level: their centres, metres, with z up.
        score: how well each fits the name.
        instance: which each belongs to, 0 to the highest without gaps.
        longest: an instance no longer than this stays whole, metres.
        reach: voxels this near along every axis are connected.

    Returns:
        Which instance each belongs to now, again without gaps, −1 for a voxel that only linked others; and of which
        instance each is a piece: what was part of something too long is as doubtful as that.
    """
    count = int(instance.max(initial=-1)) + 1
    out = np.array(instance, np.int64)
    for number in np.flatnonzero(lengths_m(points_level, instance, count) > longest):
        rows = np.flatnonzero(instance == number)
        pieces = list(_pieces(index, points_level, score, rows, longest, reach))
        near = _nearest(points_level, rows, pieces)
        out[rows] = np.where(near < len(pieces), count + near, -1)
        count += len(pieces)
    kept = out >= 0
    _, first, out[kept] = np.unique(out[kept], return_index=True, return_inverse=True)
    return out, np.asarray(instance)[kept][first]


def _pieces(
    index: Int[np.ndarray, "a 3"],
    points_level: Float[np.ndarray, "a 3"],
    score: Float[np.ndarray, " a"],
    rows: Int[np.ndarray, " m"],
    longest: float,
    reach: int,
) -> Iterator[Int[np.ndarray, " p"]]:
    """Yield the voxels of each piece that an instance falls to; what no level cuts stays as it is."""

    def fits(some: Int[np.ndarray, " p"]) -> bool:
        return bool(np.ptp(points_level[some, :2], axis=0).max() <= longest)

    levels = np.quantile(score[rows], _WITHOUT)
    pending = [(rows, 0)]
    while pending:
        some, tried = pending.pop()
        while not fits(some) and tried < len(levels):
            parts = _connected(index, some[score[some] >= levels[tried]], reach)
            tried += 1
            if len(parts) > 1 or any(map(fits, parts)):
                pending += [(part, tried) for part in parts]
                break
        else:
            yield some


def _connected(index: Int[np.ndarray, "a 3"], rows: Int[np.ndarray, " m"], reach: int) -> list[Int[np.ndarray, " p"]]:
    label = linked(index[rows], reach)
    parts = np.split(rows[np.argsort(label, kind="stable")], np.cumsum(np.bincount(label))[:-1])
    return [part for part in parts if len(part) >= _FEWEST_VOXELS]


def _nearest(
    points_level: Float[np.ndarray, "a 3"], rows: Int[np.ndarray, " m"], pieces: Sequence[Int[np.ndarray, " p"]]
) -> Int[np.ndarray, " m"]:
    from scipy.spatial import KDTree  # most queries cut nothing and need not load it

    owner = np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces])
    _, nearest = KDTree(points_level[np.concatenate(pieces)]).query(points_level[rows], distance_upper_bound=_NEAR_M)
    return np.append(owner, len(pieces))[nearest]
