"""The floors under a walk, so that encoders may know how high over the floor a pixel lies.

Frames become voxels in level axes (``patches``). Cameras are grouped by their height; for each group the level surfaces
below it are hypotheses of its floor. The floor is the lowest level that anything stands on, so that surfaces seen
**below** a level speak against it, unless the camera stood over it and nothing is seen under its own footprint, as on a
landing or a podium; its extent speaks for it; and cameras are seldom 2 m over the floor. That the floor is not in view
is a hypothesis, too. Each piece of evidence is a sum in nats; a softmax over the hypotheses gives their confidences.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int, Int64

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import apply
from avlmaps.recordings.types import Frame, Ground, Recording, Subset

COLUMNS = 107  # blocks across a picture
MAX_RANGE_M = 6.0  # beyond, a depth camera's error is as large as a step
LEVEL_RAD = np.deg2rad(18.0)  # how far a patch may lean and still count as level
CELL_M, SLICE_M = 0.1, 0.05  # a voxel of the evidence: its width, and its height along up
_FULL = 0.6  # a block counts when this share of its pixels has a depth,
_STEP = 0.15  # and when they differ by less than this share of it
_BITS = 20  # of a voxel's number, for each axis
_BIAS = 1 << (_BITS - 1)
STEP_X, STEP_Y = 1 << _BITS, 1  # between the numbers of neighbouring columns


@dataclass(frozen=True, slots=True)
class Voxelised:
    """Points gathered into voxels of 0.1 x 0.1 x 0.05 m, so that a place counts once however long it is looked at.

    Attributes:
        key: (n,) rising number of each voxel.
        count: (n,) how many points fell into it.
        height_m: (n,) their mean height along up.
        range_m: (n,) their mean depth.
    """

    key: Int64[np.ndarray, " n"]
    count: Float[np.ndarray, " n"]
    height_m: Float[np.ndarray, " n"]
    range_m: Float[np.ndarray, " n"]

    @classmethod
    def of(cls, point_m: Float[np.ndarray, "n 3"], range_m: Float[np.ndarray, " n"]) -> "Voxelised":
        """Gather points, given in level axes."""
        index = np.floor(point_m / (CELL_M, CELL_M, SLICE_M)).astype(np.int64)
        index = np.clip(index + _BIAS, 0, (1 << _BITS) - 1)
        key = (index[:, 0] << 2 * _BITS) | (index[:, 1] << _BITS) | index[:, 2]
        return _gathered(key, np.ones(len(key)), point_m[:, 2], range_m)

    @classmethod
    def union(cls, parts: "list[Voxelised]") -> "Voxelised":
        """Gather the voxels of several frames."""
        if not parts:
            return _gathered(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))
        key, count, height_m, range_m = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("key", "count", "height_m", "range_m")
        )
        return _gathered(key, count, height_m, range_m)

    def __getitem__(self, chosen: Bool[np.ndarray, " n"]) -> "Voxelised":
        return Voxelised(self.key[chosen], self.count[chosen], self.height_m[chosen], self.range_m[chosen])

    def __len__(self) -> int:
        return len(self.key)

    def columns(self) -> Int64[np.ndarray, " n"]:
        """Return the number of the column of each voxel: of its x and y."""
        return self.key >> _BITS

    def middles_m(self) -> Float[np.ndarray, "n 2"]:
        """Return the middle of each voxel's column, level x and y."""
        column = self.columns()
        index = np.stack([column >> _BITS, column & ((1 << _BITS) - 1)], axis=-1) - _BIAS
        return (index + 0.5) * CELL_M


def _gathered(
    key: Int64[np.ndarray, " n"],
    count: Float[np.ndarray, " n"],
    height_m: Float[np.ndarray, " n"],
    range_m: Float[np.ndarray, " n"],
) -> Voxelised:
    unique, place = np.unique(key, return_inverse=True)
    place = place.reshape(-1)
    total = np.bincount(place, count, minlength=len(unique))
    sums = [np.bincount(place, count * value, minlength=len(unique)) for value in (height_m, range_m)]
    return Voxelised(unique, total, sums[0] / np.maximum(total, 1.0), sums[1] / np.maximum(total, 1.0))


@dataclass(frozen=True, slots=True)
class Sight:
    """The surfaces of one frame, in level axes: x and y horizontal, the third along up; metres.

    Attributes:
        camera_m: (3,) where the camera was.
        surface: all that was seen.
        level: of it what is level and faces up.
    """

    camera_m: Float[np.ndarray, "3"]
    surface: Voxelised
    level: Voxelised


