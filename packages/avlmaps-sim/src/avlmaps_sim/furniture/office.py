"""Office fittings: whiteboards, partitions, lockers and water dispensers."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, ellipsoid, lathe, rounded_box, sheet, slab, tube


def _board(rng: np.random.Generator, width: float, height: float) -> Meshes:
    """Return a board with frame, tray and writing, its back at x = 0 and its lower edge at z = 0."""
    face = pick(rng, ("white", "white", "white", "white", "glass", "black"))
    look = material(face, rng, (0.16, 0.28, 0.22) if face == "black" and chance(rng, 0.5) else None)
    frame, y = made_of(rng, "metal", "wood", "white", "black"), width / 2
    yield from (box((0.0, -y, 0.0), (0.015, y, height), look), rim((-y, 0.0), (y, height), 0.02, (0.0, 0.02), frame))
    if chance(rng, 0.7):
        tray = draw(rng, 0.2, 1.0) * y
        yield box((0.0, -tray, -0.015), (0.09, tray, 0.005), frame)
        for _ in range(count(rng, 1, 4)):
            spot, pen = draw(rng, -0.8, 0.6) * tray, material("plastic", rng)
            yield box((0.04, spot, 0.005), (0.055, spot + 0.12, 0.02), pen)
    ink = [material("plastic", rng), material("black", rng)]
    for _ in range(count(rng, 0, 14)):  # writing
        a, z = draw(rng, -0.85, 0.5) * y, draw(rng, 0.1, 0.9) * height
        long = draw(rng, 0.05, 0.4) * y
        yield sheet((0.0165, a, z), (0.0, long, draw(rng, -0.02, 0.02)), (0.0, 0.0, 0.012), pick(rng, ink))


@family("whiteboard", "wall board")
def _wall_board(rng: np.random.Generator) -> Parts:
    return _board(rng, draw(rng, 0.6, 2.6), draw(rng, 0.6, 1.3))


@family("whiteboard", "on wheels")
def _wheeled_board(rng: np.random.Generator) -> Parts:
    width, height, low = draw(rng, 0.9, 2.0), draw(rng, 0.8, 1.2), draw(rng, 0.55, 0.85)
    metal, foot, y = made_of(rng, "metal", "white", "black"), draw(rng, 0.22, 0.32), width / 2 + 0.03
    yield from [part.moved(-0.01, 0.0, low) for part in _board(rng, width, height)]
    for side in (-1, 1):
        yield box((-0.02, side * y - 0.02, 0.08), (0.02, side * y + 0.02, low + height * 0.8), metal)
        yield box((-foot, side * y - 0.02, 0.06), (foot, side * y + 0.02, 0.1), metal)
        for x in (-foot, foot):
            yield ellipsoid((x, side * y, 0.03), (0.03, 0.015, 0.03), material("black", rng), 8, 5)
    yield box((-0.015, -y, 0.2), (0.015, y, 0.24), metal)


@family("whiteboard", "flip chart", held_out=True)
def _flip_chart(rng: np.random.Generator) -> Parts:
    width, height, top = draw(rng, 0.6, 0.75), draw(rng, 0.85, 1.05), draw(rng, 1.7, 1.95)
    metal, lean = made_of(rng, "metal", "black", "white"), 0.12
    board = joined(
        [
            *_board(rng, width, height),
            box((0.016, -width * 0.48, 0.08), (0.03, width * 0.48, height), material("paper", rng)),
        ]
    )
    yield board.tilted("y", -lean).moved(0.0, 0.0, top - height)
    low, high = lean * (top - height) - 0.03, -lean * height - 0.03  # the front legs follow the board's back
    for y, x in ((-0.4, low), (0.4, low), (0.0, -0.65)):
        yield strut((x, y, 0.0), (high, y * 0.5, top - 0.03), 0.025, 0.025, metal)


@family("partition", "panels")
def _partition(rng: np.random.Generator) -> Parts:
    number, each, tall = count(rng, 1, 3), draw(rng, 0.6, 1.2), draw(rng, 1.1, 1.9)
    look, frame = made_of(rng, "fabric", "fabric", "painted", "white"), made_of(rng, "metal", "white", "black")
    thick, lift, bend, x, y = draw(rng, 0.025, 0.07), draw(rng, 0.0, 0.15), draw(rng, -0.5, 0.5), 0.0, 0.0
    glazed = tall * draw(rng, 0.6, 0.75) if chance(rng, 0.3) else tall
    for panel in range(number):
        turn = bend * panel
        body = [rim((0.0, lift), (each, tall), 0.03, (-thick / 2, thick / 2), frame)]
        body.append(box((-thick * 0.4, 0.03, lift + 0.03), (thick * 0.4, each - 0.03, glazed - 0.03), look))
        if glazed < tall:
            body.append(box((-0.004, 0.03, glazed - 0.03), (0.004, each - 0.03, tall - 0.03), material("glass", rng)))
        feet = (0.05, each - 0.05) if lift > 0.03 else ()
        body += [box((-0.18, f - 0.03, 0.0), (0.18, f + 0.03, 0.02), frame) for f in feet]
        body += [box((-0.02, f - 0.02, 0.0), (0.02, f + 0.02, lift + 0.02), frame) for f in feet]
        yield joined(body).turned(turn).moved(x, y)
        x, y = x - each * float(np.sin(turn)), y + each * float(np.cos(turn))


@family("partition", "folding screen")
def _screen(rng: np.random.Generator) -> Parts:
    number, each, tall = count(rng, 3, 5), draw(rng, 0.38, 0.55), draw(rng, 1.5, 1.9)
    look, frame = made_of(rng, "paper", "fabric", "wood", "white"), made_of(rng, "wood", "black", "white")
    bend, columns, rows, x = draw(rng, 0.25, 0.7), count(rng, 1, 3), count(rng, 1, 6), 0.0
    for panel in range(number):
        turn = bend if panel % 2 else -bend
        body = [rim((0.0, 0.0), (each, tall), 0.035, (-0.012, 0.012), frame)]
        body.append(box((-0.004, 0.035, 0.1), (0.004, each - 0.035, tall - 0.035), look))
        uprights = np.linspace(0.035, each - 0.035, columns + 1)[1:-1].tolist()
        bars = np.linspace(0.1, tall - 0.035, rows + 1)[:-1].tolist()
        body += [box((-0.01, y - 0.007, 0.035), (0.01, y + 0.007, tall - 0.035), frame) for y in uprights]
        body += [box((-0.01, 0.035, z - 0.007), (0.01, each - 0.035, z + 0.007), frame) for z in bars]
        yield joined(body).turned(turn).moved(x, panel * each * float(np.cos(bend)))
        x += each * float(np.sin(bend)) * (1 if panel % 2 == 0 else -1)


@family("partition", "slats", held_out=True)
def _slats(rng: np.random.Generator) -> Parts:
    width, tall, look = draw(rng, 0.8, 2.0), draw(rng, 1.6, 2.4), material("wood", rng)
    wide, pitch, deep = draw(rng, 0.02, 0.05), draw(rng, 0.07, 0.14), draw(rng, 0.04, 0.1)
    slats = max(int(width / pitch), 4)
    yield from [slab(0.0, i * pitch, 0.04, deep, wide, tall - 0.08, look) for i in range(slats)]
    middle, long = (slats - 1) * pitch / 2, (slats - 1) * pitch + 2 * wide
    yield from [slab(0.0, middle, z, deep * 1.3, long, 0.04, look) for z in (0.0, tall - 0.04)]


def _locker_door(
    rng: np.random.Generator, y: float, z: float, wide: float, tall: float, look: Material, kind: str
) -> Meshes:
    """Return a door in the plane x = 0 with vents or a lock, from (y, z)."""
    gap, dark = 0.006, material("black", rng)
    yield box((0.0, y + gap, z + gap), (0.018, y + wide - gap, z + tall - gap), look)
    if kind == "vents":
        for row in range(4):
            high = z + tall * 0.88 - row * 0.035
            yield box((0.018, y + wide * 0.25, high), (0.021, y + wide * 0.75, high + 0.012), dark)
    yield box(
        (0.018, y + wide * 0.82, z + tall * 0.48), (0.03, y + wide * 0.9, z + tall * 0.48 + min(0.08, tall * 0.2)), dark
    )
    if chance(rng, 0.5):
        yield box(
            (0.018, y + wide * 0.35, z + tall * 0.62),
            (0.02, y + wide * 0.65, z + tall * 0.62 + 0.03),
            material("paper", rng),
        )


def _lockers(rng: np.random.Generator, columns: int, rows: int, wide: float, tall: float, kind: str) -> Parts:
    deep, foot = draw(rng, 0.35, 0.52), draw(rng, 0.0, 0.15)
    body = made_of(rng, "metal", "painted", "white")
    doors = [made_of(rng, "metal", "painted", "plastic", "wood") for _ in range(count(rng, 1, 2))]
    width, sloped = columns * wide, chance(rng, 0.2)
    parts = [box((-deep, 0.0, foot), (0.0, width, foot + tall), body)]
    if foot > 0.03:
        parts += [slab(x, y, 0.0, 0.04, 0.04, foot, body) for x in (-deep + 0.03, -0.03) for y in (0.03, width - 0.03)]
    for column in range(columns):
        for row in range(rows):
            look = doors[(column + row) % len(doors)]
            parts += _locker_door(rng, column * wide, foot + row * tall / rows, wide, tall / rows, look, kind)
    if sloped:
        top = foot + tall
        line = np.array([[(-deep, y, top + 0.2), (0.0, y, top)] for y in (0.0, width)])
        parts.append(cloth(line, body))
        parts.append(box((-deep, 0.0, top), (-deep + 0.01, width, top + 0.2), body))
        return parts
    return [*parts, Support((-deep, 0.0), (0.0, width), foot + tall, 0.5)]


@family("locker", "tall doors")
def _tall_locker(rng: np.random.Generator) -> Parts:
    return _lockers(rng, count(rng, 1, 5), count(rng, 1, 2), draw(rng, 0.28, 0.42), draw(rng, 1.6, 1.95), "vents")


@family("locker", "boxes")
def _box_locker(rng: np.random.Generator) -> Parts:
    rows = count(rng, 3, 6)
    kind = pick(rng, ("vents", "plain"))
    return _lockers(rng, count(rng, 1, 5), rows, draw(rng, 0.28, 0.45), min(rows * draw(rng, 0.28, 0.42), 1.95), kind)


@family("locker", "open cubbies", held_out=True)
def _cubbies(rng: np.random.Generator) -> Parts:
    columns, rows, side = count(rng, 2, 5), count(rng, 2, 4), draw(rng, 0.3, 0.4)
    deep, look, t = draw(rng, 0.3, 0.45), made_of(rng, "wood", "white", "painted"), 0.018
    width, tall = columns * side, rows * side
    yield from [box((0.0, i * side - t / 2, 0.0), (deep, i * side + t / 2, tall), look) for i in range(columns + 1)]
    yield from [box((0.0, 0.0, i * side), (deep, width, i * side + t), look) for i in range(rows + 1)]
    yield box((0.0, 0.0, 0.0), (0.006, width, tall), look)
    for column in range(columns):
        for row in range(rows):
            if chance(rng, 0.35):
                fill = made_of(rng, "fabric", "plastic", "painted")
                low, high = (0.03, column * side + 0.04, row * side + t), (deep - 0.02, (column + 1) * side - 0.04, 0.0)
                yield rounded_box(low, (*high[:2], low[2] + side * draw(rng, 0.4, 0.85)), 0.02, fill)
    yield Support((0.0, 0.0), (deep, width), tall + t, 0.5)


@family("water dispenser", "bottle on top")
def _bottle_dispenser(rng: np.random.Generator) -> Parts:
    wide, tall, deep = draw(rng, 0.27, 0.34), draw(rng, 0.85, 1.02), draw(rng, 0.28, 0.36)
    look = made_of(rng, "white", "white", "black", "plastic", "metal")
    water = material("glass", rng, (0.45, 0.65, 0.85))
    yield rounded_box((-deep / 2, -wide / 2, 0.0), (deep / 2, wide / 2, tall), 0.025, look)
    r = wide * 0.43
    rows = [(0.03, tall), (r * 0.7, tall + 0.05), (r, tall + 0.09), (r, tall + 0.19), (r * 0.94, tall + 0.21),
            (r, tall + 0.23), (r, tall + 0.35), (r * 0.85, tall + 0.38)]  # fmt: skip
    yield from (lathe(rows, water, sides=16), *_taps(rng, deep / 2, wide, tall * draw(rng, 0.68, 0.8)))


def _taps(rng: np.random.Generator, x: float, wide: float, z: float) -> Meshes:
    dark = material("black", rng)
    for side, colour in ((-1, (0.2, 0.35, 0.8)), (1, (0.8, 0.15, 0.1))):
        tap = material("plastic", rng, colour)
        yield box((x, side * wide * 0.18 - 0.015, z), (x + 0.05, side * wide * 0.18 + 0.015, z + 0.035), tap)
    yield box((x, -wide * 0.36, z - 0.2), (x + 0.07, wide * 0.36, z - 0.18), dark)
    yield box((x, -wide * 0.38, z - 0.18), (x + 0.004, wide * 0.38, z + 0.07), dark)


@family("water dispenser", "tower")
def _tower_dispenser(rng: np.random.Generator) -> Parts:
    wide, tall, deep = draw(rng, 0.26, 0.42), draw(rng, 1.0, 1.4), draw(rng, 0.3, 0.4)
    look, dark = made_of(rng, "white", "metal", "black"), material("black", rng)
    x, z = deep / 2, tall * draw(rng, 0.6, 0.7)
    hollow, deep_in = draw(rng, 0.22, 0.3), 0.14
    yield box((-x, -wide / 2, 0.0), (x, wide / 2, z), look)
    yield box((-x, -wide / 2, z + hollow), (x, wide / 2, tall), look)
    yield box((-x, -wide / 2, z), (x - deep_in, wide / 2, z + hollow), look)
    yield box((x - deep_in, -wide * 0.46, z), (x - deep_in + 0.003, wide * 0.46, z + hollow), dark)
    for s in (-1, 1):
        yield box((x - deep_in, s * wide / 2 - 0.02 * (s > 0), z), (x, s * wide / 2 + 0.02 * (s < 0), z + hollow), look)
    yield from [cylinder(x - 0.07, s * 0.05, z + hollow - 0.06, 0.012, 0.06, look, 8) for s in (-1, 1)]
    yield box((x, -wide * 0.3, z + hollow + 0.05), (x + 0.003, wide * 0.3, z + hollow + 0.11), dark)


@family("water dispenser", "fountain", held_out=True)
def _fountain(rng: np.random.Generator) -> Parts:
    wide, tall, deep = draw(rng, 0.32, 0.48), draw(rng, 0.75, 0.95), draw(rng, 0.3, 0.42)
    steel = material("metal", rng, (0.7, 0.7, 0.72))
    yield rounded_box((-deep / 2, -wide / 2, 0.0), (deep / 2, wide / 2, tall), 0.03, steel)
    bowl = [(0.12, tall), (0.15, tall + 0.05), (0.13, tall + 0.05), (0.05, tall + 0.01)]
    yield lathe(bowl, steel, sides=16)
    path = [(-0.08, 0.0, tall), (-0.08, 0.0, tall + 0.12), (-0.02, 0.0, tall + 0.16), (0.02, 0.0, tall + 0.13)]
    yield tube(path, 0.01, steel, 7)
    yield box((deep / 2, -0.06, tall - 0.1), (deep / 2 + 0.02, 0.06, tall - 0.05), material("black", rng))
