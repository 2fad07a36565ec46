"""From a seed to a scene: programme, plan, walls, furniture, lights."""

import numpy as np

from avlmaps.sim.furniture import Families
from avlmaps.sim.furniture.joinery import chance, draw
from avlmaps.sim.homes.doors import joined_up, lit_by_day
from avlmaps.sim.homes.furnish import Furnisher
from avlmaps.sim.homes.layout import Programme, floor_of
from avlmaps.sim.homes.placing import Footprint, ground_of
from avlmaps.sim.homes.plan import Plan, Room, walls_between
from avlmaps.sim.homes.polygons import middle
from avlmaps.sim.homes.rooms import RULES
from avlmaps.sim.homes.walls import Leaf, build_shell, looks_of
from avlmaps.sim.scene import Area, Light, Scene, SceneBuilder

# Kind of room: least and greatest area, m².
_SIZE_M2 = {"living room": (16, 34), "kitchen": (8, 15), "dining room": (9, 18), "bedroom": (10, 19), "bathroom": (4.5, 9),
            "hallway": (5, 11), "entrance hall": (4, 9), "office": (8, 14), "laundry room": (4, 8), "storage": (3, 7),
            "children's room": (9, 15), "gym": (10, 20)}  # fmt: skip
_EXTRA = ("bedroom", "children's room", "office", "dining room", "storage", "laundry room", "bathroom", "gym",
          "entrance hall", "bedroom", "office", "children's room")  # fmt: skip
_ORDER = ("kitchen", "dining room", "living room", "entrance hall", "hallway", "office", "storage", "laundry room",
          "bathroom", "bedroom", "children's room", "gym")  # fmt: skip


def _programme(rng: np.random.Generator) -> Programme:
    """Draw the rooms of a home and their areas."""
    wanted = draw(rng, 42, 110) if chance(rng, 0.7) else draw(rng, 110, 210)
    kinds = ["living room", "kitchen", "bathroom", "bedroom", "hallway"]
    stretch = draw(rng, 0.85, 1.3)
    sizes = {kind: draw(rng, *_SIZE_M2[kind]) for kind in kinds}
    rooms = [(kind, sizes[kind]) for kind in kinds]
    for kind in rng.permutation(np.array(_EXTRA, dtype=object)).tolist():
        size = draw(rng, *_SIZE_M2[kind])
        if sum(area for _, area in rooms) + size <= wanted:
            rooms.append((kind, size))
    order = {kind: k + rng.normal(0.0, 0.8) for k, kind in enumerate(_ORDER)}
    rooms.sort(key=lambda room: order[room[0]])
    return [(kind, size * stretch) for kind, size in rooms]


def _plan(rng: np.random.Generator, programme: Programme, floor_m: float = 0.0) -> Plan:
    height = draw(rng, 2.3, 3.4) if chance(rng, 0.4) else draw(rng, 2.45, 2.75)
    open_plan = 0.85 if chance(rng, 0.5) else 0.1
    while True:
        rooms = [Room(kind, polygon, floor_m, height) for kind, polygon in floor_of(rng, programme)]
        walls = joined_up(rng, rooms, walls_between([room.polygon for room in rooms]), open_plan)
        if walls is not None:
            break
    walls = lit_by_day(rng, rooms, walls)
    return Plan(tuple(rooms), tuple(walls), draw(rng, 0.09, 0.2), draw(rng, 0.22, 0.4), not chance(rng, 0.06))


def _keep_leaf(leaf: Leaf) -> tuple[Footprint, np.ndarray, float]:
    low, high = np.array(leaf.low), np.array(leaf.high)
    foot = Footprint(np.zeros(2), (high - low) / 2, 0.0, 2.0)
    c, s = np.cos(leaf.heading_rad), np.sin(leaf.heading_rad)
    x, y = (low + high) / 2
    return foot, leaf.origin + np.array([c * x - s * y, s * x + c * y]), leaf.heading_rad


def _furnished(rng: np.random.Generator, builder: SceneBuilder, plan: Plan, which: Families) -> None:
    home = looks_of(rng, plan.rooms[0], None)
    looks = [looks_of(rng, room, home) for room in plan.rooms]
    first = len(builder.areas)
    for room in plan.rooms:
        number = 1 + sum(area.kind == room.kind for area in builder.areas)
        builder.areas.append(Area(room.kind, room.polygon, room.floor_m, room.floor_m + room.height_m, f"{room.kind} {number}"))
    leaves = build_shell(rng, builder, plan, looks, first, which)
    for index, room in enumerate(plan.rooms):
        ground = ground_of(plan, index)
        for leaf in leaves:
            if leaf.room == index:
                ground.take(*_keep_leaf(leaf))
        furnisher = Furnisher(rng, builder, ground, first + index, room.floor_m, room.height_m, which)
        x, y = middle(room.polygon).tolist()
        builder.lights.append(Light((x, y, room.floor_m + room.height_m - 0.15)))
        if room.kind in RULES:
            RULES[room.kind](furnisher)


def make_home(seed: int, which: Families = "all") -> Scene:
    """Make a furnished home.

    Args:
        seed: another home for each.
        which: families of shapes of furniture.
    """
    rng = np.random.default_rng([seed, 0x40E])
    builder = SceneBuilder(f"house:{seed}")
    _furnished(rng, builder, _plan(rng, _programme(rng)), which)
    return builder.build()


def make_office(seed: int, which: Families = "all") -> Scene:
    """Make a furnished office.

    Args:
        seed: another office for each.
        which: families of shapes of furniture.
    """
    rng = np.random.default_rng([seed, 0x0FF])
    builder = SceneBuilder(f"office:{seed}")
    programme: Programme = [("open-plan office", 45.0), ("corridor", 14.0), ("meeting room", 18.0), ("kitchenette", 9.0),
                            ("toilet", 5.0), ("office", 14.0), ("reception", 14.0), ("copy room", 6.0)]  # fmt: skip
    _furnished(rng, builder, _plan(rng, programme), which)
    return builder.build()
