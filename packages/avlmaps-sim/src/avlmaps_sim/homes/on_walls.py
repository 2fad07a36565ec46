"""Things on walls and ceilings: curtains and blinds, radiators, pictures, clocks, lamps."""

import numpy as np

from avlmaps_sim.furniture.drapes import curtain
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw
from avlmaps_sim.homes.furnish import Furnisher, footprint, hangs, on_floor_or_wall, wall_hung
from avlmaps_sim.homes.placing import Side
from avlmaps_sim.homes.polygons import area_m2, middle
from avlmaps_sim.scene import Light

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
