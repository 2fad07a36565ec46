"""Cabinets, bookshelves, and what carries a television."""

import numpy as np

from avlmaps_sim.furniture.carcass import (
    Panel,
    Room,
    board_look,
    book_looks,
    carcass,
    doors,
    drawers,
    front_style,
    inside,
    ornament,
    shelf_boards,
    shelf_things,
    split,
)
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.legs import cabinet_base, four_legs, leg_style
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes
from avlmaps_sim.shapes import box, prism, slab


def _fullness(rng: np.random.Generator) -> float:
    return pick(rng, (0.0, 0.35, 0.6, 0.6, 0.8, 0.95))


def filled(
    rng: np.random.Generator, room: Room, shelves: int, look: Material, full: float, board: float = 0.018
) -> tuple[list[Mesh], list[Support]]:  # fmt: skip
    """Return shelves in a room with what stands on them, and the free tops."""
    boards, bays = shelf_boards(room, shelves, board, look)
    books = book_looks(rng)
    (a, b, _), (d, e, _) = room.low, room.high
    parts, supports = boards, []
    for low, high in bays:
        parts += shelf_things(rng, Room((a, b, low), (d, e, high)), books, full)
        supports.append(Support((a + 0.02, b + 0.02), (d - 0.01, e - 0.02), low, high - low))
    return parts, supports if full < 0.1 else []


@family("bookshelf", "tall")
def _tall_bookshelf(rng: np.random.Generator) -> Parts:
    columns = pick(rng, (1, 1, 1, 2, 2, 3))
    depth, width, height = draw(rng, 0.22, 0.38), draw(rng, 0.5, 0.95) * columns, draw(rng, 1.5, 2.35)
    look, full = board_look(rng), _fullness(rng)
    board, lift = draw(rng, 0.016, 0.03), draw(rng, 0.03, 0.1)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, height))
    back = look if chance(rng, 0.7) else made_of(rng, "white", "black", "wood")
    yield carcass(room, board, look, back)
    yield box((-depth / 2, -width / 2, 0.0), (depth / 2 - 0.01, width / 2, lift), look)
    free = inside(room, board)
    shelves = count(rng, 3, 6 if columns < 3 else 4)
    for index, (y0, y1) in enumerate(split(free.low[1], free.high[1], [1.0] * columns)):
        if index:
            yield box((free.low[0], y0 - board / 2, free.low[2]), (free.high[0], y0 + board / 2, free.high[2]), look)
        bay = Room((free.low[0], y0 + board / 2, free.low[2]), (free.high[0], y1 - board / 2, free.high[2]))
        more, _ = filled(rng, bay, shelves, look, full / columns**0.5, board)
        yield from more


