"""Where doors and windows go: every room is reached, by way of halls where that can be."""

import heapq
from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, draw, pick
from avlmaps_sim.homes.plan import OUTSIDE, WELL, Hole, HoleKind, Room, Wall, inside

HUBS = ("hallway", "corridor", "entrance hall", "open-plan office", "reception")
SOCIAL = ("living room", "kitchen", "dining room")
_LEAST_DOOR_M = 1.15  # of a wall that can take a door
_OPEN_KINDS = (*SOCIAL, "hallway", "entrance hall", "kitchenette", "open-plan office", "reception", "corridor")


def _price(a: str, b: str) -> float:
    if WELL in (a, b):
        return 0.5 if "hallway" in (a, b) else np.inf
    if a in HUBS or b in HUBS:
        return 1.0
    if a in SOCIAL and b in SOCIAL:
        return 1.2
    if a in SOCIAL or b in SOCIAL:
        return 3.0
    if "bathroom" in (a, b) and "bedroom" in (a, b):
        return 5.0
    return 25.0 if "bathroom" in (a, b) or "toilet" in (a, b) else 9.0


def joined_up(
    rng: np.random.Generator, rooms: list[Room], walls: list[Wall], open_plan: float, patience: float = np.inf
) -> list[Wall] | None:
    """Put doors into the walls so that every room can be reached; None where that cannot be.

    Rooms of an open plan have no wall between them with a probability ``open_plan``; ``patience`` is how dear the path
    to a room may be (see `_price`).
    """
    start = min(range(len(rooms)), key=lambda i: (rooms[i].kind not in ("entrance hall", *HUBS), i))
    wanted = _tree(rooms, walls, start, patience)
    if wanted is None:
        return None
    out = list(walls)
    for index, wall in enumerate(walls):
        if wall.right == OUTSIDE:
            continue
        a, b = rooms[wall.left].kind, rooms[wall.right].kind
        if WELL in (a, b):
            out[index] = replace(wall, built="hallway" not in (a, b))
            continue
        if wall.length_m < _LEAST_DOOR_M or not _spots(wall, rooms, 0.95):
            continue
        both_social = a in SOCIAL and b in SOCIAL
        if both_social and chance(rng, open_plan):
            out[index] = _opened(rng, wall, rooms)
        elif index in wanted or (_price(a, b) <= 3.0 and chance(rng, 0.2)):
            if a in _OPEN_KINDS and b in _OPEN_KINDS and chance(rng, 0.3 + 0.3 * open_plan):
                out[index] = _opened(rng, wall, rooms)
            else:
                out[index] = wall.with_hole(_door(rng, wall, rooms, index in wanted))
    leaves: dict[int, list[np.ndarray]] = {}
    return [_swung_free(rooms, out, index, leaves) for index in range(len(out))]


def _tree(rooms: list[Room], walls: list[Wall], start: int, patience: float) -> set[int] | None:
    """Return the walls that need a door so that the path from the start to each room costs least."""
    best = {start: 0.0}
    through: dict[int, int] = {}
    queue = [(0.0, start)]
    while queue:
        cost, room = heapq.heappop(queue)
        if cost > best[room]:
            continue
        for index, wall in enumerate(walls):
            if room not in (wall.left, wall.right) or OUTSIDE in (wall.left, wall.right):
                continue
            other = wall.right if wall.left == room else wall.left
            kinds = rooms[room].kind, rooms[other].kind
            if WELL not in kinds and (wall.length_m < _LEAST_DOOR_M or not _spots(wall, rooms, 0.95)):
                continue
            price = cost + _price(*kinds)
            if price < best.get(other, np.inf):
                best[other], through[other] = price, index
                heapq.heappush(queue, (price, other))
    return set(through.values()) if len(best) == len(rooms) and max(best.values()) <= patience else None


def _spots(wall: Wall, rooms: list[Room], width_m: float) -> list[float]:
    """Return where the middle of a door can lie, so that one can stand before it on either side."""
    ends = (0.1 + width_m / 2, wall.length_m - 0.1 - width_m / 2)
    if ends[1] < ends[0]:
        return []
    along = np.linspace(*ends, 9)
    middles = wall.a + along[:, None] * wall.along
    good = np.ones(len(along), bool)
    for room, sign in ((wall.left, 1.0), (wall.right, -1.0)):
        for away in (0.3, 0.55, 0.8):
            slack = -0.42 if away > 0.5 else -0.28  # half a wall and a robot
            good &= inside(rooms[room].polygon, middles + sign * away * wall.to_left, slack)
    return along[good].tolist()


