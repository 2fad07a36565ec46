"""Televisions, monitors, laptops and computers."""

from dataclasses import replace

import numpy as np

from avlmaps.sim.furniture.catalogue import Piece, Support, family
from avlmaps.sim.furniture.fittings import Pair, body, face, feet, spindle
from avlmaps.sim.furniture.joinery import chance, cloth, count, draw, finished, pick, pictured, rim, strut
from avlmaps.sim.materials import material
from avlmaps.sim.mesh import Material, Mesh, joined, triangles_of
from avlmaps.sim.shapes import box, cylinder, loft, prism, rounded_rectangle, sheet, slab, tube


def screen(rng: np.random.Generator, on: float = 0.55) -> Material:
    """Draw a display's surface: a picture in a share of the cases, else dark and glossy."""
    if chance(rng, on):
        return pictured("screen", rng, "black")
    return replace(material("black", rng), gloss=draw(rng, 0.6, 0.95))


def _casing(rng: np.random.Generator) -> Material:
    kind = rng.random()
    if kind < 0.6:
        return material("black", rng)
    return material("plastic", rng, (g := draw(rng, 0.3, 0.9), g, g)) if kind < 0.85 else material("metal", rng)


def _panel(rng: np.random.Generator, wide: float, high: float, z: float, thick: float, look: Material,
           glow: Material) -> list[Mesh]:  # fmt: skip
    """Return a flat display whose back is at x = 0: casing, bezel and picture, a fatter middle behind at times."""
    bezel, chin = draw(rng, 0.004, 0.03), draw(rng, 0.0, 0.04)
    parts = [
        body(rng, (0.0, -wide / 2, z), (thick, wide / 2, z + high), look, min(0.4 * thick, draw(rng, 0.003, 0.012)))
    ]
    low, top = (-wide / 2 + bezel, z + bezel + chin), (wide / 2 - bezel, z + high - bezel)
    parts.append(face(thick + 0.0015, low, top, glow, fill=True))
    if bezel > 0.012:
        parts.append(rim((-wide / 2, z), (wide / 2, z + high), bezel, (thick - 0.002, thick + 0.006), look))
    return parts


def _width(rng: np.random.Generator, low_inch: float, high_inch: float, aspect: float = 16 / 9) -> Pair:
    """Return width and height of a display of a drawn diagonal, metres."""
    diagonal = draw(rng, low_inch, high_inch) * 0.0254
    high = diagonal / float(np.hypot(aspect, 1.0))
    return high * aspect, high


@family("tv", "thin on middle foot")
def _on_foot(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 24, 65)
    look, lift, thick = _casing(rng), draw(rng, 0.04, 0.12), draw(rng, 0.02, 0.07)
    parts = [joined(_panel(rng, wide, high, lift, thick, look, screen(rng)))]
    deep, across = draw(rng, 0.18, 0.32), draw(rng, 0.28, 0.6) * wide
    foot = _casing(rng) if chance(rng, 0.4) else look
    shape = rounded_rectangle(deep, across, pick(rng, (0.01, 0.06, 0.5 * deep))) + (thick / 2, 0.0)
    parts += [prism([(float(x), float(y)) for x, y in shape], 0.0, draw(rng, 0.008, 0.025), foot),
              slab(thick * 0.4, 0.0, 0.0, 0.04, draw(rng, 0.04, 0.3) * wide, lift + 0.1, foot)]  # fmt: skip
    if chance(rng, 0.5):
        parts.append(
            body(rng, (-draw(rng, 0.02, 0.06), -wide * 0.3, lift + 0.03), (0.005, wide * 0.3, lift + 0.6 * high), look)
        )
    return finished(parts)


