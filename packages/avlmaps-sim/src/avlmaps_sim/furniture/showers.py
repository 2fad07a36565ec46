"""Showers and their curtains."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.fittings import china, chrome, outline
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import at_height, box, cylinder, ellipsoid, shell, slab, tube


def _rail(rng: np.random.Generator, x: float, y: float, tall: float, metal: Material) -> Meshes:
    """Return a shower's rail on the wall behind (x is the wall): hand shower or rain head, mixer, hose."""
    top = tall - draw(rng, 0.0, 0.15)
    yield box((x, y - 0.13, 1.05), (x + 0.06, y + 0.13, 1.1), metal)
    if chance(rng, 0.5):
        out, size = draw(rng, 0.28, 0.42), draw(rng, 0.08, 0.15)
        yield tube([(x + 0.04, y, 1.1), (x + 0.04, y, top), (x + out, y, top + 0.01)], 0.011, metal, 6)
        head = (
            cylinder(x + out, y, top - 0.03, size, 0.02, metal, 14)
            if chance(rng, 0.6)
            else slab(x + out, y, top - 0.03, 2 * size, 2 * size, 0.015, metal)
        )
        yield head
    else:
        yield tube([(x + 0.04, y, 1.15), (x + 0.04, y, top)], 0.01, metal, 6)
        yield tube([(x + 0.04, y, top - 0.1), (x + 0.16, y, top - 0.02)], 0.013, metal, 6)
        yield ellipsoid((x + 0.18, y, top - 0.03), (0.05, 0.05, 0.02), metal, 10, 4)
    yield tube(
        [
            (x + 0.05, y + 0.03, 1.06),
            (x + 0.08, y + 0.1, 0.8),
            (x + 0.09, y + 0.12, 1.0),
            (x + 0.07, y + 0.03, top - 0.12),
        ],
        0.006,
        metal,
        5,
    )


def _tray(rng: np.random.Generator, wide: float, deep: float, look: Material) -> list[Mesh]:
    high = draw(rng, 0.03, 0.16)
    outer = outline(deep, wide, 30.0, 24, middle=(deep / 2, 0.0))
    inner = outline(deep - 0.1, wide - 0.1, 6.0, 24, middle=(deep / 2, 0.0))
    floor = outline(deep - 0.2, wide - 0.2, 6.0, 24, middle=(deep / 2, 0.0))
    return [shell([(outer, 0.0), (outer, high), (inner, high), (floor, max(0.012, high - 0.08))], look),
            cylinder(deep / 2, 0.0, max(0.012, high - 0.08), 0.05, 0.004, material("metal", rng), 12)]  # fmt: skip


def _pane(
    a: tuple[float, float], b: tuple[float, float], z: tuple[float, float], glass: Material, metal: Material | None
) -> Meshes:
    """Return an upright pane between two places (x, y), with a frame if it has a metal."""
    (x0, y0), (x1, y1) = a, b
    yield cloth(np.array([[(x0, y0, z[0]), (x0, y0, z[1])], [(x1, y1, z[0]), (x1, y1, z[1])]]), glass)
    if metal is not None:
        bars = [
            ((x0, y0, z[0]), (x0, y0, z[1])),
            ((x1, y1, z[0]), (x1, y1, z[1])),
            ((x0, y0, z[1]), (x1, y1, z[1])),
            ((x0, y0, z[0]), (x1, y1, z[0])),
        ]
        yield from [tube(bar, 0.014, metal, 4) for bar in bars]


def _shower_size(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.75, 1.2), draw(rng, 0.75, 1.0), draw(rng, 1.85, 2.1)


@family("shower", "corner cabin")
def _corner_cabin(rng: np.random.Generator) -> Parts:
    wide, deep, tall = _shower_size(rng)
    metal, glass, z = chrome(rng), material("glass", rng), 0.05
    side = pick(rng, (-1.0, 1.0)) * wide / 2
    cut = draw(rng, -0.1, 0.2) * wide * np.sign(side)
    frame = metal if chance(rng, 0.7) else None
    yield from (*_tray(rng, wide, deep, china(rng)), *_pane((0.01, side), (deep, side), (z, tall), glass, frame),
                *_pane((deep, side), (deep, float(cut)), (z, tall), glass, frame))  # fmt: skip
    if chance(rng, 0.7):  # the door: shut or half open
        swing = draw(rng, 0.0, 0.7) if chance(rng, 0.3) else 0.0
        far = float(-side - cut)
        yield from _pane(
            (deep + 0.01, float(cut)),
            (deep + 0.01 + abs(far) * np.sin(swing), float(cut + far * np.cos(swing))),
            (z, tall),
            glass,
            frame,
        )
        if swing == 0.0:
            yield tube(
                [
                    (deep + 0.01, cut + 0.06, 0.95),
                    (deep + 0.05, cut + 0.06, 0.95),
                    (deep + 0.05, cut + 0.06, 1.2),
                    (deep + 0.01, cut + 0.06, 1.2),
                ],
                0.008,
                metal,
                5,
            )
    yield from _rail(rng, 0.0, 0.0, tall, metal)


