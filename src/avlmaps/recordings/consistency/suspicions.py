"""What is suspected more rarely, row by row, and what would not show: `avlmaps info` looks for it, a build does not."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from avlmaps.recordings.consistency import agreement as limits
from avlmaps.recordings.consistency.agreement import (
    FEWEST_POINTS,
    Surfaces,
    compare,
    draw_pairs,
    odd_steps,
    steps_between_all,
)
from avlmaps.recordings.consistency.check import (
    Evidence,
    Reason,
    Said,
    Suspicion,
    Verdict,
    door_verdict,
    findings_of,
)
from avlmaps.recordings.consistency.readings import AS_IT_IS, Reading, is_closer
from avlmaps.recordings.corrections import Corrections
from avlmaps.recordings.types import Recording

# Share of the depths that are exactly the largest one, in the middle of the frames: those of a wall differ.
_MOST_CUT_OFF, _FARTHEST_FUSED_M = 0.05, 10.0
# Share of pairs with one picture although the camera moved; of steps without one although the pictures changed.
_MOST_FROZEN, _MOVED_STEPS, _CHANGED = 0.08, 0.3, 12.0
# Of right frames: the means of 3 that follow one another in NYU Depth V2 are over -0.05 (265 of 265) and over 0.12
# (255); those of the kitchen over 0.13, of 6 drawn rooms over 0.4, of 12 rendered homes over 0.08.
_LEAST_WARMTH, _FEWEST_FOR_WARMTH = 0.12, 3
# Pairs that are looked at more closely, since the poses may jump between them. Across an odd step fewer points than
# this agree; elsewhere fewer than that, and their depths differ this many times as much as beside.
_MOST_JUMPS, _ACROSS_STEP, _MISFIT, _MISFIT_RATIO = 3, 0.9, 0.7, 3.0


def examine_recording(recording: Recording) -> Verdict:
    """Check a recording against itself with every row, and say what would not show.

    Raises:
        RecordingError: there is no frame, or none of the sample can be read.
    """
    evidence = Evidence.of(recording)
    verdict = door_verdict(evidence)
    findings = [*verdict.findings, *findings_of(_SINGLE, evidence)]
    disagrees = evidence.contradicts or evidence.drifts or evidence.unlike is not None
    if not disagrees or evidence.cause is None:
        findings += findings_of((_JUMP,), evidence)
    unchecked = () if findings else tuple(blind_spots(evidence))
    return replace(verdict, findings=tuple(findings), unchecked=unchecked)


# Single frames


def _cut_off(evidence: Evidence) -> Iterator[Said]:
    depth_m = evidence.sample.depth_m
    most_m = float(depth_m.max())
    shares = [float((one[one > 0.0] == most_m).mean()) for one in depth_m if one.any()]
    share = float(np.median(shares)) if shares else 0.0
    if _MOST_CUT_OFF < share < 1.0 and most_m < _FARTHEST_FUSED_M:
        yield Said(f"{share:.0%} of the depths of a frame are exactly the largest one, {most_m:.4g} m.")


def _frozen(evidence: Evidence) -> Iterator[Said]:
    pose, pairs = evidence.sample.world_from_camera, evidence.sample.pairs
    moved = pairs[[steps_between_all(pose[pair])[0] > _MOVED_STEPS for pair in pairs]]
    for what, pictures in (("depth", evidence.sample.depth_m), ("colour", evidence.sample.grey)):
        one = [bool(pictures[a].any()) and np.array_equal(pictures[a], pictures[b]) for a, b in moved]
        if len(one) >= 3 and float(np.mean(one)) > _MOST_FROZEN:
            share = f"{np.mean(one):.0%} of the pairs of frames"
            yield Said(f"In {share} the {what} picture is the same although the camera moved.")


def _frozen_pose(evidence: Evidence) -> Iterator[Said]:
    pose, grey, pairs = evidence.sample.world_from_camera, evidence.sample.grey, evidence.sample.pairs
    follows = pairs[evidence.sample.follows]
    changed = [np.array_equal(pose[a], pose[b]) and np.abs(grey[a] - grey[b]).mean() > _CHANGED for a, b in follows]
    if len(follows) and _MOST_FROZEN < float(np.mean(changed)) < 1.0:
        yield Said(f"In {np.mean(changed):.0%} of the pairs of frames the pose is the same although pictures changed.")


def _warmth(evidence: Evidence) -> float:
    """Return how much more of the pictures is redder than blue than bluer than red; 0 for too few frames."""
    return float(evidence.sample.warmth.mean()) if len(evidence.sample) >= _FEWEST_FOR_WARMTH else 0.0


def _blue(evidence: Evidence) -> Iterator[Said]:
    if (warmth := _warmth(evidence)) < -_LEAST_WARMTH:
        yield Said(
            f"Blue outweighs red: of the pixels {-warmth:.0%} more are bluer than red than redder than blue, in the "
            f"mean of {len(evidence.sample)} frames, where rooms have more that are redder."
        )


_SINGLE = (
    Suspicion(
        Reason.DEPTH,
        _cut_off,
        "They look cut off there, or none was measured: write 0 for these, or the map has a wall there.",
    ),
    Suspicion(
        Reason.DEPTH, _frozen, "The camera or its driver may have hung; record again, or leave these frames out."
    ),
    Suspicion(Reason.MOTION, _frozen_pose, "The poses froze there: check the odometry, or leave these frames out."),
    Suspicion(
        Reason.COLOUR,
        _blue,
        "Red and blue look exchanged in all colour pictures: write them as RGB, not BGR; or the light, the walls or "
        "the camera's white balance are blue.",
    ),
)


# Frames against frames


def _jump(evidence: Evidence) -> Iterator[Said]:
    """Find a pair that does not agree, where no pair across the place does, and those beside do."""
    recording, after, sample = evidence.recording, evidence.after, evidence.sample
    pairs, odd = sample.index[sample.only(sample.follows).pairs], odd_steps(recording)
    share = np.where(after.points >= 2 * FEWEST_POINTS, after.same / np.maximum(after.points, 1), 1.0)
    most = np.where([odd[a:b].any() for a, b in pairs], _ACROSS_STEP, _MISFIT)
    rows = np.flatnonzero(share < most)
    for row in rows[np.argsort(share[rows] - most[rows], kind="stable")][:_MOST_JUMPS].tolist():
        a, b = (int(number) for number in pairs[row])
        if is_odd := bool(odd[a:b].any()):
            a += int(np.argmax(odd[a:b]))
            b = a + 1
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
        better = beside.same_share > max(limits.LEAST_AGREEING, over.same_share + 0.1)
        if seen and better and (is_odd or far_off) and over.same_share < most[row]:
            yield Said(
                f"Frames {recording.name(a)} and {recording.name(b)} do not agree ({over.same_share:.0%} of the points "
                f"on one surface), although the frames before and after do ({beside.same_share:.0%})."
            )
            return


_JUMP = Suspicion(
    Reason.GEOMETRY,
    _jump,
    "The poses jump there, tracking began again, or frames are exchanged: cut the recording there, or fix them.",
)


# Mistakes that are made to see whether they would show, and what is not checked where they would not.
_MADE: tuple[tuple[tuple[Reading, ...], str], ...] = (
    ((Reading(scale=2.0), Reading(scale=0.5)), "the scale of positions against depth (positions twice as far apart)"),
    ((Reading(scale=1.15), Reading(scale=0.87)), "the scale of positions to 15% (depths that are 15% too large)"),
    (
        (Reading(Corrections(pose_delay_s=0.3)), Reading(Corrections(pose_delay_s=-0.3))),
        "the clock of the poses (poses 0.3 s late)",
    ),
    ((Reading(focal=1.25), Reading(focal=0.8)), "the focal length (one 1.25 times as long)"),
    (
        (Reading(off_centre=(0.08, 0.0)), Reading(off_centre=(0.0, 0.08))),
        "the principal point, or how the camera sits in its mount (8% of the picture)",
    ),
    ((Reading(along_ray=True),), "whether depth is measured along the camera's axis (distances along the ray)"),
)
_NEVER = (
    "Never checked: the distortion of the lens, the order of the colour channels of single pictures, whether colour "
    "lies on depth to a sixteenth of the picture, and whether poses before and after a long pause have one origin."
)


def blind_spots(evidence: Evidence) -> Iterator[str]:
    """Yield what cannot be checked in a recording of which nothing is wrong, and why, one sentence each."""
    if not evidence.judged:
        yield f"Poses, depth, colour, intrinsics and clocks cannot be checked here, because {_why(evidence)}."
        return
    as_it_is = evidence.trials.run(AS_IT_IS, colour=False)

    def shows(reading: Reading) -> bool:
        wrong = evidence.trials.run(reading, colour=False)
        if not limits.can_be_judged(wrong.after):
            return wrong.after.pairs > 0
        agrees = limits.geometry_agrees(wrong.after) and limits.apart_agrees(wrong.apart)
        return not agrees or is_closer(as_it_is, wrong)

    if hidden := [what for readings, what in _MADE if not all(map(shows, readings))]:
        yield f"The camera moves too little or too evenly here to show: {'; '.join(hidden)}."
    if _warmth(evidence) < _LEAST_WARMTH:
        yield (
            "The order of the colour channels cannot be checked here, because red outweighs blue as little as blue "
            "does red: red and blue that are exchanged in all pictures would not show."
        )
    yield _NEVER


def _why(evidence: Evidence) -> str:
    if (outside := evidence.after.outside) > 0.0:
        where = f"{outside:.0%} of the points of one lie outside of the other's view"
        return f"hardly any two frames see the same place ({where})"
    return "there is one frame" if len(evidence.recording) == 1 else "too few pixels have a depth on smooth surface"
