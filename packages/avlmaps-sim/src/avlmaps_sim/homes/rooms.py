"""The furniture of the rooms people live in: living and dining rooms, bedrooms, studies."""

import numpy as np

from avlmaps_sim.furniture import Piece
from avlmaps_sim.furniture.decor import CARPET_SHAPES, carpet
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.clutter import set_at
from avlmaps_sim.homes.furnish import Furnisher, PlacedPiece, footprint, hangs, seat_round, wall_hung
from avlmaps_sim.homes.plan import middle


def several(f: Furnisher, wanted: dict[str, float], front_m: float = 0.4) -> list[PlacedPiece]:
    """Stand pieces against walls, each with its own probability, in random order."""
    names = list(wanted)
    f.rng.shuffle(names)
    return [stood for name in names if (stood := f.stand(name, wanted[name], front_m)) is not None]


def under(f: Furnisher, about: np.ndarray, heading_rad: float, size_m: tuple[float, float]) -> None:
    """Lay a carpet of about a size under what stands about a place."""
    shapes = CARPET_SHAPES["training"] + CARPET_SHAPES["held-out"] if f.which == "all" else CARPET_SHAPES[f.which]
    shape = pick(f.rng, [name for name in shapes if name not in ("runner", "doormat")])
    mesh = carpet(f.rng, size_m[0], size_m[1], shape).mesh
    heading = np.array([heading_rad])
    for _ in range(3):
        foot = footprint(mesh)
        if f.ground.fits(foot, about[None], heading, -1.0, zones=False)[0]:  # under all that stands
            piece = Piece(mesh, category="carpet", family=shape)
            f.put(piece, foot.place(about, heading_rad), solid=False)
            return
        mesh = mesh.scaled(0.8, 0.8, 1.0)


def living_room(f: Furnisher) -> None:
    """Furnish a living room: seats that look at a screen over a low table."""
    rng = f.rng
    screen = _screen(f)
    sofa = f.new("sofa")
    stood = None
    if sofa is not None:
        stood = _facing(f, sofa, screen) if screen is not None and chance(rng, 0.75) else None
        stood = stood or f.along(sofa, front_m=0.35, corner=0.15, at_middle=0.5) or f.insist("sofa", 0.3)
    if stood is not None:
        _sofa_corner(f, stood)
    if chance(rng, 0.3):
        dining_place(f, 1.0, 0.4)
    for _ in range(count(rng, 0, 2)):
        f.stand("armchair", 0.7, 0.35)
    if chance(rng, 0.25 * f.fill) and (second := f.new("sofa")) is not None:
        f.along(second, front_m=0.35)
    several(f, {"bookshelf": 0.6, "cabinet": 0.4, "piano": 0.1, "fireplace": 0.12, "plant": 0.7, "lamp": 0.5,
                "guitar": 0.1,
                "aquarium": 0.07, "chest of drawers": 0.15, "pet bed": 0.08, "fan": 0.08, "ottoman": 0.2,
                "loudspeaker": 0.15, "side table": 0.3})  # fmt: skip
    if chance(rng, 0.3):
        several(f, {"plant": 0.6, "bookshelf": 0.5, "desk": 0.2, "vase": 0.2, "lamp": 0.3})
    if chance(rng, 0.05) and (table := f.new("pool table")) is not None:
        f.in_middle(table)


def _screen(f: Furnisher) -> PlacedPiece | None:
    if not chance(f.rng, 0.85):
        return None
    cabinet = f.stand("tv cabinet", 0.85, 0.6, corner=0.1, at_middle=0.6)
    if cabinet is not None and chance(f.rng, 0.7):
        set_at(f, cabinet, "tv", 0.35, 0.5)
        return cabinet
    tv = f.new("tv", wall_hung if chance(f.rng, 0.8) else _self_standing)
    if tv is None or not hangs(tv):
        return cabinet if tv is None else f.along(tv, front_m=0.6) or cabinet
    near = cabinet.centre if cabinet is not None else None
    sides = None
    if cabinet is not None:
        sides = [s for s in f.ground.sides if np.cos(s.heading_rad - cabinet.place.heading_rad) > 0.999]
    low = cabinet.foot.high_m + 0.15 if cabinet is not None else 0.8
    return f.hang(tv, (low, low + 0.35), sides, near=near) or cabinet


def _self_standing(family: str) -> bool:
    return family in ("on a rolling stand", "rear projection")


def _tall_lamp(family: str) -> bool:
    return family in ("shade on pole", "tripod", "arc", "torchiere", "paper column", "many heads")


def _facing(f: Furnisher, piece: Piece, screen: PlacedPiece) -> PlacedPiece | None:
    foot = footprint(piece.mesh)
    ahead = np.array([np.cos(screen.place.heading_rad), np.sin(screen.place.heading_rad)])
    away = draw(f.rng, 1.9, 3.6) + foot.half[0] + np.array([0.0, 0.3, -0.3, 0.7, -0.5, 1.1])
    aside = f.rng.normal(0.0, 0.2, len(away))
    centre = screen.centre + away[:, None] * ahead + aside[:, None] * np.array([-ahead[1], ahead[0]])
    return f.try_at(piece, centre, np.full(len(away), screen.place.heading_rad + np.pi), front_m=0.3)


