"""Shower curtains on their rails, beside a tub or round a tray. The rail runs along y, the hem is at z = 0."""

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, draw, made_of
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Triple
from avlmaps_sim.shapes import tube


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
