"""The floors and rooms of a map as names, and which of them a point lies in.

Of two bathrooms the lists of a map call one "bathroom 1", and a question may say so too.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import AvlmapsError, QueryError

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Room, Thing
    from avlmaps.query.floor_plan import FloorPlan
    from avlmaps.query.room_regions import RoomRegions
    from avlmaps.query.rooms import RoomField

_UNITS = "m|cm|metres?|meters?|feet|steps?|times|degrees?|seconds?|minutes?"
# A word and a number behind it, which counts nothing ("the kitchen 2 m ahead"): most sentences hold none.
_NUMBERED = re.compile(rf"[^\W\d_] [1-9]\d{{0,2}}\b(?!\.\d| ?({_UNITS})\b)", re.IGNORECASE)


def numbered_rooms(avlmap: "AVLMap") -> dict[str, int]:
    """Return the region of each room that shares its name with others, by the name that the lists of the map give it.

    A map whose rooms are not known, or are groups of views without walls, has none.
    """
    from avlmaps.query.contents import numbered  # most questions need neither
    from avlmaps.query.edits import plain_name

    try:
        rooms = avlmap.rooms() if "views" in avlmap.data.info.models else []
    except AvlmapsError:  # its encoder is not here: a question of something else needs none
        return {}
    names = numbered([room.name for room in rooms])
    return {
        plain_name(name): room.region
        for name, room in zip(names, rooms, strict=True)
        if name != room.name and room.region >= 0
    }


def region_named(avlmap: "AVLMap", phrase: str) -> int | None:
    """Return the region of the room that a phrase names with its number; None where it names none so.

    What a person called so goes before what the lists number.
    """
    if not _NUMBERED.search(phrase) or avlmap.edited.knows(phrase):
        return None
    from avlmaps.query.edits import plain_name

    return avlmap.numbered_rooms.get(plain_name(phrase))


def own_names(avlmap: "AVLMap", sentence: str) -> tuple[tuple[str, bool], ...]:
    """Return the names that are this map's own, and whether each is that of a room."""
    rooms = avlmap.numbered_rooms if _NUMBERED.search(sentence) else ()
    return (*avlmap.edited.own_names, *((name, True) for name in rooms))


NOWHERE = -1
"""The room of a point in a map without rooms."""
_MOST_NAMED = 30


