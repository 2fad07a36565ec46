"""The furniture of the rooms of an office."""

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.furnish import Furnisher
from avlmaps_sim.homes.polygons import middle
from avlmaps_sim.homes.rooms import desk_place, equip, several, under
from avlmaps_sim.homes.seats import seat_round
from avlmaps_sim.homes.service import kitchen


def open_plan_office(f: Furnisher) -> None:
    """Furnish a large office: desks in blocks back to back, partitions between, shelves along the walls."""
    rng = f.rng
    desk, chair, partition = f.new("desk"), f.new("office chair"), f.new("partition")
    if desk is None:
        return
    base = max(f.ground.sides, key=lambda s: s.length_m)
    with_partitions = partition is not None and chance(rng, 0.5)
    deep, wide = float(desk.mesh.size[0]), float(desk.mesh.size[1])
    step_x, step_y = wide + draw(rng, 0.03, 0.2), 2 * deep + draw(rng, 1.7, 2.4)
    away = 2 * float(np.ptp(f.ground.polygon, axis=0).max())
    gap = draw(rng, 0.12, 0.2) if with_partitions else 0.02
    along = np.arange(-away, away, step_x) + draw(rng, 0, 1)
    group = count(rng, 2, 4)
    for row in np.arange(-away, away, step_y):
        for number, at in enumerate(along):
            if number % (group + 1) == group:
                continue  # an aisle
            for sign in (1.0, -1.0):
                centre = middle(f.ground.polygon) + at * base.along + (row + sign * (deep + gap) / 2) * base.inward
                heading = base.heading_rad + (0.0 if sign > 0 else np.pi)
                stood = f.try_at(desk, centre[None], np.array([heading]), front_m=0.75) if chance(rng, 0.93) else None
                if stood is not None:
                    if chair is not None:
                        seat_round(f, stood, chair, 1, all_sides=False)
                    equip(f, stood, 0.95)
            if with_partitions and partition is not None:
                centre = middle(f.ground.polygon) + at * base.along + row * base.inward
                f.try_at(partition, centre[None], np.array([base.heading_rad]), zones=False)
    for _ in range(2):
        several(f, {"filing cabinet": 0.7, "bookshelf": 0.5, "plant": 0.6, "printer": 0.2, "locker": 0.3,
                    "trash can": 0.6,
                    "whiteboard": 0.4, "water dispenser": 0.3, "cabinet": 0.4, "partition": 0.2, "coat rack": 0.3,
                    "fan": 0.1, "sofa": 0.1, "lamp": 0.15, "box": 0.3})  # fmt: skip


def meeting_room(f: Furnisher) -> None:
    """Furnish a meeting room: a long table with chairs, a board, a screen."""
    rng = f.rng
    table = f.new("dining table")
    if table is not None and (stood := f.in_middle(table, 0.06)) is not None:
        seat = f.new(pick(rng, ("office chair", "chair", "office chair")))
        if seat is not None:
            seat_round(f, stood, seat, count(rng, 4, 12))
    several(f, {"whiteboard": 0.9, "tv": 0.6, "plant": 0.6, "cabinet": 0.4, "clock": 0.4, "telephone": 0.1,
                "chair": 0.3,
                "trash can": 0.3, "water dispenser": 0.15, "air conditioner": 0.4, "loudspeaker": 0.2})  # fmt: skip


def reception(f: Furnisher) -> None:
    """Furnish a reception: a desk, seats for guests."""
    rng = f.rng
    desk_place(f, 0.9)
    if (sofa := f.new("sofa")) is not None and (stood := f.along(sofa, front_m=0.4)) is not None:
        if chance(rng, 0.7) and (table := f.new("coffee table")) is not None:
            f.before(table, stood, 0.35)
        if chance(rng, 0.5):
            under(f, stood.centre, stood.place.heading_rad, (2.0, 2.6))
    for _ in range(count(rng, 0, 3)):
        f.stand(pick(rng, ("armchair", "chair")), 0.8, 0.3)
    several(f, {"plant": 0.9, "coat rack": 0.4, "bookshelf": 0.3, "clock": 0.4, "water dispenser": 0.4, "bench": 0.2,
                "aquarium": 0.1, "console table": 0.2, "trash can": 0.4, "lamp": 0.3, "tv": 0.2,
                "cabinet": 0.3})  # fmt: skip


def copy_room(f: Furnisher) -> None:
    """Furnish a copy corner."""
    for _ in range(count(f.rng, 1, 3)):
        f.stand("printer", 0.9, 0.5)
    several(f, {"filing cabinet": 0.8, "cabinet": 0.6, "bookshelf": 0.6, "trash can": 0.8, "box": 0.8,
                "side table": 0.4,
                "console table": 0.3, "locker": 0.3, "water dispenser": 0.2, "computer": 0.2})  # fmt: skip


def kitchenette(f: Furnisher) -> None:
    """Furnish the small kitchen of an office."""
    kitchen(f)
    several(f, {"water dispenser": 0.5, "coffee machine": 0.1, "trash can": 0.5})
