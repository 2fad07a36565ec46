"""What a map of several days says changed, held against what truly did."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool
from scipy.optimize import linear_sum_assignment

from avlmaps.days.merge import same_thing
from avlmaps.maps.store.life import Life, Stay
from avlmaps.query.changes import Days
from avlmaps_sim.mesh import Triple
from avlmaps_sim.rearranged import Change
from avlmaps_sim.scene import SceneObject

REACH_M = 0.5  # a place is right within this of a thing's box, horizontally
KINDS = ("appeared", "gone", "moved")
_SAID = {"new": "appeared", "gone": "gone", "moved": "moved"}
_TRUE = {"added": "appeared", "removed": "gone", "moved": "moved"}


@dataclass(frozen=True, slots=True)
class Happened:
    """One change, as it is said or as it is true. ``before`` is None for what appeared, ``after`` for what is gone."""

    kind: str
    name: str
    before: Triple | None
    after: Triple | None


@dataclass
class Counts:
    """Right, wrong (said, not true) and missed (true, not said) changes by kind; adds up over days and homes."""

    right: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    wrong: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    missed: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))

    def add(self, other: "Counts") -> None:
        """Add others."""
        for mine, its in ((self.right, other.right), (self.wrong, other.wrong), (self.missed, other.missed)):
            for kind in KINDS:
                mine[kind] += its[kind]

    def f1(self, kind: str) -> float:
        """Return 2 right / (2 right + wrong + missed); 1 where there was nothing to say and nothing was said."""
        all_ = 2 * self.right[kind] + self.wrong[kind] + self.missed[kind]
        return 2 * self.right[kind] / all_ if all_ else 1.0


@dataclass(frozen=True, slots=True)
class Listed:
    """How well a list of things stands for the last day.

    ``stale`` things stood there on an earlier day and do so no more, ``ghosts`` are nothing that stands there; it holds
    the ``known`` of the ``true`` things that some day saw.
    """

    listed: int
    stale: int
    ghosts: int
    known: int
    true: int


def true_changes(
    changes: Sequence[Change], day: int, seen_before: Sequence[str], seen_now: Sequence[str]
) -> list[Happened]:
    """Return what truly happened on a day, of what could be noticed: it was seen before, and is seen now."""
    own: list[Happened] = []
    for one in (one for one in changes if one.day == day and one.kind in _TRUE):
        was = one.before is None or one.name in seen_before
        there = one.after is None or one.name in seen_now
        if was and there:
            own.append(Happened(_TRUE[one.kind], one.category, one.before, one.after))
    return own


def said_changes(days: Days, visit: int) -> list[Happened]:
    """Return what a map says happened on a visit."""
    stays = days.life.stays
    found: list[Happened] = []
    for one in days.changes(visit - 1):
        if one.visit != visit or one.kind == "first seen":
            continue
        before = None if one.before is None else stays[one.before].position
        after = None if one.after is None else stays[one.after].position
        found.append(Happened(_SAID[one.kind], one.stay(stays).name, before, after))
    return found


def judged(
    said: Sequence[Happened],
    true: Sequence[Happened],
    neither: Sequence[Triple] = (),
    hidden: Sequence[Happened] = (),
    *,
    named: bool = True,
) -> Counts:
    """Return how many changes are right, wrong and missed; each is matched once.

    Neither right nor wrong to name are ``neither`` (places of a door that swung) and ``hidden``, which happened where
    nobody looked (of a move either end counts by itself).
    """
    counts = Counts()
    ends = [
        Happened(kind, one.name, before, after)
        for one in hidden
        if one.kind == "moved"
        for kind, before, after in (("gone", one.before, None), ("appeared", None, one.after))
    ]
    fits = np.array([[_fits(one, other, named) for other in true] for one in said]).reshape(len(said), len(true))
    rows, columns = linear_sum_assignment(-fits.astype(float))
    matched = [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if fits[i, j]]
    for row, _ in matched:
        counts.right[said[row].kind] += 1
    found = {column for _, column in matched}
    for number, one in enumerate(true):
        counts.missed[one.kind] += number not in found
    right = {row for row, _ in matched}
    for number, one in enumerate(said):
        excused = any(_near(place, one.after or one.before) for place in neither)
        if number not in right and not excused and not any(_fits(one, other, named) for other in (*hidden, *ends)):
            counts.wrong[one.kind] += 1
    return counts


def _fits(said: Happened, true: Happened, named: bool = True) -> bool:
    places = ((said.before, true.before), (said.after, true.after))
    return (
        said.kind == true.kind
        and (not named or same_thing(said.name, true.name))
        and all(other is None or _near(one, other) for one, other in places)
    )


def _near(one: Triple | None, other: Triple | None) -> bool:
    return one is not None and other is not None and float(np.hypot(*np.subtract(one, other)[:2])) <= REACH_M


def stands_there(
    stays: Sequence[Stay], things: Sequence[SceneObject], *, named: bool = True
) -> Bool[np.ndarray, "s t"]:
    """Return which stays are at the place of which true things, with a name that fits."""
    out = np.zeros((len(stays), len(things)), bool)
    low = np.array([thing.low for thing in things]).reshape(-1, 3)
    high = np.array([thing.high for thing in things]).reshape(-1, 3)
    for number, stay in enumerate(stays):
        at = np.array(stay.position)
        off = np.maximum(np.maximum(low - at, at - high), 0.0)
        near = (np.hypot(off[:, 0], off[:, 1]) <= 0.15) & (off[:, 2] <= 0.3)
        if named:
            near[near] = [same_thing(stay.name, things[row].category) for row in np.flatnonzero(near).tolist()]
        out[number] = near
    return out


def judged_list(
    stays: Sequence[Stay],
    now: Sequence[SceneObject],
    before: Sequence[SceneObject],
    true_names: Sequence[str],
) -> Listed:
    """Return how well a list stands for the last day.

    ``before`` are the things of all earlier days, ``true_names`` those of the last day that some day saw.
    """
    there = stands_there(stays, now)
    anything = stands_there(stays, now, named=False).any(axis=1)
    then = stands_there(stays, before).any(axis=1) if before else np.zeros(len(stays), bool)
    stale = int((~there.any(axis=1) & then).sum())
    ghosts = int((~anything).sum())
    wanted = np.array([thing.name in set(true_names) for thing in now], bool)
    return Listed(len(stays), stale, ghosts, int((there.any(axis=0) & wanted).sum()), int(wanted.sum()))


def lost(life: Life, static: Sequence[SceneObject]) -> tuple[int, int]:
    """Return how many of the first day's things that never changed are said to be gone, and how many there are."""
    first = [stay for stay in life.stays if stay.first == 0]
    at = np.flatnonzero(stands_there(first, static).any(axis=1))
    own = [first[number] for number in at]
    return sum(stay.gone is not None for stay in own), len(own)