@family("bookshelf", "low")
def _low_bookshelf(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.25, 0.4), draw(rng, 0.7, 1.6), draw(rng, 0.65, 1.2)
    look, full = board_look(rng), _fullness(rng)
    base, lift = cabinet_base(rng, depth, width, look)
    height = max(height, lift + 0.5)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, height))
    free = inside(room, 0.02)
    yield from (base, carcass(room, 0.02, look))
    columns = 1 if width < 0.95 else 2
    for index, (y0, y1) in enumerate(split(free.low[1], free.high[1], [1.0] * columns)):
        if index:
            yield box((free.low[0], y0 - 0.01, free.low[2]), (free.high[0], y0 + 0.01, free.high[2]), look)
        more, _ = filled(
            rng,
            Room((free.low[0], y0 + 0.01, free.low[2]), (free.high[0], y1 - 0.01, free.high[2])),
            count(rng, 1, 3),
            look,
            full,
        )
        yield from more
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("bookshelf", "cubes")
def _cube_shelf(rng: np.random.Generator) -> Parts:
    cell, board = draw(rng, 0.32, 0.39), draw(rng, 0.018, 0.04)
    columns, rows = pick(rng, ((2, 2), (1, 4), (2, 4), (4, 2), (3, 3), (4, 4), (2, 3), (1, 3), (5, 2)))
    depth, width = draw(rng, 0.29, 0.4), cell * columns + board
    look, full = board_look(rng), _fullness(rng) / max(1.0, (columns * rows / 6) ** 0.5)
    low = pick(rng, (0.0, 0.0, 0.1))
    height = low + cell * rows + board
    x = depth / 2
    yield from [
        box((-x, -width / 2 + i * cell, low), (x, -width / 2 + i * cell + board, height), look)
        for i in range(columns + 1)
    ]
    yield from [
        box((-x, -width / 2, low + i * cell), (x, width / 2, low + i * cell + board), look) for i in range(rows + 1)
    ]
    if low:
        yield four_legs(depth, width, low, leg_style(rng, 0.03, 0.05, True), look)
    if chance(rng, 0.4):
        yield box((-x, -width / 2, low), (-x + 0.006, width / 2, height), look)
    books, bins = book_looks(rng), made_of(rng, "fabric", "wicker", "plastic")
    style = front_style(rng, look)
    for i in range(columns):
        for j in range(rows):
            y, z = -width / 2 + i * cell + board, low + j * cell + board
            bay = Room((-x, y, z), (x, y + cell - board, z + cell - board))
            kind = rng.random()
            if kind < 0.12:
                yield from doors(rng, style, Room(bay.low, (x - style.thick, *bay.high[1:])), 1, 0.0)
            elif kind < 0.28 and full:
                high = (x - 0.02, y + cell - board - 0.015, z + (cell - board) * draw(rng, 0.6, 0.9))
                yield box((-x + 0.02, y + 0.015, z), high, bins)
            else:
                yield from shelf_things(rng, bay, books, full)
    yield Support((-x, -width / 2), (x, width / 2), height)


@family("bookshelf", "ladder")
def _ladder_shelf(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.35, 0.5), draw(rng, 0.45, 0.95), draw(rng, 1.5, 2.0)
    look = board_look(rng)
    boards = look if chance(rng, 0.6) else board_look(rng)
    y, t = width / 2, draw(rng, 0.02, 0.035)
    yield from [strut((depth / 2, s * y, 0.0), (-depth / 2 + 0.06, s * y, height), t, 0.04, look) for s in (1, -1)]
    if chance(rng, 0.5):
        for s in (1, -1):
            yield box((-depth / 2, s * y - t / 2, 0.0), (-depth / 2 + 0.03, s * y + t / 2, height), look)
    books, supports = book_looks(rng), []
    full = _fullness(rng)
    levels = np.linspace(0.25, height - 0.12, count(rng, 4, 5)).tolist()
    for i, z in enumerate(levels):
        front = depth / 2 + 0.01 - (depth - 0.06) * z / height
        yield box((-depth / 2, -y, z), (front, y, z + 0.018), boards)
        top = levels[i + 1] if i + 1 < len(levels) else z + 0.3
        if front + depth / 2 > 0.12:
            yield from shelf_things(rng, Room((-depth / 2, -y + 0.03, z + 0.018), (front, y - 0.03, top)), books, full)
            supports.append(
                Support((-depth / 2 + 0.01, -y + 0.04), (front - 0.01, y - 0.04), z + 0.018, top - z - 0.03)
            )
    yield from supports if full < 0.1 else []


@family("bookshelf", "open rack")
def _open_rack(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.28, 0.42), draw(rng, 0.6, 1.3), draw(rng, 0.9, 2.0)
    frame, look = made_of(rng, "black", "metal", "wood", "white"), board_look(rng)
    yield four_legs(depth, width, height, leg_style(rng, 0.018, 0.035, True), frame)
    shelves = count(rng, 3, 5) if height > 1.3 else count(rng, 2, 3)
    levels = np.linspace(draw(rng, 0.06, 0.2), height - 0.03, shelves).tolist()
    books, full, supports = book_looks(rng), _fullness(rng), []
    (a, b), (d, e) = (-depth / 2 + 0.01, -width / 2 + 0.01), (depth / 2 - 0.01, width / 2 - 0.01)
    for i, z in enumerate(levels):
        yield box((a, b, z), (d, e, z + 0.02), look)
        top = levels[i + 1] if i + 1 < len(levels) else z + 0.35
        supports.append(Support((a, b), (d, e), z + 0.02, top - z - 0.04))
        yield from shelf_things(rng, Room((a, b + 0.02, z + 0.02), (d, e - 0.02, top)), books, full)
    if chance(rng, 0.5):
        for s in (1, -1):
            yield strut(
                (-depth / 2 + 0.01, s * b, 0.1), (-depth / 2 + 0.01, -s * b, height - 0.05), 0.015, 0.006, frame
            )
    yield from supports if full < 0.1 else []


