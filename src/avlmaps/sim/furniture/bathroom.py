"""Toilets, bathtubs and showers."""

import numpy as np

from avlmaps.sim.furniture.catalogue import Piece, family
from avlmaps.sim.furniture.fittings import (
    Level,
    chrome,
    outline,
    shell,
    tap,
)  # fmt: skip
from avlmaps.sim.furniture.joinery import chance, cloth, draw, finished, pick, pictured
from avlmaps.sim.materials import material
from avlmaps.sim.mesh import Material, Mesh, Triple, joined
from avlmaps.sim.shapes import box, cylinder, ellipsoid, loft, polygon, rounded_box, slab, tube


def china(rng: np.random.Generator) -> Material:
    """Draw sanitary ware: white mostly, an old pastel or black at times."""
    if chance(rng, 0.82):
        return material(pick(rng, ("white", "white", "white", "ceramic")), rng, (w := draw(rng, 0.86, 0.97), w, w * draw(rng, 0.95, 1.0)))
    old = ((0.72, 0.82, 0.75), (0.85, 0.72, 0.7), (0.9, 0.85, 0.7), (0.6, 0.72, 0.82), (0.12, 0.12, 0.13))
    return material("white", rng, pick(rng, old))


def _seat(rng: np.random.Generator, length: float, wide: float, power: float, z: float, x: float,
          look: Material) -> list[Mesh]:  # fmt: skip
    """Return seat and lid over a bowl whose rim begins at ``x``: lid shut, lid up, or both up."""
    state = pick(rng, ("shut", "shut", "lid up", "both up"))
    thick, egg = draw(rng, 0.014, 0.024), 0.12
    middle = (length / 2, 0.0)

    def plate(a: float, b: float, bulge: float = 0.0) -> Mesh:
        levels = [
            (outline(length, wide, power, 20, egg, middle), a),
            (outline(length, wide, power, 20, egg, middle), b),
        ]
        if bulge:
            levels.append((outline(length * 0.8, wide * 0.78, power, 20, egg, middle), b + bulge))
        return shell(levels, look)

    inner = (length * 0.66, wide * 0.6)
    hole = (length * 0.52, 0.0)
    rings = [(outline(length, wide, power, 20, egg, middle), 0.0), (outline(length, wide, power, 20, egg, middle), thick),
             (outline(*inner, 2.0, 20, 0.2, hole), thick), (outline(*inner, 2.0, 20, 0.2, hole), 0.0)]  # fmt: skip
    ring = shell(rings, look, capped=False)
    lid = plate(0.0, thick * 0.8, draw(rng, 0.0, 0.012))
    up = -draw(rng, 1.62, 1.75)
    if state == "shut":
        parts = [ring.moved(z=z), lid.moved(z=z + thick + 0.003)]
    elif state == "lid up":
        parts = [ring.moved(z=z), lid.tilted("y", up).moved(x=0.02, z=z + thick)]
    else:
        parts = [ring.tilted("y", up).moved(x=0.045, z=z), lid.tilted("y", up).moved(x=0.02, z=z + 0.01)]
    return [part.moved(x=x) for part in parts]


def _bowl(rng: np.random.Generator, length: float, wide: float, power: float, z: tuple[float, float], x: float,
          foot: tuple[float, float, float], look: Material) -> Mesh:  # fmt: skip
    """Return a toilet's bowl with its hollow, from height to height.

    Args:
        rng: draws the bulge.
        length: of the rim, metres.
        wide: of the rim, metres.
        power: squareness of the rim.
        z: of the foot and of the rim.
        x: where the rim begins.
        foot: length, width of the foot and x of its middle.
        look: of the china.
    """
    egg, middle, (low, high) = 0.12, (x + length / 2, 0.0), z
    waist = low + (high - low) * draw(rng, 0.3, 0.5)
    swell = draw(rng, 0.8, 1.0)
    levels = [(outline(foot[0], foot[1], 2.6, 20, 0.05, (foot[2], 0.0)), low),
              (outline(foot[0] * 0.96, foot[1] * 0.9, 2.6, 20, 0.05, (foot[2], 0.0)), waist),
              (outline(length * 0.95, wide * swell, power, 20, egg, middle), high - 0.09),
              (outline(length, wide, power, 20, egg, middle), high - 0.03), (outline(length, wide, power, 20, egg, middle), high),
              (outline(length * 0.72, wide * 0.66, 2.0, 20, 0.15, (middle[0] + 0.03, 0.0)), high),
              (outline(length * 0.5, wide * 0.45, 2.0, 20, 0.1, (middle[0] + 0.03, 0.0)), high - 0.12),
              (outline(length * 0.25, wide * 0.25, 2.0, 20, 0.0, (middle[0], 0.0)), high - 0.19)]  # fmt: skip
    return shell(levels, look)


