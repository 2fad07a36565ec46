"""What is suspected more rarely, row by row, and what would not show: `avlmaps info` looks for it, a build does not."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.consistency import agreement as limits
from avlmaps.recordings.consistency.agreement import APART_SAME_M, FEWEST_POINTS, compare
from avlmaps.recordings.consistency.check import (
    LENS,
    Evidence,
    Reason,
    Said,
    Suspicion,
    Verdict,
    door_verdict,
    findings_of,
)
from avlmaps.recordings.consistency.flats import Levels
from avlmaps.recordings.consistency.readings import AS_IT_IS, Reading, is_closer
from avlmaps.recordings.consistency.sample import (
    WIDTH,
    Sample,
    Surfaces,
    draw_pairs,
    gaps,
    odd_steps,
    pairs_across,
    seams,
    steps_between_all,
)
from avlmaps.recordings.corrections import Corrections
from avlmaps.recordings.types import Recording

# Share of the depths that are exactly the largest one, in the middle of the frames: those of a wall differ.
_MOST_CUT_OFF, _FARTHEST_FUSED_M = 0.05, 10.0
# Depth that begins again at 0 beyond its largest number: of two neighbours one is nearly that far, and one nearer than
# any camera measures, at 5 places of a frame, in a quarter of the frames.
_NEARLY_MOST, _MEASURED_BY_NONE_M, _FEWEST_WRAPPED, _WRAPPED_FRAMES = 0.92, 0.1, 5, 0.25
# Share of pairs with one picture although the camera moved; of steps without one although the pictures changed.
_MOST_FROZEN, _MOVED_STEPS, _CHANGED = 0.08, 0.3, 12.0
# Of right frames: the means of 3 that follow one another in NYU Depth V2 are over -0.05 (265 of 265) and over 0.12
# (255); those of the kitchen over 0.13, of 6 drawn rooms over 0.4, of 12 rendered homes over 0.08.
_LEAST_WARMTH, _FEWEST_FOR_WARMTH = 0.12, 3
# Pairs that are looked at more closely, since the poses may jump between them. Across an odd step fewer points than
# this agree; elsewhere fewer than that, and their depths differ this many times as much as beside.
_MOST_JUMPS, _ACROSS_STEP, _MISFIT, _MISFIT_RATIO = 3, 0.9, 0.7, 3.0
# Points of frames before and after: the others look through none in 4 rendered homes and a real kitchen, each parted at
# three places, and through 0.08 where people walk, but then 0.85 lie on one surface; through 0.14 and more, and at most
# 0.35 lie on one, where the second part is 0.6 m off or has another origin.
_MOST_THROUGH_PARTS, _SAME_PARTS = 0.06, 0.7


@dataclass(eq=False)
class _Closer(Evidence):
    """Evidence with what the rows of this file alone measure, when it is asked for."""

    @cached_property
    def levels(self) -> Levels:
        return self.flats.levels()

    @cached_property
    def edges(self) -> "DepthEdges":
        return find_edges(self.sample)

    @property
    def warmth(self) -> float:
        """How much more of the pictures is redder than blue than the other way round; 0 for too few frames."""
        return float(self.sample.warmth.mean()) if len(self.sample) >= _FEWEST_FOR_WARMTH else 0.0


def examine_recording(recording: Recording) -> Verdict:
    """Check a recording against itself with every row, and say what would not show.

    Raises:
        RecordingError: there is no frame, or none of the sample can be read.
    """
    evidence = _Closer.of(recording)
    verdict = door_verdict(evidence)
    findings = [*verdict.findings, *findings_of(_SINGLE, evidence)]
    disagrees = evidence.contradicts or evidence.drifts or evidence.unlike is not None
    if not disagrees or evidence.cause is None:
        agrees_in_space = not evidence.contradicts and not evidence.drifts
        pairs = findings_of((*_GEOMETRY, *_COLOUR) if agrees_in_space else _GEOMETRY, evidence)
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
    depth_m, most_m = evidence.sample.depth_m, float(evidence.sample.depth_m.max())
    far, near = depth_m > _NEARLY_MOST * most_m, (depth_m > 0.0) & (depth_m < _MEASURED_BY_NONE_M)
    beside = np.zeros(len(depth_m), np.int64)
    for one, other in ((far, near), (near, far)):
        beside += (one[:, :, 1:] & other[:, :, :-1]).sum(axis=(1, 2)) + (one[:, 1:] & other[:, :-1]).sum(axis=(1, 2))
    share = float((beside >= _FEWEST_WRAPPED).mean())
    if share > _WRAPPED_FRAMES:
        yield Said(
            f"In {share:.0%} of the {len(depth_m)} frames that were looked at, depths of {most_m:.3g} m, the largest, "
            f"lie beside some below {_MEASURED_BY_NONE_M:g} m, which no camera measures."
        )


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


def _blue(evidence: _Closer) -> Iterator[Said]:
    if evidence.warmth < -_LEAST_WARMTH:
        yield Said(
            f"Blue outweighs red: of the pixels {-evidence.warmth:.0%} more are bluer than red than redder than blue, "
            f"in the mean of {len(evidence.sample)} frames, where rooms have more that are redder."
        )


_SINGLE = (
    Suspicion(
        Reason.DEPTH,
        _cut_off,
        "They look cut off there, or none was measured: write 0 for these, or the map has a wall there.",
    ),
    Suspicion(
        Reason.DEPTH,
        _wrapped,
        "They look cut to too few bits, so that they begin again at 0: write them whole, or 0 where too far.",
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


def _tilted(evidence: _Closer) -> Iterator[Said]:
    tilt, camera = evidence.levels.tilt, evidence.recording.rig.depth
    if not evidence.judged or tilt is None:
        return
    parts = (tilt.down_deg, "farther down", "farther up"), (tilt.right_deg, "lower on its right", "lower on its left")
    how = " and ".join(f"{abs(by):.0f} degrees {more if by > 0 else less}" for by, more, less in parts if abs(by) >= 1)
    cy_px = abs(np.tan(np.radians(tilt.down_deg))) * camera.fy
    middle = f", or cy, if it is {cy_px:.0f} pixels off in the {camera.width}x{camera.height} pictures"
    middle = middle if abs(tilt.down_deg) > abs(tilt.right_deg) else ""
    yield Said(
        f"Floors do not stay level while the camera turns: they lie {tilt.off_deg:.1f} degrees off (the middle of "
        f"{len(evidence.levels.up)} frames), and {tilt.left_deg:.1f} if the camera sits {how} than its poses say.",
        f"Correct the transform from what the poses are of to the camera{middle}.",
    )


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


def _parted(evidence: Evidence) -> Iterator[Said]:
    """Find where what came after a gap, a jump or the middle contradicts what came before, as a whole."""
    recording, worst = evidence.recording, (_MOST_THROUGH_PARTS, 0, 0)
    places = seams(recording) if gaps(recording) else [*seams(recording), len(recording) // 2 - 1]
    for at in places:
        pairs = pairs_across(recording.world_from_camera, at)
        if not len(pairs):
            continue
        both = draw_pairs(recording, np.concatenate([pairs, pairs[:, ::-1]]), np.ones(2 * len(pairs), bool))
        found = compare(both, Surfaces.of(both.depth_m), both.world_from_camera, floor_m=APART_SAME_M, colour=False)
        if limits.can_be_judged(found) and found.through_share > worst[0] and found.same_share < _SAME_PARTS:
            worst = found.through_share, at, found.pairs
    through, at, pairs = worst
    if pairs:
        apart_s, before = float(recording.stamps_s[at + 1] - recording.stamps_s[at]), recording.name(at)
        yield Said(
            f"What frames show before and after {before} does not agree: in {pairs} pairs that look at one place, "
            f"{through:.0%} of the points of the one are seen through by the other ({apart_s:.3g} s lie between "
            f"{before} and {recording.name(at + 1)})."
        )


_GEOMETRY = (
    LENS,
    Suspicion(Reason.GEOMETRY, _tilted),
    Suspicion(
        Reason.GEOMETRY,
        _jump,
        "The poses jump there, tracking began again, or frames are exchanged: cut the recording there, or fix them.",
    ),
    Suspicion(
        Reason.GEOMETRY,
        _parted,
        "They look like two recordings whose poses have different origins, or the poses drift: give both one origin, "
        "or build a map of each.",
    ),
)


# Colour against depth. Most edges of depth are edges of colour as well: over many frames the gradient of colour is
# largest where the depth camera, its lens and its clock put them.

# Shifts that are tried, in columns of a picture of `WIDTH`, and how near to none is none: a Kinect that is not
# registered has its edges 2 beside those of colour. Colour that is late while the camera turns lies up to half of the
# picture beside, hardly up or down; there more may look alike by chance.
_STEP, _MOST, _NONE = 2.0, 20.0, 3.0
_SHIFTS = np.arange(-_MOST, _MOST + 0.5 * _STEP, _STEP)
_FAR_COLUMNS, _FAR_ROWS = np.arange(-64.0, 65.0, _STEP), np.arange(-6.0, 7.0, 3.0)
_EDGE = 0.08  # a step of depth that is an edge, as a share of it
_FRAMES, _EDGES_EACH, _FEWEST_EACH, _FEWEST_FRAMES, _FEWEST_EDGES = 40, 200, 20, 5, 400
# Beyond none the gradient must be this many times that around none, by this share of its spread, and so large. Right
# recordings: up to 0.9 times, but for 1.2 times and 0.4 of the spread where a camera hardly moves (11 of a Kinect, 32
# times 25 frames of NYU, 18 drawn).
_LEAST_RATIO, _LEAST_GAIN, _LEAST_GRADIENT = 1.25, 0.7, 0.3
# Far shifts: colour 0.6 s late or early has 2.0 to 5.5 times the gradient around none, and 2.9 to 3.7 times the spread
# over the mean (7 of 8 walks that turn evenly); right recordings at most 1.6 times and 1.7 (one of 11 of a Kinect).
_LEAST_FAR_RATIO, _LEAST_FAR_SPREADS = 1.8, 2.5
_AROUND = np.hypot(_SHIFTS[None, :], _SHIFTS[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class DepthEdges:
    """The gradient of colour around edges of depth.

    Attributes:
        near: (k, k) its mean at each shift, rows by y; in standard deviations of a picture's gradient.
        far: (r, c) likewise at large shifts to the sides.
        enough: whether there are enough edges to judge by.
        depth_m: middle of their depths.
    """

    near: Float[np.ndarray, "k k"]
    far: Float[np.ndarray, "r c"]
    enough: bool
    depth_m: float

    @property
    def would_show(self) -> bool:
        """Whether colour that lies beside depth by a sixteenth would be noticed."""
        by = WIDTH / 16.0
        sides = [
            np.hypot(_SHIFTS[None, :] - x, _SHIFTS[:, None] - y) for x, y in ((by, 0), (-by, 0), (0, by), (0, -by))
        ]
        return self.enough and all(self._stands_out(side <= _NONE) for side in sides)

    def shift(self) -> tuple[float, float, float, float] | None:
        """Return columns, rows (of pictures of `WIDTH`) and gradient of where edges of colour lie, and that at none.

        None where they lie on those of depth, or nothing shows it.
        """
        if not self.enough:
            return None
        here, most, far = max(float(self.near[_AROUND <= _NONE].max()), 0.0), float(self.far.max()), self.far
        beyond = most - float(far.mean()) >= _LEAST_FAR_SPREADS * float(far.std())
        row, column = np.unravel_index(int(far.argmax()), far.shape)
        if beyond and most >= max(_LEAST_FAR_RATIO * here, _LEAST_GRADIENT) and abs(_FAR_COLUMNS[column]) > _MOST:
            return float(_FAR_COLUMNS[column]), float(_FAR_ROWS[row]), most, here
        if not self._stands_out(_AROUND <= _NONE):
            return None
        row, column = np.unravel_index(int(np.where(_AROUND <= _NONE, -np.inf, self.near).argmax()), self.near.shape)
        return float(_SHIFTS[column]), float(_SHIFTS[row]), float(self.near.max()), here

    def _stands_out(self, around: np.ndarray) -> bool:
        here, most = max(float(self.near[around].max()), 0.0), float(self.near.max())
        return most >= max(_LEAST_RATIO * here, here + _LEAST_GAIN * float(self.near.std()), _LEAST_GRADIENT)


def find_edges(sample: Sample) -> DepthEdges:
    """Measure the gradient of colour around the edges of depth."""
    import cv2

    rig, px = sample.rig, sample.rig.rgb.width / WIDTH
    rows = np.unique(np.linspace(0, len(sample) - 1, min(_FRAMES, len(sample))).round().astype(int))
    near, far, inside = np.zeros((len(_SHIFTS),) * 2), *np.zeros((2, len(_FAR_ROWS), len(_FAR_COLUMNS)))
    depths: list[np.ndarray] = []
    for row in rows:
        v, u = _edge_pixels(sample.depth_m[row])
        z = sample.depth_m[row][v, u].astype(np.float64)
        seen = (rig.depth.rays()[v, u] * z[:, None]) @ rig.rgb_from_depth[:3, :3].T + rig.rgb_from_depth[:3, 3]
        seen = seen[seen[:, 2] > 0.01]
        if len(seen) < _FEWEST_EACH:
            continue
        x, y = rig.rgb.project(seen).T
        gradient = cv2.GaussianBlur(_gradient(sample.grey[row]), (0, 0), 1.0)
        gradient = (gradient - gradient.mean()) / max(float(gradient.std()), 1e-6)
        near += _shifted(gradient, x, y, _SHIFTS * px, _SHIFTS * px)[0]
        one, counted = _shifted(gradient, x, y, _FAR_COLUMNS * px, _FAR_ROWS * px)
        far, inside = far + one, inside + counted
        depths.append(z)
    every = np.concatenate(depths) if depths else np.zeros(0)
    enough = len(depths) >= _FEWEST_FRAMES and len(every) >= _FEWEST_EDGES
    middle_m = float(np.median(every)) if len(every) else float("nan")
    return DepthEdges(near / max(len(every), 1), far / np.maximum(inside, 1), enough, middle_m)


def _shifted(
    gradient: Float[np.ndarray, "h w"], x: np.ndarray, y: np.ndarray, columns: np.ndarray, rows: np.ndarray
) -> tuple[Float[np.ndarray, "r c"], Float[np.ndarray, "r c"]]:
    height, width = gradient.shape
    u, v = np.floor(x[:, None] + columns).astype(int), np.floor(y[:, None] + rows).astype(int)
    inside = ((v >= 0) & (v < height))[:, :, None] & ((u >= 0) & (u < width))[:, None, :]
    found = gradient[np.clip(v, 0, height - 1)[:, :, None], np.clip(u, 0, width - 1)[:, None, :]]
    return np.where(inside, found, 0.0).sum(axis=0), inside.sum(axis=0).astype(np.float64)


def _edge_pixels(depth_m: Float[np.ndarray, "h w"]) -> tuple[np.ndarray, np.ndarray]:
    edge = np.zeros(depth_m.shape, bool)
    for axis in (0, 1):
        first, second = (np.moveaxis(depth_m, axis, 0)[part] for part in (slice(1, None), slice(None, -1)))
        nearer = np.minimum(first, second)
        step = (nearer > 0.0) & (np.abs(first - second) > _EDGE * nearer)
        turned = np.moveaxis(edge, axis, 0)
        turned[1:] |= step & (first < second)
        turned[:-1] |= step & (first >= second)
    v, u = np.nonzero(edge)
    chosen = np.unique(np.linspace(0, len(v) - 1, min(_EDGES_EACH, len(v))).round().astype(int))
    return v[chosen], u[chosen]


def _gradient(grey: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    import cv2

    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    steep = np.hypot(cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1))
    return np.minimum(steep / (np.quantile(steep, 0.9) + 8.0), 1.0).astype(np.float32)


def _exchanged_channels(evidence: _Closer) -> Iterator[Said]:
    sample = replace(evidence.sample, grey=evidence.sample.redness)
    alike = compare(sample, evidence.surfaces, sample.world_from_camera).alike
    if opposite := limits.opposite_pairs(alike):
        yield Said(
            f"Red and blue of the same points are exchanged in {opposite} of {int(np.isfinite(alike).sum())} pairs of "
            "frames: some colour pictures are RGB, others BGR."
        )


def _beside(evidence: _Closer) -> Iterator[Said]:
    if (found := evidence.edges.shift()) is None:
        return
    columns, rows, gradient, here = found
    camera = evidence.recording.rig.rgb
    parts = (columns, "to the right", "to the left"), (rows, "below", "above")
    px = camera.width / WIDTH
    where = " and ".join(f"{abs(by) * px:.0f} pixels {more if by > 0.0 else less}" for by, more, less in parts if by)
    x_m, y_m = (by * px * evidence.edges.depth_m / camera.fx for by in (columns, rows))
    yield Said(
        f"The edges of colour do not lie on those of depth, but {where} (gradient of colour {gradient:.2f} there, "
        f"{here:.2f} where depth has them, in standard deviations).",
        "Colour and depth look shifted against each other, or taken at different moments; check the order and the "
        "clock of the pictures, the principal points, and rgb_from_depth (of a camera that is elsewhere it is off by x "
        f"{x_m:+.2f}, y {y_m:+.2f} m).",
    )


_COLOUR = (
    Suspicion(Reason.COLOUR, _exchanged_channels, "Write all pictures in one order of channels."),
    Suspicion(Reason.COLOUR, _beside),
)


# What would not show. Mistakes that are made to see it: twice, half, a moment; smaller ones of the depth, which shows
# where the camera moves among what it sees.
_DELAY_S, _FARTHER_M, _SLIGHT, _FOCAL, _OFF_CENTRE = 0.3, 0.3, 1.15, 1.25, 0.08
_NO_OVERLAP = 0.9  # of its view: a step that turns the camera by more leaves nothing that both frames see
_MADE: tuple[tuple[tuple[Reading, ...], str], ...] = (
    (
        (Reading(scale=2.0), Reading(scale=0.5)),
        "The scale of positions against depth cannot be checked here, because the camera hardly moves between frames "
        "that see the same place: positions twice as far apart would not show.",
    ),
    (
        (Reading(scale=_SLIGHT), Reading(scale=1.0 / _SLIGHT), Reading(farther_m=_FARTHER_M)),
        "The scale of positions against depth cannot be checked closely here, because between frames that see the same "
        f"place the camera turns more than it moves: depths that are {_SLIGHT - 1.0:.0%} or {_FARTHER_M:g} m too large "
        "would not show.",
    ),
    (
        (Reading(Corrections(pose_delay_s=_DELAY_S)), Reading(Corrections(pose_delay_s=-_DELAY_S))),
        "The clock of the poses cannot be checked here, because the camera moves evenly or hardly at all: poses that "
        f"are {_DELAY_S:g} s late would not show.",
    ),
    (
        (Reading(focal=_FOCAL), Reading(focal=1.0 / _FOCAL)),
        "The focal length cannot be checked here, because the camera hardly turns between frames that see the same "
        f"place: one {_FOCAL:g} times as long would not show.",
    ),
    (
        (Reading(off_centre=(_OFF_CENTRE, 0.0)), Reading(off_centre=(0.0, _OFF_CENTRE))),
        "How the camera sits in its mount and its principal point cannot be checked here, because the camera turns "
        f"about one axis or hardly: a principal point that is off by {_OFF_CENTRE:.0%} of the picture would not show.",
    ),
    (
        (Reading(along_ray=True),),
        "Whether depth is measured along the camera's axis cannot be checked here, because the camera hardly turns or "
        "sees a narrow angle: distances along the ray would not show.",
    ),
)
_SEEN: tuple[tuple[Callable[[_Closer], bool], str], ...] = (
    (
        lambda evidence: evidence.edges.would_show,
        "Whether colour lies on depth cannot be checked here, because too few edges are seen in both: colour that lies "
        "a sixteenth of the picture beside would not show.",
    ),
    (
        lambda evidence: evidence.flats.lens_would_show,
        "Whether the distortion of the lens was taken out cannot be checked here, because too few flat surfaces are "
        "seen: a wide lens that bends walls would not show.",
    ),
)


def blind_spots(evidence: _Closer) -> Iterator[str]:
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

    hidden = [sentence for readings, sentence in _MADE if not all(map(shows, readings))]
    yield from (sentence for sentence in hidden if sentence != _MADE[1][1] or _MADE[0][1] not in hidden)
    yield from (sentence for would_show, sentence in _SEEN if not would_show(evidence))
    if evidence.warmth < _LEAST_WARMTH:
        yield (
            "The order of the colour channels cannot be checked here, because red outweighs blue as little as blue "
            "does red: red and blue that are exchanged in all pictures would not show."
        )
    yield from _unseen_steps(evidence.recording)


def _why(evidence: Evidence) -> str:
    outside = evidence.after.outside
    if len(evidence.recording) == 1:
        return "there is one frame"
    if outside > 0.0:
        return (
            f"hardly any two frames see the same place ({outside:.0%} of the points of one lie outside of the other's "
            "view)"
        )
    return "too few pixels have a depth on smooth surface"


def _unseen_steps(recording: Recording) -> Iterator[str]:
    pose, camera = recording.world_from_camera, recording.rig.depth
    view_rad = 2.0 * np.arctan(0.5 * camera.width / camera.fx)
    blind = rotation_angle_rad(pose[:-1], pose[1:]) > _NO_OVERLAP * view_rad
    if blind.any():
        at = int(np.argmax(blind))
        yield (
            f"Jumps of the poses cannot be checked at {int(blind.sum())} of {len(blind)} steps, because the camera "
            f"turns there by more than it sees, as between {recording.name(at)} and {recording.name(at + 1)}."
        )
    for at in gaps(recording):
        if not len(pairs_across(pose, at)):
            apart_s = float(recording.stamps_s[at + 1] - recording.stamps_s[at])
            yield (
                f"Whether the poses have one origin before and after the gap of {apart_s:.3g} s between "
                f"{recording.name(at)} and {recording.name(at + 1)} cannot be checked here, because no place is seen "
                "in both."
            )