@family("tv", "thin on two feet")
def _on_two_feet(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 32, 77)
    look, lift, thick = _casing(rng), draw(rng, 0.04, 0.1), draw(rng, 0.015, 0.06)
    parts = _panel(rng, wide, high, lift, thick, look, screen(rng))
    apart, reach, bar = draw(rng, 0.25, 0.46) * wide, draw(rng, 0.1, 0.16), draw(rng, 0.012, 0.025)
    splay = draw(rng, -0.05, 0.08)
    for side in (-1, 1):
        for x in (thick / 2 + reach, thick / 2 - reach):
            parts.append(
                strut((thick / 2, side * apart, lift + 0.02), (x, side * (apart + splay), bar / 2), bar, bar, look)
            )
    return finished(parts)


@family("tv", "wall flat")
def _wall_flat(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 28, 85)
    look, gap, thick = _casing(rng), draw(rng, 0.015, 0.1), draw(rng, 0.02, 0.08)
    panel = joined(_panel(rng, wide, high, 0.0, thick, look, screen(rng))).moved(x=gap)
    parts = [panel, slab(gap / 2, 0.0, high * 0.35, gap, min(0.4, 0.5 * wide), 0.3 * high, material("black", rng))]
    return finished(parts)


@family("tv", "wall swivel arm")
def _wall_arm(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 22, 55)
    look, out, tilt = _casing(rng), draw(rng, 0.12, 0.3), draw(rng, 0.0, 0.22)
    panel = joined(_panel(rng, wide, high, 0.0, draw(rng, 0.03, 0.07), look, screen(rng))).tilted("y", tilt)
    turn = draw(rng, -0.3, 0.3)
    arm, z = material("black", rng), high * 0.5
    lean = max(0.5 * wide * abs(float(np.sin(turn))), high * float(np.sin(tilt)) * 0.5)
    out = max(out, lean + 0.08)
    parts = [panel.turned(turn).moved(x=out), slab(0.015, 0.0, z - 0.1, 0.03, 0.12, 0.2, arm),
             strut((0.02, 0.0, z), (out * 0.5, 0.12, z), 0.04, 0.05, arm),
             strut((out * 0.5, 0.12, z), (out, 0.0, z), 0.04, 0.05, arm)]  # fmt: skip
    return finished(parts)


@family("tv", "tube box")
def _tube_box(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 14, 32, 4 / 3)
    edge, deep = draw(rng, 0.03, 0.07), draw(rng, 0.34, 0.55)
    wood = chance(rng, 0.3)
    look = material("wood", rng) if wood else _casing(rng)
    bottom = draw(rng, 0.02, 0.09)
    side = draw(rng, 0.08, 0.16) if chance(rng, 0.3) else 0.0
    half, top = wide / 2 + edge, high + bottom + edge
    front_x = deep
    taper = 1.0 if wood else draw(rng, 0.5, 0.75)
    mid = deep * draw(rng, 0.5, 0.7)
    rings = [np.array([(x, -h, z0), (x, h + s, z0), (x, h + s, z1), (x, -h, z1)])
             for x, h, s, z0, z1 in ((0.0, half * taper, side * taper, 0.06 * (1 - taper), top * (0.3 + 0.7 * taper)),
                                     (mid, half, side, 0.0, top), (front_x, half, side, 0.0, top))]  # fmt: skip
    parts = [loft(rings, look)]
    y, z = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(0, 1, 5), indexing="ij")
    x = front_x + 0.005 + 0.018 * (1 - y**2) * (1 - (2 * z - 1) ** 2)
    glass = np.stack([x, y * wide / 2, bottom + z * high], axis=-1)
    parts += [cloth(glass, screen(rng, 0.4), fill=True),
              rim((-half, 0.0), (half, top), edge * 0.8, (front_x - 0.001, front_x + 0.015), look if wood else _casing(rng))]  # fmt: skip
    if side:
        parts += [spindle([(0.022, front_x), (0.018, front_x + 0.02)], material("metal", rng), half + side / 2, top * h, 9)
                  for h in (0.6, 0.8)]  # fmt: skip
    if chance(rng, 0.3):
        parts += [tube([(mid, 0.0, top), (mid, s * 0.25, top + draw(rng, 0.25, 0.45))], 0.003, material("metal", rng), 4)
                  for s in (-1, 1)]  # fmt: skip
    return finished(parts, supports=[Support((mid, -half), (front_x, half), top, 0.4)])


