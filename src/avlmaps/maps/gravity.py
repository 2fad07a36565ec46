"""The up direction of a recording, and the floors under its cameras.

Floors, table tops and ceilings share one normal. A direction that many surfaces share is found by RANSAC over
surface normals; the camera decides which of a room's three directions is up: people and robots hold it nearly
level: its x axis is horizontal, however far it looks down, and its -y axis points upwards.

Frames become voxels in level axes (``patches``). Cameras are grouped by their height; for each group the level surfaces
below it are hypotheses of its floor. The floor is the lowest level that anything stands on, so that surfaces seen
**below** a level speak against it, unless the camera stood over it and nothing is seen under its own footprint, as on a
landing or a podium; its extent speaks for it; and cameras are seldom 2 m over the floor. That the floor is not in view
is a hypothesis, too. Each piece of evidence is a sum in nats; a softmax over the hypotheses gives their confidences.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, Int64
from msgspec import structs

from avlmaps.core.camera import Pinhole
from avlmaps.core.columns import concat, take
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import apply
from avlmaps.core.wording import option
from avlmaps.maps.types import FloorGuess, FloorInfo
from avlmaps.recordings.consistency.check import Finding, Grade, Reason
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Frame, Ground, Recording

STEP_PIXELS = 6  # of a picture 640 wide: normals are measured over twice this distance
MAX_DEPTH_M = 4.0  # beyond, a depth camera's noise tilts normals
MAX_JUMP = 0.05  # of the depth: a greater step between neighbours is an edge, not a surface
NORMALS_PER_FRAME = 800
CANDIDATES = 600
NEAR_RAD = np.deg2rad(8.0)
REFINED_RAD = np.deg2rad(4.0)
FEWEST_NORMALS = 200


@dataclass(frozen=True, slots=True)
class Up:
    """The up direction."""

    direction: Float[np.ndarray, "3"]  # unit vector in the world
    # share of the surface normals within 8 degrees of up or of down; below 0.05 the direction is a guess
    support: float


def find_up(frames: Iterable[Frame], rng: np.random.Generator) -> Up:
    """Find the direction that level surfaces share in some ten frames or more, spread over the recording.

    One frame after the other is held in memory; ``rng`` draws the normals.
    """
    normals: list[Float[np.ndarray, "n 3"]] = []
    rotations: list[Float[np.ndarray, "3 3"]] = []
    count = 0
    for frame in frames:
        rotation = np.asarray(frame.world_from_camera[:3, :3], np.float64)
        found = surface_normals(frame, rng)
        normals.append(found @ rotation.T)
        rotations.append(rotation)
        count += 1
    normal = np.concatenate(normals) if normals else np.zeros((0, 3))
    if len(normal) < FEWEST_NORMALS:
        raise RecordingError(
            f"The up direction cannot be found: {count} frames show {len(normal)} places with a smooth surface within "
            f"{MAX_DEPTH_M} m, and {FEWEST_NORMALS} are needed; write the recording's up direction into it."
        )
    direction = _refined(_most_shared(normal, np.stack(rotations), rng), normal)
    along: Bool[np.ndarray, " n"] = np.abs(normal @ direction) > np.cos(NEAR_RAD)
    return Up(direction, float(along.mean()))


def surface_normals(frame: Frame, rng: np.random.Generator) -> Float[np.ndarray, "n 3"]:
    """Return unit normals of smooth surfaces in the camera's frame, facing the camera; at most 800, drawn evenly."""
    step = max(1, round(STEP_PIXELS * frame.rig.depth.width / 640))
    depth = frame.depth_m.astype(np.float64)
    points = frame.rig.depth.backproject(np.where(np.isfinite(depth) & (depth < MAX_DEPTH_M), depth, 0.0))
    grid = points[::step, ::step]
    z = grid[..., 2]
    centre, left, right, above, below = z[1:-1, 1:-1], z[1:-1, :-2], z[1:-1, 2:], z[:-2, 1:-1], z[2:, 1:-1]
    smooth = centre > 0.0
    for neighbour in (left, right, above, below):
        smooth &= (neighbour > 0.0) & (np.abs(neighbour - centre) < MAX_JUMP * centre)
    across = grid[1:-1, 2:] - grid[1:-1, :-2]
    down = grid[2:, 1:-1] - grid[:-2, 1:-1]
    normal = np.cross(down[smooth], across[smooth])
    length = np.linalg.norm(normal, axis=1)
    normal = normal[length > 0.0] / length[length > 0.0, None]
    if len(normal) > NORMALS_PER_FRAME:
        normal = normal[rng.choice(len(normal), NORMALS_PER_FRAME, replace=False)]
    return normal