def sight_of(frame: Frame, up_in_world: Float[np.ndarray, "3"]) -> Sight:
    """Return the surfaces of a frame within 6 m, as voxels in level axes."""
    axes = level_axes(up_in_world)
    camera, inverse_depth = _blocks(frame)
    x = ((np.arange(camera.width) + 0.5) - camera.cx) / camera.fx
    y = ((np.arange(camera.height) + 0.5) - camera.cy) / camera.fy
    ray = np.stack([*np.meshgrid(x, y), np.ones((camera.height, camera.width))], axis=-1)
    smooth, normal = _planes(inverse_depth, x, y)
    level = normal @ (frame.world_from_camera[:3, :3].T @ up_in_world) < -np.cos(LEVEL_RAD)

    def gathered(inverse: Float[np.ndarray, "h w"], rays: Float[np.ndarray, "h w 3"]) -> Voxelised:
        known = np.isfinite(inverse)
        range_m = 1.0 / inverse[known]
        point_m = apply(frame.world_from_camera, rays[known] * range_m[:, None]) @ axes.T
        return Voxelised.of(point_m, range_m)

    return Sight(
        camera_m=axes @ frame.world_from_camera[:3, 3],
        surface=gathered(inverse_depth, ray),
        level=gathered(np.where(level, smooth, np.nan), ray[1:-1, 1:-1]),
    )


