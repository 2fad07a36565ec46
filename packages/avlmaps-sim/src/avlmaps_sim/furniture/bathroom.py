"""Toilets and bathtubs."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.fittings import china, chrome, open_bowl, outline, tap
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import box, cylinder, ellipsoid, loft, rounded_box, shell, slab, tube


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
    rings = [(outline(length, wide, power, 20, egg, middle), 0.0),
             (outline(length, wide, power, 20, egg, middle), thick), (outline(*inner, 2.0, 20, 0.2, hole), thick),
             (outline(*inner, 2.0, 20, 0.2, hole), 0.0)]  # fmt: skip
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

    ``z`` are the heights of foot and rim, ``power`` squares the rim, which begins at ``x``; ``foot`` has length, width
    and x of its middle.
    """
    egg, middle, (low, high) = 0.12, (x + length / 2, 0.0), z
    waist = low + (high - low) * draw(rng, 0.3, 0.5)
    swell = draw(rng, 0.8, 1.0)
    levels = [(outline(foot[0], foot[1], 2.6, 20, 0.05, (foot[2], 0.0)), low),
              (outline(foot[0] * 0.96, foot[1] * 0.9, 2.6, 20, 0.05, (foot[2], 0.0)), waist),
              (outline(length * 0.95, wide * swell, power, 20, egg, middle), high - 0.09),
              (outline(length, wide, power, 20, egg, middle), high - 0.03),
              (outline(length, wide, power, 20, egg, middle), high),
              (outline(length * 0.72, wide * 0.66, 2.0, 20, 0.15, (middle[0] + 0.03, 0.0)), high),
              (outline(length * 0.5, wide * 0.45, 2.0, 20, 0.1, (middle[0] + 0.03, 0.0)), high - 0.12),
              (outline(length * 0.25, wide * 0.25, 2.0, 20, 0.0, (middle[0], 0.0)), high - 0.19)]  # fmt: skip
    return shell(levels, look)


def _button(x: float, y: float, z: float, look: Material) -> Mesh:
    return cylinder(x, y, z, 0.022, 0.006, look, 10)


def _flush(rng: np.random.Generator, deep: float, wide: float, top: float, metal: Material) -> list[Mesh]:
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
    return draw(rng, 0.42, 0.52), draw(rng, 0.34, 0.4), draw(rng, 0.38, 0.46), pick(rng, (2.0, 2.2, 2.6, 4.0))


@family("toilet", "close-coupled")
def _close_coupled(rng: np.random.Generator) -> Parts:
    (length, wide, rim_z, power), look, metal = _sizes(rng), china(rng), chrome(rng)
    deep, across, top = draw(rng, 0.15, 0.21), draw(rng, 0.34, 0.48), rim_z + draw(rng, 0.32, 0.42)
    foot = (draw(rng, 0.32, 0.48), draw(rng, 0.2, 0.27), deep + draw(rng, 0.16, 0.24))
    seat = look if chance(rng, 0.7) else made_of(rng, "wood", "plastic", "black")
    return [_bowl(rng, length, wide, power, (0.0, rim_z), deep + 0.01, foot, look),
            slab(deep * 0.75, 0.0, rim_z - 0.09, deep * 1.4, min(across, 0.24), 0.085, look),
            *_tank(rng, deep, across, (rim_z - 0.01, top), look, metal),
            *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, deep + 0.015, seat)]  # fmt: skip


@family("toilet", "hung on a casing")
def _on_casing(rng: np.random.Generator) -> Parts:
    (length, wide, rim_z, power), look = _sizes(rng), china(rng)
    case_deep, case_wide, top = draw(rng, 0.1, 0.2), draw(rng, 0.5, 1.1), draw(rng, 0.95, 1.25)
    clad = pictured(pick(rng, ("tile", "plaster", "marble", "wood")), rng, "ceramic")
    foot = (length * 0.8, wide * 0.75, case_deep + length * 0.42)
    x = case_deep + 0.03
    return [box((0.0, -case_wide / 2, 0.0), (case_deep, case_wide / 2, top), clad),
            _bowl(rng, length, wide, power, (rim_z - draw(rng, 0.26, 0.34), rim_z), x, foot, look),
            slab(case_deep + 0.06, 0.0, rim_z - 0.28, 0.12, wide * 0.8, 0.26, look),
            box((case_deep, -0.12, 0.86), (case_deep + 0.012, 0.12, 0.94), made_of(rng, "white", "metal", "black")),
            *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, x + 0.005, look)]  # fmt: skip