def _sofa_corner(f: Furnisher, sofa: PlacedPiece) -> None:
    rng = f.rng
    ahead = np.array([np.cos(sofa.place.heading_rad), np.sin(sofa.place.heading_rad)])
    table = None
    if chance(rng, 0.8 * f.fill) and (piece := f.new("coffee table")) is not None:
        table = f.before(piece, sofa, draw(rng, 0.28, 0.5), aside_m=draw(rng, -0.2, 0.2))
    if chance(rng, 0.6):
        under(f, sofa.centre + (sofa.foot.half[0] + 0.6) * ahead, sofa.place.heading_rad,
              (draw(rng, 1.4, 2.2), draw(rng, 1.8, 3.0)))  # fmt: skip
    if chance(rng, 0.5) and (lamp := f.new("lamp", _tall_lamp)) is not None:
        f.beside(lamp, sofa, draw(rng, 0.03, 0.15))
    if chance(rng, 0.4) and (side := f.new("side table")) is not None:
        f.beside(side, sofa, draw(rng, 0.02, 0.1))
    if table is not None and chance(rng, 0.35) and (chair := f.new("armchair")) is not None:
        foot, base = footprint(chair.mesh), sofa.place.heading_rad
        for sign in (1.0, -1.0):
            across = np.array([-ahead[1], ahead[0]]) * sign
            centre = table.centre + across * (table.foot.half[1] + 0.35 + foot.half[0])
            if f.try_at(chair, centre[None], np.array([base - sign * np.pi / 2 + rng.normal(0, 0.2)]), zones=False):
                break
    if table is not None and chance(rng, 0.15) and (stool := f.new("ottoman")) is not None:
        f.before(stool, table, draw(rng, 0.1, 0.3))


def dining_room(f: Furnisher) -> None:
    """Furnish a dining room: a table with chairs, a cabinet for the tableware."""
    dining_place(f, 1.0)
    several(f, {"cabinet": 0.65, "plant": 0.5, "chest of drawers": 0.2, "lamp": 0.2, "console table": 0.2,
                "bookshelf": 0.15,
                "piano": 0.05, "vase": 0.15, "fireplace": 0.05, "clock": 0.15})  # fmt: skip


def dining_place(f: Furnisher, share: float, free_standing: float = 0.85) -> PlacedPiece | None:
    """Stand a dining table with chairs round it, in a share of the cases."""
    rng = f.rng
    stood = None
    for _ in range(3 if chance(rng, share) else 0):
        if (table := f.new("dining table")) is None:
            return None
        stood = f.in_middle(table, 0.14) if chance(rng, free_standing) else None
        stood = stood or f.along(table, front_m=0.0, gap_m=0.0 if chance(rng, 0.5) else draw(rng, 0.5, 0.8), corner=0.5)
        if stood is not None:
            break
    if stood is None:
        return None
    if chance(rng, 0.4):
        size = 2 * stood.foot.half + draw(rng, 0.7, 1.3)
        under(f, stood.centre, stood.place.heading_rad, (float(size[0]), float(size[1])))
    chair = f.new(pick(rng, ("chair", "chair", "chair", "chair", "stool", "bench")))
    if chair is not None:
        seat_round(f, stood, chair, count(rng, 2, 10))
    return stood


def bedroom(f: Furnisher) -> None:
    """Furnish a bedroom: head of the bed to the wall, a nightstand on either side."""
    rng = f.rng
    stood = f.insist("bed", 0.0, 0.12, 0.65)
    if stood is not None:
        _bedside(f, stood)
    several(f, {"wardrobe": 0.9, "chest of drawers": 0.55}, 0.6)
    if chance(rng, 0.3):
        desk_place(f)
    several(f, {"armchair": 0.25, "mirror": 0.35, "bookshelf": 0.25, "plant": 0.35, "laundry basket": 0.25,
                "lamp": 0.25,
                "bench": 0.15, "chair": 0.3, "tv cabinet": 0.15, "ottoman": 0.12, "crib": 0.06, "coat rack": 0.08,
                "tv": 0.15, "fan": 0.06, "wardrobe": 0.15, "ironing board": 0.05, "guitar": 0.06})  # fmt: skip