@family("tv", "rear projection", held_out=True)
def _rear_projection(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 40, 60)
    look, deep, base = _casing(rng), draw(rng, 0.38, 0.6), draw(rng, 0.28, 0.55)
    top = base + high + 0.06
    half = wide / 2 + 0.04
    side = np.array([(0.0, 0.0), (deep, 0.0), (deep, top), (0.35 * deep, top), (0.0, 0.75 * base)])
    parts = [loft([np.column_stack([side[:, 0], np.full(5, y), side[:, 1]]) for y in (-half, half)], look),
             face(deep + 0.002, (-wide / 2, base), (wide / 2, base + high), screen(rng), fill=True),
             face(deep + 0.003, (-half + 0.05, 0.05), (half - 0.05, base - 0.06), material("fabric", rng, (0.15, 0.15, 0.16)))]  # fmt: skip
    return finished(parts)


@family("tv", "on a rolling stand", held_out=True)
def _rolling(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 32, 65)
    look, lift, thick, metal = _casing(rng), draw(rng, 0.8, 1.2), draw(rng, 0.03, 0.06), material("black", rng)
    parts = [joined(_panel(rng, wide, high, lift, thick, look, screen(rng))).moved(x=0.06)]
    apart, reach = draw(rng, 0.0, 0.25), draw(rng, 0.25, 0.35)
    for side in (-1, 1) if apart > 0.06 else (0,):
        parts.append(slab(0.03, side * apart, 0.06, 0.05, 0.07, lift + 0.6 * high, metal))
    for side in (-1, 1):
        parts.append(
            strut((-reach, side * (apart + 0.2), 0.05), (reach, side * (apart + 0.2), 0.05), 0.05, 0.04, metal)
        )
    parts += [slab(0.03, 0.0, 0.04, 0.06, 2 * apart + 0.45, 0.04, metal), slab(0.1, 0.0, 0.55, 0.3, 0.45, 0.02, metal)]
    return finished(parts, supports=[Support((-0.05, -0.22), (0.25, 0.22), 0.57, 0.25)])


@family("monitor", "round foot")
def _monitor_foot(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 17, 32, pick(rng, (16 / 9, 16 / 10, 4 / 3, 5 / 4)))
    look, lift = _casing(rng), draw(rng, 0.06, 0.18)
    panel = joined(_panel(rng, wide, high, 0.0, draw(rng, 0.018, 0.05), look, screen(rng))).tilted(
        "y", -draw(rng, 0.0, 0.2)
    )
    foot = material("metal", rng) if chance(rng, 0.35) else look
    deep, across = draw(rng, 0.16, 0.26), draw(rng, 0.18, 0.34)
    shape = rounded_rectangle(deep, across, pick(rng, (0.005, 0.04, 0.49 * min(deep, across))))
    parts = [
        panel.moved(x=0.02, z=lift),
        prism([(float(a), float(b)) for a, b in shape], 0.0, draw(rng, 0.006, 0.02), foot),
    ]
    wide_post = draw(rng, 0.03, 0.12)
    parts.append(strut((-0.02, 0.0, 0.005), (0.0, 0.0, lift + 0.45 * high), wide_post, 0.03, foot))
    return finished(parts)


@family("monitor", "v foot")
def _monitor_v(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 22, 34)
    look, lift = _casing(rng), draw(rng, 0.08, 0.18)
    parts = [joined(_panel(rng, wide, high, lift, draw(rng, 0.02, 0.05), look, screen(rng))).moved(x=0.02)]
    for side in (-1, 1):
        parts.append(
            strut((-0.06, 0.0, 0.012), (draw(rng, 0.1, 0.2), side * draw(rng, 0.14, 0.26), 0.01), 0.03, 0.02, look)
        )
    parts.append(cylinder(-0.045, 0.0, 0.0, 0.022, lift + 0.5 * high, look, 10))
    return finished(parts)


