"""A path through a floor, or up the stairs through all, that shows a robot everything: poses at the frame rate."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import sparse
from scipy.sparse import csgraph

from avlmaps_sim.driving import Tour, WalkSettings, drive
from avlmaps_sim.free_space import STRUCTURE, FreeSpace, floor_cells, floor_heights, free_space, occupied, reaching_part
from avlmaps_sim.grid_kernels import mark_slab, relax, sees
from avlmaps_sim.scene import Scene
from avlmaps_sim.views import camera_poses, random_views

_CANDIDATE_M = 0.5  # places to stand are tried on a grid this wide
_FLOOR_M = 0.8  # and floor to be seen on this one
_OBJECT_M = 0.25  # things smaller than this are not gone to by themselves
_BOX_GROWN_M = 0.05  # a ray that comes this near to a thing's box shows it
_TWICE_M = 1.2  # a thing is seen from two places at least this far apart, where that can be
_LOWEST_RAD = np.deg2rad(30.0)  # how far below the horizon the camera sees
_NEAREST_M = 0.5  # from nearer than this nothing is seen as a whole
_MIDST_M = 0.5  # this much farther than the free place nearest to its middle one is still in the midst of an area
_AREA, _OBJECT, _FLOOR = 3.0, 1.0, 0.25  # value of entering an area, an object and a piece of floor
_AGAIN = 0.3  # value of seeing a thing from a second place, as a share of the first
_LEAST_GAIN = 0.9  # a place that adds less is not gone to


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """The targets on a floor: things, and pieces of the floor."""

    low: Float[np.ndarray, "t 2"]  # (t, 2) lowest xy of the box round each
    high: Float[np.ndarray, "t 2"]  # (t, 2) highest xy
    nearest_m: Float[np.ndarray, " t"]  # (t,) from nearer than this the camera looks over it
    worth: Float[np.ndarray, " t"]  # (t,) of seeing it
    area: Int[np.ndarray, " t"]  # (t,) which area it is in, −1 for none: from another area it is not seen well enough

    @property
    def middle(self) -> Float[np.ndarray, "t 2"]:
        """Middle of each."""
        return (self.low + self.high) / 2

    def in_sight(
        self, places: Float[np.ndarray, "e 2"], reach_m: float, opaque: np.ndarray, space: FreeSpace
    ) -> Bool[np.ndarray, "e t"]:
        """Return which targets are within reach of which places with nothing opaque between."""
        seen = sees(np.ascontiguousarray(places), self.low, self.high, reach_m, opaque, space.origin, space.cell_m)
        far = np.linalg.norm(places[:, None] - self.middle, axis=2) > self.nearest_m
        # A target that can only be seen from nearby, in a narrow room, is seen from there.
        return seen & (far | ~np.any(seen & far, axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoints:
    """Places to stand, and which targets each is for."""

    place: Float[np.ndarray, "k 2"]  # (k, 2) xy, metres
    purpose: tuple[Int[np.ndarray, " _"], ...]  # for each place the targets, by index


def viewpoints(
    scene: Scene, space: FreeSpace, targets: Targets, opaque: Bool[np.ndarray, "nx ny"], reach_m: float
) -> Viewpoints:
    """Choose places greedily until all is seen that can be seen from within reach; things from two places.

    A look does not pass the cells that are ``opaque``.
    """
    candidates = _candidates(space)
    seen = targets.in_sight(candidates, reach_m, opaque, space)
    same = (targets.area < 0) | (targets.area == areas_at(scene, space, candidates)[:, None])
    seen &= same | ~np.any(seen & same, axis=0)
    entered = _entered(scene, space, candidates)
    covers = np.column_stack([seen, *entered])
    wanted = np.concatenate([np.where(targets.worth >= _OBJECT, 2, 1), np.ones(len(entered), int)])
    worth = np.append(targets.worth, np.full(len(entered), _AREA))
    chosen, news = _greedy(candidates, covers, wanted, worth, _comfort(space, candidates))
    return Viewpoints(candidates[chosen], tuple(_turned_to(new[: len(targets.low)], targets) for new in news))


def _turned_to(new: Bool[np.ndarray, " t"], targets: Targets) -> Int[np.ndarray, " m"]:
    things = np.flatnonzero(new & (targets.worth >= _OBJECT))
    return things if len(things) else np.flatnonzero(new)


def _candidates(space: FreeSpace) -> Float[np.ndarray, "c 2"]:
    cells = np.argwhere(space.free)
    square = np.floor(cells * space.cell_m / _CANDIDATE_M).astype(np.int64)
    order = np.lexsort((-space.clearance_m[space.free], square[:, 1], square[:, 0]))
    _, first = np.unique(square[order], axis=0, return_index=True)
    return space.middle_of(cells[order[first]])


def areas_at(scene: Scene, space: FreeSpace, xy: Float[np.ndarray, "n 2"]) -> Int[np.ndarray, " n"]:
    """Return which area of a floor holds each place, −1 for none."""
    found = np.full(len(xy), -1, np.int64)
    for index, area in enumerate(scene.areas):
        if abs(area.floor_m - space.floor_m) < 1.0:
            found[(found < 0) & area.contains(xy)] = index
    return found


def _entered(scene: Scene, space: FreeSpace, candidates: Float[np.ndarray, "c 2"]) -> list[np.ndarray]:
    free = space.middles()
    owner, of_candidate = areas_at(scene, space, free), areas_at(scene, space, candidates)
    entered = []
    for index in np.unique(of_candidate[of_candidate >= 0]):
        away = np.linalg.norm(candidates - free[owner == index].mean(axis=0), axis=1)
        away[of_candidate != index] = np.inf
        entered.append(away <= away.min() + _MIDST_M)
    return entered


def targets_of(scene: Scene, space: FreeSpace, eye_m: float) -> Targets:
    """Return the targets on a floor for a camera at a height above it."""
    things = [
        thing for thing in scene.objects
        if thing.category not in STRUCTURE and max(thing.size) >= _OBJECT_M
        and -0.5 < thing.low[2] - space.floor_m < 2.5
    ]  # fmt: skip
    low = np.array([thing.low[:2] for thing in things]).reshape(-1, 2) - _BOX_GROWN_M
    high = np.array([thing.high[:2] for thing in things]).reshape(-1, 2) + _BOX_GROWN_M
    below_eye = space.floor_m + eye_m - np.array([thing.centre[2] for thing in things])
    stride = max(round(_FLOOR_M / space.cell_m), 1)
    piece = np.zeros_like(space.free)
    piece[::stride, ::stride] = True
    floor = space.middle_of(np.argwhere(space.free & piece))
    nearest_m = np.maximum(np.append(below_eye / np.tan(_LOWEST_RAD), np.zeros(len(floor))), _NEAREST_M)
    worth = np.concatenate([np.full(len(low), _OBJECT), np.full(len(floor), _FLOOR)])
    area = np.concatenate([np.array([thing.area for thing in things], np.int64), areas_at(scene, space, floor)])
    return Targets(np.concatenate([low, floor - 0.1]), np.concatenate([high, floor + 0.1]), nearest_m, worth, area)


def _comfort(space: FreeSpace, candidates: np.ndarray) -> np.ndarray:
    i, j = space.cell_of(candidates).T
    return 1.0 + 0.2 * np.minimum(space.clearance_m[i, j], 0.8)


def _greedy(
    places: Float[np.ndarray, "c 2"],
    covers: Bool[np.ndarray, "c t"],
    wanted: Int[np.ndarray, " t"],
    worth: Float[np.ndarray, " t"],
    comfort: Float[np.ndarray, " c"],
) -> tuple[list[int], list[np.ndarray]]:
    """Take the place that adds most, again and again; say what each added.

    ``covers`` says which targets each place shows, ``wanted`` from how many places each should be seen.
    """
    covers = covers.copy()
    left = wanted * np.any(covers, axis=0)
    chosen, news = [], []
    while True:
        gain = (covers @ (worth * np.where(left == wanted, 1.0, _AGAIN) * (left > 0))) * comfort
        best = int(np.argmax(gain.round(9)))  # a matrix product may round otherwise the next time, and ties are many
        if gain[best] < _LEAST_GAIN and chosen:
            return chosen, news
        new = covers[best] & (left > 0)
        chosen.append(best)
        news.append(new)
        left[new] -= 1
        # A target seen from here adds nothing from close by.
        close = np.linalg.norm(places - places[best], axis=1) < _TWICE_M
        covers[np.ix_(close, new)] = False


_LAYER_M = 0.05  # surfaces of the stairs are sorted by height into layers of this
_RISE_M = 0.26  # a foot is lifted no higher
_KNEE_M = 0.5  # what is higher over a step stands beside the walker, not under the next foot
_AROUND_M = 1.0  # of each floor that belongs to the stairs
_RADIUS_M = 0.2  # of who climbs: stairs are narrower than rooms
_UP = 0.8  # the upward part of the normal of what can be stepped on
_SMOOTH = 9  # points of the path over which it is evened
_STEPS = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])


def climb(scene: Scene, below: FreeSpace, above: FreeSpace, height_m: float) -> Float[np.ndarray, "n 3"] | None:
    """Return the path up the stairs of a scene, its first point on the lower floor and its last on the upper one.

    Only what is named stairs is climbed; both floors are on grids with the same cells.

    Returns:
        Points a few centimetres apart, the height of the feet as z; None where no stairs lead up.
    """
    mesh = scene.mesh
    named = np.array([thing.category == "stairs" for thing in scene.objects], bool)
    own = named[scene.instance] & (mesh.normals()[:, 2] > _UP)
    corners = mesh.corners().astype(np.float64)
    if not own.any():
        return None
    cell_m = below.cell_m
    low = np.floor((corners[own][..., :2].min(axis=(0, 1)) - _AROUND_M - below.origin) / cell_m).astype(np.int64)
    high = np.ceil((corners[own][..., :2].max(axis=(0, 1)) + _AROUND_M - below.origin) / cell_m).astype(np.int64)
    low, high = np.maximum(low, 0), np.minimum(high, below.free.shape)
    window = (slice(low[0], high[0]), slice(low[1], high[1]))
    origin = below.origin + low * cell_m
    outer = below.origin + high * cell_m
    near = ((corners[..., :2].max(axis=1) >= origin) & (corners[..., :2].min(axis=1) <= outer)).all(axis=1)
    around, treads = corners[near], corners[own]
    shape = below.free[window].shape

    def clear(top_m: float) -> Bool[np.ndarray, "nx ny"]:
        blocked = np.zeros(shape, np.bool_)
        mark_slab(around, top_m + _KNEE_M, top_m + height_m, origin, cell_m, blocked)
        away = cv2.distanceTransform((~blocked).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return away * cell_m >= _RADIUS_M

    def floor(space: FreeSpace) -> Bool[np.ndarray, "nx ny"]:
        """The floor where a robot stands, and up to the steps themselves: a foot comes nearer to them than a base."""
        return space.free[window] | (floor_cells(scene, space.floor_m, origin, shape, cell_m) & clear(space.floor_m))

    heights, layers = [below.floor_m], [floor(below)]
    for at in np.arange(below.floor_m + 0.5 * _LAYER_M, above.floor_m - 0.5 * _LAYER_M, _LAYER_M).tolist():
        tread = np.zeros(shape, np.bool_)
        mark_slab(treads, at, at + _LAYER_M, origin, cell_m, tread)
        if tread.any():
            heights.append(at + 0.5 * _LAYER_M)
            layers.append(tread & clear(heights[-1]))
    heights.append(above.floor_m)
    layers.append(floor(above))
    ends = below.free[window], above.free[window]
    nodes = _cheapest(np.array(heights), np.array(layers), ends, cell_m)
    if nodes is None:
        return None
    points = np.column_stack([origin + (nodes[:, 1:] + 0.5) * cell_m, np.array(heights)[nodes[:, 0]]])
    return _evened(points)


def _cheapest(
    heights: Float[np.ndarray, " k"],
    layers: Bool[np.ndarray, "k nx ny"],
    ends: tuple[Bool[np.ndarray, "nx ny"], Bool[np.ndarray, "nx ny"]],
    cell_m: float,
) -> Int[np.ndarray, "n 3"] | None:
    """Return the nodes (layer, i, j) of the shortest path from cells of the lowest layer to cells of the highest."""
    number = np.full(layers.shape, -1, np.int64)
    cells = np.argwhere(layers)
    number[layers] = np.arange(len(cells))
    room = [cv2.distanceTransform(np.pad(one, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1] for one in layers]
    dear = 1.0 + np.exp(-np.stack(room)[layers] * cell_m / 0.15)  # the middle of a flight is cheaper than its edge
    rows, columns, weights = [], [], []
    nx, ny = layers.shape[1:]
    for step in _STEPS:
        i, j = (cells[:, 1:] + step).T
        inside = (i >= 0) & (j >= 0) & (i < nx) & (j < ny)
        for layer, height in enumerate(heights):
            at = np.flatnonzero(inside & (np.abs(heights[cells[:, 0]] - height) <= _RISE_M))
            other = number[layer, i[at], j[at]]
            at, other = at[other >= 0], other[other >= 0]
            length = np.hypot(cell_m * np.hypot(*step), heights[cells[at, 0]] - height)
            rows.append(at)
            columns.append(other)
            weights.append(length * 0.5 * (dear[at] + dear[other]) + 1e-9)
    count = len(cells)
    row, column, weight = np.concatenate(rows), np.concatenate(columns), np.concatenate(weights)
    first = np.flatnonzero((cells[:, 0] == 0) & ends[0][tuple(cells[:, 1:].T)])
    last = np.flatnonzero((cells[:, 0] == len(heights) - 1) & ends[1][tuple(cells[:, 1:].T)])
    if not len(first) or not len(last):
        return None
    # From one node more there is a step to every place of the lower floor.
    row, column = np.append(row, np.full(len(first), count)), np.append(column, first)
    values = np.append(weight, np.full(len(first), 1e-6))
    graph = sparse.csr_matrix((values, (row, column)), shape=(count + 1, count + 1))
    cost, before = csgraph.dijkstra(graph, indices=count, return_predecessors=True)
    if not np.isfinite(cost[last]).any():
        return None
    nodes = [int(last[np.argmin(cost[last])])]
    while before[nodes[-1]] != count:
        nodes.append(int(before[nodes[-1]]))
    return cells[nodes[::-1]]


def _evened(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    half = _SMOOTH // 2
    padded = np.concatenate([np.repeat(points[:1], half, axis=0), points, np.repeat(points[-1:], half, axis=0)])
    even = np.stack([np.convolve(column, np.ones(_SMOOTH) / _SMOOTH, "valid") for column in padded.T], axis=1)
    even[0], even[-1] = points[0], points[-1]
    return even


__all__ = ["WalkSettings", "random_views", "walk_through"]

_SMOOTHING = 150  # rounds of pulling the path straight
_STAIRS_DOWN_RAD = np.deg2rad(12.0)  # on stairs a walker looks at the next steps
_AHEAD_M = 0.5  # and turns to where it will be after this


def walk_through(
    scene: Scene, rng: np.random.Generator, settings: WalkSettings | None = None
) -> Float[np.ndarray, "n 4 4"]:
    """Return the poses ``world_from_camera`` of a walk that sees every area and object of a floor, or of all of them.

    ``ValueError``: the scene has no floor to stand on.
    """
    settings = settings or WalkSettings()
    eye_m = float(rng.uniform(*settings.camera_height_m))
    space = free_space(scene, settings.radius_m, eye_m + 0.15, floor=settings.floor)
    if not space.free.any():
        raise ValueError(f"no place on the floor of {scene.name} is free for a robot of {settings.radius_m} m radius")
    floors, stairs = joined_floors(scene, space, settings, eye_m)
    place, heading, pitch, foot_m = [], [], [], []
    for number, on in enumerate(floors):
        first = stairs[number - 1][-1, :2] if number else None
        last = stairs[number][0, :2] if number < len(stairs) else None
        tour = _tour(scene, on, settings, eye_m, rng, first, last)
        along, looks = drive(tour, settings, rng, float(heading[-1][-1]) if heading else None)
        place.append(along)
        heading.append(looks)
        pitch.append(np.zeros(len(along)))
        foot_m.append(np.full(len(along), on.floor_m))
        if last is not None:
            along, looks = _climbed(stairs[number], float(looks[-1]), settings)
            place.append(along[:, :2])
            heading.append(looks)
            pitch.append(np.full(len(along), -_STAIRS_DOWN_RAD))
            foot_m.append(along[:, 2])
    walked = [np.concatenate(parts) for parts in (place, heading, pitch, foot_m)]
    if settings.max_frames is not None and len(walked[0]) > settings.max_frames:
        keep = np.linspace(0, len(walked[0]) - 1, settings.max_frames).round().astype(int)
        walked = [part[keep] for part in walked]
    return _poses(walked[0], walked[1], walked[2], walked[3] + eye_m, settings, rng)


def joined_floors(
    scene: Scene, space: FreeSpace, settings: WalkSettings, eye_m: float
) -> tuple[list[FreeSpace], list[Float[np.ndarray, "n 3"]]]:
    """Return the floors that a walk goes through, lowest first, and the stairs from each to the next."""
    heights = floor_heights(scene) if settings.every_floor else ()
    floors, stairs = [reaching_part(scene, space)], []
    if len(heights) < 2:
        return floors, stairs
    main = int(np.argmin(np.abs(np.array(heights) - space.floor_m)))
    for numbers, up in ((range(main + 1, len(heights)), True), (range(main - 1, -1, -1), False)):
        for number in numbers:
            other = free_space(scene, settings.radius_m, eye_m + 0.15, floor=number)
            if not other.free.any():
                break
            other = reaching_part(scene, other)
            pair = (floors[-1], other) if up else (other, floors[0])
            path = climb(scene, *pair, eye_m + 0.2)
            if path is None:
                break
            at = len(floors) if up else 0
            floors.insert(at, other)
            stairs.insert(len(stairs) if up else 0, path)
    return floors, stairs


def _climbed(
    path: Float[np.ndarray, "n 3"], heading_rad: float, settings: WalkSettings
) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, " m"]]:
    """Return where the feet are on stairs at every tick, and the heading, which turns no faster than the robot does."""
    along_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    at_m = np.arange(0.0, along_m[-1], settings.stairs_m_s / settings.rate_hz)
    feet, ahead = (
        np.stack([np.interp(metres, along_m, column) for column in path.T], axis=1)
        for metres in (at_m, np.minimum(at_m + _AHEAD_M, along_m[-1]))
    )
    ahead[at_m + 0.1 > along_m[-1]] = 2 * path[-1] - path[-3]
    wanted = np.arctan2(*(ahead - feet)[:, 1::-1].T)
    most = settings.turn_rad_s / settings.rate_hz
    heading = np.empty(len(wanted))
    for tick, goal in enumerate(wanted.tolist()):
        left = (goal - heading_rad + np.pi) % (2 * np.pi) - np.pi
        heading_rad += float(np.clip(left, -most, most))
        heading[tick] = heading_rad
    return feet, heading


def _tour(
    scene: Scene,
    space: FreeSpace,
    settings: WalkSettings,
    eye_m: float,
    rng: np.random.Generator,
    first: Float[np.ndarray, "2"] | None = None,
    last: Float[np.ndarray, "2"] | None = None,
) -> Tour:
    """Order the viewpoints, join them and pull the path smooth; all its points stay free.

    With a first or last place the tour begins or ends there.
    """
    targets = targets_of(scene, space, eye_m)
    opaque = occupied(scene, space, eye_m - 0.15, eye_m + 0.15)
    views = viewpoints(scene, space, targets, opaque, settings.reach_m)
    ends = [space.nearest(place) for place in (first, last) if place is not None]
    places = np.concatenate([views.place, np.array(ends).reshape(-1, 2)])
    purpose = (*views.purpose, *(np.zeros(0, np.int64) for _ in ends))
    cost, before = space.paths(places)
    count = len(views.place)
    order = _order(cost[:count, :count], rng)
    if first is not None:
        order = [count, *(order[::-1] if cost[count, order[-1]] < cost[count, order[0]] else order)]
    elif last is not None and cost[order[0], count] < cost[order[-1], count]:
        order = order[::-1]
    order += [] if last is None else [len(places) - 1]
    legs = [places[order[:1]]]
    legs += [space.path(before[a], places[b])[1:] for a, b in pairwise(order)]
    path = np.concatenate(legs)
    stop = np.cumsum([len(leg) for leg in legs]) - 1
    relax(path, space.free, space.origin, space.cell_m, _SMOOTHING)
    in_sight = targets.in_sight(path, settings.reach_m, opaque, space)
    return Tour(path, stop, tuple(purpose[k] for k in order), targets.middle, in_sight)


def _order(cost: Float[np.ndarray, "k k"], rng: np.random.Generator) -> list[int]:
    count = len(cost)
    starts = rng.permutation(count)[:8]
    tours = [_improved(_nearest_neighbour(cost, int(start)), cost) for start in starts]
    return min(tours, key=lambda tour: round(float(cost[tour[:-1], tour[1:]].sum()), 9))


def _nearest_neighbour(cost: np.ndarray, start: int) -> list[int]:
    tour, left = [start], set(range(len(cost))) - {start}
    while left:
        tour.append(min(left, key=lambda k: (cost[tour[-1], k], k)))
        left.remove(tour[-1])
    return tour


def _improved(tour: list[int], cost: np.ndarray) -> list[int]:
    better = True
    while better:
        better = False
        for i in range(len(tour) - 1):
            for j in range(i + 1, len(tour)):
                longer = 0.0
                if i:
                    longer += cost[tour[i - 1], tour[j]] - cost[tour[i - 1], tour[i]]
                if j + 1 < len(tour):
                    longer += cost[tour[i], tour[j + 1]] - cost[tour[j], tour[j + 1]]
                if longer < -1e-9:
                    tour[i : j + 1] = tour[i : j + 1][::-1]
                    better = True
    return tour


def _poses(
    place: np.ndarray,
    heading: np.ndarray,
    pitch_rad: np.ndarray,
    height_m: np.ndarray,
    settings: WalkSettings,
    rng: np.random.Generator,
) -> Float[np.ndarray, "n 4 4"]:
    seconds = np.arange(len(place)) / settings.rate_hz
    sway = [np.sin(2 * np.pi * seconds / rng.uniform(4, 12) + rng.uniform(0, 2 * np.pi)) for _ in range(3)]
    pitch = pitch_rad - settings.pitch_down_rad + settings.pitch_sway_rad * sway[0]
    position = np.column_stack([place, height_m + 0.005 * sway[1]])
    return camera_poses(position, heading, pitch, np.deg2rad(0.5) * sway[2])