@family("toilet", "back to wall")
def _back_to_wall(rng: np.random.Generator) -> Parts:
    (length, wide, rim_z, power), look, metal = _sizes(rng), china(rng), chrome(rng)
    deep, across, top = draw(rng, 0.14, 0.2), draw(rng, 0.36, 0.42), rim_z + draw(rng, 0.3, 0.4)
    skirt = (length + deep * 0.6, wide * 0.86, deep + length * 0.42)
    bowl = [(outline(skirt[0] * 0.93, skirt[1], 3.5, 20, 0.04, (skirt[2] * 0.92, 0.0)), 0.0),
            (outline(skirt[0] * 0.97, skirt[1] * 1.02, 3.5, 20, 0.06, (skirt[2] * 0.95, 0.0)),
             rim_z * 0.6)]  # fmt: skip
    middle = (deep + length / 2, 0.0)
    bowl += [(outline(length * 1.02, wide, power, 20, 0.12, middle), rim_z - 0.05),
             (outline(length, wide, power, 20, 0.12, middle), rim_z),
             (outline(length * 0.72, wide * 0.66, 2.0, 20, 0.1, middle), rim_z),
             (outline(length * 0.4, wide * 0.35, 2.0, 20, 0.1, middle), rim_z - 0.17)]  # fmt: skip
    return [shell(bowl, look), slab(deep / 2, 0.0, 0.0, deep, wide * 0.8, rim_z, look),
            *_tank(rng, deep, across, (rim_z - 0.02, top), look, metal),
            *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, deep + 0.01, look)]  # fmt: skip


@family("toilet", "one piece")
def _one_piece(rng: np.random.Generator) -> Parts:
    (length, wide, rim_z, power), look, metal = _sizes(rng), china(rng), chrome(rng)
    deep, top = draw(rng, 0.18, 0.24), rim_z + draw(rng, 0.16, 0.3)
    across = wide * draw(rng, 0.98, 1.1)
    foot = (length * 0.95, wide * 0.72, deep + length * 0.35)
    tank = [(outline(deep * s, across * w, 5.0, 20, 0.0, (deep * s / 2, 0.0)), z) for s, w,
            z in ((1.5, 0.8, rim_z - 0.12), (1.25, 0.95, rim_z), (1.0, 1.0, rim_z + 0.08), (0.95, 1.0, top - 0.02),
                  (0.85, 0.92, top))]  # fmt: skip
    return [_bowl(rng, length, wide, power, (0.0, rim_z), deep, foot, look), shell(tank, look),
            _button(deep * 0.42, 0.0, top, metal),
            box((0.0, -wide * 0.3, 0.0), (deep + 0.1, wide * 0.3, rim_z - 0.1), look),
            *_seat(rng, length, wide * 1.01, power, rim_z + 0.003, deep + 0.01, look)]  # fmt: skip


@family("toilet", "washing seat", held_out=True)
def _washing_seat(rng: np.random.Generator) -> Parts:
    (length, wide, rim_z, _), look = _sizes(rng), china(rng)
    total, power = length + draw(rng, 0.12, 0.2), draw(rng, 3.0, 5.0)
    levels = [(outline(total * a, wide * b, power, 22, 0.07, (total / 2 - total * (1 - a) / 2, 0.0)), z) for a, b,
              z in ((0.86, 0.8, 0.0), (0.9, 0.82, 0.3 * rim_z), (1.0, 0.98, 0.8 * rim_z),
                    (1.0, 1.0, rim_z))]  # fmt: skip
    back = draw(rng, 0.12, 0.2)
    yield shell(levels, look)
    yield rounded_box((0.0, -wide / 2, rim_z - 0.01), (back, wide / 2, rim_z + draw(rng, 0.08, 0.14)), 0.03, look)
    yield from _seat(rng, total - back - 0.01, wide, power, rim_z + 0.003, back, look)
    if chance(rng, 0.5):
        yield slab(back + 0.16, wide / 2 + 0.03, rim_z - 0.01, 0.22, 0.06, 0.05, look)


@family("toilet", "high tank", held_out=True)
def _high_tank(rng: np.random.Generator) -> Parts:
    (length, wide, rim_z, _), look, metal = _sizes(rng), china(rng), chrome(rng)
    wood = material("wood", rng)
    low = draw(rng, 0.85, 1.75)
    deep, across, tall = draw(rng, 0.17, 0.22), draw(rng, 0.4, 0.52), draw(rng, 0.28, 0.36)
    tank = wood if chance(rng, 0.3) else look
    x = draw(rng, 0.16, 0.2)
    foot = (draw(rng, 0.36, 0.48), draw(rng, 0.22, 0.28), x + 0.2)
    yield _bowl(rng, length, wide, 2.0, (0.0, rim_z), x, foot, look)
    yield from _seat(rng, length, wide * 1.01, 2.0, rim_z + 0.003, x + 0.005, wood)
    yield rounded_box((0.0, -across / 2, low), (deep, across / 2, low + tall), 0.02, tank)
    yield slab(deep / 2, 0.0, low + tall, deep + 0.02, across + 0.02, 0.02, tank)
    yield tube([(0.06, 0.0, low), (0.06, 0.0, rim_z + 0.02), (0.1, 0.0, rim_z - 0.06), (x + 0.08, 0.0, rim_z - 0.07)],
               0.022, metal, 8)  # fmt: skip
    yield tube([(deep / 2, across * 0.4, low), (deep / 2, across * 0.42, low - min(0.6, low * 0.4))], 0.003, metal, 4)
    yield ellipsoid((deep / 2, across * 0.42, low - min(0.6, low * 0.4)), (0.015, 0.015, 0.03), wood, 7, 4)


