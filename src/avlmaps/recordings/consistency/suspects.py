"""The usual mistakes of recordings, tried one after the other on a sample: which of them makes it agree with itself.

A suspect in words: what the recording looks like, and how to read it instead.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations, product

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.consistency.agreement import APART_SAME_M, NOTHING, SAME_M, Agreement, compare
from avlmaps.recordings.consistency.flats import offset_in_planes
from avlmaps.recordings.consistency.sample import Sample, Surfaces
from avlmaps.recordings.corrections import (
    NAMED,
    NONE,
    Corrections,
    GivenCamera,
    PoseKind,
    all_axes,
    opencv_from_axes,
    reread_poses,
)

# Poses of the sample's frames at their stamps plus a delay; None where the trajectory does not reach.
PoseAt = Callable[[float], Float[np.ndarray, "f 4 4"] | None]
# Depth and brightness of the frames that come so many later than the sample's; None where they cannot be read.
FramesAt = Callable[[int], tuple[np.ndarray, np.ndarray] | None]
# A frame of usual size has its depths compared with `SAME_M`; of a scene of another size it is this share.
_FLOOR_SHARE, _APART_FLOOR_SHARE = SAME_M / 2.5, APART_SAME_M / 2.5
UNITS = (0.5, 2.0, 0.25, 4.0, 0.2, 5.0, 0.1, 10.0, 0.01, 100.0, 0.001, 1000.0)
_SCALES = (0.87, 1.15, 0.8, 1.25, 0.63, 1.6, 0.4, 2.5, *UNITS)
_TWICE_SCALES = UNITS[:8]
_FARTHER_M = (-0.3, -0.15, 0.15, 0.3)
_ROLLED_DEG = (-8.0, -4.0, 4.0, 8.0)
_OFF_CENTRE, _BESIDE_CENTRE = (-0.12, -0.06, 0.06, 0.12), (-0.03, 0.0, 0.03)
_FOCAL = (0.5, 0.67, 0.8, 0.9, 1.12, 1.25, 1.5, 2.0)
_DELAYS_S = tuple(sign * step / 20.0 for step in range(1, 21) for sign in (1.0, -1.0))
_MOST_LATE, _LONGEST_DELAY_S, _MORE_ALIKE = 8, 5.0, 0.002
_POSES: tuple[tuple[PoseKind, ...], ...] = (
    (PoseKind.CAMERA_FROM_WORLD,),
    (PoseKind.WXYZ,),
    (PoseKind.WXYZ, PoseKind.CAMERA_FROM_WORLD),
)
# Of the points that the sample has, a suspect must compare this share to be preferred.
_LEAST_COMPARED = 0.15
# And this share of those that are compared as the recording is.
_OF_AS_IT_IS = 0.5
_CLEARLY = 0.02
_AS_GOOD = 1.15
# A scale, delay or focal length explains a recording that agrees where it leaves this share of the differences, in this
# share of the pairs; smaller differences are noise.
_LEAST_GAIN, _MOST_BETTER, _LEAST_OFF = 0.5, 0.8, 0.006
# Between the steps that are tried, the gain is greater.
_LEAST_STEP = 0.7
_FEWEST_PAIRS = 6
# An offset in planes: up to 0.05 m in right walks, 0.02 m in a real kitchen, 0.06 m in real rooms of poor depth; 0.11 m
# and more where 0.15 m are added or taken away, and then frames differ by 0.92 of what they did, in 0.6 of the pairs.
_LEAST_OFFSET_M, _MOST_OFFSET_M, _OFFSET_BETTER, _OFFSET_STEP = 0.09, 1.0, 0.6, 0.93
_PAIRS, _POINTS = 14, 128


@dataclass(frozen=True, slots=True)
class PictureTurn:
    """How pictures are turned before they fit: mirrored from left to right, then turned by quarters to the left."""

    mirror: bool
    quarters: int

    def __call__(self, pictures: Float[np.ndarray, "f h w"]) -> Float[np.ndarray, "f h w"]:
        """Turn pictures; a quarter is stretched to the size that they had."""
        import cv2

        turned = np.rot90(pictures[:, :, ::-1] if self.mirror else pictures, self.quarters, axes=(1, 2))
        size = (pictures.shape[2], pictures.shape[1])
        if turned.shape == pictures.shape:
            return np.ascontiguousarray(turned)
        resized = np.empty_like(pictures)
        for target, one in zip(resized, np.ascontiguousarray(turned), strict=True):
            target[:] = cv2.resize(one, size, interpolation=cv2.INTER_NEAREST)
        return resized

    def words(self) -> str:
        """Return what was done to the pictures."""
        if not self.mirror:
            return {1: "turned by 90 degrees", 2: "upside down (turned by 180 degrees)", 3: "turned by 90 degrees"}[
                self.quarters
            ]
        return {0: "mirrored", 1: "transposed", 2: "mirrored from top to bottom", 3: "transposed"}[self.quarters]


TURNS = tuple(
    PictureTurn(mirror, quarters) for mirror, quarters in product((False, True), range(4)) if mirror or quarters
)


@dataclass(frozen=True, slots=True)
class Suspect:
    """One mistake, or several at once.

    Attributes:
        given: what of it the options of the command line undo.
        scale: what the depth is multiplied by, beside.
        focal: what the focal lengths are multiplied by; None: nothing.
        off_centre: by how much the principal point lies to the right and below, as shares of the picture.
        rolled_deg: by how much the camera is turned about its own axis in its mount.
        centred: whether the principal point is put into the middle, with the focal length in proportion.
        swapped: whether the numbers of columns and rows are exchanged.
        turn_colour: how colour pictures are turned.
        turn_depth: how depth pictures are turned.
        along_ray: whether the depth is the distance along the ray.
        farther_m: what is added to the depth before it is scaled.
        depth_late: by how many frames depth pictures come after what they belong to.
        colour_late: the same of colour pictures.
        turned_back: whether the rotations alone are those of camera_from_world.
        places: which axes of the positions are x, y and z of the rotations, counted from 1, negative where they point
            the other way; None where they are the same.
    """

    given: Corrections = NONE
    scale: float = 1.0
    focal: float | None = None
    off_centre: tuple[float, float] = (0.0, 0.0)
    rolled_deg: float = 0.0
    centred: bool = False
    swapped: bool = False
    turn_colour: PictureTurn | None = None
    turn_depth: PictureTurn | None = None
    along_ray: bool = False
    farther_m: float = 0.0
    depth_late: int = 0
    colour_late: int = 0
    turned_back: bool = False
    places: tuple[int, int, int] | None = None


@dataclass(frozen=True, slots=True)
class Trial:
    """A suspect, how well frames agree with it that follow one another or look from apart, and one number of both."""

    suspect: Suspect
    agreement: Agreement
    apart: Agreement
    score: float

    @property
    def offs(self) -> Float[np.ndarray, " p"]:
        """Differences of depths of each pair."""
        return np.concatenate([self.agreement.off, self.apart.off])

    @property
    def off(self) -> float:
        """Their mean; infinite without any."""
        known = self.offs[np.isfinite(self.offs)]
        return float(known.mean()) if len(known) else float("inf")

    @property
    def likeness(self) -> float:
        """Mean correlation of brightness of both kinds of pairs; 0 where nothing varies."""
        known = [found.likeness for found in (self.agreement, self.apart) if np.isfinite(found.likeness)]
        return float(np.mean(known)) if known else 0.0


class Trials:
    """Tries suspects on one sample."""

    def __init__(
        self, sample: Sample, pose_at: PoseAt, given: Corrections = NONE, frames_at: FramesAt = lambda _: None,
        pace_s: float = 0.0,
    ) -> None:  # fmt: skip
        """Begin.

        Args:
            sample: that does not agree as it is.
            pose_at: the uncorrected poses at other times.
            given: what was corrected already; suspects replace what they name.
            frames_at: the pictures of frames that come later or earlier.
            pace_s: the usual time from a frame to the next.
        """
        few = [_some(np.flatnonzero(kind)) for kind in (sample.follows, ~sample.follows)]
        self.sample, self._pose_at, self.given = sample.only(np.concatenate(few)), pose_at, given
        self._frames_at, self.pace_s = cache(frames_at), pace_s
        self._depth: dict[tuple[PictureTurn | None, bool, float, int], tuple[np.ndarray, Surfaces]] = {}
        self._kinds: dict[Suspect, tuple[Sample, Sample]] = {}
        self._delayed: dict[float, np.ndarray | None] = {}
        usual = sample.depth_m[sample.depth_m > 0.0]
        self._median_m = float(np.median(usual)) if len(usual) else 1.0
        self._compared = 0
        self._points = max(int(self._measured(Suspect())[1].there[self.sample.pairs[:, 0]].sum()), 1)
        self._compared = int(_LEAST_COMPARED * self._points)
        self._compared = max(self._compared, int(_OF_AS_IT_IS * self._seen(self.run(Suspect(), colour=False))))

    def run(self, suspect: Suspect, *, colour: bool = True) -> Trial:
        """Return how well the sample agrees with a suspect; a score of 0 where it cannot be tried.

        Args:
            suspect: that is tried.
            colour: whether likeness of colour is part of the score; where depths alone decide it need not be measured.
        """
        given = suspect.given.over(self.given)
        delay_s = given.pose_delay_s or 0.0
        if delay_s not in self._delayed:
            self._delayed[delay_s] = self._pose_at(delay_s)
        pose = self._delayed[delay_s]
        rig = suspected_rig(self.sample.rig, suspect)
        late = suspect.depth_late or suspect.colour_late
        if rig is None or pose is None or (late and self._frames_at(late) is None):
            return Trial(suspect, NOTHING, NOTHING, 0.0)
        pose = _replaced(reread_poses(pose, given), suspect) @ _rolled(suspect.rolled_deg)
        surfaces, median_m = self._measured(suspect)[1], self._median_m * suspect.scale
        after, apart = (
            compare(kind, surfaces, pose, rig, suspect.scale, floor * median_m, colour=colour)
            for kind, floor in zip(self._turned(suspect), (_FLOOR_SHARE, _APART_FLOOR_SHARE), strict=True)
        )
        return Trial(suspect, after, apart, self._score(after, apart))

    @staticmethod
    def _seen(trial: Trial) -> int:
        return int(trial.agreement.points.sum() + trial.apart.points.sum())

    def _measured(self, suspect: Suspect) -> tuple[np.ndarray, Surfaces]:
        key = (suspect.turn_depth, suspect.along_ray, suspect.farther_m, suspect.depth_late)
        if key not in self._depth:
            later = self._frames_at(suspect.depth_late) if suspect.depth_late else None
            depth_m = self.sample.depth_m if later is None else later[0]
            if suspect.turn_depth is not None:
                depth_m = suspect.turn_depth(depth_m)
            if suspect.along_ray:
                length = np.linalg.norm(self.sample.rig.depth.rays(), axis=2)
                depth_m = (depth_m / length).astype(np.float32)
            if suspect.farther_m:
                depth_m = np.where(depth_m > 0.0, depth_m + np.float32(suspect.farther_m), depth_m)
            self._depth[key] = depth_m, Surfaces.of(depth_m, _POINTS)
        return self._depth[key]

    def _turned(self, suspect: Suspect) -> tuple[Sample, Sample]:
        key = Suspect(
            turn_colour=suspect.turn_colour, turn_depth=suspect.turn_depth, along_ray=suspect.along_ray,
            farther_m=suspect.farther_m, depth_late=suspect.depth_late, colour_late=suspect.colour_late,
        )  # fmt: skip
        if key not in self._kinds:
            later = self._frames_at(suspect.colour_late) if suspect.colour_late else None
            grey = self.sample.grey if later is None else later[1]
            grey = grey if suspect.turn_colour is None else suspect.turn_colour(grey)
            sample = replace(self.sample, depth_m=self._measured(suspect)[0], grey=grey)
            self._kinds[key] = sample.only(sample.follows), sample.only(~sample.follows)
        return self._kinds[key]

    def _score(self, found: Agreement, apart: Agreement) -> float:
        compared = max(int(found.points.sum() + apart.points.sum()), self._compared, 1)
        score = float(found.same.sum() + apart.same.sum()) / compared
        if np.isfinite(found.likeness) and found.textured > 0.05 * self._points:
            score *= 0.5 + 0.5 * max(found.likeness, 0.0)
        return score


def _replaced(pose: Float[np.ndarray, "f 4 4"], suspect: Suspect) -> Float[np.ndarray, "f 4 4"]:
    if not suspect.turned_back and suspect.places is None:
        return pose
    other = pose.copy()
    if suspect.turned_back:
        other[:, :3, :3] = np.swapaxes(pose[:, :3, :3], 1, 2)
    if suspect.places is not None:
        axes = np.array(suspect.places)
        other[:, :3, 3] = np.sign(axes) * pose[:, :3, 3][:, np.abs(axes) - 1]
    return other


def _rolled(degrees: float) -> Float[np.ndarray, "4 4"]:
    turn, cos, sin = np.eye(4), np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    return turn


def _some(rows: np.ndarray) -> np.ndarray:
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(_PAIRS, len(rows))).round().astype(int))]


def suspected_rig(rig: Rig, suspect: Suspect) -> Rig | None:
    """Return the cameras of a suspect, None where there are none."""
    if suspect.focal is None and not suspect.centred and not suspect.swapped and not any(suspect.off_centre):
        return rig

    def other(camera: Pinhole) -> Pinhole:
        fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
        if suspect.swapped:
            fx, fy, cx, cy = fy, fx, cy, cx
        if suspect.centred:
            fx, fy = fx * camera.width / (2.0 * cx), fy * camera.height / (2.0 * cy)
            cx, cy = camera.width / 2.0, camera.height / 2.0
        factor = suspect.focal or 1.0
        cx, cy = cx - suspect.off_centre[0] * camera.width, cy - suspect.off_centre[1] * camera.height
        return Pinhole(fx * factor, fy * factor, cx, cy, camera.width, camera.height)

    try:
        there = Rig(other(rig.rgb), other(rig.depth), rig.rgb_from_depth)
        return None if (there.rgb, there.depth) == (rig.rgb, rig.depth) else there  # what is there already is no cause
    except (ValueError, ZeroDivisionError):
        return None


def find_closer(trials: Trials) -> Trial | None:
    """Return the scale, offset, delay or focal length with which depths differ clearly less; None without one.

    With a slow camera, points stay within the tolerance of a surface in spite of such a mistake; their differences show
    it, and people who walk by do not change that.
    """
    as_it_is = trials.run(Suspect(), colour=False)
    if not _LEAST_OFF < as_it_is.off < float("inf"):
        return None
    suspects = (*_scales(), *_farther(), *_delays(trials.pace_s), *_focal(), *_mounts())
    tried = (trials.run(suspect, colour=False) for suspect in suspects)
    closer = [trial for trial in tried if _is_less_off(trial, as_it_is)]
    if not closer:
        return None
    best = _refined(trials, trials.run(min(closer, key=lambda trial: trial.off).suspect))
    delay_s = best.suspect.given.pose_delay_s
    late = -round(delay_s / trials.pace_s) if delay_s and trials.pace_s > 0.0 else 0
    if late:  # depth that is late looks like poses that are early, but for colour
        depth = trials.run(Suspect(depth_late=late))
        alike = depth.likeness > best.likeness + _MORE_ALIKE
        best = depth if alike and depth.off <= _AS_GOOD * best.off else best
    return best if is_closer(best, as_it_is) else None


def is_closer(trial: Trial, than: Trial) -> bool:
    """Return whether depths differ by less than half with one reading, so that the other is doubted."""
    return _LEAST_OFF < than.off < float("inf") and trial.off < _LEAST_GAIN * than.off and _is_less_off(trial, than)


def find_offset(trials: Trials) -> Trial | None:
    """Return the offset of all depths that flat surfaces show, where points of two frames lie nearer with it as well.

    What is below ``find_closer``: either alone may be a lens, or chance; both name one length and one sign.
    """
    too_large_m = offset_in_planes(trials.sample.depth_m)
    if not _LEAST_OFFSET_M <= abs(too_large_m) <= _MOST_OFFSET_M:
        return None
    trial, as_it_is = (trials.run(Suspect(farther_m=m), colour=False) for m in (-round(too_large_m, 2), 0.0))
    return trial if _is_less_off(trial, as_it_is, _OFFSET_BETTER, _OFFSET_STEP) else None


def _is_less_off(trial: Trial, than: Trial, most_better: float = _MOST_BETTER, least_step: float = _LEAST_STEP) -> bool:
    before, after = than.offs, trial.offs
    both = np.isfinite(before) & np.isfinite(after) if len(before) == len(after) else np.zeros(0, bool)
    if both.sum() < max(_FEWEST_PAIRS, 0.6 * np.isfinite(before).sum()):
        return False
    better = float((after[both] < before[both]).mean())
    return better >= most_better and float(after[both].mean()) < least_step * float(before[both].mean())


def find_cause(trials: Trials, enough: Callable[[Trial], bool]) -> Trial | None:
    """Return the simplest suspect with which the sample agrees, None where no one does.

    Args:
        trials: of the sample.
        enough: whether a sample agrees.
    """
    single = [trials.run(suspect) for suspect in (*_undone(trials.given), *_single(trials.pace_s))]
    # a delay, scale or focal length between the steps that were tried may fit where none of the steps does
    single += [_refined(trials, max(kind, key=lambda trial: trial.score)) for kind in _by_kind(single)]
    best = _best([trial for trial in single if enough(trial)])
    if best is None or best.suspect.given.pose_delay_s:  # pictures that are late look like poses that are early
        as_it_is = trials.run(Suspect(), colour=False)
        late = [one for one in map(trials.run, _late_depth()) if enough(one) and is_closer(one, as_it_is)]
        best = _best([*late, *([best] if best is not None else [])])
    if best is not None:
        return _refined(trials, best)
    posed = [trials.run(suspect) for suspect in _posed()]
    best = _best([trial for trial in (*posed, *map(trials.run, _apart())) if enough(trial)])
    if best is not None:
        return best
    # two mistakes of different kinds: what helped most of how poses are read, with each scale and camera
    poses = [trial for trial in single if trial.suspect.given and not trial.suspect.given.pose_delay_s]
    helped = sorted([*poses, *posed], key=lambda trial: -trial.score)[:3]
    others = (*(Suspect(scale=scale) for scale in _TWICE_SCALES), *_intrinsics())
    twice = [trials.run(_with(trial.suspect, other)) for trial in helped for other in others]
    return _best([trial for trial in twice if enough(trial)])


def _by_kind(tried: list[Trial]) -> list[list[Trial]]:
    delays = [trial for trial in tried if trial.suspect.given.pose_delay_s]
    scales = [trial for trial in tried if trial.suspect.scale != 1.0]
    return [delays, scales, [trial for trial in tried if trial.suspect.focal is not None]]


def _best(trials: list[Trial]) -> Trial | None:
    if not trials:
        return None
    most = max(trial.score for trial in trials)
    return next(trial for trial in trials if trial.score >= most - _CLEARLY)


def _undone(given: Corrections) -> Iterator[Suspect]:
    if given.poses:
        yield Suspect(Corrections(poses=(PoseKind.WORLD_FROM_CAMERA,)))
    if given.camera_axes is not None:
        yield Suspect(Corrections(camera_axes="opencv"))


def _single(pace_s: float) -> Iterator[Suspect]:
    yield from (Suspect(Corrections(poses=kinds)) for kinds in _POSES)
    yield from (Suspect(Corrections(camera_axes=name)) for name in NAMED if name != "opencv")
    yield from _scales()
    yield from _intrinsics()
    yield from _delays(pace_s)
    yield from (Suspect(Corrections(camera_axes=axes)) for axes in all_axes() if axes not in NAMED.values())
    yield Suspect(along_ray=True)
    yield from (Suspect(turn_colour=turn) for turn in TURNS)
    yield from (Suspect(turn_depth=turn) for turn in TURNS)
    yield from (Suspect(turn_colour=turn, turn_depth=turn) for turn in TURNS)


def _posed() -> Iterator[Suspect]:
    for kinds, axes in product(_POSES, all_axes()):
        yield Suspect(Corrections(poses=kinds, camera_axes=axes))


def _apart() -> Iterator[Suspect]:
    yield Suspect(turned_back=True)
    for x, y, z in permutations((1, 2, 3)):
        for signs in product((1, -1), repeat=3):
            if (x, y, z, *signs) != (1, 2, 3, 1, 1, 1):
                yield Suspect(places=(x * signs[0], y * signs[1], z * signs[2]))


def _scales() -> Iterator[Suspect]:
    yield from (Suspect(scale=scale) for scale in _SCALES)


def _farther() -> Iterator[Suspect]:
    yield from (Suspect(farther_m=by_m) for by_m in _FARTHER_M)


def _delays(pace_s: float) -> Iterator[Suspect]:
    """Yield delays of up to a second, and beyond it of whole frames where these come seldom."""
    whole = (sign * step * pace_s for step in range(1, _MOST_LATE + 1) for sign in (1.0, -1.0))
    delays_s = (*_DELAYS_S, *(delay_s for delay_s in whole if 1.0 < abs(delay_s) <= _LONGEST_DELAY_S))
    yield from (Suspect(Corrections(pose_delay_s=round(delay_s, 3))) for delay_s in delays_s)


def _late_depth() -> Iterator[Suspect]:
    yield from (Suspect(depth_late=late) for late in (1, -1, 2, -2, 3, -3))


def _intrinsics() -> Iterator[Suspect]:
    yield Suspect(centred=True)
    yield Suspect(swapped=True)
    yield from _focal()


def _focal() -> Iterator[Suspect]:
    yield from (Suspect(focal=factor) for factor in _FOCAL)


def _mounts() -> Iterator[Suspect]:
    yield from (Suspect(rolled_deg=degrees) for degrees in _ROLLED_DEG)
    for by in _OFF_CENTRE:
        yield from (Suspect(off_centre=(by, 0.0)), Suspect(off_centre=(0.0, by)))


def _with(a: Suspect, b: Suspect) -> Suspect:
    return Suspect(
        given=b.given.over(a.given),
        scale=a.scale if b.scale == 1.0 else b.scale,
        focal=b.focal or a.focal,
        rolled_deg=b.rolled_deg or a.rolled_deg,
        off_centre=b.off_centre if any(b.off_centre) else a.off_centre,
        centred=a.centred or b.centred,
        swapped=a.swapped or b.swapped,
        turn_colour=a.turn_colour,
        turn_depth=a.turn_depth,
        along_ray=a.along_ray,
        farther_m=a.farther_m,
        turned_back=a.turned_back,
        places=a.places,
    )


def _refined(trials: Trials, best: Trial) -> Trial:
    """Return the delay, scale or focal length near the best at which depths differ least."""
    suspect, tried = best.suspect, list[Suspect]()
    if suspect.given.pose_delay_s:
        around_s = suspect.given.pose_delay_s + np.arange(-4, 5) / 100.0
        tried = [replace(suspect, given=replace(suspect.given, pose_delay_s=round(float(s), 3))) for s in around_s]
    elif suspect.scale != 1.0:
        fine = np.geomspace(0.8, 1.25, 9) * suspect.scale
        tried = [replace(suspect, scale=float(scale)) for scale in (*_SCALES, *fine.tolist())]
    elif suspect.focal is not None:
        tried = [replace(suspect, focal=float(suspect.focal * factor)) for factor in np.geomspace(0.88, 1.14, 9)]
    elif suspect.farther_m:
        tried = [replace(suspect, farther_m=suspect.farther_m + by_m) for by_m in (-0.1, -0.05, 0.05, 0.1)]
    elif suspect.rolled_deg:
        tried = [
            replace(suspect, rolled_deg=suspect.rolled_deg + degrees) for degrees in (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
        ]
    elif any(suspect.off_centre):
        at_x, at_y = suspect.off_centre
        tried = [replace(suspect, off_centre=(at_x + x, at_y + y)) for x, y in product(_BESIDE_CENTRE, repeat=2)]
    found = [best, *(trial for trial in map(trials.run, tried) if trial.score >= best.score - _CLEARLY)]
    least = min(found, key=lambda trial: trial.off)
    # a usual unit rather than one beside it that fits hardly better
    usual = [trial for trial in found if trial.suspect.scale in UNITS and trial.off <= _AS_GOOD * least.off]
    return min(usual, key=lambda trial: trial.off) if usual else least


# A camera in a building looks at this much, in the middle of what it sees.
USUAL_DEPTH_M = (0.4, 7.0)
_CLOSE = 0.06
# Depth cameras that are not calibrated are off by this factor; more is another unit, or positions without a scale.
_SLIGHT = 1.2
_KINDS = {
    PoseKind.WXYZ: "the quaternions look written w first (wxyz)",
    PoseKind.CAMERA_FROM_WORLD: "the poses look like camera_from_world",
    PoseKind.WORLD_FROM_CAMERA: "the poses look like world_from_camera",
}

_GIVEN = {
    PoseKind.WXYZ: "poses of quaternions x, y, z, w",
    PoseKind.CAMERA_FROM_WORLD: "the inverse of each pose",
    PoseKind.WORLD_FROM_CAMERA: "each pose as it is",
}


def cause_of(
    suspect: Suspect, rig: Rig, stored_unit_m: float, median_m: float, gain: str, *, of_program: bool = False
) -> str:
    """Return what a recording looks like and what to do about it.

    Args:
        suspect: with which it agrees.
        rig: its cameras.
        stored_unit_m: metres of one unit of its depth as it is read.
        median_m: middle of its depths, as they are read.
        gain: how much better the recording agrees, in parentheses, or nothing.
        of_program: a program gives the frames, so that it has to give others.
    """
    looks = " and ".join(_looks(suspect, rig, median_m))
    options, hands = _options(suspect, rig, stored_unit_m, median_m), _by_hand(suspect, median_m)
    todo: list[str] = []
    if options and of_program:
        todo.append(f"give frames with {' and '.join(_in_arrays(options, suspect.scale))}")
    elif options:
        todo.append(f"build again with {options.words()}")
    if hands:
        todo.append(hands)
    gain = f" {gain}" if gain else ""
    return f"{looks[:1].upper()}{looks[1:]}{gain}: {', '.join(todo)}."


def _looks(suspect: Suspect, rig: Rig, median_m: float) -> list[str]:
    given = suspect.given
    said = [_KINDS[kind] for kind in given.poses]
    if given.camera_axes is not None:
        said.append(f"the poses look like those of {_camera(given.camera_axes)}")
    if given.pose_delay_s:
        late = "late" if given.pose_delay_s > 0.0 else "early"
        said.append(f"the poses look {abs(given.pose_delay_s):.2g} s {late}")
    if suspect.scale != 1.0:
        said.append(_scale(suspect.scale, median_m))
    if suspect.centred:
        size = f"{2 * rig.depth.cx:.0f}x{2 * rig.depth.cy:.0f}"
        said.append(f"the intrinsics look like those of a {size} picture, not {rig.depth.width}x{rig.depth.height}")
    if suspect.swapped:
        said.append("the numbers of columns and rows in the intrinsics look exchanged")
    if suspect.focal is not None:
        said.append(f"the focal length looks like {suspect.focal:.2f} of what is given")
    if any(suspect.off_centre):
        parts = zip(suspect.off_centre, (rig.rgb.width, rig.rgb.height), "xy", strict=True)
        by = " and ".join(f"{share * size:+.0f} pixels in {axis}" for share, size, axis in parts if share)
        said.append(f"the principal point looks {by} off, or the camera turned by as many in its mount")
    if suspect.rolled_deg:
        said.append(f"the camera looks turned by {suspect.rolled_deg:+.0f} degrees about its own axis in its mount")
    return (
        said + _measured_otherwise(suspect) + _of_two_worlds(suspect) + _turned(suspect.turn_colour, suspect.turn_depth)
    )


def _measured_otherwise(suspect: Suspect) -> list[str]:
    said: list[str] = []
    if suspect.farther_m:
        large = "large" if suspect.farther_m < 0.0 else "small"
        said.append(f"the depth looks {abs(suspect.farther_m):.2g} m too {large} everywhere")
    for what, late in (("depth", suspect.depth_late), ("colour", suspect.colour_late)):
        if late:
            said.append(f"the {what} pictures look {abs(late)} frame(s) {'late' if late > 0 else 'early'}")
    if suspect.along_ray:
        said.append("the depth looks like the distance along the ray, not along the camera's axis")
    return said


def _of_two_worlds(suspect: Suspect) -> list[str]:
    said: list[str] = []
    if suspect.turned_back:
        said.append("the rotations look like those of camera_from_world, the positions like those of the camera")
    if suspect.places is not None:
        axes = ", ".join(f"{'-' if axis < 0 else ''}{'xyz'[abs(axis) - 1]}" for axis in suspect.places)
        said.append(f"the positions look written in other axes than the rotations, whose x, y, z they call {axes}")
    return said


def _camera(axes: str) -> str:
    names = {"opengl": "an OpenGL camera (y up, z back)", "ros": "a body (x forward)", "opencv": "an OpenCV camera"}
    return names.get(axes, f"a camera with the axes {axes} (turned pictures, or another convention)")


def _turned(colour: PictureTurn | None, depth: PictureTurn | None) -> list[str]:
    if colour is not None and colour == depth:
        return [f"the pictures look {colour.words()}"]
    said = [(f"the {what} pictures look", turn) for what, turn in (("colour", colour), ("depth", depth))]
    return [f"{what} {turn.words()}" for what, turn in said if turn is not None]


def _scale(scale: float, median_m: float) -> str:
    times = f"{max(scale, 1.0 / scale):.3g} times too {'small' if scale > 1.0 else 'large'}"
    if _is_depth(scale, median_m):
        return f"the depth looks {times}"
    other = f"{max(scale, 1.0 / scale):.3g} times too {'large' if scale > 1.0 else 'small'}"
    if _is_positions(scale, median_m):
        return f"the positions look {other} (poses of one camera alone have no scale)"
    return f"the depth looks {times}, or the positions {other}"


def _usual(median_m: float) -> bool:
    return USUAL_DEPTH_M[0] <= median_m <= USUAL_DEPTH_M[1]


def _is_unit(scale: float) -> bool:
    return any(abs(scale / unit - 1.0) < _CLOSE for unit in UNITS)


def _is_depth(scale: float, median_m: float) -> bool:
    return _is_unit(scale) and _usual(scale * median_m) and not _usual(median_m)


def _is_positions(scale: float, median_m: float) -> bool:
    return (not _is_unit(scale) and max(scale, 1.0 / scale) > _SLIGHT) or (
        _usual(median_m) and not _usual(scale * median_m)
    )


def _options(suspect: Suspect, rig: Rig, stored_unit_m: float, median_m: float) -> Corrections:
    cameras: tuple[GivenCamera, ...] = ()
    if suspect.centred and rig.registered:
        size = (round(2 * rig.rgb.cx), round(2 * rig.rgb.cy))
        cameras = (GivenCamera(rig.rgb.fx, rig.rgb.fy, rig.rgb.cx, rig.rgb.cy, size),)
    elif suspect.centred or suspect.swapped or suspect.focal is not None or any(suspect.off_centre):
        other = suspected_rig(rig, suspect) or rig
        both = (other.rgb,) if rig.registered else (other.rgb, other.depth)
        cameras = tuple(GivenCamera(camera.fx, camera.fy, camera.cx, camera.cy) for camera in both)
    depth = suspect.scale != 1.0 and not _is_positions(suspect.scale, median_m)
    return Corrections(
        depth_unit_m=stored_unit_m * suspect.scale if depth else None,
        intrinsics=cameras,
        poses=suspect.given.poses,
        camera_axes=_named(suspect.given.camera_axes),
        pose_delay_s=suspect.given.pose_delay_s,
    )


def _in_arrays(options: Corrections, scale: float) -> list[str]:
    said = [_GIVEN[kind] for kind in options.poses]
    if options.depth_unit_m is not None:
        said.append(f"depth_m times {scale:.3g}")
    if options.intrinsics:
        words = Corrections(intrinsics=options.intrinsics).words(lambda _, value: value)
        said.append(f"a camera of fx, fy, cx, cy {words}")
    if options.camera_axes is not None:
        turn = opencv_from_axes(options.camera_axes).T.astype(int).tolist()
        said.append(f"poses of OpenCV's axes, world_from_camera[:3, :3] @ {turn}")
    if options.pose_delay_s:
        when = "later" if options.pose_delay_s > 0.0 else "earlier"
        said.append(f"the pose of {abs(options.pose_delay_s):.2g} s {when}")
    return said


def _named(axes: str | None) -> str | None:
    return next((name for name, letters in NAMED.items() if letters == axes), axes)


def _pictures_by_hand(suspect: Suspect) -> list[str]:
    todo: list[str] = []
    if suspect.turn_colour is not None and suspect.turn_depth is not None:
        todo.append("turn the pictures as the poses have them")
    elif suspect.turn_colour is not None:
        todo.append("turn the colour pictures as the depth is")
    elif suspect.turn_depth is not None:
        todo.append("turn the depth pictures as the colour is")
    for what, late in (("depth", suspect.depth_late), ("colour", suspect.colour_late)):
        if late:
            todo.append(f"pair each frame with the {what} picture {abs(late)} {'later' if late > 0 else 'earlier'}")
    return todo


def _by_hand(suspect: Suspect, median_m: float) -> str:
    """Return what no option does."""
    todo: list[str] = []
    if suspect.scale != 1.0 and not _is_depth(suspect.scale, median_m):
        alone = _is_positions(suspect.scale, median_m)
        todo.append(f"{'' if alone else 'or '}multiply the positions by {1.0 / suspect.scale:.3g}")
    todo += _pictures_by_hand(suspect)
    if suspect.rolled_deg:
        todo.append("correct the transform from what the poses are of to the camera")
    if suspect.farther_m:
        todo.append(f"write the depth from the camera's centre ({suspect.farther_m:+.2g} m)")
    if suspect.along_ray:
        todo.append("write the depth along the camera's axis (z)")
    if suspect.turned_back:
        todo.append("write the inverse of each rotation")
    if suspect.places is not None:
        todo.append("write rotations and positions in the axes of one world")
    return ", ".join(todo)