@family("monitor", "curved ultrawide")
def _monitor_curved(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 29, 49, pick(rng, (21 / 9, 21 / 9, 32 / 9)))
    look, lift, bend = _casing(rng), draw(rng, 0.08, 0.16), draw(rng, 0.25, 0.7)
    angle = np.linspace(-bend / 2, bend / 2, 11)
    radius = wide / bend
    x, y = radius * (1 - np.cos(angle)), radius * np.sin(angle)
    thick = draw(rng, 0.02, 0.05)
    rings = [np.array([(a - thick, b, lift), (a, b, lift), (a, b, lift + high), (a - thick, b, lift + high)])
             for a, b in zip(x, y, strict=True)]  # fmt: skip
    glow = np.stack([np.stack([x + 0.002, y * 0.985, np.full(11, z)], axis=-1) for z in (lift + 0.012, lift + high - 0.012)],
                    axis=1)  # fmt: skip
    parts = [
        loft(rings, look),
        cloth(glow, screen(rng), fill=True),
        cylinder(-0.06, 0.0, 0.0, 0.03, lift + 0.5 * high, look, 10),
    ]
    parts += [strut((-0.06, 0.0, 0.012), (0.16, side * 0.22, 0.01), 0.035, 0.02, look) for side in (-1, 1)]
    return finished(parts)


@family("monitor", "tube box")
def _monitor_tube(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 14, 19, 4 / 3)
    look = material("plastic", rng, pick(rng, ((0.85, 0.83, 0.75), (0.15, 0.15, 0.16), (0.7, 0.7, 0.7))))
    edge, deep, lift = draw(rng, 0.025, 0.04), draw(rng, 0.36, 0.45), draw(rng, 0.03, 0.07)
    half, top = wide / 2 + edge, lift + high + 2 * edge
    taper, mid = draw(rng, 0.45, 0.7), draw(rng, 0.55, 0.75) * deep
    rings = [np.array([(x, -h, z0), (x, h, z0), (x, h, z1), (x, -h, z1)])
             for x, h, z0, z1 in ((0.0, half * taper, lift + 0.04, lift + 0.04 + (high + edge) * taper),
                                  (mid, half, lift, top), (deep, half, lift, top))]  # fmt: skip
    parts = [loft(rings, look), rim((-half, lift), (half, top), edge, (deep - 0.001, deep + 0.012), look),
             face(deep + 0.004, (-wide / 2, lift + edge), (wide / 2, top - edge), screen(rng), fill=True),
             cylinder(deep * 0.55, 0.0, 0.0, 0.13, 0.012, look, 14), cylinder(deep * 0.55, 0.0, 0.0, 0.08, lift + 0.01, look, 12)]  # fmt: skip
    return finished(parts)


@family("monitor", "pair on an arm", held_out=True)
def _monitor_pair(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 19, 27)
    look, z, metal = _casing(rng), draw(rng, 0.08, 0.2), material(pick(rng, ("black", "metal")), rng)
    turn, upright = draw(rng, 0.05, 0.4), chance(rng, 0.3)
    parts = [cylinder(-0.06, 0.0, 0.0, 0.018, z + 0.75 * high, metal, 8), slab(-0.06, 0.0, 0.0, 0.14, 0.2, 0.02, metal)]
    for side in (-1, 1):
        panel = joined(_panel(rng, wide, high, -high / 2, draw(rng, 0.02, 0.045), look, screen(rng)))
        span = wide
        if upright and side > 0:
            panel, span = panel.tilted("x", np.pi / 2), high
        y = side * (span * 0.5 * float(np.cos(turn)) + 0.012)
        centre = max(z + 0.5 * high, 0.02 + 0.5 * (wide if upright and side > 0 else high))
        parts += [panel.turned(-side * turn).moved(x=0.5 * span * float(np.sin(turn)), y=y, z=centre),
                  strut((-0.06, 0.0, z + 0.5 * high), (0.5 * span * float(np.sin(turn)), y, z + 0.5 * high), 0.03, 0.03, metal)]  # fmt: skip
    return finished(parts)