def _opened(rng: np.random.Generator, wall: Wall, rooms: list[Room]) -> Wall:
    ceiling = min(rooms[wall.left].height_m, rooms[wall.right].height_m)
    if chance(rng, 0.45) or wall.length_m < 1.7:
        return replace(wall, built=False)
    width = min(wall.length_m - 0.3, draw(rng, 1.2, 4.0))
    nearest = 0.15 + width / 2  # a gap as wide as the wall allows has one place, and rounding must not take it
    at = draw(rng, nearest, max(nearest, wall.length_m - 0.15 - width / 2))
    head = ceiling if chance(rng, 0.4) else min(draw(rng, 2.05, 2.5), ceiling - 0.1)
    return wall.with_hole(Hole("gap", at, width, 0.0, head))


def _door(rng: np.random.Generator, wall: Wall, rooms: list[Room], needed: bool) -> Hole:
    ceiling = min(rooms[wall.left].height_m, rooms[wall.right].height_m)
    width = min(draw(rng, 0.95, 1.1), wall.length_m - 0.2)
    wide = draw(rng, 1.9, 2.1)
    if chance(rng, 0.12) and _spots(wall, rooms, wide):
        width = wide
    if not _spots(wall, rooms, width):
        width = 0.95
    kind: HoleKind = pick(rng, ("door", "door", "door", "door", "doorless"))
    spots = _spots(wall, rooms, width)
    ends = (spots[0], spots[-1])
    at = pick(rng, spots) if chance(rng, 0.4) else pick(rng, ends)
    to_corner = 1 if at > wall.length_m / 2 else -1
    open_rad = draw(rng, 1.5, 1.6) if min(at - ends[0], ends[1] - at) < 0.5 else draw(rng, 1.5, 2.5)
    if not needed and chance(rng, 0.6):
        kind = pick(rng, ("closed door", "door", "folding door") if width > 1.2 else ("closed door", "door"))
        open_rad = draw(rng, 0.1, 1.3)
    left_kind, right_kind = rooms[wall.left].kind, rooms[wall.right].kind
    into_left = left_kind not in HUBS and (right_kind in HUBS or chance(rng, 0.5))
    head = min(draw(rng, 2.0, 2.2), ceiling - 0.12)
    return Hole(kind, at, width, 0.0, head, open_rad, into_left, to_corner)


def _swung_free(rooms: list[Room], walls: list[Wall], index: int, leaves: dict[int, list[np.ndarray]]) -> Wall:
    wall = walls[index]
    holes = []
    for hole in wall.holes:
        if hole.kind == "door":
            sides = (hole.to_left, not hole.to_left)
            swings = [replace(hole, to_left=side, hinge=h) for side in sides for h in (hole.hinge, -hole.hinge)]
            free = [swing for swing in swings if _leaf_is_free(rooms, walls, index, swing, leaves)]
            hole = free[0] if free else replace(hole, kind="doorless")
            if free:
                leaves.setdefault(wall.left if hole.to_left else wall.right, []).append(_leaf_places(wall, hole))
        holes.append(hole)
    return replace(wall, holes=tuple(holes))


def _leaf_places(wall: Wall, hole: Hole) -> np.ndarray:
    into = wall.to_left if hole.to_left else -wall.to_left
    wide = hole.width_m > 1.2
    reach = hole.width_m / 2 if wide else hole.width_m
    places = []
    for hinge in (1, -1) if wide else (hole.hinge,):
        foot = wall.at(hole.at_m + hinge * hole.width_m / 2)
        way = -hinge * np.cos(hole.open_rad) * wall.along + np.sin(hole.open_rad) * into
        places += [foot + share * reach * way for share in (0.25, 0.5, 0.75, 1.0)]
    return np.array(places)


