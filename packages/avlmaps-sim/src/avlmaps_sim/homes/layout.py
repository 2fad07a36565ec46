"""Which rooms a floor has, and how it is divided: outlines cut again and again by lines in their proportions."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, pick
from avlmaps_sim.homes.plan import WELL, WELL_LENGTH_M, Room, area_m2, half, middle, rectangle, widths_m

Polygon = Float[np.ndarray, "k 2"]
Programme = list[tuple[str, float]]  # kinds of room and the area each should have, m²; neighbours stand together

LEAST_WIDTH_M = {"hallway": 1.15, "entrance hall": 1.3, "storage": 1.3, "toilet": 1.2, "bathroom": 1.6,
                 "laundry room": 1.6, "copy room": 1.6, "corridor": 1.4, "kitchen": 2.0, "bedroom": 2.4,
                 "living room": 2.8, WELL: 2.1, "dining room": 2.4, "kitchenette": 1.8}  # fmt: skip
_PASSAGES = ("hallway", "corridor", "entrance hall")


def cut(polygon: Polygon, share: float, direction: Float[np.ndarray, "2"]) -> tuple[Polygon, Polygon]:
    """Cut a convex polygon by a line across a direction, so that the first part has a share of the area."""
    reach = (polygon @ direction).tolist()
    across = (polygon @ np.array([-direction[1], direction[0]])).tolist()
    sides = list(zip(reach, across, reach[1:] + reach[:1], across[1:] + across[:1], strict=True))
    goal, done = share * area_m2(polygon), 0.0
    levels = sorted(reach)
    at = levels[-1]
    for low, high in pairwise(levels):
        if high - low < 1e-9:
            continue
        # Between two corners the width changes evenly: widths a little inside both ends determine it.
        near, far = (_width_at(sides, low + f * (high - low)) for f in (0.001, 0.999))
        slab = 0.5 * (near + far) * (high - low)
        if done + slab >= goal:
            slope = (far - near) / (high - low)
            need = goal - done
            step = need / near if abs(slope) < 1e-9 else (np.sqrt(max(near**2 + 2 * slope * need, 0.0)) - near) / slope
            at = low + float(step)
            break
        done += slab
    return half(polygon, at * direction, direction), half(polygon, at * direction, -direction)


def _width_at(sides: list[tuple[float, float, float, float]], level: float) -> float:
    crossing = [y0 + (level - x0) / (x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in sides if (x0 < level) != (x1 < level)]
    return max(crossing) - min(crossing) if crossing else 0.0


class _Unsound(Exception):  # noqa: N818
    """A room came out too narrow: the layout is drawn again. Never leaves this module."""


def divided(
    rng: np.random.Generator, polygon: Polygon, programme: Programme, slant: float, strict: bool = True
) -> list[tuple[str, Polygon]]:
    """Divide a convex polygon among a programme.

    Only the proportions of the areas count. A cut is not at right angles to the sides with a probability ``slant``;
    ``strict`` gives up at the first room that is not sound.
    """
    if len(programme) == 1:
        room = (programme[0][0], polygon)
        if strict and not sound([room]):
            raise _Unsound
        return [room]
    sizes = np.array([size for _, size in programme])
    share = np.cumsum(sizes)[:-1] / sizes.sum()
    weight = np.exp(-(((share - 0.5) / 0.16) ** 2)) + 1e-3
    at = int(rng.choice(len(share), p=weight / weight.sum()))
    direction = _long_way(polygon) if not chance(rng, 0.08) else _long_way(polygon)[::-1] * (1, -1)
    if chance(rng, slant):
        turn = draw(rng, 0.06, 0.26) * (1 if chance(rng, 0.5) else -1)
        c, s = np.cos(turn), np.sin(turn)
        direction = np.array([c * direction[0] - s * direction[1], s * direction[0] + c * direction[1]])
    if chance(rng, 0.5):
        direction = -direction
    first, second = cut(polygon, float(share[at]), direction)
    return divided(rng, first, programme[: at + 1], slant, strict) + divided(
        rng, second, programme[at + 1 :], slant, strict
    )


def along_corridor(
    rng: np.random.Generator, polygon: Polygon, programme: Programme, slant: float, corridor: str, stairs: bool = False
) -> list[tuple[str, Polygon]]:
    """Divide a polygon by a corridor along its middle, with rooms on both sides and sometimes one at its end."""
    way = _long_way(polygon)
    if chance(rng, 0.5):
        way = -way
    side = np.array([-way[1], way[0]])
    rooms = list(programme)
    total = sum(size for _, size in rooms)
    out: list[tuple[str, Polygon]] = []
    if chance(rng, 0.55) and len(rooms) > 3 + 2 * stairs:  # the largest neighbours take one end, from wall to wall
        group = 1 if chance(rng, 0.5) else 2
        end, rooms = rooms[:group], rooms[group:]
        taken = sum(size for _, size in end) / total
        head, polygon = cut(polygon, min(taken, 0.6), way)
        out += divided(rng, head, end, slant)
    depth = float(np.ptp(polygon @ side))
    width = draw(rng, 2.2, 2.5) if stairs else draw(rng, 1.25, 2.0) if corridor == "hallway" else draw(rng, 1.5, 2.6)
    first_share = draw(rng, 0.38, 0.62) * (1 - width / depth)
    lower, rest = cut(polygon, first_share, side)
    middle_part, upper = cut(rest, width / depth / (1 - first_share), side)
    if stairs:
        share = 1 - WELL_LENGTH_M / float(np.ptp(middle_part @ way))
        if share < 0.3:
            return []
        middle_part, well = cut(middle_part, share, way)
        out.append((WELL, well))
    out.append((corridor, middle_part))
    split = _index_of_share(rooms, first_share / (1 - width / depth))
    for part, some in ((lower, rooms[:split]), (upper, rooms[split:])):
        out += divided(rng, part, some, slant)
    return out


def _index_of_share(rooms: Programme, share: float) -> int:
    sizes = np.cumsum([size for _, size in rooms])
    return int(np.clip(np.argmin(np.abs(sizes / sizes[-1] - share)) + 1, 1, len(rooms) - 1))


def outlines(rng: np.random.Generator, size_m2: float, shape: str) -> list[Polygon]:
    """Return the convex parts of an outline: one rectangle, two of an L or a T; sometimes with a corner cut off."""
    if shape == "rectangle":
        aspect = draw(rng, 1.0, 1.9)
        wide = float(np.sqrt(size_m2 * aspect))
        part = rectangle(0.0, 0.0, wide, size_m2 / wide)
        return [_without_corner(rng, part)] if chance(rng, 0.25) else [part]
    share = draw(rng, 0.5, 0.72)
    wide = float(np.sqrt(size_m2 * share * draw(rng, 1.3, 2.2)))
    deep = size_m2 * share / wide
    wing_wide = wide * draw(rng, 0.4, 0.6)
    wing_deep = size_m2 * (1 - share) / wing_wide
    start = 0.0 if shape == "L" else (wide - wing_wide) * draw(rng, 0.25, 0.75)
    parts = [rectangle(0.0, 0.0, wide, deep), rectangle(start, deep, start + wing_wide, deep + wing_deep)]
    if chance(rng, 0.5):
        parts = [np.ascontiguousarray((p * (-1.0, 1.0))[::-1]) for p in parts]
    return parts


def _without_corner(rng: np.random.Generator, polygon: Polygon) -> Polygon:
    corner = polygon[count(rng, 0, 3)]
    inward = middle(polygon) - corner
    inward /= np.linalg.norm(inward)
    turn = draw(rng, -0.35, 0.35)
    c, s = np.cos(turn), np.sin(turn)
    outward = -np.array([c * inward[0] - s * inward[1], s * inward[0] + c * inward[1]])
    return half(polygon, corner - outward * draw(rng, 1.0, 2.2), outward)


def sound(rooms: list[tuple[str, Polygon]]) -> bool:
    """Return whether every room is wide enough for its kind and none is a strip."""
    for kind, polygon in rooms:
        if len(polygon) < 3 or np.min(np.hypot(*(polygon - polygon[[*range(1, len(polygon)), 0]]).T)) < 0.5:
            return False
        least, most = widths_m(polygon)
        longest = 9.0 if kind in _PASSAGES else 2.6
        if least < LEAST_WIDTH_M.get(kind, 2.2) or most > longest * least:
            return False
    return True


def floor_of(
    rng: np.random.Generator,
    programme: Programme,
    corridor: str = "hallway",
    slanted: float = 0.12,
    stairs: bool = False,
) -> list[tuple[str, Polygon]]:
    """Lay out a floor: draw an outline and divide it, again until every room is sound.

    A passage in the programme is a room like others where no corridor is cut; a share ``slanted`` of the cuts is not at
    right angles.
    """
    slant = slanted if chance(rng, 0.4) and not stairs else 0.0
    size = sum(area for _, area in programme)
    for attempt in range(200):
        try:
            rooms = _attempt(rng, programme, corridor, slant, stairs, 0.6 if attempt < 100 else 0.3)
        except _Unsound:
            continue
        if stairs and (not any(kind == WELL and len(p) == 4 for kind, p in rooms)):
            continue
        if sound(rooms) and any(kind in _PASSAGES or len(rooms) < 6 for kind, _ in rooms):
            return rooms
    if stairs:
        return floor_of(rng, programme, corridor, slanted)
    outline = rectangle(0.0, 0.0, np.sqrt(size) * 1.2, np.sqrt(size) / 1.2)
    return divided(rng, outline, programme, 0.0, strict=False)


def _attempt(
    rng: np.random.Generator, programme: Programme, corridor: str, slant: float, stairs: bool, corridors: float
) -> list[tuple[str, Polygon]]:
    """Draw an outline and divide it once; ``corridors`` is the probability of cutting a corridor."""
    size = sum(area for _, area in programme)
    inner = [room for room in programme if room[0] not in _PASSAGES]
    shape = pick(rng, ("rectangle", "rectangle", "L", "T")) if size > 60 and not stairs else "rectangle"
    parts = outlines(rng, size, shape)
    use_corridor = stairs or (len(inner) >= 4 and chance(rng, corridors))
    rooms: list[tuple[str, Polygon]] = []
    left = inner if use_corridor else list(programme)
    for number, part in enumerate(parts):
        last = number == len(parts) - 1
        split = len(left) if last else _index_of_share(left, area_m2(part) / size)
        mine, left = left[:split], left[split:]
        if not mine:
            break
        if use_corridor and len(mine) >= 3:
            rooms += along_corridor(rng, part, mine, slant, corridor, stairs)
        else:
            rooms += divided(rng, part, mine, slant)
    return rooms


def _long_way(polygon: Polygon) -> Float[np.ndarray, "2"]:
    along = polygon[[*range(1, len(polygon)), 0]] - polygon
    length = np.hypot(along[:, 0], along[:, 1])
    along = along[length > 0.45 * length.max()]  # a corner cut off does not turn the rooms
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    return along[int(np.argmax(np.ptp(polygon @ along.T, axis=0)))]


# Kind of room: least and greatest area, m².
_SIZE_M2 = {"living room": (16, 34), "kitchen": (8, 15), "dining room": (9, 18), "bedroom": (10, 19),
            "bathroom": (4.5, 9),
            "hallway": (5, 11), "entrance hall": (4, 9), "office": (8, 14), "laundry room": (4, 8), "storage": (3, 7),
            "children's room": (9, 15), "gym": (10, 20), "open-plan office": (30, 90), "corridor": (8, 16),
            "meeting room": (12, 28), "kitchenette": (7, 12), "toilet": (3, 6), "reception": (10, 22),
            "copy room": (5, 9)}  # fmt: skip
_EXTRA = ("bedroom", "children's room", "office", "dining room", "storage", "laundry room", "bathroom", "gym",
          "entrance hall",
          "bedroom", "office", "children's room", "dining room", "gym", "storage")  # fmt: skip
_ORDER = ("kitchen", "dining room", "living room", "entrance hall", "hallway", "office", "storage", "laundry room",
          "bathroom", "bedroom", "children's room", "gym")  # fmt: skip
_MOST = {"dining room": 1, "gym": 1, "storage": 2, "laundry room": 1, "entrance hall": 1}


def home_programme(rng: np.random.Generator, most_m2: float = 215.0) -> Programme:
    """Draw the rooms of a home of 40 to 220 m² (or as large as is said) and their areas."""
    wanted = min(draw(rng, 42, 120) if chance(rng, 0.7) else draw(rng, 110, 215), most_m2)
    stretch = draw(rng, 0.85, 1.25)
    kinds = ["living room", "kitchen", "bathroom", "bedroom", "hallway"]
    rooms = [(kind, draw(rng, *_SIZE_M2[kind]) * stretch) for kind in kinds]
    if chance(rng, 0.12) and wanted > 90:  # one very large room
        rooms[0] = ("living room", draw(rng, 40, 75))
    for kind in rng.permutation(np.array(_EXTRA, dtype=object)).tolist():
        size = draw(rng, *_SIZE_M2[kind]) * stretch
        enough = sum(k == kind for k, _ in rooms) >= _MOST.get(kind, 3)
        if not enough and sum(area for _, area in rooms) + size <= wanted:
            rooms.append((kind, size))
    order = {kind: k + rng.normal(0.0, 0.8) for k, kind in enumerate(_ORDER)}
    rooms.sort(key=lambda room: order[room[0]])
    total = sum(area for _, area in rooms)
    return rooms if total > 40 else [(kind, area * 41 / total) for kind, area in rooms]


def upstairs(rng: np.random.Generator, rooms: Sequence[Room], floor_m: float, height_m: float) -> list[Room]:
    """Return the rooms of an upper floor, each over one of the same outline; hall and stairs lie above theirs."""
    out = []
    free = [room for room in rooms if room.kind not in ("hallway", WELL)]
    smallest = min(free, key=lambda room: area_m2(room.polygon))
    for room in rooms:
        size = area_m2(room.polygon)
        kind = room.kind
        if room is smallest:
            kind = "bathroom"
        elif kind not in ("hallway", WELL) and size < 8:
            kind = pick(rng, ("bathroom", "storage", "laundry room", "office"))
        elif kind not in ("hallway", WELL):
            kind = pick(rng, ("bedroom", "bedroom", "children's room", "office", "gym" if size > 12 else "bedroom"))
        out.append(Room(kind, room.polygon, floor_m, height_m))
    return out


def office_programme(rng: np.random.Generator) -> Programme:
    """Draw the rooms of an office of 70 to 250 m² and their areas."""
    kinds = ["open-plan office", "corridor", "toilet", pick(rng, ("kitchenette", "kitchen"))]
    for kind, share in (("meeting room", 0.9), ("reception", 0.8), ("copy room", 0.6), ("office", 0.7), ("office", 0.5),
                        ("meeting room", 0.4), ("open-plan office", 0.3), ("toilet", 0.5), ("storage", 0.4),
                        ("office", 0.3)):  # fmt: skip
        if chance(rng, share):
            kinds.append(kind)
    rooms = [(kind, draw(rng, *_SIZE_M2[kind])) for kind in kinds]
    order = {kind: rng.normal() for kind in kinds}
    rooms.sort(key=lambda room: order[room[0]])
    return rooms
