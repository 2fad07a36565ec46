"""What became of each thing: it is the one of an earlier day, it is gone, it moved, or nobody knows.

First the things of the new day are matched with those that were there; then what was not matched is judged by the
evidence at its place (``evidence``); then the new ones are matched with those that are gone (moved). Surface that only
one of two days has, in groups of a thing's size, are things without a name of a list (``changed_things``).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from msgspec.structs import replace
from scipy.optimize import linear_sum_assignment

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.timeline import DAY_S
from avlmaps.days.evidence import Day, DayVerdict, DayViews, seen_again, seen_before
from avlmaps.days.surfaces import AROUND, Occupied, packed
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.life import Life, Stay
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import STRUCTURE, Thing, thing_of
from avlmaps.query.voxel_space import linked
from avlmaps.query.words import VoxelNamer

# A thing is the one of an earlier day where this part of the smaller of the two lies in the other; with another name,
# where the second part does, and the smaller is this part of the larger.
OVERLAP, SAME_PLACE = 0.25, 0.6
REACH_M = 20.0  # what moved farther is not recognised
WITHIN_S = 30 * DAY_S  # nor what comes back after more time
LEAST_LIKENESS = 0.3  # of size, colour and looks together, for a thing to be the one that is gone from elsewhere
LIKENESS_UNNAMED = 0.5  # where the names differ and one of them has little confidence
CONFIDENT_AT = 0.5  # a name of less confidence does not speak against another
LEAST_VOXELS = 12  # surface without a name is a changed thing from this number of voxels that rays pass through
MOST_M = 2.0  # longer ones are no thing that somebody carries
LOWEST_VOXELS = 2.5  # nor is what is flatter: a table's top of which one day saw a little more

_DARK = 20.0  # of 255: what is darker has hardly a hue
_NAMED = 0.3  # a name that fits is worth this much likeness

SameName = Callable[[str, str], bool]
"""Says whether two names may be of one thing."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenThing:
    """A thing as a day's map lists it, in the grid of the map of all days."""

    name: str  # the word of the vocabulary
    confidence: float
    position: tuple[float, float, float]  # a point of it, metres
    size: tuple[float, float, float]  # along the level axes, metres
    color: tuple[int, int, int]  # mean RGB
    index: Int[np.ndarray, "v 3"]  # its voxels
    seen_s: float  # when it was last seen, the map's time
    feature: Float[np.ndarray, " d"] | None = None  # how its voxels look together, unit norm


def begun(things: Sequence[SeenThing], visit: int = 0) -> Life:
    """Return the life of things on the first day."""
    return Life.of([_stay(thing, visit, appeared=False) for thing in things], [thing.index for thing in things])


def lived_on(
    life: Life,
    things: Sequence[SeenThing],
    day: Day,
    before: Sequence[DayViews],
    known: Occupied,
    visit: int,
    at_s: Sequence[float],
    grid: GridSpec,
    same: SameName = lambda one, other: one == other,
    features: Mapping[int, Float[np.ndarray, " d"]] = MappingProxyType({}),
) -> Life:
    """Return what became of things by another day.

    ``before`` are the views of each earlier visit, ``known`` is the surface of the map until then, ``at_s`` when each
    visit ended, the new one last, the map's time. ``features`` says how the things of until then look, by the number of
    their stay, as ``SeenThing.feature``.
    """
    voxels = [life.voxels(number) for number in range(len(life))]
    stays = list(life.stays)
    present = [number for number, stay in enumerate(stays) if stay.gone is None]
    matched = _matched(present, stays, voxels, things, same)
    for number, stay in enumerate(stays):
        if (thing := matched.get(number)) is not None:
            seen = things[thing]
            better = seen.confidence > stay.confidence
            name, confidence = (seen.name, seen.confidence) if better else (stay.name, stay.confidence)
            stays[number] = replace(_there(stay, visit, seen.seen_s), name=name, confidence=confidence)
            continue
        views = [one for one in before[stay.first : visit if stay.gone is None else stay.gone] if len(one)]
        verdict = seen_again(voxels[number], grid, views, known, day).verdict(grid.voxel_size_m)
        if verdict is DayVerdict.GONE:
            gone = replace(stay, absent_on=(*stay.absent_on, visit))
            stays[number] = replace(gone, looked=visit, gone=visit) if stay.gone is None else gone
        elif verdict is DayVerdict.THERE and stay.gone is None:
            stays[number] = _there(stay, visit, at_s[visit])
    new: list[int] = []
    looks = dict(features)
    for number in sorted(set(range(len(things))) - set(matched.values())):
        thing = things[number]
        then = seen_before(thing.index, grid, before, known, day)
        if then is not DayVerdict.THERE:
            new.append(len(stays))
        if thing.feature is not None:
            looks[len(stays)] = thing.feature
        stay = _stay(thing, visit, appeared=then is DayVerdict.GONE)
        if stay.appeared:
            each = [seen_before(thing.index, grid, [views], known, day) for views in before]
            absent_on = tuple(one for one, verdict in enumerate(each) if verdict is DayVerdict.GONE)
            stay = replace(stay, absent_on=absent_on)
        stays.append(stay)
        voxels.append(thing.index)
    return Life.of(_moved(stays, new, looks, visit, at_s, same), voxels)


