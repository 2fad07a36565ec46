"""What became of things: matched, gone, unknown, new, moved."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from test_evidence import BACK, BOX, FRONT, GRID, MIDDLE, NOTHING, day, views

from avlmaps.core.errors import MapError
from avlmaps.days.evidence import DayViews
from avlmaps.days.life import SeenThing, begun, likeness, lived_on, look_alike
from avlmaps.days.surfaces import Occupied
from avlmaps.maps.store.life import Life, life_arrays, read_life

AWAY = np.array([20, 0, 0], np.int32)  # voxels: a metre off


def thing(index: np.ndarray = BOX, name: str = "bag", color: tuple[int, int, int] = (200, 30, 30)) -> SeenThing:
    size = tuple(((np.ptp(index, axis=0) + 1) * GRID.voxel_size_m).tolist())
    middle = tuple(GRID.centre_of(index).mean(axis=0).tolist())
    return SeenThing(name, 0.9, middle, size, color, index, 5.0)


def after(life: Life, things: list[SeenThing], now: DayViews, known: np.ndarray = BOX, visit: int = 1) -> Life:
    before = [views(FRONT, MIDDLE, 1.9)] * visit
    at_s = [1e5 * (number + 1) for number in range(visit + 1)]
    surface = np.concatenate([NOTHING, *(one.index for one in things)])
    return lived_on(life, things, day(now, surface), before, Occupied.of(known, GRID), visit, at_s, GRID)


def test_a_thing_seen_again_lives_on() -> None:
    (stay,) = after(begun([thing()]), [thing(BOX + 1)], views(FRONT, MIDDLE, 4.0)).stays
    assert (stay.first, stay.last, stay.looked, stay.gone) == (0, 1, 1, None)


@pytest.mark.parametrize(("place", "free_m"), [(FRONT, 1.0), (BACK, 4.0)])
def test_not_seen_is_not_gone(place: list, free_m: float) -> None:
    (stay,) = after(begun([thing()]), [], views(place, MIDDLE, free_m)).stays
    assert (stay.last, stay.looked, stay.gone) == (0, 0, None) and stay.is_there(1)


def test_what_is_looked_through_is_gone_from_that_day_on() -> None:
    (stay,) = after(begun([thing()]), [], views(FRONT, MIDDLE, 4.0)).stays
    assert (stay.last, stay.gone) == (0, 1)
    assert stay.is_there(0) and not stay.is_there(1) and not stay.is_there(5)


def test_a_perception_that_misses_a_thing_does_not_lose_it() -> None:
    life = begun([thing()])
    before = [views(FRONT, MIDDLE, 1.9)]
    now = day(views(FRONT, MIDDLE, 1.8), BOX)  # its surface, and no name
    (stay,) = lived_on(life, [], now, before, Occupied.of(BOX, GRID), 1, [1e5, 2e5], GRID).stays
    assert (stay.last, stay.looked, stay.gone) == (1, 1, None)


def moved_to(other: SeenThing) -> tuple:
    """Return what is known when the bag's place is empty and another thing stands a metre off, where it was empty."""
    wide = [*FRONT, (2.0, 1.0, 0.3)]
    before = [views(wide, (0.65, 0.15, 0.15), 6.0)]
    life = begun([thing()])
    now = day(views(wide, (0.65, 0.15, 0.15), 6.0), other.index)
    return lived_on(life, [other], now, before, Occupied.of(BOX, GRID), 1, [1e5, 2e5], GRID).stays


def test_an_alike_thing_elsewhere_is_the_one_that_is_gone() -> None:
    old, new = moved_to(thing(BOX + AWAY))
    assert (old.gone, old.moved_to, new.moved_from, new.appeared) == (1, 1, 0, True)


