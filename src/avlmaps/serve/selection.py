"""Which things of a map are meant: those of a room, near a place or another thing, of some names; a page of them."""

import math
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import QueryError
from avlmaps.query.schema import ThingAnswer
from avlmaps.query.unknown_names import unknown_note
from avlmaps.query.whereabouts import Whereabouts
from avlmaps.serve import work
from avlmaps.serve.errors import RequestError
from avlmaps.serve.requests import ListedThingsQuery, ThingsQuery, place_of
from avlmaps.serve.shelf import ServedMap
from avlmaps.serve.work import ListedThing, ListedThingsAnswer, Task

Row = TypeVar("Row")


@dataclass(frozen=True, slots=True)
class Selected:
    """One thing that is meant.

    Attributes:
        thing: as it is listed.
        room: number of its room; negative without one.
        away_m: from the place that it should be near, metres; None where none is named.
    """

    thing: ThingAnswer
    room: int
    away_m: float | None = None


def whereabouts(served: ServedMap) -> Whereabouts:
    """Return the floors and rooms of a map, found once."""
    return served.once("whereabouts", lambda: Whereabouts.of(served.avlmap))


def things_with_rooms(task: Task, query: ThingsQuery) -> list[Selected]:
    """Return things, each with its room."""
    things = work.list_things(task, query)["things"]
    key = ("rooms of things", query.least, tuple(query.name), query.structure)
    places = np.array([thing["position"] for thing in things], np.float64).reshape(-1, 3)
    rooms = task.map.once(key, lambda: whereabouts(task.map).rooms_of(places).tolist())
    return [Selected(thing, room) for thing, room in zip(things, rooms, strict=True)]


def selected(
    task: Task, query: ThingsQuery, room: str | None, near: str | list[float] | None
) -> tuple[list[Selected], dict[str, Any] | None]:
    """Return the things that are meant, and the thing that they are near to if one is named.

    Raises:
        QueryError: there is no such room, or no such thing to be near to.
    """
    found = things_with_rooms(task, query)
    if room is not None:
        wanted = set(whereabouts(task.map).numbers_of(room))
        found = [one for one in found if one.room in wanted]
    if near is None:
        return found, None
    place, about = _near(task, near)
    itself = None if about is None else about["position"]
    found = [replace(one, away_m=_away(task.map, one.thing, place)) for one in found if one.thing["position"] != itself]
    return sorted(found, key=lambda one: one.away_m or 0.0), about


def page_of(rows: list[Row], top: int, page: int, of: str) -> tuple[list[Row], int]:
    """Return a page of some rows, and how many pages there are.

    Raises:
        RequestError: there is no such page.
    """
    pages = max(1, math.ceil(len(rows) / top))
    if page > pages:
        raise RequestError(f"There is no page {page}; there are {pages} of {top}, for {len(rows)} {of}.")
    return rows[(page - 1) * top : page * top], pages


def list_selected(task: Task, query: ListedThingsQuery) -> ListedThingsAnswer:
    """Return a page of the things that are meant; where nothing but names is queried, all of them, without a count."""
    plain = ThingsQuery(least=query.least, name=query.name, structure=query.structure)
    whole = work.list_things(task, plain)
    rows, about = [ListedThing(**thing) for thing in whole["things"]], None
    if query.room is not None or query.near is not None:
        chosen, about = selected(task, plain, query.room, query.near)
        names = whereabouts(task.map).names
        rows = [_row(one, names[one.room] if one.room >= 0 else None) for one in chosen]
    elif query.top is None and query.page == 1:
        return {**whole, "things": rows}
    things, pages = page_of(rows, query.top or max(len(rows), 1), query.page, "things")
    answer: ListedThingsAnswer = {**whole, "things": things, "total": len(rows), "page": query.page, "pages": pages}
    return answer if about is None else {**answer, "near": about}


def _row(one: Selected, room: str | None) -> ListedThing:
    row = ListedThing(**one.thing, room=room)
    if one.away_m is not None:
        row["distance_m"] = round(one.away_m, 3)
    return row


def _near(task: Task, near: str | list[float]) -> tuple[Float[np.ndarray, " n"], dict[str, Any] | None]:
    """Return the place that is meant, and the thing there if one is named."""
    if isinstance(near, list) or not any(letter.isalpha() for letter in near):
        return place_given(near), None
    known = task.map.avlmap.knows(near)
    things = work.list_things(task, ThingsQuery(name=[near]))["things"] if known else []
    if not things:
        why = "" if known else f": {unknown_note(near)}"
        raise QueryError(f"The map shows no {near[:60]!r} to be near to{why}; give a place as x,y,z, or another name.")
    best = things[0]
    about = {"name": best["name"], "confidence": best["confidence"], "position": best["position"]}
    return np.array(best["position"]), about


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
