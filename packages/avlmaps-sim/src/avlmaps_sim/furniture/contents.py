"""The contents of shelves and wardrobes: books, boxes, vases, folded and hanging clothes."""

import numpy as np

from avlmaps_sim.furniture.carcass import Room
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, triangles_of
from avlmaps_sim.shapes import box, lathe, loft, prism, rounded_rectangle, tube

_BOOKS: tuple[Triple, ...] = (
    (0.55, 0.13, 0.12), (0.12, 0.2, 0.4), (0.15, 0.35, 0.22), (0.85, 0.8, 0.68), (0.12, 0.12, 0.13), (0.8, 0.62, 0.2),
    (0.4, 0.26, 0.18), (0.92, 0.92, 0.9), (0.3, 0.5, 0.62), (0.5, 0.22, 0.4), (0.75, 0.4, 0.2),
)  # fmt: skip


def _half_box(low: Triple, high: Triple, look: Material) -> Mesh:
    (a, b, c), (d, e, f) = low, high
    corner = np.array([(x, y, z) for z in (c, f) for y in (b, e) for x in (a, d)], np.float64)
    quads = np.array([[4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [1, 3, 7, 5]])
    return triangles_of(corner, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), look)


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
        parts.append(_half_box((front - depth, y, c), (front, y + wide, c + tall), pick(rng, looks)))
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
    """Return the contents of one bay of a shelf: books, things or nothing.

    About a share ``full`` of it is taken.
    """
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
