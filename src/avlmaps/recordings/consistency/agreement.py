"""How well the frames of a sample agree, and how far right recordings may differ from themselves.

The figures are in docs/recordings.md.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core import poses
from avlmaps.core.camera import Rig
from avlmaps.recordings.consistency.sample import Sample, Surfaces

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
        """Number of pairs with enough points."""
        return int((self.points >= FEWEST_POINTS).sum())

    def share(self, counts: Int[np.ndarray, " p"]) -> float:
        """Return a share of the points of the pairs that count."""
        used = self.points >= FEWEST_POINTS
        return float(counts[used].sum() / max(self.points[used].sum(), 1))

    @property
    def median_off(self) -> float:
        """Middle of ``off`` of the pairs with enough points; NaN where there is none."""
        known = self.off[np.isfinite(self.off)]
        return float(np.median(known)) if len(known) else float("nan")

    @property
    def same_share(self) -> float:
        """Share of points on the surface that the other frame sees."""
        return self.share(self.same)

    @property
    def through_share(self) -> float:
        """Share of points that the other frame looks through."""
        return self.share(self.through)


_NONE = np.zeros(0, np.int64)
NOTHING = Agreement(_NONE, _NONE, _NONE, _NONE, np.zeros(0), 0.0, float("nan"), np.zeros(0), 0, 0.0)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # of points beside and behind a camera
def compare(
    sample: Sample, surfaces: Surfaces, world_from_camera: Float[np.ndarray, "f 4 4"], rig: Rig | None = None,
    scale: float = 1.0, floor_m: float = SAME_M, *, colour: bool = True,
) -> Agreement:  # fmt: skip
    """Compare the pairs of a sample.

    Args:
        sample: the pictures.
        surfaces: of its depth.
        world_from_camera: poses of the frames.
        rig: other cameras than the sample's.
        scale: what its depths are multiplied by.
        floor_m: by how much depths of one surface may differ however near it is.
        colour: whether likeness is measured as well, which takes a third of the time; otherwise nothing is alike.
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

    Who goes round a corner leaves behind it what was in view: that is no contradiction, however many points it are.
    Wrong poses, depths or cameras always let one of the two frames look through what the other sees; where neither
    does, hidden points say nothing. Frames that are close together are judged by all of their points.

    Args:
        found: of the sample's pairs.
        sample: the pictures.
        surfaces: of its depth.
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
    one, ok_one = _looked_up(sample, rig, rows[0], points)
    two, ok_two = _looked_up(sample, rig, rows[1], moved)
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


def _looked_up(
    sample: Sample, rig: Rig, frames: np.ndarray, points: Float[np.ndarray, "p m 3"]
) -> tuple[np.ndarray, np.ndarray]:
    camera = rig.rgb
    seen = points @ rig.rgb_from_depth[:3, :3].T + rig.rgb_from_depth[:3, 3]
    u = camera.fx * seen[..., 0] / seen[..., 2] + camera.cx
    v = camera.fy * seen[..., 1] / seen[..., 2] + camera.cy
    ok = (seen[..., 2] > _LEAST_DEPTH_M) & (u >= 0.0) & (v >= 0.0) & (u < camera.width) & (v < camera.height)
    at_u, at_v = np.where(ok, u, 0.0).astype(int), np.where(ok, v, 0.0).astype(int)
    return sample.grey[frames[:, None], at_v, at_u].astype(np.float64), ok


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
