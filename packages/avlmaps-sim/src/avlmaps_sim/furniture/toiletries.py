"""Mirrors and towels. Families named "wall ..." hang; the home chooses their height."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.fittings import chrome, face, knob, outline, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, rim
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, circle, cylinder, loft, polygon, rounded_box, tube


def _frame_look(rng: np.random.Generator) -> Material:
    return made_of(rng, "wood", "wood", "metal", "black", "white", "painted")


@family("mirror", "wall framed")
def _framed(rng: np.random.Generator) -> Parts:
    wide, high, bar = draw(rng, 0.3, 1.2), draw(rng, 0.4, 1.3), draw(rng, 0.012, 0.11)
    deep, look = draw(rng, 0.015, 0.05), _frame_look(rng)
    bar = min(bar, 0.2 * wide)
    yield rim((-wide / 2, 0.0), (wide / 2, high), bar, (0.0, deep), look)
    yield box((0.0, -wide / 2 + 0.005, 0.005), (0.008, wide / 2 - 0.005, high - 0.005), material("black", rng))
    yield face(0.012, (-wide / 2 + bar * 0.9, bar * 0.9), (wide / 2 - bar * 0.9, high - bar * 0.9),
               material("mirror", rng))  # fmt: skip
    if bar > 0.05:
        yield rim((-wide / 2 + 0.25 * bar, 0.25 * bar), (wide / 2 - 0.25 * bar, high - 0.25 * bar), 0.3 * bar,
                  (deep, deep + 0.012), look)  # fmt: skip


@family("mirror", "wall bare sheet")
def _bare(rng: np.random.Generator) -> Parts:
    wide, high, off = draw(rng, 0.4, 2.2), draw(rng, 0.5, 1.4), draw(rng, 0.003, 0.03)
    yield box((0.0, -wide / 2 + 0.03, 0.03), (off, wide / 2 - 0.03, high - 0.03), material("white", rng))
    yield box((off, -wide / 2, 0.0), (off + 0.005, wide / 2, high), material("mirror", rng))
    if chance(rng, 0.3):
        look = material("white", rng)
        yield box((0.0, -wide * 0.25, high + 0.03), (0.06, wide * 0.25, high + 0.07), chrome(rng))
        yield box((0.06, -wide * 0.25, high + 0.03), (0.085, wide * 0.25, high + 0.055), look)
    if chance(rng, 0.3):
        yield box((0.0, -wide / 2, -0.05), (draw(rng, 0.08, 0.14), wide / 2, -0.035),
                  made_of(rng, "glass", "wood", "white"))  # fmt: skip


def _round_mirror(rng: np.random.Generator, flat: np.ndarray, bar: float, deep: float, look: Material) -> list[Mesh]:
    inner = flat * (1 - bar / np.abs(flat).max())

    def ring(points: np.ndarray, x: float) -> np.ndarray:
        return np.column_stack([np.full(len(points), x), points])

    frame = loft([ring(flat, 0.0), ring(flat, deep * 0.7), ring((flat + inner) / 2, deep), ring(inner, deep * 0.6)],
                 look, capped=False)  # fmt: skip
    return [frame, polygon(ring(inner, deep * 0.6), material("mirror", rng)), polygon(ring(flat, 0.0), look)]


@family("mirror", "wall round")
def _round(rng: np.random.Generator) -> Parts:
    size = draw(rng, 0.15, 0.5)
    flat = circle(size, 28, size * pick(rng, (1.0, 1.0, draw(rng, 1.2, 1.6))))
    return _round_mirror(rng, flat, draw(rng, 0.008, 0.07), draw(rng, 0.015, 0.05), _frame_look(rng))


@family("mirror", "wall arch")
def _arch(rng: np.random.Generator) -> Parts:
    wide, high = draw(rng, 0.4, 0.9), draw(rng, 0.7, 1.6)
    rise = pick(rng, (wide / 2, draw(rng, 0.1, 0.3) * wide))
    arc = np.linspace(0.0, np.pi, 17)
    top = np.column_stack([wide / 2 * np.cos(arc), high / 2 - rise + rise * np.sin(arc)])
    flat = np.concatenate([top, [(-wide / 2, -high / 2), (wide / 2, -high / 2)]])
    return _round_mirror(rng, flat, draw(rng, 0.01, 0.07), draw(rng, 0.015, 0.045), _frame_look(rng))


@family("mirror", "wall sunburst", held_out=True)
def _sunburst(rng: np.random.Generator) -> Parts:
    size, rays = draw(rng, 0.14, 0.26), count(rng, 12, 30)
    gold = material("metal", rng, (0.75, 0.6, 0.3)) if chance(rng, 0.6) else _frame_look(rng)
    yield from _round_mirror(rng, circle(size, 24), 0.02, 0.03, gold)
    for i in range(rays):
        a = 2 * np.pi * i / rays
        reach = size * (draw(rng, 1.6, 2.0) if i % 2 else 1.45)
        y, z = float(np.cos(a)), float(np.sin(a))
        yield tube([(0.015, size * 0.95 * y, size * 0.95 * z), (0.012, reach * y, reach * z)], 0.007, gold, 4)


@family("mirror", "wall cabinet")
def _mirror_cabinet(rng: np.random.Generator) -> Parts:
    wide, high, deep, doors = draw(rng, 0.35, 1.2), draw(rng, 0.5, 0.8), draw(rng, 0.11, 0.18), count(rng, 1, 3)
    look = made_of(rng, "white", "white", "wood", "metal")
    doors = max(1, min(doors, int(wide / 0.25)))
    yield box((0.0, -wide / 2, 0.0), (deep, wide / 2, high), look)
    step = wide / doors
    for i in range(doors):
        a = -wide / 2 + i * step
        yield box((deep, a + 0.003, 0.003), (deep + 0.016, a + step - 0.003, high - 0.003), look)
        yield face(deep + 0.0175, (a + 0.006, 0.006), (a + step - 0.006, high - 0.006), material("mirror", rng))
    if chance(rng, 0.4):
        metal = chrome(rng)
        yield from [knob(deep + 0.017, -wide / 2 + (i + 1) * step - 0.03, 0.08, 0.01, metal) for i in range(doors)]


@family("mirror", "standing in a frame")
def _cheval(rng: np.random.Generator) -> Parts:
    wide, high, lift = draw(rng, 0.35, 0.6), draw(rng, 1.1, 1.5), draw(rng, 0.1, 0.22)
    look, lean = _frame_look(rng), draw(rng, 0.02, 0.2)
    if chance(rng, 0.5):
        panel = joined(_round_mirror(rng, outline(wide, high, pick(rng, (2.0, 2.6, 8.0)), 28), 0.03, 0.03, look))
    else:
        panel = joined([rim((-wide / 2, -high / 2), (wide / 2, high / 2), 0.035, (0.0, 0.03), look),
                        box((0.0, -wide / 2 + 0.02, -high / 2 + 0.02), (0.012, wide / 2 - 0.02, high / 2 - 0.02),
                            material("black", rng)),
                        face(0.014, (-wide / 2 + 0.02, -high / 2 + 0.02), (wide / 2 - 0.02, high / 2 - 0.02),
                             material("mirror", rng))])  # fmt: skip
    yield panel.tilted("y", -lean).moved(z=lift + high / 2)
    reach = max(0.2, 0.5 * high * float(np.sin(lean)) + 0.1)
    for s in (-1, 1):
        y = s * (wide / 2 + 0.03)
        yield tube([(0.0, y, 0.03), (0.0, y, lift + draw(rng, 0.5, 0.62) * high)], 0.016, look, 7)
        yield tube([(-reach, y, 0.015), (0.0, y, 0.05), (reach, y, 0.015)], 0.016, look, 6)
    yield tube([(0.0, -wide / 2 - 0.03, 0.06), (0.0, wide / 2 + 0.03, 0.06)], 0.012, look, 6)


@family("mirror", "leaning on a wall")
def _leaning(rng: np.random.Generator) -> Parts:
    wide, high, bar, look = draw(rng, 0.45, 1.0), draw(rng, 1.4, 2.0), draw(rng, 0.02, 0.12), _frame_look(rng)
    panel = joined([rim((-wide / 2, 0.0), (wide / 2, high), bar, (0.0, 0.035), look),
                    box((0.0, -wide / 2 + 0.01, 0.01), (0.01, wide / 2 - 0.01, high - 0.01), look),
                    face(0.014, (-wide / 2 + bar * 0.9, bar * 0.9), (wide / 2 - bar * 0.9, high - bar * 0.9),
                         material("mirror", rng))])  # fmt: skip
    return [panel.tilted("y", -draw(rng, 0.06, 0.16))]


@family("mirror", "counter make-up", held_out=True)
def _make_up(rng: np.random.Generator) -> Parts:
    size, lift, metal = draw(rng, 0.07, 0.2), draw(rng, 0.06, 0.2), chrome(rng)
    panel = joined(_round_mirror(rng, circle(size, 24), 0.012, 0.02, metal)).tilted("y", -draw(rng, 0.0, 0.3))
    return [panel.moved(z=lift + size), cylinder(0.0, 0.0, 0.0, draw(rng, 0.06, 0.09), 0.012, metal, 16),
            cylinder(-0.005, 0.0, 0.0, 0.008, lift + 0.02, metal, 7)]  # fmt: skip


def _towel(rng: np.random.Generator) -> Material:
    if chance(rng, 0.4):
        return material(
            "fabric", rng, pick(rng, ((0.93, 0.92, 0.9), (0.85, 0.8, 0.72), (0.55, 0.65, 0.72), (0.75, 0.55, 0.55)))
        )
    return material("fabric", rng)


def _draped(rng: np.random.Generator, x: float, y: float, z: float, wide: float, drop: float, look: Material,
            fold: float = 0.03) -> Mesh:  # fmt: skip
    n, phase = 9, draw(rng, 0.0, 6.0)
    across = np.linspace(-wide / 2, wide / 2, n)
    ripple = draw(rng, 0.0, 0.012) * np.sin(across / wide * draw(rng, 6.0, 16.0) + phase)
    back = drop * draw(rng, 0.4, 0.95)
    rows = [(x + fold, z - drop, 1.4), (x + fold * 0.9, z - drop * 0.5, 1.0), (x + fold * 0.6, z - 0.02, 0.5),
            (x, z + 0.012, 0.2), (x - fold * 0.6, z - 0.02, 0.4), (x - fold * 0.8, z - back, 0.6)]  # fmt: skip
    return cloth(np.stack([np.column_stack([px + ripple * share, across + y, np.full(n, pz)]) for px, pz,
                           share in rows]), look)  # fmt: skip


@family("towel", "wall bar")
def _on_bar(rng: np.random.Generator) -> Parts:
    long, out, metal, bars = draw(rng, 0.35, 0.8), draw(rng, 0.06, 0.1), chrome(rng), count(rng, 1, 2)
    parts: list[Mesh] = []
    for k in range(bars):
        x, z = out + 0.07 * k, -0.05 * k
        parts.append(tube([(0.0, -long / 2, z), (x, -long / 2, z), (x, long / 2, z), (0.0, long / 2, z)], 0.008, metal,
                          6))  # fmt: skip
        left = -long / 2 + 0.02
        while left < long / 2 - 0.2:
            wide = min(draw(rng, 0.2, 0.6), long / 2 - left - 0.02)
            if chance(rng, 0.85):
                parts.append(_draped(rng, x, left + wide / 2, z, wide - 0.01, draw(rng, 0.25, 0.7), _towel(rng), 0.022))
            left += wide
    if len(parts) == bars:
        parts.append(_draped(rng, out, 0.0, 0.0, long * 0.8, 0.5, _towel(rng), 0.022))
    return parts


@family("towel", "wall ring")
def _on_ring(rng: np.random.Generator) -> Parts:
    metal, size = chrome(rng), draw(rng, 0.07, 0.1)
    angle = np.linspace(0.0, 2 * np.pi, 14, endpoint=False)
    circle_path = [(0.05, float(size * np.cos(a)), float(size * np.sin(a))) for a in angle]
    yield tube(circle_path, 0.005, metal, 5, closed=True)
    yield tube([(0.0, 0.0, size), (0.05, 0.0, size)], 0.012, metal, 7)
    yield _draped(rng, 0.05, 0.0, -size, draw(rng, 0.14, 0.26), draw(rng, 0.2, 0.45), _towel(rng), 0.025)


@family("towel", "wall hook")
def _on_hook(rng: np.random.Generator) -> Parts:
    high, metal, look = draw(rng, 0.5, 0.95), chrome(rng), _towel(rng)
    n, folds = 18, count(rng, 2, 4)
    angle = np.linspace(0.0, 2 * np.pi, n, endpoint=False)
    rings = []
    for share in np.linspace(0.0, 1.0, 6):
        wide = 0.02 + draw(rng, 0.9, 1.1) * 0.13 * share**0.7
        wave = 1 + 0.25 * share * np.sin(folds * 2 * angle + 1.0)
        rings.append(np.column_stack([0.05 + 0.35 * wide * wave * np.cos(angle) + 0.03 * share,
                                      wide * wave * np.sin(angle), np.full(n, -high * share)]))  # fmt: skip
    cone = loft(rings, look, capped=False)
    cone = cone.moved(x=max(0.0, 0.003 - float(cone.low[0])))
    return [cone, tube([(0.0, 0.0, 0.0), (0.05, 0.0, -0.01), (0.065, 0.0, 0.025)], 0.008, metal, 6)]


@family("towel", "folded pile")
def _folded(rng: np.random.Generator) -> Parts:
    deep, wide, z = draw(rng, 0.2, 0.36), draw(rng, 0.26, 0.45), 0.0
    same = _towel(rng) if chance(rng, 0.4) else None
    for _ in range(count(rng, 1, 5)):
        thick = draw(rng, 0.03, 0.07)
        d, w = deep * draw(rng, 0.9, 1.0), wide * draw(rng, 0.9, 1.0)
        look = same or _towel(rng)
        half = rounded_box((-d / 2, -w / 2, z), (d / 2, w / 2, z + thick / 2 + 0.004), thick * 0.24, look, 2)
        yield half
        yield rounded_box((-d / 2 + 0.004, -w / 2 + 0.004, z + thick / 2), (d / 2, w / 2 - 0.002, z + thick),
                          thick * 0.24, look, 2, 0.004)  # fmt: skip
        z += thick * 0.97


@family("towel", "rolled", held_out=True)
def _rolled(rng: np.random.Generator) -> Parts:
    radius, long, n = draw(rng, 0.04, 0.07), draw(rng, 0.22, 0.4), count(rng, 1, 4)
    for i in range(n):
        look = _towel(rng)
        y = (i % 3 - min(n, 3) / 2 + 0.5) * 2 * radius + (radius if i == 3 else 0.0)
        z = radius + (1.73 * radius if i == 3 else 0.0)
        turn = np.linspace(0.0, 5 * np.pi, 26)
        r = radius * (0.25 + 0.75 * turn / turn[-1])
        spiral = np.column_stack([y + r * np.cos(turn), z + r * np.sin(turn)])
        yield cloth(np.stack([np.column_stack([np.full(26, x), spiral]) for x in (-long / 2, long / 2)], axis=1), look)
        for x in (-long / 2, long / 2):
            yield spindle([(radius * 0.9, x), (radius * 0.2, x * 0.98)], look, y, z, 12, capped=False)


@family("towel", "on a stand", held_out=True)
def _on_stand(rng: np.random.Generator) -> Parts:
    wide, high, look = draw(rng, 0.45, 0.7), draw(rng, 0.8, 1.1), made_of(rng, "wood", "metal", "black")
    yield from [tube([(0.0, s * wide / 2, 0.0), (0.0, s * wide / 2, high)], 0.012, look, 6) for s in (-1, 1)]
    yield from [tube([(-0.14, s * wide / 2, 0.012), (0.14, s * wide / 2, 0.012)], 0.012, look, 6) for s in (-1, 1)]
    for k in range(count(rng, 2, 3)):
        z = high - 0.01 - 0.22 * k
        yield tube([(0.0, -wide / 2, z), (0.0, wide / 2, z)], 0.01, look, 6)
        if chance(rng, 0.75) or k == 0:
            cover = draw(rng, 0.4, 0.85) * wide
            yield _draped(rng, 0.0, draw(rng, -0.5, 0.5) * (wide - cover), z, cover, draw(rng, 0.3, 0.6), _towel(rng))