def _most_shared(
    normals: Float[np.ndarray, "n 3"], rotations: Float[np.ndarray, "k 3 3"], rng: np.random.Generator
) -> Float[np.ndarray, "3"]:
    candidates = normals[rng.integers(len(normals), size=CANDIDATES)]
    camera_x, camera_up = rotations[:, :, 0], -rotations[:, :, 1]
    candidates = np.where((candidates @ camera_up.mean(axis=0) < 0.0)[:, None], -candidates, candidates)
    votes = normals[rng.permutation(len(normals))[:10_000]]
    support = np.mean(np.abs(candidates @ votes.T) > np.cos(NEAR_RAD), axis=1)
    upright = np.clip(candidates @ camera_up.T, 0.0, 1.0).mean(axis=1)
    level = np.sqrt(np.clip(1.0 - np.square(candidates @ camera_x.T), 0.0, 1.0)).mean(axis=1)
    return candidates[np.argmax(support * upright**2 * level**4)]


def _refined(direction: Float[np.ndarray, "3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"]:
    for cone_rad in (NEAR_RAD, NEAR_RAD, REFINED_RAD, REFINED_RAD, REFINED_RAD):
        along = np.abs(normals @ direction)
        level, upright = normals[along > np.cos(cone_rad)], normals[along < np.sin(cone_rad)]
        main = np.linalg.eigh(level.T @ level - upright.T @ upright)[1][:, -1]
        direction = main if main @ direction > 0.0 else -main
    return direction / np.linalg.norm(direction)


_FRAMES = 16  # that show whether a direction is right
# Given and found directions closer than this are one; beside it, a slope or a tilted sensor explains the difference.
_APART_DEG = 20.0
# Planes count where so large a share of the surface agrees and the camera was held within this angle of them.
_LEAST_SUPPORT, _HELD_DEG, _UPSIDE_DEG = 0.1, 40.0, 160.0
# A walk is level: along what is up it spreads less than half as far as along what is not.
_FLATTER, _STILL_M = 0.5, 0.15
# Floors and the tops of furniture face up: where this many times as much level surface faces down, at its extremes and
# between them, and so many voxels at least, the camera hung upside down.
_OVERTURNED, _FEWEST_LEVEL, _BETWEEN_M = 4.0, 200, 0.25


def up_doubts(recording: Recording) -> tuple[Finding, ...]:
    """Return a finding where the up direction of a recording, given or found, is not that of what it shows, or nothing.

    A camera that is mounted on its side shows walls where floors are expected; then the walk decides: nobody walks
    up and down as far as along.
    """
    given, frames = recording.up_in_world, list(spread_frames(recording, _FRAMES))
    try:
        found = find_up(frames, np.random.default_rng(0))
    except RecordingError:  # too little smooth surface
        return ()
    held = -recording.world_from_camera[:, :3, 1].mean(axis=0)
    if found.support < _LEAST_SUPPORT or _angle_deg(held, found.direction) > _HELD_DEG:
        return ()
    is_overturned = _overturned(frames, found.direction)
    is_so, taken = -found.direction if is_overturned else found.direction, found.direction if given is None else given
    if (apart := _angle_deg(taken, is_so)) < _APART_DEG:
        return ()
    places = recording.world_from_camera[:, :3, 3]
    along_taken_m, along_found_m = (float(np.std(places @ up)) for up in (taken, is_so))
    is_level = max(along_taken_m, along_found_m) < _STILL_M or along_found_m < _FLATTER * along_taken_m
    if not is_level and apart < _UPSIDE_DEG:
        return ()
    why = "so was the camera held"
    if is_overturned:
        why = "the tops of furniture and the floor face that way; the camera looks mounted upside down"
    sentence = (
        f"Up is {'found' if given is None else 'given'} as {_words(taken)}, but {found.support:.0%} of the surface in "
        f"view is level along {_words(is_so)}, {apart:.0f} degrees away, and {why}."
    )
    up = f"up_in_world=({_words(is_so)})" if is_of_program(recording) else option("up", _words(is_so))
    other = "leave it if the camera hung upside down" if apart > _UPSIDE_DEG and not is_overturned else "fix the poses"
    return (Finding(Reason.UP, Grade.SUSPICIOUS, sentence, f"Give {up}, or {other}."),)


def _overturned(frames: Sequence[Frame], up: Float[np.ndarray, "3"]) -> bool:
    counts = list[Int[np.ndarray, "2"]]()
    for axis in (up, -up):
        sights = [sight_of(frame, axis) for frame in frames]
        height_m = Voxelised.union([sight.level for sight in sights]).height_m
        low_m, high_m = np.quantile(Voxelised.union([sight.surface for sight in sights]).height_m, (0.005, 0.995))
        between = (height_m > low_m + _BETWEEN_M) & (height_m < high_m - _BETWEEN_M)
        counts.append(np.array([len(height_m), between.sum()]))
    return bool((counts[1] > _OVERTURNED * counts[0]).all() and counts[1][0] >= _FEWEST_LEVEL)


def spread_frames(recording: Recording, count: int) -> Iterator[Frame]:
    """Read frames evenly spread over the recording; those that cannot be read are left out."""
    for index in np.unique(np.linspace(0, len(recording) - 1, count).round().astype(int)).tolist():
        with suppress(RecordingError):
            yield recording.frame(index)


def _words(up: Float[np.ndarray, "3"]) -> str:
    return ",".join(f"{value + 0.0:.2f}" for value in np.round(up, 2).tolist())  # + 0.0 turns -0.0 into 0.0


def _angle_deg(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> float:
    length = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(a @ b / max(length, 1e-12), -1.0, 1.0))))


