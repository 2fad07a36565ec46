"""Doors, windows and folding doors, with their frames, to fill a hole in a wall or to stand for themselves.

`door`, `window` and `folding_door` fill a hole of a given size: the middle of the hole's lower edge lies at the
origin, the wall reaches from -wall_m / 2 to wall_m / 2 along x, the room is at +x (doors open to it).
"""

from itertools import pairwise

import numpy as np

from avlmaps_sim.furniture.catalogue import Families, Parts, Piece, family
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, rim, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, ellipsoid, sheet, tube

DOOR_STYLES: dict[Families, tuple[str, ...]] = {
    "training": ("panel", "flush", "glazed", "half-glazed", "grooved"),
    "held-out": ("plank", "louvre"),
}
WINDOW_STYLES: dict[Families, tuple[str, ...]] = {
    "training": ("casement", "sash", "pane", "french", "transom"),
    "held-out": ("lattice", "sliding"),
}
FOLDING_STYLES: dict[Families, tuple[str, ...]] = {
    "training": ("accordion", "bifold panel", "bifold glazed"),
    "held-out": ("bifold louvre",),
}


def _styles(known: dict[Families, tuple[str, ...]], which: Families) -> tuple[str, ...]:
    return known["training"] + known["held-out"] if which == "all" else known[which]


def _casing(rng: np.random.Generator, width: float, height: float, wall: float, look: Material) -> tuple[Mesh, float]:
    lining, trim, proud = draw(rng, 0.018, 0.04), draw(rng, 0.04, 0.1), draw(rng, 0.008, 0.022)
    edge = width / 2
    parts = [
        box((-wall / 2, -edge, 0.0), (wall / 2, -edge + lining, height), look),
        box((-wall / 2, edge - lining, 0.0), (wall / 2, edge, height), look),
        box((-wall / 2, -edge + lining, height - lining), (wall / 2, edge - lining, height), look),
    ]
    for side in (-1, 1):
        back, front = sorted((side * wall / 2, side * (wall / 2 + proud)))
        parts += [
            box((back, -edge - trim, 0.0), (front, -edge, height + trim), look),
            box((back, edge, 0.0), (front, edge + trim, height + trim), look),
            box((back, -edge, height), (front, edge, height + trim), look),
        ]
    return joined(parts), lining


def door(rng: np.random.Generator, width_m: float, height_m: float, wall_m: float, open_rad: float = 0.0,
         which: Families = "all", style: str | None = None) -> Piece:  # fmt: skip
    """Make a door with its frame for a hole in a wall, the middle of the hole's lower edge at the origin.

    Wider than 1.2 m it has two leaves, open by ``open_rad`` towards +x. Styles are ``DOOR_STYLES``.
    """
    style = pick(rng, _styles(DOOR_STYLES, which)) if style is None else style
    look = opaque(rng)
    frame, lining = _casing(rng, width_m, height_m, wall_m, look if chance(rng, 0.7) else opaque(rng))
    gap = 0.003
    room, tall = width_m - 2 * lining - 2 * gap, height_m - lining - gap - 0.008
    hinge = wall_m / 2 - 0.028
    if width_m > 1.2:
        state = rng.bit_generator.state
        left = door_leaf(rng, room / 2 - gap, tall, style, look, handle=True)
        rng.bit_generator.state = state  # the same draws again: both leaves look alike
        right = door_leaf(rng, room / 2 - gap, tall, style, look, handle=True).scaled(1.0, -1.0, 1.0)
        leaves = [left.turned(-open_rad).moved(hinge, -room / 2, 0.008)]
        leaves.append(right.turned(open_rad * draw(rng, 0.0, 1.0)).moved(hinge, room / 2, 0.008))
    else:
        leaf = door_leaf(rng, room, tall, style, look, handle=True).turned(-open_rad).moved(hinge, -room / 2, 0.008)
        leaves = [leaf.scaled(1.0, -1.0, 1.0) if chance(rng, 0.5) else leaf]
    return Piece(joined([frame, *leaves]), category="door", family=style)


def _panes(rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float], x: tuple[float, float],
           columns: int, rows: int, look: Material) -> list[Mesh]:  # fmt: skip
    bar, thin = draw(rng, 0.035, 0.07), draw(rng, 0.016, 0.03)
    (a, b), (c, d) = low, high
    parts = [rim(low, high, bar, x, look)]
    uprights = np.linspace(a + bar, c - bar, columns + 1)[1:-1].tolist()
    levels = np.linspace(b + bar, d - bar, rows + 1)[1:-1].tolist()
    parts += [box((x[0], y - thin / 2, b + bar), (x[1], y + thin / 2, d - bar), look) for y in uprights]
    return parts + [box((x[0], a + bar, z - thin / 2), (x[1], c - bar, z + thin / 2), look) for z in levels]


