"""Stairs between two floors: two flights side by side with a landing, in a well beside the hall."""

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, draw, pick
from avlmaps_sim.homes.plan import WELL, WELL_LENGTH_M, Storey, Wall
from avlmaps_sim.homes.walls import heading_of, placed, surface
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.scene import SceneBuilder
from avlmaps_sim.shapes import box, cylinder, tube

_LANDING_M = 1.0
_RISER_M = 0.18


def mouth_of(plan: Storey) -> Wall:
    """Return the open side of the stairwell, seen so that the well lies on its left."""
    index = next(i for i, room in enumerate(plan.rooms) if room.kind == WELL)
    wall, on_left = next((w, left) for w, left in plan.walls_of(index) if not w.built)
    return wall if on_left else Wall(wall.b, wall.a, wall.right, wall.left, (), built=False)


def build_stairs(rng: np.random.Generator, builder: SceneBuilder, ground: Storey, upper: Storey, area: int) -> None:
    """Add stairs and railings to a scene.

    ``area`` is the hall that they start from.
    """
    mouth = mouth_of(ground)
    rise = upper.rooms[0].floor_m - ground.rooms[0].floor_m
    ceiling = ground.rooms[0].height_m
    wide = mouth.length_m - ground.wall_m
    deep = WELL_LENGTH_M - ground.wall_m / 2
    look = surface(pick(rng, ("wood", "stone", "concrete", "marble", "wood")), rng)
    heading, middle = heading_of(mouth.to_left), (mouth.a + mouth.b) / 2
    floor = ground.rooms[0].floor_m
    parts, tread, number = _flights(rise, wide, deep, look)
    builder.add("stairs", placed(joined(parts), middle, heading, floor), heading + np.pi, area=area)
    edge = box((-0.04, -wide / 2, ceiling - 0.01), (0.0, wide / 2, rise - 0.004), surface("plaster", rng))
    builder.add("wall", placed(edge, middle, heading, floor), heading)
    run = tread * (number - 1)
    rails = _railings(rng, rise, wide, run)
    builder.add("railing", placed(joined(rails), middle, heading, floor), heading, area=area)


def _flights(rise: float, wide: float, deep: float, look: Material) -> tuple[list[Mesh], float, int]:
    """Return steps and landing, depth of a tread and steps of a flight; the well's mouth at x = 0, open towards -x."""
    number = max(int(np.ceil(rise / 2 / _RISER_M)), 2)
    riser, tread = rise / 2 / number, (deep - _LANDING_M) / (number - 1)
    parts = []
    for i in range(number - 1):
        top = (i + 1) * riser
        parts.append(box((i * tread, -wide / 2, 0.0), (deep - _LANDING_M, -0.03, top), look) if i == 0 else
                     box((i * tread, -wide / 2, top - riser), (deep - _LANDING_M, -0.03, top), look))  # fmt: skip
        start, top = (number - 2 - i) * tread, rise / 2 + (i + 1) * riser
        parts.append(box((start, 0.03, top - riser - 0.14), (start + tread + 0.02, wide / 2, top), look))
    parts.append(box((deep - _LANDING_M, -wide / 2, rise / 2 - 0.2), (deep, wide / 2, rise / 2), look))
    return parts, tread, number


def _railings(rng: np.random.Generator, rise: float, wide: float, run: float) -> list[Mesh]:
    metal = surface(pick(rng, ("metal", "wood", "black", "white")), rng)
    high, thick = draw(rng, 0.88, 1.0), draw(rng, 0.012, 0.03)
    up = (-0.08, 0.0, rise)  # the railing of the upper floor stands a little before the edge
    parts = [
        tube([(up[0], -wide / 2, rise + high), (up[0], 0.0, rise + high)], thick * 1.4, metal),
        tube([(0.0, 0.0, high), (run, 0.0, rise / 2 + high), (0.0, 0.0, rise + high)], thick * 1.2, metal),
    ]
    places = np.arange(-wide / 2 + 0.08, 0.01, 0.14).tolist()
    parts += [cylinder(up[0], y, rise, thick * 0.6, high, metal, 6) for y in places]
    bars = 9 if chance(rng, 0.6) else 4
    for x in np.linspace(0.05, run - 0.05, bars).tolist():
        low = rise / 2 * x / run
        parts.append(cylinder(x, 0.0, low + 0.05, thick * 0.6, high - 0.05, metal, 6))
        parts.append(cylinder(x, 0.0, rise - low, thick * 0.6, high, metal, 6))
    return parts
