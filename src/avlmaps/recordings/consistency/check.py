"""The check of a recording at the door of a build: what a stranger's recording really has wrong, in about a second.

Points of one frame must lie on the surface that another frame sees, and look alike there. Thresholds: right recordings
(rendered homes with people, noise and drift, a real Kinect walk) have at least 0.96 of the points on the surface and a
likeness of 0.87 at least; docs/recordings.md has the figures. `suspicions.py` looks further.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.wording import option
from avlmaps.recordings.channels import level_faults
from avlmaps.recordings.consistency import agreement, readings
from avlmaps.recordings.consistency.readings import LEAST_OFF, Trial, Trials, cause_of, find_cause, find_closer
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Recording


class Grade(StrEnum):
    """How a recording stands after the check."""

    FINE = "fine"
    UNCHECKED = "unchecked"
    SUSPICIOUS = "suspicious"
    IMPOSSIBLE = "impossible"


class Reason(StrEnum):
    """What can be wrong; the word lets a recording through that is refused because of it."""

    GEOMETRY = "geometry"
    COLOUR = "colour"
    DEPTH = "depth"
    INTRINSICS = "intrinsics"
    MOTION = "motion"
    UP = "up"
    MICROPHONES = "microphones"
    SOUND = "sound"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be: what, with numbers, and the likely cause with what to do."""

    reason: Reason
    grade: Grade
    sentence: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.sentence} {self.remedy}"


class Said(NamedTuple):
    """What a measure says: a sentence with numbers, what to do where that differs, and whether it cannot be right."""

    sentence: str
    remedy: str = ""
    sure: bool = False


class Suspicion(NamedTuple):
    """One row of what may be wrong: its word, what measures it, and the likely cause with what to do."""

    reason: Reason
    measure: Callable[[Any], Iterable[Said]]
    remedy: str = ""


