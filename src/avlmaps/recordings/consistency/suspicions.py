"""What is suspected more rarely, row by row, and what would not show: `avlmaps info` looks for it, a build does not."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from jaxtyping import Float

from avlmaps.recordings.consistency import agreement, check
from avlmaps.recordings.consistency.check import Evidence, Reason, Said, Suspicion
from avlmaps.recordings.consistency.readings import Reading, is_closer
from avlmaps.recordings.corrections import Corrections
from avlmaps.recordings.types import Recording

# Share of the depths that are exactly the largest one, in the middle of the frames: those of a wall differ.
_MOST_CUT_OFF, _FARTHEST_FUSED_M = 0.05, 10.0
# Depth that begins again at 0 beyond its largest number: beside nearly that lies less than any camera measures, in so
# many pixels of a frame, in a quarter of the frames.
_NEARLY_MOST, _MEASURED_BY_NONE_M, _FEWEST_WRAPPED, _WRAPPED_FRAMES = 0.92, 0.1, 5, 0.25
# Share of pairs with one picture although the camera moved; of steps without one although the pictures changed.
_MOST_FROZEN, _MOVED_STEPS, _CHANGED = 0.08, 0.3, 12.0
# Of right frames: the means of 3 that follow one another in NYU Depth V2 are over -0.05 (265 of 265) and over 0.12
# (255); those of the kitchen over 0.13, of 6 drawn rooms over 0.4, of 12 rendered homes over 0.08.
_LEAST_WARMTH, _FEWEST_FOR_WARMTH, _COLOURED = 0.12, 3, 0.15
_DRAWN = 0.93  # right recordings: 0.78 in the middle of their frames at most
# Pairs that are looked at more closely, since the poses may jump between them. Across an odd step fewer points than
# this agree; elsewhere fewer than that, and their depths differ this many times as much as beside.
_MOST_JUMPS, _ACROSS_STEP, _MISFIT, _MISFIT_RATIO = 3, 0.9, 0.7, 3.0


def examine_recording(recording: Recording) -> check.Verdict:
    """Check a recording against itself with every row, and say what would not show."""
    evidence = Evidence.of(recording)
    verdict = check.door_verdict(evidence)
    findings = [*verdict.findings, *check.findings_of(_SINGLE, evidence)]
    disagrees = evidence.contradicts or evidence.drifts or evidence.unlike is not None
    if not disagrees or evidence.cause is None:
        in_space = evidence.contradicts or evidence.drifts
        pairs = check.findings_of((_JUMP,) if in_space else (_JUMP, *_COLOUR), evidence)
        findings += islice(pairs, 1)  # one cause has several symptoms
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


def _wrapped(evidence: Evidence) -> Iterator[Said]:
    near_m, most_m = evidence.surfaces.near_m, float(evidence.sample.depth_m.max())
    wrapped = (near_m > 0.0) & (near_m < _MEASURED_BY_NONE_M) & (evidence.surfaces.far_m > _NEARLY_MOST * most_m)
    share = float((wrapped.sum(axis=(1, 2)) >= _FEWEST_WRAPPED).mean())
    if share > _WRAPPED_FRAMES:
        yield Said(
            f"In {share:.0%} of the {len(near_m)} frames that were looked at, depths of {most_m:.3g} m, the largest, "
            f"lie beside some below {_MEASURED_BY_NONE_M:g} m, which no camera measures."
        )


def _frozen(evidence: Evidence) -> Iterator[Said]:
    pose, pairs = evidence.sample.world_from_camera, evidence.sample.pairs
    moved = pairs[[agreement.steps_between_all(pose[pair])[0] > _MOVED_STEPS for pair in pairs]]
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
    """How much more of the pictures is redder than blue than bluer than red; 0 for too few frames."""
    hue = evidence.sample.hue
    return float((hue > _COLOURED).mean() - (hue < -_COLOURED).mean()) if len(hue) >= _FEWEST_FOR_WARMTH else 0.0


def _drawn(evidence: Evidence) -> Iterator[Said]:
    grey, depth_m = evidence.sample.grey, evidence.sample.depth_m
    if grey.shape != depth_m.shape:
        return
    known = [(one[z > 0.0], z[z > 0.0]) for one, z in zip(grey, depth_m, strict=True) if (z > 0.0).any()]
    alike = [abs(float(np.corrcoef(both)[0, 1])) for both in known if all(np.ptp(one) > 0.0 for one in both)]
    if len(alike) >= _FEWEST_FOR_WARMTH and float(np.median(alike)) > _DRAWN:
        yield Said(f"Colour is as bright as depth is far: they correlate by {np.median(alike):.2f} in a frame.")


def _blue(evidence: Evidence) -> Iterator[Said]:
    if (warmth := _warmth(evidence)) < -_LEAST_WARMTH:
        yield Said(
            f"Blue outweighs red: of the pixels {-warmth:.0%} more are bluer than red than redder than blue, in the "
            f"mean of {len(evidence.sample)} frames, where rooms have more that are redder."
        )


_SINGLE = (
    Suspicion(Reason.DEPTH, _cut_off,
        "They look cut off there, or none was measured: write 0 for these, or the map has a wall there."),
    Suspicion(Reason.DEPTH, _wrapped,
        "They look cut to too few bits, so that they begin again at 0: write them whole, or 0 where too far."),
    Suspicion(Reason.DEPTH, _frozen,
        "The camera or its driver may have hung; record again, or leave these frames out."),
    Suspicion(Reason.MOTION, _frozen_pose, "The poses froze there: check the odometry, or leave these frames out."),
    Suspicion(Reason.COLOUR, _drawn, "They look like drawings of the depth: give what the colour camera saw."),
    Suspicion(Reason.COLOUR, _blue,
        "Red and blue look exchanged in all colour pictures: write them as RGB, not BGR; or the light, the walls or "
        "the camera's white balance are blue."),
)  # fmt: skip


# Frames against frames


def _jump(evidence: Evidence) -> Iterator[Said]:
    """Find a pair that does not agree, where no pair across the place does, and those beside do."""
    recording, after, sample = evidence.recording, evidence.after, evidence.sample
    pairs, odd = sample.index[sample.only(sample.follows).pairs], agreement.odd_steps(recording)
    share = np.where(after.points >= 2 * agreement.FEWEST_POINTS, after.same / np.maximum(after.points, 1), 1.0)
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
        near = agreement.draw_pairs(recording, across, np.arange(len(across)) < 4)
        surfaces = agreement.Surfaces.of(near.depth_m)
        over, beside = (
            agreement.compare(near.only(kind), surfaces, near.world_from_camera, colour=False)
            for kind in (near.follows, ~near.follows)
        )
        few = over.pairs >= agreement.FEWEST_PAIRS and over.same_share < agreement.HARDLY_ANY
        seen = (agreement.can_be_judged(over) or few) and agreement.can_be_judged(beside)
        far_off = over.same_share < agreement.BAD_PAIR or over.median_off > _MISFIT_RATIO * beside.median_off
        better = beside.same_share > max(agreement.LEAST_AGREEING, over.same_share + 0.1)
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


# Colour against depth

# How red less blue of the same points correlates where one picture has both exchanged: in two pairs, or surely in one.
_OPPOSITE, _SURELY_OPPOSITE = -0.5, -0.8
# Most edges of depth are edges of colour as well: over many frames the gradient of colour is greatest where the depth
# camera, its lens and its clock put them. Of 32 right recordings (drawn, rendered, a Kinect) it is greatest within 2.3
# columns of none. Where one lies 8 beside the other, it is there at least 1.26 times what it is within 3 columns of
# none, and by 0.8 of its spread larger.
_EDGE, _NONE, _FARTHEST, _FEWEST_EDGES, _EDGES_BLUR = 0.1, 3, 20, 400, (0.0, 1.4, 1.4)
_LEAST_RATIO, _LEAST_GAIN, _LEAST_GRADIENT = 1.2, 0.7, 0.3


def _exchanged_channels(evidence: Evidence) -> Iterator[Said]:
    red = replace(evidence.sample, grey=255.0 * evidence.sample.hue)
    alike = agreement.compare(red, evidence.surfaces, red.world_from_camera).alike
    opposite = int((alike < _OPPOSITE).sum())
    if opposite > 1 or (alike < _SURELY_OPPOSITE).any():
        yield Said(
            f"Red and blue of the same points are exchanged in {opposite} of {int(np.isfinite(alike).sum())} pairs of "
            "frames: some colour pictures are RGB, others BGR."
        )


def _beside(evidence: Evidence) -> Iterator[Said]:
    from scipy.ndimage import gaussian_filter

    sample, surfaces, rig = evidence.sample, evidence.surfaces, evidence.sample.rig
    edge = (surfaces.near_m > 0.0) & (sample.depth_m > 0.0) & (surfaces.far_m > (1.0 + _EDGE) * sample.depth_m)
    (frame, row, column), z = np.nonzero(edge), sample.depth_m[edge].astype(np.float64)
    u, v, seen = agreement.in_colour(rig, rig.depth.rays()[row, column] * z[:, None])
    marks, (height, width) = np.zeros(sample.grey.shape), sample.grey.shape[1:]
    marks[frame[seen], v[seen], u[seen]] = 1.0
    across, along = (gaussian_filter(sample.grey, _EDGES_BLUR, order) for order in ((0, 0, 1), (0, 1, 0)))
    steep: Float[np.ndarray, "f h w"] = np.hypot(across, along)
    steep = np.minimum(steep / (np.quantile(steep, 0.9, axis=(1, 2), keepdims=True) + 4.0), 1.0)
    steep -= steep.mean(axis=(1, 2), keepdims=True)
    steep /= np.maximum(steep.std(axis=(1, 2), keepdims=True), 1e-6)
    double = (2 * max(height, _FARTHEST), 2 * max(width, _FARTHEST))  # nothing comes in again beyond an edge
    spectrum = (np.fft.rfft2(steep, double) * np.conj(np.fft.rfft2(marks, double))).sum(axis=0)
    shifts = np.arange(-_FARTHEST, _FARTHEST + 1)
    found = np.fft.irfft2(spectrum, double)[np.ix_(shifts, shifts)] / max(marks.sum(), 1.0)
    none = max(float(found[np.hypot(*np.meshgrid(shifts, shifts)) <= _NONE].max()), 0.0)
    most, (down, right) = float(found.max()), [int(shifts[at]) for at in divmod(int(found.argmax()), len(shifts))]
    least = max(_LEAST_RATIO * none, none + _LEAST_GAIN * float(found.std()), _LEAST_GRADIENT)
    if marks.sum() < _FEWEST_EDGES or most < least:
        return
    scale = evidence.recording.rig.rgb.width / width
    x_m, y_m = (by * float(np.median(z)) / rig.rgb.fx for by in (right, down))
    yield Said(
        f"The edges of colour do not lie on those of depth, but {right * scale:+.0f} pixels in x and "
        f"{down * scale:+.0f} in y (gradient of colour {most:.2f} there, {none:.2f} where depth has them, in standard "
        "deviations).",
        "Colour and depth look shifted against each other, or taken at different moments; check the order and the "
        "clock of the pictures, the principal points, and rgb_from_depth (of a camera that is elsewhere it is off by x "
        f"{x_m:+.2f}, y {y_m:+.2f} m).",
    )


_COLOUR = (
    Suspicion(Reason.COLOUR, _exchanged_channels, "Write all pictures in one order of channels."),
    Suspicion(Reason.COLOUR, _beside),
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
    "May be wrong and not show: the distortion of the lens, the order of the colour channels of single pictures, "
    "whether colour lies on depth, and whether poses before and after a long pause have one origin."
)


def blind_spots(evidence: Evidence) -> Iterator[str]:
    """Yield what cannot be checked in a recording of which nothing is wrong, and why, one sentence each."""
    if not evidence.judged:
        yield f"Poses, depth, colour, intrinsics and clocks cannot be checked here, because {_why(evidence)}."
        return

    def shows(reading: Reading) -> bool:
        wrong = evidence.trials.run(reading, colour=False)
        if not agreement.can_be_judged(wrong.after):
            return wrong.after.pairs > 0
        agrees = agreement.geometry_agrees(wrong.after) and agreement.apart_agrees(wrong.apart)
        return not agrees or is_closer(evidence.trials.as_it_is, wrong)

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
