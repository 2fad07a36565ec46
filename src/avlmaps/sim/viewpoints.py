"""From where a whole floor is seen: few places whose views together cover every area and every object."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.sim.free_space import STRUCTURE, FreeSpace, occupied
from avlmaps.sim.grid_kernels import sees
from avlmaps.sim.scene import Scene

_CANDIDATE_M = 0.5  # places to stand are tried on a grid this wide
_FLOOR_M = 0.8  # and floor to be seen on this one
_OBJECT_M = 0.25  # things smaller than this are not gone to by themselves
_BOX_GROWN_M = 0.05  # a ray that comes this near to a thing's box shows it
_AREA, _OBJECT, _FLOOR = 3.0, 1.0, 0.3  # what entering an area, an object and a piece of floor are worth


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoints:
    """Places to stand, and in which directions there is what is seen from there and was not seen before.

    Attributes:
        place: (k, 2) xy, metres.
        headings_rad: for each place the directions of what it is for.
    """

    place: Float[np.ndarray, "k 2"]
    headings_rad: tuple[Float[np.ndarray, " m"], ...]


def viewpoints(scene: Scene, space: FreeSpace, reach_m: float, eye_m: float) -> Viewpoints:
    """Choose places greedily until all is seen that can be seen from within reach.

    Args:
        scene: what there is to see.
        space: where the robot can stand; one connected part.
        reach_m: from how far a thing counts as seen.
        eye_m: height of the camera above the floor.
    """
    candidates = _candidates(space)
    low, high, worth = _targets(scene, space)
    opaque = occupied(scene, space, eye_m - 0.15, eye_m + 0.15)
    seen = sees(candidates, low, high, reach_m, opaque, space.origin, space.cell_m)
    entered = [area.contains(candidates) for area in scene.areas if abs(area.floor_m - space.floor_m) < 1.0]
    covers = np.column_stack([seen, *entered]) if entered else seen
    chosen, news = _greedy(covers, np.append(worth, np.full(len(entered), _AREA)), _comfort(space, candidates))
    middle = (low + high) / 2
    headings = []
    for place, new in zip(candidates[chosen], news, strict=True):
        offset = middle[new[: len(low)]] - place
        headings.append(np.arctan2(offset[:, 1], offset[:, 0]))
    return Viewpoints(candidates[chosen], tuple(headings))


def _candidates(space: FreeSpace) -> Float[np.ndarray, "c 2"]:
    """Return the roomiest free place of every square of the candidates' grid."""
    cells = np.argwhere(space.free)
    square = np.floor(cells * space.cell_m / _CANDIDATE_M).astype(np.int64)
    order = np.lexsort((-space.clearance_m[space.free], square[:, 1], square[:, 0]))
    _, first = np.unique(square[order], axis=0, return_index=True)
    return space.middle_of(cells[order[first]])


def _targets(scene: Scene, space: FreeSpace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the boxes (lowest and highest xy corners) of what is to be seen, and what each is worth."""
    things = [
        thing for thing in scene.objects
        if thing.category not in STRUCTURE and max(thing.size) >= _OBJECT_M
        and -0.5 < thing.low[2] - space.floor_m < 2.5
    ]  # fmt: skip
    low = np.array([thing.low[:2] for thing in things]).reshape(-1, 2) - _BOX_GROWN_M
    high = np.array([thing.high[:2] for thing in things]).reshape(-1, 2) + _BOX_GROWN_M
    stride = max(round(_FLOOR_M / space.cell_m), 1)
    piece = np.zeros_like(space.free)
    piece[::stride, ::stride] = True
    floor = space.middle_of(np.argwhere(space.free & piece))
    worth = np.concatenate([np.full(len(low), _OBJECT), np.full(len(floor), _FLOOR)])
    return np.concatenate([low, floor - 0.1]), np.concatenate([high, floor + 0.1]), worth


def _comfort(space: FreeSpace, candidates: np.ndarray) -> np.ndarray:
    """Return how well one stands at each place: a little better where there is room around."""
    i, j = space.cell_of(candidates).T
    return 1.0 + 0.2 * np.minimum(space.clearance_m[i, j], 0.8)


def _greedy(
    covers: Bool[np.ndarray, "c t"], worth: Float[np.ndarray, " t"], comfort: Float[np.ndarray, " c"]
) -> tuple[list[int], list[np.ndarray]]:
    """Take the place that adds most until none adds an object or three pieces of floor; say what each added."""
    left = np.any(covers, axis=0)
    chosen, news = [], []
    while True:
        gain = (covers[:, left] @ worth[left]) * comfort
        best = int(np.argmax(gain))
        if gain[best] < 0.85:
            return chosen, news
        new = covers[best] & left
        chosen.append(best)
        news.append(new)
        left &= ~new