@family("bookshelf", "staggered", held_out=True)
def _staggered_shelf(rng: np.random.Generator) -> Parts:
    depth, width = draw(rng, 0.24, 0.34), draw(rng, 0.7, 1.2)
    rows, cell, t = count(rng, 3, 6), draw(rng, 0.28, 0.38), draw(rng, 0.02, 0.035)
    look, full, books = board_look(rng), _fullness(rng), book_looks(rng)
    x, y = depth / 2, width / 2
    yield from [box((-x, -y, i * cell), (x, y, i * cell + t), look) for i in range(rows + 1)]
    cut = draw(rng, 0.25, 0.5) * y
    for i in range(rows):
        s = 1 if i % 2 else -1
        yield from [slab(0.0, place, i * cell + t, depth, t, cell - t, look) for place in (s * (y - t / 2), -s * cut)]
        lo, hi = sorted((s * (y - t), -s * (cut - t)))
        yield from shelf_things(rng, Room((-x, lo, i * cell + t), (x, hi, (i + 1) * cell)), books, full)


@family("bookshelf", "with doors", held_out=True)
def _closed_bookshelf(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.3, 0.42), draw(rng, 0.75, 1.3), draw(rng, 1.7, 2.3)
    look = board_look(rng)
    style, cut = front_style(rng, look), draw(rng, 0.6, 0.9)
    (a, b), (d, e) = (-depth / 2, -width / 2), (depth / 2, width / 2)
    out = pick(rng, (0.0, 0.1))
    yield carcass(Room((a, b, 0.06), (d + out, e, cut)), 0.02, look)
    yield box((a, b, 0.0), (d + out - 0.02, e, 0.06), look)
    yield from doors(rng, style, Room((a, b, 0.06), (d + out, e, cut)), count(rng, 2, 3), 0.08)
    upper = Room((a, b, cut), (d, e, height))
    more, _ = filled(rng, inside(upper, 0.02), count(rng, 2, 4), look, _fullness(rng))
    yield from (carcass(upper, 0.02, look), *more)
    if chance(rng, 0.35):
        yield from doors(rng, style, upper, 2, 0.1, "glass")


def _body(
    rng: np.random.Generator, depth: float, width: float, height: float, look: Material
) -> tuple[list[Mesh], Room, float]:  # fmt: skip
    base, lift = cabinet_base(rng, depth, width, look)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, max(height, lift + 0.25)))
    out = pick(rng, (0.0, 0.0, draw(rng, 0.005, 0.03)))
    top = look if chance(rng, 0.75) else made_of(rng, "wood", "marble", "white", "glass")
    (a, b, _), (d, e, f) = room.low, room.high
    lid = box((a, b - out, f), (d + 0.02 + out, e + out, f + 0.025), top)
    return [base, carcass(room, 0.02, look), lid], room, f + 0.025


def _bays(rng: np.random.Generator, room: Room, kinds: list[str], panels: tuple[Panel, ...], look: Material) -> Meshes:
    style = front_style(rng, look, panels)
    (a, b, c), (d, e, f) = room.low, room.high
    shares = [draw(rng, 0.8, 1.25) for _ in kinds]
    for kind, (y0, y1) in zip(kinds, split(b, e, shares), strict=True):
        bay = Room((a, y0, c), (d, y1, f))
        if y0 > b:
            yield box((a, y0 - 0.009, c), (d, y0 + 0.009, f), look)
        if kind == "drawers":
            yield from drawers(rng, style, bay, [1.0] * max(1, round((f - c) / draw(rng, 0.16, 0.24))))
        elif kind == "doors":
            yield from doors(rng, style, bay, 2 if y1 - y0 > 0.62 else 1, 0.07)
        else:
            free = Room((a + 0.01, y0 + 0.02, c + 0.02), (d - 0.01, y1 - 0.02, f - 0.02))
            more, _ = filled(rng, free, max(0, round((f - c) / 0.35) - 1), look, draw(rng, 0.2, 0.8))
            yield from more
            if kind == "glass":
                yield from doors(rng, style, bay, 2 if y1 - y0 > 0.62 else 1, 0.05, "glass")


