"""Shoe racks, wall shelves, filing cabinets and coat racks."""

import numpy as np

from avlmaps_sim.furniture.carcass import (
    Room,
    board_look,
    book_looks,
    carcass,
    cloth_looks,
    doors,
    drawers,
    front_style,
    grip,
    inside,
    ornament,
    shelf_things,
    split,
)
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.legs import four_legs, leg_style, star_base
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, ellipsoid, lathe, loft, rounded_box, rounded_rectangle, slab, tube


def shoe(rng: np.random.Generator, look: Material) -> Mesh:
    """Return a shoe about the origin whose tip looks along +x: a sole, a rounded toe, a higher heel."""
    long, wide = draw(rng, 0.22, 0.3), draw(rng, 0.08, 0.1)
    heel = draw(rng, 0.06, 0.12)
    rings = []
    for z, back, front, share in (
        (0.0, 0.0, 1.0, 1.0),
        (0.03, 0.0, 0.99, 1.0),
        (0.05, 0.02, 0.72, 0.9),
        (heel, 0.05, 0.42, 0.7),
    ):
        flat = rounded_rectangle(long * (front - back), wide * share, wide * 0.4, 2)
        rings.append(
            np.column_stack([flat[:, 0] + long * ((front + back) / 2 - 0.5), flat[:, 1], np.full(len(flat), z)])
        )
    return loft(rings, look)


def _shoes(rng: np.random.Generator, y: tuple[float, float], x: float, z: float, full: float) -> Meshes:
    looks = [made_of(rng, "leather", "fabric", "plastic", "white", "black") for _ in range(4)]
    for at in np.arange(y[0] + 0.12, y[1] - 0.1, 0.24).tolist():
        if chance(rng, full):
            one, turn = shoe(rng, pick(rng, looks)), draw(rng, -0.1, 0.1)
            yield from [one.turned(turn).moved(x + draw(rng, -0.02, 0.02), at + s * 0.052, z) for s in (1, -1)]


@family("shoe rack", "open tiers")
def _shoe_tiers(rng: np.random.Generator) -> Parts:
    depth, width, tiers = draw(rng, 0.26, 0.36), draw(rng, 0.5, 1.0), count(rng, 2, 5)
    high = 0.06 + 0.2 * tiers
    frame, look = made_of(rng, "metal", "black", "wood", "white"), board_look(rng)
    rods, full = chance(rng, 0.5), draw(rng, 0.2, 0.8) / max(1, tiers / 3)
    yield four_legs(depth, width, high, leg_style(rng, 0.015, 0.03, True), frame)
    for z in np.linspace(0.08, high - 0.02, tiers).tolist():
        if rods:
            for x in np.linspace(-0.42, 0.42, 4) * depth:
                yield tube([(x, -width / 2, z), (x, width / 2, z)], 0.007, frame, 4)
        else:
            yield slab(0.0, 0.0, z - 0.015, depth, width, 0.018, look)
        yield from _shoes(rng, (-width / 2, width / 2), 0.0, z + 0.005, full)


@family("shoe rack", "tilting cabinet")
def _shoe_cabinet(rng: np.random.Generator) -> Parts:
    depth, width, rows = draw(rng, 0.17, 0.3), draw(rng, 0.5, 1.0), count(rng, 2, 4)
    height = 0.1 + rows * draw(rng, 0.3, 0.4)
    look = board_look(rng)
    style = front_style(rng, look)
    low = draw(rng, 0.04, 0.12)
    room = Room((-depth / 2, -width / 2, low), (depth / 2, width / 2, height))
    yield from (carcass(room, 0.018, look), four_legs(depth, width, low, leg_style(rng, 0.02, 0.04, True), look))
    for z0, z1 in split(low, height, [1.0] * rows):
        flap = drawers(rng, style, Room((-depth / 2, -width / 2, z0), (depth / 2, width / 2, z1)), [1.0], 0.0)
        lean = draw(rng, 0.2, 0.5) if chance(rng, 0.15) else 0.0
        yield from [m.moved(-depth / 2, 0.0, -z0).tilted("y", lean).moved(depth / 2, 0.0, z0) for m in flap]
    yield box((-depth / 2, -width / 2 - 0.01, height), (depth / 2 + 0.03, width / 2 + 0.01, height + 0.02), look)
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height + 0.02)


