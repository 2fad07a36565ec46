"""The check of a recording against itself: a sample of frames, in a second or two, without any model.

Points of one frame must lie on the surface that another frame sees, and look alike there. Thresholds: right
recordings (rendered homes with people, noise and drift, a real Kinect walk) have at least 0.96 of the points on the
surface and a likeness of 0.87 at least; docs/recordings.md has the figures.
"""

from collections.abc import Iterator

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.consistency.agreement import FEWEST_POINTS, LEAST_CONTRAST, Agreement, compare
from avlmaps.recordings.consistency.causes import cause_of
from avlmaps.recordings.consistency.sample import Sample, Surfaces, draw_sample
from avlmaps.recordings.consistency.single_frames import of_colour, of_depth, of_intrinsics, of_motion
from avlmaps.recordings.consistency.suspects import PoseAt, Trial, Trials, find_cause
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason, Verdict
from avlmaps.recordings.corrections import NONE, CorrectedRecording, uncorrected
from avlmaps.recordings.types import Recording

# Share of points on the surface that the other frame sees.
LEAST_AGREEING = 0.94
IMPOSSIBLE_AGREEING = 0.70
# Share of pairs that do not agree at all, although the others do: jumps, exchanged frames.
BAD_PAIR = 0.6
MOST_BAD_PAIRS = 0.08
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
    known = sample.depth_m[sample.depth_m > 0.0]
    median_m = float(np.median(known)) if known.size else float("nan")
    findings = [
        *of_intrinsics(sample, recording),
        *of_depth(sample, median_m),
        *of_colour(sample, surfaces),
        *of_motion(recording, after, _can_be_judged(after)),
        *_of_agreement(recording, sample, after, median_m),
    ]
    order = (Grade.IMPOSSIBLE, Grade.SUSPICIOUS)
    checked = _can_be_judged(after)
    return Verdict(
        frames=len(sample),
        pairs=after.pairs,
        agreeing=after.same_share if checked else float("nan"),
        seen_through=after.through_share if checked else float("nan"),
        likeness=after.likeness,
        median_depth_m=median_m,
        findings=tuple(sorted(findings, key=lambda finding: order.index(finding.grade))),
    )


def _can_be_judged(found: Agreement) -> bool:
    return found.pairs >= FEWEST_PAIRS and int(found.points.sum()) >= FEWEST_IN_ALL


def agrees(found: Agreement) -> bool:
    """Return whether pairs agree as those of right recordings do."""
    if not _can_be_judged(found):
        return False
    used = found.points >= FEWEST_POINTS
    bad = float((found.same[used] < BAD_PAIR * found.points[used]).mean())
    return found.same_share >= LEAST_AGREEING and bad <= MOST_BAD_PAIRS and not _unlike(found)


def _unlike(found: Agreement) -> bool:
    """Return whether the same points do not look alike, in all or in several pairs."""
    if not np.isfinite(found.likeness) or found.textured < FEWEST_IN_ALL or found.contrast < LEAST_CONTRAST:
        return False
    bad = int((found.alike < BAD_LIKENESS).sum())
    return found.likeness < LEAST_LIKENESS or (bad >= 2 and bad > MOST_BAD_PAIRS * np.isfinite(found.alike).sum())


def _of_agreement(recording: Recording, sample: Sample, found: Agreement, median_m: float) -> Iterator[Finding]:
    if not _can_be_judged(found) or agrees(found):
        return
    used = found.points >= FEWEST_POINTS
    share = found.same[used] / found.points[used]
    bad = int((share < BAD_PAIR).sum())
    if found.same_share < LEAST_AGREEING or bad > MOST_BAD_PAIRS * used.sum():
        grade = Grade.IMPOSSIBLE if found.same_share < IMPOSSIBLE_AGREEING else Grade.SUSPICIOUS
        sentence = (
            f"Frames that should see the same place do not agree: of the points of one frame {found.same_share:.0%} "
            f"lie on the surface that another sees, and {found.through_share:.1%} are seen through ({found.pairs} "
            "pairs of frames)."
        )
        others = float(np.median(share[share >= BAD_PAIR])) if bad < len(share) else 0.0
        yield Finding(Reason.GEOMETRY, grade, sentence, _remedy(recording, sample, found, median_m, bad, others))
        return
    grade = Grade.IMPOSSIBLE if found.likeness < IMPOSSIBLE_LIKENESS else Grade.SUSPICIOUS
    bad = int((found.alike < BAD_LIKENESS).sum())
    sentence = (
        "The colour pictures do not show what the depth pictures show: the brightness of the same points in two "
        f"frames correlates by {found.likeness:.2f} where right recordings have 0.9 and more, and hardly at all in "
        f"{bad} of {int(np.isfinite(found.alike).sum())} pairs."
    )
    other = "Check that colour and depth of a frame belong together (order of names, clock, intrinsics of colour)."
    yield Finding(Reason.COLOUR, grade, sentence, _cause(recording, sample, found, median_m) or other)


def _remedy(recording: Recording, sample: Sample, found: Agreement, median_m: float, bad: int, others: float) -> str:
    cause = _cause(recording, sample, found, median_m)
    if cause:
        return cause
    if 0 < bad <= 0.4 * found.pairs and others > LEAST_AGREEING:
        pairs = sample.only(sample.follows).pairs
        row = int(np.argmin(np.where(found.points >= FEWEST_POINTS, found.same / np.maximum(found.points, 1), 1.0)))
        a, b = (recording.name(int(sample.index[i])) for i in pairs[row])
        return (
            f"{bad} of the pairs are far off, the others are right: the poses jump, or frames are exchanged, for "
            f"example between {a} and {b}. Cut the recording there, or fix the order or the poses."
        )
    return "No usual mistake explains it; check the poses, the depth and the intrinsics, and that they belong together."


def _cause(recording: Recording, sample: Sample, found: Agreement, median_m: float) -> str:
    """Return what makes the recording agree with itself, or nothing."""
    given = recording.given if isinstance(recording, CorrectedRecording) else NONE
    trials = Trials(sample.only(sample.follows), pose_at(recording, sample), given)
    best = find_cause(trials, lambda trial: _explains(trial, found))
    if best is None:
        return ""
    better = best.agreement
    if found.same_share < LEAST_AGREEING:
        gain = f"(seen through {found.through_share:.1%} -> {better.through_share:.1%}, "
        gain += f"agreeing {found.same_share:.0%} -> {better.same_share:.0%})"
    else:
        gain = f"(correlation {found.likeness:.2f} -> {better.likeness:.2f})"
    return cause_of(best.suspect, recording.rig, recording.stored_depth_unit_m, median_m, gain)


def _explains(trial: Trial, before: Agreement) -> bool:
    """Return whether a suspect makes the pairs agree, clearly better than they did."""
    found = trial.agreement
    if not agrees(found) or trial.score < LEAST_AGREEING * 0.9:
        return False
    if before.same_share < LEAST_AGREEING:
        return found.same_share > before.same_share + 0.5 * (1.0 - before.same_share)
    return found.likeness > before.likeness + 0.1 or not agrees(before)


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