COLUMNS = 107  # blocks across a picture
MAX_RANGE_M = 6.0  # beyond, a depth camera's error is as large as a step
LEVEL_RAD = np.deg2rad(18.0)  # how far a patch may lean and still count as level
CELL_M, SLICE_M = 0.1, 0.05  # a voxel of the evidence: its width, and its height along up
_FULL = 0.6  # a block counts when this share of its pixels has a depth,
_STEP = 0.15  # and when they differ by less than this share of it
_BITS = 20  # of a voxel's number, for each axis
_BIAS = 1 << (_BITS - 1)


@dataclass(frozen=True, slots=True)
class Voxelised:
    """Points gathered into voxels of 0.1 x 0.1 x 0.05 m, so that a place counts once however long it is looked at."""

    key: Int64[np.ndarray, " n"]  # rising number of each voxel
    count: Float[np.ndarray, " n"]  # how many points fell into it
    height_m: Float[np.ndarray, " n"]  # their mean height along up
    range_m: Float[np.ndarray, " n"]  # their mean depth

    @classmethod
    def of(cls, point_m: Float[np.ndarray, "n 3"], range_m: Float[np.ndarray, " n"]) -> "Voxelised":
        """Gather points, given in level axes."""
        index = np.floor(point_m / (CELL_M, CELL_M, SLICE_M)).astype(np.int64)
        index = np.clip(index + _BIAS, 0, (1 << _BITS) - 1)
        key = (index[:, 0] << 2 * _BITS) | (index[:, 1] << _BITS) | index[:, 2]
        return cls.union([cls(key, np.ones(len(key)), point_m[:, 2], range_m)])

    @classmethod
    def union(cls, parts: "Sequence[Voxelised]") -> "Voxelised":
        """Gather the voxels of several frames, at least one."""
        every = concat(parts)
        key, place = np.unique(every.key, return_inverse=True)
        count = np.bincount(place, every.count)
        height_m, range_m = (np.bincount(place, every.count * of) / count for of in (every.height_m, every.range_m))
        return cls(key, count, height_m, range_m)

    def __getitem__(self, chosen: Bool[np.ndarray, " n"]) -> "Voxelised":
        return take(self, chosen)

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


@dataclass(frozen=True, slots=True)
class Sight:
    """The surfaces of one frame, in level axes: x and y horizontal, the third along up; metres."""

    camera_m: Float[np.ndarray, "3"]  # where the camera was
    surface: Voxelised  # all that was seen
    level: Voxelised  # of it what is level and faces up


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
    """The surfaces round a camera height."""

    camera_m: float  # of the cameras, along up
    surface: Voxelised  # all that was seen by cameras of about that height
    level: Voxelised  # level surfaces that face up, seen by them
    under_m: Float[np.ndarray, " k"]  # of what each camera at this height stood over; NaN where that was not seen


