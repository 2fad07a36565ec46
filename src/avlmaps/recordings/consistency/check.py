"""The check of a recording against itself: a sample of frames, in a second or two, without any model.

Points of one frame must lie on the surface that another frame sees, and look alike there. Thresholds: right
recordings (rendered homes with people, noise and drift, a real Kinect walk) have at least 0.96 of the points on the
surface and a likeness of 0.87 at least; docs/recordings.md has the figures.
"""

from collections.abc import Iterator

import numpy as np

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.consistency.agreement import FEWEST_POINTS, LEAST_CONTRAST, Agreement, compare
from avlmaps.recordings.consistency.causes import cause_of
from avlmaps.recordings.consistency.sample import Sample, Surfaces, draw_sample, steps_between_all
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
# A camera in a building sees this far, in the middle.
SUSPICIOUS_DEPTH_M = (0.3, 9.0)
IMPOSSIBLE_DEPTH_M = (0.04, 60.0)
LEAST_DEPTH_SHARE = 0.05
MOST_EMPTY_FRAMES = 0.25
LEAST_COLOURED = 0.6
IMPOSSIBLE_COLOURED = 0.05
# Dark to the eye, and nothing at all.
DARK, FLAT = 8.0, 1.5
# Faster than anybody walks, frame after frame.
MOST_SPEED_M_S = 4.0
_NEAR_IN_TIME_S = 1.0
_CENTRE_MARGIN = 0.2
_FOCAL_RANGE = (0.25, 4.0)
_MOST_ASPECT = 1.15


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
        *_of_intrinsics(sample, recording),
        *_of_depth(sample, median_m),
        *_of_colour(sample, surfaces),
        *_of_motion(recording, after),
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


def _remedy(
    recording: Recording, sample: Sample, found: Agreement, median_m: float, bad: int, others: float
) -> str:
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


def _of_intrinsics(sample: Sample, recording: Recording) -> Iterator[Finding]:
    rig = recording.rig
    for what, camera in (("colour", rig.rgb), ("depth", rig.depth)):
        if what == "depth" and rig.registered:
            continue
        where = f"of the {what} camera" if not rig.registered else "of the cameras"
        yield from _of_camera(camera, where)


def _of_camera(camera: Pinhole, where: str) -> Iterator[Finding]:
    size = f"{camera.width}x{camera.height}"
    off = (abs(camera.cx / camera.width - 0.5), abs(camera.cy / camera.height - 0.5))
    fit = f"give those of a {size} picture with --intrinsics fx,fy,cx,cy, or of another size as fx,fy,cx,cy@WxH."
    if max(off) > 0.5 - _CENTRE_MARGIN:
        grade = Grade.IMPOSSIBLE if max(off) > 0.5 else Grade.SUSPICIOUS
        middle = "outside" if max(off) > 0.5 else "near the edge of"
        sentence = f"The principal point {where} ({camera.cx:.6g}, {camera.cy:.6g}) lies {middle} the {size} picture."
        looks = ""
        if max(off) > 0.5 and min(camera.cx, camera.cy) > 0.0:
            looks = f"They look like those of a {2 * camera.cx:.0f}x{2 * camera.cy:.0f} picture: "
        yield Finding(Reason.INTRINSICS, grade, sentence, f"{looks}{fit if looks else fit.capitalize()}")
    wide = camera.fx / camera.width
    if not _FOCAL_RANGE[0] <= wide <= _FOCAL_RANGE[1]:
        sentence = (
            f"The focal length {where} ({camera.fx:.4g} pixels) gives the {size} picture a view of "
            f"{2 * np.degrees(np.arctan(0.5 / wide)):.0f} degrees, which no usual depth camera has."
        )
        yield Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, f"Check the intrinsics: {fit}")
    aspect = max(camera.fx / camera.fy, camera.fy / camera.fx)
    if aspect > _MOST_ASPECT:
        sentence = f"The focal lengths {where} differ by {aspect:.2f} times (fx {camera.fx:.4g}, fy {camera.fy:.4g})."
        yield Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, f"Pixels are square in usual cameras; {fit}")


def _of_depth(sample: Sample, median_m: float) -> Iterator[Finding]:
    there = sample.depth_m > 0.0
    share = there.mean(axis=(1, 2))
    empty = float((share == 0.0).mean())
    if empty == 1.0:
        yield Finding(
            Reason.DEPTH, Grade.SUSPICIOUS, f"None of the {len(sample)} frames that were looked at has any depth.",
            "A map needs depth; check the depth pictures and their unit (--depth-unit).",
        )  # fmt: skip
        return
    if empty > MOST_EMPTY_FRAMES:
        sentence = f"{empty:.0%} of the {len(sample)} frames that were looked at have no depth at all."
        yield Finding(Reason.DEPTH, Grade.SUSPICIOUS, sentence, "Check the depth pictures; the map lacks these frames.")
    elif float(np.median(share)) < LEAST_DEPTH_SHARE:
        sentence = f"Only {np.median(share):.1%} of the pixels of a frame have a depth (the middle of {len(sample)})."
        yield Finding(Reason.DEPTH, Grade.SUSPICIOUS, sentence, "Check the depth pictures and their unit (--depth-unit).")
    low, high = SUSPICIOUS_DEPTH_M
    if not low <= median_m <= high:
        sure = not IMPOSSIBLE_DEPTH_M[0] <= median_m <= IMPOSSIBLE_DEPTH_M[1]
        grade = Grade.IMPOSSIBLE if sure else Grade.SUSPICIOUS
        sentence = f"The depth is {median_m:.3g} m in the middle, where rooms have {low:g} to {high:g} m."
        remedy = "Check its unit: --depth-unit METRES says what one stored unit is (0.001: millimetres)."
        yield Finding(Reason.DEPTH, grade, sentence, remedy)
    yield from _of_flat_depth(sample, there)