def _there(stay: Stay, visit: int, seen_s: float) -> Stay:
    return replace(stay, last=visit, looked=visit, last_seen_s=seen_s, there_on=(*stay.there_on, visit))


def _stay(thing: SeenThing, visit: int, appeared: bool) -> Stay:
    return Stay(
        name=thing.name, confidence=thing.confidence, position=thing.position, size=thing.size, color=thing.color,
        first=visit, last=visit, last_seen_s=thing.seen_s, looked=visit, appeared=appeared,
        there_on=(visit,),
    )  # fmt: skip


def _matched(
    present: Sequence[int],
    stays: Sequence[Stay],
    voxels: Sequence[Int[np.ndarray, "v 3"]],
    things: Sequence[SeenThing],
    same: SameName,
) -> dict[int, int]:
    # A name that fits counts first; what lies in the same voxels under another name is that thing named otherwise.
    keys = [np.unique(packed((np.asarray(thing.index)[:, None] + AROUND[None]).reshape(-1, 3))) for thing in things]
    own = [packed(voxels[number]) for number in present]
    value = np.zeros((len(present), len(things)))
    for row, number in enumerate(present):
        for column, thing in enumerate(things):
            far_m = (np.linalg.norm(stays[number].size) + np.linalg.norm(thing.size)) / 2 + 0.2
            if np.linalg.norm(np.subtract(stays[number].position, thing.position)) > far_m:
                continue
            shared = int(np.isin(own[row], keys[column], assume_unique=False).sum())
            smaller, larger = sorted((len(own[row]), len(thing.index)))
            part = min(shared / max(smaller, 1), 1.0)
            if same(stays[number].name, thing.name):
                value[row, column] = 1.0 + part if part >= OVERLAP else 0.0
            elif part >= SAME_PLACE and smaller >= SAME_PLACE * larger:
                value[row, column] = part
    rows, columns = linear_sum_assignment(-value)
    return {
        present[row]: int(column)
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True)
        if value[row, column] > 0.0
    }


def _moved(
    stays: list[Stay],
    new: Sequence[int],
    looks: Mapping[int, Float[np.ndarray, " d"]],
    visit: int,
    at_s: Sequence[float],
    same: SameName,
) -> list[Stay]:
    # The pairs that are most alike, in name second. They must be more alike where nobody had looked at the place of the
    # new thing, or where the other was gone before this visit; what no name fits is not followed over more than a
    # visit.
    gone = [
        number
        for number, stay in enumerate(stays)
        if stay.gone is not None and stay.moved_to is None and at_s[visit] - at_s[stay.last] <= WITHIN_S
    ]
    value = np.zeros((len(gone), len(new)))
    for row, one in enumerate(gone):
        for column, other in enumerate(new):
            alike, now = likeness(stays[one], stays[other]), stays[one].gone == visit
            if one in looks and other in looks:
                alike *= look_alike(looks[one], looks[other])
            unsure = min(stays[one].confidence, stays[other].confidence) < CONFIDENT_AT
            if unsure and not now:
                continue
            named = same(stays[one].name, stays[other].name)
            clear = named and now and stays[other].appeared
            fits = alike >= (LEAST_LIKENESS if clear else LIKENESS_UNNAMED)
            apart_m = np.linalg.norm(np.subtract(stays[one].position, stays[other].position))
            if (named or unsure) and fits and apart_m <= REACH_M:
                value[row, column] = alike + _NAMED * named
    for row, column in zip(*linear_sum_assignment(-value), strict=True):
        if value[row, column] > 0.0:
            one, other = gone[row], new[column]
            stays[one] = replace(stays[one], moved_to=other)
            stays[other] = replace(stays[other], moved_from=one)
    return stays