def _tub(low: Triple, high: Triple, power: float, wall: float, look: Material, skirt: Material, deep: float,
         tilt: float = 0.12) -> Meshes:  # fmt: skip
    """Return a tub with a hollow between two corners; ``power`` squares the hollow, ``tilt`` slants its low-y end."""
    (a, b, c), (d, e, f) = low, high
    wide, long, middle = d - a, e - b, ((a + d) / 2, (b + e) / 2)
    outer = outline(wide, long, 30.0, 28, middle=middle)
    inner = (wide - 2 * wall, long - 2 * wall)
    shift = tilt * long / 4
    foot = outline(inner[0] * 0.8, inner[1] * (0.86 - tilt), power, 28, middle=(middle[0], middle[1] + shift))
    half = outline(inner[0] * 0.93, inner[1] * (0.96 - tilt / 2), power, 28, middle=(middle[0], middle[1] + shift / 2))
    yield from open_bowl([(outer, f - 0.03), (outer, f), (outline(*inner, power, 28, middle=middle), f),
                          (half, f - deep * 0.5), (foot, f - deep)], look)  # fmt: skip
    sides = [box((a, b, c), (a + 0.02, e, f - 0.03), skirt), box((d - 0.02, b, c), (d, e, f - 0.03), skirt),
             box((a, b, c), (d, b + 0.02, f - 0.03), skirt),
             box((a, e - 0.02, c), (d, e, f - 0.03), skirt)]  # fmt: skip
    yield from sides


def _tub_tap(rng: np.random.Generator, x: float, y: float, z: float, metal: Material) -> list[Mesh]:
    parts = tap(rng, (0.0, 0.0, 0.0), draw(rng, 0.12, 0.18), draw(rng, 0.1, 0.2), metal)
    return [joined(parts).turned(-np.pi / 2).moved(x, y, z)]


def _tub_size(rng: np.random.Generator) -> tuple[float, float, float]:
    return draw(rng, 0.66, 0.85), draw(rng, 1.4, 1.85), draw(rng, 0.48, 0.62)


@family("bathtub", "built in")
def _built_in(rng: np.random.Generator) -> Parts:
    (wide, long, high), look = _tub_size(rng), china(rng)
    skirt = look if chance(rng, 0.5) else pictured(pick(rng, ("tile", "tile", "wood", "marble")), rng, "ceramic")
    wall, metal = draw(rng, 0.04, 0.11), chrome(rng)
    yield from _tub(
        (0.0, -long / 2, 0.0),
        (wide, long / 2, high),
        pick(rng, (3.0, 5.0, 8.0)),
        wall,
        look,
        skirt,
        draw(rng, 0.36, 0.44),
    )
    yield from _tub_tap(rng, wide / 2, long / 2 - 0.04, high, metal) if chance(rng, 0.6) else []


@family("bathtub", "with glass screen")
def _screened(rng: np.random.Generator) -> Parts:
    (wide, long, high), look, metal = _tub_size(rng), china(rng), chrome(rng)
    yield from _tub((0.0, -long / 2, 0.0), (wide, long / 2, high), 5.0, 0.06, look, look, 0.4)
    pane, tall = draw(rng, 0.35, 0.55) * long, draw(rng, 1.3, 1.5)
    yield box((wide - 0.04, long / 2 - pane, high), (wide - 0.032, long / 2, high + tall), material("glass", rng))
    yield box((wide - 0.045, long / 2 - 0.02, high), (wide - 0.025, long / 2, high + tall), metal)
    yield tube([(wide / 2, long / 2 - 0.01, high + 0.2), (wide / 2, long / 2 - 0.01, high + tall - 0.05),
                (wide / 2, long / 2 - 0.28, high + tall)], 0.011, metal, 6)  # fmt: skip
    yield cylinder(wide / 2, long / 2 - 0.3, high + tall - 0.03, draw(rng, 0.05, 0.12), 0.02, metal, 12)
    yield box((wide / 2 - 0.12, long / 2 - 0.06, high + 0.2), (wide / 2 + 0.12, long / 2 - 0.01, high + 0.25), metal)