@family("cabinet", "sideboard")
def _sideboard(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.36, 0.52), draw(rng, 1.1, 2.2), draw(rng, 0.65, 0.95)
    look = board_look(rng)
    parts, room, z = _body(rng, depth, width, height, look)
    kinds = [pick(rng, ("doors", "doors", "drawers", "open")) for _ in range(count(rng, 2, 4))]
    parts += _bays(rng, room, kinds, (), look)
    return [*parts, Support((-depth / 2, -width / 2), (depth / 2, width / 2), z)]


@family("cabinet", "display")
def _display_cabinet(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.33, 0.48), draw(rng, 0.5, 1.3), draw(rng, 1.4, 2.15)
    look = board_look(rng)
    parts, room, _ = _body(rng, depth, width, height, look)
    (a, b, c), (d, e, f) = room.low, room.high
    cut = c + (draw(rng, 0.4, 0.7) if chance(rng, 0.6) else 0.0)
    style = front_style(rng, look, ("flat", "framed", "raised"))
    leaves = 1 if width < 0.6 else 2
    if cut > c:
        parts += [
            *doors(rng, style, Room((a, b, c), (d, e, cut)), leaves, 0.05),
            box((a, b, cut - 0.01), (d, e, cut + 0.01), look),
        ]
    free = Room((a + 0.01, b + 0.02, cut + 0.02), (d - 0.02, e - 0.02, f - 0.02))
    more, _ = filled(rng, free, count(rng, 2, 4), look, draw(rng, 0.3, 0.7), 0.012)
    parts += [*more, *doors(rng, style, Room((a, b, cut), (d, e, f)), leaves, 0.06, "glass")]
    return parts


@family("cabinet", "cupboard")
def _cupboard(rng: np.random.Generator) -> Parts:
    depth, leaves, height = draw(rng, 0.3, 0.48), count(rng, 1, 2), draw(rng, 0.8, 1.75)
    width = draw(rng, 0.35, 0.55) * leaves
    look = board_look(rng)
    parts, room, z = _body(rng, depth, width, height, look)
    style = front_style(rng, look)
    (a, b, c), (d, e, f) = room.low, room.high
    cut = f - (draw(rng, 0.14, 0.24) if chance(rng, 0.4) else 0.0)
    parts += doors(rng, style, Room((a, b, c), (d, e, cut)), leaves, 0.08)
    if cut < f:
        for y0, y1 in split(b, e, [1.0] * leaves):
            parts += drawers(rng, style, Room((a, y0, cut), (d, y1, f)), [1.0])
    return [*parts, Support((a, b), (d, e), z)]


@family("cabinet", "hutch")
def _hutch(rng: np.random.Generator) -> Parts:
    depth, width, cut = draw(rng, 0.42, 0.55), draw(rng, 0.9, 1.6), draw(rng, 0.78, 0.95)
    look = board_look(rng)
    parts, room, z = _body(rng, depth, width, cut, look)
    (a, b, c), (d, e, f) = room.low, room.high
    style = front_style(rng, look, ("flat", "framed", "raised", "slatted"))
    mid, number = f - draw(rng, 0.14, 0.2), count(rng, 2, 3)
    parts += doors(rng, style, Room((a, b, c), (d, e, mid)), number, 0.05)
    for y0, y1 in split(b, e, [1.0] * number):
        parts += drawers(rng, style, Room((a, y0, mid), (d, y1, f)), [1.0])
    upper = Room(
        (a, b, z + pick(rng, (0.0, draw(rng, 0.15, 0.4)))),
        (a + depth * draw(rng, 0.5, 0.7), e, z + draw(rng, 0.8, 1.2)),
    )
    parts += [box((a, y, z), (upper.high[0], y + 0.02, upper.low[2] + 0.01), look) for y in (b, e - 0.02)]
    parts += [box((a, b, z), (a + 0.01, e, upper.low[2]), look), carcass(upper, 0.02, look)]
    more, _ = filled(rng, inside(upper, 0.02), count(rng, 1, 3), look, draw(rng, 0.3, 0.8))
    parts += more
    if chance(rng, 0.5):
        parts += doors(rng, style, upper, number, 0.05, "glass")
    return [*parts, Support((upper.high[0] + 0.02, b), (d, e), z)]


