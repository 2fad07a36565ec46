"""Chests of drawers."""

import numpy as np

from avlmaps_sim.furniture.carcass import Room, board_look, carcass, doors, drawers, front_style, split
from avlmaps_sim.furniture.catalogue import Parts, Support, family, finished
from avlmaps_sim.furniture.legs import cabinet_base, four_legs, leg_style
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, rim
from avlmaps_sim.furniture.table_parts import metal_frame
from avlmaps_sim.furniture.upholstery import pillow
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import joined
from avlmaps_sim.shapes import box, sheet


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
def low_chest(rng: np.random.Generator) -> Parts:
    """Return a broad chest with two or three columns of drawers."""
    columns = count(rng, 2, 3)
    rows = count(rng, 2, 4)
    size = (draw(rng, 0.38, 0.55), draw(rng, 0.48, 0.62) * columns, draw(rng, 0.2, 0.25) * rows + draw(rng, 0.1, 0.2))
    return _chest(
        rng, size, [[draw(rng, 0.9, 1.1)] + [1.0] * (rows - 1)] * columns, pick(rng, (0.0, draw(rng, 0.0, 0.03)))
    )


@family("chest of drawers", "high")
def high_chest(rng: np.random.Generator) -> Parts:
    """Return a chest of one column of drawers that grow taller downwards."""
    rows = count(rng, 3, 6)
    size = (draw(rng, 0.36, 0.52), draw(rng, 0.5, 0.95), draw(rng, 0.18, 0.24) * rows + draw(rng, 0.08, 0.18))
    fall = draw(rng, 0.0, 0.12)
    return _chest(rng, size, [[1.0 - fall * i for i in range(rows)]], pick(rng, (0.0, draw(rng, 0.01, 0.04))))


@family("chest of drawers", "mixed")
def mixed_chest(rng: np.random.Generator) -> Parts:
    """Return a chest with broad drawers below two or three small ones side by side."""
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
def door_chest(rng: np.random.Generator) -> Parts:
    """Return a chest with drawers at one side and a door at the other, or doors on both sides of them."""
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
def stand_chest(rng: np.random.Generator) -> Parts:
    """Return a shallow box of drawers carried by long legs, round rods or a frame of metal."""
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
def basket_chest(rng: np.random.Generator) -> Parts:
    """Return an open frame of posts or rods with deep boxes, baskets or cloth bins for drawers."""
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
def mirror_dresser(rng: np.random.Generator) -> Parts:
    """Return a chest on which a mirror stands between two posts, upright or swung back."""
    chest = finished(mixed_chest(rng) if chance(rng, 0.5) else low_chest(rng))
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
