"""Fixtures of rooms: columns, piers and niches, walls that stand free, beams; stairs between floors."""

import numpy as np

from avlmaps_sim.furniture import Piece
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.furnish import Furnisher, footprint
from avlmaps_sim.homes.plan import WELL, WELL_LENGTH_M, Storey, Wall
from avlmaps_sim.homes.polygons import area_m2, half
from avlmaps_sim.homes.walls import heading_of, placed, surface
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.scene import SceneBuilder
from avlmaps_sim.shapes import box, cylinder, prism, tube

_COLUMNS = ("living room", "dining room", "kitchen", "open-plan office", "reception", "gym", "meeting room", "corridor")


def fit_out(f: Furnisher, wall: Material) -> None:
    """Build fixtures into a share of the rooms, before furniture comes."""
    rng, size = f.rng, area_m2(f.ground.polygon)
    if f.kind in _COLUMNS and chance(rng, 0.7 if f.kind == "open-plan office" else 0.2):
        _columns(f, wall, count(rng, 1, 4) if size > 35 else 1)
    if chance(rng, 0.16):
        for _ in range(count(rng, 1, 2)):
            pier = _block(draw(rng, 0.12, 0.45), draw(rng, 0.3, 1.4), f.height_m, wall)
            f.along(pier, front_m=0.0, gap_m=-0.006, corner=0.5)
    if size > 16 and chance(rng, 0.12):
        low = chance(rng, 0.5)
        tall = draw(rng, 0.85, 1.3) if low else f.height_m
        spur = _block(draw(rng, 0.7, 1.8), draw(rng, 0.09, 0.18), tall, wall)
        f.along(spur, front_m=0.0, gap_m=-0.006, corner=0.0)
    if size > 24 and chance(rng, 0.1):
        screen = _block(draw(rng, 0.09, 0.2), draw(rng, 0.9, 2.4), f.height_m if chance(rng, 0.6) else 1.5, wall)
        f.in_middle(screen, 0.2)
    if f.has_ceiling and chance(rng, 0.08):
        _beams(f)


def _block(depth_m: float, width_m: float, height_m: float, look: Material) -> Piece:
    mesh = box((-depth_m / 2, -width_m / 2, 0.0), (depth_m / 2, width_m / 2, height_m), look)
    return Piece(mesh, category="wall")


def _columns(f: Furnisher, wall: Material, number: int) -> None:
    rng = f.rng
    look = wall if chance(rng, 0.4) else surface(pick(rng, ("concrete", "painted", "stone", "wood", "marble")), rng)
    thick = draw(rng, 0.18, 0.45)
    if chance(rng, 0.45):
        mesh = cylinder(0.0, 0.0, 0.0, thick / 2, f.height_m, look, 18)
    else:
        deep = thick * draw(rng, 0.8, 1.3)
        mesh = box((-thick / 2, -deep / 2, 0.0), (thick / 2, deep / 2, f.height_m), look)
    for _ in range(number):
        f.in_middle(Piece(mesh, category="column"), 0.22)


def _beams(f: Furnisher) -> None:
    """Lay beams under the ceiling, all one way."""
    rng = f.rng
    side = max(f.ground.sides, key=lambda s: s.length_m)
    way, look = side.along, surface(pick(rng, ("wood", "wood", "painted", "concrete")), rng)
    wide, high, step = draw(rng, 0.1, 0.25), draw(rng, 0.1, 0.25), draw(rng, 0.8, 1.6)
    reach = f.ground.polygon @ way
    for at in np.arange(float(reach.min()) + step / 2, float(reach.max()) - wide, step):
        strip = half(half(f.ground.polygon, (at + wide / 2) * way, way), (at - wide / 2) * way, -way)
        if len(strip) >= 3 and area_m2(strip) > 0.1:
            mesh: Mesh = prism([(float(x), float(y)) for x, y in strip], f.floor_m + f.height_m - high, high, look)
            f.builder.add("ceiling", mesh, area=f.area)
            across = strip @ side.inward
            middle = (at * way) + (float(across.min() + across.max()) / 2) * side.inward
            foot = footprint(box((-wide / 2, -float(np.ptp(across)) / 2, f.height_m - high),
                                 (wide / 2, float(np.ptp(across)) / 2, f.height_m), look))  # fmt: skip
            f.ground.take(foot, middle, float(np.arctan2(way[1], way[0])))


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
