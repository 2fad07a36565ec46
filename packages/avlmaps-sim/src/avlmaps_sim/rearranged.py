"""A building on a later day: things were moved, taken away and brought, doors were swung. The truth says which.

Day 0 is the scene as it was made. Each day follows from the one before, so that day 3 holds the changes of three days.
The name of a thing lasts over the days; one that was brought has a name that no other ever had.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from avlmaps_sim.free_space import STRUCTURE, FreeSpace, free_space, reaching_part
from avlmaps_sim.furniture import Families, make
from avlmaps_sim.mesh import Mesh, Triple
from avlmaps_sim.scene import Scene, SceneBuilder

ChangeKind = Literal["moved", "removed", "added", "swung"]

# What people carry about, and what they carry into a home and out of it.
PORTABLE = (
    "chair", "office chair", "stool", "armchair", "ottoman", "bag", "box", "basket", "laundry basket", "trash can",
    "plant", "side table", "fan", "vacuum cleaner", "toy", "ball", "baby stroller", "bicycle", "nightstand",
    "ironing board", "pet bed", "rocking horse", "bench", "guitar", "dumbbell", "loudspeaker", "lamp", "shoe rack",
)  # fmt: skip
BROUGHT = ("bag", "box", "basket", "chair", "stool", "laundry basket", "trash can", "plant", "ottoman", "toy", "fan")
_ON_FLOOR_M = 0.06  # a thing stands on the floor with its foot this near to it
_LARGEST_M = 1.3  # and a person carries what is no longer, top-down
_SMALLEST_M = 0.18  # smaller things are lost in a map of 5 cm
_APART_M = 1.0  # what moved stands at least this far from where it was
_GAP_M = 0.06  # between things
_SWING_DEG = (20.0, 45.0)
_TRIES = 40
_LEAF_M = 0.12  # what stands farther out of a wall than this is a door's leaf
_KEPT_SHARE = 0.9  # of the floor that a robot reached before


@dataclass(frozen=True, slots=True)
class Change:
    """One change from a day to the next.

    ``before`` and ``after`` are middles of its box; None for what was brought, or was taken away.
    """

    day: int
    kind: ChangeKind
    name: str
    category: str
    before: Triple | None
    after: Triple | None


def rearranged(scene: Scene, day: int, which: Families = "all", since: int = 0) -> tuple[Scene, tuple[Change, ...]]:
    """Return a building on a later day, and all changes since the day of the scene in their order.

    The same scene and day give the same building; the changes of day 2 begin with those of day 1. ``since`` is the day
    of the scene, 0 as it was made.

    ``ValueError``: the day is before the first.
    """
    if day < since:
        raise ValueError(f"day {day} lies before day {since}, on which the scene was made")
    named = int.from_bytes(sha256(scene.name.encode()).digest()[:4], "little")
    changes: list[Change] = []
    for number in range(since + 1, day + 1):
        scene, new = _next_day(scene, number, np.random.default_rng([named, 0xDA7, number]), which)
        changes += new
    return scene, tuple(changes)


def _next_day(scene: Scene, day: int, rng: np.random.Generator, which: Families) -> tuple[Scene, list[Change]]:
    portable = [number for number in _standing_alone(scene) if scene.objects[number].category in PORTABLE]
    order = [portable[i] for i in rng.permutation(len(portable))]
    out = order[: max(1, len(order) // 8)] if len(order) > 2 else []
    moving = order[len(out) : len(out) + max(2, len(order) // 4)]
    taken = [Change(day, "removed", o.name, o.category, o.centre, None) for o in (scene.objects[k] for k in out)]
    gone, kept_names = set(out), {scene.objects[k].name for k in moving}
    scene = _without(scene, gone)
    stays = {thing.name: number for number, thing in enumerate(scene.objects)}
    ways = _Ways(scene)
    moves: list[Change] = []
    for name in sorted(kept_names):
        number = stays[name]
        if (moved := _moved(scene, number, rng, ways)) is not None:
            before, scene = scene.objects[number], moved
            after = scene.objects[number]
            moves.append(Change(day, "moved", name, after.category, before.centre, after.centre))
    brought: list[Change] = []
    for number in range(int(rng.integers(1, 4))):
        category = str(rng.choice(BROUGHT))
        name = f"{category}#day{day}.{number + 1}"
        if (more := _with_brought(scene, category, name, rng, which, ways)) is not None:
            scene = more
            brought.append(Change(day, "added", name, category, None, scene.objects[-1].centre))
    swings: list[Change] = []
    doors = [number for number, thing in enumerate(scene.objects) if thing.category == "door"]
    for number in rng.permutation(doors)[:2].tolist():
        if (swung := _swung(scene, number, rng, ways)) is not None:
            before, scene = scene.objects[number], swung
            swings.append(Change(day, "swung", before.name, "door", before.centre, scene.objects[number].centre))
    return scene, [*taken, *moves, *brought, *swings]


def _standing_alone(scene: Scene) -> list[int]:
    low = np.array([thing.low for thing in scene.objects])
    high = np.array([thing.high for thing in scene.objects])
    middle = (low + high) / 2
    loose = np.array([thing.category not in STRUCTURE for thing in scene.objects])
    found: list[int] = []
    for number, thing in enumerate(scene.objects):
        area = scene.area_at(thing.centre)
        size = high[number] - low[number]
        if area < 0 or abs(low[number, 2] - scene.areas[area].floor_m) > _ON_FLOOR_M:
            continue
        if not (np.hypot(*size[:2]) <= _LARGEST_M and size.max() >= _SMALLEST_M and size[2] < 1.9):
            continue
        over = loose & (middle[:, :2] > low[number, :2]).all(axis=1) & (middle[:, :2] < high[number, :2]).all(axis=1)
        over &= (low[:, 2] > low[number, 2] + 0.05) & (low[:, 2] < high[number, 2] + 0.1)
        over[number] = False
        if not over.any():
            found.append(number)
    return found


class _Ways:
    def __init__(self, scene: Scene) -> None:
        self._reached = [self._reach(scene, floor) for floor in self._floors(scene)]

    def _floors(self, scene: Scene) -> range:
        from avlmaps_sim.free_space import floor_heights

        return range(len(floor_heights(scene)))

    def _reach(self, scene: Scene, floor: int) -> tuple[int, float]:
        space = reaching_part(scene, free_space(scene, floor=floor))
        xy = space.middles()
        areas = sum(bool(area.contains(xy).any()) for area in scene.areas) if len(xy) else 0
        return areas, space.area_m2

    def are_kept(self, scene: Scene) -> bool:
        now = [self._reach(scene, floor) for floor in self._floors(scene)]
        return all(a >= b and m >= _KEPT_SHARE * n for (a, m), (b, n) in zip(now, self._reached, strict=True))


def _space_for(scene: Scene, reach_m: float, floor_m: float) -> FreeSpace:
    from avlmaps_sim.free_space import floor_heights

    floors = floor_heights(scene)
    nearest = int(np.argmin([abs(height - floor_m) for height in floors]))
    return free_space(scene, reach_m + _GAP_M, 1.6, floor=nearest)


def _places(scene: Scene, reach_m: float, floor_m: float, rng: np.random.Generator) -> Float[np.ndarray, "n 2"]:
    space = _space_for(scene, reach_m, floor_m)
    cells = np.argwhere(space.free)
    if not len(cells):
        return np.zeros((0, 2))
    clear = space.clearance_m[cells[:, 0], cells[:, 1]]
    weight = np.exp(-4.0 * (clear - clear.min())) + 1e-6
    count = min(len(cells), _TRIES)
    return space.middle_of(cells[rng.choice(len(cells), count, replace=False, p=weight / weight.sum())])


def _moved(scene: Scene, number: int, rng: np.random.Generator, ways: _Ways) -> Scene | None:
    thing = scene.objects[number]
    others = _without(scene, {number})
    floor_m = scene.areas[scene.area_at(thing.centre)].floor_m
    for xy in _places(others, float(np.hypot(*thing.size[:2])) / 2, floor_m, rng):
        if np.hypot(*(xy - thing.centre[:2])) < _APART_M or scene.area_at((*xy, floor_m + 0.1)) < 0:
            continue
        made = _carried(scene, number, (float(xy[0]), float(xy[1])), float(rng.uniform(-np.pi, np.pi)))
        if ways.are_kept(made):
            return made
    return None


def _carried(scene: Scene, number: int, xy: tuple[float, float], turn_rad: float) -> Scene:
    thing, own = scene.objects[number], scene.instance == number
    middle = np.array([*thing.centre[:2], 0.0])
    return _bent(scene, number, own, middle, turn_rad, xy)


def _bent(
    scene: Scene,
    number: int,
    own: Bool[np.ndarray, " t"],
    pivot: Float[np.ndarray, "3"],
    turn_rad: float,
    xy: tuple[float, float] | None = None,
) -> Scene:
    mesh, thing = scene.mesh, scene.objects[number]
    rows = np.unique(mesh.triangle[own])
    shared = np.isin(rows, mesh.triangle[~own])
    vertex, triangle = mesh.vertex, mesh.triangle.copy()
    # Vertices that stay in use elsewhere are copied before they move.
    copies = np.arange(len(vertex), len(vertex) + int(shared.sum()), dtype=np.int32)
    vertex = np.concatenate([vertex, vertex[rows[shared]]])
    renamed = np.arange(len(vertex), dtype=np.int32)
    renamed[rows[shared]] = copies
    triangle[own] = renamed[triangle[own]]
    rows = np.unique(triangle[own])
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    turned = (vertex[rows].astype(np.float64) - pivot) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + pivot
    if xy is not None:
        box = (turned.min(axis=0) + turned.max(axis=0)) / 2
        turned[:, :2] += np.array(xy) - box[:2]
    vertex = vertex.copy()
    vertex[rows] = turned
    made = replace(mesh, vertex=vertex, triangle=triangle)
    at = vertex[np.unique(triangle[scene.instance == number])]
    low, high = (tuple(float(v) for v in corner) for corner in (at.min(axis=0), at.max(axis=0)))
    heading = thing.heading_rad + (turn_rad if xy is not None else 0.0)
    middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
    after = replace(thing, low=low, high=high, heading_rad=heading, area=scene.area_at(middle))  # pyright: ignore[reportArgumentType]
    objects = (*scene.objects[:number], after, *scene.objects[number + 1 :])
    return replace(scene, mesh=made, objects=objects)


def _without(scene: Scene, gone: set[int]) -> Scene:
    if not gone:
        return scene
    stays = ~np.isin(scene.instance, list(gone))
    number = np.cumsum([k not in gone for k in range(len(scene.objects))]) - 1
    mesh = scene.mesh
    kept = Mesh(mesh.vertex, mesh.triangle[stays], mesh.uv[stays], mesh.material[stays], mesh.materials)
    objects = tuple(thing for k, thing in enumerate(scene.objects) if k not in gone)
    return replace(scene, mesh=kept, instance=number[scene.instance[stays]].astype(np.int32), objects=objects)


def _with_brought(
    scene: Scene, category: str, name: str, rng: np.random.Generator, which: Families, ways: _Ways
) -> Scene | None:
    piece = make(category, rng, which)
    if piece.family.startswith(("wall", "counter", "table top")) or float(piece.mesh.size.max()) < _SMALLEST_M:
        return None
    mesh = piece.mesh.turned(float(rng.uniform(-np.pi, np.pi))).standing()
    floor_m = scene.areas[int(rng.integers(len(scene.areas)))].floor_m
    for xy in _places(scene, float(np.hypot(*mesh.size[:2])) / 2, floor_m, rng):
        area = scene.area_at((*xy, floor_m + 0.1))
        if area < 0:
            continue
        builder = SceneBuilder.of(scene)
        builder.add(category, mesh.moved(float(xy[0]), float(xy[1]), floor_m), 0.0, piece.family, name, area)
        made = builder.build()
        if ways.are_kept(made):
            return made
    return None


def _swung(scene: Scene, number: int, rng: np.random.Generator, ways: _Ways) -> Scene | None:
    thing = scene.objects[number]
    own = np.flatnonzero(scene.instance == number)
    at = scene.mesh.corners()[own].astype(np.float64)
    c, s = np.cos(thing.heading_rad), np.sin(thing.heading_rad)
    out_m = at[..., :2] @ np.array([c, s])  # in the direction that the leaf opens to
    aside_m = at[..., :2] @ np.array([-s, c])
    wall = np.median(out_m)
    back, front = out_m.min(), out_m.max()
    if front - back < 0.5:
        return None  # it is closed
    stands_out = out_m.max(axis=1) > min(back + 0.3, wall + _LEAF_M)
    leaf = out_m[stands_out].reshape(-1), aside_m[stands_out].reshape(-1)
    hinge_out = float(np.min(leaf[0]))
    hinge_aside = float(np.mean(leaf[1][leaf[0] < hinge_out + 0.1]))
    pivot = np.array([c * hinge_out - s * hinge_aside, s * hinge_out + c * hinge_aside, 0.0])
    chosen = np.zeros(len(scene.instance), bool)
    chosen[own[stands_out]] = True
    for sign in rng.permutation([-1.0, 1.0]):
        made = _bent(scene, number, chosen, pivot, float(sign * np.deg2rad(rng.uniform(*_SWING_DEG))))
        if not _meets(made, number, chosen) and ways.are_kept(made):
            return made
    return None


def _meets(scene: Scene, number: int, own: Bool[np.ndarray, " t"]) -> bool:
    points = scene.mesh.corners()[own].reshape(-1, 3)
    for other, thing in enumerate(scene.objects):
        if other == number or thing.category in ("floor", "ceiling", "carpet", "mat"):
            continue
        if bool(((points > np.array(thing.low)) & (points < np.array(thing.high))).all(axis=1).any()):
            return True
    return False


def to_json(changes: Sequence[Change]) -> list[dict[str, object]]:
    """Return the changes as the truth file holds them."""
    return [
        {"day": one.day, "kind": one.kind, "name": one.name, "category": one.category,
         "before": None if one.before is None else [round(v, 4) for v in one.before],
         "after": None if one.after is None else [round(v, 4) for v in one.after]}
        for one in changes
    ]  # fmt: skip
