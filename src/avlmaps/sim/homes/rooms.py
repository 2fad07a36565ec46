"""What stands in which kind of room, and how: one function per kind."""

from collections.abc import Callable

import numpy as np

from avlmaps.sim.furniture.joinery import chance, count, draw, pick
from avlmaps.sim.homes.furnish import Furnisher, Stood

Rule = Callable[[Furnisher], None]


def seats_round(f: Furnisher, table: Stood, category: str = "chair", number: int = 6) -> None:
    """Stand chairs round a table, each facing it, pushed in or drawn out."""
    rng = f.rng
    half_x, half_y = table.foot.half
    places: list[tuple[float, float, float]] = []
    for sign in (1.0, -1.0):
        across = max(int(2 * half_y / 0.62), 1)
        places += [(sign * half_x, (k + 0.5) / across * 2 * half_y - half_y, 0.0 if sign < 0 else np.pi) for k in range(across)]
        places.append((0.0, sign * half_y, -sign * np.pi / 2))
    rng.shuffle(places)
    state = rng.bit_generator.state
    for x, y, heading in places[:number]:
        after = rng.bit_generator.state
        rng.bit_generator.state = state  # the chairs of a table are alike
        piece = f.new(category)
        if piece is None:
            return
        rng.bit_generator.state = after
        rng.random()
        depth = float(piece.mesh.size[0])
        out = depth / 2 + (draw(rng, 0.02, 0.35) if chance(rng, 0.4) else 0.02)
        away = np.array([-np.cos(heading), -np.sin(heading)]) * out
        centre = table.to_world(table.foot.middle + np.array([x, y]) + away)
        turned = table.place.heading_rad + heading + rng.normal(0.0, 0.12)
        f.try_at(piece, centre[None], np.array([turned]), zones=False)


def bedroom(f: Furnisher) -> None:
    """Furnish a bedroom."""
    rng = f.rng
    if (bed := f.new("bed")) is not None and (stood := f.along(bed, corner=0.3, at_middle=0.6, front_m=0.5)):
        for _ in range(2):
            if chance(rng, 0.8) and (stand := f.new("nightstand")) is not None:
                where = f.beside(stand, stood, draw(rng, 0.02, 0.1))
                if where is not None:
                    f.on(where, [pick(rng, ("lamp", "book", "clock", "cup"))])
    for category, share in (("wardrobe", 0.9), ("chest of drawers", 0.6), ("desk", 0.3), ("armchair", 0.3), ("mirror", 0.3),
                            ("bookshelf", 0.3), ("plant", 0.4), ("laundry basket", 0.3)):  # fmt: skip
        stand_if(f, category, share)


def stand_if(f: Furnisher, category: str, share: float, front_m: float = 0.5) -> Stood | None:
    """Stand a piece against a wall in a share of the cases."""
    if not chance(f.rng, share) or (piece := f.new(category)) is None:
        return None
    return f.along(piece, front_m=front_m)


def living_room(f: Furnisher) -> None:
    """Furnish a living room."""
    rng = f.rng
    if (sofa := f.new("sofa")) is not None and (stood := f.along(sofa, front_m=0.3, corner=0.1, at_middle=0.5)):
        if (table := f.new("coffee table")) is not None:
            f.before(table, stood, draw(rng, 0.3, 0.5))
    for category, share in (("tv cabinet", 0.9), ("bookshelf", 0.6), ("armchair", 0.6), ("plant", 0.7), ("lamp", 0.5),
                            ("cabinet", 0.4), ("piano", 0.1), ("fireplace", 0.1)):  # fmt: skip
        stand_if(f, category, share)


def kitchen(f: Furnisher) -> None:
    """Furnish a kitchen."""
    for category in ("refrigerator", "kitchen counter", "stove", "kitchen counter", "dishwasher"):
        stand_if(f, category, 0.95, 0.6)


def dining_room(f: Furnisher) -> None:
    """Furnish a dining room."""
    if (table := f.new("dining table")) is not None and (stood := f.in_middle(table)) is not None:
        seats_round(f, stood, number=count(f.rng, 2, 8))
    for category, share in (("cabinet", 0.7), ("plant", 0.5), ("chest of drawers", 0.2)):
        stand_if(f, category, share)


def bathroom(f: Furnisher) -> None:
    """Furnish a bathroom."""
    for category, share in (("bathtub", 0.5), ("shower", 0.6), ("toilet", 0.95), ("sink", 1.0), ("washing machine", 0.3)):
        stand_if(f, category, share, 0.45)


def office(f: Furnisher) -> None:
    """Furnish a study."""
    for category, share in (("desk", 1.0), ("bookshelf", 0.8), ("filing cabinet", 0.4), ("sofa", 0.2), ("plant", 0.5)):
        stand_if(f, category, share, 0.7)


def hallway(f: Furnisher) -> None:
    """Furnish a hall."""
    for category, share in (("shoe rack", 0.5), ("coat rack", 0.5), ("console table", 0.4), ("plant", 0.3), ("bench", 0.2)):
        stand_if(f, category, share, 0.3)


RULES: dict[str, Rule] = {
    "bedroom": bedroom, "children's room": bedroom, "living room": living_room, "kitchen": kitchen,
    "dining room": dining_room, "bathroom": bathroom, "toilet": bathroom, "office": office, "hallway": hallway,
    "entrance hall": hallway, "corridor": hallway,
}  # fmt: skip
