"""Wardrobes and chests of drawers of many builds."""

import numpy as np

from avlmaps_sim.furniture.carcass import (
    Room,
    board_look,
    carcass,
    cloth_looks,
    doors,
    drawers,
    folded,
    front_style,
    hanging,
    inside,
    shelf_boards,
    split,
)
from avlmaps_sim.furniture.catalogue import Parts, Support, family, finished
from avlmaps_sim.furniture.legs import cabinet_base, four_legs, leg_style, metal_frame
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, rim
from avlmaps_sim.furniture.upholstery import pillow
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, sheet, slab, tube


def _wardrobe_room(rng: np.random.Generator, wide: tuple[float, float], base: float) -> Room:
    depth, width, height = draw(rng, 0.5, 0.66), draw(rng, *wide), draw(rng, 1.75, 2.36)
    return Room((-depth / 2, -width / 2, base), (depth / 2, width / 2, max(height, base + 1.6)))


def _cornice(rng: np.random.Generator, room: Room, look: Material) -> list[Mesh]:
    if chance(rng, 0.6):
        return []
    (a, b, _), (d, e, f) = room.low, room.high
    out, tall = draw(rng, 0.01, 0.05), draw(rng, 0.03, 0.08)
    return [
        box((a, b - out * 0.5, f), (d + out * 0.5, e + out * 0.5, f + tall / 2), look),
        box((a, b - out, f + tall / 2), (d + out, e + out, f + tall), look),
    ]


def _on_top(rng: np.random.Generator, room: Room) -> list[Mesh]:
    if chance(rng, 0.8):
        return []
    (a, b, _), (d, e, f) = room.low, room.high
    parts = []
    for y in np.arange(b + 0.25, e - 0.2, draw(rng, 0.42, 0.6)).tolist():
        look = made_of(rng, "paper", "wicker", "plastic", "fabric")
        parts.append(slab((a + d) / 2, y, f, draw(rng, 0.25, 0.4), draw(rng, 0.25, 0.4), draw(rng, 0.12, 0.28), look))
    return parts


@family("wardrobe", "hinged")
def _hinged_wardrobe(rng: np.random.Generator) -> Parts:
    number = count(rng, 1, 4)
    look = board_look(rng)
    room = _wardrobe_room(rng, (0.42 * number + 0.06, 0.56 * number + 0.08), 0.0)
    base, lift = cabinet_base(rng, room.high[0] - room.low[0], room.high[1] - room.low[1], look)
    room = Room((*room.low[:2], lift), room.high)
    style = front_style(rng, look)
    yield from (base, carcass(room, 0.02, look), *_cornice(rng, room, look), *_on_top(rng, room))
    ajar = 0.12
    leaves = doors(rng, style, room, number, ajar)
    yield from (*leaves, *hanging(rng, inside(room, 0.02), cloth_looks(rng), 0.35))


@family("wardrobe", "doors over drawers")
def _drawer_wardrobe(rng: np.random.Generator) -> Parts:
    number = count(rng, 2, 3)
    look = board_look(rng)
    room = _wardrobe_room(rng, (0.42 * number + 0.06, 0.55 * number + 0.08), draw(rng, 0.04, 0.1))
    (a, b, c), (d, e, f) = room.low, room.high
    style = front_style(rng, look)
    cut, upper = c + draw(rng, 0.25, 0.55), f
    yield from (carcass(room, 0.02, look), *_cornice(rng, room, look), box((a, b, 0.0), (d - 0.03, e, c), look))
    for y0, y1 in split(b, e, [1.0] * count(rng, 1, number)):
        yield from drawers(rng, style, Room((a, y0, c), (d, y1, cut)), [1.0] * (1 if cut - c < 0.35 else 2))
    if chance(rng, 0.35):
        upper = f - draw(rng, 0.3, 0.45)
        yield from doors(rng, style, Room((a, b, upper), (d, e, f)), number, 0.0)
    yield from doors(rng, style, Room((a, b, cut), (d, e, upper)), number, 0.08)


