"""Parts of cabinets (carcasses, doors and drawers of many styles, handles, shelves), and what they hold."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, rim
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import box, ellipsoid, lathe, loft, prism, rounded_rectangle, sheet, tube

Panel = Literal["flat", "framed", "raised", "glass", "mirror", "slatted"]
Grip = Literal["bar", "knob", "cup", "bow", "groove", "none"]


_SHADOW = Material((0.05, 0.045, 0.04), gloss=0.0)


@dataclass(frozen=True, slots=True)
class Room:
    """A box in the air that a carcass or its inside fills, metres; the front is at its greatest x."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class FrontStyle:
    """How the doors and drawers of one piece look.

    ``gap`` and ``thick`` are in metres; ``metal`` is that of the grips.
    """

    panel: Panel
    grip: Grip
    gap: float
    thick: float
    look: Material
    metal: Material


def board_look(rng: np.random.Generator) -> Material:
    """Draw the materials of a cabinet."""
    return made_of(rng, "wood", "wood", "wood", "white", "white", "painted", "black")


def front_style(rng: np.random.Generator, look: Material, panels: tuple[Panel, ...] = ()) -> FrontStyle:
    """Draw a style of doors and drawers; the fronts often differ from the body."""
    panel: Panel = pick(rng, panels or ("flat", "flat", "flat", "framed", "raised", "slatted"))
    grip: Grip = pick(rng, ("bar", "knob", "knob", "cup", "bow", "groove", "none"))
    fronts = look if chance(rng, 0.7) else board_look(rng)
    metal = made_of(rng, "metal", "metal", "black", "wood")
    return FrontStyle(panel, grip, draw(rng, 0.003, 0.01), draw(rng, 0.015, 0.025), fronts, metal)


def carcass(room: Room, board: float, look: Material, back: Material | None = None) -> Mesh:
    """Return a body open to the front: two sides, top, bottom and a thin back."""
    (a, b, c), (d, e, f) = room.low, room.high
    return joined(
        [
            box((a, b, c), (d, b + board, f), look),
            box((a, e - board, c), (d, e, f), look),
            box((a, b + board, c), (d, e - board, c + board), look),
            box((a, b + board, f - board), (d, e - board, f), look),
            box((a, b + board, c + board), (a + 0.008, e - board, f - board), back or look),
        ]
    )


def inside(room: Room, board: float) -> Room:
    """Return the free room within a carcass."""
    (a, b, c), (d, e, f) = room.low, room.high
    return Room((a + 0.008, b + board, c + board), (d, e - board, f - board))


def grip(style: FrontStyle, x: float, y: float, z: float, upright: bool, length: float) -> Mesh:
    """Return a handle on a front whose face lies at x, its middle at (y, z)."""
    half = length / 2
    if style.grip == "knob":
        return ellipsoid((x + 0.014, y, z), (0.016, 0.016, 0.016), style.metal, 6, 4)
    if style.grip == "cup":
        half = min(half, 0.05)
        return ellipsoid((x, y, z), (0.026, half, 0.018), style.metal, 8, 4)
    along = (0.0, 0.0, half) if upright else (0.0, half, 0.0)
    ends = [(y - along[1], z - along[2]), (y + along[1], z + along[2])]
    (y0, z0), (y1, z1) = ends
    if style.grip == "bar":
        bar = box(
            (x + 0.022, min(y0, y1) - 0.005, min(z0, z1) - 0.005),
            (x + 0.034, max(y0, y1) + 0.005, max(z0, z1) + 0.005),
            style.metal,
        )
        inner = 0.8
        feet = [box((x, y + s * inner * along[1] - 0.004, z + s * inner * along[2] - 0.004),
                    (x + 0.024, y + s * inner * along[1] + 0.004, z + s * inner * along[2] + 0.004), style.metal)
                for s in (1, -1)]  # fmt: skip
        return joined([bar, *feet])
    half_path = [(x, y0, z0), (x + 0.028, y0 * 0.8 + y1 * 0.2, z0 * 0.8 + z1 * 0.2),
                 (x + 0.028, y0 * 0.2 + y1 * 0.8, z0 * 0.2 + z1 * 0.8), (x, y1, z1)]  # fmt: skip
    return tube(half_path, 0.005, style.metal, 5)