def _sashes(rng: np.random.Generator, width: float, height: float, x: float, style: str, look: Material) -> list[Mesh]:
    """Return the sashes of a window that fill a hole up to its middle lines; glass lies at ``x``."""
    y, thin = width / 2, (x - 0.025, x + 0.025)
    if style == "pane":
        return _panes(rng, (-y, 0.0), (y, height), thin, 1, 1, look)
    if style == "lattice":
        return _panes(rng, (-y, 0.0), (y, height), thin, max(int(width / 0.25), 2), max(int(height / 0.28), 2), look)
    if style == "sash":
        grid = (count(rng, 1, 3), count(rng, 1, 2))
        middle = height * draw(rng, 0.45, 0.55)
        upper = _panes(rng, (-y, middle - 0.02), (y, height), (x - 0.035, x - 0.003), *grid, look)
        return upper + _panes(rng, (-y, 0.0), (y, middle + 0.02), (x + 0.003, x + 0.035), *grid, look)
    if style == "sliding":
        near = -draw(rng, 0.1, 0.7) * y if chance(rng, 0.4) else -0.03  # slid aside where it is open
        back = _panes(rng, (-y, 0.0), (0.03, height), (x - 0.035, x - 0.003), 1, 1, look)
        return back + _panes(
            rng, (near, 0.0), (near + y + 0.03 if near < -0.03 else y, height), (x, x + 0.035), 1, 1, look
        )
    foot = height * draw(rng, 0.15, 0.35) if style == "french" and chance(rng, 0.5) else 0.0
    top = height * draw(rng, 0.68, 0.8) if style == "transom" else height
    leaves = max(2 if style == "french" else 1, round(width / draw(rng, 0.5, 0.8)))
    rows = count(rng, 2, 4) if style == "french" and chance(rng, 0.6) else count(rng, 1, 2)
    parts, edges, metal = [], np.linspace(-y, y, leaves + 1).tolist(), material("metal", rng)
    for a, c in pairwise(edges):
        parts += _panes(rng, (a, foot), (c, top), thin, 1, rows, look)
        parts.append(box((x + 0.025, c - 0.035, top * 0.45), (x + 0.045, c - 0.015, top * 0.45 + 0.12), metal))
        if style == "transom":
            parts += _panes(rng, (a, top), (c, height), thin, count(rng, 1, 2), 1, look)
    if foot:
        parts.append(box((x - 0.02, -y, 0.0), (x + 0.02, y, foot + 0.04), look))
    return parts


def window(rng: np.random.Generator, width_m: float, height_m: float, wall_m: float,
           which: Families = "all", style: str | None = None) -> Piece:  # fmt: skip
    """Make a window for a hole in a wall, the middle of its lower edge at the origin, its sill to the room at +x.

    Styles are ``WINDOW_STYLES``.
    """
    tall = height_m > 1.75
    known = tuple(s for s in _styles(WINDOW_STYLES, which) if (s != "french") or tall)
    style = pick(rng, known) if style is None else style
    look = made_of(rng, "white", "white", "wood", "painted")
    jamb, x = draw(rng, 0.03, 0.06), draw(rng, -0.35, 0.15) * wall_m
    y = width_m / 2
    parts = [rim((-y, 0.0), (y, height_m), jamb, (x - 0.04, x + 0.04), look)]
    inner_w, inner_h = width_m - 2 * jamb, height_m - 2 * jamb
    parts += [part.moved(z=jamb) for part in _sashes(rng, inner_w, inner_h, x, style, look)]
    pane = (0.0, inner_w, 0.0), (0.0, 0.0, inner_h)
    # The outside is a picture behind the bars, since nothing is built there; a few panes are plain.
    view = material("outdoors" if chance(rng, 0.88) else "glass", rng)
    parts.append(sheet((x, -inner_w / 2, jamb), *pane, view, fill=True))
    trim, proud = draw(rng, 0.04, 0.1), draw(rng, 0.006, 0.02)
    front = wall_m / 2
    if chance(rng, 0.55):
        casing = rim((-y - trim, -trim), (y + trim, height_m + trim), trim, (front, front + proud), look)
        parts.append(casing)
    if style != "french":
        deep, board = draw(rng, 0.03, 0.2), draw(rng, 0.018, 0.045)
        wide = y + draw(rng, 0.0, 0.12)
        sill = look if chance(rng, 0.6) else made_of(rng, "stone", "wood", "white")
        parts.append(box((x + 0.04, -y, 0.0), (front, y, 0.006), sill))
        parts.append(box((front, -wide, -board + 0.006), (front + deep, wide, 0.006), sill))
    return Piece(joined(parts), category="window", family=style)