@family("shoe rack", "bench")
def _shoe_bench(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.3, 0.4), draw(rng, 0.6, 1.1), draw(rng, 0.42, 0.52)
    look = board_look(rng)
    room = Room((-depth / 2, -width / 2, 0.0), (depth / 2, width / 2, height - 0.05))
    yield carcass(room, 0.02, look)
    free = inside(room, 0.02)
    mid = (free.low[2] + free.high[2]) / 2
    yield box((free.low[0], free.low[1], mid - 0.009), (free.high[0], free.high[1], mid + 0.009), look)
    for z in (free.low[2], mid + 0.009):
        yield from _shoes(rng, (free.low[1], free.high[1]), 0.0, z, 0.5)
    top = rounded_box(
        (-depth / 2, -width / 2, height - 0.05), (depth / 2, width / 2, height), 0.02, material("fabric", rng), 2
    )
    yield (
        top if chance(rng, 0.6) else box((-depth / 2, -width / 2, height - 0.05), (depth / 2, width / 2, height), look)
    )


@family("wall shelf", "boards")
def _wall_boards(rng: np.random.Generator) -> Parts:
    depth, width, number = draw(rng, 0.15, 0.28), draw(rng, 0.4, 1.3), pick(rng, (1, 1, 2, 2, 3))
    look = board_look(rng)
    metal = made_of(rng, "metal", "black", "white")
    brackets, books = chance(rng, 0.6), book_looks(rng)
    step, parts, supports = draw(rng, 0.28, 0.4), [], []
    full = pick(rng, (0.0, 0.5, 0.8))
    for i in range(number):
        z, shift = 0.15 + i * step, draw(rng, -0.15, 0.15) if chance(rng, 0.3) else 0.0
        y0, y1 = shift - width / 2, shift + width / 2
        parts.append(box((-depth / 2, y0, z), (depth / 2, y1, z + draw(rng, 0.015, 0.045)), look))
        top = float(parts[-1].high[2])
        if brackets:
            for y in (y0 + 0.12 * width, y1 - 0.12 * width):
                parts += [box((-depth / 2, y - 0.012, z - 0.14), (-depth / 2 + 0.006, y + 0.012, z), metal),
                          strut((-depth / 2, y, z - 0.13), (depth / 2 - 0.03, y, z), 0.012, 0.012, metal)]  # fmt: skip
        parts += shelf_things(
            rng, Room((-depth / 2, y0 + 0.02, top), (depth / 2, y1 - 0.02, top + step - 0.04)), books, full
        )
        supports.append(Support((-depth / 2, y0), (depth / 2, y1), top, step - 0.05))
    return [*parts, *(supports if not full else [])]


@family("wall shelf", "boxes")
def _wall_boxes(rng: np.random.Generator) -> Parts:
    depth, look, books = draw(rng, 0.15, 0.25), board_look(rng), book_looks(rng)
    y = 0.0
    for _ in range(count(rng, 1, 3)):
        wide, tall, z = draw(rng, 0.25, 0.6), draw(rng, 0.25, 0.4), draw(rng, 0.0, 0.3)
        room = Room((-depth / 2, y, z), (depth / 2, y + wide, z + tall))
        yield from (carcass(room, 0.018, look), *shelf_things(rng, inside(room, 0.018), books, 0.6))
        y += wide + draw(rng, 0.0, 0.2)


@family("wall shelf", "bracketed rails")
def _rail_shelf(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.2, 0.3), draw(rng, 0.6, 1.2), draw(rng, 0.8, 1.6)
    look, metal, books = board_look(rng), made_of(rng, "metal", "white", "black"), book_looks(rng)
    a = -depth / 2
    rails = (-width * 0.3, width * 0.3)
    yield from [box((a, y - 0.012, 0.0), (a + 0.015, y + 0.012, height), metal) for y in rails]
    levels = np.linspace(0.1, height - 0.15, count(rng, 2, 4)).tolist()
    for i, z in enumerate(levels):
        yield box((a + 0.015, -width / 2, z), (depth / 2, width / 2, z + 0.02), look)
        yield from [strut((a + 0.01, y, z - 0.06), (depth / 2 - 0.02, y, z), 0.01, 0.025, metal) for y in rails]
        top = levels[i + 1] - 0.05 if i + 1 < len(levels) else z + 0.3
        yield from shelf_things(rng, Room((a + 0.015, -width / 2, z + 0.02), (depth / 2, width / 2, top)), books, 0.6)


