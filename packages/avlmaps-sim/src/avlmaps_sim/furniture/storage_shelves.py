"""Bookshelves, cabinets, tv cabinets."""

import numpy as np

from avlmaps_sim.furniture.carcass import Room, board_look, carcass, doors, front_style, inside, shelf_boards, split
from avlmaps_sim.furniture.catalogue import Parts, Support, family
from avlmaps_sim.furniture.contents import book_looks, shelf_things
from avlmaps_sim.furniture.legs import cabinet_base, four_legs, leg_style
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.shapes import box, slab


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