def _folded(leaf: Mesh, width: float, leaves: int, bend_rad: float) -> Mesh:
    step = width * np.cos(bend_rad)
    parts = []
    for number in range(leaves):
        forth = number % 2 == 0
        turned = leaf.turned(-bend_rad if forth else bend_rad)
        parts.append(turned.moved(0.0 if forth else width * np.sin(bend_rad), number * step))
    return joined(parts)


def folding_door(rng: np.random.Generator, width_m: float, height_m: float, wall_m: float,
                 which: Families = "all", style: str | None = None) -> Piece:  # fmt: skip
    """Make a folding door with its frame for a hole in a wall, closed or drawn aside in part.

    The middle of the hole's lower edge is at the origin. Styles are ``FOLDING_STYLES``.
    """
    style = pick(rng, _styles(FOLDING_STYLES, which)) if style is None else style
    look = opaque(rng)
    frame, lining = _casing(rng, width_m, height_m, wall_m, look if chance(rng, 0.6) else opaque(rng))
    room, tall = width_m - 2 * lining, height_m - lining - 0.03
    if style == "accordion":
        leaves = max(round(room / draw(rng, 0.09, 0.16)), 4)
        bend = draw(rng, 0.35, 1.25)
        each = room / leaves / np.cos(0.3)
        leaf = box((-0.005, 0.0, 0.0), (0.005, each, tall), look)
        pairs, stack = 1, _folded(leaf, each, leaves, max(bend, 0.32))
    else:
        pairs = 1 if room < 1.3 else count(rng, 1, 2)
        leaves = 2 * max(round(room / pairs / 2 / draw(rng, 0.35, 0.6)), 1)
        each = room / pairs / leaves - 0.002
        bend = draw(rng, 0.08, 1.3)
        kind = {"bifold panel": pick(rng, ("panel", "flush")), "bifold glazed": "glazed"}.get(style, "louvre")
        stack = _folded(door_leaf(rng, each, tall, kind, look, handle=False), each, leaves, bend)
    shift = draw(rng, -0.3, 0.2) * wall_m
    hung = [stack.moved(shift, -room / 2, 0.012)]
    if pairs == 2:
        hung.append(hung[0].scaled(1.0, -1.0, 1.0))
    rail = box((shift - 0.02, -room / 2, height_m - lining - 0.03), (shift + 0.02, room / 2, height_m - lining), look)
    return Piece(joined([frame, rail, *hung]), category="folding door", family=style)


def _wall(rng: np.random.Generator) -> float:
    return draw(rng, 0.09, 0.3)


def _register_door(style: str, held_out: bool) -> None:
    @family("door", style, held_out)
    def recipe(rng: np.random.Generator) -> Parts:
        return [door(rng, draw(rng, 0.68, 1.05), draw(rng, 1.95, 2.3), _wall(rng), 0.0, style=style).mesh]


def _register_window(style: str, held_out: bool) -> None:
    @family("window", style, held_out)
    def recipe(rng: np.random.Generator) -> Parts:
        width = draw(rng, 1.0, 2.4) if style in ("sliding", "french") else draw(rng, 0.5, 2.2)
        height = draw(rng, 1.95, 2.4) if style == "french" else draw(rng, 0.6, 1.7)
        return [window(rng, width, height, _wall(rng), style=style).mesh]


def _register_folding_door(style: str, held_out: bool) -> None:
    @family("folding door", style, held_out)
    def recipe(rng: np.random.Generator) -> Parts:
        return [folding_door(rng, draw(rng, 0.7, 2.8), draw(rng, 1.95, 2.4), _wall(rng), style=style).mesh]


for _known, _register in (
    (DOOR_STYLES, _register_door), (WINDOW_STYLES, _register_window), (FOLDING_STYLES, _register_folding_door),
):  # fmt: skip
    for _which, _names in _known.items():
        for _name in _names:
            _register(_name, _which == "held-out")


