"""Paper: loose sheets, stacks, newspapers and letters on tops and floors, notes and calendars on walls."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.shapes import box, ellipsoid

_SIZES = ((0.21, 0.297), (0.21, 0.297), (0.297, 0.42), (0.148, 0.21), (0.11, 0.22))


def _look(rng: np.random.Generator) -> Material:
    """Return paper: mostly white, at times coloured, printed or torn from something else."""
    kind = rng.random()
    if kind < 0.65:
        return material("paper", rng)
    if kind < 0.85:
        red, green, blue = rng.uniform(0.45, 1.0, 3).tolist()
        return material("paper", rng, (red, green, blue))
    return material("poster", rng)


def leaf(rng: np.random.Generator, wide: float, long: float, curl: float, look: Material) -> Mesh:
    """Return a sheet on z = 0 whose edges and corners rise by up to ``curl`` metres."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 6), np.linspace(-0.5, 0.5, 6), indexing="ij")
    turn = draw(rng, 0, 2 * np.pi)
    along = np.cos(turn) * x + np.sin(turn) * y
    z = 0.0015 + curl * (2 * along) ** 2 * draw(rng, 0.2, 1.0) + 0.2 * curl * np.sin(7 * x + 5 * y + turn)
    points = np.stack([x * wide, y * long, np.maximum(z, 0.001)], axis=-1)
    return cloth(points, look, fill=True)


@family("paper", "loose sheets")
def _sheets(rng: np.random.Generator) -> Parts:
    (wide, long) = pick(rng, _SIZES)
    for number in range(count(rng, 1, 8)):
        one = leaf(rng, wide, long, draw(rng, 0.0, 0.02), _look(rng)).turned(draw(rng, -0.7, 0.7))
        reach = 0.02 * count(rng, 0, 8)
        yield one.moved(draw(rng, -reach, reach), draw(rng, -reach, reach), 0.002 * number)


@family("paper", "stack")
def _stack(rng: np.random.Generator) -> Parts:
    z, (wide, long) = 0.0, pick(rng, _SIZES)
    for _ in range(count(rng, 1, 6)):
        high, look = draw(rng, 0.003, 0.05), _look(rng)
        part = box((-wide / 2, -long / 2, 0.0), (wide / 2, long / 2, high), look).turned(draw(rng, -0.15, 0.15))
        yield part.moved(draw(rng, -0.01, 0.01), draw(rng, -0.01, 0.01), z)
        z += high
    yield leaf(rng, wide, long, 0.006, _look(rng)).moved(z=z)


@family("paper", "newspaper")
def _newspaper(rng: np.random.Generator) -> Parts:
    wide, long, look = draw(rng, 0.28, 0.4), draw(rng, 0.36, 0.58), material("poster", rng)
    yield leaf(rng, wide, long, draw(rng, 0.0, 0.03), material("paper", rng, (0.84, 0.82, 0.78)))
    for number in range(count(rng, 1, 4)):
        part = leaf(rng, wide, long, draw(rng, 0.005, 0.03), look if chance(rng, 0.5) else _look(rng))
        yield part.turned(draw(rng, -0.06, 0.06)).moved(draw(rng, -0.02, 0.02), z=0.003 * (number + 1))


@family("paper", "crumpled", held_out=True)
def _crumpled(rng: np.random.Generator) -> Parts:
    for _ in range(count(rng, 1, 4)):
        size = draw(rng, 0.025, 0.06)
        ball = ellipsoid((0.0, 0.0, size), (size, size * 0.9, size * 0.8), _look(rng), 9, 6)
        jag = rng.normal(0.0, 0.12 * size, ball.vertex.shape).astype(np.float32)
        dented = Mesh(ball.vertex + jag, ball.triangle, ball.uv, ball.material, ball.materials)
        yield dented.moved(draw(rng, -0.15, 0.15), draw(rng, -0.15, 0.15), -float(dented.low[2]))


@family("paper", "wall notes")
def _notes(rng: np.random.Generator) -> Parts:
    for _ in range(count(rng, 1, 9)):
        wide, long = pick(rng, _SIZES)
        one = leaf(rng, wide, long, draw(rng, 0.0, 0.015), _look(rng)).turned(draw(rng, -0.12, 0.12))
        upright = one.tilted("y", np.pi / 2).moved(x=-float(one.tilted("y", np.pi / 2).low[0]))
        yield upright.moved(y=draw(rng, -0.35, 0.35), z=draw(rng, -0.3, 0.3))


@family("paper", "wall calendar", held_out=True)
def _calendar(rng: np.random.Generator) -> Parts:
    wide, high = draw(rng, 0.25, 0.35), draw(rng, 0.4, 0.6)
    top = box((0.0, -wide / 2, 0.45 * high), (0.006, wide / 2, high), material("poster", rng))
    return [top, box((0.0, -wide / 2, 0.0), (0.004, wide / 2, 0.45 * high), material("paper", rng))]