@family("wardrobe", "sliding")
def _sliding_wardrobe(rng: np.random.Generator) -> Parts:
    number = count(rng, 2, 3)
    look = board_look(rng)
    room = _wardrobe_room(rng, (0.62 * number, 0.95 * number), 0.0)
    (a, b, c), (d, e, f) = room.low, room.high
    track = 0.03
    yield from (carcass(Room((a, b, c), (d + 0.06, e, f)), 0.022, look), box((a, b, 0.0), (d + 0.06, e, 0.05), look))
    metal = made_of(rng, "metal", "black", "white")
    kinds = [pick(rng, ("plain", "mirror", "banded", "glass")) for _ in range(number)]
    kinds = kinds if chance(rng, 0.4) else [kinds[0]] * number
    fronts = look if chance(rng, 0.5) else board_look(rng)
    for index, (y0, y1) in enumerate(split(b + 0.022, e - 0.022, [1.0] * number)):
        x = d + track * (index % 2)
        y0, y1 = max(y0 - 0.02, b + 0.022), min(y1 + 0.02, e - 0.022)
        top = f - 0.022
        fill = material("mirror" if kinds[index] == "mirror" else "white", rng) if kinds[index] != "plain" else fronts
        fill = fronts if kinds[index] == "banded" else fill
        yield box((x, y0, 0.06), (x + 0.02, y1, top), fronts if kinds[index] == "mirror" else fill)
        if kinds[index] == "mirror":
            yield sheet((x + 0.021, y0 + 0.02, 0.08), (0.0, y1 - y0 - 0.04, 0.0), (0.0, 0.0, top - 0.1), fill, True)
        yield from [box((x + 0.015, y, 0.06), (x + 0.028, y + 0.02, top), metal) for y in (y0, y1 - 0.02)]
        if kinds[index] == "banded":
            bands = np.linspace(0.06, top, count(rng, 3, 5))[1:-1].tolist()
            yield from [box((x + 0.015, y0, z), (x + 0.026, y1, z + 0.02), metal) for z in bands]


@family("wardrobe", "mirror doors")
def _mirror_wardrobe(rng: np.random.Generator) -> Parts:
    number = count(rng, 2, 4)
    look = board_look(rng)
    room = _wardrobe_room(rng, (0.42 * number, 0.55 * number), draw(rng, 0.04, 0.1))
    (a, b, c), (d, e, f) = room.low, room.high
    style = front_style(rng, look, ("flat", "framed", "raised"))
    yield from (carcass(room, 0.02, look), *_cornice(rng, room, look), box((a, b, 0.0), (d - 0.03, e, c), look))
    every = chance(rng, 0.4)
    middle = (number - 1) / 2
    for index, (y0, y1) in enumerate(split(b, e, [1.0] * number)):
        mirrored = every or abs(index - middle) < 0.9
        yield from doors(rng, style, Room((a, y0, c), (d, y1, f)), 1, 0.05, "mirror" if mirrored else None)


@family("wardrobe", "open")
def _open_wardrobe(rng: np.random.Generator) -> Parts:
    number = count(rng, 2, 3)
    look = board_look(rng)
    room = _wardrobe_room(rng, (0.55 * number, 0.9 * number), draw(rng, 0.03, 0.08))
    (a, b, c), (d, e, f) = room.low, room.high
    looks, style = cloth_looks(rng), front_style(rng, look)
    yield from (carcass(room, 0.02, look), box((a, b, 0.0), (d - 0.03, e, c), look))
    for index, (y0, y1) in enumerate(split(b + 0.01, e - 0.01, [draw(rng, 0.7, 1.3) for _ in range(number)])):
        if index:
            yield box((a, y0 - 0.01, c), (d, y0 + 0.01, f), look)
        bay = Room((a + 0.01, y0 + 0.012, c + 0.02), (d, y1 - 0.012, f - 0.02))
        cut = c + draw(rng, 0.35, 0.7) if chance(rng, 0.6) else c + 0.02
        if cut > c + 0.1:
            yield box((a, y0 + 0.01, cut - 0.02), (d, y1 - 0.01, cut), look)
            yield from drawers(
                rng,
                style,
                Room((a, y0 + 0.012, c + 0.02), (d - 0.02, y1 - 0.012, cut - 0.02)),
                [1.0] * count(rng, 1, 3),
            )
        upper = Room((bay.low[0], bay.low[1], cut), bay.high)
        if index == 0 or chance(rng, 0.5):
            yield from hanging(rng, upper, looks, 0.7)
        else:
            boards, bays = shelf_boards(upper, count(rng, 2, 4), 0.018, look)
            yield from boards
            for low, high in bays:
                yield from folded(rng, Room((a, y0, low), (d, y1, high)), looks)