@family("door", "ajar")
def _ajar(rng: np.random.Generator) -> Parts:
    wide, tall = draw(rng, 0.7, 1.0), draw(rng, 1.95, 2.25)
    return [door(rng, wide, tall, _wall(rng), draw(rng, 0.3, 1.9), which="training").mesh]


@family("door", "double")
def _double(rng: np.random.Generator) -> Parts:
    wide, tall = draw(rng, 1.3, 2.0), draw(rng, 2.0, 2.5)
    open_rad = draw(rng, 0.2, 1.6) if chance(rng, 0.4) else 0.0
    return [door(rng, wide, tall, _wall(rng), open_rad, which="training").mesh]


Rows = list[tuple[float, int, str]]


def opaque(rng: np.random.Generator) -> Material:
    """Draw the material of a door or a frame: mostly white or wood."""
    kind = pick(rng, ("white", "wood", "wood", "painted", "white"))
    return material(kind, rng)


def _rows(rng: np.random.Generator, style: str) -> Rows:
    columns = count(rng, 1, 3)
    if style == "glazed":
        if chance(rng, 0.3):
            return [(1.0, 1, "glass")]
        rows: Rows = [(1.0, columns, "glass") for _ in range(count(rng, 2, 5))]
        return [(draw(rng, 0.5, 1.5), 1, "panel"), *rows] if chance(rng, 0.4) else rows
    if style == "half-glazed":
        lower, upper = draw(rng, 0.4, 0.7), count(rng, 1, 3)
        return [(lower, count(rng, 1, 2), "panel"), *[((1 - lower) / upper, columns, "glass")] * upper]
    if style == "louvre":
        return [(1.0, 1, "louvre")] * count(rng, 1, 3)
    layouts: tuple[Rows, ...] = (
        [(0.42, 2, "panel"), (0.42, 2, "panel"), (0.16, 2, "panel")],
        [(0.42, 1, "panel"), (0.58, 1, "panel")],
        [(0.35, 2, "panel"), (0.65, 2, "panel")],
        [(0.2, 1, "panel")] * 5,
        [(0.4, 1, "panel"), (0.15, 1, "panel"), (0.45, 1, "panel")],
    )
    return pick(rng, layouts)


def _field(rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float], thick: float, fill: str,
           look: Material, glass: Material, raised: float) -> Mesh:  # fmt: skip
    (a, b), (c, d) = low, high
    if fill == "glass":
        return sheet((0.0, a, b), (0.0, c - a, 0.0), (0.0, 0.0, d - b), glass, fill=True)
    if fill == "louvre":
        slats = max(int((d - b) / 0.055), 1)
        height = (d - b) / slats
        return joined(
            [
                sheet((-thick * 0.35, a, b + i * height), (0.0, c - a, 0.0), (thick * 0.7, 0.0, height * 1.1), look)
                for i in range(slats)
            ]
        )
    parts = [box((-thick * 0.22, a, b), (thick * 0.22, c, d), look)]
    inset = min(0.04, (c - a) * 0.2, (d - b) * 0.2)
    if raised:
        parts.append(box((-raised, a + inset, b + inset), (raised, c - inset, d - inset), look))
    return joined(parts)


def _gridded(rng: np.random.Generator, width: float, height: float, thick: float, rows: Rows, look: Material) -> Mesh:
    """Return a leaf of stiles and rails with fields between; hinge edge at y = 0, middle of its thickness at x = 0."""
    stile, bar = min(draw(rng, 0.07, 0.13), width * 0.22), draw(rng, 0.025, 0.1)
    if rows[0][2] == "glass" or rows[-1][2] == "glass":
        bar = draw(rng, 0.018, 0.045)
    glass = material("glass", rng)
    raised = thick * draw(rng, 0.3, 0.42) if chance(rng, 0.6) else 0.0
    foot = stile * draw(rng, 1.0, 2.2)
    parts = [
        box((-thick / 2, 0.0, 0.0), (thick / 2, stile, height), look),
        box((-thick / 2, width - stile, 0.0), (thick / 2, width, height), look),
        box((-thick / 2, stile, 0.0), (thick / 2, width - stile, foot), look),
        box((-thick / 2, stile, height - stile), (thick / 2, width - stile, height), look),
    ]
    total, z = sum(row[0] for row in rows), foot
    free = height - foot - stile - bar * (len(rows) - 1)
    for number, (share, columns, fill) in enumerate(rows):
        top = z + free * share / total
        if number < len(rows) - 1:
            parts.append(box((-thick / 2, stile, top), (thick / 2, width - stile, top + bar), look))
        field = (width - 2 * stile - bar * (columns - 1)) / columns
        for column in range(columns):
            y = stile + column * (field + bar)
            parts.append(_field(rng, (y, z), (y + field, top), thick, fill, look, glass, raised))
            if column:
                parts.append(box((-thick / 2, y - bar, z), (thick / 2, y, top), look))
        z = top + bar
    return joined(parts)


