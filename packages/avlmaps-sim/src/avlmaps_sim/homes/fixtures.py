"""Fixtures of rooms: columns, piers and niches, walls that stand free, beams; stairs; what hangs on walls."""

import numpy as np

from avlmaps_sim.furniture import Piece
from avlmaps_sim.furniture.drapes import curtain
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.furnish import Furnisher, footprint, hangs, on_floor_or_wall, wall_hung
from avlmaps_sim.homes.placing import Side
from avlmaps_sim.homes.plan import WELL, WELL_LENGTH_M, Storey, Wall, area_m2, half, middle
from avlmaps_sim.homes.walls import heading_of, placed, surface
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.scene import Light, SceneBuilder
from avlmaps_sim.shapes import box, cylinder, prism, tube

_NO_CLOTH = ("bathroom", "toilet", "storage", "laundry room", "gym", "copy room")


def dress_windows(f: Furnisher, cloth: float, style: str | None) -> None:
    """Hang curtains or blinds at windows, and stand radiators under some.

    ``cloth`` is the probability that a window has them; the curtains' style is drawn for each where none is given.
    """
    for side in f.ground.sides:
        for start, end, sill, head in side.windows:
            warm = sill > 0.55 and chance(f.rng, 0.45) and _radiator(f, side, (start + end) / 2, sill)
            if not chance(f.rng, cloth):
                continue
            if f.kind not in _NO_CLOTH and chance(f.rng, 0.65):
                _curtain(f, side, (start, end, sill, head), warm, style)
            else:
                _blinds(f, side, (start, end, sill, head))


def _at_window(side: Side, at_m: float, piece_depth_m: float) -> np.ndarray:
    return (side.a + at_m * side.along + (0.001 + piece_depth_m / 2) * side.inward)[None]


def _curtain(
    f: Furnisher, side: Side, window: tuple[float, float, float, float], warm: bool, style: str | None
) -> None:
    start, end, sill, head = window
    width = end - start + draw(f.rng, 0.1, 0.5)
    at = (start + end) / 2
    width = min(width, 2 * min(at, side.length_m - at) - 0.1)
    if width < end - start:
        return
    top = min(head + draw(f.rng, 0.05, 0.3), f.height_m - 0.06)
    short = warm or (sill > 0.5 and chance(f.rng, 0.4))
    hem = max(sill - draw(f.rng, 0.02, 0.2), 0.01) if short else draw(f.rng, 0.01, 0.06)
    if top - hem < 0.5:
        return
    piece = curtain(f.rng, width, top - hem, f.which, style)
    foot = footprint(piece.mesh)
    f.try_at(piece, _at_window(side, at, foot.depth_m), np.array([side.heading_rad]), hem, zones=False)


def _blinds(f: Furnisher, side: Side, window: tuple[float, float, float, float]) -> None:
    start, end, sill, head = window
    if (piece := f.new("blinds")) is None:
        return
    foot = footprint(piece.mesh)
    wide, tall = (end - start + 0.06) / foot.width_m, (head - sill + 0.08) / max(foot.high_m, 0.1)
    mesh = piece.mesh.scaled(1.0, float(np.clip(wide, 0.3, 2.5)), float(np.clip(tall, 0.4, 1.6)))
    piece = type(piece)(mesh, piece.supports, piece.light, piece.category, piece.family)
    foot = footprint(mesh)
    z = head + 0.04 - foot.high_m
    if z < 0.02:
        return
    f.try_at(piece, _at_window(side, (start + end) / 2, foot.depth_m), np.array([side.heading_rad]), z, zones=False)


def _radiator(f: Furnisher, side: Side, at_m: float, sill_m: float) -> bool:
    if (piece := f.new("radiator")) is None:
        return False
    foot = footprint(piece.mesh)
    z = draw(f.rng, 0.08, 0.14) if hangs(piece) else 0.0
    if z + foot.high_m > sill_m - 0.06 or foot.width_m / 2 > min(at_m, side.length_m - at_m):
        return False
    centre = _at_window(side, at_m, foot.depth_m + 0.02)
    return f.try_at(piece, centre, np.array([side.heading_rad]), z) is not None


def adorn(f: Furnisher) -> None:
    """Hang pictures, clocks, mirrors, shelves and the like on what is free of the walls."""
    rng = f.rng
    bare = 0.35 if f.kind in ("storage", "toilet", "bathroom", "laundry room", "copy room") else 1.0
    for _ in range(int(rng.poisson((0.5 + 0.09 * area_m2(f.ground.polygon)) * bare * f.fill))):
        f.stand("picture", among=wall_hung if chance(rng, 0.92) else on_floor_or_wall)
    shares = {"clock": 0.25, "mirror": 0.15, "wall shelf": 0.3, "air conditioner": 0.14, "lamp": 0.06, "plant": 0.03}
    for category, share in shares.items():
        among = None if category == "wall shelf" else wall_hung
        if chance(rng, share * (0.4 + 0.6 * bare)) and (piece := f.new(category, among)) is not None:
            low, high = {"clock": (1.5, 2.0), "air conditioner": (1.9, 2.4)}.get(category, (1.1, 1.6))
            f.hang(piece, (low, high))


def light_up(f: Furnisher, by_day: float) -> None:
    """Hang lamps from the ceiling and light the room by them, and by its windows.

    The light of the windows is ``by_day`` strong, 0 at night.
    """
    rng, size = f.rng, area_m2(f.ground.polygon)
    spots = _lamp_places(f, size)
    strength = draw(rng, 0.45, 0.9) * (0.35 if by_day > 0.5 else 1.0) * float(np.clip(np.sqrt(size / 14), 0.6, 1.6))
    warm = np.array([1.0, draw(rng, 0.84, 1.0), draw(rng, 0.66, 1.0)]) * strength / np.sqrt(len(spots))
    look = f.new("chandelier") if f.has_ceiling and chance(rng, 0.7) else None
    for place in spots:
        hung = f.from_ceiling(look, place) if look is not None else None
        z = f.floor_m + f.height_m - 0.12
        if hung is not None:
            z = min(z, f.floor_m + hung.place.z + hung.foot.low_m - 0.05)
        f.builder.lights.append(Light((float(place[0]), float(place[1]), z), tuple(warm.tolist())))
    if by_day <= 0:
        return
    for side in f.ground.sides:
        for start, end, sill, head in side.windows:
            at = side.a + (start + end) / 2 * side.along + 0.35 * side.inward
            sky = np.array([0.92, 0.97, 1.0]) * by_day * float(np.sqrt((end - start) * (head - sill)))
            z = f.floor_m + (sill + 2 * head) / 3
            f.builder.lights.append(Light((float(at[0]), float(at[1]), z), tuple(sky.tolist())))


def _lamp_places(f: Furnisher, size_m2: float) -> np.ndarray:
    centre = middle(f.ground.polygon)
    if size_m2 < 20:
        return centre[None] + f.rng.normal(0.0, 0.15, (1, 2))
    longest = max(f.ground.sides, key=lambda s: s.length_m)
    number = count(f.rng, 2, 3) if size_m2 < 45 else count(f.rng, 3, 6)
    step = longest.length_m / number
    return centre + np.outer((np.arange(number) - (number - 1) / 2) * step, longest.along)


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
    """Add stairs and railings to a scene. ``area`` is the hall that they start from."""
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