def _button(x: float, y: float, z: float, look: Material) -> Mesh:
    return cylinder(x, y, z, 0.022, 0.006, look, 10)


def _flush(rng: np.random.Generator, deep: float, wide: float, top: float, metal: Material) -> list[Mesh]:
    """Return what the tank is flushed with: a button on its lid, two buttons, or a lever at its front."""
    if chance(rng, 0.3):
        return [tube([(deep, -wide * 0.35, top - 0.07), (deep + 0.02, -wide * 0.35, top - 0.07),
                      (deep + 0.022, -wide * 0.15, top - 0.075)], 0.006, metal, 5)]  # fmt: skip
    return [_button(deep / 2, y, top, metal) for y in pick(rng, ((0.0,), (-0.024, 0.024)))]


def _tank(rng: np.random.Generator, deep: float, wide: float, z: tuple[float, float], look: Material,
          metal: Material) -> list[Mesh]:  # fmt: skip
    soft = draw(rng, 0.01, 0.05)
    lid = draw(rng, 0.025, 0.04)
    return [rounded_box((0.0, -wide / 2, z[0]), (deep, wide / 2, z[1] - lid), soft, look),
            rounded_box((-0.004, -wide / 2 - 0.008, z[1] - lid), (deep + 0.012, wide / 2 + 0.008, z[1]), 0.012, look),
            *_flush(rng, deep, wide, z[1], metal)]  # fmt: skip


def _sizes(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Return length, width and height of a toilet's rim, metres, and how square it is."""
    return draw(rng, 0.42, 0.52), draw(rng, 0.34, 0.4), draw(rng, 0.38, 0.46), pick(rng, (2.0, 2.2, 2.6, 4.0))


@family("toilet", "close-coupled")
def _close_coupled(rng: np.random.Generator) -> Piece:
    (length, wide, rim_z, power), look, metal = _sizes(rng), china(rng), chrome(rng)
    deep, across, top = draw(rng, 0.15, 0.21), draw(rng, 0.34, 0.48), rim_z + draw(rng, 0.32, 0.42)
    foot = (draw(rng, 0.32, 0.48), draw(rng, 0.2, 0.27), deep + draw(rng, 0.16, 0.24))
    seat = look if chance(rng, 0.7) else material(pick(rng, ("wood", "plastic", "black")), rng)
    parts = [_bowl(rng, length, wide, power, (0.0, rim_z), deep + 0.01, foot, look),
             slab(deep * 0.75, 0.0, rim_z - 0.09, deep * 1.4, min(across, 0.24), 0.085, look),
             *_tank(rng, deep, across, (rim_z - 0.01, top), look, metal),
             *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, deep + 0.015, seat)]  # fmt: skip
    return finished(parts)


@family("toilet", "hung on a casing")
def _on_casing(rng: np.random.Generator) -> Piece:
    (length, wide, rim_z, power), look = _sizes(rng), china(rng)
    case_deep, case_wide, top = draw(rng, 0.1, 0.2), draw(rng, 0.5, 1.1), draw(rng, 0.95, 1.25)
    clad = pictured(pick(rng, ("tile", "plaster", "marble", "wood")), rng, "ceramic")
    foot = (length * 0.8, wide * 0.75, case_deep + length * 0.42)
    x = case_deep + 0.03
    parts = [box((0.0, -case_wide / 2, 0.0), (case_deep, case_wide / 2, top), clad),
             _bowl(rng, length, wide, power, (rim_z - draw(rng, 0.26, 0.34), rim_z), x, foot, look),
             slab(case_deep + 0.06, 0.0, rim_z - 0.28, 0.12, wide * 0.8, 0.26, look),
             box((case_deep, -0.12, 0.86), (case_deep + 0.012, 0.12, 0.94), material(pick(rng, ("white", "metal", "black")), rng)),
             *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, x + 0.005, look)]  # fmt: skip
    return finished(parts)


