"""Pictures, carpets, cushions, vases and candles."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Families, Parts, Piece, family
from avlmaps_sim.furniture.lighting import shining
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, rim
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined, triangles_of
from avlmaps_sim.shapes import circle, cylinder, ellipsoid, lathe, loft, prism, rounded_rectangle, sheet, slab, tube


def _vessel(rng: np.random.Generator, tall: float, wide: float, kind: str, look: Material) -> Mesh:
    rows = {"belly": [(0.45, 0.0), (0.85, 0.2), (1.0, 0.42), (0.8, 0.65), (0.42, 0.85), (0.5, 1.0), (0.3, 0.8)],
            "bottle": [(0.8, 0.0), (1.0, 0.15), (0.95, 0.35), (0.3, 0.55), (0.22, 0.9), (0.32, 1.0), (0.2, 0.97)],
            "trumpet": [(0.6, 0.0), (0.35, 0.1), (0.4, 0.5), (0.65, 0.85), (1.0, 1.0), (0.9, 0.98), (0.4, 0.6)],
            "tube": [(0.85, 0.0), (1.0, 0.02), (1.0, 1.0), (0.9, 1.0), (0.88, 0.1)],
            "tulip": [(0.5, 0.0), (0.9, 0.3), (0.95, 0.6), (0.75, 1.0), (0.68, 0.98), (0.8, 0.5)],
            "stepped": [(0.7, 0.0), (0.7, 0.3), (1.0, 0.33), (1.0, 0.7), (0.55, 0.73), (0.55, 1.0),
                        (0.45, 0.7)]}[kind]  # fmt: skip
    swell = rng.uniform(0.9, 1.1, len(rows))
    return lathe([(r * s * wide, h * tall) for (r, h), s in zip(rows, swell, strict=True)], look, sides=16)


_FORMS = ("belly", "bottle", "trumpet", "tube", "tulip", "stepped")


def _clay(rng: np.random.Generator) -> Material:
    return made_of(rng, "ceramic", "ceramic", "ceramic", "glass", "painted", "painted", "metal", "stone", "wood")


@family("vase", "turned")
def _vase(rng: np.random.Generator) -> Parts:
    tall = draw(rng, 0.12, 0.5) if chance(rng, 0.8) else draw(rng, 0.5, 0.9)
    return [_vessel(rng, tall, min(tall * draw(rng, 0.17, 0.36), 0.17), pick(rng, _FORMS), _clay(rng))]


def flowers(rng: np.random.Generator, z: float, spread: float, rise: float) -> Meshes:
    """Return a bunch of stems with blossoms that leaves a mouth at z."""
    stem = material("plant", rng)
    blossom = material("plastic", rng, tuple(rng.uniform(0.3, 1.0, 3).tolist()))
    kind, size = pick(rng, ("ball", "cup", "twig")), draw(rng, 0.015, 0.035)
    for _ in range(count(rng, 5, 11)):
        turn, out = draw(rng, 0.0, 2 * np.pi), draw(rng, 0.1, 1.0) * spread
        x, y, top = out * float(np.cos(turn)), out * float(np.sin(turn)), z + rise * draw(rng, 0.65, 1.0)
        yield tube([(0.0, 0.0, z - 0.03), (x * 0.4, y * 0.4, (z + top) / 2), (x, y, top)], 0.002, stem, 3)
        if kind == "ball":
            yield ellipsoid((x, y, top), (size, size, size), blossom, 6, 4)
        elif kind == "cup":
            yield lathe([(0.004, top - size), (size, top), (size * 0.7, top + size * 1.4)], blossom, x, y, 6)
        else:
            yield tube([(x, y, top), (x * 1.2, y * 1.2, top + rise * 0.3)], 0.004, blossom, 3)


@family("vase", "with flowers")
def _vase_with_flowers(rng: np.random.Generator) -> Parts:
    tall = draw(rng, 0.14, 0.35)
    body = _vessel(rng, tall, tall * draw(rng, 0.2, 0.35), pick(rng, _FORMS), _clay(rng))
    return [body, *flowers(rng, tall, draw(rng, 0.07, 0.2), draw(rng, 0.15, 0.4))]


@family("vase", "block")
def _block_vase(rng: np.random.Generator) -> Parts:
    tall, wide, deep = draw(rng, 0.15, 0.45), draw(rng, 0.04, 0.1), draw(rng, 0.03, 0.08)
    twist, swell = draw(rng, -0.6, 0.6), draw(rng, 0.7, 1.4)
    rings = []
    for step, z in enumerate((0.0, 0.33, 0.66, 1.0)):
        size = 1.0 + (swell - 1.0) * step / 3
        flat = rounded_rectangle(2 * deep * size, 2 * wide * size, 0.01, 2)
        c, s = np.cos(twist * z), np.sin(twist * z)
        rings.append(np.column_stack([flat @ np.array([[c, s], [-s, c]]), np.full(len(flat), z * tall)]))
    inner = rings[-1] * (0.85, 0.85, 1.0)
    return [loft([*rings, inner, inner - (0.0, 0.0, tall * 0.5)], _clay(rng))]


@family("vase", "amphora", held_out=True)
def _amphora(rng: np.random.Generator) -> Parts:
    tall = draw(rng, 0.2, 0.6)
    wide, look = tall * draw(rng, 0.22, 0.32), _clay(rng)
    yield _vessel(rng, tall, wide, "belly", look)
    for side in (-1, 1):
        path = [(0.0, side * wide * r, tall * z) for r, z in ((0.8, 0.6), (1.15, 0.75), (0.95, 0.92), (0.4, 0.93))]
        yield tube(path, tall * 0.025, look, 5)


def _wax(rng: np.random.Generator) -> Material:
    pale = draw(rng, 0.75, 0.95)
    tint: Triple = (pale, pale * draw(rng, 0.5, 1.0), pale * draw(rng, 0.4, 0.95))
    return material("paper", rng, tint)


def _flame(rng: np.random.Generator, x: float, y: float, z: float) -> Mesh:
    return ellipsoid((x, y, z + 0.016), (0.005, 0.005, 0.014), shining(rng), 5, 4)


@family("candle", "pillars")
def _pillars(rng: np.random.Generator) -> Parts:
    look, light, number = _wax(rng), [], count(rng, 1, 4)
    for x, y in (circle(0.06, number) if number > 1 else np.zeros((1, 2))).tolist():
        tall, radius = draw(rng, 0.06, 0.24), draw(rng, 0.025, 0.045)
        yield from (cylinder(x, y, 0.008, radius, tall, look, 10), _flame(rng, x, y, tall + 0.008))
        light.append((x, y, tall + 0.02))
    tray = made_of(rng, "metal", "wood", "stone", "glass")
    yield cylinder(0.0, 0.0, 0.0, 0.06 if number == 1 else 0.13, 0.01, tray, 16)
    yield from light


@family("candle", "stick")
def _candlestick(rng: np.random.Generator) -> Parts:
    look, tall, foot = made_of(rng, "metal", "wood", "ceramic", "black"), draw(rng, 0.06, 0.4), draw(rng, 0.035, 0.07)
    rows = [(foot, 0.0), (foot * 0.9, 0.012), (0.012, 0.03), (0.018, tall * 0.5), (0.011, tall * 0.8), (0.024, tall)]
    wax = draw(rng, 0.08, 0.28)
    yield from (lathe(rows, look, sides=10), lathe([(0.011, tall), (0.008, tall + wax)], _wax(rng), sides=8))
    yield _flame(rng, 0.0, 0.0, tall + wax)
    yield (0.0, 0.0, tall + wax)


@family("candle", "lantern")
def _candle_lantern(rng: np.random.Generator) -> Parts:
    wide, look = draw(rng, 0.05, 0.12), made_of(rng, "black", "metal", "white", "wood")
    tall, edge = wide * draw(rng, 2.0, 4.0), 0.012
    yield slab(0.0, 0.0, 0.0, 2 * wide, 2 * wide, 0.015, look)
    yield slab(0.0, 0.0, tall, 2 * wide, 2 * wide, 0.015, look)
    yield from [slab(x * (wide - edge / 2), y * (wide - edge / 2), 0.0, edge, edge, tall, look) for x in (-1, 1)
                for y in (-1, 1)]  # fmt: skip
    yield lathe([(wide * 1.2, tall + 0.015), (0.02, tall + wide * 0.8)], look, sides=4).turned(np.pi / 4)
    yield cylinder(0.0, 0.0, 0.015, wide * 0.4, tall * draw(rng, 0.3, 0.6), _wax(rng), 10)
    yield (0.0, 0.0, tall * 0.7)


@family("candle", "candelabra", held_out=True)
def _candelabra(rng: np.random.Generator) -> Parts:
    look, tall, reach = material("metal", rng), draw(rng, 0.2, 0.38), draw(rng, 0.08, 0.14)
    parts, light, wax = [lathe([(0.07, 0.0), (0.012, 0.03), (0.01, tall)], look, sides=10)], [], _wax(rng)
    for share in pick(rng, ((-1.0, 0.0, 1.0), (-1.0, -0.5, 0.0, 0.5, 1.0))):
        y, high = share * reach, tall + (0.04 if share == 0 else 0.0)
        parts.append(tube([(0.0, 0.0, tall * 0.6), (0.0, y * 0.7, tall * 0.62), (0.0, y, high)], 0.006, look, 5))
        parts += [cylinder(0.0, y, high, 0.01, 0.14, wax, 6), _flame(rng, 0.0, y, high + 0.14)]
        light.append((0.0, y, high + 0.15))
    return [*parts, *light]


CARPET_SHAPES: dict[Families, tuple[str, ...]] = {
    "training": ("rectangle", "round", "runner", "fringed", "doormat"),
    "held-out": ("oval", "hide"),
}


def _art(rng: np.random.Generator) -> Material:
    return made_of(rng, "painting", "painting", "poster")


def _format(rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    long = draw(rng, low, high)
    short = long * draw(rng, 0.55, 0.85)
    return pick(rng, ((long, short), (short, long), (long, long)))


def _framed(rng: np.random.Generator, width: float, height: float, look: Material, ornate: bool = False) -> Mesh:
    """Return a framed picture whose back lies at x = 0 and whose lower edge lies at z = 0, its middle at y = 0."""
    bar = min(draw(rng, 0.012, 0.05) * (1.8 if ornate else 1.0), 0.2 * min(width, height))
    deep, y = draw(rng, 0.015, 0.04), width / 2
    parts = [rim((-y, 0.0), (y, height), bar, (0.0, deep), look)]
    if ornate:
        parts.append(rim((-y, 0.0), (y, height), bar * 0.35, (deep, deep + 0.02), look))
        inner = bar * 0.72
        parts.append(rim((-y + inner, inner), (y - inner, height - inner), bar * 0.28, (deep, deep + 0.01), look))
    inset, face = bar, deep * 0.4
    if chance(rng, 0.45) and not ornate:
        passe = material("white" if chance(rng, 0.8) else "black", rng)
        parts.append(_face(face, -y + inset, inset, y - inset, height - inset, passe))
        inset, face = inset + draw(rng, 0.1, 0.22) * min(width, height), face + 0.002
    parts.append(_face(face, -y + inset, inset, y - inset, height - inset, _art(rng)))
    return joined(parts)


def _face(x: float, y0: float, z0: float, y1: float, z1: float, look: Material) -> Mesh:
    return sheet((x, y0, z0), (0.0, y1 - y0, 0.0), (0.0, 0.0, z1 - z0), look, fill=True)


def _frame_look(rng: np.random.Generator) -> Material:
    return made_of(rng, "wood", "wood", "black", "white", "metal", "painted")


@family("picture", "wall framed")
def _wall_framed(rng: np.random.Generator) -> Parts:
    return [_framed(rng, *_format(rng, 0.22, 1.3), _frame_look(rng))]


@family("picture", "wall ornate")
def _wall_ornate(rng: np.random.Generator) -> Parts:
    gold = (draw(rng, 0.6, 0.8), draw(rng, 0.45, 0.6), draw(rng, 0.2, 0.35))
    look = material("metal", rng, gold) if chance(rng, 0.6) else material("wood", rng)
    return [_framed(rng, *_format(rng, 0.4, 1.5), look, ornate=True)]


@family("picture", "wall canvas")
def _wall_canvas(rng: np.random.Generator) -> Parts:
    width, height = _format(rng, 0.3, 1.6)
    panels, gap, deep = pick(rng, (1, 1, 1, 2, 3, 3, 5)), draw(rng, 0.015, 0.06), draw(rng, 0.015, 0.04)
    if panels > 1:
        width, height = max(width, height) * draw(rng, 0.9, 1.3), min(width, height)
    edge, step = material("white", rng), width / panels
    stagger = draw(rng, 0.0, 0.12) if panels > 1 else 0.0
    art = _art(rng)
    for number in range(panels):
        y, z = -width / 2 + number * step, stagger * (number % 2) * height
        yield slab(deep / 2, y + (step - gap) / 2, z, deep, step - gap, height, edge)
        yield _face(deep + 0.001, y, z, y + step - gap, z + height, art if chance(rng, 0.5) else _art(rng))


@family("picture", "wall poster")
def _wall_poster(rng: np.random.Generator) -> Parts:
    width = draw(rng, 0.28, 0.85)
    height, curl = width * pick(rng, (1.414, 1.5, 0.707, 1.33)), draw(rng, 0.0, 0.02)
    rows = np.linspace(0.0, 1.0, 4)
    points = np.stack([np.stack([np.array([0.002 + curl * (2 * v - 1) ** 4, (u - 0.5) * width, v * height])
                                 for v in rows]) for u in (0.0, 1.0)])  # fmt: skip
    yield cloth(points, material("poster", rng), fill=True)
    if chance(rng, 0.35):  # hangs between two bars
        bar = made_of(rng, "wood", "black")
        yield from [slab(0.009, 0.0, z, 0.018, width + 0.01, 0.022, bar) for z in (-0.01, height - 0.012)]
        yield tube([(0.008, -width * 0.4, height), (0.004, 0.0, height + width * 0.25), (0.008, width * 0.4, height)],
                   0.002, bar, 4)  # fmt: skip


@family("picture", "wall set")
def _wall_set(rng: np.random.Generator) -> Parts:
    look, same = _frame_look(rng), chance(rng, 0.6)
    columns, rows = count(rng, 1, 4), count(rng, 1, 3)
    rows = 2 if columns == 1 and rows == 1 else rows
    wide, tall, gap = draw(rng, 0.18, 0.42), draw(rng, 0.18, 0.5), draw(rng, 0.03, 0.1)
    for column in range(columns):
        for row in range(rows):
            share = (1.0, 1.0) if same else (draw(rng, 0.55, 1.0), draw(rng, 0.55, 1.0))
            one = _framed(rng, wide * share[0], tall * share[1], look if same else _frame_look(rng))
            slack = (draw(rng, -0.5, 0.5) * wide * (1 - share[0]), draw(rng, 0.0, 1.0) * tall * (1 - share[1]))
            yield one.moved(0.0, column * (wide + gap) + slack[0], row * (tall + gap) + slack[1])


@family("picture", "wall oval", held_out=True)
def _wall_oval(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.1, 0.35)
    tall, bar, look = wide * draw(rng, 1.0, 1.4), draw(rng, 0.02, 0.06), _frame_look(rng)
    sides = 28
    rings = []
    for grow, x in ((1.0, 0.0), (1.0, 0.02), (0.5, 0.035), (0.0, 0.015)):
        ring = circle(wide + bar * grow, sides, tall + bar * grow)
        rings.append(np.column_stack([np.full(sides, x), ring]))
    flat = circle(1.0, sides)
    vertex = np.column_stack([np.full(sides, 0.01), flat * (wide, tall)])
    fan = np.stack([np.zeros(sides - 2, int), np.arange(1, sides - 1), np.arange(2, sides)], axis=1)
    uv = (flat * (0.5, -0.5) + 0.5)[fan]
    return [loft(rings, look, capped=False), triangles_of(vertex, fan, _art(rng), uv)]


@family("picture", "wall hanging")
def _wall_hanging(rng: np.random.Generator) -> Parts:
    width, height = draw(rng, 0.3, 1.3), draw(rng, 0.5, 1.6)
    rod, look = made_of(rng, "wood", "metal"), made_of(rng, "rug", "painting")
    wave, phase = draw(rng, 0.003, 0.02), draw(rng, 0.0, 6.0)
    pointed = draw(rng, 0.1, 0.35) * height if chance(rng, 0.4) else 0.0
    points = np.array([[(0.03 + wave * np.sin(9 * u + phase) * (1 - v), (u - 0.5) * width,
                         height * v + pointed * (1 - v) * abs(2 * u - 1)) for v in np.linspace(0.0, 1.0, 4)]
                       for u in np.linspace(0.0, 1.0, 9)])  # fmt: skip
    yield cloth(points, look, fill=True)
    yield tube([(0.03, -width * 0.54, height), (0.03, width * 0.54, height)], 0.012, rod, 8)
    if chance(rng, 0.6):
        for y in np.linspace(-0.48, 0.48, 14).tolist():
            low = pointed * abs(2 * y)
            yield slab(0.03, y * width, low - 0.1, 0.006, width * 0.03, 0.1, look)
    yield from (slab(0.015, s * width * 0.5, height - 0.01, 0.03, 0.01, 0.02, rod) for s in (-1, 1))


@family("picture", "leaning")
def _leaning(rng: np.random.Generator) -> Parts:
    number, x = count(rng, 1, 3), 0.0
    for _ in range(number):
        lean = draw(rng, 0.08, 0.25)
        width, height = _format(rng, 0.35, 1.2)
        one = _framed(rng, width, height, _frame_look(rng), ornate=chance(rng, 0.2))
        yield one.tilted("y", -lean).moved(x + float(np.sin(lean)) * height, draw(rng, -0.3, 0.3))
        x += 0.06


@family("picture", "photo frame")
def _photo_frame(rng: np.random.Generator) -> Parts:
    width, height = _format(rng, 0.1, 0.3)
    lean, look = draw(rng, 0.12, 0.3), _frame_look(rng)
    front = _framed(rng, width, height, look).tilted("y", -lean)
    prop = slab(0.0, 0.0, 0.0, 0.005, width * 0.3, height * 0.8, material("black", rng)).tilted("y", lean * 0.9)
    return [front.moved(z=-float(front.low[2])), prop.moved(-float(np.sin(lean)) * height * 1.55)]


def _pile(outline: np.ndarray, thick: float, look: Material) -> list[Mesh]:
    side = prism(outline.tolist(), 0.0, thick, look)
    k = len(outline)
    size = np.ptp(outline, axis=0)
    vertex = np.column_stack([np.vstack([outline, outline.mean(axis=0)]), np.full(k + 1, thick + 0.0005)])
    fan = np.stack([np.arange(k), np.roll(np.arange(k), -1), np.full(k, k)], axis=1)
    uv = ((vertex[:, :2] - outline.min(axis=0)) / size)[fan]
    return [side, triangles_of(vertex, fan, look, uv)]


def carpet(rng: np.random.Generator, length_m: float, width_m: float, shape: str) -> Piece:
    """Make a carpet on the floor about the origin, its length along x without fringes; shapes are ``CARPET_SHAPES``."""
    thick = draw(rng, 0.005, 0.015)
    look = material("rug" if chance(rng, 0.75) else "carpet", rng)
    if shape in ("round", "oval"):
        return Piece(joined(_pile(circle(length_m / 2, 32, width_m / 2), thick, look)))
    if shape == "hide":
        tan = draw(rng, 0.25, 0.75)
        hide = material("fabric", rng, pick(rng, ((tan, tan * 0.75, tan * 0.55), (0.9, 0.88, 0.84), (0.12, 0.1, 0.1))))
        angle = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
        radius = 0.78 + 0.22 * np.cos(4 * angle + np.pi) + rng.uniform(-0.05, 0.05, 40)
        outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
        outline = (outline - (outline.min(0) + outline.max(0)) / 2) * (length_m, width_m) / np.ptp(outline, axis=0)
        return Piece(joined(_pile(outline, thick, hide)))
    corner = draw(rng, 0.005, 0.06)
    parts = _pile(rounded_rectangle(length_m, width_m, corner, 3), thick, look)
    if shape == "fringed":
        yarn, long = material("fabric", rng, (0.85, 0.8, 0.7)), draw(rng, 0.03, 0.08)
        for y in np.linspace(-width_m * 0.48, width_m * 0.48, 24).tolist():
            parts += [slab(s * (length_m + long) / 2, y, 0.0, long, width_m * 0.012, 0.004, yarn) for s in (-1, 1)]
    elif chance(rng, 0.3):  # a bound edge
        edge, band = material("fabric", rng), draw(rng, 0.02, 0.06)
        for s in (-1, 1):
            parts.append(slab(s * (length_m - band) / 2, 0.0, 0.0, band, width_m, thick + 0.002, edge))
            parts.append(slab(0.0, s * (width_m - band) / 2, 0.0, length_m - 2 * band, band, thick + 0.002, edge))
    return Piece(joined(parts))


def _register_carpet(shape: str, held_out: bool) -> None:
    @family("carpet", shape, held_out)
    def recipe(rng: np.random.Generator) -> Parts:
        length = draw(rng, 1.2, 3.4)
        width = length * draw(rng, 0.5, 0.85)
        if shape in ("round", "hide"):
            length = width = draw(rng, 0.9, 2.4)
        elif shape == "runner":
            length, width = draw(rng, 1.6, 4.0), draw(rng, 0.5, 0.9)
        elif shape == "doormat":
            length, width = draw(rng, 0.35, 0.55), draw(rng, 0.55, 1.0)
        return [carpet(rng, length, width, shape).mesh]


for _which, _names in CARPET_SHAPES.items():
    for _name in _names:
        _register_carpet(_name, _which == "held-out")


def _pillow(
    length: float, width: float, thick: float, look: Material, corner: float = 4.0, button: float = 0.0,
    fill: bool = False,
) -> Mesh:  # fmt: skip
    """Return a stuffed bag lying on z = 0, length along x; ``corner`` near 2 makes it round."""
    n = 7
    axis = np.sin(np.linspace(-np.pi / 2, np.pi / 2, n))
    u, v = np.meshgrid(axis, axis, indexing="ij")
    if corner < 3:  # a disc: squeeze the square into a circle
        u, v = u * np.sqrt(1 - v**2 / 2), v * np.sqrt(1 - u**2 / 2)
        bulge = np.sqrt(np.clip(1 - u**2 - v**2, 0.0, 1.0))
    else:
        bulge = ((1 - np.abs(u) ** corner) * (1 - np.abs(v) ** corner)) ** 0.6
        pinch = 1 - 0.08 * (1 - np.abs(u * v))
        u, v = u * pinch, v * pinch
    bulge = bulge * (1 - button * np.exp(-12 * (u**2 + v**2)))
    flat = np.stack([u * length / 2, v * width / 2], axis=-1)
    top, low = (np.concatenate([flat, (thick / 2 * (1 + s * bulge))[..., None]], axis=-1) for s in (1, -1))
    return joined([cloth(top, look, fill), cloth(low, look, fill)])


@family("cushion", "square")
def _square_cushion(rng: np.random.Generator) -> Parts:
    side, kind = draw(rng, 0.35, 0.65), pick(rng, ("fabric", "fabric", "fabric", "rug", "leather"))
    other = side * pick(rng, (1.0, 1.0, draw(rng, 0.55, 0.8)))
    look, corner = material(kind, rng), draw(rng, 3.0, 7.0)
    one = _pillow(other, side, draw(rng, 0.09, 0.2), look, corner, draw(rng, 0.0, 0.5), fill=kind == "rug")
    lean = draw(rng, 0.9, 1.4) if chance(rng, 0.5) else 0.0  # upright against a back, or lying
    return [one.tilted("y", lean)]


@family("cushion", "round")
def _round_cushion(rng: np.random.Generator) -> Parts:
    side = draw(rng, 0.3, 0.55)
    look = made_of(rng, "fabric", "leather")
    return [_pillow(side, side, draw(rng, 0.08, 0.18), look, 2.0, draw(rng, 0.0, 0.7))]


@family("cushion", "bolster", held_out=True)
def _bolster(rng: np.random.Generator) -> Parts:
    radius, long, look = draw(rng, 0.07, 0.12), draw(rng, 0.35, 0.9), material("fabric", rng)
    rows = [(radius * 0.5, -0.01), (radius * 0.95, 0.0), (radius, 0.03), (radius, long - 0.03), (radius * 0.95, long),
            (radius * 0.5, long + 0.01)]  # fmt: skip
    return [lathe(rows, look, sides=14).tilted("x", np.pi / 2)]


@family("cushion", "stack")
def _cushion_stack(rng: np.random.Generator) -> Parts:
    side, thick, z = draw(rng, 0.38, 0.6), draw(rng, 0.08, 0.16), 0.0
    for _ in range(count(rng, 2, 3)):
        one = _pillow(side, side * draw(rng, 0.8, 1.0), thick, material("fabric", rng), draw(rng, 3.5, 7.0))
        yield one.turned(draw(rng, -0.3, 0.3)).moved(z=z)
        z += thick * 0.8