@family("bathtub", "with shower curtain")
def _curtained_tub(rng: np.random.Generator) -> Parts:
    (wide, long, high), look, metal = _tub_size(rng), china(rng), chrome(rng)
    yield from _tub((0.0, -long / 2, 0.0), (wide, long / 2, high), 4.0, 0.06, look, look, 0.4)
    rail, share = draw(rng, 1.9, 2.05), draw(rng, 0.25, 1.0)
    yield tube([(wide - 0.03, -long / 2, rail), (wide - 0.03, long / 2, rail)], 0.012, metal, 6)
    n = 34
    y = np.linspace(long / 2 - share * long, long / 2 - 0.02, n)
    x = wide + 0.01 + draw(rng, 0.015, 0.035) * np.sin(np.arange(n) * 1.5)
    points = np.stack([np.column_stack([x, y, np.full(n, z)]) for z in (draw(rng, 0.15, 0.35), rail - 0.02)], axis=1)
    yield cloth(points, pictured("curtain", rng, "fabric"))
    yield from _tub_tap(rng, wide / 2, long / 2 - 0.04, high, metal)


def _free_tub(rng: np.random.Generator, wide: float, long: float, z: tuple[float, float], foot: float, power: float,
              look: Material, inside: Material) -> list[Mesh]:  # fmt: skip
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
def _freestanding(rng: np.random.Generator) -> Parts:
    wide, long, high, look = draw(rng, 0.68, 0.88), draw(rng, 1.45, 1.85), draw(rng, 0.52, 0.66), china(rng)
    outside = look if chance(rng, 0.65) else made_of(rng, "painted", "stone", "metal")
    yield from _free_tub(
        rng, wide, long, (0.0, high), draw(rng, 0.6, 0.92), pick(rng, (2.0, 2.3, 3.0, 5.0)), outside, look
    )
    if chance(rng, 0.5):  # a tap that stands on the floor
        metal = chrome(rng)
        yield from (tube([(-wide / 2 - 0.07, 0.0, 0.0), (-wide / 2 - 0.07, 0.0, high + 0.28),
                          (-wide / 2 + 0.02, 0.0, high + 0.33), (-wide / 2 + 0.13, 0.0, high + 0.27)], 0.014, metal, 6),
                    cylinder(-wide / 2 - 0.07, 0.0, 0.0, 0.04, 0.012, metal, 10))  # fmt: skip


@family("bathtub", "clawfoot", held_out=True)
def _clawfoot(rng: np.random.Generator) -> Parts:
    wide, long, high, look = draw(rng, 0.68, 0.8), draw(rng, 1.4, 1.75), draw(rng, 0.56, 0.66), china(rng)
    metal, lift = chrome(rng), draw(rng, 0.1, 0.16)
    outside = look if chance(rng, 0.5) else material("painted", rng)
    yield from _free_tub(rng, wide, long, (lift, high), draw(rng, 0.5, 0.7), 2.4, outside, look)
    for x in (-0.25, 0.25):
        for y in (-0.3, 0.3):
            yield tube([(x * wide * 0.8, y * long * 0.9, lift + 0.12), (x * wide * 1.25, y * long, lift * 0.7),
                        (x * wide * 1.1, y * long, 0.02), (x * wide * 1.3, y * long * 1.02, 0.012)], 0.022, metal,
                       6)  # fmt: skip
    yield from _tub_tap(rng, 0.0, long / 2 - 0.03, high, metal)


@family("bathtub", "corner")
def _corner_tub(rng: np.random.Generator) -> Parts:
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
             *open_bowl([(outer, high - 0.03), (outer, high), (hollow, high),
                         (middle + (hollow - middle) * 0.92, high - 0.2),
                         (middle + (hollow - middle) * 0.74, high - 0.38)], look)]  # fmt: skip
    return [joined(parts).moved(y=-side / 2)]


@family("bathtub", "deep tub", held_out=True)
def _deep_tub(rng: np.random.Generator) -> Parts:
    wide, long, high = draw(rng, 0.7, 1.1), draw(rng, 0.85, 1.25), draw(rng, 0.6, 0.85)
    wood = material("wood", rng) if chance(rng, 0.6) else pictured("tile", rng, "ceramic")
    if chance(rng, 0.5):
        flat = outline(long, long, 2.0, 24)
        yield shell([(flat, 0.0), (flat, high), (flat * 0.9, high), (flat * 0.85, high - 0.5)], wood)
        for z in (0.12, high - 0.15):
            yield shell([(flat * 1.012, z), (flat * 1.012, z + 0.03)], material("metal", rng), capped=False)
    else:
        yield from _tub((0.0, -long / 2, 0.0), (wide, long / 2, high), 8.0, 0.05, wood, wood, 0.5, 0.0)