@family("monitor", "computer in one")
def _all_in_one(rng: np.random.Generator) -> Piece:
    wide, high = _width(rng, 21, 27)
    look = material(pick(rng, ("metal", "white", "black")), rng)
    chin, lift, thick = draw(rng, 0.06, 0.11), draw(rng, 0.06, 0.12), draw(rng, 0.01, 0.03)
    total = high + chin
    parts = [body(rng, (0.0, -wide / 2, lift), (thick, wide / 2, lift + total), look, 0.004),
             face(thick + 0.001, (-wide / 2, lift + chin), (wide / 2, lift + total), material("black", rng)),
             face(thick + 0.003, (-wide / 2 + 0.02, lift + chin + 0.02), (wide / 2 - 0.02, lift + total - 0.02), screen(rng), fill=True)]  # fmt: skip
    path = [(0.12, 0.0, 0.004), (-0.06, 0.0, 0.004), (-0.08, 0.0, 0.02), (-0.005, 0.0, lift + 0.4 * total)]
    parts += [strut(a, b, draw(rng, 0.16, 0.2), 0.008, look) for a, b in zip(path[:-1], path[1:], strict=True)]
    return finished(parts)


def key_field(rng: np.random.Generator, low: Pair, high: Pair, z: float, rows: int, columns: int, look: Material,
              rise: float = 0.002, bar: bool = True) -> list[Mesh]:  # fmt: skip
    """Return a field of keys between two corners (x, y) on a plane at ``z``.

    Args:
        rng: draws the gaps.
        low: corner of least (x, y), metres.
        high: corner of greatest (x, y).
        z: of what they stand on.
        rows: along x.
        columns: along y.
        look: of the keys.
        rise: how far they stand up.
        bar: whether the nearest row holds a wide space bar.
    """
    deep, wide = (high[0] - low[0]) / rows, (high[1] - low[1]) / columns
    gap = draw(rng, 0.06, 0.13)
    quads: list[np.ndarray] = []
    for r in range(rows):
        x = high[0] - (r + 0.5) * deep
        spans = [(c, c + 1) for c in range(columns)]
        if r == 0 and bar and columns > 6:
            spans = [(0, 1), (1, 3), (3, columns - 4), (columns - 4, columns - 2), (columns - 2, columns)]
        for a, b in spans:
            y0, y1 = low[1] + a * wide + gap * wide, low[1] + b * wide - gap * wide
            x0, x1 = x - (0.5 - gap) * deep, x + (0.5 - gap) * deep
            quads.append(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))
    if rise < 0.003:  # flat keys: their tops only
        tops = np.array([[(*p, z + rise) for p in quad] for quad in quads]).reshape(-1, 3)
        at = np.arange(len(tops)).reshape(-1, 4)
        return [triangles_of(tops, np.concatenate([at[:, [0, 1, 2]], at[:, [0, 2, 3]]]), look)]
    shrunk = [quad + 0.12 * (quad.mean(axis=0) - quad) for quad in quads]
    corner = np.array([[*((*p, z) for p in q), *((*p, z + rise) for p in s)] for q, s in zip(quads, shrunk, strict=True)])
    faces = np.array([(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)])
    at = (np.arange(len(quads))[:, None, None] * 8 + faces).reshape(-1, 4)
    return [triangles_of(corner.reshape(-1, 3), np.concatenate([at[:, [0, 1, 2]], at[:, [0, 2, 3]]]), look)]


def face_up(low: Pair, high: Pair, z: float, look: Material, fill: bool = False) -> Mesh:
    """Return a flat rectangle that looks upwards, between two corners (x, y); upright for who sits at its +x side."""
    return sheet((high[0], low[1], z), (0.0, high[1] - low[1], 0.0), (low[0] - high[0], 0.0, 0.0), look, fill)


