"""Other ways to read a recording: usual mistakes are undone one by one on a sample, until its frames agree."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import from_quaternion
from avlmaps.recordings import corrections
from avlmaps.recordings.consistency import agreement
from avlmaps.recordings.corrections import NAMED, NONE, Corrections, GivenCamera, PoseKind, all_axes
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Recording

# Pictures that are mirrored from left to right first (or not), then turned by quarters to the left.
Turn = tuple[bool, int]
TURNS: dict[Turn, str] = {
    (False, 1): "turned by 90 degrees",
    (False, 2): "upside down (turned by 180 degrees)",
    (False, 3): "turned by 90 degrees",
    (True, 0): "mirrored",
    (True, 1): "transposed",
    (True, 2): "mirrored from top to bottom",
    (True, 3): "transposed",
}
UNITS = (0.5, 2.0, 0.25, 4.0, 0.2, 5.0, 0.1, 10.0, 0.01, 100.0, 0.001, 1000.0)
_UNITS_M = (1 / 256, 1 / 1000, 1 / 4000, 1 / 5000, 1e-4)  # that cameras and data sets store depth in
_SCALES = (0.87, 1.15, 0.8, 1.25, 0.63, 1.6, 0.4, 2.5, *UNITS)
_OFF_CENTRE, _BESIDE_CENTRE = (-0.12, -0.06, 0.06, 0.12), (-0.03, 0.0, 0.03)
_FOCAL = (0.5, 0.67, 0.8, 0.9, 1.12, 1.25, 1.5, 2.0)
_DELAYS_S = tuple(sign * step / 20.0 for step in range(1, 21) for sign in (1.0, -1.0))
_MOST_LATE, _LONGEST_DELAY_S, _MORE_ALIKE = 8, 5.0, 0.002
_POSES: tuple[tuple[PoseKind, ...], ...] = (
    (PoseKind.CAMERA_FROM_WORLD,),
    (PoseKind.WXYZ,),
    (PoseKind.WXYZ, PoseKind.CAMERA_FROM_WORLD),
)
# A frame of usual size has its depths compared with `SAME_M`; of a scene of another size it is this share.
_FLOOR_SHARE, _APART_FLOOR_SHARE = agreement.SAME_M / 2.5, agreement.APART_SAME_M / 2.5
# A reading must compare this share of the sample's points to be preferred, and this one of those compared as it is.
_LEAST_COMPARED, _OF_AS_IT_IS = 0.15, 0.5
_CLEARLY, _AS_GOOD = 0.02, 1.15
# A scale, delay or focal length explains a recording that agrees where it leaves this share of the differences, in this
# share of the pairs; smaller differences are noise. Between the steps that are tried, the gain is greater.
_LEAST_GAIN, _MOST_BETTER, LEAST_OFF, _LEAST_STEP, _FEWEST_PAIRS = 0.5, 0.8, 0.006, 0.7, 6
_PAIRS, _POINTS = 14, 128
# A camera's place is searched by steps of metres. Two readings fit alike where their differences are this many times
# one another's; of drawn rooms the true one of a place and a focal length fits 1.9 to 3.3 times better.
_FIRST_STEP_M, _LAST_STEP_M, _OFF_WEIGHT, _ALIKE = 0.3, 0.02, 5.0, 1.5


@dataclass(frozen=True, slots=True)
class Reading:
    """One mistake that is undone, or several.

    Attributes:
        given: what options of the command line undo.
        scale: factor of the depth.
        focal: factor of the focal lengths.
        off_centre: by how much the principal point lies to the right and below, as shares of the picture.
        centred: whether the principal point is put into the middle, with the focal length in proportion.
        turn: how the pictures that are ``turned`` are.
        rolled_deg: by how much the camera is turned about its axis of view, in its mount.
        k1: of the lens, whose distortion is in the pictures.
        depth_late: by how many frames depth pictures come after what they belong to.
        beside_m: where the camera sits from what the poses are of, on the camera's axes.
        or_focal: factor of the focal lengths that explains about as much as ``beside_m``.
    """

    given: Corrections = NONE
    scale: float = 1.0
    focal: float = 1.0
    off_centre: tuple[float, float] = (0.0, 0.0)
    centred: bool = False
    turn: Turn = (False, 0)
    turned: tuple[str, ...] = ()
    rolled_deg: float = 0.0
    k1: float = 0.0
    along_ray: bool = False
    depth_late: int = 0
    beside_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    or_focal: float = 1.0


AS_IT_IS = Reading()
_SCALED = tuple(Reading(scale=scale) for scale in _SCALES)
_FOCUSED = tuple(Reading(focal=factor) for factor in _FOCAL)
_MOUNTED = tuple(Reading(rolled_deg=by) for by in (-8.0, -4.0, 4.0, 8.0))
_BENT = tuple(Reading(k1=k1) for k1 in (-0.1, -0.2, -0.3))
_SHIFTED = tuple(Reading(off_centre=at) for by in _OFF_CENTRE for at in ((by, 0.0), (0.0, by)))


@dataclass(frozen=True, slots=True)
class Trial:
    """A reading, how frames agree with it that follow one another or look from apart, and one number of both."""

    reading: Reading
    after: agreement.Agreement
    apart: agreement.Agreement
    score: float

    @property
    def offs(self) -> Float[np.ndarray, " p"]:
        return np.concatenate([self.after.off, self.apart.off])

    @property
    def off(self) -> float:
        known = self.offs[np.isfinite(self.offs)]
        return float(known.mean()) if len(known) else float("inf")

    @property
    def likeness(self) -> float:
        """Mean correlation of brightness of both kinds of pairs; 0 where nothing varies."""
        known = [found.likeness for found in (self.after, self.apart) if np.isfinite(found.likeness)]
        return float(np.mean(known)) if known else 0.0


class Trials:
    """Tries readings on a few pairs of one sample."""

    def __init__(self, recording: Recording, sample: agreement.Sample) -> None:
        few = [_some(np.flatnonzero(kind)) for kind in (sample.follows, ~sample.follows)]
        self.recording, self.sample = recording, sample.only(np.concatenate(few))
        self.given = recording.given if isinstance(recording, corrections.CorrectedRecording) else NONE
        self.pace_s = float(np.median(np.diff(recording.stamps_s))) if len(recording) > 1 else 0.0
        # what is the same for many readings is kept
        self._delayed, self._late, self._pictures = cache(self._poses_at), cache(self._depths_of), cache(self._read_so)
        known = sample.depth_m[sample.depth_m > 0.0]
        self.median_m = float(np.median(known)) if len(known) else 1.0
        as_read = self._pictures(AS_IT_IS)
        assert as_read is not None
        self._points = max(int(as_read[1].there[self.sample.pairs[:, 0]].sum()), 1)
        self._compared = int(_LEAST_COMPARED * self._points)
        self.as_it_is = self.run(AS_IT_IS, colour=False)
        seen = int(self.as_it_is.after.points.sum() + self.as_it_is.apart.points.sum())
        self._compared = max(self._compared, int(_OF_AS_IT_IS * seen))

    def run(self, reading: Reading, *, colour: bool = True) -> Trial:
        """Return how well the sample agrees so; a score of 0 where it cannot be read so."""
        given = reading.given.over(self.given)
        pose, rig = self._delayed(given.pose_delay_s or 0.0), rig_of(self.sample.rig, reading)
        seen = self._pictures(replace(AS_IT_IS, **{name: getattr(reading, name) for name in _OF_PICTURES}))
        if rig is None or pose is None or seen is None:
            return Trial(reading, agreement.NOTHING, agreement.NOTHING, 0.0)
        half_rad = np.radians(reading.rolled_deg) / 2.0
        turned = np.array([[0.0, 0.0, np.sin(half_rad), np.cos(half_rad)]])
        mounted = from_quaternion(np.array([reading.beside_m]), turned)
        (sample, surfaces), pose = seen, corrections.reread_poses(pose, given) @ mounted
        median_m = self.median_m * reading.scale
        after, apart = (
            agreement.compare(sample.only(kind), surfaces, pose, rig, reading.scale, floor * median_m, colour=colour)
            for kind, floor in ((sample.follows, _FLOOR_SHARE), (~sample.follows, _APART_FLOOR_SHARE))
        )
        return Trial(reading, after, apart, self._score(after, apart))

    def _poses_at(self, delay_s: float) -> Float[np.ndarray, "f 4 4"] | None:
        known = corrections.uncorrected(self.recording).walk
        wanted_s = self.sample.stamps_s + delay_s
        held_s = np.clip(wanted_s, known.stamps_s[0], known.stamps_s[-1])
        return known.at(held_s) if float((np.abs(wanted_s - held_s) > 0.05).mean()) <= 0.5 else None

    def _depths_of(self, late: int) -> Float[np.ndarray, "f h w"] | None:
        if not late:
            return self.sample.depth_m
        rows = np.clip(self.sample.index + late, 0, len(self.recording) - 1)
        if len(np.unique(rows)) < 0.5 * len(rows):
            return None
        try:
            depths = [agreement.small_depth(self.recording.frame(int(row)), self.sample.rig) for row in rows]
        except RecordingError:
            return None
        depths_m: Float[np.ndarray, "f h w"] = np.stack(depths)
        depths_m[self.sample.index + late != rows] = 0.0  # beyond the ends nothing is known
        return depths_m

    def _read_so(self, reading: Reading) -> tuple[agreement.Sample, agreement.Surfaces] | None:
        depth_m, grey = self._late(reading.depth_late), self.sample.grey
        if depth_m is None:
            return None
        if "depth" in reading.turned:
            depth_m = _turned(depth_m, reading.turn)
        if reading.along_ray:
            depth_m = (depth_m / np.linalg.norm(self.sample.rig.depth.rays(), axis=2)).astype(np.float32)
        if "colour" in reading.turned:
            grey = _turned(grey, reading.turn)
        if reading.k1:
            depth_m = _straightened(depth_m, self.sample.rig.depth, reading.k1)
            grey = _straightened(grey, self.sample.rig.rgb, reading.k1)
        return replace(self.sample, depth_m=depth_m, grey=grey), agreement.Surfaces.of(depth_m, _POINTS)

    def _score(self, after: agreement.Agreement, apart: agreement.Agreement) -> float:
        compared = max(int(after.points.sum() + apart.points.sum()), self._compared, 1)
        score = float(after.same.sum() + apart.same.sum()) / compared
        if np.isfinite(after.likeness) and after.textured > 0.05 * self._points:
            score *= 0.5 + 0.5 * max(after.likeness, 0.0)
        return score


_OF_PICTURES = ("turn", "turned", "k1", "along_ray", "depth_late")


def _straightened(pictures: Float[np.ndarray, "f h w"], camera: Pinhole, k1: float) -> Float[np.ndarray, "f h w"]:
    rays = camera.rays()
    rays[..., :2] *= 1.0 + k1 * (rays[..., :2] ** 2).sum(axis=2, keepdims=True)
    column, row = np.moveaxis(np.floor(camera.project(rays)).astype(int), 2, 0)
    inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
    return np.where(inside, pictures[:, row * inside, column * inside], np.float32(0.0))


def _turned(pictures: Float[np.ndarray, "f h w"], turn: Turn) -> Float[np.ndarray, "f h w"]:
    import cv2

    mirror, quarters = turn
    turned = np.rot90(pictures[:, :, ::-1] if mirror else pictures, quarters, axes=(1, 2))
    size = (pictures.shape[2], pictures.shape[1])
    return np.stack([cv2.resize(np.ascontiguousarray(p), size, interpolation=cv2.INTER_NEAREST) for p in turned])


def _some(rows: np.ndarray) -> np.ndarray:
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(_PAIRS, len(rows))).round().astype(int))]


def rig_of(rig: Rig, reading: Reading) -> Rig | None:
    """Return the cameras of a reading, None where there are none or they are what is there already."""
    if reading.focal == 1.0 and not reading.centred and not any(reading.off_centre):
        return rig

    def other(camera: Pinhole) -> Pinhole:
        fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
        if reading.centred:
            fx, fy = fx * camera.width / (2.0 * cx), fy * camera.height / (2.0 * cy)
            cx, cy = camera.width / 2.0, camera.height / 2.0
        cx, cy = cx - reading.off_centre[0] * camera.width, cy - reading.off_centre[1] * camera.height
        return Pinhole(fx * reading.focal, fy * reading.focal, cx, cy, camera.width, camera.height)

    try:
        there = Rig(other(rig.rgb), other(rig.depth), rig.rgb_from_depth)
    except (ValueError, ZeroDivisionError):
        return None
    return None if (there.rgb, there.depth) == (rig.rgb, rig.depth) else there


def find_closer(trials: Trials) -> Trial | None:
    """Return the scale, delay or camera with which depths differ clearly less; None without one.

    With a slow camera points stay within the tolerance in spite of such a mistake; their differences show it.
    """
    as_it_is = trials.as_it_is
    if not LEAST_OFF < as_it_is.off < float("inf"):
        return None
    readings = (*_SCALED, *_delays(trials.pace_s), *_FOCUSED, *_SHIFTED, *_MOUNTED, *_BENT)
    tried = (trials.run(reading, colour=False) for reading in readings)
    closer = [trial for trial in tried if _is_less_off(trial, as_it_is)]
    found = _refined(trials, trials.run(min(closer, key=lambda trial: trial.off).reading)) if closer else None
    of_files = Reading(focal=corrections.uncorrected(trials.recording).rig.rgb.fx / trials.recording.rig.rgb.fx)
    best = _or_beside(trials, found, [AS_IT_IS, *([of_files] if trials.given.intrinsics else [])])
    if best is None:
        return None
    delay_s = best.reading.given.pose_delay_s
    late = -round(delay_s / trials.pace_s) if delay_s and trials.pace_s > 0.0 else 0
    if late:  # depth that is late looks like poses that are early, but for colour
        depth = trials.run(Reading(depth_late=late))
        alike = depth.likeness > best.likeness + _MORE_ALIKE
        best = depth if alike and depth.off <= _AS_GOOD * best.off else best
    return best if is_closer(best, as_it_is) else None


def is_closer(trial: Trial, than: Trial) -> bool:
    """Return whether depths differ by less than half with one reading, so that the other is doubted."""
    return LEAST_OFF < than.off < float("inf") and trial.off < _LEAST_GAIN * than.off and _is_less_off(trial, than)


def _is_less_off(trial: Trial, than: Trial) -> bool:
    before, after = than.offs, trial.offs
    both = np.isfinite(before) & np.isfinite(after) if len(before) == len(after) else np.zeros(0, bool)
    if both.sum() < max(_FEWEST_PAIRS, 0.6 * np.isfinite(before).sum()):
        return False
    better = float((after[both] < before[both]).mean())
    return better >= _MOST_BETTER and float(after[both].mean()) < _LEAST_STEP * float(before[both].mean())


def find_cause(trials: Trials, enough: Callable[[Trial], bool]) -> Trial | None:
    """Return the simplest reading with which the sample agrees, None where no one does."""
    single = [trials.run(reading) for reading in _single(trials)]
    # a delay, scale or focal length between the steps that were tried may fit where none of the steps does
    delayed = [trial for trial in single if _is_delayed(trial.reading)]
    scaled = [trial for trial in single if trial.reading.scale != 1.0]
    focal = [trial for trial in single if trial.reading.focal != 1.0]
    single += [_refined(trials, max(kind, key=lambda trial: trial.score)) for kind in (delayed, scaled, focal)]
    best = _best([trial for trial in single if enough(trial)])
    if best is None or _is_delayed(best.reading):  # pictures that are late look like poses that are early
        late = [trials.run(Reading(depth_late=late)) for late in (1, -1, 2, -2, 3, -3)]
        best = _best([*(t for t in late if enough(t) and is_closer(t, trials.as_it_is)), *([best] if best else [])])
    if best is not None:
        return _or_beside(trials, _refined(trials, best), [replace(best.reading, focal=1.0, scale=1.0)], enough)
    posed = [
        trials.run(Reading(Corrections(poses=kinds, camera_axes=axes))) for kinds, axes in product(_POSES, all_axes())
    ]
    best = _best([trial for trial in posed if enough(trial)])
    if best is not None:
        return best
    # two mistakes of different kinds: what helped most of how poses are read, with each unit and camera
    poses = [trial for trial in single if trial.reading.given and not _is_delayed(trial.reading)]
    helped = sorted([*poses, *posed], key=lambda trial: -trial.score)[:3]
    others = [{"scale": scale} for scale in UNITS[:8]] + [{"focal": focal} for focal in _FOCAL] + [{"centred": True}]
    twice = [trials.run(replace(trial.reading, **other)) for trial in helped for other in others]
    best = _best([trial for trial in twice if enough(trial)])
    return _or_beside(trials, best, [AS_IT_IS, *(trial.reading for trial in helped)], enough)


def _or_beside(
    trials: Trials, found: Trial | None, starts: list[Reading], enough: Callable[[Trial], bool] = lambda _: True
) -> Trial | None:
    """Return what was found, or a camera beside what the poses are of, which looks like another focal length."""
    if found is not None and found.reading.focal == found.reading.scale == 1.0:
        return found
    beside = [trial for trial in (_placed(trials, start) for start in starts) if enough(trial)]
    best = min(beside, key=lambda trial: trial.off, default=None)
    if found is None or best is None or best.off * _ALIKE < found.off:
        return best or found
    if best.off > _ALIKE * found.off or found.reading.focal == 1.0:
        return found
    return replace(best, reading=replace(best.reading, or_focal=found.reading.focal))


def _placed(trials: Trials, start: Reading) -> Trial:
    def fit(trial: Trial) -> float:
        return trial.score - _OFF_WEIGHT * min(trial.off, 0.1)

    best, step_m = trials.run(start, colour=False), _FIRST_STEP_M
    while step_m > _LAST_STEP_M:
        moved = best.reading.beside_m + step_m * np.concatenate([np.eye(3), -np.eye(3)])
        around = (trials.run(replace(start, beside_m=(x, y, z)), colour=False) for x, y, z in moved.tolist())
        closer = max(around, key=fit)
        best, step_m = (closer, step_m) if fit(closer) > fit(best) else (best, step_m / 2.0)
    return trials.run(best.reading)


def _is_known(scale: float, unit_m: float) -> bool:
    return scale in UNITS or any(abs(scale * unit_m / known - 1.0) < 1e-6 for known in _UNITS_M)


def _is_delayed(reading: Reading) -> bool:
    return bool(reading.given.pose_delay_s)


def _best(trials: list[Trial]) -> Trial | None:
    most = max((trial.score for trial in trials), default=0.0)
    return next((trial for trial in trials if trial.score >= most - _CLEARLY), None)


def _single(trials: Trials) -> Iterator[Reading]:
    if trials.given.poses:
        yield Reading(Corrections(poses=(PoseKind.WORLD_FROM_CAMERA,)))
    if trials.given.camera_axes is not None:
        yield Reading(Corrections(camera_axes="opencv"))
    yield from (Reading(Corrections(poses=kinds)) for kinds in _POSES)
    yield from (Reading(Corrections(camera_axes=name)) for name in NAMED if name != "opencv")
    yield from (*_SCALED, Reading(centred=True), *_FOCUSED)
    yield from _delays(trials.pace_s)
    yield from (Reading(Corrections(camera_axes=axes)) for axes in all_axes() if axes not in NAMED.values())
    yield from (Reading(along_ray=True), *_MOUNTED, *_BENT)
    for turned in (("colour",), ("depth",), ("colour", "depth")):
        yield from (Reading(turn=turn, turned=turned) for turn in TURNS)


def _delays(pace_s: float) -> Iterator[Reading]:
    whole = (sign * step * pace_s for step in range(1, _MOST_LATE + 1) for sign in (1.0, -1.0))
    delays_s = (*_DELAYS_S, *(delay_s for delay_s in whole if 1.0 < abs(delay_s) <= _LONGEST_DELAY_S))
    return (Reading(Corrections(pose_delay_s=round(delay_s, 3))) for delay_s in delays_s)


def _refined(trials: Trials, best: Trial) -> Trial:
    reading, tried = best.reading, list[Reading]()
    if delay_s := reading.given.pose_delay_s:
        around_s = (round(float(s), 3) for s in delay_s + np.arange(-4, 5) / 100.0)
        tried = [replace(reading, given=replace(reading.given, pose_delay_s=s)) for s in around_s]
    elif reading.scale != 1.0:
        fine = np.geomspace(0.8, 1.25, 9) * reading.scale
        units = [unit_m / trials.recording.stored_depth_unit_m for unit_m in _UNITS_M]
        tried = [replace(reading, scale=float(scale)) for scale in (*_SCALES, *units, *fine.tolist())]
    elif reading.focal != 1.0:
        tried = [replace(reading, focal=float(reading.focal * factor)) for factor in np.geomspace(0.88, 1.14, 9)]
    elif any(reading.off_centre):
        at_x, at_y = reading.off_centre
        tried = [replace(reading, off_centre=(at_x + x, at_y + y)) for x, y in product(_BESIDE_CENTRE, repeat=2)]
    elif reading.rolled_deg:
        tried = [replace(reading, rolled_deg=reading.rolled_deg + by) for by in (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)]
    found = [best, *(trial for trial in map(trials.run, tried) if trial.score >= best.score - _CLEARLY)]
    least = min(found, key=lambda trial: trial.off)
    # a usual unit rather than one beside it that fits hardly better
    unit_m = trials.recording.stored_depth_unit_m
    usual = [trial for trial in found if trial.off <= _AS_GOOD * least.off and _is_known(trial.reading.scale, unit_m)]
    return min(usual, key=lambda trial: trial.off) if usual else least


# What a reading says, and what undoes it.

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
_OF_PROGRAM = (
    "give frames with world_from_camera of an OpenCV camera (x right, y down, z forward), depth_m in metres along its "
    "axis, the camera of these pictures, and stamps of one clock"
)
_CAMERAS = {"opengl": "an OpenGL camera (y up, z back)", "ros": "a body (x forward)", "opencv": "an OpenCV camera"}


def cause_of(reading: Reading, recording: Recording, median_m: float, gain: str = "") -> str:
    """Return what a recording looks like, the middle of whose depths is read as ``median_m``, and what to do about it.

    ``gain`` says how much better the recording agrees, in parentheses, or nothing.
    """
    told = list(_told(reading, recording.rig, median_m))
    looks, todo = " and ".join(look for look, _ in told), [by_hand for _, by_hand in told if by_hand]
    if options := _options(reading, recording, median_m):
        if is_of_program(recording):
            todo.insert(0, _OF_PROGRAM)
        else:
            todo.insert(0, f"build again with {options.words()}")
    return f"{looks[:1].upper()}{looks[1:]}{' ' * bool(gain)}{gain}: {', '.join(todo)}."


def _told(reading: Reading, rig: Rig, median_m: float) -> Iterator[tuple[str, str]]:
    given, camera = reading.given, rig.depth
    yield from ((_KINDS[kind], "") for kind in given.poses)
    if (axes := given.camera_axes) is not None:
        other = f"a camera with the axes {axes} (turned pictures, or another convention)"
        yield f"the poses look like those of {_CAMERAS.get(axes, other)}", ""
    if delay_s := given.pose_delay_s:
        yield f"the poses look {abs(delay_s):.2g} s {_late(delay_s)}", ""
    if reading.scale != 1.0:
        yield _scaled(reading.scale, median_m)
    if reading.centred:
        size = f"{2 * camera.cx:.0f}x{2 * camera.cy:.0f}"
        yield f"the intrinsics look like those of a {size} picture, not {camera.width}x{camera.height}", ""
    if reading.focal != 1.0:
        yield f"the focal length looks like {reading.focal:.2f} of what is given", ""
    if any(reading.beside_m):
        other = f", or the focal length looks like {reading.or_focal:.2f} of what is given" * (reading.or_focal != 1.0)
        by_hand = "give the poses of the camera (each times the camera's place on the body; in a bag /tf_static)"
        by_hand += ", or its true intrinsics if they are" * bool(other)
        yield f"the camera looks beside what the poses are of{other}", by_hand
    if any(reading.off_centre):
        parts = zip(reading.off_centre, (rig.rgb.width, rig.rgb.height), "xy", strict=True)
        by = " and ".join(f"{share * size:+.0f} pixels in {axis}" for share, size, axis in parts if share)
        yield f"the principal point looks {by} off, or the camera turned by as many in its mount", ""
    yield from _told_of_pictures(reading)


def is_left_handed(reading: Reading) -> bool:
    """Return whether both pictures are mirrored, as those of right-handed cameras with left-handed poses are."""
    return reading.turn[0] and len(reading.turned) == 2


def _told_of_pictures(reading: Reading) -> Iterator[tuple[str, str]]:
    if by := reading.rolled_deg:
        mounted = f"the camera looks turned by {abs(by):.0f} degrees about its axis of view in its mount"
        yield mounted, "correct the transform from what the poses are of to the camera"
    if reading.k1:
        lens = f"the pictures look taken through a wide lens (k1 about {reading.k1:.2g})"
        yield lens, "take its distortion out of the colour and the depth pictures, and give the camera of the new ones"
    if late := reading.depth_late:
        by_hand = f"pair each frame with the depth picture {abs(late)} {'later' if late > 0 else 'earlier'}"
        yield f"the depth pictures look {abs(late)} frame(s) {_late(late)}", by_hand
    if reading.along_ray:
        by_hand = "write the depth along the camera's axis (z)"
        yield "the depth looks like the distance along the ray, not along the camera's axis", by_hand
    if reading.turned:
        what = " and ".join(reading.turned)
        look, by_hand = f"the {what} pictures look {TURNS[reading.turn]}", f"turn the {what} pictures back"
        if is_left_handed(reading):
            look += ", or the poses are left-handed (Unity, Unreal)"
            kept = {0: "x", 2: "y"}.get(reading.turn[1])
            signs = f"negate t{kept} and the two of qx, qy, qz but q{kept}" if kept else "exchange two axes"
            by_hand = f"where writing in them reads rightly, write right-handed poses ({signs}), else {by_hand}"
        yield look, by_hand


def _late(by: float) -> str:
    return "late" if by > 0 else "early"


def _scaled(scale: float, median_m: float) -> tuple[str, str]:
    times, by_hand = f"{max(scale, 1.0 / scale):.3g} times too", f"multiply the positions by {1.0 / scale:.3g}"
    small, large = ("small", "large") if scale > 1.0 else ("large", "small")
    if _is_positions(scale, median_m):
        return f"the positions look {times} {large} (poses of one camera alone have no scale)", by_hand
    if _usual(scale * median_m) > _usual(median_m):
        return f"the depth looks {times} {small}", ""
    return f"the depth looks {times} {small}, or the positions {times} {large}", f"or {by_hand}"


def _usual(median_m: float) -> bool:
    return USUAL_DEPTH_M[0] <= median_m <= USUAL_DEPTH_M[1]


def _is_positions(scale: float, median_m: float) -> bool:
    if (before := _usual(median_m)) != _usual(scale * median_m):
        return before
    return not any(abs(scale / unit - 1.0) < _CLOSE for unit in UNITS) and max(scale, 1.0 / scale) > _SLIGHT


def _options(reading: Reading, recording: Recording, median_m: float) -> Corrections:
    rig, given = recording.rig, reading.given
    cameras: tuple[GivenCamera, ...] = ()
    if reading.centred and rig.registered:
        size = (round(2 * rig.rgb.cx), round(2 * rig.rgb.cy))
        cameras = (GivenCamera(rig.rgb.fx, rig.rgb.fy, rig.rgb.cx, rig.rgb.cy, size),)
    elif (other := rig_of(rig, reading) or rig) is not rig:
        both = (other.rgb,) if rig.registered else (other.rgb, other.depth)
        cameras = tuple(GivenCamera(camera.fx, camera.fy, camera.cx, camera.cy) for camera in both)
    of_depth = reading.scale != 1.0 and not _is_positions(reading.scale, median_m)
    axes = next((name for name, letters in NAMED.items() if letters == given.camera_axes), given.camera_axes)
    unit_m = recording.stored_depth_unit_m * reading.scale if of_depth else None
    return replace(given, depth_unit_m=unit_m, intrinsics=cameras, camera_axes=axes)