@family("wardrobe", "garment rack", held_out=True)
def _garment_rack(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.4, 0.5), draw(rng, 0.8, 1.5), draw(rng, 1.4, 1.75)
    look = made_of(rng, "metal", "black", "wood", "white")
    r, half, t = draw(rng, 0.01, 0.018), width / 2, depth / 2
    for s in (1, -1):
        y = s * half
        if chance(rng, 0.5):
            yield tube([(t, y, 0.02), (0.0, y, height), (-t, y, 0.02)], r, look, 6)
        else:
            yield tube([(t, y, 0.02), (-t, y, 0.02)], r, look, 6)
            yield tube([(0.0, y, 0.02), (0.0, y, height)], r, look, 6)
    shelf = draw(rng, 0.1, 0.25)
    yield box((-t * 0.8, -half, shelf), (t * 0.8, half, shelf + 0.02), look)
    looks = cloth_looks(rng)
    yield from hanging(rng, Room((-t, -half, shelf), (t, half, height + 0.05)), looks, 0.8)
    yield from folded(rng, Room((-t, -half, shelf + 0.02), (t, half, shelf + 0.35)), looks)


@family("wardrobe", "armoire", held_out=True)
def _armoire(rng: np.random.Generator) -> Parts:
    look = material("wood", rng)
    room = _wardrobe_room(rng, (1.05, 1.4), draw(rng, 0.12, 0.2))
    (a, b, c), (d, e, f) = room.low, room.high
    style = front_style(rng, look, ("raised", "framed"))
    yield carcass(room, 0.03, look)
    yield from [box((d - 0.03, y, 0.0), (d + 0.03, y + 0.07, f + 0.02), look) for y in (b - 0.02, e - 0.05)]
    yield from [box((a, y, 0.0), (a + 0.07, y + 0.05, c), look) for y in (b, e - 0.05)]
    cut = c + draw(rng, 0.2, 0.34)
    yield from drawers(rng, style, Room((a, b + 0.05, c), (d, e - 0.05, cut)), [1.0], 0.0)
    yield from doors(rng, style, Room((a, b + 0.05, cut), (d, e - 0.05, f)), 2, 0.1)
    rise = draw(rng, 0.1, 0.22)
    for share in np.linspace(-0.9, 0.9, 9).tolist():
        y = share * (e - b) / 2
        tall = 0.05 + rise * (1 - share**2)
        yield box((d - 0.04, y - 0.12 * (e - b) / 2, f), (d + 0.01, y + 0.12 * (e - b) / 2, f + tall), look)
    yield box((a - 0.01, b - 0.04, f), (d + 0.05, e + 0.04, f + 0.05), look)


def _chest(
    rng: np.random.Generator, size: tuple[float, float, float], columns: list[list[float]], top: float = 0.0
) -> Parts:
    """Return a chest of a size (depth, width, height) whose top stands out by ``top``.

    Columns are shares of the heights of drawers from below, columns from the right to the left.
    """
    depth, width, height = size
    look = board_look(rng)
    style = front_style(rng, look)
    base, lift = cabinet_base(rng, depth, width, look)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, height - 0.02))
    (a, b, c), (d, e, f) = room.low, room.high
    parts = [base, carcass(room, 0.02, look)]
    for shares, (y0, y1) in zip(columns, split(b, e, [1.0] * len(columns)), strict=True):
        parts += drawers(rng, style, Room((a, y0, c), (d, y1, f)), shares)
    board = look if chance(rng, 0.75) else made_of(rng, "wood", "marble", "white")
    parts.append(box((a, b - top, f), (d + style.thick + top, e + top, f + draw(rng, 0.018, 0.035)), board))
    z = float(parts[-1].high[2])
    return [*parts, Support((a, b), (d, e), z)]