def level_axes(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return a rotation from the world into axes whose third is up; its rows are the axes."""
    away = np.eye(3)[int(np.argmin(np.abs(up)))]
    x = np.cross(up, away)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def _blocks(frame: Frame) -> tuple[Pinhole, Float[np.ndarray, "h w"]]:
    camera = frame.rig.depth
    size = max(1, round(camera.width / COLUMNS))
    h, w = camera.height // size, camera.width // size
    depth = frame.depth_m[: h * size, : w * size].astype(np.float64)
    depth = np.where(np.isfinite(depth) & (depth > 0.0), depth, 0.0).reshape(h, size, w, size)
    known = depth > 0.0
    count = known.sum(axis=(1, 3))
    mean = np.divide(1.0, depth, out=np.zeros_like(depth), where=known).sum(axis=(1, 3)) / np.maximum(count, 1)
    far_m = depth.max(axis=(1, 3))
    spread_m = far_m - np.where(known, depth, far_m[:, None, :, None]).min(axis=(1, 3))
    good = (count >= _FULL * size * size) & (mean * MAX_RANGE_M > 1.0) & (spread_m * mean < _STEP)
    small = Pinhole(camera.fx / size, camera.fy / size, camera.cx / size, camera.cy / size, w, h)
    return small, np.where(good, mean, np.nan)


def _planes(
    inverse_depth: Float[np.ndarray, "h w"], x: Float[np.ndarray, " w"], y: Float[np.ndarray, " h"]
) -> tuple[Float[np.ndarray, "hs ws"], Float[np.ndarray, "hs ws 3"]]:
    h, w = inverse_depth.shape
    if h < 3 or w < 3:
        return np.zeros((0, 0)), np.zeros((0, 0, 3))
    near = {(i, j): inverse_depth[1 + i : h - 1 + i, 1 + j : w - 1 + j] for i in (-1, 0, 1) for j in (-1, 0, 1)}
    middle = np.sum(list(near.values()), axis=0) / 9.0
    along_x = np.sum([j * value for (_, j), value in near.items()], axis=0) / (6.0 * (x[1] - x[0]))
    along_y = np.sum([i * value for (i, _), value in near.items()], axis=0) / (6.0 * (y[1] - y[0]))
    rest = middle - along_x * x[None, 1:-1] - along_y * y[1:-1, None]
    normal = np.stack([along_x, along_y, rest], axis=-1)
    return middle, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


# The floor is searched between these distances below the camera, metres.
DEEPEST_M, HIGHEST_M = 2.6, 0.12
# Where no floor is in view the camera is taken to be held as people and robots mostly do.
USUAL_HEIGHT_M = 1.3
CERTAIN = 0.9  # from this confidence a floor gives the camera's height in the whole recording
SAME_M = 0.12  # two heights closer than this are one hypothesis
_BIN_M, _BLUR_M = 0.02, 0.03  # of the histogram of level heights
_FEWEST = 3.0  # voxels that make a peak
_BELOW_M, _BELOW_PER_M = 0.08, 0.02  # a surface lies below a level when it does by this, and this for each metre away
_DEEP_M = 0.25  # and counts fully when it does by this much more: up is seldom known to a degree
_REACH_M = 0.25  # a camera stands over what is level within this horizontal distance
_FEWEST_UNDER = 3  # voxels that say what a camera stands over

# Weights of the evidence, nats: round numbers, chosen on NYUv2's training frames, the red kitchen and simulated walks.
_FEW = 20.0  # this number of level voxels (0.2 m2) is worth -0.7
_MANY = 300.0  # this number (3 m2) is worth +0.5
_BELOW_NATS, _MOST_BELOW = 40.0, 0.25
# Cameras over a level make it a floor (a landing, a podium) when that many stand over it and it is larger than tables
# are, or when they are as high over it as they are over other floors.
_MOST_STOOD, _LARGE_M2, _USUAL, _STOOD_NATS = 0.5, 5.0, 0.1, 3.0
_UNSEEN_NATS = -2.5
_NOT_SAID_NATS = 6.0  # against every floor but the one that someone gave
_GUESSED = 0.5  # how likely the height of a floor out of view is right, when it is out of view
_AT_BOTTOM = 0.65  # the bottom of what is in view is taken for a floor out of view from this share of the usual height


@dataclass(frozen=True, slots=True)
class SurfacesAtHeight:
    """The surfaces round a camera height.

    Attributes:
        camera_m: height of the cameras, along up.
        surface: all that was seen by cameras of about that height.
        level: level surfaces that face up, seen by them.
        under_m: (k,) height of what each camera at this height stood over; NaN where that was not seen.
    """

    camera_m: float
    surface: Voxelised
    level: Voxelised
    under_m: Float[np.ndarray, " k"]


@dataclass(frozen=True, slots=True)
class Expected:
    """A user's or a robot's hint about the floor.

    Attributes:
        floor_m: its height along up.
        camera_height_m: of the camera over it.
        exact: whether the floor lies there, or only not above it.
    """

    floor_m: float
    camera_height_m: float
    exact: bool = True


@dataclass(frozen=True, slots=True)
class FloorEvidence:
    """The evidence for and against a floor at one height.

    Attributes:
        height_m: of the floor, along up.
        camera_height_m: of the camera over it.
        level_m2: area of level surface at this height; 0 for a floor out of view.
        below: share of all surface in view that lies below, in [0, 1].
        undercut: share of its own footprint with surface seen beneath, in [0, 1].
        stood: share of the cameras that stand over it, among those of which that is known, in [0, 1].
        trusted: whether that many cameras over so large a level, or at the recording's usual height, make it a floor
            though other surface lies below.
        seen: whether a level surface lies there; False says that the floor is out of view.
        nats: all of it as one sum, the higher the better.
    """

    height_m: float
    camera_height_m: float
    level_m2: float
    below: float
    undercut: float
    stood: float
    trusted: bool
    seen: bool
    nats: float


@dataclass(frozen=True, slots=True)
class Choice:
    """The floor under a camera.

    Attributes:
        best: the hypothesis that is taken.
        confidence: how likely the floor lies within 0.12 m of that height under all the evidence, in [0, 1]; at most
            0.5 for a floor out of view.
        runner_up: the best hypothesis at another height, None where there is none.
        runner_up_confidence: how likely that one is, in [0, 1].
    """

    best: FloorEvidence
    confidence: float
    runner_up: FloorEvidence | None
    runner_up_confidence: float


def choose_floor(view: SurfacesAtHeight, expected: Expected | None = None, usual_m: float | None = None) -> Choice:
    """Return the floor under the cameras of a view."""
    found = [weigh(view, height_m, expected, usual_m) for height_m in hypotheses(view)]
    found = sorted([*found, out_of_view(view, expected)], key=lambda evidence: -evidence.nats)
    weight = np.exp(np.array([evidence.nats for evidence in found]) - found[0].nats)
    weight /= weight.sum()
    if expected is None or not expected.exact:
        weight *= np.array([1.0 if evidence.seen else _GUESSED for evidence in found])
    best = found[0]
    same = np.array([abs(evidence.height_m - best.height_m) < SAME_M for evidence in found])
    others = np.flatnonzero(~same)
    if not len(others):
        return Choice(best, float(weight[same].sum()), None, 0.0)
    second = found[int(others[0])]
    near = ~same & np.array([abs(evidence.height_m - second.height_m) < SAME_M for evidence in found])
    return Choice(best, float(weight[same].sum()), second, float(weight[near].sum()))


def hypotheses(view: SurfacesAtHeight) -> list[float]:
    """Return the heights along up at which level surface gathers, below the camera."""
    lowest = view.camera_m - DEEPEST_M
    level = view.level.height_m
    level = level[(level > lowest) & (level < view.camera_m - HIGHEST_M)]
    bins = round(DEEPEST_M / _BIN_M)
    count = np.bincount(((level - lowest) / _BIN_M).astype(int), minlength=bins + 1).astype(float)
    offset = np.arange(-5, 6) * _BIN_M
    smooth = np.pad(np.convolve(count, np.exp(-0.5 * (offset / _BLUR_M) ** 2), "same"), 1)
    peak = (smooth[1:-1] >= smooth[:-2]) & (smooth[1:-1] > smooth[2:]) & (smooth[1:-1] >= _FEWEST)
    middles = lowest + (np.flatnonzero(peak) + 0.5) * _BIN_M
    return [float(np.median(level[np.abs(level - height) < 2.5 * _BIN_M])) for height in middles]


def weigh(
    view: SurfacesAtHeight, height_m: float, expected: Expected | None = None, usual_m: float | None = None
) -> FloorEvidence:
    """Return the evidence for a floor at a height where level surface was seen."""
    at = np.abs(view.level.height_m - height_m) < 2.5 * _BIN_M
    off = (view.level.height_m[at] - height_m) / _BLUR_M
    support = float(np.exp(-0.5 * off**2).sum())
    below, beneath = _beneath(view, height_m)
    undercut = _undercut(view.level[at], beneath)
    known = view.under_m[np.isfinite(view.under_m)]
    stood = float(np.mean(np.abs(known - height_m) < SAME_M)) if len(known) else 0.0
    level_m2 = len(np.unique(view.level[at].columns())) * CELL_M**2
    usual = usual_m is not None and abs(np.log((view.camera_m - height_m) / usual_m)) < _USUAL
    trusted = stood >= _MOST_STOOD and (level_m2 >= _LARGE_M2 or usual)
    given = expected is not None and expected.exact
    prior = 0.0 if trusted and usual and not given else prior_nats(height_m, view.camera_m, expected)
    nats = (
        np.log(support / (support + _FEW))
        + 0.7 * np.log1p(support / _MANY)
        - _BELOW_NATS * min(undercut if trusted else below, _MOST_BELOW)
        + _STOOD_NATS * trusted
        + prior
    )
    return FloorEvidence(
        height_m, view.camera_m - height_m, level_m2, below, undercut, stood, trusted, True, float(nats)
    )


def out_of_view(view: SurfacesAtHeight, expected: Expected | None = None) -> FloorEvidence:
    """Return the hypothesis that no level surface in view is the floor.

    The floor then lies where someone said; else at the bottom of what is in view, or where cameras usually have it if
    that is lower by far.
    """
    window = view.surface.height_m[view.surface.height_m > view.camera_m - DEEPEST_M]
    deep_m = view.camera_m - float(np.quantile(window, 0.01)) if len(window) else 0.0
    camera_height_m = deep_m if deep_m > _AT_BOTTOM * USUAL_HEIGHT_M else USUAL_HEIGHT_M
    if expected is not None and expected.exact:
        given_m = view.camera_m - expected.floor_m
        camera_height_m = given_m if HIGHEST_M < given_m < DEEPEST_M else expected.camera_height_m
    height_m = view.camera_m - camera_height_m
    nats = _UNSEEN_NATS + prior_nats(height_m, view.camera_m, expected)
    below, _ = _beneath(view, height_m)
    return FloorEvidence(height_m, camera_height_m, 0.0, below, 0.0, 0.0, False, False, float(nats))


def prior_nats(height_m: float, camera_m: float, expected: Expected | None = None) -> float:
    """Return how likely a floor at a height is before anything was seen, in nats below the likeliest.

    People hold cameras and robots carry them 0.9 to 1.7 m high; small robots have theirs anywhere below.
    """
    camera_height_m = camera_m - height_m
    if expected is not None and expected.exact:
        if abs(height_m - expected.floor_m) < SAME_M:
            return 0.0
        return max(-0.5 * (np.log(camera_height_m / expected.camera_height_m) / 0.1) ** 2, -12.0) - _NOT_SAID_NATS
    too_high = expected is not None and camera_height_m < expected.camera_height_m - SAME_M
    ratio = np.log(camera_height_m / 1.25)
    likely = 0.93 * np.exp(-0.5 * (ratio / (0.4 if ratio < 0.0 else 0.25)) ** 2)
    return float(np.log(likely + (0.07 if ratio < 0.0 else 0.002))) - _NOT_SAID_NATS * too_high


def _beneath(view: SurfacesAtHeight, height_m: float) -> tuple[float, Voxelised]:
    window = view.surface.height_m > view.camera_m - DEEPEST_M
    deep_m = height_m - view.surface.height_m - _BELOW_M - _BELOW_PER_M * view.surface.range_m
    below = float(np.clip(deep_m[window] / _DEEP_M, 0.0, 1.0).mean()) if window.any() else 0.0
    return below, view.surface[window & (deep_m > 0.0)]


def _undercut(level: Voxelised, beneath: Voxelised) -> float:
    column = np.unique(level.columns())
    inner = np.ones(len(column), bool)
    for step in (STEP_X, -STEP_X, STEP_Y, -STEP_Y):
        inner &= np.isin(column + step, column)
    if not inner.any():
        return 0.0
    return float(np.isin(column[inner], beneath.columns()).mean())


def stood_over(camera_m: Float[np.ndarray, "k 3"], level: Voxelised) -> Float[np.ndarray, " k"]:
    """Return the height of the level surface that each camera stood over, along up; NaN where none was seen.

    Args:
        camera_m: (k, 3) in level axes.
        level: level surfaces that any frame saw.
    """
    middle_m = level.middles_m()
    under = np.full(len(camera_m), np.nan)
    for index, (x, y, height_m) in enumerate(camera_m):
        close = np.hypot(middle_m[:, 0] - x, middle_m[:, 1] - y) < _REACH_M
        drop_m = height_m - level.height_m[close]
        there = level.height_m[close][(drop_m > HIGHEST_M) & (drop_m < DEEPEST_M)]
        if len(there) >= _FEWEST_UNDER:
            under[index] = _commonest(there)
    return under


def _commonest(heights: Float[np.ndarray, " n"]) -> float:
    near: Sequence[int] = (np.abs(heights[:, None] - heights[None]) < 0.06).sum(axis=1).tolist()
    return float(max(zip(near, heights.tolist(), strict=True))[1])


_BAND_M = 0.12  # cameras of one group differ in height by no more than this
_STOREY_M = 0.6  # a camera's view counts for others whose height differs by no more than this


@dataclass(frozen=True, slots=True)
class FoundFloor:
    """A floor that cameras stood over.

    Attributes:
        cameras_m: (k,) rising heights of these cameras, along up.
        height_m: of the floor, along up.
        confidence: how likely this is the floor under all the evidence, in [0, 1]; mean over the cameras.
        choice: the hypotheses behind it, of the group with the most cameras.
    """

    cameras_m: Float[np.ndarray, " k"]
    height_m: float
    confidence: float
    choice: Choice

    @property
    def camera_height_m(self) -> float:
        """Median height of these cameras over the floor."""
        return float(np.median(self.cameras_m)) - self.height_m


@dataclass(frozen=True, slots=True)
class FoundGround:
    """The floors of a recording, and their confidence.

    Attributes:
        ground: for the height of each camera the floor under it.
        floors: each of them once, lowest first.
    """

    ground: Ground
    floors: tuple[FoundFloor, ...]


def find_ground(
    frames: Iterable[Frame], up_in_world: Float[np.ndarray, "3"], start: Expected | None = None
) -> FoundGround:
    """Find the floors that a recording's cameras stood over.

    Args:
        frames: spread over the recording; one after the other is held in memory.
        up_in_world: unit vector.
        start: the floor that someone gave for the start of the recording.

    Returns:
        For the height of each frame's camera the height of the floor under it, along up, and the confidence.
    """
    up = np.asarray(up_in_world, np.float64)
    return ground_of_sights([sight_of(frame, up) for frame in frames], up, start)


def ground_of_sights(
    sights: Sequence[Sight], up_in_world: Float[np.ndarray, "3"], start: Expected | None = None
) -> FoundGround:
    """Find the floors from what frames show; see ``find_ground``."""
    nothing = Voxelised.union([])
    sights = sorted(sights or [Sight(np.zeros(3), nothing, nothing)], key=lambda sight: float(sight.camera_m[2]))
    cameras_m = np.array([sight.camera_m[2] for sight in sights])
    everywhere = Voxelised.union([sight.level for sight in sights])
    under_m = stood_over(np.stack([sight.camera_m for sight in sights]), everywhere)
    bands = list(_bands(cameras_m))
    views = [_view(sights, cameras_m, under_m, band) for band in bands]
    usual_m = _usual_height_m(bands, [choose_floor(view, start) for view in views])
    choices = [choose_floor(view, start, usual_m) for view in views]
    floor_m = np.concatenate(
        [np.full(len(band), choice.best.height_m) for band, choice in zip(bands, choices, strict=True)]
    )
    return FoundGround(Ground(up_in_world, cameras_m, floor_m), _floors(cameras_m, bands, choices))


def _bands(cameras_m: Float[np.ndarray, " k"]) -> Iterator[Int[np.ndarray, " m"]]:
    order = np.arange(len(cameras_m))
    for run in np.split(order, np.flatnonzero(np.diff(cameras_m) > _BAND_M) + 1):
        span_m = cameras_m[run[-1]] - cameras_m[run[0]]
        pieces = max(1, int(np.ceil(span_m / _BAND_M - 1e-6)))
        place = np.minimum(((cameras_m[run] - cameras_m[run[0]]) / max(span_m, 1e-9) * pieces).astype(int), pieces - 1)
        yield from (run[place == piece] for piece in range(pieces) if (place == piece).any())


def _view(
    sights: Sequence[Sight],
    cameras_m: Float[np.ndarray, " k"],
    under_m: Float[np.ndarray, " k"],
    band: Int[np.ndarray, " m"],
) -> SurfacesAtHeight:
    middle_m = float(np.median(cameras_m[band]))
    near = [sight for sight, at_m in zip(sights, cameras_m, strict=True) if abs(at_m - middle_m) < _STOREY_M]
    return SurfacesAtHeight(
        camera_m=middle_m,
        surface=Voxelised.union([sight.surface for sight in near]),
        level=Voxelised.union([sight.level for sight in near]),
        under_m=under_m[band],
    )


def _usual_height_m(bands: Sequence[Int[np.ndarray, " m"]], choices: Sequence[Choice]) -> float | None:
    known = [
        (choice.best.camera_height_m, len(band))
        for band, choice in zip(bands, choices, strict=True)
        if choice.best.seen and choice.confidence >= CERTAIN
    ]
    heights_m = [height_m for height_m, count in known for _ in range(count)]
    return float(np.median(heights_m)) if heights_m else None


def _floors(
    cameras_m: Float[np.ndarray, " k"], bands: Sequence[Int[np.ndarray, " m"]], choices: Sequence[Choice]
) -> tuple[FoundFloor, ...]:
    order = sorted(range(len(bands)), key=lambda index: choices[index].best.height_m)
    joined: list[list[int]] = []
    for index in order:
        height_m = choices[index].best.height_m
        if joined and height_m - choices[joined[-1][0]].best.height_m < SAME_M:
            joined[-1].append(index)
        else:
            joined.append([index])
    return tuple(_joined(cameras_m, [bands[i] for i in group], [choices[i] for i in group]) for group in joined)


def _joined(
    cameras_m: Float[np.ndarray, " k"], bands: Sequence[Int[np.ndarray, " m"]], choices: Sequence[Choice]
) -> FoundFloor:
    count = np.array([len(band) for band in bands])
    main = choices[int(count.argmax())]
    confidence = float(np.average([choice.confidence for choice in choices], weights=count))
    return FoundFloor(np.sort(cameras_m[np.concatenate(bands)]), main.best.height_m, confidence, main)


class GroundedRecording(Subset):
    """A whole recording whose frames know the up direction and where the floor is."""

    def __init__(self, whole: Recording, ground: Ground) -> None:
        super().__init__(whole, range(len(whole)))
        self.ground = ground

    def frame(self, index: int) -> Frame:
        """Read one frame and give it the ground."""
        return replace(self.whole.frame(index), ground=self.ground)

    @cached_property
    def fingerprint(self) -> str:
        """The recording's own: the ground follows from it."""
        return self.whole.fingerprint
