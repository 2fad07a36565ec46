"""What a building holds, as a path of small answers for agents: building, floors, rooms, and the things of a room."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

from avlmaps.core.errors import QueryError
from avlmaps.core.poses import FRAME
from avlmaps.query.schema import SoundAnswer, ThingAnswer
from avlmaps.query.unknown_names import unknown_note
from avlmaps.query.whereabouts import Whereabouts
from avlmaps.serve import work
from avlmaps.serve.errors import RequestError
from avlmaps.serve.requests import NoQuery, ThingsQuery, Words, place_of
from avlmaps.serve.shelf import ServedMap
from avlmaps.serve.work import Task

Confidence = Annotated[float, Meta(ge=0.0, le=1.0)]
Top = Annotated[int, Meta(ge=1, le=50)]
Page = Annotated[int, Meta(ge=1)]
Place = Annotated[str | list[float], Meta(description="x,y,z")]
PlaceOrName = Annotated[str | list[float] | None, Meta(description="x,y,z or a thing's name: nearest first")]
Names = str | list[Words]
_MOST_KINDS = 12


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


def whereabouts(served: ServedMap) -> Whereabouts:
    """Return the floors and rooms of a map, found once."""
    return served.once("whereabouts", lambda: Whereabouts.of(served.avlmap))


def describe_building(task: Task, query: MapQuery) -> dict[str, Any]:
    """Return the floors with their rooms, and how many things of each name there are."""
    del query
    avlmap, where = task.map.avlmap, whereabouts(task.map)
    things, thing_rooms = _things(task, ThingsQuery())
    floors = where.floors_of(_places([room.position for room in where.rooms]))
    thing_floors = where.floors_of(_places([thing["position"] for thing in things]))
    del thing_rooms
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
        "sounds": _kinds([{"name": _first_name(sound)} for sound in work.list_sounds(task, NoQuery())["sounds"]]),
    }


def list_things(task: Task, query: ListThingsQuery) -> dict[str, Any]:
    """Return the things of a room, or near a place, or of a name; a page of them.

    Raises:
        QueryError: there is no such room, or no such thing to be near to.
    """
    where = whereabouts(task.map)
    names = _names(query.name)
    unknown = [name for name in names if not task.map.avlmap.knows(name)]
    known = [name for name in names if name not in unknown]
    wanted_things = ThingsQuery(least=query.least, name=known, structure=query.structure)
    things, rooms = _things(task, wanted_things) if known or not names else ([], [])
    chosen = list(range(len(things)))
    if query.room is not None:
        wanted = set(where.numbers_of(query.room))
        chosen = [k for k in chosen if rooms[k] in wanted]
    about: dict[str, Any] = {}
    away: dict[int, float] = {}
    if query.near is not None:
        place, about["near"], itself = _near(task, query.near)
        away = {k: _away(task.map, things[k], place) for k in chosen if things[k]["position"] != itself}
        chosen = sorted(away, key=lambda k: away[k])
    rows = [_thing_row(things[k], where, rooms[k], away.get(k)) for k in chosen]
    if unknown:
        about["note"] = unknown_note(unknown[0])
    if not names and len(rows) > query.top:
        about["names"] = _kinds(rows)
    return _paged(task, "things", rows, query.top, query.page) | about


def list_rooms(task: Task, query: ListRoomsQuery) -> dict[str, Any]:
    """Return the rooms of a floor, each with the number of things in it; a page of them."""
    where = whereabouts(task.map)
    _, thing_rooms = _things(task, ThingsQuery())
    count = Counter(thing_rooms)
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
            "position": list(where.rooms[k].position),
            "things": count[k],
            **({"floor": int(floors[k])} if where.floor_count > 1 else {}),
        }
        for k in wanted
        if where.rooms[k].confidence >= query.least and query.floor in (None, int(floors[k]))
    ]
    return _paged(task, "rooms", rows, query.top, query.page)


def list_sounds(task: Task, query: ListSoundsQuery) -> dict[str, Any]:
    """Return the sounds with their likeliest names, times and places; a page of them."""
    where, names = whereabouts(task.map), {name.casefold() for name in _names(query.name)}
    sounds = work.list_sounds(task, NoQuery())["sounds"]
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


def _things(task: Task, query: ThingsQuery) -> tuple[list[ThingAnswer], list[int]]:
    """Return things, and the number of each one's room."""
    things = work.list_things(task, query)["things"]
    key = ("rooms of things", query.least, tuple(query.name), query.structure)
    places = _places([thing["position"] for thing in things])
    return things, task.map.once(key, lambda: whereabouts(task.map).rooms_of(places).tolist())


def _thing_row(thing: ThingAnswer, where: Whereabouts, room: int, away_m: float | None) -> dict[str, Any]:
    return {
        "name": thing["name"],
        "confidence": thing["confidence"],
        "position": thing["position"],
        "size": thing["size"],
        "room": where.names[room] if room >= 0 else None,
        "distance_m": away_m,
    }


def _near(task: Task, near: str | list[float]) -> tuple[Float[np.ndarray, " n"], Any, list[float] | None]:
    """Return the place that is meant, how the answer names it, and the position of the thing itself if it is one."""
    if isinstance(near, list) or not any(letter.isalpha() for letter in near):
        place = place_given(near)
        return place, None, None
    known = task.map.avlmap.knows(near)
    things = work.list_things(task, ThingsQuery(name=[near]))["things"] if known else []
    if not things:
        why = "" if known else f": {unknown_note(near)}"
        raise QueryError(f"The map shows no {near[:60]!r} to be near to{why}; give a place as x,y,z, or another name.")
    best = things[0]
    about = {"name": best["name"], "confidence": best["confidence"], "position": best["position"]}
    return np.array(best["position"]), about, best["position"]


def place_given(place: str | list[float]) -> Float[np.ndarray, " n"]:
    """Return the numbers of a place that comes as a text or as a list.

    Raises:
        QueryError: they are no two or three numbers.
    """
    return place_of(place if isinstance(place, str) else ",".join(str(value) for value in place))


def _away(served: ServedMap, thing: ThingAnswer, place: Float[np.ndarray, " n"]) -> float:
    """Return how far a thing's position lies from a place: in space, or level where the place has no height."""
    point, level = np.array(thing["position"]), served.avlmap.space.level
    return math.dist(point, place) if len(place) == 3 else math.dist(level(point)[:2], place)


def _paged(task: Task, key: str, rows: list[dict[str, Any]], top: int, page: int) -> dict[str, Any]:
    pages = max(1, math.ceil(len(rows) / top))
    if page > pages:
        raise RequestError(f"There is no page {page}; there are {pages} of {top}, for {len(rows)} {key}.")
    paging = {"page": page, "pages": pages} if pages > 1 else {}
    return {"map": task.map.name, "frame": FRAME, "total": len(rows), **paging,
            key: rows[(page - 1) * top : page * top]}  # fmt: skip


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
