"""Leaves of doors: panelled, glazed, louvred, flush, of planks, with their handles."""

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, ellipsoid, sheet, tube

Rows = list[tuple[float, int, str]]


def opaque(rng: np.random.Generator) -> Material:
    """Draw the material of a door or a frame: mostly white or wood."""
    kind = pick(rng, ("white", "wood", "wood", "painted", "white"))
    return material(kind, rng)


def _rows(rng: np.random.Generator, style: str) -> Rows:
    """Draw rows of fields from the bottom up: share of the height, number of columns, what fills them."""
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
    """Return a flush leaf, one with grooves, or one of planks, placed as `_gridded` does."""
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