@family("cabinet", "bar", held_out=True)
def _corner_cabinet(rng: np.random.Generator) -> Parts:
    depth, width = draw(rng, 0.35, 0.45), draw(rng, 0.6, 0.95)
    low, height = draw(rng, 0.35, 0.6), draw(rng, 1.05, 1.45)
    look = board_look(rng)
    legs = look if chance(rng, 0.4) else made_of(rng, "metal", "black")
    room = Room((-depth / 2, -width / 2, low), (depth / 2, width / 2, height))
    yield carcass(room, 0.022, look)
    yield from doors(rng, front_style(rng, look, ("slatted", "raised", "flat")), room, 2, 0.15)
    yield four_legs(depth, width, low + 0.01, leg_style(rng, 0.02, 0.045), legs, draw(rng, 0.0, 0.04))
    yield from [ornament(rng, 0.0, y, height, 0.3) for y in (-0.2, 0.2) if chance(rng, 0.4)]
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("cabinet", "glass column", held_out=True)
def _glass_column(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.33, 0.45), draw(rng, 0.4, 0.95), draw(rng, 1.3, 1.9)
    look, glass = board_look(rng), material("glass", rng)
    (a, b), (d, e) = (-depth / 2, -width / 2), (depth / 2, width / 2)
    low = draw(rng, 0.06, 0.3)
    yield from (box((a, b, 0.0), (d, e, low), look), box((a, b, height - 0.04), (d, e, height), look))
    yield four_legs(depth, width, height - 0.02, leg_style(rng, 0.018, 0.03, True), look)
    more, _ = filled(
        rng, Room((a + 0.02, b + 0.03, low), (d - 0.02, e - 0.03, height - 0.04)), count(rng, 2, 4), glass, 0.5, 0.008
    )
    yield from (*more, *(box((a + 0.01, y, low), (d - 0.01, y + 0.004, height), glass) for y in (b + 0.01, e - 0.014)))
    yield box((d - 0.014, b + 0.01, low), (d - 0.01, e - 0.01, height), glass)


@family("tv cabinet", "low bench")
def _tv_bench(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.35, 0.5), draw(rng, 1.0, 2.2), draw(rng, 0.35, 0.58)
    look = board_look(rng)
    parts, room, z = _body(rng, depth, width, height, look)
    kinds = [pick(rng, ("open", "open", "drawers", "doors")) for _ in range(count(rng, 2, 4))]
    parts += _bays(rng, room, kinds, (), look)
    return [*parts, Support((-depth / 2, -width / 2), (depth / 2, width / 2), z)]


@family("tv cabinet", "open tiers")
def _tv_tiers(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.35, 0.5), draw(rng, 0.8, 1.6), draw(rng, 0.36, 0.62)
    look = material("glass", rng) if chance(rng, 0.4) else board_look(rng)
    frame = made_of(rng, "metal", "black", "wood")
    tiers = count(rng, 2, 3)
    levels = np.linspace(0.06, height - 0.02, tiers).tolist()
    yield from [slab(0.0, 0.0, z, depth, width, 0.02, look) for z in levels]
    yield four_legs(
        depth, width * draw(rng, 0.7, 1.0), height - 0.02, leg_style(rng, 0.03, 0.06, True), frame, inset=0.02
    )
    box_look = material("black", rng)
    for z in [level for level in levels[:-1] if chance(rng, 0.6)]:
        size = (0.25, draw(rng, 0.25, 0.42), draw(rng, 0.04, 0.08))
        yield slab(0.0, draw(rng, -0.2, 0.2) * width, z + 0.02, *size, box_look)
    yield Support((-depth * 0.48, -width * 0.48), (depth * 0.48, width * 0.48), height)