def _laptop(rng: np.random.Generator, wide: float, deep: float, thick: float, angle: float, look: Material,
            lid: Material, glow: Material) -> Piece:  # fmt: skip
    """Return an open laptop: base with keys and touch pad, lid ``angle`` radians back from the upright."""
    dark = material(pick(rng, ("black", "black", "white", "metal")), rng)
    parts = [body(rng, (0.0, -wide / 2, 0.0), (deep, wide / 2, thick), look, min(0.3 * thick, 0.006))]
    key_look = dark if chance(rng, 0.8) else look
    parts += [face_up((0.14 * deep, -0.46 * wide), (0.6 * deep, 0.46 * wide), thick + 0.0006, dark)]
    low, high = (0.15 * deep, -0.45 * wide), (0.59 * deep, 0.45 * wide)
    if chance(rng, 0.5):
        parts.append(face_up(low, high, thick + 0.001, pictured("keyboard", rng, "black"), fill=True))
    else:
        parts += key_field(rng, low, high, thick + 0.0006, 5, 13, key_look)
    pad = draw(rng, 0.15, 0.24) * wide
    parts.append(face_up((0.66 * deep, -pad), (0.96 * deep, pad), thick + 0.001, material("metal", rng)))
    bezel = draw(rng, 0.005, 0.02)
    cover = joined([body(rng, (-0.007, -wide / 2, 0.0), (0.0, wide / 2, deep * 0.97), lid, 0.003),
                    face(0.0006, (-wide / 2 + 0.003, 0.003), (wide / 2 - 0.003, deep * 0.965), material("black", rng)),
                    face(0.0014, (-wide / 2 + bezel, 0.02), (wide / 2 - bezel, deep * 0.96 - bezel), glow, fill=True)])  # fmt: skip
    parts.append(cover.tilted("y", -angle).moved(x=0.01, z=thick))
    return finished(parts)


@family("laptop", "open thin")
def _laptop_open(rng: np.random.Generator) -> Piece:
    wide = draw(rng, 0.28, 0.39)
    look = material(pick(rng, ("metal", "metal", "white", "black", "painted")), rng)
    return _laptop(
        rng,
        wide,
        wide * draw(rng, 0.64, 0.74),
        draw(rng, 0.01, 0.02),
        draw(rng, 0.05, 0.6),
        look,
        look,
        screen(rng, 0.75),
    )


@family("laptop", "open thick")
def _laptop_thick(rng: np.random.Generator) -> Piece:
    wide = draw(rng, 0.33, 0.43)
    look, lid = material("black", rng), material(pick(rng, ("black", "plastic", "metal")), rng)
    return _laptop(
        rng, wide, wide * draw(rng, 0.68, 0.8), draw(rng, 0.022, 0.04), draw(rng, 0.1, 0.5), look, lid, screen(rng, 0.7)
    )


@family("laptop", "closed")
def _laptop_closed(rng: np.random.Generator) -> Piece:
    wide = draw(rng, 0.28, 0.4)
    deep, thick, look = (
        wide * draw(rng, 0.64, 0.76),
        draw(rng, 0.014, 0.035),
        material(pick(rng, ("metal", "black", "white", "plastic")), rng),
    )
    parts = [body(rng, (0.0, -wide / 2, 0.0), (deep, wide / 2, 0.52 * thick), look, 0.003),
             body(rng, (0.003, -wide / 2, 0.56 * thick), (deep, wide / 2, thick), look, 0.004),
             slab(deep / 2, 0.0, 0.4 * thick, deep * 0.97, wide * 0.97, 0.25 * thick, material("black", rng)),
             face_up((deep * 0.45, -0.02), (deep * 0.55, 0.02), thick + 0.0008, material("metal", rng))]  # fmt: skip
    return finished(parts)