@family("toilet", "back to wall")
def _back_to_wall(rng: np.random.Generator) -> Piece:
    (length, wide, rim_z, power), look, metal = _sizes(rng), china(rng), chrome(rng)
    deep, across, top = draw(rng, 0.14, 0.2), draw(rng, 0.36, 0.42), rim_z + draw(rng, 0.3, 0.4)
    skirt = (length + deep * 0.6, wide * 0.86, deep + length * 0.42)
    bowl = [(outline(skirt[0] * 0.93, skirt[1], 3.5, 20, 0.04, (skirt[2] * 0.92, 0.0)), 0.0),
            (outline(skirt[0] * 0.97, skirt[1] * 1.02, 3.5, 20, 0.06, (skirt[2] * 0.95, 0.0)), rim_z * 0.6)]  # fmt: skip
    middle = (deep + length / 2, 0.0)
    bowl += [(outline(length * 1.02, wide, power, 20, 0.12, middle), rim_z - 0.05), (outline(length, wide, power, 20, 0.12, middle), rim_z),
             (outline(length * 0.72, wide * 0.66, 2.0, 20, 0.1, middle), rim_z),
             (outline(length * 0.4, wide * 0.35, 2.0, 20, 0.1, middle), rim_z - 0.17)]  # fmt: skip
    parts = [shell(bowl, look), slab(deep / 2, 0.0, 0.0, deep, wide * 0.8, rim_z, look),
             *_tank(rng, deep, across, (rim_z - 0.02, top), look, metal),
             *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, deep + 0.01, look)]  # fmt: skip
    return finished(parts)


@family("toilet", "one piece")
def _one_piece(rng: np.random.Generator) -> Piece:
    (length, wide, rim_z, power), look, metal = _sizes(rng), china(rng), chrome(rng)
    deep, top = draw(rng, 0.18, 0.24), rim_z + draw(rng, 0.16, 0.3)
    across = wide * draw(rng, 0.98, 1.1)
    foot = (length * 0.95, wide * 0.72, deep + length * 0.35)
    tank = [(outline(deep * s, across * w, 5.0, 20, 0.0, (deep * s / 2, 0.0)), z)
            for s, w, z in ((1.5, 0.8, rim_z - 0.12), (1.25, 0.95, rim_z), (1.0, 1.0, rim_z + 0.08), (0.95, 1.0, top - 0.02), (0.85, 0.92, top))]  # fmt: skip
    parts = [_bowl(rng, length, wide, power, (0.0, rim_z), deep, foot, look), shell(tank, look), _button(deep * 0.42, 0.0, top, metal),
             box((0.0, -wide * 0.3, 0.0), (deep + 0.1, wide * 0.3, rim_z - 0.1), look),
             *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, deep + 0.01, look)]  # fmt: skip
    return finished(parts)


@family("toilet", "washing seat", held_out=True)
def _washing_seat(rng: np.random.Generator) -> Piece:
    (length, wide, rim_z, _), look = _sizes(rng), china(rng)
    total, power = length + draw(rng, 0.12, 0.2), draw(rng, 3.0, 5.0)
    levels = [(outline(total * a, wide * b, power, 22, 0.07, (total / 2 - total * (1 - a) / 2, 0.0)), z)
              for a, b, z in ((0.86, 0.8, 0.0), (0.9, 0.82, 0.3 * rim_z), (1.0, 0.98, 0.8 * rim_z), (1.0, 1.0, rim_z))]  # fmt: skip
    back = draw(rng, 0.12, 0.2)
    parts = [shell(levels, look), rounded_box((0.0, -wide / 2, rim_z - 0.01), (back, wide / 2, rim_z + draw(rng, 0.08, 0.14)), 0.03, look),
             *_seat(rng, total - back - 0.01, wide, power, rim_z + 0.003, back, look)]  # fmt: skip
    if chance(rng, 0.5):
        parts.append(slab(back + 0.16, wide / 2 + 0.03, rim_z - 0.01, 0.22, 0.06, 0.05, look))
    return finished(parts)