@family("tv cabinet", "legged")
def _tv_sideboard(rng: np.random.Generator) -> Parts:
    depth, width = draw(rng, 0.36, 0.46), draw(rng, 1.1, 1.9)
    low, height = draw(rng, 0.12, 0.22), draw(rng, 0.44, 0.62)
    look = made_of(rng, "wood", "wood", "white")
    legs = look if chance(rng, 0.5) else made_of(rng, "wood", "black", "metal")
    room = Room((-depth / 2, -width / 2, low), (depth / 2, width / 2, height))
    yield carcass(room, 0.022, look)
    yield four_legs(depth * 0.8, width * 0.85, low, leg_style(rng, 0.03, 0.045), legs, 0.04)
    kinds = pick(
        rng, (["doors", "open", "doors"], ["open", "doors"], ["drawers", "open"], ["doors", "open", "drawers"])
    )
    yield from _bays(rng, room, kinds, ("flat", "slatted", "framed"), look)
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("tv cabinet", "media wall")
def _media_wall(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.35, 0.45), draw(rng, 1.9, 2.8), draw(rng, 0.4, 0.55)
    look, tall = board_look(rng), draw(rng, 1.4, 2.1)
    parts, room, z = _body(rng, depth, width, height, look)
    parts += _bays(rng, room, [pick(rng, ("drawers", "doors", "open")) for _ in range(3)], (), look)
    (a, b, _), (d, e, _) = room.low, room.high
    wide = draw(rng, 0.3, 0.5)
    sides = [(b, b + wide), (e - wide, e)] if chance(rng, 0.6) else [(b, b + wide)]
    for y0, y1 in sides:
        tower = Room((a, y0, z), (d - 0.05, y1, tall))
        more, _ = filled(rng, inside(tower, 0.018), count(rng, 2, 4), look, draw(rng, 0.2, 0.6))
        parts += [carcass(tower, 0.018, look), *more]
        if chance(rng, 0.3):
            parts += doors(rng, front_style(rng, look), tower, 1, 0.0, pick(rng, ("glass", "flat")))
    if len(sides) == 2 and chance(rng, 0.5):
        parts.append(box((a, b + wide, tall - 0.25), (d - 0.1, e - wide, tall - 0.23), look))
    free = (b + wide + 0.02, e - wide - 0.02 if len(sides) == 2 else e)
    return [*parts, Support((a, free[0]), (d, free[1]), z)]


@family("tv cabinet", "corner stand", held_out=True)
def _corner_stand(rng: np.random.Generator) -> Parts:
    width, back, depth = draw(rng, 0.9, 1.25), draw(rng, 0.35, 0.55), draw(rng, 0.45, 0.55)
    height, look = draw(rng, 0.45, 0.6), board_look(rng)

    flat = [
        (depth / 2, -width / 2),
        (depth / 2, width / 2),
        (-depth / 6, width / 2),
        (-depth / 2, back / 2),
        (-depth / 2, -back / 2),
        (-depth / 6, -width / 2),
    ]
    levels = np.linspace(0.04, height - 0.025, count(rng, 2, 3)).tolist()
    yield from [prism(flat, z, 0.025, look) for z in levels]
    for s in (1, -1):
        yield box(
            (-depth / 6, s * (width / 2 - 0.012) - 0.012, 0.0),
            (depth / 2, s * (width / 2 - 0.012) + 0.012, height - 0.02),
            look,
        )
    yield box((-depth / 2, -back / 2, 0.0), (-depth / 2 + 0.02, back / 2, height - 0.02), look)
    if chance(rng, 0.5):
        room = Room((0.0, -width / 2 + 0.02, 0.06), (depth / 2 - 0.03, width / 2 - 0.02, height - 0.03))
        yield from doors(rng, front_style(rng, look), room, 2, 0.05, pick(rng, ("glass", "flat")))
    yield Support((-depth * 0.15, -width * 0.46), (depth * 0.48, width * 0.46), height)