def _panel(style: FrontStyle, room: Room, panel: Panel, glass: Material) -> Mesh:
    (a, b, c), (d, e, f) = room.low, room.high
    frame = min(0.07, 0.25 * (e - b), 0.25 * (f - c))
    if panel == "flat":
        return box(room.low, room.high, style.look)
    parts = [rim((b, c), (e, f), frame, (a, d), style.look)]
    inner_low, inner_high = (b + frame, c + frame), (e - frame, f - frame)
    if panel in ("glass", "mirror"):
        x = (a + d) / 2
        parts.append(sheet((x, inner_low[0], inner_low[1]), (0.0, inner_high[0] - inner_low[0], 0.0),
                           (0.0, 0.0, inner_high[1] - inner_low[1]), glass, fill=True))  # fmt: skip
        return joined(parts)
    parts.append(box((a, *inner_low), (d - 0.008, *inner_high), style.look))
    if panel == "raised":
        inset = min(0.03, 0.2 * (inner_high[0] - inner_low[0]), 0.2 * (inner_high[1] - inner_low[1]))
        parts.append(box((d - 0.009, inner_low[0] + inset, inner_low[1] + inset),
                         (d - 0.001, inner_high[0] - inset, inner_high[1] - inset), style.look))  # fmt: skip
    elif panel == "slatted":
        number = max(int((inner_high[0] - inner_low[0]) / 0.09), 2)
        parts += [
            box((d - 0.009, y - 0.008, inner_low[1]), (d - 0.001, y + 0.008, inner_high[1]), style.look)
            for y in np.linspace(inner_low[0], inner_high[0], number + 1)[1:-1].tolist()
        ]
    return joined(parts)


def glazing(rng: np.random.Generator, panel: Panel) -> Material:
    """Return the pane of a glazed or mirrored front."""
    return material("mirror" if panel == "mirror" else "glass", rng)


def door(
    rng: np.random.Generator, style: FrontStyle, room: Room, hinge: int, open_rad: float = 0.0,
    panel: Panel | None = None,
) -> Mesh:  # fmt: skip
    """Return a door with its handle; ``hinge`` is 1 where it turns round its greatest y, -1 round its least."""
    (_, b, c), (d, e, f) = room.low, room.high
    fill = panel or style.panel
    parts = [_panel(style, room, fill, glazing(rng, fill))]
    inset = min(0.04, 0.2 * (e - b))
    y = b + inset if hinge > 0 else e - inset
    tall = f - c
    if style.grip in ("bar", "knob", "cup", "bow"):
        z = c + tall * 0.5 if tall > 1.2 else (f - 0.12 if c < 0.7 else c + 0.12)
        parts.append(grip(style, d, y, z, style.grip != "cup", min(draw(rng, 0.1, 0.3), tall * 0.5)))
    mesh = joined(parts)
    if not open_rad:
        return mesh
    edge = e if hinge > 0 else b
    return mesh.moved(-d, -edge).turned(hinge * open_rad).moved(d, edge)


def drawer(rng: np.random.Generator, style: FrontStyle, room: Room, pulled: float = 0.0) -> Mesh:
    """Return a drawer's front with its handles, and its box where it stands open by ``pulled`` metres."""
    (a, b, c), (d, e, f) = room.low, room.high
    panel: Panel = style.panel if style.panel in ("flat", "framed", "raised") else "flat"
    parts = [_panel(style, room, panel, style.look)]
    wide, tall = e - b, f - c
    pair = wide > 0.65 and style.grip in ("knob", "cup", "bow")
    z = c + tall * (0.5 if tall < 0.3 else 0.72)
    places = (b + wide * 0.22, e - wide * 0.22) if pair else ((b + e) / 2,)
    if style.grip not in ("groove", "none"):
        parts += [grip(style, d, y, z, False, min(0.14 if pair else 0.2, wide * 0.5)) for y in places]
    if style.grip == "groove":
        parts.append(box((d, b, f - 0.012), (d + 0.012, e, f), style.look))
    if pulled:
        low, high, t = a - pulled - 0.05, a, 0.01
        walls = [box((low, y, c + 0.02), (high, y + t, f - 0.03), style.look) for y in (b + 0.02, e - 0.02 - t)]
        parts += [*walls, box((low, b + 0.02, c + 0.02), (high, e - 0.02, c + 0.03), style.look)]
    return joined(parts).moved(x=pulled)


def split(low: float, high: float, shares: list[float]) -> list[tuple[float, float]]:
    """Return the bounds of parts of a length by their shares."""
    edge = low + (high - low) * np.concatenate([[0.0], np.cumsum(shares) / np.sum(shares)])
    return [(float(edge[i]), float(edge[i + 1])) for i in range(len(shares))]


def _gap(x: float, low: tuple[float, float], high: tuple[float, float]) -> Mesh:
    (b, c), (e, f) = low, high
    return sheet((x + 0.001, b, c), (0.0, e - b, 0.0), (0.0, 0.0, f - c), _SHADOW)