@family("toilet", "high tank", held_out=True)
def _high_tank(rng: np.random.Generator) -> Piece:
    (length, wide, rim_z, _), look, metal = _sizes(rng), china(rng), chrome(rng)
    wood = material("wood", rng)
    low = draw(rng, 0.85, 1.75)
    deep, across, tall = draw(rng, 0.17, 0.22), draw(rng, 0.4, 0.52), draw(rng, 0.28, 0.36)
    tank = wood if chance(rng, 0.3) else look
    x = draw(rng, 0.16, 0.2)
    foot = (draw(rng, 0.36, 0.48), draw(rng, 0.22, 0.28), x + 0.2)
    parts = [_bowl(rng, length, wide, 2.0, (0.0, rim_z), x, foot, look), *_seat(rng, length, wide * 1.01, 2.0, rim_z + 0.003, x + 0.005, wood),
             rounded_box((0.0, -across / 2, low), (deep, across / 2, low + tall), 0.02, tank),
             slab(deep / 2, 0.0, low + tall, deep + 0.02, across + 0.02, 0.02, tank),
             tube([(0.06, 0.0, low), (0.06, 0.0, rim_z + 0.02), (0.1, 0.0, rim_z - 0.06), (x + 0.08, 0.0, rim_z - 0.07)], 0.022, metal, 8),
             tube([(deep / 2, across * 0.4, low), (deep / 2, across * 0.42, low - min(0.6, low * 0.4))], 0.003, metal, 4),
             ellipsoid((deep / 2, across * 0.42, low - min(0.6, low * 0.4)), (0.015, 0.015, 0.03), wood, 7, 4)]  # fmt: skip
    return finished(parts)


def open_bowl(levels: list[Level], look: Material) -> list[Mesh]:
    """Return a hollow that is open above: the skin through its levels, from the rim inwards, and its floor."""
    flat, z = levels[-1]
    return [shell(levels, look, capped=False), polygon(np.column_stack([flat, np.full(len(flat), z)]), look)]


def _tub(low: Triple, high: Triple, power: float, wall: float, look: Material, skirt: Material, deep: float,
         tilt: float = 0.12) -> list[Mesh]:  # fmt: skip
    """Return a tub with a hollow between two corners; ``power`` squares the hollow, ``tilt`` slants its low-y end."""
    (a, b, c), (d, e, f) = low, high
    wide, long, middle = d - a, e - b, ((a + d) / 2, (b + e) / 2)
    outer = outline(wide, long, 30.0, 28, middle=middle)
    inner = (wide - 2 * wall, long - 2 * wall)
    shift = tilt * long / 4
    foot = outline(inner[0] * 0.8, inner[1] * (0.86 - tilt), power, 28, middle=(middle[0], middle[1] + shift))
    half = outline(inner[0] * 0.93, inner[1] * (0.96 - tilt / 2), power, 28, middle=(middle[0], middle[1] + shift / 2))
    rim_part = open_bowl([(outer, f - 0.03), (outer, f), (outline(*inner, power, 28, middle=middle), f),
                          (half, f - deep * 0.5), (foot, f - deep)], look)  # fmt: skip
    sides = [box((a, b, c), (a + 0.02, e, f - 0.03), skirt), box((d - 0.02, b, c), (d, e, f - 0.03), skirt),
             box((a, b, c), (d, b + 0.02, f - 0.03), skirt), box((a, e - 0.02, c), (d, e, f - 0.03), skirt)]  # fmt: skip
    return [*rim_part, *sides]


def _tub_tap(rng: np.random.Generator, x: float, y: float, z: float, metal: Material) -> list[Mesh]:
    """Return a tap at the middle of the back or at the end of a tub's rim, pouring inwards."""
    parts = tap(rng, (0.0, 0.0, 0.0), draw(rng, 0.12, 0.18), draw(rng, 0.1, 0.2), metal)
    return [joined(parts).turned(-np.pi / 2).moved(x, y, z)]