@family("shower", "quarter round")
def _quarter_round(rng: np.random.Generator) -> Parts:
    size, tall = draw(rng, 0.8, 1.05), draw(rng, 1.85, 2.1)
    look, metal, glass = china(rng), chrome(rng), material("glass", rng)
    cut = draw(rng, 0.3, 0.5) * size
    arc = np.linspace(0.0, np.pi / 2, 9)
    curve = np.column_stack([cut + (size - cut) * np.cos(arc), cut + (size - cut) * np.sin(arc)])
    path = np.concatenate([[(size, 0.0)], curve, [(0.0, size)]])
    floor = np.concatenate([path, [(0.0, 0.0)]])
    high = draw(rng, 0.04, 0.17)
    middle = floor.mean(axis=0)
    parts = [
        shell(
            [
                (floor, 0.0),
                (floor, high),
                (middle + (floor - middle) * 0.9, high),
                (middle + (floor - middle) * 0.85, high * 0.6),
            ],
            look,
        )
    ]
    wall = np.stack([at_height(path, high), at_height(path, tall)], axis=1)
    parts.append(cloth(wall, glass))
    places: list[tuple[float, float]] = [(float(x), float(y)) for x, y in path]
    parts += [tube([(x, y, z) for x, y in places], 0.016, metal, 5) for z in (high + 0.01, tall)]
    parts += [tube([(x, y, high), (x, y, tall)], 0.014, metal, 5) for x, y in (places[k] for k in (0, 3, 7, -1))]
    whole = joined(parts).moved(y=-size / 2)
    return [whole, *_rail(rng, 0.0, draw(rng, -0.2, 0.2) * size, tall, metal)]


@family("shower", "walk in")
def _walk_in(rng: np.random.Generator) -> Parts:
    wide, deep, tall = draw(rng, 0.9, 1.6), draw(rng, 0.8, 1.1), draw(rng, 1.9, 2.1)
    metal, glass = chrome(rng), material("glass", rng)
    side = pick(rng, (-1.0, 1.0)) * wide / 2
    share = draw(rng, 0.5, 0.8)
    far = side - np.sign(side) * share * wide
    yield box((0.0, -wide / 2, 0.0), (deep, wide / 2, draw(rng, 0.01, 0.04)), pictured("tile", rng, "stone"))
    yield from _pane((deep, float(side)), (deep, float(far)), (0.03, tall), glass, metal if chance(rng, 0.5) else None)
    yield tube([(deep, float(far), tall - 0.03), (0.0, float(far), tall - 0.03)], 0.01, metal, 5)
    if chance(rng, 0.4):  # black bars divide the pane
        for z in np.linspace(0.4, tall - 0.3, 4):
            yield tube([(deep, float(side), z), (deep, float(far), z)], 0.008, metal, 4)
    yield from _rail(rng, 0.0, float(side * 0.2), tall, metal)


@family("shower", "behind a curtain")
def _curtained_shower(rng: np.random.Generator) -> Parts:
    wide, deep, tall = _shower_size(rng)
    metal, rail, n = chrome(rng), draw(rng, 1.9, 2.05), 40
    yield from (*_tray(rng, wide, deep, china(rng)), *_rail(rng, 0.0, 0.0, tall, metal))
    bend = 0.15
    path = [
        (0.0, wide / 2),
        (deep - bend, wide / 2),
        (deep - 0.04, wide / 2 - 0.04),
        (deep, wide / 2 - bend),
        (deep, -wide / 2),
    ]
    yield tube([(x, y, rail) for x, y in path], 0.012, metal, 6)
    along = np.linspace(draw(rng, 0.2, 0.6), 0.99, n) * (deep + wide)
    wave = draw(rng, 0.02, 0.035) * np.sin(np.arange(n) * 1.6)
    on_side = along < deep
    x = np.where(on_side, np.minimum(along, deep), deep + wave)
    y = np.where(on_side, wide / 2 + wave, wide / 2 - (along - deep))
    points = np.stack([np.column_stack([x, y, np.full(n, z)]) for z in (draw(rng, 0.08, 0.25), rail - 0.02)], axis=1)
    yield cloth(points, pictured("curtain", rng, "fabric"))


