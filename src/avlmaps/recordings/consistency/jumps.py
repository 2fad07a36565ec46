"""What is wrong at one place of a recording that agrees elsewhere: a jump of the poses, frames that are exchanged.

What could be wrong with a recording that agrees with itself, and would not show: tried by making it wrong.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.arrays import Bool
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.consistency import agreement as limits
from avlmaps.recordings.consistency.agreement import (
    APART_SAME_M,
    FEWEST_POINTS,
    Agreement,
    apart_agrees,
    can_be_judged,
    compare,
    geometry_agrees,
)
from avlmaps.recordings.consistency.edges import DepthEdges
from avlmaps.recordings.consistency.flats import Levels, RightAngles
from avlmaps.recordings.consistency.sample import Sample, Surfaces, draw_pairs, pairs_across, steps_between_all
from avlmaps.recordings.consistency.single_frames import LEAST_WARMTH
from avlmaps.recordings.consistency.suspects import Suspect, Trial, Trials, is_closer
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason
from avlmaps.recordings.corrections import Corrections
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
    for many in range(2, _IN_A_ROW + 1):
        for first in range(1, count - many):
            for order in permutations(range(many)):
                if order[0] != 0 and order[-1] != many - 1:
                    rows = np.arange(count)
                    rows[first : first + many] = first + np.array(order)
                    yield rows


# Mistakes that are made to see whether they would show: twice, half, a moment.
_FACTOR, _FOCAL, _DELAY_S = 2.0, 1.25, 0.3
# Smaller ones of the depth, which shows where the camera moves among what it sees.
_SLIGHT, _FARTHER_M = 1.15, 0.3
_OFF_CENTRE, _ROLLED_DEG = 0.08, 6.0
# A step that turns the camera by more than this share of its view leaves nothing that both frames see.
_NO_OVERLAP = 0.9


def blind_spots(
    recording: Recording,
    found: Agreement,
    trials: Trials,
    edges: DepthEdges,
    levels: Levels,
    angles: RightAngles,
    warmth: float,
) -> tuple[str, ...]:
    """Return what cannot be checked in a recording of which nothing is wrong, and why, one sentence each.

    Args:
        recording: that agrees with itself.
        found: pairs of its frames that follow one another.
        trials: of its sample.
        edges: of its colour and depth.
        levels: of its floors.
        angles: of its flat surfaces.
        warmth: of its pictures.
    """
    if not can_be_judged(found):
        return (_nothing(recording, found),)
    return (*_spots(recording, trials, edges, levels), *_of_flats(angles), *_of_channels(warmth))


def _nothing(recording: Recording, found: Agreement) -> str:
    if len(recording) == 1:
        why = "there is one frame"
    elif found.outside > 0.0:
        why = f"hardly any two frames see the same place ({found.outside:.0%} of the points of one lie "
        why += "outside of the other's view)"
    else:
        why = "too few pixels have a depth on smooth surface"
    return f"Poses, depth, colour, intrinsics and clocks cannot be checked here, because {why}."


def _spots(recording: Recording, trials: Trials, edges: DepthEdges, levels: Levels) -> Iterator[str]:
    as_it_is = trials.run(Suspect(), colour=False)

    def shows(*suspects: Suspect) -> bool:
        return all(_would_show(as_it_is, trials.run(suspect, colour=False)) for suspect in suspects)

    places = recording.world_from_camera[:, :3, 3]
    across_m = float(np.linalg.norm(np.ptp(places, axis=0)))
    if not shows(Suspect(scale=_FACTOR), Suspect(scale=1.0 / _FACTOR)):
        yield (
            "The scale of positions against depth cannot be checked here, because the camera moved within "
            f"{across_m:.2g} m, and between frames that see the same place hardly: positions twice as far apart would "
            "not show."
        )
    elif not shows(Suspect(scale=_SLIGHT), Suspect(scale=1.0 / _SLIGHT), Suspect(farther_m=_FARTHER_M)):
        yield (
            "The scale of positions against depth cannot be checked closely here, because between frames that see the "
            f"same place the camera turns more than it moves: depths that are {_SLIGHT - 1.0:.0%} or {_FARTHER_M:g} m "
            "too large would not show."
        )
    late, early = (Suspect(Corrections(pose_delay_s=s)) for s in (_DELAY_S, -_DELAY_S))
    if not shows(late, early):
        yield (
            "The clock of the poses cannot be checked here, because the camera moves evenly or hardly at all: poses "
            f"that are {_DELAY_S:g} s late would not show."
        )
    if not shows(Suspect(focal=_FOCAL), Suspect(focal=1.0 / _FOCAL)):
        yield (
            "The focal length cannot be checked here, because the camera hardly turns between frames that see the same "
            f"place: one {_FOCAL:g} times as long would not show."
        )
    tilted = levels.would_show or shows(Suspect(off_centre=(0.0, _OFF_CENTRE)), Suspect(rolled_deg=_ROLLED_DEG))
    aside = shows(Suspect(off_centre=(_OFF_CENTRE, 0.0)))
    if tilted and not aside:
        yield (
            "Whether the camera looks aside in its mount cannot be checked here, because it turns about one axis or "
            f"hardly: a principal point that is off by {_OFF_CENTRE:.0%} of the picture's width would not show."
        )
    elif not tilted:
        yield (
            "How the camera sits in its mount and its principal point cannot be checked here, because the camera turns "
            f"about one axis or hardly: a principal point that is off by {_OFF_CENTRE:.0%} of the picture, or a roll "
            f"of {_ROLLED_DEG:g} degrees, would not show."
        )
    if not shows(Suspect(along_ray=True)):
        yield (
            "Whether depth is measured along the camera's axis cannot be checked here, because the camera hardly turns "
            "or sees a narrow angle: distances along the ray would not show."
        )
    if not edges.would_show:
        yield (
            "Whether colour lies on depth cannot be checked here, because too few edges are seen in both: colour that "
            "lies a sixteenth of the picture beside would not show."
        )
    yield from _of_gaps(recording)
    yield from _of_parts(recording)


def _of_flats(angles: RightAngles) -> Iterator[str]:
    if not angles.lens_would_show:
        yield (
            "Whether the distortion of the lens was taken out cannot be checked here, because too few flat surfaces "
            "are seen: a wide lens that bends walls would not show."
        )
    if not angles.squeeze_would_show:
        yield (
            "The ratio of fx to fy cannot be checked here, because too few flat surfaces that meet at right angles are "
            "seen, or all of them by a level camera: pictures that were squeezed along one axis would not show."
        )


def _of_channels(warmth: float) -> Iterator[str]:
    if warmth < LEAST_WARMTH:
        yield (
            "The order of the colour channels cannot be checked here, because red outweighs blue as little as blue "
            "does red: red and blue that are exchanged in all pictures would not show."
        )


def _would_show(as_it_is: Trial, wrong: Trial) -> bool:
    if not can_be_judged(wrong.agreement):
        return wrong.agreement.pairs > 0
    if not geometry_agrees(wrong.agreement) or not apart_agrees(wrong.apart):
        return True
    return is_closer(as_it_is, wrong)


def _of_gaps(recording: Recording) -> Iterator[str]:
    blind = _steps_without_overlap(recording)
    if not blind.any():
        return
    at = int(np.argmax(blind))
    yield (
        f"Jumps of the poses cannot be checked at {int(blind.sum())} of {len(blind)} steps, because the camera turns "
        f"there by more than it sees, as between {recording.name(at)} and {recording.name(at + 1)}."
    )


def _of_parts(recording: Recording) -> Iterator[str]:
    for at in gaps(recording):
        if not len(pairs_across(recording.world_from_camera, at)):
            apart_s = float(recording.stamps_s[at + 1] - recording.stamps_s[at])
            yield (
                f"Whether the poses have one origin before and after the gap of {apart_s:.3g} s between "
                f"{recording.name(at)} and {recording.name(at + 1)} cannot be checked here, because no place is seen "
                "in both."
            )


def _steps_without_overlap(recording: Recording) -> Bool[np.ndarray, " m"]:
    pose, camera = recording.world_from_camera, recording.rig.depth
    view_rad = 2.0 * np.arctan(0.5 * camera.width / camera.fx)
    if len(pose) < 2:
        return np.zeros(0, bool)
    return rotation_angle_rad(pose[:-1], pose[1:]) > _NO_OVERLAP * view_rad
