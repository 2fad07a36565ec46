"""Bathtubs."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.fittings import china, chrome, open_bowl, outline, shell, tap
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, draw, made_of, pick, pictured
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import box, cylinder, loft, tube


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
    """Return a tap at the middle of the back or at the end of a tub's rim, pouring inwards."""
    parts = tap(rng, (0.0, 0.0, 0.0), draw(rng, 0.12, 0.18), draw(rng, 0.1, 0.2), metal)
    return [joined(parts).turned(-np.pi / 2).moved(x, y, z)]


def _tub_size(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return width, length and height of a tub, metres."""
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
    """Return a tub that stands by itself: a shell that narrows to its foot, its ends raised at times."""
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