def _leaf_is_free(
    rooms: list[Room], walls: list[Wall], index: int, hole: Hole, leaves: dict[int, list[np.ndarray]]
) -> bool:
    wall = walls[index]
    room = wall.left if hole.to_left else wall.right
    polygon, places = rooms[room].polygon, _leaf_places(wall, hole)
    if not inside(polygon, places[-1:], -0.08).all() or not inside(polygon, places, -0.03).all():
        return False
    for end in range(3, len(places), 4):
        tip, way = places[end], (places[end] - places[end - 1]) / np.linalg.norm(places[end] - places[end - 1])
        halfway = places[end - 2]  # this is far enough from its own wall that another wall is near it or none
        beside_wall = not inside(polygon, halfway, -0.35) and not inside(polygon, tip, -0.35)
        if not beside_wall and not inside(polygon, tip + 0.5 * way, -0.45):
            return False
    for other in leaves.get(room, []):
        if np.min(np.linalg.norm(places[:, None] - other[None], axis=2)) < 1.0:
            return False
    for number, other in enumerate(walls):
        if number == index or room not in (other.left, other.right):
            continue
        spans = [(h.at_m, h.width_m / 2) for h in other.holes if h.kind not in ("window", "closed door")]
        spans += [] if other.built else [(other.length_m / 2, 0.5)]
        for at, half in spans:
            away = np.abs((places - other.at(at)) @ other.to_left)
            along = np.abs((places - other.at(at)) @ other.along)
            if np.any((away < 0.85) & (along < half + 0.1)):
                return False
    return True


def lit_by_day(rng: np.random.Generator, rooms: list[Room], walls: list[Wall], has_entrance: bool = True) -> list[Wall]:
    """Put windows into outer walls, and one closed door to the outside where the floor has the entrance."""
    entrance = _entrance(rng, rooms, walls) if has_entrance else -1
    style = draw(rng, 0.0, 0.9), draw(rng, 0.7, 1.1), pick(rng, (0.5, 0.7, 0.9))
    out = []
    for index, wall in enumerate(walls):
        if wall.right != OUTSIDE or wall.length_m < 0.9:
            out.append(wall)
            continue
        room = rooms[wall.left]
        if index == entrance:
            width = min(draw(rng, 0.88, 1.05), wall.length_m - 0.25)
            at = draw(rng, 0.12 + width / 2, wall.length_m - 0.12 - width / 2)
            out.append(wall.with_hole(Hole("closed door", at, width, 0.0, min(2.1, room.height_m - 0.15))))
            continue
        out.append(_with_windows(rng, wall, room, style))
    return out


def _entrance(rng: np.random.Generator, rooms: list[Room], walls: list[Wall]) -> int:
    outer = [i for i, wall in enumerate(walls) if wall.right == OUTSIDE and wall.length_m > 1.2]
    order = ("entrance hall", "reception", "hallway", "corridor", "living room", "kitchen")
    rank = {kind: number for number, kind in enumerate(order)}
    return min(outer, key=lambda i: (rank.get(rooms[walls[i].left].kind, 9), rng.random())) if outer else -1


def _with_windows(rng: np.random.Generator, wall: Wall, room: Room, style: tuple[float, float, float]) -> Wall:
    low_sill, sill, share = style
    if room.kind in ("storage", WELL) or not chance(rng, 0.35 if room.kind in HUBS else share):
        return wall
    if room.kind in ("bathroom", "toilet", "laundry room"):
        sizes = (0.5, 0.9, draw(rng, 1.1, 1.5))
    elif room.kind in ("kitchen", "kitchenette"):
        sizes = (0.7, 1.8, draw(rng, 1.07, 1.2))  # over the counters
    elif chance(rng, low_sill * 0.4):
        sizes = (1.2, 3.2, pick(rng, (0.03, 0.25, 0.45)))
    else:
        sizes = (0.7, 2.2, sill)
    head = min(max(draw(rng, 2.05, 2.3), sizes[2] + 0.6), room.height_m - 0.15)
    number = 1 if wall.length_m < 3.5 else int(rng.integers(1, 2 + int(wall.length_m / 3.5)))
    each = wall.length_m / number
    width = min(draw(rng, sizes[0], sizes[1]), each - 0.4)
    if width < 0.45 or head - sizes[2] < 0.4:
        return wall
    for k in range(number):
        slack = max(each - width - 0.4, 0.0)
        at = (k + 0.5) * each + slack * draw(rng, -0.4, 0.4)
        wall = wall.with_hole(Hole("window", at, width, sizes[2], head))
    return wall