@family("filing cabinet", "vertical")
def _filing_cabinet(rng: np.random.Generator) -> Parts:
    depth, width, rows = draw(rng, 0.45, 0.7), draw(rng, 0.38, 0.5), count(rng, 2, 4)
    height = 0.04 + rows * draw(rng, 0.29, 0.33)
    look = made_of(rng, "metal", "white", "black", "painted")
    style = front_style(rng, look, ("flat",))
    room = Room((-depth / 2, -width / 2, 0.03), (depth / 2, width / 2, height))
    yield carcass(room, 0.012, look)
    yield box((-depth / 2, -width / 2, 0.0), (depth / 2 - 0.03, width / 2, 0.03), look)
    yield from drawers(rng, style, room, [1.0] * rows, 0.1)
    label = material("paper", rng)
    for _, z in split(0.03, height, [1.0] * rows):
        yield slab(depth / 2 + style.thick, 0.0, z - 0.1, 0.006, 0.09, 0.04, label)
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("filing cabinet", "lateral")
def _lateral_file(rng: np.random.Generator) -> Parts:
    depth, width, rows = draw(rng, 0.42, 0.5), draw(rng, 0.75, 1.2), count(rng, 2, 4)
    height = 0.06 + rows * draw(rng, 0.3, 0.36)
    look = made_of(rng, "metal", "white", "painted", "wood")
    style = front_style(rng, look, ("flat",))
    room = Room((-depth / 2, -width / 2, 0.05), (depth / 2, width / 2, height))
    yield carcass(room, 0.014, look)
    yield box((-depth / 2, -width / 2, 0.0), (depth / 2 - 0.03, width / 2, 0.05), look)
    if chance(rng, 0.7):
        yield from drawers(rng, style, room, [1.0] * rows, 0.06)
    else:
        for y0, y1 in split(-width / 2 + 0.02, width / 2 - 0.02, [1.0] * 18):
            yield box((depth / 2 - 0.015, y0, 0.07), (depth / 2 + 0.004 * (y0 > 0), y1 - 0.004, height - 0.02), look)
        yield from [grip(style, depth / 2, s * 0.04, height / 2, True, 0.15) for s in (1, -1)]
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("filing cabinet", "rolling")
def _rolling_file(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.45, 0.6), draw(rng, 0.36, 0.44), draw(rng, 0.5, 0.64)
    look = made_of(rng, "metal", "white", "black", "wood", "painted")
    room = Room((-depth / 2, -width / 2, 0.05), (depth / 2, width / 2, height))
    shares = pick(rng, ([1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [2.0, 1.0], [2.0, 2.0, 0.6]))
    yield from (carcass(room, 0.014, look), *drawers(rng, front_style(rng, look, ("flat",)), room, shares, 0.08))
    dark = material("black", rng)
    wheel = cylinder(0.0, 0.0, -0.012, 0.025, 0.024, dark, 8).tilted("x", np.pi / 2).moved(z=0.025)
    yield from [wheel.moved(sx * (depth / 2 - 0.05), sy * (width / 2 - 0.05)) for sx in (1, -1) for sy in (1, -1)]
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


def _coat(rng: np.random.Generator, x: float, y: float, z: float, look: Material, heading: float) -> Mesh:
    long, half = draw(rng, 0.6, 1.0), draw(rng, 0.12, 0.2)
    rings = []
    for dz, share, thick in ((0.0, 0.25, 0.03), (-0.1, 0.9, 0.1), (-0.5 * long, 1.0, 0.12), (-long, 1.15, 0.09)):
        flat = rounded_rectangle(thick, 2 * half * share, thick * 0.45, 2)
        rings.append(np.column_stack([flat[:, 0] + 0.05, flat[:, 1], np.full(len(flat), dz)]))
    return loft(rings, look).turned(heading).moved(x, y, z)


@family("coat rack", "tree")
def _coat_tree(rng: np.random.Generator) -> Parts:
    height = draw(rng, 1.6, 1.9)
    look = made_of(rng, "wood", "wood", "black", "metal", "white")
    reach = draw(rng, 0.2, 0.3)
    legs = count(rng, 3, 5)
    foot = star_base(legs, reach, 0.25, look, 0.02)
    if chance(rng, 0.4):
        foot = lathe([(reach * 0.85, 0.0), (reach * 0.8, 0.025), (0.03, 0.04)], look, sides=16)
    yield from (foot, cylinder(0.0, 0.0, 0.02, draw(rng, 0.015, 0.028), height - 0.02, look, 8))
    yield ellipsoid((0.0, 0.0, height), (0.03, 0.03, 0.03), look, 8, 5)
    looks, full = cloth_looks(rng, 3), draw(rng, 0.0, 0.6)
    for i, a in enumerate(np.linspace(0.0, 2 * np.pi, count(rng, 4, 8), endpoint=False).tolist()):
        z = height - (0.08 if i % 2 else draw(rng, 0.1, 0.35))
        c, s = float(np.cos(a)), float(np.sin(a))
        yield tube(
            [(0.02 * c, 0.02 * s, z - 0.03), (0.1 * c, 0.1 * s, z - 0.02), (0.15 * c, 0.15 * s, z + 0.06)],
            0.009,
            look,
            5,
        )
        if chance(rng, full):
            yield _coat(rng, 0.1 * c, 0.1 * s, z, pick(rng, looks), a)


@family("coat rack", "wall board")
def _coat_board(rng: np.random.Generator) -> Parts:
    width, look = draw(rng, 0.5, 1.2), board_look(rng)
    metal, looks, full = made_of(rng, "metal", "black"), cloth_looks(rng, 3), draw(rng, 0.0, 0.7)
    tall = draw(rng, 0.08, 0.25)
    yield box((0.0, -width / 2, 0.0), (0.02, width / 2, tall), look)
    for y in np.linspace(-width * 0.42, width * 0.42, count(rng, 3, 7)).tolist():
        yield tube([(0.02, y, tall * 0.4), (0.07, y, tall * 0.35), (0.08, y, tall * 0.5 + 0.03)], 0.006, metal, 5)
        if chance(rng, full):
            yield _coat(rng, 0.03, y, tall * 0.5, pick(rng, looks), 0.0)
    if chance(rng, 0.5):
        yield box((0.0, -width / 2, tall), (draw(rng, 0.18, 0.28), width / 2, tall + 0.02), look)
        if chance(rng, 0.6):
            yield ornament(rng, 0.1, draw(rng, -0.3, 0.3) * width, tall + 0.02, 0.25)


@family("coat rack", "hall stand", held_out=True)
def _hall_stand(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.32, 0.42), draw(rng, 0.65, 1.1), draw(rng, 1.65, 2.0)
    look, looks = board_look(rng), cloth_looks(rng, 3)
    a, seat = -depth / 2, draw(rng, 0.42, 0.5)
    room = Room((a, -width / 2, 0.0), (depth / 2, width / 2, seat))
    parts = [carcass(room, 0.022, look), box((a, -width / 2, seat), (a + 0.02, width / 2, height), look)]
    parts.append(box((a, -width / 2, height - 0.02), (a + depth * 0.75, width / 2, height), look))
    if chance(rng, 0.5):
        parts += [box((a, y, seat), (0.0, y + 0.02, height), look) for y in (-width / 2, width / 2 - 0.02)]
    if chance(rng, 0.5):
        parts += doors(rng, front_style(rng, look), room, 2, 0.0)
    else:
        parts += _shoes(rng, (-width / 2, width / 2), 0.0, 0.022, 0.6)
    metal = material("metal", rng)
    for y in np.linspace(-width * 0.36, width * 0.36, count(rng, 3, 5)).tolist():
        parts.append(
            tube(
                [(a + 0.02, y, height - 0.25), (a + 0.1, y, height - 0.24), (a + 0.11, y, height - 0.18)],
                0.007,
                metal,
                5,
            )
        )
        if chance(rng, 0.4):
            parts.append(_coat(rng, a + 0.04, y, height - 0.22, pick(rng, looks), 0.0))
    return [joined(parts)]