@pytest.mark.parametrize(
    "other", [thing(BOX + AWAY, "chair"), thing(BOX + AWAY, color=(10, 10, 250)), thing((BOX * [4, 4, 5]) + AWAY)]
)
def test_another_one_is_not(other: SeenThing) -> None:
    old, new = moved_to(other)
    assert old.gone == 1 and (old.moved_to, new.moved_from) == (None, None)


def followed(cosine: float, visit: int = 1, named: float = 0.2) -> bool:
    """Return whether a stool is known to be the chair of a visit, the cosine between their looks being this."""
    wide, place = [*FRONT, (2.0, 1.0, 0.3)], (0.65, 0.15, 0.15)
    look = np.array([cosine, np.sqrt(1.0 - cosine**2)])
    before = [views(wide, place, 6.0)] * visit
    life, features = begun([thing(BOX, "stool")]), {0: np.array([1.0, 0.0])}
    life = Life.of([msgspec.structs.replace(life.stays[0], gone=visit - 1 or None, confidence=named)], [BOX])
    new = replace(thing(BOX + AWAY, "chair"), confidence=named, feature=look)
    at_s = [1e5 * (number + 1) for number in range(visit + 1)]
    now = day(views(wide, place, 6.0), new.index)
    stays = lived_on(life, [new], now, before, Occupied.of(BOX, GRID), visit, at_s, GRID, features=features).stays
    return stays[0].moved_to == 1 and stays[1].moved_from == 0


def test_what_no_name_fits_is_followed_by_its_looks_from_a_day_to_the_next() -> None:
    assert followed(0.9) and not followed(0.6), "looks decide where names are doubtful"
    assert not followed(0.9, named=0.8), "two names that are sure are two things"
    assert not followed(1.0, visit=2), "gone before this visit, and doubtful"


def test_looks_count_less_the_more_they_differ() -> None:
    cosines = np.linspace(-1.0, 1.0, 21)
    alike = [look_alike(np.array([1.0, 0.0]), np.array([c, np.sqrt(max(1.0 - c * c, 0.0))])) for c in cosines]
    assert alike[-1] == 1.0 and np.all(np.diff(alike) > 0.0)


def test_a_small_thing_that_is_looked_through_is_gone() -> None:
    small = BOX[:14]
    (stay,) = after(begun([thing(small)]), [], views(FRONT, MIDDLE, 4.0), known=small).stays
    assert stay.gone == 1


def test_likeness_is_symmetric_and_one_for_the_same() -> None:
    (one,), (other,) = begun([thing()]).stays, begun([thing(color=(150, 40, 30))]).stays
    assert likeness(one, one) == 1.0 and likeness(one, other) == likeness(other, one) < 1.0


def test_a_life_is_stored_whole_and_a_damaged_one_is_said() -> None:
    life = after(begun([thing()]), [thing(BOX + AWAY, "chair")], views(FRONT, MIDDLE, 4.0))
    arrays = life_arrays(life)
    again = read_life(arrays, "life")
    assert again.stays == life.stays and np.array_equal(again.voxels(1), BOX + AWAY)
    for name, broken in (("stays", arrays["stays"][:-3]), ("offsets", arrays["offsets"][:-1]), ("index", BOX[:2])):
        with pytest.raises(MapError, match="damaged"):
            read_life({**arrays, name: broken}, "life")
    assert msgspec.structs.replace(life.stays[0], name="person").is_person


def test_each_day_that_looked_is_counted_and_no_other() -> None:
    seen, empty, blind = views(FRONT, MIDDLE, 1.9), views(FRONT, MIDDLE, 4.0), views(BACK, MIDDLE, 4.0)
    life = after(begun([thing()]), [thing(BOX + 1)], seen, visit=1)
    life = after(life, [], blind, visit=2)
    life = after(life, [], empty, visit=3)
    life = after(life, [], empty, visit=4)
    (stay,) = life.stays
    assert (stay.there_on, stay.absent_on, stay.gone) == ((0, 1), (3, 4), 3)
    assert (stay.days_there, stay.days_absent) == ({0, 1}, {3, 4})