@dataclass(frozen=True, slots=True)
class Expected:
    """A user's or a robot's hint about the floor."""

    floor_m: float  # along up
    camera_height_m: float  # over it
    exact: bool = True  # whether the floor lies there, or only not above it


Weighed = tuple[float, FloorGuess]
"""A hypothesis with all that speaks for and against it as one sum, nats; its confidence is not known yet."""


def choose_floor(
    view: SurfacesAtHeight, expected: Expected | None = None, usual_m: float | None = None
) -> tuple[FloorGuess, FloorGuess | None]:
    """Return the floor under the cameras of a view, and the best hypothesis at another height, if there is one.

    The confidence of a floor out of view is 0.5 at most.
    """
    found = [weigh(view, height_m, expected, usual_m) for height_m in hypotheses(view)]
    found = sorted([*found, out_of_view(view, expected)], key=lambda one: -one[0])
    weight = np.exp(np.array([nats for nats, _ in found]) - found[0][0])
    weight /= weight.sum()
    if expected is None or not expected.exact:
        weight *= np.array([1.0 if guess.in_view else _GUESSED for _, guess in found])
    height_m = np.array([guess.height_m for _, guess in found])
    rest, chosen = np.ones(len(found), bool), list[FloorGuess]()
    while rest.any() and len(chosen) < 2:
        best = int(rest.argmax())
        near = rest & (np.abs(height_m - height_m[best]) < SAME_M)
        chosen.append(structs.replace(found[best][1], confidence=float(weight[near].sum())))
        rest &= ~near
    return chosen[0], chosen[1] if len(chosen) > 1 else None


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
) -> Weighed:
    """Return the evidence for a floor at a height where level surface was seen."""
    at = np.abs(view.level.height_m - height_m) < 2.5 * _BIN_M
    off = (view.level.height_m[at] - height_m) / _BLUR_M
    support = float(np.exp(-0.5 * off**2).sum())
    below, beneath = _below(view, height_m)
    known = view.under_m[np.isfinite(view.under_m)]
    stood = float(np.mean(np.abs(known - height_m) < SAME_M)) if len(known) else 0.0
    level_m2 = len(np.unique(view.level[at].columns())) * CELL_M**2
    usual = usual_m is not None and abs(np.log((view.camera_m - height_m) / usual_m)) < _USUAL
    trusted = stood >= _MOST_STOOD and (level_m2 >= _LARGE_M2 or usual)
    given = expected is not None and expected.exact
    prior = 0.0 if trusted and usual and not given else prior_nats(height_m, view.camera_m, expected)
    against = min(_undercut(view.level[at], beneath) if trusted else below, _MOST_BELOW)
    nats = np.log(support / (support + _FEW)) + 0.7 * np.log1p(support / _MANY) - _BELOW_NATS * against
    return float(nats + _STOOD_NATS * trusted + prior), _guess(view, height_m, level_m2, below, seen=True)


def out_of_view(view: SurfacesAtHeight, expected: Expected | None = None) -> Weighed:
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
    return nats, _guess(view, height_m, 0.0, _below(view, height_m)[0], seen=False)


def _guess(view: SurfacesAtHeight, height_m: float, level_m2: float, below: float, *, seen: bool) -> FloorGuess:
    return FloorGuess(
        height_m=height_m, camera_height_m=view.camera_m - height_m, confidence=0.0, in_view=seen,
        level_m2=round(level_m2, 2), below=round(below, 4),
    )  # fmt: skip


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


def _below(view: SurfacesAtHeight, height_m: float) -> tuple[float, Voxelised]:
    window = view.surface[view.surface.height_m > view.camera_m - DEEPEST_M]
    deep_m = height_m - window.height_m - _BELOW_M - _BELOW_PER_M * window.range_m
    return float(np.clip(deep_m / _DEEP_M, 0.0, 1.0).mean()) if len(window) else 0.0, window[deep_m > 0.0]


def _undercut(level: Voxelised, beneath: Voxelised) -> float:
    """Return the share of a level's own footprint, without its rim, under which surface was seen: that of a table."""
    column = level.columns()
    beside = [np.isin(column + step, column) for step in (1 << _BITS, -(1 << _BITS), 1, -1)]
    inner = np.unique(column[np.all(beside, axis=0)])
    return float(np.isin(inner, beneath.columns()).mean()) if len(inner) else 0.0


