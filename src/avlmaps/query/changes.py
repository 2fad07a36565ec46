"""What changed in a map of several days, where a thing was last seen, and what is usual, by the days that looked."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from typing import TYPE_CHECKING, Literal

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.poses import FRAME
from avlmaps.core.wording import place_text, the_room
from avlmaps.core.words import plural_of
from avlmaps.query.schema import ChangeAnswer, LastSeenPlace, row_of
from avlmaps.query.settings import FOUND_AT

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Life, Stay
    from avlmaps.maps.store.manifest import Visit
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Thing
    from avlmaps.query.schema import ChangesAnswer, DayAnswer, LastSeenAnswer, UsualAnswer
    from avlmaps.query.voxel_space import Space

SOMETHING = "something"
"""A thing that changed and is of no name with a probability of ``FOUND_AT``."""
ChangeKind = Literal["new", "gone", "moved", "first seen"]


def name_of(stay: "Stay") -> str:
    """Return a thing's name where it is known, else ``SOMETHING``."""
    return stay.name if stay.confidence >= FOUND_AT else SOMETHING


RoomOf = Callable[[tuple[float, float, float]], str | None]
"""Returns the name of the room that holds a place."""


@dataclass(frozen=True, slots=True)
class Days:
    """The days of a map and what became of its things."""

    visits: "tuple[Visit, ...]"  # the days, in the order of time
    life: "Life"  # of the things

    @classmethod
    def of(cls, avlmap: "AVLMap", unknown: str = "nothing is known to have changed") -> "Days":
        """Return those of a map, its things as people named them. ``QueryError``: it was seen on one day alone."""
        life = avlmap.data.life
        if life is None:
            raise QueryError(
                f"{avlmap.path.name} was seen on one day alone, so that {unknown}; add another with `avlmaps merge`."
            )
        return cls(avlmap.data.info.visits, avlmap.edited.life(life))

    @property
    def last(self) -> int:
        """The last visit."""
        return len(self.visits) - 1

    def name(self, visit: int) -> str:
        """Return the day of a visit, or its number from 1, for people."""
        return self.visits[visit].day or f"visit {visit + 1}"

    def visit_of(self, said: str | int) -> int:
        """Return the number of the visit that a day names: a number from 1, or the last one up to a date.

        ``said``: "2", "visit 2", "day 2", "2026-11-25", "yesterday" or "today". ``QueryError``: there is none.
        """
        text = str(said).strip().lower().removeprefix("visit ").removeprefix("day ").strip()
        if text in ("today", "yesterday"):
            text = (date.today() - timedelta(days=text == "yesterday")).isoformat()
        if text.isdecimal():
            if not 1 <= int(text) <= len(self.visits):
                raise QueryError(f"There is no visit {text}; the map has {len(self.visits)}, counted from 1.")
            return int(text) - 1
        try:
            wanted = date.fromisoformat(text).isoformat()
        except ValueError:
            raise QueryError(f"{text!r} is no day; write it as 2026-11-25, or as the number of a visit.") from None
        dated = [number for number, visit in enumerate(self.visits) if visit.day and visit.day <= wanted]
        if not dated:
            first = next((visit.day for visit in self.visits if visit.day), None)
            why = f"its first day is {first}" if first else "its days are not known, number them from 1"
            raise QueryError(f"The map was not seen up to {wanted}; {why}.")
        return dated[-1]

    def at(self, visit: int) -> "list[int]":
        """Return the numbers of the stays that were there on a visit."""
        return [number for number, stay in enumerate(self.life.stays) if stay.is_there(visit)]

    def changes(self, since: int = 0) -> "list[Change]":
        """Return what changed after a visit, in time; ``new`` is what stands where somebody had looked before."""
        found: list[Change] = []
        stays = self.life.stays
        for number, stay in enumerate(stays):
            if stay.first > since and stay.moved_from is None:
                found.append(Change("new" if stay.appeared else "first seen", stay.first, None, number))
            if stay.gone is not None and stay.gone > since and stay.moved_to is None:
                found.append(Change("gone", stay.gone, number, None))
            if stay.moved_to is not None and stays[stay.moved_to].first > since:
                found.append(Change("moved", stays[stay.moved_to].first, number, stay.moved_to))
        return sorted(found, key=lambda one: (one.visit, _ORDER[one.kind], one.stay(stays).name))


_ORDER = {"new": 0, "moved": 1, "gone": 2, "first seen": 3}


@dataclass(frozen=True, slots=True)
class Change:
    """One change."""

    kind: ChangeKind  # what happened
    visit: int  # the day on which it was noticed
    before: int | None  # number of the stay that ended; None for what is new
    after: int | None  # number of the stay that began; None for what is gone

    def stay(self, stays: "Sequence[Stay]") -> "Stay":
        """Return where it is now, or where it was."""
        number = self.before if self.after is None else self.after
        assert number is not None
        return stays[number]


