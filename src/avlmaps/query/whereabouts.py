"""The floors and rooms of a map as names, and which of them a point lies in.

Of two bathrooms the lists of a map call one "bathroom 1", and a question may say so too.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.registry import Kind
from avlmaps.query.contents import UNKNOWN, numbered

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Thing
    from avlmaps.query.floor_plan import FloorPlan

NOWHERE = -1
"""The room of a point in no room."""
_MOST_NAMED = 30
_UNITS = "m|cm|metres?|meters?|feet|steps?|times|degrees?|seconds?|minutes?"
# A word and a number behind it, which counts nothing ("the kitchen 2 m ahead"): most sentences hold none.
_NUMBERED = re.compile(rf"[^\W\d_] [1-9]\d{{0,2}}\b(?!\.\d| ?({_UNITS})\b)", re.IGNORECASE)


class Whereabouts:
    """The floors and rooms of one map; none where it has no model of views.

    ``rooms``: those with most views first. ``names``: of each room, all different: its kind, and a number where there
    are several. ``regions``: their floors; None without a floor plan. ``MapError``: another encoder made the map.
    """

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map, has_rooms = avlmap, avlmap.has(Kind.VIEWS)
        self.rooms = tuple(avlmap.rooms()) if has_rooms else ()
        self.names = numbered([room.name for room in self.rooms])
        self.regions = avlmap.room_regions if has_rooms else None

    @cached_property
    def _plan(self) -> "FloorPlan | None":
        return None if (votes := self._map.room_votes) is None else votes.plan

    @property
    def floor_count(self) -> int:
        """Number of storeys; 1 where they are not known."""
        return 1 if self._plan is None else len(self._plan.storeys)

    def floors_of(self, points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the storey of each point (metres, recording frame), counted from 0, the lowest."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        return np.zeros(len(points), np.int64) if self._plan is None else self._plan.storeys_of(points)

    def rooms_of(self, points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the room of each point (metres, recording frame): by its region, else of the nearest view.

        Numbers into ``rooms``; ``NOWHERE`` for a map without rooms, and outside.
        """
        points = np.asarray(points, np.float64).reshape(-1, 3)
        field = self._map.room_field if self.rooms and len(points) else None
        if field is None or self.regions is None:
            return np.full(len(points), NOWHERE, np.int64)
        listed = np.full(len(self.regions) + 1, NOWHERE, np.int64)
        listed[[room.region for room in self.rooms]] = np.arange(len(self.rooms))
        return listed[field.room_of(points)]

    def name_of(self, place: Sequence[float]) -> str | None:
        """Return the name of the room of a place; None in a map without rooms."""
        number = int(self.rooms_of(np.array([place]))[0])
        return None if number == NOWHERE else self.names[number]

    def with_rooms(self, things: "Sequence[Thing]") -> "list[Thing]":
        """Return things that know their rooms."""
        rooms: list[int] = self.rooms_of(np.array([thing.position for thing in things]).reshape(-1, 3)).tolist()
        named = [self.names[room] if room != NOWHERE else None for room in rooms]
        return [replace(thing, room=name) for thing, name in zip(things, named, strict=True)]

    def areas_m2(self) -> Float[np.ndarray, " r"]:
        """Return the floor area of each room; none for a map without a floor plan."""
        return np.array([room.area_m2 for room in self.rooms], np.float64)

    def parts_of(self, kind: Callable[[str], bool], points: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Return which points (metres, recording frame) lie in a room whose name is meant, or such a part of one."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        own = self.rooms_of(points)
        whole = np.array([kind(room.name) for room in self.rooms] + [False])[own]
        part = np.array([room.may_be(kind) for room in self.rooms] + [False])[own] & ~whole
        field = self._map.room_field if part.any() else None
        if field is None:
            return whole
        likeliest = field.at(points[part]).argmax(axis=1)
        whole[part] = np.array([kind(name) for name in field.kinds])[likeliest]
        return whole

    def inside(self, asked: str, points: Sequence[Sequence[float]] | np.ndarray) -> Bool[np.ndarray, " m"]:
        """Return which points lie in what a word names: one room by its own name, or all rooms and parts of a kind."""
        places, own = np.array(points, np.float64).reshape(-1, 3), self._one_named(asked)
        if own is not None and self.names[own] != self.rooms[own].name:
            return self.rooms_of(places) == own
        return self.parts_of(self._kind(asked), places)

    def has(self, asked: str) -> bool:
        """Return whether a word names a room of the map, or a part of one."""
        kind = self._kind(asked)
        return self._one_named(asked) is not None or any(room.may_be(kind) for room in self.rooms)

    def require(self, asked: str) -> None:
        """Raise ``QueryError`` where a word names no room; the sentence lists those that there are."""
        if self.has(asked):
            return
        if not self.names:
            raise QueryError("The map has no rooms: it was built without a model of views; leave out the room.")
        more = f" and {len(self.names) - _MOST_NAMED} more" if len(self.names) > _MOST_NAMED else ""
        raise QueryError(
            f"There is no room {asked[:60]!r}; the rooms are: {', '.join(self.names[:_MOST_NAMED])}{more}."
        )

    def numbers_of(self, asked: str) -> list[int]:
        """Return the numbers of the rooms that a word names, or parts of which it names. ``QueryError``: see above."""
        self.require(asked)
        own, kind = self._one_named(asked), self._kind(asked)
        if own is not None:
            return [own]
        whole = [number for number, room in enumerate(self.rooms) if kind(room.name)]
        return whole or [number for number, room in enumerate(self.rooms) if room.may_be(kind)]

    def _one_named(self, asked: str) -> int | None:
        return next((number for number, name in enumerate(self.names) if name.casefold() == _plain(asked)), None)

    def _kind(self, asked: str) -> Callable[[str], bool]:
        word = _plain(asked)
        if word == UNKNOWN and word in (room.name for room in self.rooms):  # else "the room" is any room
            return lambda kind: kind == word
        return lambda kind: kind.casefold() == word or lexicon().is_a(kind, word, EntryKind.ROOM)

    @cached_property
    def numbered(self) -> dict[str, int]:
        """The region of each room that shares its name with others, by the name with its number."""
        from avlmaps.query.edits import plain_name

        rooms = zip(self.names, self.rooms, strict=True)
        return {plain_name(name): room.region for name, room in rooms if name != room.name}


def _plain(asked: str) -> str:
    return " ".join(asked.casefold().split()).removeprefix("the ")


def _numbered(avlmap: "AVLMap") -> dict[str, int]:
    try:
        return avlmap.where.numbered
    except AvlmapsError:  # its encoder is not here: a question of something else needs none
        return {}


def region_named(avlmap: "AVLMap", phrase: str) -> int | None:
    """Return the region of the room that a phrase names with its number; None where a person called something so."""
    if not _NUMBERED.search(phrase) or avlmap.edited.knows(phrase):
        return None
    from avlmaps.query.edits import plain_name

    return _numbered(avlmap).get(plain_name(phrase))


def own_names(avlmap: "AVLMap", sentence: str) -> tuple[tuple[str, bool], ...]:
    """Return the names that are this map's own, and whether each is that of a room."""
    rooms = _numbered(avlmap) if _NUMBERED.search(sentence) else ()
    return (*avlmap.edited.own_names, *((name, True) for name in rooms))