def findings_of(rows: Iterable[Suspicion], evidence: Any) -> Iterator[Finding]:
    """Yield what the rows find in the evidence, in their order."""
    for reason, measure, remedy in rows:
        for said in measure(evidence):
            grade = Grade.IMPOSSIBLE if said.sure else Grade.SUSPICIOUS
            yield Finding(reason, grade, said.sentence, said.remedy or remedy)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The outcome of the check of some frames, of which some pairs see the same place and some could not be read.

    Attributes:
        agreeing: share of points of the one frame on the surface that the other sees; NaN without pairs.
        seen_through: share of points that the other frame looks through; NaN without pairs.
        likeness: correlation of the brightness of the same points; NaN where nothing varies.
        median_depth_m: of the pixels with a depth; NaN without any.
        findings: what is wrong, the gravest first.
        unchecked: what could be wrong without showing, and why, one sentence each, where there are no findings.
    """

    frames: int
    pairs: int
    agreeing: float
    seen_through: float
    likeness: float
    median_depth_m: float
    findings: tuple[Finding, ...] = ()
    unread: int = 0
    unchecked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        gravest_first = sorted(self.findings, key=lambda finding: finding.grade is not Grade.IMPOSSIBLE)
        object.__setattr__(self, "findings", tuple(gravest_first))

    @property
    def grade(self) -> Grade:
        """The gravest grade of the findings; without any, whether frames could be compared at all."""
        if self.findings:
            return self.findings[0].grade
        return Grade.UNCHECKED if np.isnan(self.agreeing) else Grade.FINE

    def sentences(self) -> tuple[str, ...]:
        return tuple(map(str, self.findings))

    def refused(self, allowed: tuple[str, ...]) -> Finding | None:
        """Return the first finding that forbids a map, None where there is none or its reason is allowed."""
        grave = (finding for finding in self.findings if finding.grade == Grade.IMPOSSIBLE)
        return next((finding for finding in grave if finding.reason not in allowed), None)


# A camera in a building sees this far, in the middle.
SUSPICIOUS_DEPTH_M, _IMPOSSIBLE_DEPTH_M = (0.3, 9.0), (0.04, 60.0)
_LEAST_DEPTH_SHARE, _MOST_EMPTY_FRAMES = 0.05, 0.25
# Share of pixels whose neighbours lie on one surface with them: less, or hardly any, is noise. In a coarser picture
# than this the pixels around one look at other surfaces, which differ as noise does.
_LEAST_SMOOTH, _IMPOSSIBLE_SMOOTH, _FEWEST_COLUMNS = 0.3, 0.1, 64
_LEAST_COLOURED, _IMPOSSIBLE_COLOURED = 0.6, 0.05
# Of a camera that sees nothing; dark to the eye, of 255; nothing at all. More black frames are no camera that begins.
_BLACK, _DARK, _UNVARIED, _MOST_BLACK = 8.0, 20.0, 1.5, 0.1
# Faster than anybody walks, frame after frame; beyond that pace by as much, one step alone is a jump.
MOST_SPEED_M_S, _LEAST_JUMP_M = 4.0, 0.5
_NEAR_IN_TIME_S = 1.0
# With poses of fewer frames, or on several clocks, much of the drive is not in the map.
_LEAST_POSED = 0.75
_CENTRE_MARGIN, _FOCAL_RANGE, _MOST_ASPECT, _AS_IF_EXCHANGED = 0.2, (0.25, 4.0), 1.15, 0.04
_WORTH_A_TRIAL = 0.75  # of the least differences that another reading explains: those of all points are smaller
_STANDS = 0.01  # steps between poses that are one


@dataclass(eq=False)
class Evidence:
    """What the check looks at: a sample, its surfaces, and how pairs agree that follow or look from apart."""

    recording: Recording
    sample: agreement.Sample
    surfaces: agreement.Surfaces
    after: agreement.Agreement
    apart: agreement.Agreement

    @classmethod
    def of(cls, recording: Recording) -> Self:
        """Draw a sample and compare its pairs; RecordingError where none of its frames can be read."""
        if len(recording) == 0:
            raise RecordingError(f"{recording.path} has no frames with a pose; there is nothing to check.")
        sample = agreement.draw_pairs(recording, *agreement.choose_pairs(recording.world_from_camera))
        surfaces = agreement.Surfaces.of(sample.depth_m)
        following, distant = sample.only(sample.follows), sample.only(~sample.follows)
        after = agreement.compare(following, surfaces, sample.world_from_camera)
        apart = agreement.compare(distant, surfaces, sample.world_from_camera, floor_m=agreement.APART_SAME_M)
        after, apart = (
            agreement.without_occluded(after, following, surfaces),
            agreement.without_occluded(apart, distant, surfaces),
        )
        return cls(recording, sample, surfaces, after, apart)

    @cached_property
    def median_m(self) -> float:
        known = self.sample.depth_m[self.sample.depth_m > 0.0]
        return float(np.median(known)) if known.size else float("nan")

    @property
    def judged(self) -> bool:
        return agreement.can_be_judged(self.after)

    @property
    def contradicts(self) -> bool:
        """Whether points of frames that follow one another do not lie on one surface."""
        return self.judged and not agreement.geometry_agrees(self.after)

    @property
    def drifts(self) -> bool:
        """Whether only those of frames from apart do not."""
        return not self.contradicts and not agreement.apart_agrees(self.apart)

    @property
    def unlike(self) -> agreement.Agreement | None:
        """The pairs whose points lie on one surface and do not look alike, None where they do."""
        return None if self.contradicts or self.drifts else _unlike(self.after, self.apart)

    @cached_property
    def trials(self) -> Trials:
        return Trials(self.recording, self.sample)

    @cached_property
    def cause(self) -> Trial | None:
        """The reading with which frames agree that do not, None where no usual mistake explains them."""
        return find_cause(self.trials, self._explains)

    @property
    def explanation(self) -> str:
        best = self.cause
        if best is None:
            return ""
        return cause_of(best.reading, self.recording, self.median_m, self._gain(best))

    def _explains(self, trial: Trial) -> bool:
        after, apart = trial.after, trial.apart
        if (
            not agreement.can_be_judged(after)
            or not agreement.geometry_agrees(after)
            or not agreement.apart_agrees(apart)
        ):
            return False
        if _unlike(after, apart) is not None or trial.score < agreement.LEAST_AGREEING * 0.9:
            return False
        if not agreement.geometry_agrees(self.after):
            return after.same_share > self.after.same_share + 0.5 * (1.0 - self.after.same_share)
        if not agreement.apart_agrees(self.apart):
            return agreement.can_be_judged(apart) and apart.same_share > 0.5 * (1.0 + self.apart.same_share)
        return True

    def _gain(self, best: Trial) -> str:
        if (unlike := self.unlike) is None:
            before, after = (self.after, best.after) if self.contradicts else (self.apart, best.apart)
            return (
                f"(seen through {before.through_share:.1%} -> {after.through_share:.1%}, agreeing "
                f"{before.same_share:.0%} -> {after.same_share:.0%})"
            )
        then = best.after if unlike is self.after else best.apart
        return f"(correlation {unlike.likeness:.2f} -> {then.likeness:.2f})"


def _unlike(after: agreement.Agreement, apart: agreement.Agreement) -> agreement.Agreement | None:
    return next((one for one in (after, apart) if agreement.can_be_judged(one) and agreement.unlike(one)), None)


def check_recording(recording: Recording) -> Verdict:
    """Check a recording against itself, as a build does."""
    return door_verdict(Evidence.of(recording))


def door_verdict(evidence: Evidence) -> Verdict:
    """Return what the rows of the door find."""
    return Verdict(
        frames=len(evidence.sample),
        pairs=evidence.after.pairs,
        agreeing=evidence.after.same_share if evidence.judged else float("nan"),
        seen_through=evidence.after.through_share if evidence.judged else float("nan"),
        likeness=evidence.after.likeness,
        median_depth_m=evidence.median_m,
        findings=tuple(findings_of(_DOOR, evidence)),
        unread=evidence.sample.unread,
    )


# Cameras


def _cameras(evidence: Evidence) -> Iterator[tuple[Pinhole, str, str, str]]:
    rig = evidence.recording.rig
    for what, camera in (("colour", rig.rgb), ("depth", rig.depth))[: 1 if rig.registered else 2]:
        size, given = f"{camera.width}x{camera.height}", option("intrinsics", "fx,fy,cx,cy")
        fit = f"Give those of a {size} picture with {given}, or of another size as fx,fy,cx,cy@WxH."
        fit = f"Give the camera of a {size} picture." if is_of_program(evidence.recording) else fit
        yield camera, "of the cameras" if rig.registered else f"of the {what} camera", size, fit


def _middle(evidence: Evidence) -> Iterator[Said]:
    for camera, which, size, fit in _cameras(evidence):
        (w, h), (cx, cy) = (camera.width, camera.height), (camera.cx, camera.cy)
        off, middle = max(abs(cx / w - 0.5), abs(cy / h - 0.5)), f"The principal point {which} ({cx:.6g}, {cy:.6g})"
        if off > 0.5:
            like = f"They look like those of a {2 * cx:.0f}x{2 * cy:.0f} picture. " if min(cx, cy) > 0.0 else ""
            yield Said(f"{middle} lies outside the {size} picture.", like + fit, sure=True)
        elif off > 0.5 - _CENTRE_MARGIN:
            yield Said(f"{middle} lies near the edge of the {size} picture.", fit)
        if abs(w - h) > 0.1 * w and max(abs(cx - h / 2), abs(cy - w / 2)) < _AS_IF_EXCHANGED * w:
            remedy = f"cx and cy look exchanged, or the picture was turned. {fit}"
            yield Said(f"{middle} is the middle of a {h}x{w} picture.", remedy)


def _focal(evidence: Evidence) -> Iterator[Said]:
    for camera, which, size, fit in _cameras(evidence):
        if not _FOCAL_RANGE[0] <= (wide := camera.fx / camera.width) <= _FOCAL_RANGE[1]:
            view = f"a view of {2 * np.degrees(np.arctan(0.5 / wide)):.0f} degrees, which no usual depth camera has"
            yield Said(f"The focal length {which} ({camera.fx:.4g} pixels) gives the {size} picture {view}.", fit)
        if (aspect := max(camera.fx / camera.fy, camera.fy / camera.fx)) > _MOST_ASPECT:
            numbers = f"{aspect:.2f} times (fx {camera.fx:.4g}, fy {camera.fy:.4g})"
            remedy = f"Pixels are square in usual cameras. {fit}"
            yield Said(f"The focal lengths {which} differ by {numbers}.", remedy)


def _without_colour(evidence: Evidence) -> Iterator[Said]:
    rig, there = evidence.sample.rig, evidence.surfaces.there
    if rig.registered or not there.any():
        return
    frame, at = np.nonzero(there)
    row, column = evidence.surfaces.row[frame, at], evidence.surfaces.column[frame, at]
    z = evidence.sample.depth_m[frame, row, column].astype(np.float64)
    share = float(agreement.in_colour(rig, rig.depth.rays()[row, column] * z[:, None])[2].mean())
    if share < _LEAST_COLOURED:
        sentence = f"The colour camera sees {share:.0%} of what the depth camera sees; the rest has no colour."
        yield Said(sentence, sure=share < _IMPOSSIBLE_COLOURED)


# Depth and colour


def _depth(evidence: Evidence) -> Iterator[Said]:
    share = (evidence.sample.depth_m > 0.0).mean(axis=(1, 2))
    empty, count = float((share == 0.0).mean()), len(evidence.sample)
    if empty > _MOST_EMPTY_FRAMES:
        yield Said(f"{empty:.0%} of the {count} frames that were looked at have no depth at all.")
    elif float(np.median(share)) < _LEAST_DEPTH_SHARE:
        yield Said(f"Only {np.median(share):.1%} of the pixels of a frame have a depth (the middle of {count}).")
    (low, high), median_m, smooth = SUSPICIOUS_DEPTH_M, evidence.median_m, evidence.surfaces.smooth_share
    if np.isfinite(median_m) and not low <= median_m <= high:
        unit = f"{option('depth-unit', 'METRES')} says what one stored unit is (0.001: millimetres)"
        remedy = f"Check its unit: {'depth_m is in metres' if is_of_program(evidence.recording) else unit}."
        sure = not _IMPOSSIBLE_DEPTH_M[0] <= median_m <= _IMPOSSIBLE_DEPTH_M[1]
        yield Said(f"The depth is {median_m:.3g} m in the middle; rooms have {low:g} to {high:g} m.", remedy, sure)
    if smooth < _LEAST_SMOOTH and evidence.sample.depth_m.shape[2] >= _FEWEST_COLUMNS:
        on_surface = f"{smooth:.0%} of the pixels lie on a surface with those around"
        yield Said(f"The depth pictures look like noise: {on_surface}.", sure=smooth < _IMPOSSIBLE_SMOOTH)
    known = [depth_m[depth_m > 0.0] for depth_m in evidence.sample.depth_m if depth_m.any()]
    if len(known) >= 3 and float(np.median([np.ptp(depth_m) / depth_m.mean() for depth_m in known])) < 0.01:
        yield Said("The depth pictures are flat: every pixel has the same depth.", sure=True)


def _dark(evidence: Evidence) -> Iterator[Said]:
    grey, count = evidence.sample.grey, len(evidence.sample)
    flat = grey.std(axis=(1, 2)) < _UNVARIED
    black = np.flatnonzero(flat & (grey.mean(axis=(1, 2)) < _BLACK))
    level, of_them = float(np.median(grey)), f"of the {count} colour pictures that were looked at are"
    if flat.mean() > 0.5:
        yield Said(f"{flat.mean():.0%} {of_them} {'black' if level < _BLACK else 'of one colour'}.")
    elif len(black) > _MOST_BLACK * count:
        from_s, to_s = evidence.sample.stamps_s[black[[0, -1]]]
        yield Said(f"{len(black) / count:.0%} {of_them} black, from {from_s:.2f} to {to_s:.2f} s.")
    elif level < _DARK:
        yield Said(f"The colour pictures are dark: the middle brightness is {level:.0f} of 255.")


# Poses, clocks, sound


def _few_posed(evidence: Evidence) -> Iterator[Said]:
    if (posed := evidence.recording.posed) < _LEAST_POSED:
        yield Said(f"Only {posed:.0%} of the frames have a pose on one clock; the others are left out.")


def _pace(evidence: Evidence) -> Iterator[Said]:
    recording, outside = evidence.recording, evidence.after.outside
    if len(recording) < 5:
        return
    apart_s = np.diff(recording.stamps_s)
    moved_m = np.linalg.norm(np.diff(recording.world_from_camera[:, :3, 3], axis=0), axis=1)
    pace_s, speed = float(np.median(apart_s)), float(np.quantile(moved_m / apart_s, 0.75))
    far = np.flatnonzero(moved_m > _LEAST_JUMP_M + MOST_SPEED_M_S * apart_s)
    if speed > MOST_SPEED_M_S:
        sentence = f"The camera moves at {speed:.3g} m/s in a quarter of the steps or faster, more than anybody walks."
        yield Said(sentence, "Check that positions are in metres and stamps in seconds.")
    elif len(far):
        at = int(far[np.argmax(moved_m[far])])
        where = f"between {recording.name(at)} and {recording.name(at + 1)}, faster than anybody walks"
        where += f", and at {len(far) - 1} other places" if len(far) > 1 else ""
        remedy = "If tracking began again there, the map shows the place twice: cut the recording, or fix the poses."
        yield Said(f"The poses jump by {moved_m[at]:.3g} m within {apart_s[at]:.2g} s {where}.", remedy)
    elif len(recording) >= 20 and pace_s < _NEAR_IN_TIME_S and not evidence.judged and outside > 0.0:
        yield Said(
            f"Hardly any two frames see the same place ({outside:.0%} of the points of one lie outside of the other's "
            f"view), although they are {pace_s:.2g} s apart."
        )


def _levels(evidence: Evidence) -> Iterator[Said]:
    track, check = evidence.recording.audio, "Check the microphone, and which input was recorded: nothing that sounded"
    if track is None or track.microphones is not None:  # channels of an array are looked at elsewhere
        return
    with suppress(AudioError):  # hearing says why
        silent, clipped = level_faults(track)
        yield from (Said(one, f"{check} then is in the map.") for one in silent)
        yield from (Said(one, "What is loud may be taken for another sound.") for one in clipped)


# Frames against frames


def _contradiction(evidence: Evidence) -> Iterator[Said]:
    after = evidence.after
    if evidence.contradicts:
        sentence = (
            f"Frames that should see the same place do not agree: of the points of one frame {after.same_share:.0%} "
            f"lie on the surface that another sees, and {after.through_share:.1%} are seen through ({after.pairs} "
            "pairs of frames)."
        )
        is_mirrored = evidence.cause is not None and readings.is_left_handed(evidence.cause.reading)
        sure = is_mirrored or after.same_share < agreement.IMPOSSIBLE_AGREEING
        yield Said(sentence, evidence.explanation or _other_cause(evidence), sure)


def _other_cause(evidence: Evidence) -> str:
    after, recording = evidence.after, evidence.recording
    if float(agreement.steps_between_all(evidence.sample.world_from_camera).max(initial=0.0)) < _STANDS:
        return "All poses are the same, though the pictures are not: the poses are missing, or those of another camera."
    share = np.where(after.points >= agreement.FEWEST_POINTS, after.same / np.maximum(after.points, 1), np.nan)
    bad, others = agreement.bad_pairs(after), share[share >= agreement.BAD_PAIR]
    if 0 < bad <= 0.4 * after.pairs and len(others) and float(np.median(others)) > agreement.LEAST_AGREEING:
        pair = evidence.sample.only(evidence.sample.follows).pairs[int(np.nanargmin(share))]
        a, b = (recording.name(int(evidence.sample.index[i])) for i in pair)
        return (
            f"{bad} of the pairs are far off, the others are right: the poses jump, or frames are exchanged, for "
            f"example between {a} and {b}. Cut the recording there, or fix the order or the poses."
        )
    return ""


def _drift(evidence: Evidence) -> Iterator[Said]:
    if evidence.drifts:
        apart = evidence.apart
        yield Said(
            f"Frames that look at the same place from apart do not agree: {apart.same_share:.0%} of their points lie "
            f"on one surface, and {apart.through_share:.1%} are seen through ({apart.pairs} pairs of frames).",
            evidence.explanation,
        )


def _closer(evidence: Evidence) -> Iterator[Said]:
    offs = np.concatenate([evidence.after.off, evidence.apart.off])
    if (
        not evidence.judged
        or evidence.contradicts
        or evidence.drifts
        or not np.nanmean(offs) > _WORTH_A_TRIAL * LEAST_OFF
    ):
        return
    if (best := find_closer(evidence.trials)) is not None:
        yield Said(
            f"The depths of the same points in two frames differ by {np.nanmean(offs):.1%}, and by "
            f"{np.nanmean(best.offs):.1%} if the recording is read in another way.",
            cause_of(best.reading, evidence.recording, evidence.median_m),
        )


def _unlike_colour(evidence: Evidence) -> Iterator[Said]:
    if (found := evidence.unlike) is not None:
        bad, pairs = int((found.alike < agreement.BAD_LIKENESS).sum()), int(np.isfinite(found.alike).sum())
        apart, right = (" from apart", "0.85") if found is evidence.apart else ("", "0.9")
        sentence = (
            "The colour pictures do not show what the depth pictures show: the brightness of the same points in two "
            f"frames{apart} correlates by {found.likeness:.2f} where right recordings have {right} and more, and "
            f"hardly at all in {bad} of {pairs} pairs."
        )
        yield Said(sentence, evidence.explanation, evidence.after.likeness < agreement.IMPOSSIBLE_LIKENESS)


_DOOR = (
    Suspicion(Reason.INTRINSICS, _middle),
    Suspicion(Reason.INTRINSICS, _focal),
    Suspicion(Reason.INTRINSICS, _without_colour,
        "Check the intrinsics of both cameras and the transform between them (rgb_from_depth)."),
    Suspicion(Reason.DEPTH, _depth,
        "A map needs depth; check how the depth pictures are stored (16 bits, their unit, order of bytes, no colours, "
        "no lossy compression)."),
    Suspicion(Reason.COLOUR, _dark,
        "Little or nothing is recognised in such pictures; check the camera and its exposure, or leave them out."),
    Suspicion(Reason.MOTION, _few_posed,
        "What they show is not in the map: check that pictures and poses are of one drive and one clock."),
    Suspicion(Reason.MOTION, _pace, "Check the poses, the intrinsics and the depth unit."),
    Suspicion(Reason.SOUND, _levels),
    Suspicion(Reason.GEOMETRY, _contradiction,
        "No usual mistake explains it; check the poses, the depth and the intrinsics, and that they belong together."),
    Suspicion(Reason.GEOMETRY, _drift,
        "The poses drift, depth and positions have different scales, or much was moved; check them."),
    Suspicion(Reason.GEOMETRY, _closer),
    Suspicion(Reason.COLOUR, _unlike_colour,
        "Check that colour and depth of a frame belong together (order of names, clock, intrinsics of colour)."),
)  # fmt: skip
