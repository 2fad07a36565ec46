"""The check of a recording against itself: a sample of frames, in a second or two, without any model.

Points of one frame must lie on the surface that another frame sees, and look alike there. Thresholds: right
recordings (rendered homes with people, noise and drift, a real Kinect walk) have at least 0.96 of the points on the
surface and a likeness of 0.87 at least; docs/recordings.md has the figures.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.consistency.agreement import (
    APART_SAME_M,
    FEWEST_POINTS,
    LEAST_CONTRAST,
    Agreement,
    compare,
)
from avlmaps.recordings.consistency.causes import cause_of
from avlmaps.recordings.consistency.sample import Sample, Surfaces, draw_pairs, draw_sample
from avlmaps.recordings.consistency.single_frames import of_colour, of_depth, of_intrinsics, of_motion
from avlmaps.recordings.consistency.suspects import PoseAt, Trial, Trials, find_cause, find_closer
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason, Verdict
from avlmaps.recordings.corrections import NONE, CorrectedRecording, uncorrected
from avlmaps.recordings.types import Recording

# Share of points on the surface that the other frame sees.
LEAST_AGREEING = 0.94
IMPOSSIBLE_AGREEING = 0.70
# Where people walk by, fewer points agree, but those that do agree well: by a share of their depth.
LEAST_WITH_PEOPLE, MOST_OFF = 0.80, 0.01
# Of pairs that look one way from apart, which have the drift of a walk as well.
LEAST_AGREEING_APART = 0.75
# Share of pairs that do not agree at all, although the others do: jumps, exchanged frames.
BAD_PAIR = 0.6
BAD_OFF = 0.03
MOST_BAD_PAIRS = 0.08
# Pairs that are looked at more closely, since the poses may jump between them.
MOST_JUMPS = 3
# A step of the poses this many times the usual one, and beyond this, is a jump if fewer points agree across it.
LEAST_ACROSS_STEP = 0.9
ODD_STEP, ODD_STEP_M, ODD_STEP_RAD = 4.0, 0.15, np.radians(8.0)
# Of fewer points than are judged otherwise, hardly any may agree.
HARDLY_ANY = 0.2
# Correlation of the brightness of the same points, of all pairs and of a pair that is not one.
LEAST_LIKENESS = 0.75
BAD_LIKENESS = 0.4
IMPOSSIBLE_LIKENESS = 0.3
# Nothing is said of a recording with fewer pairs or points.
FEWEST_PAIRS = 2
FEWEST_IN_ALL = 150


def check_recording(recording: Recording) -> Verdict:
    """Check a recording against itself.

    Raises:
        RecordingError: it has no frame that can be read.
    """
    if len(recording) == 0:
        raise RecordingError(f"{recording.path} has no frames with a pose; there is nothing to check.")
    sample = draw_sample(recording)
    surfaces = Surfaces.of(sample.depth_m)
    after = compare(sample.only(sample.follows), surfaces, sample.world_from_camera)
    apart = compare(sample.only(~sample.follows), surfaces, sample.world_from_camera, floor_m=APART_SAME_M)
    known = sample.depth_m[sample.depth_m > 0.0]
    median_m = float(np.median(known)) if known.size else float("nan")
    findings = [
        *of_intrinsics(sample, recording),
        *of_depth(sample, surfaces, median_m),
        *of_colour(sample, surfaces),
        *of_motion(recording, after, _can_be_judged(after)),
        *_of_agreement(recording, sample, _Found(after, apart), median_m),
    ]
    checked = _can_be_judged(after)
    return Verdict(
        frames=len(sample),
        pairs=after.pairs,
        agreeing=after.same_share if checked else float("nan"),
        seen_through=after.through_share if checked else float("nan"),
        likeness=after.likeness,
        median_depth_m=median_m,
        findings=tuple(findings),
        unread=sample.unread,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """How pairs agree that follow one another, and pairs from apart."""

    after: Agreement
    apart: Agreement


def _can_be_judged(found: Agreement) -> bool:
    return found.pairs >= FEWEST_PAIRS and int(found.points.sum()) >= FEWEST_IN_ALL


def _geometry_agrees(found: Agreement) -> bool:
    """Return whether nearly all points agree, or most of them do so well that the others are what moved meanwhile."""
    if _bad_pairs(found) > MOST_BAD_PAIRS * found.pairs:
        return False
    known = found.off[np.isfinite(found.off)]
    moved = found.same_share >= LEAST_WITH_PEOPLE and float(np.median(known)) <= MOST_OFF
    return found.same_share >= LEAST_AGREEING or moved


def _apart_agrees(found: Agreement) -> bool:
    return not _can_be_judged(found) or found.same_share >= LEAST_AGREEING_APART


def _bad_pairs(found: Agreement) -> int:
    """Return how many pairs hardly agree, not for somebody who stands before a part of the picture."""
    used = found.points >= FEWEST_POINTS
    return int(((found.same < BAD_PAIR * found.points) & (found.off > BAD_OFF))[used].sum())


def _unlike(found: Agreement) -> bool:
    """Return whether the same points do not look alike, in all or in several pairs."""
    if not np.isfinite(found.likeness) or found.textured < FEWEST_IN_ALL or found.contrast < LEAST_CONTRAST:
        return False
    bad = int((found.alike < BAD_LIKENESS).sum())
    return found.likeness < LEAST_LIKENESS or (bad >= 2 and bad > MOST_BAD_PAIRS * np.isfinite(found.alike).sum())


def _most_unlike(after: Agreement, apart: Agreement) -> Agreement | None:
    """Return the pairs that do not look alike: those that follow one another if they do not, else those from apart."""
    return next((one for one in (after, apart) if _can_be_judged(one) and _unlike(one)), None)


def _of_agreement(recording: Recording, sample: Sample, found: _Found, median_m: float) -> Iterator[Finding]:
    after, apart = found.after, found.apart
    if _can_be_judged(after) and not _geometry_agrees(after):
        grade = Grade.IMPOSSIBLE if after.same_share < IMPOSSIBLE_AGREEING else Grade.SUSPICIOUS
        sentence = (
            f"Frames that should see the same place do not agree: of the points of one frame {after.same_share:.0%} "
            f"lie on the surface that another sees, and {after.through_share:.1%} are seen through ({after.pairs} "
            "pairs of frames)."
        )
        cause = _cause(recording, sample, found, median_m)
        yield Finding(Reason.GEOMETRY, grade, sentence, cause or _other_cause(recording, sample, after))
    elif not _apart_agrees(apart):
        sentence = (
            f"Frames that look at the same place from apart do not agree: {apart.same_share:.0%} of their points lie "
            f"on one surface, and {apart.through_share:.1%} are seen through ({apart.pairs} pairs of frames)."
        )
        other = "The poses drift, depth and positions have different scales, or much was moved; check them."
        cause = _cause(recording, sample, found, median_m)
        yield Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, cause or other)
    elif _can_be_judged(after) and (closer := find_closer(_trials(recording, sample))) is not None:
        then = _off(_Found(closer.agreement, closer.apart))
        sentence = (
            f"The depths of the same points in two frames differ by {_off(found):.1%}, and by {then:.1%} if the "
            "recording is read in another way."
        )
        yield Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, _words(recording, closer, median_m, ""))
    elif jump := _jump(recording, sample, after):
        yield jump
    elif unlike := _most_unlike(after, apart):
        grade = Grade.IMPOSSIBLE if after.likeness < IMPOSSIBLE_LIKENESS else Grade.SUSPICIOUS
        sentence = (
            "The colour pictures do not show what the depth pictures show: the brightness of the same points in two "
            f"frames{' from apart' if unlike is apart else ''} correlates by {unlike.likeness:.2f} where right "
            f"recordings have {'0.85' if unlike is apart else '0.9'} and more, and hardly at all in "
            f"{int((unlike.alike < BAD_LIKENESS).sum())} of {int(np.isfinite(unlike.alike).sum())} pairs."
        )
        other = "Check that colour and depth of a frame belong together (order of names, clock, intrinsics of colour)."
        yield Finding(Reason.COLOUR, grade, sentence, _cause(recording, sample, found, median_m) or other)


def _off(found: _Found) -> float:
    return float(np.nanmean(np.concatenate([found.after.off, found.apart.off])))


def _jump(recording: Recording, sample: Sample, after: Agreement) -> Finding | None:
    """Return a finding where a pair does not agree, no pair across the same place does, and those beside do."""
    pairs = sample.index[sample.only(sample.follows).pairs]
    odd = _odd_steps(recording)
    share = np.where(after.points >= 2 * FEWEST_POINTS, after.same / np.maximum(after.points, 1), 1.0)
    most = np.where([odd[a:b].any() for a, b in pairs], LEAST_ACROSS_STEP, BAD_PAIR)
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
            compare(near.only(kind), surfaces, near.world_from_camera) for kind in (near.follows, ~near.follows)
        )
        few = over.pairs >= FEWEST_PAIRS and over.same_share < HARDLY_ANY
        seen = (_can_be_judged(over) or few) and _can_be_judged(beside)
        if seen and over.same_share < most[row] and beside.same_share > max(LEAST_AGREEING, over.same_share + 0.1):
            sentence = (
                f"Frames {recording.name(a)} and {recording.name(b)} do not agree ({over.same_share:.0%} of the points "
                f"on one surface), although the frames before and after do ({beside.same_share:.0%})."
            )
            remedy = "The poses jump there, or tracking began again: cut the recording there, or fix the poses."
            return Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, remedy)
    return None


def _odd_steps(recording: Recording) -> Bool[np.ndarray, " m"]:
    """Return which steps of the poses are far longer, or turn far more, than the usual one."""
    pose = recording.world_from_camera
    if len(pose) < 2:
        return np.zeros(0, bool)
    moved_m = np.linalg.norm(np.diff(pose[:, :3, 3], axis=0), axis=1)
    turned_rad = rotation_angle_rad(pose[:-1], pose[1:])
    far = moved_m > max(ODD_STEP * float(np.median(moved_m)), ODD_STEP_M)
    return far | (turned_rad > max(ODD_STEP * float(np.median(turned_rad)), ODD_STEP_RAD))


def _other_cause(recording: Recording, sample: Sample, after: Agreement) -> str:
    used = after.points >= FEWEST_POINTS
    share = np.where(used, after.same / np.maximum(after.points, 1), np.nan)
    bad, others = _bad_pairs(after), share[share >= BAD_PAIR]
    if 0 < bad <= 0.4 * after.pairs and len(others) and float(np.median(others)) > LEAST_AGREEING:
        pair = sample.only(sample.follows).pairs[int(np.nanargmin(share))]
        a, b = (recording.name(int(sample.index[i])) for i in pair)
        return (
            f"{bad} of the pairs are far off, the others are right: the poses jump, or frames are exchanged, for "
            f"example between {a} and {b}. Cut the recording there, or fix the order or the poses."
        )
    return "No usual mistake explains it; check the poses, the depth and the intrinsics, and that they belong together."


def _cause(recording: Recording, sample: Sample, found: _Found, median_m: float) -> str:
    """Return what makes the recording agree with itself, or nothing."""
    best = find_cause(_trials(recording, sample), lambda trial: _explains(trial, found))
    return "" if best is None else _words(recording, best, median_m, _gain(found, best))


def _trials(recording: Recording, sample: Sample) -> Trials:
    given = recording.given if isinstance(recording, CorrectedRecording) else NONE
    return Trials(sample, pose_at(recording, sample), given)


def _words(recording: Recording, best: Trial, median_m: float, gain: str) -> str:
    return cause_of(best.suspect, recording.rig, recording.stored_depth_unit_m, median_m, gain)


def _gain(found: _Found, best: Trial) -> str:
    """Return how much better it agrees, in parentheses."""
    for before, after, right in (
        (found.after, best.agreement, _geometry_agrees(found.after)),
        (found.apart, best.apart, _apart_agrees(found.apart)),
    ):
        if not right:
            return (
                f"(seen through {before.through_share:.1%} -> {after.through_share:.1%}, "
                f"agreeing {before.same_share:.0%} -> {after.same_share:.0%})"
            )
    after = _unlike(found.after)
    before, then = (found.after, best.agreement) if after else (found.apart, best.apart)
    return f"(correlation {before.likeness:.2f} -> {then.likeness:.2f})"


def _explains(trial: Trial, found: _Found) -> bool:
    """Return whether a suspect makes the pairs agree, clearly better than they did."""
    after, apart = trial.agreement, trial.apart
    if not _can_be_judged(after) or not _geometry_agrees(after) or not _apart_agrees(apart):
        return False
    if _most_unlike(after, apart) is not None:
        return False
    if trial.score < LEAST_AGREEING * 0.9:
        return False
    if not _geometry_agrees(found.after):
        return after.same_share > found.after.same_share + 0.5 * (1.0 - found.after.same_share)
    if not _apart_agrees(found.apart):
        return _can_be_judged(apart) and apart.same_share > 0.5 * (1.0 + found.apart.same_share)
    return True


def pose_at(recording: Recording, sample: Sample) -> PoseAt:
    """Return a function that gives the uncorrected poses of the sample's frames at their stamps plus a delay."""
    whole = uncorrected(recording)
    known = whole.trajectory or Trajectory(whole.stamps_s, whole.world_from_camera)

    def at(delay_s: float) -> np.ndarray | None:
        wanted_s = sample.stamps_s + delay_s
        held_s = np.clip(wanted_s, known.stamps_s[0], known.stamps_s[-1])
        if float((np.abs(wanted_s - held_s) > 0.05).mean()) > 0.5:
            return None
        return known.at(held_s)

    return at