@family("chest of drawers", "low")
def _low_chest(rng: np.random.Generator) -> Parts:
    columns = count(rng, 2, 3)
    rows = count(rng, 2, 4)
    size = (draw(rng, 0.38, 0.55), draw(rng, 0.48, 0.62) * columns, draw(rng, 0.2, 0.25) * rows + draw(rng, 0.1, 0.2))
    return _chest(
        rng, size, [[draw(rng, 0.9, 1.1)] + [1.0] * (rows - 1)] * columns, pick(rng, (0.0, draw(rng, 0.0, 0.03)))
    )


@family("chest of drawers", "high")
def _high_chest(rng: np.random.Generator) -> Parts:
    rows = count(rng, 3, 6)
    size = (draw(rng, 0.36, 0.52), draw(rng, 0.5, 0.95), draw(rng, 0.18, 0.24) * rows + draw(rng, 0.08, 0.18))
    fall = draw(rng, 0.0, 0.12)
    return _chest(rng, size, [[1.0 - fall * i for i in range(rows)]], pick(rng, (0.0, draw(rng, 0.01, 0.04))))


@family("chest of drawers", "mixed")
def _mixed_chest(rng: np.random.Generator) -> Parts:
    depth, width = draw(rng, 0.4, 0.52), draw(rng, 0.75, 1.15)
    look = board_look(rng)
    style = front_style(rng, look, ("flat", "framed", "raised"))
    base, lift = cabinet_base(rng, depth, width, look)
    height = lift + draw(rng, 0.65, 1.05)
    (a, b, c), (d, e, f) = room = ((-depth / 2, -width / 2, lift), (depth / 2, width / 2, height))
    cut = f - draw(rng, 0.13, 0.2)
    yield base
    yield carcass(Room(*room), 0.02, look)
    yield from drawers(rng, style, Room((a, b, c), (d, e, cut)), [1.0] * count(rng, 2, 4))
    for y0, y1 in split(b, e, [1.0] * count(rng, 2, 3)):
        yield from drawers(rng, style, Room((a, y0, cut), (d, y1, f)), [1.0])
    out = draw(rng, 0.01, 0.04)
    yield box((a, b - out, f), (d + style.thick + out, e + out, f + 0.028), look)
    if chance(rng, 0.2):
        yield pillow(rng, 0.3, 0.3, 0.08, material("fabric", rng)).moved(0.0, draw(rng, -0.2, 0.2), f + 0.068)
    yield Support((a, b), (d, e), f + 0.028)


@family("chest of drawers", "door and drawers")
def _door_chest(rng: np.random.Generator) -> Parts:
    depth, width, height = draw(rng, 0.38, 0.52), draw(rng, 0.8, 1.5), draw(rng, 0.7, 1.1)
    look = board_look(rng)
    style = front_style(rng, look)
    base, lift = cabinet_base(rng, depth, width, look)
    height = max(height, lift + 0.55)
    room = Room((-depth / 2, -width / 2, lift), (depth / 2, width / 2, height - 0.02))
    (a, b, c), (d, e, f) = room.low, room.high
    kinds = pick(rng, (("drawers", "door"), ("door", "drawers"), ("door", "drawers", "door")))
    yield from (base, carcass(room, 0.018, look))
    for kind, (y0, y1) in zip(kinds, split(b, e, [1.5 if kind == "drawers" else 1.0 for kind in kinds]), strict=True):
        bay = Room((a, y0, c), (d, y1, f))
        yield from (
            drawers(rng, style, bay, [1.0] * count(rng, 3, 5)) if kind == "drawers" else doors(rng, style, bay, 1)
        )
    yield box((a, b - 0.01, f), (d + 0.03, e + 0.01, height), look)
    yield Support((a, b), (d, e), height)


