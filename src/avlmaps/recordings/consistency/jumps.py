"""What is wrong at one place of a recording that agrees elsewhere: a jump of the poses, frames that are exchanged."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.arrays import Bool
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.consistency import limits
from avlmaps.recordings.consistency.agreement import APART_SAME_M, FEWEST_POINTS, Agreement, compare
from avlmaps.recordings.consistency.sample import Sample, Surfaces, draw_pairs, pairs_across, steps_between_all
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason
from avlmaps.recordings.types import Recording

# Pairs that are looked at more closely, since the poses may jump between them or their frames be exchanged.
MOST_JUMPS = 3
# A step of the poses this many times the usual one, and beyond this, is a jump if fewer points agree across it.
LEAST_ACROSS_STEP = 0.9
# Without such a step fewer points must agree across it, and their depths differ this many times as much as beside.
_MISFIT, _MISFIT_RATIO = 0.7, 3.0
ODD_STEP, ODD_STEP_M, ODD_STEP_RAD = 4.0, 0.15, np.radians(8.0)
# Pairs of frames that are exchanged agree less than this, and all of them agree in another order.
_EXCHANGED, _PUT_RIGHT, _COLOUR_RIGHT = 0.85, 0.15, 0.3
# This many neighbours may be in another order, among others that are not.
_IN_A_ROW, _BESIDE = 3, 2
# Where a recording is parted: the longest times without a frame, this many times the usual pace and this long.
_MOST_GAPS, _GAP, _GAP_S = 3, 10.0, 2.0
# Points of frames before and after: the others look through none in 4 rendered homes and a real kitchen, each parted at
# three places, and through 0.08 where people walk, but then 0.85 lie on one surface; through 0.14 and more, and at most
# 0.35 lie on one, where the second part is 0.6 m off or has another origin.
_MOST_THROUGH_PARTS, _SAME_PARTS = 0.06, 0.7


def find_jump(recording: Recording, sample: Sample, after: Agreement) -> Finding | None:
    """Return a finding where a pair does not agree, no pair across the same place does, and those beside do."""
    pairs = sample.index[sample.only(sample.follows).pairs]
    odd = _odd_steps(recording)
    share = np.where(after.points >= 2 * FEWEST_POINTS, after.same / np.maximum(after.points, 1), 1.0)
    most = np.where([odd[a:b].any() for a, b in pairs], LEAST_ACROSS_STEP, _MISFIT)
    rows = np.flatnonzero(share < most)
    for row in rows[np.argsort(share[rows] - most[rows], kind="stable")][:MOST_JUMPS].tolist():
        a, b = (int(number) for number in pairs[row])
        at = a + int(np.argmax(odd[a:b])) if odd[a:b].any() else a
        a, b = (at, at + 1) if odd[a:b].any() else (a, b)
        if a < 1 or b > len(recording) - 2:
            continue
        across = np.array([(a - 1, b), (a, b), (a, b + 1), (a - 1, b + 1), (a - 1, a), (b, b + 1)])
        near = draw_pairs(recording, across, np.arange(len(across)) < 4)
        surfaces = Surfaces.of(near.depth_m)
        over, beside = (
            compare(near.only(kind), surfaces, near.world_from_camera, colour=False)
            for kind in (near.follows, ~near.follows)
        )
        few = over.pairs >= limits.FEWEST_PAIRS and over.same_share < limits.HARDLY_ANY
        seen = (limits.can_be_judged(over) or few) and limits.can_be_judged(beside)
        far_off = over.same_share < limits.BAD_PAIR or over.median_off > _MISFIT_RATIO * beside.median_off
        step = far_off or most[row] == LEAST_ACROSS_STEP
        better = beside.same_share > max(limits.LEAST_AGREEING, over.same_share + 0.1)
        if seen and step and better and over.same_share < most[row]:
            sentence = (
                f"Frames {recording.name(a)} and {recording.name(b)} do not agree ({over.same_share:.0%} of the points "
                f"on one surface), although the frames before and after do ({beside.same_share:.0%})."
            )
            remedy = "The poses jump there, or tracking began again: cut the recording there, or fix the poses."
            return Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, remedy)
    return None


def find_parts(recording: Recording) -> Finding | None:
    """Return a finding where what came after a gap, a jump or the middle contradicts what came before, as a whole."""
    worst: tuple[float, int, Agreement] | None = None
    places = [*seams(recording), *([] if gaps(recording) else [len(recording) // 2 - 1])]
    for at in sorted(set(places)):
        pairs = pairs_across(recording.world_from_camera, at)
        if not len(pairs):
            continue
        both = draw_pairs(recording, np.concatenate([pairs, pairs[:, ::-1]]), np.ones(2 * len(pairs), bool))
        found = compare(both, Surfaces.of(both.depth_m), both.world_from_camera, floor_m=APART_SAME_M, colour=False)
        least = max(_MOST_THROUGH_PARTS, worst[0] if worst else 0.0)
        if limits.can_be_judged(found) and found.through_share > least and found.same_share < _SAME_PARTS:
            worst = found.through_share, at, found
    if worst is None:
        return None
    through, at, found = worst
    apart_s = float(recording.stamps_s[at + 1] - recording.stamps_s[at])
    sentence = (
        f"What frames show before and after {recording.name(at)} does not agree: in {found.pairs} pairs that look at "
        f"one place, {through:.0%} of the points of the one are seen through by the other ({apart_s:.3g} s lie between "
        f"{recording.name(at)} and {recording.name(at + 1)})."
    )
    remedy = (
        "They look like two recordings whose poses have different origins, or the poses drift: give both one origin, "
        "or build a map of each."
    )
    return Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, remedy)


def gaps(recording: Recording) -> list[int]:
    """Return the last frames before the longest times without any, the longest first."""
    apart_s = np.diff(recording.stamps_s)
    if not len(apart_s):
        return []
    long = np.flatnonzero(apart_s > max(_GAP_S, _GAP * float(np.median(apart_s))))
    return long[np.argsort(-apart_s[long], kind="stable")][:_MOST_GAPS].tolist()


def seams(recording: Recording) -> list[int]:
    """Return the last frames before gaps, and before the step of the poses that is oddest."""
    odd, step = _odd_steps(recording), steps_between_all(recording.world_from_camera)
    oddest = [int(np.argmax(np.where(odd, step, 0.0)))] if odd.any() else []
    return list(dict.fromkeys([*gaps(recording), *oddest]))


def _odd_steps(recording: Recording) -> Bool[np.ndarray, " m"]:
    """Return which steps of the poses are far longer, or turn far more, than the usual one."""
    pose = recording.world_from_camera
    if len(pose) < 2:
        return np.zeros(0, bool)
    moved_m = np.linalg.norm(np.diff(pose[:, :3, 3], axis=0), axis=1)
    turned_rad = rotation_angle_rad(pose[:-1], pose[1:])
    far = moved_m > max(ODD_STEP * float(np.median(moved_m)), ODD_STEP_M)
    return far | (turned_rad > max(ODD_STEP * float(np.median(turned_rad)), ODD_STEP_RAD))


def find_exchanged(recording: Recording, sample: Sample, after: Agreement) -> Finding | None:
    """Return a finding where pictures of neighbours agree in another order, and do not as they are."""
    enough = after.points >= 2 * FEWEST_POINTS
    same = np.where(enough, after.same / np.maximum(after.points, 1), 1.0)
    for reason, share, what in (
        (Reason.GEOMETRY, same, "pictures"),
        (Reason.COLOUR, np.where(enough & np.isfinite(after.alike), after.alike, 1.0), "colour pictures"),
    ):
        if order := _exchanged_near(recording, sample, share, colour=reason is Reason.COLOUR):
            names = ", ".join(recording.name(number) for number in order)
            sentence = f"The {what} of the frames {names} do not agree with those beside, and do in another order."
            remedy = "They are exchanged: put them in the order in which they were taken."
            return Finding(reason, Grade.SUSPICIOUS, sentence, remedy)
    return None


def _exchanged_near(
    recording: Recording, sample: Sample, share: Float[np.ndarray, " p"], *, colour: bool
) -> list[int] | None:
    """Return frames that are exchanged, near the pairs that agree least."""
    worst = np.argsort(share, kind="stable")[:MOST_JUMPS]
    pairs = sample.index[sample.only(sample.follows).pairs[worst[share[worst] < _EXCHANGED]]]
    for first in dict.fromkeys(max(0, frame - _IN_A_ROW + 1) for frame in pairs.ravel().tolist()):
        low, high = max(0, first - _BESIDE), min(len(recording), first + 2 * _IN_A_ROW - 1 + _BESIDE)
        near = np.array([(a, b) for a in range(low, high) for b in range(a + 1, min(high, a + 3))])
        if order := _better_order(draw_pairs(recording, near, np.ones(len(near), bool)), colour=colour):
            return order
    return None


def _better_order(near: Sample, *, colour: bool) -> list[int] | None:
    """Return the frames that agree with their neighbours in another order only."""
    surfaces = Surfaces.of(near.depth_m)
    for rows in _orders(len(near)):
        moved = np.flatnonzero(rows != np.arange(len(near)))
        touched = near.only(np.isin(near.pairs, moved).sum(axis=1) == 1)
        other = replace(touched, grey=touched.grey[rows]) if colour else touched
        poses = near.world_from_camera if colour else near.world_from_camera[rows]
        before, after = (
            compare(one, surfaces, pose, colour=colour)
            for one, pose in ((touched, near.world_from_camera), (other, poses))
        )
        if not limits.can_be_judged(before) or not limits.can_be_judged(after) or before.pairs < 2 * len(moved) - 1:
            continue
        least = limits.LEAST_LIKENESS if colour else limits.LEAST_AGREEING
        now, then = (one.likeness if colour else one.same_share for one in (before, after))
        if now < _EXCHANGED and then > max(least, now + (_COLOUR_RIGHT if colour else _PUT_RIGHT)):
            return near.index[moved].tolist()
    return None


def _orders(count: int) -> Iterator[Int[np.ndarray, " n"]]:
    """Yield orders of some frames in which two or three neighbours are exchanged, the simplest first."""
    for many in range(2, _IN_A_ROW + 1):
        for first in range(1, count - many):
            for order in permutations(range(many)):
                if order[0] != 0 and order[-1] != many - 1:
                    rows = np.arange(count)
                    rows[first : first + many] = first + np.array(order)
                    yield rows