def look_alike(one: Float[np.ndarray, " d"], other: Float[np.ndarray, " d"]) -> float:
    """Return how alike two things look, in [0, 1]: exp(−½ ((1 − cos) / 0.25)²) of the angle between their features."""
    return float(np.exp(-0.5 * ((1.0 - float(np.dot(one, other))) / 0.25) ** 2))


def likeness(one: Stay, other: Stay) -> float:
    """Return how alike two things are by size and colour, in [0, 1].

    exp(−½ (Δ log size / 0.5)² − ½ (Δ brightness / 60)² − ½ (Δ hue / 0.25)²): the size is height, and the diagonal of
    the footprint, which turning leaves nearly as it is; the hue is RGB over its brightness, as light leaves it nearly.
    """
    x, y, z = np.array([one.size, other.size]).T
    size = np.log(np.maximum([np.hypot(x, y), z], 0.05))
    color = np.array([one.color, other.color], np.float64)
    bright = color.mean(axis=1)
    hue = color / (bright + _DARK)[:, None]
    off = float(np.square((size[:, 0] - size[:, 1]) / 0.5).sum())
    off += float(((bright[0] - bright[1]) / 60.0) ** 2 + np.square((hue[0] - hue[1]) / 0.25).mean())
    return float(np.exp(-0.5 * off))


_MOSTLY = 0.5  # a thing changed where the other days have no surface at this part of its voxels
_LOOKED = 0.25  # rays pass through this part of a group of voxels that is one thing
_BESIDE = 2  # voxels: so near to each other two are of one thing


def changed_things(
    avlmap: AVLMap,
    loose: Bool[np.ndarray, " n"],
    through: Bool[np.ndarray, " n"],
    owned: Sequence[Int[np.ndarray, " r"]],
) -> list[Thing]:
    """Return what changed, each as a thing with the likeliest name of its voxels together.

    Voxels that touch are one thing where rays of another day pass through enough of them. Of a group that is too large
    for a thing, or hardly looked at, those alone that rays pass through are. What lies beside a thing that changed is a
    part of it.
    """
    index = np.asarray(avlmap.data.voxels.index)
    changed = [rows for rows in owned if loose[rows].sum() > _MOSTLY * len(rows)]
    parts_of = Occupied.of(
        np.concatenate([np.zeros((0, 3), np.int32), *(index[rows] for rows in changed)]), avlmap.data.grid
    )
    loose = loose.copy()
    for rows in owned:
        loose[rows] = False
    if "pixels" not in avlmap.data.info.models or not (loose & through).any():
        return []
    space, namer = avlmap.space, VoxelNamer(avlmap)
    voxel_m = avlmap.data.grid.voxel_size_m
    named = np.array([name not in (*STRUCTURE, "other") for name in namer.names])

    def size_m(own: Int[np.ndarray, " k"]) -> Float[np.ndarray, "3"]:
        return np.ptp(space.level(space.centres_of(own)), axis=0) + voxel_m

    def groups(rows: Int[np.ndarray, " r"]) -> Iterator[Int[np.ndarray, " k"]]:
        which = linked(index[rows], _BESIDE)
        enough = np.bincount(which, weights=through[rows]) >= LEAST_VOXELS
        yield from (rows[which == number] for number in np.flatnonzero(enough))

    found: list[Thing] = []
    for whole in groups(np.flatnonzero(loose)):
        is_thing = size_m(whole).max() <= MOST_M and through[whole].mean() >= _LOOKED
        for own in [whole] if is_thing else groups(whole[through[whole]]):
            size = size_m(own)
            if size[2] < LOWEST_VOXELS * voxel_m or size.max() > MOST_M or not named.any():
                continue
            if parts_of.near(space.centres_of(own), _BESIDE + 0.5).any():
                continue
            share = np.where(named, namer.confidences(own).mean(axis=0), -1.0)
            best = int(share.argmax())
            likely = min(float(share[best]), CONFIDENT_AT - 0.01)
            found.append(thing_of(avlmap, namer.names[best], likely, own))
    return found
