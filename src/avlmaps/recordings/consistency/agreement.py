"""A few frames of a recording at low resolution, which of them see the same place, and how well they agree.

How far right recordings may differ from themselves is in docs/recordings.md.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.types import Frame, Recording

WIDTH = 128
POINTS = 320
PAIRS = 30  # that follow in time, at most
# How far a camera moves between the frames of a pair: degrees and metres count alike where both are one such step.
STEP_RAD = np.radians(12.0)
STEP_M = 0.35
STEPS = (0.5, 1.2)
# A frame further away is of another camera that takes turns with this one, or after a jump: a nearer one is compared.
NO_STEP = 5.0
# Of the pairs that look one way from apart: this far apart, as long as poses say so.
APART = 12
APART_M, APART_RAD = 0.7, np.radians(25.0)
JUMPS = 4
# A step this many times the usual one is a jump that is looked at.
JUMP_RATIO = 4.0
# A step of the poses this many times the usual one, and beyond this, is odd.
_ODD_STEP, _ODD_STEP_M, _ODD_STEP_RAD = 4.0, 0.15, np.radians(8.0)
_DIM = 30.0  # the least brightness, of 255, of which red less blue is a share
# A neighbourhood whose depths differ by more is an edge, of which no point is taken.
_SMOOTH = 0.06
# Of a pixel and its neighbours, with a depth.
_FEWEST_AROUND = 4
# A pair is compared at most this much later where the poses hardly move: the clock then says that they should.
_LATEST_SHARE = 0.1


@dataclass(frozen=True, slots=True)
class Sample:
    """Frames at low resolution, and pairs of them.

    Attributes:
        index: (f,) numbers of the frames in the recording.
        world_from_camera: (f, 4, 4) poses as they are read.
        depth_m: (f, h, w) z-depth, 0 where there is none.
        grey: (f, hc, wc) brightness, 0 to 255.
        hue: (f, hc, wc) red less blue, of the brightest of the three, -1 to 1.
        rig: the cameras at these sizes.
        pairs: (p, 2) rows of frames that should see the same place, the earlier first.
        follows: (p,) whether the frames of a pair follow one another; the others look at one place from apart.
        unread: number of frames of the sample that could not be read.
    """

    index: Int[np.ndarray, " f"]
    stamps_s: Float[np.ndarray, " f"]
    world_from_camera: Float[np.ndarray, "f 4 4"]
    depth_m: Float32[np.ndarray, "f h w"]
    grey: Float32[np.ndarray, "f hc wc"]
    hue: Float32[np.ndarray, "f hc wc"]
    rig: Rig
    pairs: Int[np.ndarray, "p 2"]
    follows: Bool[np.ndarray, " p"]
    unread: int = 0

    def __len__(self) -> int:
        return len(self.index)

    def only(self, chosen: Bool[np.ndarray, " p"] | Int[np.ndarray, " k"]) -> "Sample":
        return replace(self, pairs=self.pairs[chosen], follows=self.follows[chosen])


def draw_pairs(recording: Recording, pairs: Int[np.ndarray, "p 2"], follows: Bool[np.ndarray, " p"]) -> Sample:
    """Read the frames of pairs; those with a frame that cannot be read are left out."""
    index = np.unique(pairs) if len(pairs) else np.arange(min(len(recording), 1))
    whole = recording.rig
    rig = Rig(_small(whole.rgb), _small(whole.depth), whole.rgb_from_depth)
    seen: dict[int, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
    fault: RecordingError | None = None
    for number in index.tolist():
        try:
            frame = recording.frame(number)
        except RecordingError as error:
            fault = error
            continue
        seen[number] = small_depth(frame, rig), *_colour(frame.rgb, rig.rgb)
    if not seen:
        raise fault or RecordingError(f"{recording.path} has no frame; there is nothing to check.")
    read, (depth, grey, hue) = np.array(list(seen)), zip(*seen.values(), strict=True)
    kept = np.isin(pairs, read).all(axis=1)
    return Sample(
        index=read,
        stamps_s=recording.stamps_s[read],
        world_from_camera=recording.world_from_camera[read],
        depth_m=np.stack(depth),
        grey=np.stack(grey),
        hue=np.stack(hue),
        rig=rig,
        pairs=np.searchsorted(read, pairs[kept]),
        follows=follows[kept],
        unread=len(index) - len(read),
    )


def small_depth(frame: Frame, rig: Rig) -> Float32[np.ndarray, "h w"]:
    """Return the depth of a frame at the size of a sample's cameras."""
    camera, (rows, columns) = rig.depth, frame.depth_m.shape
    row = ((np.arange(camera.height) + 0.5) * rows / camera.height).astype(int)
    column = ((np.arange(camera.width) + 0.5) * columns / camera.width).astype(int)
    return frame.depth_m[row[:, None], column]