@dataclass(frozen=True, eq=False)
class Whereabouts:
    """The floors and rooms of one map."""

    rooms: "tuple[Room, ...]"  # those with most views first
    # Of each room, all different: the kind of room, and a number where there are several of a kind.
    names: tuple[str, ...]
    avlmap: "AVLMap"  # the map
    plan: "FloorPlan | None"  # its storeys; None for a map without a floor plan
    field: "RoomField | None"  # the kinds of room of each place; None for a map whose rooms are groups of views
    regions: "RoomRegions | None" = None  # the floor of each room; None likewise

    @classmethod
    def of(cls, avlmap: "AVLMap") -> "Whereabouts":
        """Find the rooms of a map; none where it has no model of views.

        ``MapError``: the map was built with another encoder than is installed.
        """
        from avlmaps.query.contents import numbered

        if "views" not in avlmap.data.info.models:
            votes = avlmap.room_votes
            return cls((), (), avlmap, None if votes is None else votes.plan, None)
        rooms, field = tuple(avlmap.rooms()), avlmap.room_field
        names = numbered([room.name for room in rooms])
        return cls(rooms, names, avlmap, None if field is None else field.plan, field, avlmap.room_regions)

    @property
    def floor_count(self) -> int:
        """Number of storeys; 1 where they are not known."""
        return 1 if self.plan is None else len(self.plan.storeys)

    def floors_of(self, points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the storey of each point (metres, recording frame), counted from 0, the lowest."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        return np.zeros(len(points), np.int64) if self.plan is None else self.plan.storeys_of(points)

    def rooms_of(self, points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the number of the room of each point: the one whose region holds it, else the nearest of its storey.

        ``points``: metres, recording frame. Numbers into ``rooms``; ``NOWHERE`` for a map without rooms.
        """
        from scipy.spatial import KDTree

        points = np.asarray(points, np.float64).reshape(-1, 3)
        if not self.rooms or not len(points):
            return np.full(len(points), NOWHERE, np.int64)
        level = self.avlmap.space.level
        places = np.concatenate([room.places for room in self.rooms])
        number = np.repeat(np.arange(len(self.rooms)), [len(room.places) for room in self.rooms])
        nearest = KDTree(self._by_storey(level(places), places)).query(self._by_storey(level(points), points))[1]
        if self.regions is None:
            return number[nearest]
        own = self.regions.listed_at([room.region for room in self.rooms], points)
        return np.where(own == NOWHERE, number[nearest], own)

    def with_rooms(self, things: "Sequence[Thing]") -> "list[Thing]":
        """Return things that know their rooms."""
        rooms: list[int] = self.rooms_of(np.array([thing.position for thing in things]).reshape(-1, 3)).tolist()
        named = [self.names[room] if room != NOWHERE else None for room in rooms]
        return [replace(thing, room=name) for thing, name in zip(things, named, strict=True)]

    def things_in(self, asked: str, things: "Sequence[Thing]") -> "list[Thing]":
        """Return the things in a room by its name, or in all rooms of a kind. ``QueryError``: there is no such room."""
        meant = {self.names[number] for number in self.numbers_of(asked)}
        return [thing for thing in self.with_rooms(things) if thing.room in meant]

    def _by_storey(self, level: Float[np.ndarray, "m 3"], points: Float[np.ndarray, "m 3"]) -> np.ndarray:
        return np.c_[level[:, :2], 1e4 * self.floors_of(points)]

    def areas_m2(self) -> Float[np.ndarray, " r"]:
        """Return the floor area of each room; none for a map without a floor plan."""
        if self.regions is None:
            return np.zeros(0)
        return np.array([room.area_m2 or 0.0 for room in self.rooms], np.float64)

    def parts_of(self, kind: Callable[[str], bool], points: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Return which points lie in a room of a kind: in one of that name, or in the part of an open plan that is.

        ``kind``: whether a name of a room is meant. ``points``: metres, recording frame.
        """
        points = np.asarray(points, np.float64).reshape(-1, 3)
        own = self.rooms_of(points)
        whole = np.array([kind(room.name) for room in self.rooms] + [False])[own]
        part = np.array([room.may_be(kind) for room in self.rooms] + [False])[own] & ~whole
        if self.field is None or not part.any():
            return whole
        likeliest = self.field.at(points[part]).argmax(axis=1)
        meant = np.array([kind(name) for name in self.field.kinds])
        whole[part] = meant[likeliest]
        return whole

    def one_named(self, asked: str) -> int | None:
        """Return the number of the room that a word names, and no other room; None where it names none so."""
        word = " ".join(asked.casefold().split()).removeprefix("the ")
        return next((k for k, name in enumerate(self.names) if name.casefold() == word), None)

    def numbers_of(self, asked: str) -> list[int]:
        """Return the numbers of the rooms that a word names: one by its own name, or all of a kind.

        ``QueryError``: there is no such room; the sentence lists those that there are.
        """
        word = " ".join(asked.casefold().split()).removeprefix("the ")
        own = self.one_named(asked)
        numbers = [own] if own is not None else [k for k, room in enumerate(self.rooms) if room.name.casefold() == word]
        if numbers:
            return numbers
        if not self.names:
            raise QueryError("The map has no rooms: it was built without a model of views; leave out the room.")
        more = f" and {len(self.names) - _MOST_NAMED} more" if len(self.names) > _MOST_NAMED else ""
        raise QueryError(
            f"There is no room {asked[:60]!r}; the rooms are: {', '.join(self.names[:_MOST_NAMED])}{more}."
        )
