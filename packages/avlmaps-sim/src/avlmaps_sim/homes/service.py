"""The furniture of rooms that serve: kitchens, bathrooms, laundries, halls, storage rooms, gyms; and of offices."""

import numpy as np

from avlmaps_sim.furniture import Piece
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.clutter import set_at
from avlmaps_sim.homes.furnish import Furnisher, PlacedPiece, floor_standing, footprint, seat_round, wall_hung
from avlmaps_sim.homes.plan import middle
from avlmaps_sim.homes.rooms import desk_place, dining_place, equip, several, under


def _let_in(family: str) -> bool:
    return family in ("counter single bowl", "counter double bowl")


def kitchen(f: Furnisher) -> None:
    """Furnish a kitchen: counters and machines in rows, cabinets above, a place to eat."""
    rng = f.rng
    if chance(rng, 0.4) and (angled := f.new("kitchen counter")) is not None:
        f.along(angled, front_m=0.6, corner=0.9)
    base = ["refrigerator", "kitchen counter", "stove", "kitchen counter", "dishwasher", "kitchen counter"]
    if chance(rng, 0.5):
        base = ["kitchen counter", "stove", "dishwasher", "kitchen counter", "refrigerator"]
    if chance(rng, 0.15):
        base.append("washing machine")
    fitted = f.row(base, front_m=0.6)
    for needed in ("stove", "refrigerator", "kitchen counter"):
        if not any(stood.piece.category == needed for stood in f.stood):
            f.insist(needed, 0.5, corner=0.6)
    _above(f, fitted)
    _sink(f)
    if chance(rng, 0.3) and (island := f.new("kitchen island")) is not None:
        stood = f.in_middle(island, 0.1)
        if stood is not None and chance(rng, 0.6) and (stool := f.new("stool")) is not None:
            seat_round(f, stood, stool, count(rng, 2, 4), all_sides=chance(rng, 0.3))
    elif chance(rng, 0.45):
        dining_place(f, 1.0, 0.6)
    several(f, {"trash can": 0.7, "kitchen cabinet": 0.4, "microwave": 0.1, "plant": 0.2, "cabinet": 0.2,
                "water heater": 0.15,
                "wall shelf": 0.3, "basket": 0.2, "stool": 0.15, "water dispenser": 0.06, "pet bed": 0.04, "towel": 0.2,
                "clock": 0.2})  # fmt: skip


def _above(f: Furnisher, fitted: list[PlacedPiece]) -> None:
    for stood in [s for s in f.stood if s.piece.category == "stove"]:
        hood = f.new("range hood")
        if hood is not None and chance(f.rng, 0.85):
            _over(f, hood, stood, draw(f.rng, 1.45, 1.65))
    low = draw(f.rng, 1.38, 1.52)
    if not chance(f.rng, 0.85):
        return
    for stood in [s for s in fitted if s.piece.category in ("kitchen counter", "dishwasher", "washing machine")]:
        for _ in range(3):
            cabinet = f.new("kitchen cabinet", wall_hung)
            if cabinet is not None:
                _over(f, cabinet, stood, low)


def _over(f: Furnisher, piece: Piece, stood: PlacedPiece, z: float) -> PlacedPiece | None:
    foot = footprint(piece.mesh)
    if z + foot.high_m > f.height_m - 0.03:
        piece = type(piece)(piece.mesh.scaled(1, 1, max((f.height_m - 0.05 - z) / foot.high_m, 0.4)), (), (),
                            piece.category,
                            piece.family)  # fmt: skip
        foot = footprint(piece.mesh)
    room = max(stood.foot.half[1] - foot.half[1], 0.0)
    aside = np.concatenate([[0.0, room, -room], f.rng.uniform(-1.0, 1.0, 4) * room])
    x = stood.foot.middle[0] - stood.foot.half[0] + foot.half[0]
    local = np.column_stack([np.full(len(aside), x), stood.foot.middle[1] + aside])
    heading = np.full(len(aside), stood.place.heading_rad)
    centre = stood.to_world(local)
    on_wall = np.array([_clear_of_holes(f, c, foot.half[1], z, z + foot.high_m, stood) for c in centre])
    if not on_wall.any():
        return None
    return f.try_at(piece, centre[on_wall], heading[on_wall], z, zones=False)


def _clear_of_holes(
    f: Furnisher, centre: np.ndarray, half_m: float, low: float, high: float, stood: PlacedPiece
) -> bool:
    for side in f.ground.sides:
        if np.cos(side.heading_rad - stood.place.heading_rad) > 0.999:
            at = float((centre - side.a) @ side.along)
            if not side.is_free(np.array([at - half_m]), np.array([at + half_m]), low, high)[0]:
                return False
    return True


def _sink(f: Furnisher) -> None:
    counters = [s for s in f.stood if s.piece.category == "kitchen counter"]
    f.rng.shuffle(counters)  # type: ignore[arg-type]
    sunk = any(set_at(f, s, "sink", 0.5, draw(f.rng, 0.1, 0.9), among=_let_in) for s in counters[:3])
    if not sunk and not any(stood.piece.category == "sink" for stood in f.stood):
        f.insist("sink", 0.45, tries=2, among=lambda name: name.startswith(("kitchen", "steel", "trough")))
    if chance(f.rng, 0.25) and counters:
        set_at(f, counters[-1], "stove", 0.5, draw(f.rng, 0.0, 1.0), among=lambda name: name.startswith("counter"))


def _for_bathrooms(family: str) -> bool:
    return not family.startswith(("kitchen", "steel", "counter", "trough"))


