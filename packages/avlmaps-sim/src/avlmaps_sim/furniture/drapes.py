"""Curtains and blinds. They hang in front of a wall at their lowest x; the lowest hem lies at z = 0."""

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.catalogue import Families, Parts, Piece, family
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, ellipsoid, rounded_box, sheet, slab, tube

CURTAIN_STYLES: dict[Families, tuple[str, ...]] = {
    "training": ("wall open pair", "wall closed pair", "wall one side", "wall sheer and drapes", "wall cafe"),
    "held-out": ("wall tied back", "wall valance"),
}


def _drape(
    rng: np.random.Generator, low_y: float, high_y: float, top: float, look: Material, x: float,
    pinch: Float[np.ndarray, " r"] | None = None, towards: float = 0.0, hem: float = 0.0,
) -> Mesh:  # fmt: skip
    """Return a pleated panel from ``low_y`` to ``high_y``, from ``hem`` to ``top``, the middle of its depth at ``x``.

    ``pinch`` is the share of its width that stays, from the hem up; the rest is gathered ``towards`` a y.
    """
    width = high_y - low_y
    pleats = max(int(width / draw(rng, 0.07, 0.16)), 2)
    s = np.linspace(0.0, 1.0, 5 * pleats + 1)
    keep = np.ones(4) if pinch is None else pinch
    rows = np.linspace(0.0, 1.0, len(keep))
    deep, phase = draw(rng, 0.02, 0.06), draw(rng, 0.0, 6.0)
    swing = rng.uniform(0.5, 1.0, pleats + 1)[np.minimum((s * pleats).astype(int), pleats)]
    warp = s + 0.25 / pleats * np.sin(2 * np.pi * s * max(pleats // 3, 1) + phase)
    points = np.empty((len(s), len(rows), 3))
    for row, (height, share) in enumerate(zip(rows.tolist(), keep.tolist(), strict=True)):
        free = 1.0 - 0.5 * height  # pleats are held at the top
        points[:, row, 0] = x + deep * free * swing * np.sin(2 * np.pi * pleats * warp + 0.4 * (1 - height))
        points[:, row, 1] = towards + (low_y + width * s - towards) * share
        points[:, row, 2] = hem + height * (top - hem)
    points[..., 0] = np.maximum(points[..., 0], 0.004)
    return cloth(points, look)


def _rod(rng: np.random.Generator, width: float, z: float, x: float) -> list[Mesh]:
    """Return a rod with ends and brackets to the wall, or a flat rail; ``width`` between its ends."""
    look, y = made_of(rng, "metal", "black", "wood", "white"), width / 2
    if chance(rng, 0.3):
        return [slab(x / 2 + 0.02, 0.0, z, x + 0.04, width, draw(rng, 0.02, 0.16), look)]
    radius = draw(rng, 0.008, 0.02)
    parts = [tube([(x, -y, z), (x, y, z)], radius, look, 8)]
    for side in (-1, 1):
        parts.append(ellipsoid((x, side * y, z), (radius * 1.8, radius * 2.5, radius * 1.8), look, 8, 5))
        parts.append(box((0.0, side * y * 0.94 - 0.008, z - 0.03), (x + 0.005, side * y * 0.94 + 0.008, z), look))
    return parts


def _textile(rng: np.random.Generator) -> Material:
    return material("curtain", rng)


def _sheer(rng: np.random.Generator) -> Material:
    pale = draw(rng, 0.82, 0.97)
    return material("fabric", rng, (pale, pale, pale * draw(rng, 0.9, 1.0)))


def _panels(rng: np.random.Generator, y: float, top: float, x: float, style: str) -> list[Mesh]:
    look = _textile(rng)
    if style == "wall open pair":
        shares = draw(rng, 0.18, 0.4), draw(rng, 0.18, 0.4)
        shares = shares if chance(rng, 0.3) else (shares[0], shares[0])
        return [
            _drape(rng, -y, -y + 2 * y * shares[0], top, look, x),
            _drape(rng, y - 2 * y * shares[1], y, top, look, x),
        ]
    if style == "wall closed pair":
        meet = draw(rng, -0.1, 0.1) * y
        gap = draw(rng, 0.0, 0.06)
        return [_drape(rng, -y, meet - gap, top, look, x), _drape(rng, meet + gap, y, top, look, x)]
    if style == "wall one side":
        side, share = pick(rng, (-1.0, 1.0)), draw(rng, 0.3, 1.0)
        ends = sorted((side * y, side * y * (1 - 2 * share)))
        return [_drape(rng, ends[0], ends[1], top, look if chance(rng, 0.7) else _sheer(rng), x)]
    if style == "wall sheer and drapes":
        share = draw(rng, 0.15, 0.3)
        parts = [_drape(rng, -y * 0.96, y * 0.96, top - 0.01, _sheer(rng), x * 0.5, hem=0.01)]
        parts.append(_drape(rng, -y, -y + 2 * y * share, top, look, x * 1.2))
        return [*parts, _drape(rng, y - 2 * y * share, y, top, look, x * 1.2)]
    if style == "wall cafe":
        low = _drape(rng, -y, y, top * draw(rng, 0.45, 0.6), _sheer(rng) if chance(rng, 0.5) else look, x)
        return [low, _drape(rng, -y, y, top, look, x, hem=top * draw(rng, 0.72, 0.85))]
    if style == "wall tied back":
        waist = draw(rng, 0.25, 0.45)
        pinch = np.interp(np.linspace(0.0, 1.0, 8), [0.0, 0.3, 0.38, 0.6, 1.0], [waist * 1.5, waist, waist, 0.8, 1.0])
        half = draw(rng, 0.5, 0.98)
        parts = [_drape(rng, -y, -y * (1 - half), top, look, x, pinch, -y)]
        return [*parts, _drape(rng, y * (1 - half), y, top, look, x, pinch, y)]
    share, deep = draw(rng, 0.15, 0.3), draw(rng, 0.12, 0.25)
    parts = [_drape(rng, -y, -y + 2 * y * share, top, look, x), _drape(rng, y - 2 * y * share, y, top, look, x)]
    s = np.linspace(0.0, 1.0, 25)
    swags = count(rng, 1, 4)
    hem = top * (1 - deep) - 0.06 * top * np.abs(np.sin(np.pi * swags * s))
    flap = np.stack([np.column_stack([np.full(25, x + 0.07), -y + 2 * y * s, h]) for h in (hem, np.full(25, top))], 1)
    return [*parts, cloth(flap, look if chance(rng, 0.5) else _textile(rng))]


def curtain(rng: np.random.Generator, width_m: float, height_m: float, which: Families = "all",
            style: str | None = None) -> Piece:  # fmt: skip
    """Make a curtain with its rod: wall at x = 0, middle at y = 0, hem at z = 0.

    It is ``width_m`` wide drawn shut, and ``height_m`` from hem to rod; styles are ``CURTAIN_STYLES``.
    """
    known = CURTAIN_STYLES["training"] + CURTAIN_STYLES["held-out"] if which == "all" else CURTAIN_STYLES[which]
    style = pick(rng, known) if style is None else style
    x = draw(rng, 0.07, 0.13)
    parts = _rod(rng, width_m * draw(rng, 1.02, 1.15), height_m, x)
    cloths = _panels(rng, width_m / 2, height_m - draw(rng, 0.0, 0.03), x, style)
    if style == "wall cafe":
        parts += [tube([(x, -width_m / 2, float(c.high[2])), (x, width_m / 2, float(c.high[2]))], 0.006,
                       material("metal", rng), 5) for c in cloths[:1]]  # fmt: skip
    return Piece(joined([*parts, *cloths]), category="curtain", family=style)


def _register_curtain(style: str, held_out: bool) -> None:
    @family("curtain", style, held_out)
    def recipe(rng: np.random.Generator) -> Parts:
        short = style == "wall cafe" or chance(rng, 0.25)
        height = draw(rng, 0.7, 1.6) if short else draw(rng, 2.0, 2.7)
        width = draw(rng, 0.6, 1.4) if style == "wall one side" else draw(rng, 0.9, 3.2)
        return [curtain(rng, width, height, style=style).mesh]


for _which, _names in CURTAIN_STYLES.items():
    for _name in _names:
        _register_curtain(_name, _which == "held-out")


def _measures(rng: np.random.Generator) -> tuple[float, float]:
    return draw(rng, 0.5, 2.0), draw(rng, 0.6, 2.1)


@family("blinds", "wall venetian")
def _venetian(rng: np.random.Generator) -> Parts:
    width, height = _measures(rng)
    look, deep = made_of(rng, "white", "white", "wood", "metal", "painted"), draw(rng, 0.025, 0.05)
    tilt, shut = draw(rng, -1.2, 1.2), draw(rng, 0.3, 1.0)
    step = max(deep * 0.85, height * shut / 60)
    slats = max(int(height * shut / step), 4)
    low = height - slats * step
    across, rise = deep * float(np.cos(tilt)), deep * float(np.sin(tilt))
    x = deep / 2 + 0.015
    for i in range(slats):
        yield sheet(
            (x - across / 2, -width / 2, low + (i + 0.5) * step - rise / 2),
            (0.0, width, 0.0),
            (across, 0.0, rise),
            look,
        )
    yield box((0.0, -width / 2, height), (2 * x, width / 2, height + 0.05), look)
    yield slab(x, 0.0, low - 0.015, deep, width, 0.02, look)
    yield from [slab(x, s * width * 0.36, low, 0.004, 0.012, height - low, look) for s in (-1, 1)]


@family("blinds", "wall roller")
def _roller(rng: np.random.Generator) -> Parts:
    width, height = _measures(rng)
    look = made_of(rng, "fabric", "curtain", "paper", "white")
    radius, shut = draw(rng, 0.018, 0.035), draw(rng, 0.25, 1.0)
    hung = height * shut
    x = radius + 0.01
    yield tube([(x, -width / 2, 0.0), (x, width / 2, 0.0)], radius, look, 10)
    yield sheet((x + radius, -width / 2, -hung), (0.0, width, 0.0), (0.0, 0.0, hung), look)
    yield slab(x + radius, 0.0, -hung - 0.015, 0.012, width, 0.025, material("white", rng))
    cord = material("white", rng)
    yield slab(x, width / 2 + 0.01, -hung * 0.7, 0.004, 0.008, hung * 0.7, cord)
    for s in (-1, 1):
        yield box((0.0, s * (width / 2 + 0.008) - 0.006, -0.04), (2 * x, s * (width / 2 + 0.008) + 0.006, 0.04), cord)


@family("blinds", "wall roman")
def _roman(rng: np.random.Generator) -> Parts:
    width, height = _measures(rng)
    look, folds = _textile(rng), count(rng, 3, 7)
    shut = draw(rng, 0.35, 1.0)
    step, sag = height * shut / folds, 0.01 + 0.07 * (1 - shut)
    rows = []
    for fold in range(folds):
        base = fold * step
        rows += [(0.02, base), (0.02 + sag, base + step * 0.12), (0.02 + sag * 0.8, base + step * 0.35)]
    rows.append((0.02, folds * step))
    points = np.array([[(x, y, z) for x, z in rows] for y in (-width / 2, width / 2)])
    return [
        cloth(points, look),
        box((0.0, -width / 2, folds * step - 0.02), (0.04, width / 2, folds * step + 0.03), look),
    ]


@family("blinds", "wall vertical", held_out=True)
def _vertical(rng: np.random.Generator) -> Parts:
    width, height = draw(rng, 0.9, 2.4), draw(rng, 1.2, 2.4)
    look, wide, tilt = made_of(rng, "white", "fabric", "paper"), draw(rng, 0.09, 0.13), draw(rng, 0.0, 1.4)
    slats = int(width / (wide * 0.9))
    along, across = wide * float(np.cos(tilt)), wide * float(np.sin(tilt))
    yield from [
        sheet((0.07 - across / 2, -width / 2 + i * wide * 0.9, 0.0), (across, along, 0.0), (0.0, 0.0, height), look)
        for i in range(slats)
    ]
    yield box((0.0, -width / 2, height), (0.09, width / 2, height + 0.05), material("white", rng))


@family("blinds", "wall pleated")
def _pleated(rng: np.random.Generator) -> Parts:
    width, height = _measures(rng)
    look, folds = material("fabric", rng), count(rng, 14, 40)
    hung = height * draw(rng, 0.3, 1.0)
    rows = [(0.015 + 0.018 * (i % 2), hung * i / folds) for i in range(folds + 1)]
    points = np.array([[(x, y, z) for x, z in rows] for y in (-width / 2, width / 2)])
    frame = material("white", rng)
    yield cloth(points, look)
    yield rounded_box((0.0, -width / 2, hung), (0.045, width / 2, hung + 0.03), 0.005, frame)
    yield slab(0.024, 0.0, -0.012, 0.03, width, 0.014, frame)