def choose_pairs(pose: Float[np.ndarray, "n 4 4"]) -> tuple[Int[np.ndarray, "p 2"], Bool[np.ndarray, " p"]]:
    """Return pairs after a step or across jumps, then of cameras that look one way from apart; which are the former."""
    n = len(pose)
    if n < 2:
        return np.zeros((0, 2), np.int64), np.zeros(0, bool)
    found: dict[tuple[int, int], None] = {}
    latest = max(2, round(_LATEST_SHARE * n))
    for a in _spread(n - 1):
        if len(found) >= PAIRS:
            break
        moved = steps_between(pose[a], pose[a + 1 : a + 1 + 4 * latest])
        for wanted in STEPS:
            far = np.flatnonzero(moved >= wanted)
            if len(far) and moved[far[0]] > NO_STEP:
                far = far[[int(np.argmin(moved[far]))]]
            found[a, a + 1 + (int(far[0]) if len(far) else min(latest, len(moved)) - 1)] = None
    step = steps_between_all(pose)
    odd = np.flatnonzero(step > JUMP_RATIO * max(float(np.median(step)), 0.02))
    for at in odd[np.argsort(-step[odd], kind="stable")][:JUMPS].tolist():
        found[at, at + 1] = None
    after = sorted(found)
    apart = [pair for pair in _apart(pose) if pair not in found]
    return np.array([*after, *apart], np.int64).reshape(-1, 2), np.arange(len(after) + len(apart)) < len(after)


