"""Traces of people in a finished home: clothes, papers, shower curtains, and the people themselves.

They are added after a home is made, so that the home of a seed stays what it is; ``house:7:lived-in`` and training
worlds have them. The cloths of tubs and showers that have one become shower curtains of their own.
"""

from dataclasses import dataclass, replace

import numpy as np

from avlmaps_sim.free_space import floor_heights, free_space
from avlmaps_sim.furniture import families, make
from avlmaps_sim.furniture.catalogue import Families
from avlmaps_sim.furniture.people import fabric, seated, thrown_over
from avlmaps_sim.mesh import Mesh
from avlmaps_sim.scene import Scene, SceneBuilder, SceneObject

# How many of a thing lie on one of a category, on average; of the people how many sit there.
_CLOTHES_ON = {
    "bed": 0.8, "bunk bed": 0.4, "sofa": 0.5, "armchair": 0.35, "chair": 0.2, "office chair": 0.25, "bench": 0.3,
    "ottoman": 0.2, "stool": 0.08, "chest of drawers": 0.25, "nightstand": 0.1, "ironing board": 0.7,
    "washing machine": 0.3, "laundry basket": 0.5, "dining table": 0.06, "carpet": 0.1,
}  # fmt: skip
_PAPERS_ON = {
    "desk": 1.6, "dining table": 0.6, "coffee table": 0.8, "side table": 0.4, "console table": 0.3, "nightstand": 0.2,
    "kitchen counter": 0.35, "kitchen island": 0.4, "chest of drawers": 0.2, "printer": 0.5, "sofa": 0.12, "bed": 0.15,
    "filing cabinet": 0.5, "tv cabinet": 0.15, "bookshelf": 0.3, "shoe rack": 0.05,
}  # fmt: skip
_SEATED_ON = {"chair": 0.06, "office chair": 0.15, "armchair": 0.12, "sofa": 0.15, "bench": 0.08, "bed": 0.06}
_LYING_ON = {"bed": 0.05, "sofa": 0.02}
_THROWN_OVER = {"chair": 0.12, "office chair": 0.2, "armchair": 0.12, "sofa": 0.15}
# How many lie, stand or hang in a room of a kind, on average.
_CLOTHES_ON_FLOOR = {"bedroom": 0.8, "children's room": 0.9, "laundry room": 0.8, "bathroom": 0.4, "storage": 0.3}
_CLOTHES_ON_WALL = {"hallway": 0.9, "entrance hall": 0.9, "bedroom": 0.5, "bathroom": 0.3, "children's room": 0.3}
_PAPERS_ON_FLOOR = {"office": 0.3, "children's room": 0.4, "open-plan office": 0.5, "copy room": 0.8}
_PAPERS_ON_WALL = {"office": 0.8, "open-plan office": 2.0, "kitchen": 0.4, "children's room": 0.6,
                   "meeting room": 0.6, "copy room": 0.8, "hallway": 0.2}  # fmt: skip
_PEOPLE_STANDING = 0.3
_ON_THEIR_FEET = ("standing", "walking", "crouching")  # families of people who need no seat
_CURTAINS = 0.5  # share of tubs and showers that get one
_SEAT_M = (0.3, 0.65)  # heights of seats and beds over their feet
_FEWEST_M2 = 0.02  # of a top on which something lies


@dataclass(eq=False)
class _Filled:
    scene: Scene
    rng: np.random.Generator
    which: Families
    builder: SceneBuilder

    def piece(self, category: str, *, on_wall: bool = False) -> Mesh:
        names = list(families(category, self.which))
        if category == "person":
            fit = [name for name in names if name in _ON_THEIR_FEET]
        else:
            fit = [name for name in names if name.startswith("wall") == on_wall] or names
        return make(category, self.rng, self.which, str(self.rng.choice(fit))).mesh

    def times(self, mean: float) -> range:
        return range(int(self.rng.poisson(mean)))


def lived_in(scene: Scene, rng: np.random.Generator, which: Families) -> Scene:
    """Return the home with clothes, papers, shower curtains and people in it."""
    scene = with_curtains_apart(scene)
    filled = _Filled(scene, rng, which, SceneBuilder.of(scene))
    corners = scene.mesh.corners().astype(np.float64)
    order = np.argsort(scene.instance, kind="stable")
    ends = np.searchsorted(scene.instance[order], np.arange(len(scene.objects) + 1))
    for number, thing in enumerate(scene.objects):
        its = corners[order[ends[number] : ends[number + 1]]]
        if len(its):
            _on(filled, thing, its)
    _in_rooms(filled)
    return filled.builder.build()