def doors(
    rng: np.random.Generator, style: FrontStyle, room: Room, number: int, ajar: float = 0.1, panel: Panel | None = None
) -> list[Mesh]:  # fmt: skip
    """Return doors side by side before a room, hinged in pairs; a share of them stands open."""
    (_, b, c), (d, e, f) = room.low, room.high
    parts = []
    for index, (y0, y1) in enumerate(split(b, e, [1.0] * number)):
        leaf = Room(
            (d, y0 + style.gap / 2, c + style.gap / 2), (d + style.thick, y1 - style.gap / 2, f - style.gap / 2)
        )
        hinge = -1 if index % 2 == 0 and index < number - 1 else 1
        opened = draw(rng, 0.2, 1.7) if chance(rng, ajar) else 0.0
        parts.append(door(rng, style, leaf, hinge, opened, panel))
        if not opened and (panel or style.panel) != "glass":
            parts.append(_gap(d, (y0, c), (y1, f)))
    return parts


def drawers(
    rng: np.random.Generator, style: FrontStyle, room: Room, shares: list[float], ajar: float = 0.06
) -> list[Mesh]:
    """Return drawers one above the other before a room, from below by their shares of its height."""
    (_, b, c), (d, e, f) = room.low, room.high
    parts = []
    for z0, z1 in split(c, f, shares):
        low = (d, b + style.gap / 2, z0 + style.gap / 2)
        front = Room(low, (d + style.thick, e - style.gap / 2, z1 - style.gap / 2))
        pulled = draw(rng, 0.05, 0.25) if chance(rng, ajar) else 0.0
        parts.append(drawer(rng, style, front, pulled))
        if not pulled:
            parts.append(_gap(d, (b, z0), (e, z1)))
    return parts


def shelf_boards(room: Room, number: int, board: float, look: Material) -> tuple[list[Mesh], list[tuple[float, float]]]:
    """Return evenly spaced shelves within a room, and the bounds in z of the bays between them."""
    (a, b, c), (d, e, f) = room.low, room.high
    bays = split(c, f, [1.0] * (number + 1))
    boards = [box((a, b, top - board / 2), (d - 0.005, e, top + board / 2), look) for _, top in bays[:-1]]
    free = [
        (lo + (board / 2 if i else 0.0), hi - (board / 2 if i < number else 0.0)) for i, (lo, hi) in enumerate(bays)
    ]
    return boards, free


