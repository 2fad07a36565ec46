"""Which rooms a home or an office has, and how large each is."""

from collections.abc import Sequence

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, draw, pick
from avlmaps_sim.homes.layout import Programme
from avlmaps_sim.homes.plan import WELL, Room
from avlmaps_sim.homes.polygons import area_m2

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