def when(days: Days, visit: int, stamp_s: float | None = None) -> "DayAnswer":
    """Return a visit as answers have it."""
    answer: DayAnswer = {"visit": visit + 1, "day": days.visits[visit].day or None}
    if stamp_s is not None:
        answer["stamp_s"] = round(stamp_s - days.visits[visit].shift_s, 3)
    return answer


def changes_answer(
    days: Days, name: str, since: int = 0, room_of: RoomOf = lambda place: None, *, first_seen: bool = False
) -> "ChangesAnswer":
    """Return what ``avlmaps changes --json`` prints."""
    stays = days.life.stays
    listed: list[ChangeAnswer] = []
    for one in days.changes(since):
        if one.kind == "first seen" and not first_seen:
            continue
        stay = one.stay(stays)
        before = None if one.before is None else stays[one.before]
        after = None if one.after is None else stays[one.after]
        listed.append(row_of(
            stay, ChangeAnswer, kind=one.kind, name=name_of(stay),
            room=room_of(stay.position), noticed=when(days, one.visit),
            last_seen=when(days, stay.last, stay.last_seen_s),
            first_seen=when(days, stay.first if before is None else before.first),
            **{"from": None if before is None or after is None else list(before.position)},
        ))  # fmt: skip
    return {
        "map": name,
        "frame": FRAME,
        "since": when(days, since),
        "days": [when(days, number) for number in range(len(days.visits))],
        "changes": listed,
        "unknown": sum(stay.gone is None and stay.looked < days.last for stay in stays),
    }


def last_seen(days: Days, name: str, same: Callable[[str], bool], room_of: RoomOf) -> "LastSeenAnswer":
    """Return where things of a name were last seen: those of a known name, those that are there still, the latest."""
    stays = days.life.stays
    own = [stay for stay in stays if same(stay.name) and stay.moved_to is None]
    own.sort(key=lambda stay: (stay.confidence < FOUND_AT, stay.gone is not None, -stay.last_seen_s, -stay.confidence))

    def row(stay: "Stay") -> LastSeenPlace:
        return row_of(
            stay, LastSeenPlace, room=room_of(stay.position), last_seen=when(days, stay.last, stay.last_seen_s),
            gone=None if stay.gone is None else when(days, stay.gone), looked=when(days, stay.looked),
        )  # fmt: skip

    return {"name": name, "frame": FRAME, "last_day": when(days, days.last), "seen": list(map(row, own))}


def things_at(
    space: "Space", days: Days, at: str | int, names: "Sequence[str] | None", least_confidence: float
) -> "list[Thing]":
    """Return the things that were there on a day, most confident first; see ``AVLMap.things``."""
    from avlmaps.query.contents import Thing
    from avlmaps.query.edits import means

    meant = None if names is None else [means(name) for name in names]
    found: list[Thing] = []
    for number in days.at(days.visit_of(at)):
        stay, index = days.life.stays[number], days.life.voxels(number)
        if stay.confidence < least_confidence or not (meant is None or any(one(stay.name) for one in meant)):
            continue
        rows, points = space.rows_of(index), space.grid.centre_of(index)
        left = np.sort(rows[rows >= 0])
        found.append(Thing(stay.name, stay.confidence, stay.position, stay.size, stay.color, left, points))
    return sorted(found, key=lambda thing: -thing.confidence)


def text_of(answer: "ChangesAnswer", kinds: Iterable[ChangeKind] = ("new", "moved", "gone"), place: str = "") -> str:
    """Return changes in one sentence."""
    wanted = set(kinds)
    own = [one for one in answer["changes"] if one["kind"] in wanted]
    where = f" in {the_room(place)}" if place else ""
    if not own:
        words = {"new": "to be new", "moved": "to have moved", "gone": "to be gone"}
        names = " or ".join(word for kind, word in words.items() if kind in wanted)
        return f"Nothing is known {names}{where} since {said(answer['since'])}."
    parts: list[str] = []
    for one in own:
        there = f" ({one['room']})" if one["room"] and not place else ""
        verb = "is" if one["kind"] != "moved" else "has"
        parts.append(f"{_article(one['name'])} {verb} {one['kind']}{there}, noticed on {said(one['noticed'])}")
    return f"Since {said(answer['since'])}{where}: {'; '.join(parts)}."


def said(day: "DayAnswer") -> str:
    """Return a day in words."""
    return day["day"] or f"visit {day['visit']}"


