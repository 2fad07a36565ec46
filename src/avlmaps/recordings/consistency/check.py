"""The check of a recording against itself: a sample of frames, in a second or two, without any model.

Points of one frame must lie on the surface that another frame sees, and look alike there. Thresholds: right
recordings (rendered homes with people, noise and drift, a real Kinect walk) have at least 0.96 of the points on the
surface and a likeness of 0.87 at least; docs/recordings.md has the figures.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.consistency import agreement as limits
from avlmaps.recordings.consistency.agreement import APART_SAME_M, FEWEST_POINTS, Agreement, compare, without_occluded
from avlmaps.recordings.consistency.edges import DepthEdges, Shift, find_edges, shift_of
from avlmaps.recordings.consistency.flats import Levels, RightAngles, Tilt, find_levels
from avlmaps.recordings.consistency.jumps import blind_spots, find_exchanged, find_jump, find_parts
from avlmaps.recordings.consistency.sample import Sample, Surfaces, draw_sample, small_frame, steps_between_all
from avlmaps.recordings.consistency.single_frames import (
    of_colour,
    of_depth,
    of_intrinsics,
    of_loudness,
    of_motion,
    of_poses,
    of_sound,
    warmth_of,
)
from avlmaps.recordings.consistency.suspects import (
    FramesAt,
    PoseAt,
    Suspect,
    Trial,
    Trials,
    cause_of,
    find_cause,
    find_closer,
    find_offset,
)
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason, Verdict
from avlmaps.recordings.corrections import NONE, CorrectedRecording, uncorrected
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Recording

_STANDS = 0.01  # steps between poses that are one


def check_recording(recording: Recording) -> Verdict:
    """Check a recording against itself."""
    if len(recording) == 0:
        raise RecordingError(f"{recording.path} has no frames with a pose; there is nothing to check.")
    sample = draw_sample(recording)
    surfaces = Surfaces.of(sample.depth_m)
    following, distant = sample.only(sample.follows), sample.only(~sample.follows)
    after = compare(following, surfaces, sample.world_from_camera)
    after = without_occluded(after, following, surfaces)
    apart = compare(distant, surfaces, sample.world_from_camera, floor_m=APART_SAME_M)
    apart = without_occluded(apart, distant, surfaces)
    redness = compare(sample.of_redness(), surfaces, sample.world_from_camera)
    found = _Found(
        after,
        apart,
        find_edges(sample),
        redness,
        find_levels(sample),
        RightAngles.of(sample),
        _trials(recording, sample),
    )
    of_program = is_of_program(recording)
    known = sample.depth_m[sample.depth_m > 0.0]
    median_m = float(np.median(known)) if known.size else float("nan")
    findings = [
        *of_intrinsics(recording, of_program),
        *of_depth(sample, surfaces, median_m, of_program),
        *of_colour(sample, surfaces),
        *of_poses(recording),
        *of_sound(recording),
        *of_loudness(recording),
        *of_motion(recording, after, limits.can_be_judged(after)),
        *_of_agreement(recording, sample, found, median_m),
    ]
    checked, unchecked = limits.can_be_judged(after), ()
    if not findings:
        unchecked = blind_spots(
            recording, after, found.trials, found.edges, found.levels, found.angles, warmth_of(sample)
        )
    return Verdict(
        frames=len(sample),
        pairs=after.pairs,
        agreeing=after.same_share if checked else float("nan"),
        seen_through=after.through_share if checked else float("nan"),
        likeness=after.likeness,
        median_depth_m=median_m,
        findings=tuple(findings),
        unread=sample.unread,
        unchecked=unchecked,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """How pairs agree that follow, and from apart; colour at edges; red less blue; floors; walls; what is tried."""

    after: Agreement
    apart: Agreement
    edges: DepthEdges
    redness: Agreement
    levels: Levels
    angles: RightAngles
    trials: Trials


def _most_unlike(after: Agreement, apart: Agreement) -> Agreement | None:
    return next((one for one in (after, apart) if limits.can_be_judged(one) and limits.unlike(one)), None)


def _of_agreement(recording: Recording, sample: Sample, found: _Found, median_m: float) -> Iterator[Finding]:
    after, apart = found.after, found.apart
    if limits.can_be_judged(after) and not limits.geometry_agrees(after):
        grade = Grade.IMPOSSIBLE if after.same_share < limits.IMPOSSIBLE_AGREEING else Grade.SUSPICIOUS
        sentence = (
            f"Frames that should see the same place do not agree: of the points of one frame {after.same_share:.0%} "
            f"lie on the surface that another sees, and {after.through_share:.1%} are seen through ({after.pairs} "
            "pairs of frames)."
        )
        cause = _cause(recording, found, median_m)
        yield Finding(Reason.GEOMETRY, grade, sentence, cause or _other_cause(recording, sample, found))
    elif not limits.apart_agrees(apart):
        sentence = (
            f"Frames that look at the same place from apart do not agree: {apart.same_share:.0%} of their points lie "
            f"on one surface, and {apart.through_share:.1%} are seen through ({apart.pairs} pairs of frames)."
        )
        other = "The poses drift, depth and positions have different scales, or much was moved; check them."
        cause = _cause(recording, found, median_m)
        yield Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, cause or other)
    elif flat := found.angles.finding(recording, found.levels):
        yield flat
    elif limits.can_be_judged(after) and (closer := find_closer(found.trials)) is not None:
        then = _off(closer.agreement, closer.apart)
        sentence = (
            f"The depths of the same points in two frames differ by {_off(after, apart):.1%}, and by {then:.1%} if the "
            "recording is read in another way."
        )
        yield Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, _words(recording, closer, median_m, ""))
    elif limits.can_be_judged(after) and (offset := find_offset(found.trials)) is not None:
        sentence = (
            f"Flat surfaces are curved in the depth of single frames, as if {abs(offset.suspect.farther_m):.2g} m were "
            f"{'added to' if offset.suspect.farther_m < 0.0 else 'taken from'} all of it, and without that the depths "
            f"of the same points in two frames differ by {offset.off:.1%}, not by {_off(after, apart):.1%}."
        )
        yield Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, _words(recording, offset, median_m, ""))
    elif limits.can_be_judged(after) and (tilt := found.levels.tilt) is not None:
        sentence = (
            f"Floors do not stay level while the camera turns: they lie {tilt.off_deg:.1f} degrees off (the middle of "
            f"{len(found.levels.up)} frames), and {tilt.left_deg:.1f} if the camera sits {_tilt_words(tilt)} than its "
            "poses say."
        )
        yield Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, _tilt_remedy(tilt, recording))
    elif misplaced := (
        find_exchanged(recording, sample, after) or find_jump(recording, sample, after) or find_parts(recording)
    ):
        yield misplaced
    else:
        yield from _of_colours(recording, sample, found, median_m)


def _of_colours(recording: Recording, sample: Sample, found: _Found, median_m: float) -> Iterator[Finding]:
    after, apart = found.after, found.apart
    if differing := _most_unlike(after, apart):
        grade = Grade.IMPOSSIBLE if after.likeness < limits.IMPOSSIBLE_LIKENESS else Grade.SUSPICIOUS
        sentence = (
            "The colour pictures do not show what the depth pictures show: the brightness of the same points in two "
            f"frames{' from apart' if differing is apart else ''} correlates by {differing.likeness:.2f} where right "
            f"recordings have {'0.85' if differing is apart else '0.9'} and more, and hardly at all in "
            f"{int((differing.alike < limits.BAD_LIKENESS).sum())} of {int(np.isfinite(differing.alike).sum())} pairs."
        )
        other = "Check that colour and depth of a frame belong together (order of names, clock, intrinsics of colour)."
        shift = shift_of(found.edges, sample)
        where = "" if shift is None else " ".join(_shift_words(shift, recording))
        yield Finding(Reason.COLOUR, grade, sentence, _cause(recording, found, median_m) or where or other)
    elif opposite := limits.opposite_pairs(found.redness):
        sentence = (
            f"Red and blue of the same points are exchanged in {opposite} of "
            f"{int(np.isfinite(found.redness.alike).sum())} pairs of frames: some colour pictures are RGB, others BGR."
        )
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, "Write all pictures in one order of channels.")
    elif shift := shift_of(found.edges, sample):
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, *_shift_words(shift, recording))


def _shift_words(shift: Shift, recording: Recording) -> tuple[str, str]:
    """Return what is wrong where edges of colour lie beside those of depth, and what to do."""
    width = recording.rig.rgb.width
    parts = ((shift.columns * width, "to the right", "to the left"), (shift.rows * width, "below", "above"))
    where = " and ".join(f"{abs(px):.0f} pixels {more if px > 0.0 else less}" for px, more, less in parts if px)
    sentence = (
        f"The edges of colour do not lie on those of depth, but {where} (gradient of colour {shift.gradient:.2f} "
        f"there, {shift.here:.2f} where depth has them, in standard deviations)."
    )
    if shift.metres is not None:
        x_m, y_m = shift.metres
        return sentence, (
            f"The colour camera looks {np.hypot(x_m, y_m):.2g} m beside where rgb_from_depth has it (x {x_m:+.2f}, y "
            f"{y_m:+.2f} m in its axes); correct rgb_from_depth, or register the depth to colour."
        )
    return sentence, (
        "Colour and depth look shifted against each other, or taken at different moments; check the order and the "
        "clock of the pictures, rgb_from_depth and the principal points."
    )


def _tilt_words(tilt: Tilt) -> str:
    parts = (
        (tilt.down_deg, "farther down", "farther up"),
        (tilt.right_deg, "lower on its right", "lower on its left"),
    )
    words = [f"{abs(by):.0f} degrees {more if by > 0.0 else less}" for by, more, less in parts if abs(by) >= 1.0]
    return " and ".join(words)


def _tilt_remedy(tilt: Tilt, recording: Recording) -> str:
    camera = recording.rig.depth
    rows = abs(np.tan(np.radians(tilt.down_deg))) * camera.fy
    remedy = "Correct the transform from what the poses are of to the camera"
    if abs(tilt.down_deg) > abs(tilt.right_deg):
        remedy += f", or cy, if it is {rows:.0f} pixels off in the {camera.width}x{camera.height} pictures"
    return f"{remedy}."


def _off(after: Agreement, apart: Agreement) -> float:
    return float(np.nanmean(np.concatenate([after.off, apart.off])))


def _other_cause(recording: Recording, sample: Sample, found: _Found) -> str:
    after = found.after
    if float(steps_between_all(sample.world_from_camera).max(initial=0.0)) < _STANDS:
        return "All poses are the same, though the pictures are not: the poses are missing, or those of another camera."
    if (exchanged := find_exchanged(recording, sample, after)) is not None:
        return str(exchanged)
    if (flat := found.angles.finding(recording, found.levels)) is not None:
        return str(flat)
    used = after.points >= FEWEST_POINTS
    share = np.where(used, after.same / np.maximum(after.points, 1), np.nan)
    bad, others = limits.bad_pairs(after), share[share >= limits.BAD_PAIR]
    if 0 < bad <= 0.4 * after.pairs and len(others) and float(np.median(others)) > limits.LEAST_AGREEING:
        pair = sample.only(sample.follows).pairs[int(np.nanargmin(share))]
        a, b = (recording.name(int(sample.index[i])) for i in pair)
        return (
            f"{bad} of the pairs are far off, the others are right: the poses jump, or frames are exchanged, for "
            f"example between {a} and {b}. Cut the recording there, or fix the order or the poses."
        )
    if (tilt := found.levels.tilt) is not None:
        return f"By its floors the camera sits {_tilt_words(tilt)} than its poses say. {_tilt_remedy(tilt, recording)}"
    return "No usual mistake explains it; check the poses, the depth and the intrinsics, and that they belong together."


def _cause(recording: Recording, found: _Found, median_m: float) -> str:
    best = find_cause(found.trials, lambda trial: _explains(trial, found))
    if best is None:
        return ""
    of_focal_alone = best.suspect == Suspect(focal=best.suspect.focal)
    if of_focal_alone and (lens := found.angles.lens()) is not None:
        return str(lens)  # another focal length moves what it bends, and leaves flat surfaces flat
    return _words(recording, best, median_m, _gain(found, best))


def _trials(recording: Recording, sample: Sample) -> Trials:
    given = recording.given if isinstance(recording, CorrectedRecording) else NONE
    pace_s = float(np.median(np.diff(recording.stamps_s))) if len(recording) > 1 else 0.0
    return Trials(sample, pose_at(recording, sample), given, frames_at(recording, sample), pace_s)


def _words(recording: Recording, best: Trial, median_m: float, gain: str) -> str:
    stored_unit_m, of_program = recording.stored_depth_unit_m, is_of_program(recording)
    return cause_of(best.suspect, recording.rig, stored_unit_m, median_m, gain, of_program=of_program)


def _gain(found: _Found, best: Trial) -> str:
    for before, after, right in (
        (found.after, best.agreement, limits.geometry_agrees(found.after)),
        (found.apart, best.apart, limits.apart_agrees(found.apart)),
    ):
        if not right:
            return (
                f"(seen through {before.through_share:.1%} -> {after.through_share:.1%}, "
                f"agreeing {before.same_share:.0%} -> {after.same_share:.0%})"
            )
    after = limits.unlike(found.after)
    before, then = (found.after, best.agreement) if after else (found.apart, best.apart)
    return f"(correlation {before.likeness:.2f} -> {then.likeness:.2f})"


def _explains(trial: Trial, found: _Found) -> bool:
    after, apart = trial.agreement, trial.apart
    if not limits.can_be_judged(after) or not limits.geometry_agrees(after) or not limits.apart_agrees(apart):
        return False
    if _most_unlike(after, apart) is not None:
        return False
    if trial.score < limits.LEAST_AGREEING * 0.9:
        return False
    if not limits.geometry_agrees(found.after):
        return after.same_share > found.after.same_share + 0.5 * (1.0 - found.after.same_share)
    if not limits.apart_agrees(found.apart):
        return limits.can_be_judged(apart) and apart.same_share > 0.5 * (1.0 + found.apart.same_share)
    return True


def frames_at(recording: Recording, sample: Sample) -> FramesAt:
    """Return a function that reads the pictures of frames that come so many after the sample's."""

    def at(late: int) -> tuple[np.ndarray, np.ndarray] | None:
        rows = np.clip(sample.index + late, 0, len(recording) - 1)
        if len(np.unique(rows)) < 0.5 * len(rows):
            return None
        try:
            frames = [small_frame(recording.frame(int(row)), sample.rig) for row in rows]
        except RecordingError:
            return None
        there = sample.index + late == rows  # beyond the ends nothing is known
        depth_m = np.stack([depth_m if own else 0.0 * depth_m for (depth_m, _), own in zip(frames, there, strict=True)])
        return depth_m, np.stack([grey for _, grey in frames])

    return at


def pose_at(recording: Recording, sample: Sample) -> PoseAt:
    """Return a function that gives the uncorrected poses of the sample's frames at their stamps plus a delay."""
    known = uncorrected(recording).walk

    def at(delay_s: float) -> np.ndarray | None:
        wanted_s = sample.stamps_s + delay_s
        held_s = np.clip(wanted_s, known.stamps_s[0], known.stamps_s[-1])
        if float((np.abs(wanted_s - held_s) > 0.05).mean()) > 0.5:
            return None
        return known.at(held_s)

    return at