def stood_over(camera_m: Float[np.ndarray, "k 3"], level: Voxelised) -> Float[np.ndarray, " k"]:
    """Return the height along up of the level surface that each camera stood over; NaN where none was seen.

    Cameras are in level axes; ``level`` is what any frame saw.
    """
    middle_m = level.middles_m()
    under = np.full(len(camera_m), np.nan)
    for index, (x, y, height_m) in enumerate(camera_m):
        close = np.hypot(middle_m[:, 0] - x, middle_m[:, 1] - y) < _REACH_M
        drop_m = height_m - level.height_m[close]
        there = level.height_m[close][(drop_m > HIGHEST_M) & (drop_m < DEEPEST_M)]
        if len(there) >= _FEWEST_UNDER:
            near: Sequence[int] = (np.abs(there[:, None] - there[None]) < 0.06).sum(axis=1).tolist()
            under[index] = max(zip(near, there.tolist(), strict=True))[1]
    return under


_BAND_M = 0.12  # cameras of one group differ in height by no more than this
_STOREY_M = 0.6  # a camera's view counts for others whose height differs by no more than this


@dataclass(frozen=True, slots=True)
class FoundGround:
    """The floors of a recording, and their confidence."""

    ground: Ground  # for the height of each camera the floor under it
    floors: tuple[FloorInfo, ...]  # each of them once, lowest first


def find_ground(
    frames: Iterable[Frame], up_in_world: Float[np.ndarray, "3"], start: Expected | None = None
) -> FoundGround:
    """Find the floors that the cameras of frames, spread over a recording, stood over.

    One frame after the other is held in memory. ``start`` is the floor that someone gave for the start of the
    recording.
    """
    up = np.asarray(up_in_world, np.float64)
    return ground_of_sights([sight_of(frame, up) for frame in frames], up, start)


def ground_of_sights(
    sights: Sequence[Sight], up_in_world: Float[np.ndarray, "3"], start: Expected | None = None
) -> FoundGround:
    """Find the floors from what frames show; see ``find_ground``."""
    nothing = Voxelised.of(np.zeros((0, 3)), np.zeros(0))
    sights = sorted(sights or [Sight(np.zeros(3), nothing, nothing)], key=lambda sight: float(sight.camera_m[2]))
    cameras_m = np.array([sight.camera_m[2] for sight in sights])
    everywhere = Voxelised.union([sight.level for sight in sights])
    under_m = stood_over(np.stack([sight.camera_m for sight in sights]), everywhere)
    bands = list(_bands(cameras_m))
    views = [_view(sights, cameras_m, under_m, band) for band in bands]
    sure_m = [
        guess.camera_height_m
        for guess, band in ((choose_floor(view, start)[0], band) for view, band in zip(views, bands, strict=True))
        if guess.in_view and guess.confidence >= CERTAIN
        for _ in band
    ]
    usual_m = float(np.median(sure_m)) if sure_m else None
    choices = [choose_floor(view, start, usual_m) for view in views]
    floor_m = np.repeat([best.height_m for best, _ in choices], [len(band) for band in bands])
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


def _floors(
    cameras_m: Float[np.ndarray, " k"],
    bands: Sequence[Int[np.ndarray, " m"]],
    choices: Sequence[tuple[FloorGuess, FloorGuess | None]],
) -> tuple[FloorInfo, ...]:
    joined: list[list[int]] = []
    for index in sorted(range(len(bands)), key=lambda index: choices[index][0].height_m):
        same = joined and choices[index][0].height_m - choices[joined[-1][0]][0].height_m < SAME_M
        joined = [*joined[:-1], [*joined[-1], index]] if same else [*joined, [index]]
    floors: list[FloorInfo] = []
    for group in joined:
        count = [len(bands[index]) for index in group]
        (best, second), cameras = choices[group[int(np.argmax(count))]], sum(count)
        middle_m = float(np.median(cameras_m[np.concatenate([bands[index] for index in group])]))
        confidence = float(np.average([choices[index][0].confidence for index in group], weights=count))
        best, *others = (
            structs.replace(
                guess, height_m=round(guess.height_m, 4), camera_height_m=round(middle_m - guess.height_m, 4),
                confidence=round(sure, 4),
            )
            for guess, sure in ((best, confidence), *(() if second is None else ((second, second.confidence),)))
        )  # fmt: skip
        share = cameras / len(cameras_m)
        floors.append(FloorInfo(best=best, runner_up=others[0] if others else None, cameras=share))
    return tuple(floors)
