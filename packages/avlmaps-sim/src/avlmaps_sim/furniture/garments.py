"""Clothes that lie about or hang: heaps, folded stacks, what was thrown over a chair, jackets on hooks and hangers."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.recipe_helpers import cloth, count, draw, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import ellipsoid, loft, rounded_box, tube

_CLOTHS = ("fabric", "fabric", "fabric", "curtain", "leather")


def fabric(rng: np.random.Generator) -> Material:
    """Return the cloth of a garment."""
    return material(pick(rng, _CLOTHS), rng)


def _waves(rng: np.random.Generator, number: int, longest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the wave vectors, phases and heights of random folds."""
    turn, wave = rng.uniform(0, 2 * np.pi, number), longest * rng.uniform(0.25, 1.0, number)
    vector = np.stack([np.cos(turn), np.sin(turn)], axis=1) * (2 * np.pi / wave)[:, None]
    return vector, rng.uniform(0, 2 * np.pi, number), rng.uniform(0.3, 1.0, number) * wave


def heap(rng: np.random.Generator, long: float, wide: float, high: float, look: Material) -> Mesh:
    """Return crumpled cloth on z = 0: an uneven outline, folds that run every direction, edges that lie flat."""
    sides, rings = 28, 10
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    outline = 1.0 + sum(draw(rng, 0.0, 0.28 / k) * np.sin(k * angle + draw(rng, 0, 6.3)) for k in (1, 2, 3, 4, 5))
    vector, phase, tall = _waves(rng, 6, 0.5 * max(long, wide))
    layers = []
    for share in np.linspace(1.0, 0.02, rings):
        flat = np.column_stack([np.cos(angle) * long / 2, np.sin(angle) * wide / 2]) * (outline * share)[:, None]
        folds = np.sqrt(np.abs(np.sin(flat @ vector.T + phase))) @ tall / tall.sum()
        folds = np.clip(2.2 * folds - 1.0, 0.0, 1.0)
        rise = np.clip((1.0 - share) / 0.35, 0.0, 1.0) ** 0.6
        layers.append(np.column_stack([flat, 0.004 + high * rise * (0.2 + 0.8 * folds)]))
    first = layers[0].copy()
    first[:, 2] = 0.0
    return loft([first, *layers], look)


def thrown_over(rng: np.random.Generator, wide: float, front: float, back: float, thick: float, look: Material) -> Mesh:
    """Return cloth that hangs over an edge along y at z = 0, ``thick`` from front to back: two flaps and the fold."""
    across = np.linspace(-0.5, 0.5, 15)
    vector, phase, tall = _waves(rng, 5, 0.35)
    hem = rng.uniform(0.75, 1.1, 2)
    rows = []
    for side, length, low in ((1.0, front, hem[0]), (-1.0, back, hem[1])):
        for share in (1.0, 0.75, 0.5, 0.25, 0.05):
            y = wide * across * (1.0 + 0.15 * share * draw(rng, -1, 1))
            z = -length * share * (low + 0.12 * np.sin(5 * across + phase[0]) * share)
            folds = np.sin(np.stack([y, z], axis=1) @ vector.T + phase) @ tall / tall.sum()
            x = side * (thick / 2 + 0.012 + 0.035 * share * (1.0 + folds))
            rows.append(np.column_stack([x, y, z + 0.01]))
        if side > 0:
            rows.append(np.column_stack([np.zeros(15), wide * across, np.full(15, 0.022)]))
            rows[-1][:, 2] += 0.006 * np.sin(9 * across + phase[1])
    return cloth(np.stack([*rows[:6], *rows[:5:-1]]), look)


def _hanging(rng: np.random.Generator, look: Material, shoulders: float, long: float, deep: float) -> Mesh:
    """Return a garment that hangs from z = 0 downwards: narrow at the collar, wide below, folded."""
    rings, sides = [], 22
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    phase, folds = draw(rng, 0, 6.3), count(rng, 3, 7)
    for share, width in ((0.0, 0.25), (0.08, 0.85), (0.2, 1.0), (0.6, 1.0), (1.0, draw(rng, 0.95, 1.25))):
        wrinkle = 1.0 + 0.18 * share * np.sin(folds * angle + phase)
        x, y = np.cos(angle) * deep / 2 * wrinkle, np.sin(angle) * shoulders / 2 * width
        rings.append(np.column_stack([x, y, np.full(sides, -long * share)]))
    return loft(rings, look)


