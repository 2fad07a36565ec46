"""What is usual in a map of several days: on how many of the days that looked at a place something was there."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.inflection import plural_of
from avlmaps.core.wording import place_text, the_room
from avlmaps.query.changes import Days, RoomOf, when

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Life, Stay
    from avlmaps.maps.store.reader import StoredMap
    from avlmaps.query.schema import DayAnswer, UsualAnswer

USUAL_FROM, FEWEST_DAYS = 0.5, 2
"""Something is usual where it was on at least this share of the days that looked, and on at least this number."""
_ONE_PLACE_M = 1.0


@dataclass(frozen=True, slots=True)
class Usual:
    """A thing at a place, over the days.

    Attributes:
        stay: the last one of it there.
        there: days on which it was seen there.
        looked: days on which its place was looked at, those among them.
    """

    stay: "Stay"
    there: int
    looked: int

    @property
    def share(self) -> float:
        """Share of the days that looked."""
        return self.there / self.looked

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


def days_of(stored: "StoredMap", corrected: "Callable[[Life], Life]") -> Days:
    """Return the days of a map.

    Raises:
        QueryError: it was seen on one day alone.
    """
    if not getattr(stored.info, "visits", ()):
        raise QueryError(
            f"{stored.path.name} was seen on one day alone, so that nobody knows what is usual there; add other days "
            "with `avlmaps merge`."
        )
    return Days.of(stored, corrected)


def usual(days: Days, wanted: "Callable[[Stay], bool]") -> list[Usual]:
    """Return things of some stays, each at its place, the most usual first.

    Stays of one name whose places lie within a metre are one thing that came and went. A day that looked at the place
    while one of them was there counts as one on which it was there.
    """
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
    number = Counter((one.stay.name, f" ({one.counted})" if counted else "") for one in some)
    return ", ".join(f"{name if n == 1 else f'{n} {plural_of(name)}'}{days}" for (name, days), n in number.items())


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
        day = _day_of(days, best.stay)
        return f"The {name} was seen on 1 day only, {day}, {at(best)}; that says nothing of what is usual."
    else:
        text = f"The {name} is nowhere usually; most often it was {at(best)}, on {best.counted}."
    others = [f"{at(one)} ({one.counted})" for one in found[1:4]]
    return text + (f" Also {'; '.join(others)}." if others else "")


def _day_of(days: Days, stay: "Stay") -> str:
    day: DayAnswer = when(days, stay.first)
    return day["day"] or f"visit {day['visit']}"