@family("laptop", "folded like a tent", held_out=True)
def _laptop_tent(rng: np.random.Generator) -> Piece:
    wide = draw(rng, 0.26, 0.36)
    deep, lean, look = wide * draw(rng, 0.62, 0.72), draw(rng, 0.35, 0.6), material(pick(rng, ("metal", "black")), rng)
    leaf = body(rng, (-0.008, -wide / 2, -deep), (0.0, wide / 2, 0.0), look, 0.003)
    shown = joined([leaf, face(0.0005, (-wide / 2 + 0.004, -deep + 0.004), (wide / 2 - 0.004, -0.004), material("black", rng)),
                    face(0.0015, (-wide / 2 + 0.012, -deep + 0.012), (wide / 2 - 0.012, -0.02), screen(rng, 0.9), fill=True)])  # fmt: skip
    return finished([shown.tilted("y", -lean), leaf.tilted("y", lean)])


def _case_front(rng: np.random.Generator, deep: float, wide: float, high: float, look: Material) -> list[Mesh]:
    """Return what the front of a computer shows: drive bays, button, lamp, grille."""
    parts: list[Mesh] = []
    dark = material("black", rng)
    for i in range(count(rng, 0, 3)):
        z = high * (0.9 - 0.11 * i)
        parts.append(
            box(
                (deep - 0.001, -wide * 0.42, z - 0.035),
                (deep + 0.004, wide * 0.42, z),
                look if chance(rng, 0.5) else dark,
            )
        )
    parts += [spindle([(0.011, deep), (0.009, deep + 0.006)], material("metal", rng), 0.0, high * 0.55, 9)]
    n = count(rng, 0, 8)
    parts += [face(deep + 0.0012, (-wide * 0.35, 0.06 * high + 0.035 * i * high), (wide * 0.35, (0.078 + 0.035 * i) * high), dark)
              for i in range(n)]  # fmt: skip
    return parts


@family("computer", "tower")
def _tower(rng: np.random.Generator) -> Piece:
    wide, deep, high = draw(rng, 0.16, 0.24), draw(rng, 0.36, 0.52), draw(rng, 0.34, 0.56)
    look = material("plastic", rng, pick(rng, ((0.1, 0.1, 0.1), (0.82, 0.8, 0.72), (0.7, 0.7, 0.72), (0.9, 0.9, 0.9))))
    front_look = look if chance(rng, 0.6) else _casing(rng)
    parts = [box((0.0, -wide / 2, 0.015), (deep - 0.03, wide / 2, high), look),
             body(rng, (deep - 0.035, -wide / 2 - 0.003, 0.015), (deep, wide / 2 + 0.003, high + 0.004), front_look),
             *_case_front(rng, deep, wide, high, front_look), *feet((0.0, -wide / 2), (deep, wide / 2), 0.015, look),
             face(-0.001, (-wide * 0.35, 0.3 * high), (wide * 0.1, 0.5 * high), material("metal", rng))]  # fmt: skip
    return finished(parts, supports=[Support((0.0, -wide / 2), (deep, wide / 2), high + 0.004, 0.4)])


@family("computer", "flat desktop")
def _flat_desktop(rng: np.random.Generator) -> Piece:
    wide, deep, high = draw(rng, 0.28, 0.44), draw(rng, 0.28, 0.42), draw(rng, 0.07, 0.16)
    look = _casing(rng)
    parts = [body(rng, (0.0, -wide / 2, 0.008), (deep, wide / 2, high), look),
             box((deep - 0.001, 0.05 * wide, 0.6 * high), (deep + 0.003, 0.45 * wide, 0.85 * high), material("black", rng)),
             box((deep - 0.001, -0.45 * wide, 0.2 * high), (deep + 0.002, -0.1 * wide, 0.8 * high), material("metal", rng)),
             *feet((0.0, -wide / 2), (deep, wide / 2), 0.008, look)]  # fmt: skip
    return finished(parts, supports=[Support((0.0, -wide / 2), (deep, wide / 2), high, 0.5)])