def bathroom(f: Furnisher) -> None:
    """Furnish a bathroom or a toilet."""
    rng = f.rng
    large = f.kind == "bathroom"
    order = [
        "sink",
        "toilet",
        *(["bathtub", "shower"] if chance(rng, 0.3) else [pick(rng, ("bathtub", "shower", "shower"))]),
    ]
    if not large:
        order = ["toilet", "sink"]
    if chance(rng, 0.5):
        order.reverse()
    basin = None
    for category in order:
        among = _for_bathrooms if category == "sink" else floor_standing
        stood = f.insist(category, 0.35, corner=0.8 if category in ("bathtub", "shower") else 0.4, among=among)
        basin = stood if category == "sink" else basin
    if basin is not None and (mirror := f.new("mirror", wall_hung)) is not None:
        _over(f, mirror, basin, draw(rng, 1.15, 1.35))
    if large and chance(rng, 0.25):
        f.stand("sink", 1.0, 0.4, among=_for_bathrooms)
    several(f, {"washing machine": 0.3 * large, "towel": 0.8, "radiator": 0.25, "laundry basket": 0.35 * large,
                "trash can": 0.5, "cabinet": 0.25 * large, "wall shelf": 0.3, "plant": 0.15, "water heater": 0.15,
                "stool": 0.1,
                "mirror": 0.2, "basket": 0.2, "fan": 0.03})  # fmt: skip
    if chance(rng, 0.5) and (mat := f.new(pick(rng, ("carpet", "mat")))) is not None and mat.mesh.size[:2].max() < 1.5:
        f.somewhere(mat, square=1.0, solid=False)
    if chance(rng, 0.5):
        f.stand("towel", 1.0)


def laundry_room(f: Furnisher) -> None:
    """Furnish a laundry room."""
    f.row(["washing machine", "washing machine", "kitchen counter"][: count(f.rng, 1, 3)], front_m=0.5)
    several(f, {"laundry basket": 0.9, "ironing board": 0.6, "cabinet": 0.4, "sink": 0.5, "wall shelf": 0.5,
                "basket": 0.5,
                "vacuum cleaner": 0.4, "water heater": 0.4, "kitchen cabinet": 0.3, "box": 0.4, "bottle": 0.2,
                "towel": 0.3,
                "trash can": 0.2, "shoe rack": 0.1, "wardrobe": 0.2})  # fmt: skip


def storage(f: Furnisher) -> None:
    """Fill a storage room: shelves and boxes, and what has no other place."""
    several(f, {"bookshelf": 0.8, "cabinet": 0.5, "wardrobe": 0.3, "vacuum cleaner": 0.4, "bicycle": 0.3,
                "ironing board": 0.2,
                "water heater": 0.25, "box": 0.9, "basket": 0.3, "fan": 0.2, "baby stroller": 0.15, "shoe rack": 0.2,
                "chair": 0.2, "computer": 0.1, "guitar": 0.1, "bag": 0.4, "pot": 0.1, "locker": 0.1}, 0.2)  # fmt: skip
    for _ in range(count(f.rng, 1, 6)):
        f.stand(pick(f.rng, ("box", "box", "box", "basket", "bag")), 1.0, 0.0)


def hallway(f: Furnisher) -> None:
    """Furnish a hall: coats, shoes, a runner, with a free passage."""
    rng = f.rng
    entrance = 1.6 if f.kind == "entrance hall" else 0.8
    several(f, {"coat rack": 0.45 * entrance, "shoe rack": 0.45 * entrance, "console table": 0.35, "plant": 0.3,
                "bench": 0.2,
                "mirror": 0.45 * entrance, "wardrobe": 0.2, "shoes": 0.35 * entrance, "bag": 0.15, "cabinet": 0.15,
                "chest of drawers": 0.15, "bookshelf": 0.15, "baby stroller": 0.05, "bicycle": 0.05, "chair": 0.1,
                "clock": 0.15, "vase": 0.1, "lamp": 0.12, "basket": 0.1, "vacuum cleaner": 0.05}, 0.25)  # fmt: skip
    if chance(rng, 0.45) and (runner := f.new("carpet")) is not None:
        side = max(f.ground.sides, key=lambda s: s.length_m)
        middle_of = f.ground.polygon.mean(axis=0)
        turn = side.heading_rad + (np.pi / 2 if runner.mesh.size[0] > runner.mesh.size[1] else 0.0)
        f.try_at(runner, middle_of[None], np.array([turn]), solid=False, zones=False)


def gym(f: Furnisher) -> None:
    """Furnish a gym: machines, weights, mats, mirrors."""
    rng = f.rng
    for _ in range(count(rng, 2, 6)):
        if (machine := f.new("fitness equipment")) is not None:
            f.along(machine, front_m=0.4, gap_m=draw(rng, 0.0, 0.3))
    for _ in range(count(rng, 1, 3)):
        if (mat := f.new("mat")) is not None:
            f.somewhere(mat, square=0.7)
    several(f, {"mirror": 0.8, "bench": 0.5, "ball": 0.7, "bicycle": 0.2, "fan": 0.3, "tv": 0.3, "locker": 0.2,
                "towel": 0.4,
                "water dispenser": 0.2, "loudspeaker": 0.3, "plant": 0.3, "clock": 0.3, "stool": 0.2,
                "cabinet": 0.2})  # fmt: skip
    for _ in range(count(rng, 1, 5)):
        if (weight := f.new("dumbbell")) is not None:
            f.somewhere(weight, square=0.2, tries=6)


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