def with_curtains_apart(scene: Scene) -> Scene:
    """Return the scene with the cloths that hang from tubs and showers as things of their own."""
    matt = np.array([m.gloss == 0.0 for m in scene.mesh.materials], bool)[scene.mesh.material]
    objects, instance = list(scene.objects), scene.instance.copy()
    for number, thing in enumerate(scene.objects):
        if thing.category in ("bathtub", "shower") and "curtain" in thing.family:
            cloth = np.flatnonzero((scene.instance == number) & matt)
            if len(cloth):
                at = scene.mesh.corners()[cloth].reshape(-1, 3)
                low, high = ((float(x), float(y), float(z)) for x, y, z in (at.min(axis=0), at.max(axis=0)))
                instance[cloth] = len(objects)
                title = f"shower curtain#{1 + sum(o.category == 'shower curtain' for o in objects)}"
                objects.append(SceneObject("shower curtain", low, high, thing.heading_rad, name=title))
    return replace(scene, instance=instance, objects=tuple(objects))


def _on(filled: _Filled, thing: SceneObject, corners: np.ndarray) -> None:
    rng, kind = filled.rng, thing.category
    for category, means in (("clothing", _CLOTHES_ON), ("paper", _PAPERS_ON)):
        for _ in filled.times(means.get(kind, 0.0)):
            place = _a_top(rng, corners, highest_m=_SEAT_M[1] if kind in _SEATED_ON else 1.6)
            if place is not None:
                mesh = _no_larger(filled.piece(category), thing).turned(rng.uniform(0, 2 * np.pi))
                sunk = 0.01 if category == "clothing" else 0.0
                filled.builder.add(category, mesh.moved(float(place[0]), float(place[1]), float(place[2]) - sunk))
    if rng.random() < _SEATED_ON.get(kind, 0.0):
        place = _a_top(rng, corners, *_SEAT_M)
        if place is not None:
            floor = thing.low[2]
            mesh = seated(rng, float(place[2]) - floor).turned(thing.heading_rad + rng.normal(0, 0.2))
            filled.builder.add("person", mesh.moved(float(place[0]), float(place[1]), floor))
    if rng.random() < _LYING_ON.get(kind, 0.0):
        place = _a_top(rng, corners, *_SEAT_M)
        if place is not None:
            mesh = make("person", rng, name="lying").mesh.turned(thing.heading_rad + np.pi * int(rng.integers(2)))
            middle = thing.centre
            filled.builder.add("person", mesh.moved(middle[0], middle[1], float(place[2]) - 0.02))
    if rng.random() < _THROWN_OVER.get(kind, 0.0):
        _throw_over(filled, thing, corners)
    if kind in ("bathtub", "shower") and "curtain" not in thing.family and rng.random() < _CURTAINS:
        _curtain_before(filled, thing, corners)


def _no_larger(mesh: Mesh, thing: SceneObject) -> Mesh:
    share = min(1.0, 0.9 * min(thing.size[:2]) / float(max(mesh.size[:2])))
    return mesh.scaled(share, share, share)


def _a_top(
    rng: np.random.Generator, corners: np.ndarray, lowest_m: float = 0.05, highest_m: float = 1.6
) -> np.ndarray | None:
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1) / 2
    foot = corners[..., 2].min()
    middle = corners[..., 2].mean(axis=1) - foot
    flat = (np.abs(across[:, 2]) > 1.7 * area) & (middle > lowest_m) & (middle < highest_m)
    if area[flat].sum() < _FEWEST_M2:
        return None
    # Of all such places the upper ones: of a closed box the top, not the bottom.
    share = np.where(flat, area * np.exp(4.0 * middle), 0.0)
    a, b, c = corners[int(rng.choice(len(share), p=share / share.sum()))]
    u, v = np.sort(rng.random(2))
    return a * u + b * (v - u) + c * (1 - v)


def _forward(thing: SceneObject) -> tuple[np.ndarray, np.ndarray]:
    c, s = np.cos(thing.heading_rad), np.sin(thing.heading_rad)
    return np.array([c, s]), np.array([-s, c])