@family("computer", "glass side")
def _glass_side(rng: np.random.Generator) -> Piece:
    wide, deep, high = draw(rng, 0.2, 0.26), draw(rng, 0.4, 0.52), draw(rng, 0.42, 0.55)
    look, side = material(pick(rng, ("black", "black", "white")), rng), pick(rng, (-1.0, 1.0))
    glow = replace(material("plastic", rng, tuple(rng.uniform(0.2, 1.0, 3))), emission=draw(rng, 0.3, 0.9))
    inner = side * (wide / 2 - 0.02)
    parts = [box((0.0, -wide / 2, 0.02), (deep, -inner * 0.0 + wide / 2, 0.04), look),
             box((0.0, -wide / 2, high - 0.02), (deep, wide / 2, high), look), box((0.0, -wide / 2, 0.02), (0.01, wide / 2, high), look),
             box((0.0, min(-inner, -inner - side * 0.02), 0.02), (deep, max(-inner, -inner - side * 0.02), high), look),
             face(deep * 1.0, (-wide / 2, 0.02), (wide / 2, high), look)]  # fmt: skip
    y0, y1 = sorted((inner + side * 0.012, inner + side * 0.018))
    parts += [box((0.0, y0, 0.03), (deep, y1, high - 0.01), material("glass", rng)),
              slab(deep * 0.5, 0.0, high * 0.4, 0.28, wide * 0.3, 0.045, glow), slab(deep * 0.35, 0.0, high * 0.65, 0.1, wide * 0.4, 0.1, material("metal", rng))]  # fmt: skip
    for z in np.linspace(0.14, high - 0.12, 3):
        parts.append(
            spindle([(0.055, deep + 0.001), (0.045, deep + 0.006), (0.01, deep + 0.004)], glow, 0.0, float(z), 14)
        )
    parts += feet((0.0, -wide / 2), (deep, wide / 2), 0.02, look)
    return finished(parts)


@family("computer", "mini", held_out=True)
def _mini(rng: np.random.Generator) -> Piece:
    wide, high = draw(rng, 0.12, 0.22), draw(rng, 0.035, 0.22)
    look = _casing(rng)
    parts = [body(rng, (0.0, -wide / 2, 0.004), (wide, wide / 2, high), look, draw(rng, 0.006, 0.03)),
             slab(wide / 2, 0.0, 0.0, wide * 0.7, wide * 0.7, 0.006, material("black", rng)),
             face(wide + 0.001, (-0.3 * wide, 0.3 * high), (-0.1 * wide, 0.5 * high), material("black", rng))]  # fmt: skip
    return finished(parts)


@family("computer", "server in a rack", held_out=True)
def _server(rng: np.random.Generator) -> Piece:
    wide, deep, high = draw(rng, 0.5, 0.65), draw(rng, 0.5, 0.9), draw(rng, 0.6, 1.6)
    look, parts = material("black", rng), []
    parts = [*(box((0.0, y, 0.05), (deep, y + 0.03, high), look) for y in (-wide / 2, wide / 2 - 0.03)),
             box((0.0, -wide / 2, high - 0.03), (deep, wide / 2, high), look), box((0.0, -wide / 2, 0.05), (deep, wide / 2, 0.08), look),
             *feet((0.0, -wide / 2), (deep, wide / 2), 0.05, look)]  # fmt: skip
    z = 0.1
    while z < high - 0.1:
        tall = pick(rng, (0.044, 0.088, 0.133))
        if chance(rng, 0.75) and z + tall < high - 0.04:
            parts += [box((0.05, -wide / 2 + 0.03, z), (deep - 0.03, wide / 2 - 0.03, z + tall - 0.004), _casing(rng)),
                      face(deep - 0.028, (-0.35 * wide, z + 0.3 * tall), (0.2 * wide, z + 0.6 * tall), look)]  # fmt: skip
        z += tall
    return finished(parts, supports=[Support((0.0, -wide / 2), (deep, wide / 2), high, 0.5)])

