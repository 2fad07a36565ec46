"""From where a whole floor is seen: few places whose views together cover every area and every object."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from avlmaps_sim.free_space import STRUCTURE, FreeSpace
from avlmaps_sim.grid_kernels import sees
from avlmaps_sim.scene import Scene

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
    """The targets on a floor: things, and pieces of the floor.

    Attributes:
        low: (t, 2) lowest xy of the box round each.
        high: (t, 2) highest xy.
        nearest_m: (t,) from nearer than this the camera looks over it.
        worth: (t,) of seeing it.
        area: (t,) which area it is in, −1 for none: from another area it is not seen well enough.
    """

    low: Float[np.ndarray, "t 2"]
    high: Float[np.ndarray, "t 2"]
    nearest_m: Float[np.ndarray, " t"]
    worth: Float[np.ndarray, " t"]
    area: Int[np.ndarray, " t"]

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
    """Places to stand, and which targets each is for.

    Attributes:
        place: (k, 2) xy, metres.
        purpose: for each place the targets, by index.
    """

    place: Float[np.ndarray, "k 2"]
    purpose: tuple[Int[np.ndarray, " _"], ...]


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
