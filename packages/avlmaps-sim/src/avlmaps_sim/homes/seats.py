"""Chairs at tables: pushed in under the top or drawn out, each looking at its table."""

import numpy as np

from avlmaps_sim.furniture import Piece
from avlmaps_sim.furniture.recipe_helpers import chance, draw
from avlmaps_sim.homes.furnish import Furnisher, PlacedPiece, footprint
from avlmaps_sim.homes.placing import Footprint
from avlmaps_sim.mesh import Mesh

_LEGS_BELOW_M = 0.35


def push_in_m(chair: Mesh, table: Mesh) -> float:
    """Return how far a chair can go under a table before its back or its arms meet the top."""
    under = float(table.high[2]) - 0.09
    high = chair.vertex[chair.vertex[:, 2] > under - 0.02]
    reach = float(high[:, 0].max()) if len(high) else float(chair.low[0]) + 0.1
    return float(np.clip(chair.high[0] - reach - 0.03, 0.0, 0.45))


def meets_legs(table: PlacedPiece, foot: Footprint, centre: np.ndarray, heading_rad: float) -> bool:
    """Return whether a leg of the table would stand within the box of a chair."""
    mesh = table.piece.mesh
    legs = table.to_world(mesh.vertex[mesh.vertex[:, 2] < _LEGS_BELOW_M][:, :2].astype(np.float64))
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    away = legs - centre
    x, y = c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]
    return bool(np.any((np.abs(x) < foot.half[0] + 0.01) & (np.abs(y) < foot.half[1] + 0.01)))


def _seat_places(table: PlacedPiece, width_m: float) -> list[tuple[float, float, float]]:
    """Return places (x, y, heading) along the four edges of a table, in its own frame."""
    half_x, half_y = table.foot.half
    out = []
    for sign in (1.0, -1.0):
        for half_a, half_b, turned in ((half_y, half_x, False), (half_x, half_y, True)):
            number = int(2 * half_a / (width_m + 0.08))
            for k in range(max(number, 1 if half_a > 0.3 else 0)):
                at = (k + 0.5) / max(number, 1) * 2 * half_a - half_a
                place = (
                    (at, sign * half_b, -sign * np.pi / 2)
                    if turned
                    else (sign * half_b, at, np.pi if sign > 0 else 0.0)
                )
                out.append(place)
    return out


def seat_round(f: Furnisher, table: PlacedPiece, piece: Piece, number: int, all_sides: bool = True) -> int:
    """Stand chairs of one kind round a table; return how many found a place.

    They stand ``all_sides`` round it, or only at its front.
    """
    foot = footprint(piece.mesh)
    places = _seat_places(table, foot.width_m)
    if not all_sides:
        places = [place for place in places if place[2] == np.pi and place[0] > 0]
    f.rng.shuffle(places)
    done = 0
    tidy = chance(f.rng, 0.5)
    for x, y, heading in places:
        if done >= number:
            break
        deepest = push_in_m(piece.mesh, table.piece.mesh)
        outs = [draw(f.rng, -deepest, 0.02) if tidy or chance(f.rng, 0.6) else draw(f.rng, 0.02, 0.4), 0.02, 0.2]
        done += any(_sit(f, table, piece, foot, (x, y, heading), out, tidy) for out in outs)
    return done


def _sit(f: Furnisher, table: PlacedPiece, piece: Piece, foot: Footprint, place: tuple[float, float, float],
         out_m: float, tidy: bool) -> bool:  # fmt: skip
    x, y, heading = place
    turn = 0.0 if tidy and chance(f.rng, 0.7) else float(f.rng.normal(0.0, 0.05 if out_m < 0 else 0.3))
    toward = np.array([np.cos(heading), np.sin(heading)])
    centre = table.to_world(table.foot.middle + np.array([x, y]) - (out_m + foot.half[0] + 0.01) * toward)
    way = table.place.heading_rad + heading + turn
    if out_m < 0 and meets_legs(table, foot, centre, way):
        return False
    except_for = table.number if out_m < 0 else -1
    return f.try_at(piece, centre[None], np.array([way]), zones=False, except_for=except_for) is not None