def _throw_over(filled: _Filled, thing: SceneObject, corners: np.ndarray) -> None:
    rng, points = filled.rng, corners.reshape(-1, 3)
    top = float(points[:, 2].max())
    edge = points[points[:, 2] > top - 0.06]
    front, left = _forward(thing)
    deep, wide = edge[:, :2] @ front, edge[:, :2] @ left
    thick, across = float(np.ptp(deep)), float(np.ptp(wide))
    if not 0.2 < across < 3.0 or thick > 0.3:
        return
    width = min(across, rng.uniform(0.3, 0.7))
    at = wide.min() + width / 2 + rng.uniform(0.0, across - width)
    drop = rng.uniform(0.15, 0.5, 2) * (top - thing.low[2]) * 0.8
    mesh = thrown_over(rng, width, float(drop[0]), float(drop[1]), thick, fabric(rng)).turned(thing.heading_rad)
    x, y = front * (deep.min() + thick / 2) + left * at
    filled.builder.add("clothing", mesh.moved(float(x), float(y), top))


def _curtain_before(filled: _Filled, thing: SceneObject, corners: np.ndarray) -> None:
    rng, points = filled.rng, corners.reshape(-1, 3)
    front, left = _forward(thing)
    deep, wide = points[:, :2] @ front, points[:, :2] @ left
    piece = make("shower curtain", rng, filled.which).mesh
    share = float(np.clip(np.ptp(wide) / piece.size[1], 0.5, 1.5))
    mesh = piece.scaled(1.0, share, 1.0).turned(thing.heading_rad + np.pi * int(rng.integers(2)))
    x, y = front * (deep.max() + 0.03) + left * (wide.min() + wide.max()) / 2
    filled.builder.add("shower curtain", mesh.moved(float(x), float(y), thing.low[2] + rng.uniform(0.08, 0.3)))


def _in_rooms(filled: _Filled) -> None:
    scene, rng = filled.scene, filled.rng
    for floor, floor_m in enumerate(floor_heights(scene)):
        middles = free_space(scene, 0.3, 1.9, floor=floor).middles()
        for area in scene.areas:
            inside = middles[area.contains(middles)] if abs(area.floor_m - floor_m) < 0.3 else middles[:0]
            if not len(inside):
                continue
            means = {
                "clothing": _CLOTHES_ON_FLOOR.get(area.kind, 0.1),
                "paper": _PAPERS_ON_FLOOR.get(area.kind, 0.05),
                "person": _PEOPLE_STANDING,
            }
            for category, mean in means.items():
                for _ in filled.times(mean):
                    x, y = inside[int(rng.integers(len(inside)))] + rng.uniform(-0.1, 0.1, 2)
                    mesh = filled.piece(category).turned(rng.uniform(0, 2 * np.pi))
                    filled.builder.add(category, mesh.moved(float(x), float(y), area.floor_m))
    for area in scene.areas:
        for _ in filled.times(_CLOTHES_ON_WALL.get(area.kind, 0.05)):
            _on_wall(filled, "clothing", area.polygon, area.floor_m, (1.5, 1.9))
        for _ in filled.times(_PAPERS_ON_WALL.get(area.kind, 0.05)):
            _on_wall(filled, "paper", area.polygon, area.floor_m, (1.2, 1.7))


def _on_wall(
    filled: _Filled, category: str, polygon: np.ndarray, floor_m: float, heights_m: tuple[float, float]
) -> None:
    rng = filled.rng
    edge = np.roll(polygon, -1, axis=0) - polygon
    length = np.linalg.norm(edge, axis=1)
    number = int(rng.choice(len(length), p=length / length.sum()))
    along = edge[number] / length[number]
    inward = np.array([-along[1], along[0]])  # corners run counter-clockwise
    mesh = filled.piece(category, on_wall=True)
    half = float(mesh.size[1]) / 2
    if length[number] < 2.5 * half:
        return
    out = float(mesh.size[0]) / 2 + 0.005
    x, y = polygon[number] + along * rng.uniform(half, length[number] - half) + inward * out
    behind = np.array([x, y]) - inward * (out + 0.06)
    if not any(_over(behind, thing) for thing in filled.scene.objects if thing.category == "wall"):
        return  # part of an open plan: no wall is there
    top = float(rng.uniform(*heights_m))
    turned = mesh.turned(float(np.arctan2(inward[1], inward[0])))
    filled.builder.add(category, turned.moved(float(x), float(y), floor_m + max(0.1, top - float(mesh.size[2]))))


def _over(place: np.ndarray, thing: SceneObject) -> bool:
    return all(low <= value <= high for low, value, high in zip(thing.low[:2], place, thing.high[:2], strict=True))