def _sleeves(rng: np.random.Generator, look: Material, shoulders: float, long: float) -> Meshes:
    for side in (-1, 1):
        y, out = side * shoulders * 0.44, side * draw(rng, 0.02, 0.1)
        line = [(0.0, y, -0.06), (0.01, y + 0.6 * out, -0.3 * long), (0.02, y + out, -0.62 * long)]
        yield tube(line, draw(rng, 0.045, 0.065), look, 8)


@family("clothing", "heap")
def _heap(rng: np.random.Generator) -> Parts:
    long = draw(rng, 0.25, 0.75)
    return [heap(rng, long, long * draw(rng, 0.5, 1.0), draw(rng, 0.04, 0.16), fabric(rng))]


@family("clothing", "several in a heap")
def _pile(rng: np.random.Generator) -> Parts:
    z = 0.0
    for _ in range(count(rng, 2, 5)):
        long, high = draw(rng, 0.3, 0.6), draw(rng, 0.04, 0.12)
        one = heap(rng, long, long * draw(rng, 0.5, 0.9), high, fabric(rng)).turned(draw(rng, 0, 6.3))
        yield one.moved(draw(rng, -0.12, 0.12), draw(rng, -0.12, 0.12), z)
        z += 0.55 * high


@family("clothing", "folded stack")
def _stack(rng: np.random.Generator) -> Parts:
    z = 0.0
    long, wide = draw(rng, 0.25, 0.4), draw(rng, 0.2, 0.32)
    for _ in range(count(rng, 1, 7)):
        high = draw(rng, 0.012, 0.045)
        a, b = long / 2 * draw(rng, 0.85, 1.0), wide / 2 * draw(rng, 0.85, 1.0)
        one = rounded_box((-a, -b, 0.0), (a, b, high), 0.012, fabric(rng), soft_top=0.005)
        yield one.turned(draw(rng, -0.12, 0.12)).moved(z=z)
        z += high


@family("clothing", "wall hook")
def _on_hook(rng: np.random.Generator) -> Parts:
    look, long, shoulders = fabric(rng), draw(rng, 0.6, 1.15), draw(rng, 0.3, 0.45)
    yield from (_hanging(rng, look, shoulders, long, draw(rng, 0.1, 0.18)), *_sleeves(rng, look, shoulders, long))
    hook = tube([(-0.09, 0.0, 0.02), (0.0, 0.0, 0.0), (0.02, 0.0, 0.03)], 0.008, material("metal", rng), 6)
    yield hook


@family("clothing", "trousers laid out", held_out=True)
def _trousers(rng: np.random.Generator) -> Parts:
    look, long, wide = fabric(rng), draw(rng, 0.7, 1.05), draw(rng, 0.13, 0.2)
    for side in (-1, 1):
        apart = draw(rng, 0.5, 1.4) * side
        line = [(0.0, side * wide * 0.45, 0.02), (long * 0.5, apart * wide * 0.8, 0.024), (long, apart * wide, 0.016)]
        leg = tube(line, wide * 0.5, look, 10)
        yield leg.scaled(1.0, 1.0, 0.28)
    yield ellipsoid((0.0, 0.0, 0.014), (0.09, wide * 0.95, 0.022), look)


@family("clothing", "on hangers", held_out=True)
def _on_hangers(rng: np.random.Generator) -> Parts:
    x = 0.0
    for _ in range(count(rng, 3, 8)):
        look, long, shoulders = fabric(rng), draw(rng, 0.6, 1.1), draw(rng, 0.36, 0.46)
        one = joined([_hanging(rng, look, shoulders, long, 0.06), *_sleeves(rng, look, shoulders, long)])
        yield one.turned(draw(rng, -0.15, 0.15)).moved(x)
        x += draw(rng, 0.05, 0.1)
    rod = tube([(-0.1, 0.0, 0.05), (x + 0.1, 0.0, 0.05)], 0.014, material("metal", rng), 8)
    yield rod
