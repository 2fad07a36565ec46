"""What a building holds, as a path of small answers for agents: building, floors, rooms, and the things of a room."""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

from avlmaps.core.poses import FRAME
from avlmaps.query.schema import SoundAnswer
from avlmaps.query.selection import Selected, Wanted, page_of, selected, things_with_rooms
from avlmaps.query.unknown_names import unknown_note
from avlmaps.query.whereabouts import Whereabouts
from avlmaps.serve.errors import RequestError
from avlmaps.serve.requests import Words
from avlmaps.serve.work import WorkInput, lists_of

Confidence = Annotated[float, Meta(ge=0.0, le=1.0)]
Top = Annotated[int, Meta(ge=1, le=50)]
Page = Annotated[int, Meta(ge=1)]
Place = Annotated[str | list[float], Meta(description="x,y,z")]
PlaceOrName = Annotated[str | list[float] | None, Meta(description="x,y,z or a thing's name: nearest first")]
Names = str | list[Words]
_MOST_KINDS = 12
_MOST_HEARD = 2


class ListThingsQuery(Struct, forbid_unknown_fields=True):
    """Which things are listed."""

    room: Annotated[Words | None, Meta(description="one, or all of a kind")] = None
    near: PlaceOrName = None
    name: Names = []
    least: Confidence = 0.5
    top: Top = 10
    page: Page = 1
    structure: Annotated[bool, Meta(description="walls and floors too")] = False
    picture: bool = False


class ListRoomsQuery(Struct, forbid_unknown_fields=True):
    """Which rooms are listed."""

    floor: Annotated[int | None, Meta(description="0 is the lowest")] = None
    name: Names = []
    least: Confidence = 0.0
    top: Top = 10
    page: Page = 1
    picture: bool = False


class ListSoundsQuery(Struct, forbid_unknown_fields=True):
    """Which sounds are listed."""

    name: Names = []
    top: Top = 10
    page: Page = 1
    picture: bool = False


class MapQuery(Struct, forbid_unknown_fields=True):
    """A whole map."""

    picture: bool = False


def describe_building(task: WorkInput, query: MapQuery) -> dict[str, Any]:
    """Return the floors with their rooms, and how many things of each name there are."""
    del query
    avlmap, lists = task.map.avlmap, lists_of(task)
    where, things = lists.where, lists.things()
    floors = where.floors_of(_places([room.position for room in where.rooms]))
    thing_floors = where.floors_of(_places([thing["position"] for thing in things]))
    level = avlmap.space.level(avlmap.points) if len(avlmap.space) else np.zeros((1, 3))
    return {
        "map": task.map.name,
        "frame": FRAME,
        "size_m": [round(float(side), 1) for side in np.ptp(level, axis=0)],
        "floors": [
            {
                "floor": floor,
                "rooms": dict(Counter(where.rooms[k].name for k in np.flatnonzero(floors == floor)).most_common()),
                "things": int((thing_floors == floor).sum()),
            }
            for floor in range(where.floor_count)
        ],
        "things": len(things),
        "names": _kinds(things),
        "sounds": _kinds([{"name": _first_name(sound)} for sound in lists.sounds()]),
    }


def list_things(task: WorkInput, query: ListThingsQuery) -> dict[str, Any]:
    """Return the things of a room, or near a place, or of a name; a page of them.

    Raises:
        QueryError: there is no such room, or no such thing to be near to.
    """
    lists = lists_of(task)
    where, names = lists.where, _names(query.name)
    unknown = [name for name in names if not task.map.avlmap.knows(name)]
    known = [name for name in names if name not in unknown]
    wanted = Wanted(least=query.least, name=known, structure=query.structure, room=query.room, near=query.near)
    chosen, near = selected(lists, wanted) if known or not names else ([], None)
    about: dict[str, Any] = {"near": near}
    rows = [_thing_row(one, where) for one in chosen]
    if unknown:
        about["note"] = unknown_note(unknown[0])
    if not names and len(rows) > query.top:
        about["names"] = _kinds(rows)
    return _paged(task, "things", rows, query.top, query.page) | about