def last_seen_text(answer: "LastSeenAnswer") -> str:
    """Return where a thing was last seen, in one sentence."""
    if not answer["seen"]:
        return f"No {answer['name']} was seen on any day."
    one = answer["seen"][0]
    room = f"in {the_room(one['room'])}, " if one["room"] else ""
    sure = one["confidence"] >= FOUND_AT
    what = (
        f"The {one['name']}" if sure else f"What may be {_article(one['name'])} (probability {one['confidence']:.2f})"
    )
    text = f"{what} was last seen on {said(one['last_seen'])}, {room}at {place_text(one['position'])}."
    if one["gone"] is not None:
        return f"{text} On {said(one['gone'])} it was gone from there."
    if one["last_seen"]["visit"] == answer["last_day"]["visit"]:
        return text
    return f"{text} Nobody has looked at its place since."


def _article(name: str) -> str:
    return name if name == SOMETHING else f"{'an' if name[:1] in 'aeiou' else 'a'} {name}"


USUAL_FROM, FEWEST_DAYS = 0.5, 2
"""Something is usual where it was on at least this share of the days that looked, and on at least this number."""
_ONE_PLACE_M = 1.0


@dataclass(frozen=True, slots=True)
class Usual:
    """A thing at a place, over the days."""

    stay: "Stay"  # the last one of it there
    there: int  # days on which it was seen there
    looked: int  # days on which its place was looked at, those among them

    @property
    def share(self) -> float:
        """Share of the days that looked."""
        return self.there / self.looked

    @property
    def name(self) -> str:
        """Its name, or ``SOMETHING``."""
        return name_of(self.stay)

    @property
    def is_usual(self) -> bool:
        """Whether it is there on most days, and on more than one."""
        return self.there >= FEWEST_DAYS and self.share >= USUAL_FROM

    @property
    def counted(self) -> str:
        """The days in words."""
        return f"{self.there} of {self.looked} days"

    def to_json(self) -> "UsualAnswer":
        """Return the days as answers have them."""
        return {"there": self.there, "looked": self.looked}


def usual(days: Days, wanted: "Callable[[Stay], bool]") -> list[Usual]:
    """Return things of some stays, the most usual first; of one name within a metre they are one thing."""
    groups: list[list[Stay]] = []
    for stay in sorted(days.life.stays, key=lambda one: (one.last, one.last_seen_s), reverse=True):
        if stay.is_person or not wanted(stay):
            continue
        own = next((group for group in groups if _is_one(group[0], stay)), None)
        if own is None:
            groups.append([stay])
        else:
            own.append(stay)
    found: list[Usual] = []
    for group in groups:
        there = frozenset[int]().union(*(stay.days_there for stay in group))
        absent = frozenset[int]().union(*(stay.days_absent for stay in group)) - there
        found.append(Usual(group[0], len(there), len(there) + len(absent)))
    return sorted(found, key=lambda one: (not one.is_usual, -one.share, -one.there, one.stay.name))


def _is_one(one: "Stay", other: "Stay") -> bool:
    return one.name == other.name and float(np.linalg.norm(np.subtract(one.position, other.position))) <= _ONE_PLACE_M


def usual_text(found: Sequence[Usual], where: str) -> str:
    """Return what is usually somewhere, in a sentence or two: ``on the table``."""
    often = [one for one in found if one.is_usual]
    once = [one for one in found if one.there == 1]
    rest = [one for one in found if one not in often and one not in once]
    parts = [f"Usually {where}: {_listed(often)}." if often else f"Nothing is known to be usually {where}."]
    if rest:
        parts.append(f"Now and then: {_listed(rest)}.")
    if once:
        parts.append(f"Seen there on 1 day only: {_listed(once, counted=False)}.")
    return " ".join(parts)


def _listed(some: Sequence[Usual], *, counted: bool = True) -> str:
    number = Counter((one.name, f" ({one.counted})" if counted else "") for one in some)
    several = {SOMETHING: "things"}
    return ", ".join(
        f"{name if n == 1 else f'{n} {several.get(name) or plural_of(name)}'}{days}"
        for (name, days), n in number.items()
    )


def usual_place_text(days: Days, name: str, found: Sequence[Usual], room_of: RoomOf) -> str:
    """Return where a thing usually is, in a sentence or two."""
    if not found:
        return f"No {name} was seen on any day."

    def at(one: Usual) -> str:
        room = room_of(one.stay.position)
        return (f"in {the_room(room)}, " if room else "") + f"at {place_text(one.stay.position)}"

    best = found[0]
    if best.is_usual:
        text = f"The {name} is usually {at(best)}: on {best.counted} on which its place was looked at."
    elif all(one.there == 1 for one in found) and len(found) == 1:
        seen = f"The {name} was seen on 1 day only, {days.name(best.stay.first)}, {at(best)}"
        return f"{seen}; that says nothing of what is usual."
    else:
        text = f"The {name} is nowhere usually; most often it was {at(best)}, on {best.counted}."
    others = [f"{at(one)} ({one.counted})" for one in found[1:4]]
    return text + (f" Also {'; '.join(others)}." if others else "")