@family("chest of drawers", "on a stand")
def _stand_chest(rng: np.random.Generator) -> Parts:
    depth, width = draw(rng, 0.38, 0.5), draw(rng, 0.7, 1.3)
    low, tall, look = draw(rng, 0.25, 0.42), draw(rng, 0.35, 0.6), board_look(rng)
    legs = look if chance(rng, 0.4) else made_of(rng, "metal", "black", "wood")
    style = front_style(rng, look)
    room = Room((-depth / 2, -width / 2, low), (depth / 2, width / 2, low + tall))
    (a, b, c), (d, e, f) = room.low, room.high
    yield carcass(room, 0.02, look)
    rows = [1.0] * count(rng, 2, 3)
    for y0, y1 in split(b, e, [1.0] * count(rng, 1, 2)):
        yield from drawers(rng, style, Room((a, y0, c), (d, y1, f)), rows)
    splay = draw(rng, 0.0, 0.06)
    if chance(rng, 0.7):
        yield four_legs(depth - 0.02, width - 0.04, low + 0.01, leg_style(rng, 0.025, 0.05), legs, splay)
    else:
        yield from metal_frame(rng, depth, width, low, legs)
    yield Support((a, b), (d, e), f)


@family("chest of drawers", "boxes in a frame")
def _basket_chest(rng: np.random.Generator) -> Parts:
    depth, width, rows = draw(rng, 0.36, 0.48), draw(rng, 0.36, 0.95), count(rng, 3, 5)
    columns, height = (2 if width > 0.7 else 1), 0.08 + rows * draw(rng, 0.17, 0.23)
    frame = made_of(rng, "wood", "metal", "white", "black")
    bins = made_of(rng, "wicker", "fabric", "plastic", "wood")
    yield four_legs(depth, width, height, leg_style(rng, 0.018, 0.035, True), frame)
    top = board_look(rng) if chance(rng, 0.7) else frame
    yield box((-depth / 2, -width / 2, height - 0.018), (depth / 2, width / 2, height), top)
    knob = made_of(rng, "metal", "black", "leather")
    for z0, z1 in split(0.05, height - 0.02, [1.0] * rows):
        for y0, y1 in split(-width / 2 + 0.03, width / 2 - 0.03, [1.0] * columns):
            out = draw(rng, 0.05, 0.2) if chance(rng, 0.08) else 0.0
            x, middle = depth / 2 + out, (y0 + y1) / 2
            yield box((x - depth + 0.02, y0 + 0.008, z0 + 0.012), (x, y1 - 0.008, z1 - 0.02), bins)
            yield box((x, middle - 0.04, z1 - 0.07), (x + 0.012, middle + 0.04, z1 - 0.05), knob)
    yield Support((-depth / 2, -width / 2), (depth / 2, width / 2), height)


@family("chest of drawers", "dresser with mirror", held_out=True)
def _mirror_dresser(rng: np.random.Generator) -> Parts:
    chest = finished(_mixed_chest(rng) if chance(rng, 0.5) else _low_chest(rng))
    top = max(chest.supports, key=lambda s: s.z)
    look = chest.mesh.materials[0]
    wide, tall = (top.high[1] - top.low[1]) * draw(rng, 0.4, 0.75), draw(rng, 0.5, 0.85)
    x, half = top.low[0] + 0.05, wide / 2
    posts = [
        box((x - 0.02, y - 0.02, top.z - 0.01), (x + 0.02, y + 0.02, top.z + tall * 0.7), look) for y in (-half, half)
    ]
    pane = ((0.0, wide - 0.06, 0.0), (0.0, 0.0, tall - 0.06))
    glass = sheet((0.012, 0.03 - half, 0.03), *pane, material("mirror", rng), fill=True)
    yield from (chest.mesh, *posts)
    frame = joined([rim((0.0 - half + 0.01, 0.0), (half - 0.01, tall), 0.035, (-0.012, 0.016), look), glass])
    yield frame.tilted("y", -draw(rng, 0.0, 0.18)).moved(x + 0.01, 0.0, top.z + 0.04)
    yield Support((x + 0.06, top.low[1]), top.high, top.z, 1.0)
