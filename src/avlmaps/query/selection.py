"""What a map holds, as the command line, the server and agents list it: by room, place, name and page."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NotRequired, TypedDict, TypeVar

import numpy as np

from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.core.registry import Kind
from avlmaps.core.wording import the_room
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import Watch, listed_rooms, put_storeys, require_known
from avlmaps.query.places import Box, distance_m, is_place, place_given
from avlmaps.query.schema import ListedThing, NearAnswer, Notes, RoomAnswer, SoundAnswer, ThingAnswer
from avlmaps.query.sound_sources import with_heard
from avlmaps.query.words import unknown_note

Row = TypeVar("Row")
T = TypeVar("T")


def _computed(key: object, work: Callable[[], T]) -> T:
    del key
    return work()


@dataclass(frozen=True, slots=True)
class MapLists:
    """The lists of one map."""

    avlmap: AVLMap  # the map
    # Returns what work returns, perhaps remembered under a key; by default it is computed each time.
    once: Callable[[object, Callable[[], Any]], Any] = field(default=_computed, repr=False)
    # Is given the progress, as by ``AVLMap.things``.
    watch: Watch = field(default=lambda stage, done, total: None, repr=False)

    def things(
        self, least: float = 0.5, names: Sequence[str] = (), structure: bool = False, at: str | None = None
    ) -> list[ThingAnswer]:
        """Return the things, perhaps those of a day, most confident first; none of a map without a model of pixels."""

        def found() -> list[ThingAnswer]:
            if not self.avlmap.has(Kind.PIXELS):
                return []
            require_known(self.avlmap.knows, names)
            things = self.avlmap.things(tuple(names) or None, least, structure, watch=self.watch, at=at)
            if at is None:  # those of a day come with the sounds of that day
                things = with_heard(self.avlmap, things, are_all=not names)
            return put_storeys([thing.to_json() for thing in things], self.avlmap.storeys)

        return self.once(("things", least, tuple(names), structure, at), found)

    def wanted(self, wanted: "Wanted") -> list[ThingAnswer]:
        """Return the things of the names, confidence and day that are wanted, of all rooms."""
        return self.things(wanted.least, wanted.name, wanted.structure, wanted.at)

    def sounds(self) -> list[SoundAnswer]:
        """Return the sounds in the order of their onset."""
        avlmap = self.avlmap
        return self.once("sounds", lambda: put_storeys([sound.to_json() for sound in avlmap.sounds()], avlmap.storeys))

    def rooms(self, least: float = 0.0) -> list[RoomAnswer]:
        """Return the rooms of at least some confidence, those with most views first; none without a model of views."""
        avlmap = self.avlmap

        def found() -> list[RoomAnswer]:
            return listed_rooms(avlmap.rooms() if avlmap.has(Kind.VIEWS) else [], avlmap.storeys)

        rooms: list[RoomAnswer] = self.once("rooms", found)
        return [room for room in rooms if room["confidence"] >= least]


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Which things are listed, in which order, and how many at once."""

    least: float = 0.5  # things of less confidence are left out, in [0, 1]
    name: Sequence[str] = ()  # list these things only; by default the pixel encoder's vocabulary
    structure: bool = False  # list walls, floors and the like as well
    room: str | None = None  # a room by its name, or all rooms of a kind
    # What they are near to, the nearest first: x,y,z of the recording frame, x,y of the level one, or a thing's name.
    near: str | Sequence[float] | None = None
    top: int | None = None  # most things of a page; None for all
    page: int = 1  # which page, counted from 1
    # Of a map of several days, those that were there on that day: a date, or the number of a visit from 1.
    at: str | None = None

    @property
    def is_whole(self) -> bool:
        """Whether nothing but names and confidence is selected: all things, on one page."""
        return self.room is self.near is self.top is self.at is None and self.page == 1


class ThingsPage(TypedDict):
    """A page of the things that are meant, most confident or nearest first."""

    things: list[ListedThing]
    total: NotRequired[int]
    page: NotRequired[int]
    pages: NotRequired[int]
    near: NotRequired[NearAnswer]
    notes: NotRequired[Notes]


@dataclass(frozen=True, slots=True)
class Selected:
    """One thing that is meant."""

    thing: ThingAnswer  # as it is listed
    part: int  # number of its room, or its part of one, among ``Whereabouts.parts``; negative without one
    away_m: float | None = None  # from the place that it should be near, metres; None where none is named


def page_of_things(lists: MapLists, wanted: Wanted) -> ThingsPage:
    """Return a page of the things that are meant; where nothing but names is selected, all, without a count."""
    if wanted.is_whole:
        return {"things": [ListedThing(**thing) for thing in lists.wanted(wanted)]}
    about = None
    if wanted.room is None and wanted.near is None:
        rows = [ListedThing(**thing) for thing in lists.wanted(wanted)]
    else:
        chosen, about = selected(lists, wanted)
        rows = [_row(one, lists.avlmap.where.parts[one.part].name if one.part >= 0 else None) for one in chosen]
    top = max(len(rows), 1) if wanted.top is None else wanted.top
    things, pages = page_of(rows, top, wanted.page, "things")
    answer: ThingsPage = {"things": things, "total": len(rows), "page": wanted.page, "pages": pages}
    if about is not None:
        answer["near"] = about
    if notes := beyond(lists, wanted.room, about):
        answer["notes"] = notes
    return answer