def _of_flat_depth(sample: Sample, there: np.ndarray) -> Iterator[Finding]:
    """Find depth that is one number: a constant, or the same picture in every frame although the camera moves."""
    if len(sample) < 3:
        return
    spread = [float(np.ptp(d[t])) / float(d[t].mean()) for d, t in zip(sample.depth_m, there, strict=True) if t.any()]
    if len(spread) >= 3 and float(np.median(spread)) < 0.01:
        sentence = "The depth pictures are flat: every pixel has the same depth."
        yield Finding(Reason.DEPTH, Grade.IMPOSSIBLE, sentence, "Check how they were written.")
    moved = np.array([steps_between_all(sample.world_from_camera[pair])[0] for pair in sample.pairs])
    same = np.array([np.array_equal(sample.depth_m[a], sample.depth_m[b]) and there[a].any() for a, b in sample.pairs])
    if len(moved) and (moved > 0.3).sum() >= 3:
        share = float(same[moved > 0.3].mean())
        if share > MOST_BAD_PAIRS:
            sentence = f"In {share:.0%} of the pairs of frames the depth picture is the same although the camera moved."
            remedy = "The camera or its driver may have hung; record again, or leave these frames out."
            yield Finding(Reason.DEPTH, Grade.SUSPICIOUS, sentence, remedy)


def _of_colour(sample: Sample, surfaces: Surfaces) -> Iterator[Finding]:
    spread = sample.grey.std(axis=(1, 2))
    level = float(np.median(sample.grey))
    flat = float((spread < FLAT).mean())
    if flat > 0.5:
        shade = "black" if level < DARK else "of one colour"
        sentence = f"{flat:.0%} of the {len(sample)} colour pictures that were looked at are {shade}."
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, "Nothing can be recognised in them; check the camera.")
    elif level < DARK:
        sentence = f"The colour pictures are dark: the middle brightness is {level:.0f} of 255."
        remedy = "Little is recognised in the dark; record with more light or a longer exposure."
        yield Finding(Reason.COLOUR, Grade.SUSPICIOUS, sentence, remedy)
    rig = sample.rig
    if rig.registered or not surfaces.there.any():
        return
    frame, at = np.nonzero(surfaces.there)
    row, column = surfaces.row[frame, at], surfaces.column[frame, at]
    z = sample.depth_m[frame, row, column].astype(np.float64)
    points = np.stack([(column + 0.5 - rig.depth.cx) / rig.depth.fx * z, (row + 0.5 - rig.depth.cy) / rig.depth.fy * z, z], 1)
    seen = points @ rig.rgb_from_depth[:3, :3].T + rig.rgb_from_depth[:3, 3]
    ahead = seen[:, 2] > 0.01
    at_px = rig.rgb.project(np.where(ahead[:, None], seen, 1.0))
    inside = ahead & ((at_px >= 0.0) & (at_px < (rig.rgb.width, rig.rgb.height))).all(axis=1)
    share = float(inside.mean())
    if share < LEAST_COLOURED:
        grade = Grade.IMPOSSIBLE if share < IMPOSSIBLE_COLOURED else Grade.SUSPICIOUS
        sentence = f"The colour camera sees {share:.0%} of what the depth camera sees; the rest has no colour."
        remedy = "Check the intrinsics of both cameras and the transform between them (rgb_from_depth)."
        yield Finding(Reason.INTRINSICS, grade, sentence, remedy)


def _of_motion(recording: Recording, found: Agreement) -> Iterator[Finding]:
    if len(recording) < 5:
        return
    apart_s = np.diff(recording.stamps_s)
    moved_m = np.linalg.norm(np.diff(recording.world_from_camera[:, :3, 3], axis=0), axis=1)
    pace_s, speed = float(np.median(apart_s)), float(np.quantile(moved_m / apart_s, 0.75))
    if speed > MOST_SPEED_M_S:
        sentence = f"The camera moves at {speed:.3g} m/s in a quarter of the steps or faster, more than anybody walks."
        remedy = "Check that positions are in metres and stamps in seconds."
        yield Finding(Reason.MOTION, Grade.SUSPICIOUS, sentence, remedy)
    elif len(recording) >= 20 and pace_s < _NEAR_IN_TIME_S and not _can_be_judged(found) and found.outside > 0.0:
        sentence = (
            f"Hardly any two frames see the same place ({found.outside:.0%} of the points of one lie outside of the "
            f"other's view), although they are {pace_s:.2g} s apart."
        )
        remedy = "Check the poses, the intrinsics and the depth unit."
        yield Finding(Reason.MOTION, Grade.SUSPICIOUS, sentence, remedy)