def _bedside(f: Furnisher, bed: PlacedPiece) -> None:
    rng = f.rng
    first = f.new("nightstand")
    for _ in range(2):
        if first is not None and chance(rng, 0.85 * f.fill):
            stand = f.beside(first, bed, draw(rng, 0.015, 0.12))
            if stand is not None and chance(rng, 0.6):
                set_at(f, stand, "lamp", draw(rng, 0.2, 0.6), draw(rng, 0.3, 0.7), draw(rng, -0.3, 0.3))
    if chance(rng, 0.45):
        ahead = np.array([np.cos(bed.place.heading_rad), np.sin(bed.place.heading_rad)])
        under(f, bed.centre + 0.5 * ahead, bed.place.heading_rad, (draw(rng, 1.6, 2.6), draw(rng, 2.0, 3.2)))
    if chance(rng, 0.15) and (bench := f.new("bench")) is not None:
        f.before(bench, bed, 0.05, facing=False)


def childrens_room(f: Furnisher) -> None:
    """Furnish a children's room: small beds, toys, a place to paint."""
    rng = f.rng
    if chance(rng, 0.12):
        f.stand("crib", 1.0)
    for _ in range(count(rng, 1, 2)):
        f.insist(pick(rng, ("bed", "bunk bed", "crib", "bed")), 0.0, 0.7, tries=2)
    if chance(rng, 0.5):
        desk_place(f)
    if chance(rng, 0.6):
        under(f, middle(f.ground.polygon), f.ground.sides[0].heading_rad, (draw(rng, 1.2, 2.0), draw(rng, 1.4, 2.6)))
    several(f, {"wardrobe": 0.75, "chest of drawers": 0.5, "bookshelf": 0.6, "toy": 0.8, "rocking horse": 0.25,
                "play tent": 0.25, "baby stroller": 0.12, "basket": 0.4, "ball": 0.4, "mat": 0.2, "stool": 0.2,
                "armchair": 0.15, "lamp": 0.2, "plant": 0.15, "piano": 0.03, "guitar": 0.08, "box": 0.3,
                "nightstand": 0.3,
                "laundry basket": 0.15, "bicycle": 0.06})  # fmt: skip
    for _ in range(int(rng.poisson(1.0 + 4 * f.mess))):
        toy = f.new(pick(rng, ("toy", "toy", "toy", "ball", "book", "cushion", "box")))
        if toy is not None:
            f.somewhere(toy, square=0.0, tries=6)


def desk_place(f: Furnisher, computer: float = 0.75) -> PlacedPiece | None:
    """Stand a desk against a wall, with a chair before it and what one works with on it."""
    rng = f.rng
    stood = f.insist("desk", 0.75, 0.35, tries=2)
    if stood is not None:
        seat = f.new("office chair" if chance(rng, 0.7) else "chair")
        if seat is not None:
            seat_round(f, stood, seat, 1, all_sides=False)
        equip(f, stood, computer)
    return stood


def equip(f: Furnisher, desk: PlacedPiece, computer: float = 0.75) -> None:
    """Put a screen and a keyboard, or a laptop, and a lamp on a desk."""
    rng = f.rng
    if chance(rng, computer):
        at = draw(rng, 0.35, 0.65)
        if chance(rng, 0.7):
            if chance(rng, 0.25):
                set_at(f, desk, "monitor", 0.12, 0.15, 0.15)
                set_at(f, desk, "monitor", 0.12, 0.75, -0.15)
                at = 0.5
            else:
                set_at(f, desk, "monitor", draw(rng, 0.05, 0.25), at, draw(rng, -0.12, 0.12))
            set_at(f, desk, "keyboard", draw(rng, 0.75, 0.95), at, draw(rng, -0.06, 0.06))
            if chance(rng, 0.5) and (computer_case := f.new("computer")) is not None:
                f.beside(computer_case, desk, 0.04)
        else:
            set_at(f, desk, "laptop", draw(rng, 0.5, 0.9), at, draw(rng, -0.2, 0.2))
    elif chance(rng, 0.5):
        set_at(f, desk, "book", 0.7, 0.5, draw(rng, -1.0, 1.0))
    if chance(rng, 0.5):
        set_at(f, desk, "lamp", 0.05, float(pick(rng, (0.0, 1.0))), draw(rng, -0.5, 0.5))


def study(f: Furnisher) -> None:
    """Furnish a study."""
    rng = f.rng
    for _ in range(1 if chance(rng, 0.75) else 2):
        desk_place(f, 0.85)
    several(f, {"bookshelf": 0.85, "filing cabinet": 0.4, "cabinet": 0.25, "armchair": 0.3, "sofa": 0.2, "plant": 0.5,
                "trash can": 0.5, "printer": 0.1, "lamp": 0.3, "whiteboard": 0.12, "guitar": 0.1,
                "chest of drawers": 0.15,
                "piano": 0.05, "fan": 0.08, "chair": 0.2, "box": 0.25, "bag": 0.2})  # fmt: skip
    if chance(rng, 0.6):
        several(f, {"bookshelf": 0.8, "bicycle": 0.05, "locker": 0.03})
    if chance(rng, 0.35):
        under(f, middle(f.ground.polygon), f.ground.sides[0].heading_rad, (draw(rng, 1.2, 2.0), draw(rng, 1.4, 2.6)))