def list_rooms(task: WorkInput, query: ListRoomsQuery) -> dict[str, Any]:
    """Return the rooms of a floor, each with the number of things in it; a page of them."""
    lists = lists_of(task)
    where = lists.where
    count = Counter(one.room for one in things_with_rooms(lists, Wanted()))
    floors = where.floors_of(_places([room.position for room in where.rooms]))
    if query.floor is not None and not 0 <= query.floor < where.floor_count:
        raise RequestError(f"There is no floor {query.floor}; the map has {where.floor_count}, counted from 0.")
    wanted = range(len(where.rooms))
    if names := _names(query.name):
        known = {room.name.casefold() for room in where.rooms} | {name.casefold() for name in where.names}
        wanted = sorted({k for name in names if name.casefold() in known for k in where.numbers_of(name)})
    rows = [
        {
            "room": where.names[k],
            "name": where.rooms[k].name,
            "confidence": where.rooms[k].confidence,
            "area_m2": where.rooms[k].area_m2,
            "position": list(where.rooms[k].position),
            "things": count[k],
            **({"floor": int(floors[k])} if where.floor_count > 1 else {}),
        }
        for k in wanted
        if where.rooms[k].confidence >= query.least and query.floor in (None, int(floors[k]))
    ]
    return _paged(task, "rooms", rows, query.top, query.page)


def list_sounds(task: WorkInput, query: ListSoundsQuery) -> dict[str, Any]:
    """Return the sounds with their likeliest names, times and places; a page of them."""
    lists, names = lists_of(task), {name.casefold() for name in _names(query.name)}
    where, sounds = lists.where, lists.sounds()
    rooms = where.rooms_of(_places([sound["position"] for sound in sounds]))
    rows = [
        {
            "name": _first_name(sound),
            "confidence": sound["confidences"][0] if sound["confidences"] else None,
            "onset_s": sound["onset_s"],
            "offset_s": sound["offset_s"],
            "position": sound["position"],
            "room": where.names[room] if room >= 0 else None,
        }
        for sound, room in zip(sounds, rooms.tolist(), strict=True)
        if not names or _first_name(sound).casefold() in names
    ]
    return _paged(task, "sounds", rows, query.top, query.page)


def _thing_row(one: Selected, where: Whereabouts) -> dict[str, Any]:
    return {
        "name": one.thing["name"],
        "confidence": one.thing["confidence"],
        "position": one.thing["position"],
        "size": one.thing["size"],
        "room": where.names[one.room] if one.room >= 0 else None,
        "distance_m": one.away_m,
        "heard": one.thing.get("heard", [])[:_MOST_HEARD] or None,
    }


def _paged(task: WorkInput, key: str, rows: list[dict[str, Any]], top: int, page: int) -> dict[str, Any]:
    shown, pages = page_of(rows, top, page, key)
    paging = {"page": page, "pages": pages} if pages > 1 else {}
    return {"map": task.map.name, "frame": FRAME, "total": len(rows), **paging, key: shown}


def _kinds(rows: Sequence[Any]) -> dict[str, int]:
    """Return how often each name occurs, the most common first; ``other names`` counts the rest."""
    ordered = Counter(row["name"] for row in rows).most_common()
    rest = sum(count for _, count in ordered[_MOST_KINDS:])
    return dict(ordered[:_MOST_KINDS]) | ({"other names": rest} if rest else {})


def _names(name: str | list[str]) -> list[str]:
    return [name] if isinstance(name, str) and name.strip() else list(name) if isinstance(name, list) else []


def _first_name(sound: SoundAnswer) -> str:
    return sound["names"][0] if sound["names"] else "sound"


def _places(positions: Sequence[Sequence[float]]) -> Float[np.ndarray, "m 3"]:
    return np.array(positions, np.float64).reshape(-1, 3)