def _spread(n: int) -> list[int]:
    order: dict[int, None] = {}
    parts = 1
    while len(order) < min(n, PAIRS):
        order |= dict.fromkeys(((2 * np.arange(parts) + 1) * n // (2 * parts)).tolist())
        parts *= 2
    return list(order)


def _apart(pose: Float[np.ndarray, "n 4 4"]) -> list[tuple[int, int]]:
    rows = np.unique(np.linspace(0, len(pose) - 1, min(len(pose), 150)).round().astype(int))
    few = pose[rows]
    away_m = np.linalg.norm(few[:, None, :3, 3] - few[None, :, :3, 3], axis=-1)
    ahead = few[:, :3, 2] @ few[:, :3, 2].T
    upright = few[:, :3, 1] @ few[:, :3, 1].T
    least = np.cos(APART_RAD)
    with np.errstate(divide="ignore"):
        off = np.abs(np.log(away_m / APART_M))
    off[(ahead < least) | (upright < least) | np.tri(len(rows), dtype=bool)] = np.inf
    off += 0.2 * np.abs(np.subtract.outer(rows, rows)) / len(pose)  # of pairs as far apart, the sooner ones
    near, found = max(1, len(rows) // (3 * APART)), list[tuple[int, int]]()
    while len(found) < APART and np.isfinite(off).any():  # each time beyond the rows around those before
        a, b = (int(i) for i in np.unravel_index(int(np.argmin(off)), off.shape))
        found.append((int(rows[a]), int(rows[b])))
        off[max(0, a - near) : a + near + 1, :] = np.inf
    return found


def steps_between(one: Float[np.ndarray, "*n 4 4"], others: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, " n"]:
    """Return how far cameras are from one, or each from its own, in steps."""
    away_m = np.linalg.norm(others[:, :3, 3] - one[..., :3, 3], axis=1)
    return away_m / STEP_M + rotation_angle_rad(np.broadcast_to(one, others.shape), others) / STEP_RAD


def steps_between_all(pose: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, " m"]:
    """Return how far each camera is from the one before, in steps."""
    return steps_between(pose[:-1], pose[1:])


def odd_steps(recording: Recording) -> Bool[np.ndarray, " m"]:
    """Return which steps from a frame to the next are much larger than usual."""
    pose = recording.world_from_camera
    if len(pose) < 2:
        return np.zeros(0, bool)
    moved_m = np.linalg.norm(np.diff(pose[:, :3, 3], axis=0), axis=1)
    turned_rad = rotation_angle_rad(pose[:-1], pose[1:])
    far = moved_m > max(_ODD_STEP * float(np.median(moved_m)), _ODD_STEP_M)
    return far | (turned_rad > max(_ODD_STEP * float(np.median(turned_rad)), _ODD_STEP_RAD))


def _small(camera: Pinhole) -> Pinhole:
    width = min(WIDTH, camera.width)
    return camera.resized(width, max(1, round(camera.height * width / camera.width)))


def _colour(rgb: np.ndarray, camera: Pinhole) -> tuple[Float32[np.ndarray, "hs ws"], Float32[np.ndarray, "hs ws"]]:
    import cv2

    small = cv2.resize(rgb, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    colours = small.astype(np.float32)
    hue = (colours[..., 0] - colours[..., 2]) / np.maximum(colours.max(axis=2), _DIM)
    return cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float32), hue


@dataclass(frozen=True, slots=True)
class Surfaces:
    """What is needed of each depth picture, computed once.

    Attributes:
        near_m: (f, h, w) least depth of the 3x3 pixels around, 0 where too few of them have one.
        far_m: (f, h, w) greatest depth there.
        row: (f, m) pixels on smooth surface; with ``column``, where ``there``.
        smooth_share: of the pixels with depth around, those on smooth surface; NaN without any.
    """

    near_m: Float32[np.ndarray, "f h w"]
    far_m: Float32[np.ndarray, "f h w"]
    row: Int[np.ndarray, "f m"]
    column: Int[np.ndarray, "f m"]
    there: Bool[np.ndarray, "f m"]
    smooth_share: float

    @staticmethod
    def of(depth_m: Float32[np.ndarray, "f h w"], points: int = POINTS) -> "Surfaces":
        near, far = _around(depth_m)
        count = len(depth_m)
        row, column = np.zeros((count, points), np.int64), np.zeros((count, points), np.int64)
        there = np.zeros((count, points), bool)
        smooth = 0
        for f in range(count):
            v, u = np.nonzero((near[f] > 0.0) & (depth_m[f] > 0.0) & (far[f] - near[f] < _SMOOTH * near[f]))
            smooth += len(v)
            if len(v) == 0:
                continue
            chosen = np.unique(np.linspace(0, len(v) - 1, min(points, len(v))).round().astype(int))
            row[f, : len(chosen)], column[f, : len(chosen)] = v[chosen], u[chosen]
            there[f, : len(chosen)] = True
        known = int(((near > 0.0) & (depth_m > 0.0)).sum())
        return Surfaces(near, far, row, column, there, smooth / known if known else float("nan"))


def _around(depth_m: Float32[np.ndarray, "f h w"]) -> tuple[np.ndarray, np.ndarray]:
    from scipy.ndimage import maximum_filter, minimum_filter, uniform_filter

    size, known = (1, 3, 3), depth_m > 0.0
    share = uniform_filter(known.astype(np.float32), size, mode="constant")
    enough = np.rint(9.0 * share) >= _FEWEST_AROUND
    enough[:, [0, -1]] = enough[:, :, [0, -1]] = False
    low = minimum_filter(np.where(known, depth_m, np.float32(np.inf)), size)
    return np.where(enough, low, np.float32(0.0)), np.where(enough, maximum_filter(depth_m, size), np.float32(0.0))


# A surface is the same where the depths differ by no more than this: that of a depth camera's error.
SAME_M, SAME_SHARE = 0.03, 0.02
# A point is seen through where the other frame sees this much farther in all directions around: in floors, in shares.
BEHIND, BEHIND_SHARE = 2.0, 0.04
# Pairs from apart have the drift of what lies between them as well.
APART_SAME_M = 0.06
# A pair with fewer points in view says nothing.
FEWEST_POINTS = 25
_LEAST_DEPTH_M = 0.02
# Cameras further apart than this may have gone round a corner; then less than this share is seen through.
WIDE_STEP_M, MOST_THROUGH = 0.5, 0.02
# Brightness that varies less, of 255, is noise.
LEAST_CONTRAST = 6.0


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """Counts of pairs of frames.

    Attributes:
        points: (p,) points of the one frame that the other has in view, with a depth there.
        same: (p,) of them on the surface that the other sees.
        through: (p,) of them in front of what the other sees: it looks through them.
        hidden: (p,) of them behind it.
        off: (p,) median difference of depths there, as a share of the depth; NaN of a pair with too few points.
        outside: share of all points that their partner does not have in view.
        likeness: correlation of brightness of the same points, over all pairs; NaN where nothing varies.
        alike: (p,) the same of each pair; NaN where too few points have colour, or it hardly varies.
        textured: points on the same surface that both frames have the colour of.
        contrast: by how much their brightness varies, of 255.
    """

    points: Int[np.ndarray, " p"]
    same: Int[np.ndarray, " p"]
    through: Int[np.ndarray, " p"]
    hidden: Int[np.ndarray, " p"]
    off: Float[np.ndarray, " p"]
    outside: float
    likeness: float
    alike: Float[np.ndarray, " p"]
    textured: int
    contrast: float

    @property
    def pairs(self) -> int:
        return int((self.points >= FEWEST_POINTS).sum())

    def share(self, counts: Int[np.ndarray, " p"]) -> float:
        used = self.points >= FEWEST_POINTS
        return float(counts[used].sum() / max(self.points[used].sum(), 1))

    @property
    def median_off(self) -> float:
        """Middle of ``off`` of the pairs with enough points; NaN where there is none."""
        known = self.off[np.isfinite(self.off)]
        return float(np.median(known)) if len(known) else float("nan")

    @property
    def same_share(self) -> float:
        return self.share(self.same)

    @property
    def through_share(self) -> float:
        return self.share(self.through)


_NONE = np.zeros(0, np.int64)
NOTHING = Agreement(_NONE, _NONE, _NONE, _NONE, np.zeros(0), 0.0, float("nan"), np.zeros(0), 0, 0.0)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # of points beside and behind a camera
def compare(
    sample: Sample, surfaces: Surfaces, world_from_camera: Float[np.ndarray, "f 4 4"], rig: Rig | None = None,
    scale: float = 1.0, floor_m: float = SAME_M, *, colour: bool = True,
) -> Agreement:  # fmt: skip
    """Compare the pairs of a sample, perhaps with another rig and its depths times a scale.

    Depths of one surface may differ by ``floor_m`` however near it is. Without ``colour``, which takes a third of the
    time, nothing is alike.
    """
    rig = rig or sample.rig
    camera = rig.depth
    a, b = sample.pairs[:, 0], sample.pairs[:, 1]
    if len(a) == 0:
        return NOTHING
    row, column, there = surfaces.row[a], surfaces.column[a], surfaces.there[a]
    z = sample.depth_m[a[:, None], row, column].astype(np.float64) * scale
    x = (column + 0.5 - camera.cx) / camera.fx * z
    y = (row + 0.5 - camera.cy) / camera.fy * z
    points = np.stack([x, y, z], axis=-1)
    b_from_a = poses.inverse(world_from_camera[b]) @ world_from_camera[a]
    moved = points @ np.swapaxes(b_from_a[:, :3, :3], 1, 2) + b_from_a[:, None, :3, 3]
    far = moved[..., 2]
    u = camera.fx * moved[..., 0] / far + camera.cx
    v = camera.fy * moved[..., 1] / far + camera.cy
    inside = there & (far > _LEAST_DEPTH_M) & (u >= 0.0) & (v >= 0.0) & (u < camera.width) & (v < camera.height)
    at_u, at_v = np.where(inside, u, 0.0).astype(int), np.where(inside, v, 0.0).astype(int)
    near = surfaces.near_m[b[:, None], at_v, at_u] * scale
    deep = surfaces.far_m[b[:, None], at_v, at_u] * scale
    seen = inside & (near > 0.0)
    same = seen & (far > near - floor_m - SAME_SHARE * far) & (far < deep + floor_m + SAME_SHARE * far)
    through = seen & (near > far + BEHIND * floor_m + BEHIND_SHARE * far)
    hidden = seen & (deep < far - BEHIND * floor_m - BEHIND_SHARE * far)
    outside = 1.0 - float(inside.sum() / max(there.sum(), 1))
    counts = (seen.sum(axis=1), same.sum(axis=1), through.sum(axis=1), hidden.sum(axis=1))
    measured = sample.depth_m[b[:, None], at_v, at_u] * scale
    unknown = float("nan"), np.full(len(a), np.nan), 0, 0.0
    alike = _likeness(sample, rig, (a, b), points, moved, same) if colour else unknown
    return Agreement(*counts, _off(measured, far, seen), outside, *alike)


def without_occluded(found: Agreement, sample: Sample, surfaces: Surfaces) -> Agreement:
    """Return an agreement in which points that a wide step has hidden do not count.

    Who goes round a corner leaves behind what was in view. Wrong poses, depths or cameras always let one of the frames
    look through what the other sees; where neither does, hidden points say nothing.
    """
    place = sample.world_from_camera[:, :3, 3]
    step_m = np.linalg.norm(place[sample.pairs[:, 1]] - place[sample.pairs[:, 0]], axis=-1)
    wide = np.flatnonzero((step_m > WIDE_STEP_M) & (found.through <= MOST_THROUGH * found.points))
    apart = sample.only(wide)
    back = compare(replace(apart, pairs=apart.pairs[:, ::-1]), surfaces, sample.world_from_camera, colour=False)
    occluded = wide[back.through <= MOST_THROUGH * back.points]
    points = found.points.copy()
    points[occluded] -= found.hidden[occluded]
    return replace(found, points=points)


def _off(measured: Float[np.ndarray, "p m"], expected: Float[np.ndarray, "p m"], seen: np.ndarray) -> np.ndarray:
    usable = seen & (measured > 0.0)
    count = usable.sum(axis=1)
    share = np.sort(np.where(usable, np.abs(measured - expected) / expected, np.inf), axis=1)
    row = np.arange(len(share))
    median = 0.5 * (share[row, np.maximum(count - 1, 0) // 2] + share[row, np.minimum(count // 2, share.shape[1] - 1)])
    return np.where(count >= FEWEST_POINTS, median, np.nan)


def _likeness(
    sample: Sample,
    rig: Rig,
    rows: tuple[np.ndarray, np.ndarray],
    points: Float[np.ndarray, "p m 3"],
    moved: Float[np.ndarray, "p m 3"],
    same: np.ndarray,
) -> tuple[float, Float[np.ndarray, " p"], int, float]:
    (u_one, v_one, ok_one), (u_two, v_two, ok_two) = in_colour(rig, points), in_colour(rig, moved)
    one, two = sample.grey[rows[0][:, None], v_one, u_one], sample.grey[rows[1][:, None], v_two, u_two]
    used = same & ok_one & ok_two
    count = used.sum(axis=1)
    enough = count >= FEWEST_POINTS
    used &= enough[:, None]
    total = np.maximum(used.sum(axis=1, keepdims=True), 1)
    one = np.where(used, one - np.where(used, one, 0.0).sum(axis=1, keepdims=True) / total, 0.0)
    two = np.where(used, two - np.where(used, two, 0.0).sum(axis=1, keepdims=True) / total, 0.0)
    power = np.stack([(one * one).sum(axis=1), (two * two).sum(axis=1)])
    common, varies = (one * two).sum(axis=1), enough & (power > total[:, 0] * LEAST_CONTRAST**2).all(axis=0)
    alike = np.full(len(one), np.nan)
    alike[varies] = common[varies] / np.sqrt(power[0, varies] * power[1, varies])
    textured, spread = int(used.sum()), float(np.sqrt(power[0].sum() * power[1].sum()))
    likeness = float(common.sum()) / spread if spread > 0.0 else float("nan")
    return likeness, alike, textured, float(np.sqrt(power.sum(axis=1).min() / max(textured, 1)))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def in_colour(rig: Rig, points: Float[np.ndarray, "*n 3"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the columns and rows where the colour camera sees points of the depth camera, and whether it does."""
    camera = rig.rgb
    seen = points @ rig.rgb_from_depth[:3, :3].T + rig.rgb_from_depth[:3, 3]
    u = camera.fx * seen[..., 0] / seen[..., 2] + camera.cx
    v = camera.fy * seen[..., 1] / seen[..., 2] + camera.cy
    ok = (seen[..., 2] > _LEAST_DEPTH_M) & (u >= 0.0) & (v >= 0.0) & (u < camera.width) & (v < camera.height)
    return np.where(ok, u, 0.0).astype(int), np.where(ok, v, 0.0).astype(int), ok


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
# Of fewer points than are judged otherwise, hardly any may agree.
HARDLY_ANY = 0.2
# Correlation of the brightness of the same points, of all pairs and of a pair that is not one.
LEAST_LIKENESS = 0.75
BAD_LIKENESS = 0.4
IMPOSSIBLE_LIKENESS = 0.3
# Nothing is said of a recording with fewer pairs or points.
FEWEST_PAIRS = 2
FEWEST_IN_ALL = 150


def can_be_judged(found: Agreement) -> bool:
    """Return whether enough pairs see the same place."""
    return found.pairs >= FEWEST_PAIRS and int(found.points.sum()) >= FEWEST_IN_ALL


def geometry_agrees(found: Agreement) -> bool:
    """Return whether nearly all points agree, or most of them do so well that the others are what moved meanwhile."""
    if bad_pairs(found) > MOST_BAD_PAIRS * found.pairs:
        return False
    known = found.off[np.isfinite(found.off)]
    moved = found.same_share >= LEAST_WITH_PEOPLE and float(np.median(known)) <= MOST_OFF
    return found.same_share >= LEAST_AGREEING or moved


def apart_agrees(found: Agreement) -> bool:
    """Return whether pairs that look one way from apart agree, as far as there are any."""
    return not can_be_judged(found) or found.same_share >= LEAST_AGREEING_APART


def bad_pairs(found: Agreement) -> int:
    """Return how many pairs hardly agree, not for somebody who stands before a part of the picture."""
    used = found.points >= FEWEST_POINTS
    return int(((found.same < BAD_PAIR * found.points) & (found.off > BAD_OFF))[used].sum())


def unlike(found: Agreement) -> bool:
    """Return whether the same points do not look alike, in all or in several pairs."""
    if not np.isfinite(found.likeness) or found.textured < FEWEST_IN_ALL or found.contrast < LEAST_CONTRAST:
        return False
    bad = int((found.alike < BAD_LIKENESS).sum())
    return found.likeness < LEAST_LIKENESS or (bad >= 2 and bad > MOST_BAD_PAIRS * np.isfinite(found.alike).sum())