@family("shower", "five-sided", held_out=True)
def _five_sided(rng: np.random.Generator) -> Parts:
    size, tall, high = draw(rng, 0.85, 1.1), draw(rng, 1.85, 2.05), draw(rng, 0.05, 0.15)
    cut, metal, glass = draw(rng, 0.35, 0.55) * size, chrome(rng), material("glass", rng)
    floor = np.array([(0.0, 0.0), (size, 0.0), (size, cut), (cut, size), (0.0, size)])
    parts = [shell([(floor, 0.0), (floor, high)], china(rng))]
    for a, b in pairwise(floor[1:]):
        parts += _pane((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), (high, tall), glass, metal)
    return [joined(parts).moved(y=-size / 2), *_rail(rng, 0.0, -0.1 * size, tall, metal)]


@family("shower", "wall rail")
def _wall_rail(rng: np.random.Generator) -> Parts:
    metal = chrome(rng)
    rail = joined(_rail(rng, 0.0, 0.0, draw(rng, 1.9, 2.1), metal))
    return [rail]


def _look(rng: np.random.Generator) -> Material:
    if chance(rng, 0.4):
        pale = draw(rng, 0.8, 0.97)
        return material("fabric", rng, (pale, pale, pale))
    return made_of(rng, "curtain", "curtain", "plastic")


def _hung(rng: np.random.Generator, rail: Float[np.ndarray, "n 2"], high: float, look: Material) -> Mesh:
    """Return cloth that hangs from a rail through points (x, y): folds across it, wider at the hem."""
    step = np.diff(rail, axis=0)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))])
    dense = np.linspace(0.0, length[-1], max(int(length[-1] / 0.025), 12))
    place = np.stack([np.interp(dense, length, rail[:, k]) for k in range(2)], axis=1)
    along = np.gradient(place, axis=0)
    across = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    wave, phase, deep = 2 * np.pi / draw(rng, 0.09, 0.2), draw(rng, 0, 6.3), draw(rng, 0.012, 0.04)
    columns = []
    for share in (0.0, 0.35, 0.7, 1.0):
        fold = deep * (1.1 - 0.5 * share) * np.sin(wave * dense + phase + 0.5 * share * np.sin(3 * dense))
        xy = place + across * fold[:, None]
        columns.append(np.column_stack([xy, np.full(len(xy), high * share)]))
    return cloth(np.stack(columns, axis=1), look)


def _with_rail(rng: np.random.Generator, whole: list[Triple], cloths: list[Mesh]) -> Parts:
    return [*cloths, tube(whole, draw(rng, 0.01, 0.016), material("metal", rng), 8)]


@family("shower curtain", "drawn")
def _drawn(rng: np.random.Generator) -> Parts:
    long, high = draw(rng, 0.8, 1.9), draw(rng, 1.6, 1.95)
    reach = long * draw(rng, 0.75, 1.0)
    rail = np.array([[0.0, -long / 2], [0.0, -long / 2 + reach]])
    top = high + 0.03
    return _with_rail(rng, [(0.0, -long / 2, top), (0.0, long / 2, top)], [_hung(rng, rail, high, _look(rng))])


@family("shower curtain", "pushed aside")
def _pushed(rng: np.random.Generator) -> Parts:
    long, high, top = draw(rng, 0.8, 1.9), draw(rng, 1.6, 1.95), 0.03
    reach, look = long * draw(rng, 0.2, 0.45), _look(rng)
    rail = np.array([[0.0, -long / 2], [0.0, -long / 2 + reach]])
    cloths = [_hung(rng, rail, high, look), _hung(rng, rail + np.array([0.03, 0.0]), high, look)]
    return _with_rail(rng, [(0.0, -long / 2, high + top), (0.0, long / 2, high + top)], cloths)


@family("shower curtain", "round a corner", held_out=True)
def _cornered(rng: np.random.Generator) -> Parts:
    wide, long, high = draw(rng, 0.7, 0.9), draw(rng, 0.7, 1.0), draw(rng, 1.7, 1.95)
    bend = [(wide - 0.15 * (1 - np.cos(a)), long - 0.15 * (1 - np.sin(a))) for a in np.linspace(0.0, np.pi / 2, 5)]
    rail = np.array([(wide, 0.0), *bend[:-1], (wide - 0.15, long), (0.0, long)])
    points: list[Triple] = [(float(x), float(y), high + 0.03) for x, y in rail]
    keep = rail[: max(3, int(len(rail) * draw(rng, 0.6, 1.0)))]
    return _with_rail(rng, points, [_hung(rng, keep, high, _look(rng))])