def _tub_size(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return width, length and height of a tub, metres."""
    return draw(rng, 0.66, 0.85), draw(rng, 1.4, 1.85), draw(rng, 0.48, 0.62)


@family("bathtub", "built in")
def _built_in(rng: np.random.Generator) -> Piece:
    (wide, long, high), look = _tub_size(rng), china(rng)
    skirt = look if chance(rng, 0.5) else pictured(pick(rng, ("tile", "tile", "wood", "marble")), rng, "ceramic")
    wall, metal = draw(rng, 0.04, 0.11), chrome(rng)
    parts = _tub(
        (0.0, -long / 2, 0.0),
        (wide, long / 2, high),
        pick(rng, (3.0, 5.0, 8.0)),
        wall,
        look,
        skirt,
        draw(rng, 0.36, 0.44),
    )
    parts += _tub_tap(rng, wide / 2, long / 2 - 0.04, high, metal) if chance(rng, 0.6) else []
    return finished(parts)


@family("bathtub", "with glass screen")
def _screened(rng: np.random.Generator) -> Piece:
    (wide, long, high), look, metal = _tub_size(rng), china(rng), chrome(rng)
    parts = _tub((0.0, -long / 2, 0.0), (wide, long / 2, high), 5.0, 0.06, look, look, 0.4)
    pane, tall = draw(rng, 0.35, 0.55) * long, draw(rng, 1.3, 1.5)
    parts += [box((wide - 0.04, long / 2 - pane, high), (wide - 0.032, long / 2, high + tall), material("glass", rng)),
              box((wide - 0.045, long / 2 - 0.02, high), (wide - 0.025, long / 2, high + tall), metal),
              tube([(wide / 2, long / 2 - 0.01, high + 0.2), (wide / 2, long / 2 - 0.01, high + tall - 0.05),
                    (wide / 2, long / 2 - 0.28, high + tall)], 0.011, metal, 6),
              cylinder(wide / 2, long / 2 - 0.3, high + tall - 0.03, draw(rng, 0.05, 0.12), 0.02, metal, 12),
              box((wide / 2 - 0.12, long / 2 - 0.06, high + 0.2), (wide / 2 + 0.12, long / 2 - 0.01, high + 0.25), metal)]  # fmt: skip
    return finished(parts)


@family("bathtub", "with shower curtain")
def _curtained_tub(rng: np.random.Generator) -> Piece:
    (wide, long, high), look, metal = _tub_size(rng), china(rng), chrome(rng)
    parts = _tub((0.0, -long / 2, 0.0), (wide, long / 2, high), 4.0, 0.06, look, look, 0.4)
    rail, share = draw(rng, 1.9, 2.05), draw(rng, 0.25, 1.0)
    parts.append(tube([(wide - 0.03, -long / 2, rail), (wide - 0.03, long / 2, rail)], 0.012, metal, 6))
    n = 34
    y = np.linspace(long / 2 - share * long, long / 2 - 0.02, n)
    x = wide + 0.01 + draw(rng, 0.015, 0.035) * np.sin(np.arange(n) * 1.5)
    points = np.stack([np.column_stack([x, y, np.full(n, z)]) for z in (draw(rng, 0.15, 0.35), rail - 0.02)], axis=1)
    parts += [cloth(points, pictured("curtain", rng, "fabric")), *_tub_tap(rng, wide / 2, long / 2 - 0.04, high, metal)]
    return finished(parts)


def _free_tub(rng: np.random.Generator, wide: float, long: float, z: tuple[float, float], foot: float, power: float, look: Material,
              inside: Material) -> list[Mesh]:  # fmt: skip
    """Return a tub that stands by itself: a shell that narrows to its foot, its ends higher than its middle at times."""
    low, high = z
    lift = draw(rng, 0.0, 0.13) if chance(rng, 0.5) else 0.0

    def ring(scale: float, z_at: float, swing: float) -> np.ndarray:
        flat = outline(wide * scale, long * (0.3 + 0.7 * scale) if scale < 1 else long * scale, power, 28)
        return np.column_stack([flat, z_at + swing * (2 * flat[:, 1] / long) ** 2])


    mid = low + 0.5 * (high - low)
    outer = [
        ring(foot, low, 0.0),
        ring(0.5 + foot / 2, mid, 0.3 * lift),
        ring(1.0, high - 0.02, lift),
        ring(1.02, high, lift),
    ]
    floor = low + 0.1
    narrow = foot + (1 - foot) * 0.5 * (floor - low) / (mid - low) - 0.07
    hollow = [ring(0.92, high, lift), ring(0.44 + foot / 2, mid, 0.3 * lift), ring(narrow, floor, 0.0)]
    return [loft(outer, look, capped=False), loft([outer[0], outer[0] * (1e-3, 1e-3, 1.0)], look, capped=False),
            loft([outer[-1], *hollow, hollow[-1] * (1e-3, 1e-3, 1.0)], inside, capped=False)]  # fmt: skip


@family("bathtub", "freestanding oval")
def _freestanding(rng: np.random.Generator) -> Piece:
    wide, long, high, look = draw(rng, 0.68, 0.88), draw(rng, 1.45, 1.85), draw(rng, 0.52, 0.66), china(rng)
    outside = look if chance(rng, 0.65) else material(pick(rng, ("painted", "stone", "metal")), rng)
    parts = _free_tub(
        rng, wide, long, (0.0, high), draw(rng, 0.6, 0.92), pick(rng, (2.0, 2.3, 3.0, 5.0)), outside, look
    )
    if chance(rng, 0.5):  # a tap that stands on the floor
        metal = chrome(rng)
        parts += [tube([(-wide / 2 - 0.07, 0.0, 0.0), (-wide / 2 - 0.07, 0.0, high + 0.28), (-wide / 2 + 0.02, 0.0, high + 0.33),
                        (-wide / 2 + 0.13, 0.0, high + 0.27)], 0.014, metal, 6), cylinder(-wide / 2 - 0.07, 0.0, 0.0, 0.04, 0.012, metal, 10)]  # fmt: skip
    return finished(parts)


@family("bathtub", "clawfoot", held_out=True)
def _clawfoot(rng: np.random.Generator) -> Piece:
    wide, long, high, look = draw(rng, 0.68, 0.8), draw(rng, 1.4, 1.75), draw(rng, 0.56, 0.66), china(rng)
    metal, lift = chrome(rng), draw(rng, 0.1, 0.16)
    outside = look if chance(rng, 0.5) else material("painted", rng)
    parts = _free_tub(rng, wide, long, (lift, high), draw(rng, 0.5, 0.7), 2.4, outside, look)
    for x in (-0.25, 0.25):
        for y in (-0.3, 0.3):
            parts.append(tube([(x * wide * 0.8, y * long * 0.9, lift + 0.12), (x * wide * 1.25, y * long, lift * 0.7), (x * wide * 1.1, y * long, 0.02),
                               (x * wide * 1.3, y * long * 1.02, 0.012)], 0.022, metal, 6))  # fmt: skip
    parts += _tub_tap(rng, 0.0, long / 2 - 0.03, high, metal)
    return finished(parts)


@family("bathtub", "corner")
def _corner_tub(rng: np.random.Generator) -> Piece:
    side, high, look = draw(rng, 1.2, 1.55), draw(rng, 0.5, 0.62), china(rng)
    short, bow = draw(rng, 0.3, 0.55) * side, draw(rng, 0.0, 0.3) * side
    along = np.linspace(0.0, 1.0, 20)[:, None]
    front = (1 - along) * (side, short) + along * (short, side) + bow * np.sin(np.pi * along) * 0.35
    outer = np.concatenate([front, [(0.0, side), (0.0, side / 2), (0.0, 0.0), (side / 2, 0.0), (side, 0.0)]])
    middle = outer.mean(axis=0)
    toward = outer - middle
    reach = np.linalg.norm(toward, axis=1, keepdims=True)
    hollow = middle + toward / reach * np.minimum(0.82 * reach, draw(rng, 0.36, 0.44) * side)
    skirt = look if chance(rng, 0.6) else pictured("tile", rng, "ceramic")
    parts = [shell([(outer, 0.0), (outer, high - 0.03)], skirt, capped=False),
             *open_bowl([(outer, high - 0.03), (outer, high), (hollow, high), (middle + (hollow - middle) * 0.92, high - 0.2),
                         (middle + (hollow - middle) * 0.74, high - 0.38)], look)]  # fmt: skip
    return finished([joined(parts).moved(y=-side / 2)])


@family("bathtub", "deep tub", held_out=True)
def _deep_tub(rng: np.random.Generator) -> Piece:
    wide, long, high = draw(rng, 0.7, 1.1), draw(rng, 0.85, 1.25), draw(rng, 0.6, 0.85)
    wood = material("wood", rng) if chance(rng, 0.6) else pictured("tile", rng, "ceramic")
    if chance(rng, 0.5):
        flat = outline(long, long, 2.0, 24)
        parts = [shell([(flat, 0.0), (flat, high), (flat * 0.9, high), (flat * 0.85, high - 0.5)], wood)]
        parts += [
            shell([(flat * 1.012, z), (flat * 1.012, z + 0.03)], material("metal", rng), capped=False)
            for z in (0.12, high - 0.15)
        ]
    else:
        parts = _tub((0.0, -long / 2, 0.0), (wide, long / 2, high), 8.0, 0.05, wood, wood, 0.5, 0.0)
    return finished(parts)


def _rail(rng: np.random.Generator, x: float, y: float, tall: float, metal: Material) -> list[Mesh]:
    """Return a shower's rail on the wall behind (x is the wall): hand shower or rain head, mixer, hose."""
    top = tall - draw(rng, 0.0, 0.15)
    parts = [box((x, y - 0.13, 1.05), (x + 0.06, y + 0.13, 1.1), metal)]
    if chance(rng, 0.5):
        out, size = draw(rng, 0.28, 0.42), draw(rng, 0.08, 0.15)
        parts += [tube([(x + 0.04, y, 1.1), (x + 0.04, y, top), (x + out, y, top + 0.01)], 0.011, metal, 6)]
        head = (
            cylinder(x + out, y, top - 0.03, size, 0.02, metal, 14)
            if chance(rng, 0.6)
            else slab(x + out, y, top - 0.03, 2 * size, 2 * size, 0.015, metal)
        )
        parts.append(head)
    else:
        parts += [tube([(x + 0.04, y, 1.15), (x + 0.04, y, top)], 0.01, metal, 6),
                  tube([(x + 0.04, y, top - 0.1), (x + 0.16, y, top - 0.02)], 0.013, metal, 6),
                  ellipsoid((x + 0.18, y, top - 0.03), (0.05, 0.05, 0.02), metal, 10, 4)]  # fmt: skip
    parts.append(
        tube(
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
    )
    return parts


def _tray(rng: np.random.Generator, wide: float, deep: float, look: Material) -> list[Mesh]:
    high = draw(rng, 0.03, 0.16)
    outer, inner = (
        outline(deep, wide, 30.0, 24, middle=(deep / 2, 0.0)),
        outline(deep - 0.1, wide - 0.1, 6.0, 24, middle=(deep / 2, 0.0)),
    )
    floor = outline(deep - 0.2, wide - 0.2, 6.0, 24, middle=(deep / 2, 0.0))
    return [shell([(outer, 0.0), (outer, high), (inner, high), (floor, max(0.012, high - 0.08))], look),
            cylinder(deep / 2, 0.0, max(0.012, high - 0.08), 0.05, 0.004, material("metal", rng), 12)]  # fmt: skip


def _pane(
    a: tuple[float, float], b: tuple[float, float], z: tuple[float, float], glass: Material, metal: Material | None
) -> list[Mesh]:
    """Return an upright pane between two places (x, y), with a frame if it has a metal."""
    (x0, y0), (x1, y1) = a, b
    parts = [cloth(np.array([[(x0, y0, z[0]), (x0, y0, z[1])], [(x1, y1, z[0]), (x1, y1, z[1])]]), glass)]
    if metal is not None:
        bars = [
            ((x0, y0, z[0]), (x0, y0, z[1])),
            ((x1, y1, z[0]), (x1, y1, z[1])),
            ((x0, y0, z[1]), (x1, y1, z[1])),
            ((x0, y0, z[0]), (x1, y1, z[0])),
        ]
        parts += [tube(bar, 0.014, metal, 4) for bar in bars]
    return parts


def _shower_size(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.75, 1.2), draw(rng, 0.75, 1.0), draw(rng, 1.85, 2.1)


@family("shower", "corner cabin")
def _corner_cabin(rng: np.random.Generator) -> Piece:
    wide, deep, tall = _shower_size(rng)
    metal, glass, z = chrome(rng), material("glass", rng), 0.05
    side = pick(rng, (-1.0, 1.0)) * wide / 2
    cut = draw(rng, -0.1, 0.2) * wide * np.sign(side)
    frame = metal if chance(rng, 0.7) else None
    parts = [*_tray(rng, wide, deep, china(rng)), *_pane((0.01, side), (deep, side), (z, tall), glass, frame),
             *_pane((deep, side), (deep, float(cut)), (z, tall), glass, frame)]  # fmt: skip
    if chance(rng, 0.7):  # the door: shut or half open
        swing = draw(rng, 0.0, 0.7) if chance(rng, 0.3) else 0.0
        far = float(-side - cut)
        parts += _pane(
            (deep + 0.01, float(cut)),
            (deep + 0.01 + abs(far) * np.sin(swing), float(cut + far * np.cos(swing))),
            (z, tall),
            glass,
            frame,
        )
        if swing == 0.0:
            parts.append(
                tube(
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
            )
    return finished([*parts, *_rail(rng, 0.0, 0.0, tall, metal)])


@family("shower", "quarter round")
def _quarter_round(rng: np.random.Generator) -> Piece:
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
    wall = np.stack([np.column_stack([path, np.full(len(path), z)]) for z in (high, tall)], axis=1)
    parts.append(cloth(wall, glass))
    for z in (high + 0.01, tall):
        parts.append(tube([(float(x), float(y), z) for x, y in path], 0.016, metal, 5))
    for k in (0, 3, 7, len(path) - 1):
        parts.append(
            tube(
                [(float(path[k, 0]), float(path[k, 1]), high), (float(path[k, 0]), float(path[k, 1]), tall)],
                0.014,
                metal,
                5,
            )
        )
    whole = joined(parts).moved(y=-size / 2)
    return finished([whole, *_rail(rng, 0.0, draw(rng, -0.2, 0.2) * size, tall, metal)])


@family("shower", "walk in")
def _walk_in(rng: np.random.Generator) -> Piece:
    wide, deep, tall = draw(rng, 0.9, 1.6), draw(rng, 0.8, 1.1), draw(rng, 1.9, 2.1)
    metal, glass = chrome(rng), material("glass", rng)
    side = pick(rng, (-1.0, 1.0)) * wide / 2
    share = draw(rng, 0.5, 0.8)
    far = side - np.sign(side) * share * wide
    parts = [box((0.0, -wide / 2, 0.0), (deep, wide / 2, draw(rng, 0.01, 0.04)), pictured("tile", rng, "stone")),
             *_pane((deep, float(side)), (deep, float(far)), (0.03, tall), glass, metal if chance(rng, 0.5) else None),
             tube([(deep, float(far), tall - 0.03), (0.0, float(far), tall - 0.03)], 0.01, metal, 5)]  # fmt: skip
    if chance(rng, 0.4):  # black bars divide the pane
        parts += [
            tube([(deep, float(side), z), (deep, float(far), z)], 0.008, metal, 4)
            for z in np.linspace(0.4, tall - 0.3, 4)
        ]
    return finished([*parts, *_rail(rng, 0.0, float(side * 0.2), tall, metal)])


@family("shower", "behind a curtain")
def _curtained_shower(rng: np.random.Generator) -> Piece:
    wide, deep, tall = _shower_size(rng)
    metal, rail, n = chrome(rng), draw(rng, 1.9, 2.05), 40
    parts = [*_tray(rng, wide, deep, china(rng)), *_rail(rng, 0.0, 0.0, tall, metal)]
    bend = 0.15
    path = [
        (0.0, wide / 2),
        (deep - bend, wide / 2),
        (deep - 0.04, wide / 2 - 0.04),
        (deep, wide / 2 - bend),
        (deep, -wide / 2),
    ]
    parts.append(tube([(x, y, rail) for x, y in path], 0.012, metal, 6))
    along = np.linspace(draw(rng, 0.2, 0.6), 0.99, n) * (deep + wide)
    wave = draw(rng, 0.02, 0.035) * np.sin(np.arange(n) * 1.6)
    on_side = along < deep
    x, y = (
        np.where(on_side, np.minimum(along, deep), deep + wave),
        np.where(on_side, wide / 2 + wave, wide / 2 - (along - deep)),
    )
    points = np.stack([np.column_stack([x, y, np.full(n, z)]) for z in (draw(rng, 0.08, 0.25), rail - 0.02)], axis=1)
    return finished([*parts, cloth(points, pictured("curtain", rng, "fabric"))])


@family("shower", "five-sided", held_out=True)
def _five_sided(rng: np.random.Generator) -> Piece:
    size, tall, high = draw(rng, 0.85, 1.1), draw(rng, 1.85, 2.05), draw(rng, 0.05, 0.15)
    cut, metal, glass = draw(rng, 0.35, 0.55) * size, chrome(rng), material("glass", rng)
    floor = np.array([(0.0, 0.0), (size, 0.0), (size, cut), (cut, size), (0.0, size)])
    parts = [shell([(floor, 0.0), (floor, high)], china(rng))]
    for a, b in zip(floor[1:-1], floor[2:], strict=True):
        parts += _pane((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), (high, tall), glass, metal)
    return finished([joined(parts).moved(y=-size / 2), *_rail(rng, 0.0, -0.1 * size, tall, metal)])


@family("shower", "wall rail")
def _wall_rail(rng: np.random.Generator) -> Piece:
    metal = chrome(rng)
    rail = joined(_rail(rng, 0.0, 0.0, draw(rng, 1.9, 2.1), metal))
    return finished([rail])