def _flat(rng: np.random.Generator, width: float, height: float, thick: float, look: Material, style: str) -> Mesh:
    if style == "plank":
        boards = max(int(width / draw(rng, 0.09, 0.16)), 2)
        each = width / boards
        parts = [
            box((-thick / 2, i * each + 0.003, 0.0), (thick / 2 - 0.004, (i + 1) * each - 0.003, height), look)
            for i in range(boards)
        ]
        levels = [0.12 * height, 0.85 * height] + ([0.48 * height] if chance(rng, 0.6) else [])
        parts += [box((0.0, 0.03, z), (thick / 2 + 0.02, width - 0.03, z + 0.11), look) for z in levels]
        if chance(rng, 0.6):
            low, high = (thick / 2 + 0.008, 0.08, 0.16 * height), (thick / 2 + 0.008, width - 0.08, 0.86 * height)
            parts.append(strut(low, high, 0.022, 0.1, look))
        return joined(parts)
    parts = [box((-thick / 2, 0.0, 0.0), (thick / 2, width, height), look)]
    if style == "grooved":
        line = made_of(rng, "metal", "black", "wood")
        deep, upright = thick / 2 + 0.002, chance(rng, 0.3)
        for at in np.linspace(0.0, 1.0, count(rng, 2, 6) + 2)[1:-1].tolist():
            y, z = (at * width, 0.0) if upright else (0.0, at * height)
            far, top = (y + 0.012, height) if upright else (width, z + 0.012)
            parts.append(box((-deep, y, z), (deep, far, top), line))
    elif chance(rng, 0.25):  # a small window or a letter plate
        z = height * draw(rng, 0.62, 0.7)
        y, tall = width * draw(rng, 0.35, 0.65), height * draw(rng, 0.05, 0.25)
        glass = material("glass", rng)
        parts.append(box((-thick / 2 - 0.002, y - 0.07, z), (thick / 2 + 0.002, y + 0.07, z + tall), glass))
    return joined(parts)


def _handle(rng: np.random.Generator, y: float, z: float, thick: float, towards: float) -> Mesh:
    """Return handles on both sides at (y, z); ``towards`` is the side (+1 or -1 along y) that a lever points to."""
    metal, kind = material("metal", rng), pick(rng, ("lever", "knob", "bar", "plate"))
    parts = []
    for side in (-1.0, 1.0):
        face, out = side * thick / 2, side * (thick / 2 + 0.05)
        near, far = min(face, face + side * 0.008), max(face, face + side * 0.008)
        if kind == "bar":
            reach = draw(rng, 0.1, 0.3)
            path = [(face, y, z - reach), (out, y, z - reach), (out, y, z + reach), (face, y, z + reach)]
            parts.append(tube(path, 0.009, metal, sides=6))
            continue
        tall = 0.1 if kind == "plate" else 0.026
        parts.append(box((near, y - 0.024, z - tall), (far, y + 0.024, z + tall), metal))
        parts.append(tube([(face, y, z), (out, y, z)], 0.009, metal, sides=6))
        if kind == "knob":
            parts.append(ellipsoid((out, y, z), (0.022, 0.028, 0.028), metal, 8, 5))
        else:
            parts.append(strut((out, y - towards * 0.01, z), (out, y + towards * 0.11, z), 0.014, 0.02, metal))
    return joined(parts)


def door_leaf(rng: np.random.Generator, width: float, height: float, style: str, look: Material, handle: bool) -> Mesh:
    """Return a leaf whose hinge is the z axis and which reaches to y = ``width``."""
    thick = draw(rng, 0.032, 0.05)
    if style in ("plank", "flush", "grooved"):
        body = _flat(rng, width, height, thick, look, style)
    else:
        body = _gridded(rng, width, height, thick, _rows(rng, style), look)
    if not handle:
        return body
    return joined([body, _handle(rng, width - min(0.06, width * 0.15), draw(rng, 0.46, 0.52) * height, thick, -1.0)])
