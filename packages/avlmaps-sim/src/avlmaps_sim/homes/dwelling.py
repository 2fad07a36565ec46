"""From a seed to a scene: programme, plan, walls, furniture, lights."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture import Families
from avlmaps_sim.furniture.recipe_helpers import chance, draw
from avlmaps_sim.homes import rooms, service
from avlmaps_sim.homes.clutter import dress, litter
from avlmaps_sim.homes.doors import joined_up, lit_by_day
from avlmaps_sim.homes.fixtures import adorn, build_stairs, dress_windows, fit_out, light_up
from avlmaps_sim.homes.furnish import Furnisher
from avlmaps_sim.homes.layout import Programme, floor_of, home_programme, office_programme, upstairs
from avlmaps_sim.homes.placing import Footprint, ground_of
from avlmaps_sim.homes.plan import WELL, Room, Storey, walls_between
from avlmaps_sim.homes.walls import build_shell, looks_of
from avlmaps_sim.scene import Area, Light, Scene, SceneBuilder

TWO_STOREYS = 0.12  # share of homes with an upper floor

RULES: dict[str, Callable[[Furnisher], None]] = {
    "living room": rooms.living_room, "dining room": rooms.dining_room, "bedroom": rooms.bedroom,
    "children's room": rooms.childrens_room, "office": rooms.study, "kitchen": service.kitchen,
    "bathroom": service.bathroom, "toilet": service.bathroom, "laundry room": service.laundry_room,
    "storage": service.storage, "hallway": service.hallway, "entrance hall": service.hallway,
    "corridor": service.hallway, "gym": service.gym, "open-plan office": service.open_plan_office,
    "meeting room": service.meeting_room, "reception": service.reception, "copy room": service.copy_room,
    "kitchenette": service.kitchenette,
}  # fmt: skip


def _plan(rng: np.random.Generator, programme: Programme, corridor: str, stairs: bool = False) -> Storey:
    height = draw(rng, 2.3, 3.4) if chance(rng, 0.4) else draw(rng, 2.45, 2.75)
    open_plan = 0.85 if chance(rng, 0.5) else 0.1
    patience = 7.0
    while True:
        laid = [Room(kind, polygon, 0.0, height) for kind, polygon in floor_of(rng, programme, corridor, stairs=stairs)]
        laid.sort(key=lambda room: room.kind == WELL)  # it is not an area: the others keep their numbers
        walls = joined_up(rng, laid, walls_between([room.polygon for room in laid]), open_plan, patience)
        patience *= 1.15
        if walls is not None:
            break
    walls = lit_by_day(rng, laid, walls)
    ceiling = laid[-1].kind == WELL or not chance(rng, 0.06)
    return Storey(tuple(laid), tuple(walls), draw(rng, 0.09, 0.2), draw(rng, 0.22, 0.4), ceiling)


def _upper(rng: np.random.Generator, ground: Storey) -> Storey | None:
    floor_m = ground.rooms[0].floor_m + ground.rooms[0].height_m + ground.slab_m
    for _ in range(4):
        rooms = upstairs(rng, ground.rooms, floor_m, draw(rng, 2.3, 2.8))
        walls = joined_up(rng, rooms, walls_between([room.polygon for room in rooms]), 0.0)
        if walls is not None:
            lit = lit_by_day(rng, rooms, walls, has_entrance=False)
            return Storey(tuple(rooms), tuple(lit), ground.wall_m, ground.outer_m, ceiling=not chance(rng, 0.06))
    return None


def _furnished(rng: np.random.Generator, builder: SceneBuilder, plan: Storey, which: Families) -> None:
    home = looks_of(rng, replace(plan.rooms[0], kind="living room"), None)
    looks = [looks_of(rng, room, home) for room in plan.rooms]
    first = len(builder.areas)
    for room in plan.rooms:
        if room.kind == WELL:
            continue
        number = 1 + sum(area.kind == room.kind for area in builder.areas)
        top = room.floor_m + room.height_m
        builder.areas.append(Area(room.kind, room.polygon, room.floor_m, top, f"{room.kind} {number}"))
    leaves = build_shell(rng, builder, plan, looks, first, which)
    mess, cloth = draw(rng, 0.0, 0.9) ** 1.5, draw(rng, 0.3, 0.95)
    fill = 0.35 if chance(rng, 0.08) else draw(rng, 0.75, 1.2)
    day = draw(rng, 0.3, 1.1) if chance(rng, 0.5) else 0.0
    for index, room in enumerate(plan.rooms):
        if room.kind == WELL:
            x, y = room.polygon.mean(axis=0).tolist()
            builder.lights.append(Light((x, y, room.floor_m + room.height_m - 0.2), (0.5, 0.48, 0.42)))
            continue
        ground = ground_of(plan, index)
        for leaf in leaves:
            if leaf.room == index:
                foot = Footprint(np.zeros(2), leaf.half_m, 0.0, 2.0)
                ground.take(foot, leaf.centre, leaf.heading_rad)
        sparse = 0.3 if chance(rng, 0.04) else 1.0
        f = Furnisher(rng, builder, ground, first + index, room.kind, room.floor_m, room.height_m, which, plan.ceiling,
                      fill * sparse, min(mess * draw(rng, 0.5, 1.6), 1.0))  # fmt: skip
        fit_out(f, looks[index].wall)
        dress_windows(f, cloth, None)
        RULES[room.kind](f)
        adorn(f)
        light_up(f, day)
        dress(f)
        litter(f)


def make_home(seed: int, which: Families = "all") -> Scene:
    """Make a furnished home."""
    rng = np.random.default_rng([seed, 0x40E])
    builder = SceneBuilder(f"house:{seed}")
    upper = None
    if chance(rng, TWO_STOREYS):
        ground = _plan(rng, home_programme(rng, 105.0), "hallway", stairs=True)
        ground = replace(ground, slab_m=draw(rng, 0.2, 0.35))
        upper = _upper(rng, ground) if ground.rooms[-1].kind == WELL else None
    else:
        ground = _plan(rng, home_programme(rng), "hallway")
    _furnished(rng, builder, ground, which)
    if upper is not None:
        hall = next(i for i, room in enumerate(ground.rooms) if room.kind == "hallway")
        build_stairs(rng, builder, ground, upper, hall)
        _furnished(rng, builder, upper, which)
    return builder.build()


def make_office(seed: int, which: Families = "all") -> Scene:
    """Make a furnished office."""
    rng = np.random.default_rng([seed, 0x0FF])
    builder = SceneBuilder(f"office:{seed}")
    _furnished(rng, builder, _plan(rng, office_programme(rng), "corridor"), which)
    return builder.build()