def things_with_rooms(lists: MapLists, wanted: Wanted) -> list[Selected]:
    """Return the things of some names, each with its room."""
    things = lists.wanted(wanted)
    key = ("rooms of things", wanted.least, tuple(wanted.name), wanted.structure, wanted.at)
    places = np.array([thing["position"] for thing in things], np.float64).reshape(-1, 3)
    parts: list[int] = lists.once(key, lambda: lists.avlmap.where.parts_at(places).tolist())
    return [Selected(thing, part) for thing, part in zip(things, parts, strict=True)]


def selected(lists: MapLists, wanted: Wanted) -> tuple[list[Selected], NearAnswer | None]:
    """Return all things that are meant, and the thing that they are near to if one is named."""
    found = _inside(lists, wanted.room, things_with_rooms(lists, wanted), lambda one: one.thing["position"])
    if wanted.near is None:
        return found, None
    away_m, about = _near(lists, wanted.near, wanted.at, wanted.room)
    itself = None if about is None else about["position"]
    found = [replace(one, away_m=away_m(one.thing)) for one in found if one.thing["position"] != itself]
    return sorted(found, key=lambda one: one.away_m or 0.0), about


def page_of(rows: Sequence[Row], top: int, page: int, of: str) -> tuple[list[Row], int]:
    """Return a page of some rows, and how many pages there are. ``QueryError``: there is no such page."""
    if top < 1:
        raise QueryError(f"A page cannot hold {top} {of}; it holds at least 1.")
    pages = max(1, math.ceil(len(rows) / top))
    if not 1 <= page <= pages:
        raise QueryError(f"There is no page {page}; there are {pages} of {top}, for {len(rows)} {of}.")
    return list(rows[(page - 1) * top : page * top]), pages


def _row(one: Selected, room: str | None) -> ListedThing:
    row: ListedThing = {**one.thing, "room": room}
    return row if one.away_m is None else {**row, "distance_m": round(one.away_m, 3)}


def _near(
    lists: MapLists, near: str | Sequence[float], at: str | None, room: str | None
) -> tuple[Callable[[ThingAnswer], float], NearAnswer | None]:
    # How far a thing is from the place that is meant, and the thing there if one is named: in the room if it can be.
    space = lists.avlmap.space
    if is_place(near):
        place = place_given(near)
        return lambda thing: distance_m(space.level, thing["position"], place), None
    name = str(near)
    known = lists.avlmap.knows(name)
    things = lists.things(names=[name], at=at) if known else []
    if not things:
        why = "" if known else f": {unknown_note(name)}"
        raise QueryError(f"The map shows no {name[:60]!r} to be near to{why}; give a place as x,y,z, or another name.")
    best = next(iter(_inside(lists, room, things, lambda thing: thing["position"])), things[0])
    about: NearAnswer = {"name": best["name"], "confidence": best["confidence"], "position": best["position"]}
    own = Box(space, best["position"], best["size"])
    return lambda thing: own.gap_m(Box(space, thing["position"], thing["size"])), about


def _inside(lists: MapLists, room: str | None, rows: Sequence[Row], place: Callable[[Row], list[float]]) -> list[Row]:
    if room is None:
        return list(rows)
    where = lists.avlmap.where
    where.require(room)
    return [row for row, is_in in zip(rows, where.inside(room, [place(row) for row in rows]), strict=True) if is_in]


def beyond(lists: MapLists, room: str | None, about: NearAnswer | None) -> list[str]:
    """Return the note that what things should be near to lies in another room than they do."""
    if room is None or about is None or _inside(lists, room, [about], lambda one: one["position"]):
        return []
    own = the_room(lists.avlmap.where.name_of(about["position"]) or "the map")
    return [f"No {about['name']} lies in {the_room(room)}; the distances are to the one in {own}."]


def map_answer(avlmap: AVLMap, note: Callable[[AvlmapsError], object] = lambda _: None) -> dict[str, Any]:
    """Return what ``avlmaps info`` prints; ``note`` is given the error where the sounds' model is not here."""
    from avlmaps.maps.store.map_data import describe
    from avlmaps.query.settings import rules_of

    described = describe(avlmap.path, avlmap.data)
    try:
        events = avlmap.sounds()
    except AvlmapsError as error:
        note(error)
    else:
        described["sounds"] = [
            {**sound, "names": list(event.names), "confidences": list(event.confidences)}
            for sound, event in zip(described["sounds"], events, strict=True)
        ]
    if avlmap.edited:
        described |= {"edits": len(avlmap.edited.edits), "notices": [*described["notices"], *_lost_edits(avlmap)]}
    return {**described, "rules": rules_of(avlmap.data.info.settings)}


def _lost_edits(avlmap: AVLMap) -> list[str]:
    try:
        return [str(one) for one in avlmap.edited.lost]
    except AvlmapsError as error:
        return [f"The edits are not checked: {error}"]
