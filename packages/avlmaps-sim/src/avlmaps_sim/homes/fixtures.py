"""Fixtures of rooms: columns, piers and niches, low and free-standing walls, beams under the ceiling."""

import numpy as np

from avlmaps_sim.furniture import Piece
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.furnish import Furnisher, footprint
from avlmaps_sim.homes.polygons import area_m2, half
from avlmaps_sim.homes.walls import surface
from avlmaps_sim.mesh import Material, Mesh
from avlmaps_sim.shapes import box, cylinder, prism

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