_BOOKS: tuple[Triple, ...] = (
    (0.55, 0.13, 0.12), (0.12, 0.2, 0.4), (0.15, 0.35, 0.22), (0.85, 0.8, 0.68), (0.12, 0.12, 0.13), (0.8, 0.62, 0.2),
    (0.4, 0.26, 0.18), (0.92, 0.92, 0.9), (0.3, 0.5, 0.62), (0.5, 0.22, 0.4), (0.75, 0.4, 0.2),
)  # fmt: skip
_BOOK_SIDES = np.array([[4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [1, 3, 7, 5]])  # all but the back and the one below


def book_looks(rng: np.random.Generator) -> list[Material]:
    """Draw covers of books."""
    return [material("paper", rng, pick(rng, _BOOKS)) for _ in range(7)]


def books(rng: np.random.Generator, room: Room, looks: list[Material], fill: float, thick: float = 0.038) -> list[Mesh]:
    """Return a row of books that fills a share of a shelf; the last one may lean, some lie flat."""
    (a, b, c), (d, e, f) = room.low, room.high
    end = b + (e - b) * fill
    usual, deep = min(draw(rng, 0.19, 0.28), (f - c) * 0.92), min(draw(rng, 0.14, 0.2), (d - a) * 0.9)
    parts, y = [], b
    front = d - draw(rng, 0.01, max(0.012, (d - a - deep) * 0.6))
    while True:
        wide = thick * draw(rng, 0.5, 1.6)
        if y + wide > end:
            break
        tall = min(usual * draw(rng, 0.78, 1.15), (f - c) * 0.97)
        depth = deep * draw(rng, 0.85, 1.05)
        parts.append(box((front - depth, y, c), (front, y + wide, c + tall), pick(rng, looks), _BOOK_SIDES))
        y += wide
    rest = e - y
    if parts and rest > 0.2 and chance(rng, 0.5):
        lean = draw(rng, 0.15, 0.35)
        tall = min(usual, (f - c) * 0.9)
        one = box((front - deep, 0.0, 0.0), (front, 0.025, tall), pick(rng, looks)).tilted("x", lean)
        parts.append(one.moved(y=y + tall * float(np.sin(lean)) + 0.005, z=c))
    elif rest > 0.24 and chance(rng, 0.5):
        z = c
        for _ in range(count(rng, 1, 4)):
            high = draw(rng, 0.015, 0.04)
            if z + high > f - 0.02:
                break
            parts.append(
                box((front - deep, e - 0.22, z), (front - draw(rng, 0.0, 0.03), e - 0.02, z + high), pick(rng, looks))
            )
            z += high
    return parts


def ornament(rng: np.random.Generator, x: float, y: float, z: float, tall: float) -> Mesh:
    """Return a vase, a bowl, a box or a frame that stands at a place and is at most so tall."""
    kind = pick(rng, ("vase", "bowl", "box", "frame", "basket"))
    tall = min(tall, 0.3)
    if kind == "vase":
        h, r = tall * draw(rng, 0.5, 0.95), draw(rng, 0.035, 0.065)
        shape = [(0.6 * r, 0.0), (r, 0.4 * h), (0.4 * r, 0.8 * h), (0.55 * r, h)]
        return lathe([(radius, z + up) for radius, up in shape], material("ceramic", rng), x, y, 8)
    if kind == "bowl":
        r, h = draw(rng, 0.06, 0.11), min(draw(rng, 0.04, 0.08), tall)
        return lathe(
            [(0.4 * r, z), (r, z + h), (0.85 * r, z + h), (0.3 * r, z + 0.3 * h)], material("ceramic", rng), x, y, 8
        )
    if kind == "frame":
        wide, h = draw(rng, 0.1, 0.2), tall * draw(rng, 0.5, 0.9)
        return box(
            (x - 0.01, y - wide / 2, z), (x + 0.01, y + wide / 2, z + h), made_of(rng, "wood", "black", "painting")
        )
    look = material("wicker" if kind == "basket" else pick(rng, ("paper", "plastic", "wood")), rng)
    wide, deep, h = draw(rng, 0.14, 0.3), draw(rng, 0.14, 0.22), tall * draw(rng, 0.4, 0.85)
    return box((x - deep / 2, y - wide / 2, z), (x + deep / 2, y + wide / 2, z + h), look)


def shelf_things(rng: np.random.Generator, room: Room, looks: list[Material], full: float) -> list[Mesh]:
    """Return the contents of one bay of a shelf: books, things or nothing. About a share ``full`` of it is taken."""
    (a, b, c), (d, e, f) = room.low, room.high
    if not chance(rng, min(1.0, full * 1.5)) or f - c < 0.08:
        return []
    if chance(rng, 0.65):
        return books(rng, room, looks, min(1.0, full * draw(rng, 0.5, 1.4)))
    x, tall = (a + d) / 2, (f - c) * 0.9
    places = [y for y in np.arange(b + 0.12, e - 0.1, draw(rng, 0.24, 0.4)).tolist() if chance(rng, full)]
    return [ornament(rng, x + draw(rng, -0.02, 0.03), y + draw(rng, -0.02, 0.02), c, tall) for y in places]


def folded(rng: np.random.Generator, room: Room, looks: list[Material]) -> Meshes:
    """Return piles of folded clothes on a shelf."""
    (a, b, c), (d, e, f) = room.low, room.high
    for y in np.arange(b + 0.18, e - 0.16, 0.36).tolist():
        z = c
        for _ in range(count(rng, 0, 4)):
            high = draw(rng, 0.03, 0.07)
            if z + high > f - 0.03:
                break
            deep, wide = min(0.32, (d - a) * 0.8), draw(rng, 0.24, 0.32)
            middle = np.array([(a + d) / 2, y + draw(rng, -0.015, 0.015)])
            yield prism(middle + rounded_rectangle(deep, wide, 0.04, 2), z, high, pick(rng, looks))
            z += high


def hanging(rng: np.random.Generator, room: Room, looks: list[Material], full: float = 0.7) -> Meshes:
    """Return clothes on hangers under a rail that runs along y near the top of a room."""
    (a, b, c), (d, e, f) = room.low, room.high
    x, z = (a + d) / 2, f - 0.06
    yield tube([(x, b, z), (x, e, z)], 0.012, material("metal", rng), 6)
    y = b + 0.05
    while y < e - 0.05:
        if chance(rng, full):
            long = min(draw(rng, 0.55, 1.2), z - c - 0.06)
            half, thick = min(draw(rng, 0.19, 0.25), (d - a) * 0.47), draw(rng, 0.012, 0.03)
            rings = []
            for dz, share in ((-0.03, 0.2), (-0.1, 1.0), (-long, draw(rng, 0.75, 1.1))):
                w = half * share
                rings.append(
                    np.array([(x - w, y, z + dz), (x, y - thick, z + dz), (x + w, y, z + dz), (x, y + thick, z + dz)])
                )
            yield loft(rings, pick(rng, looks))
        y += draw(rng, 0.035, 0.09)


def cloth_looks(rng: np.random.Generator, number: int = 6) -> list[Material]:
    """Draw the materials of clothes."""
    return [material("fabric", rng) for _ in range(number)]
