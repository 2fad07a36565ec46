"""The benchmark of rooms: oracles in closed form, and what makes one room of two areas."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_sim.bench.harness.figures import median_interval
from avlmaps_sim.bench.rooms.suite import CELL_M, Floor, Listed, floors_of, judged
from avlmaps_sim.scene import Area

KITCHEN = Area("kitchen", np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]))
LIVING = Area("living room", np.array([[4.0, 0.0], [9.0, 0.0], [9.0, 3.0], [4.0, 3.0]]))
CAMERA = np.array([[1.0, 1.0, 1.3]])


def true_floor(opening_m: float, join: bool = True, shown: float = 9.0) -> Floor:
    """Two areas side by side; the wall between them leaves an opening, and the map shows all up to an x."""
    y = np.arange(opening_m, 3.0, 0.05)
    walls = np.concatenate([np.c_[np.full(len(y), 4.0), y, np.full(len(y), z)] for z in (1.3, 1.6)])
    x, y = np.meshgrid(np.arange(0.05, shown, 0.1), np.arange(0.05, 3.0, 0.1))
    (floor,) = floors_of([KITCHEN, LIVING], walls, np.c_[x.ravel(), y.ravel(), np.zeros(x.size)], CAMERA, join)
    return floor


def oracle(floor: Floor) -> list[Listed]:
    masks = [floor.label == number for number in range(len(floor.kinds))]
    return [Listed(kinds[0], mask, mask.sum() * CELL_M**2) for kinds, mask in zip(floor.kinds, masks, strict=True)]


@pytest.mark.parametrize(("opening_m", "rooms"), [(0.9, 2), (2.0, 2), (2.6, 1), (3.0, 1)])
def test_an_opening_wider_than_a_door_makes_one_room(opening_m: float, rooms: int) -> None:
    floor = true_floor(opening_m)
    assert len(floor.kinds) == rooms
    assert (("kitchen", "living room") in floor.kinds) == (rooms == 1)
    assert len(true_floor(opening_m, join=False).kinds) == 2


def test_an_oracle_is_right_and_a_map_without_rooms_is_not() -> None:
    floor = true_floor(0.9)
    right = judged("home", [floor], [oracle(floor)])
    assert [(room.overlap, room.is_named) for room in right.rooms] == [(1.0, True)] * 2 and right.listed == 2
    assert max(room.area_error for room in right.rooms) == pytest.approx(0.0)
    nothing = judged("home", [floor], [[]])
    assert [(room.overlap, room.is_named) for room in nothing.rooms] == [(0.0, False)] * 2 and nothing.listed == 0


@given(st.integers(0, 10_000))
def test_order_does_not_matter_and_no_overlap_is_counted_twice(seed: int) -> None:
    rng, floor = np.random.default_rng(seed), true_floor(0.9)
    listed = [Listed("kitchen", floor.mask(box(rng)), 1.0) for _ in range(3)]
    one, other = (judged("home", [floor], [order]) for order in (listed, listed[::-1]))
    assert sum(room.overlap for room in one.rooms) == pytest.approx(sum(room.overlap for room in other.rooms))
    assert all(0.0 <= room.overlap <= 1.0 for room in one.rooms)
    alone = judged("home", [floor], [listed[:1]])
    assert sum(room.overlap > 0.0 for room in alone.rooms) <= 1


def box(rng: np.random.Generator) -> np.ndarray:
    (x, y), (w, d) = rng.uniform([0, 0], [7, 2]), rng.uniform(0.5, 3.0, 2)
    return np.array([[x, y, 0], [x + w, y, 0], [x + w, y + d, 0], [x, y + d, 0.0]])


def test_a_room_that_the_map_does_not_show_counts_neither_way() -> None:
    floor = true_floor(0.9, shown=4.0)
    found = judged("home", [floor], [oracle(floor)])
    assert [room.kinds for room in found.rooms] == [("kitchen",)] and found.listed == 1


def test_the_median_lies_in_its_interval() -> None:
    middle, low, high = median_interval(np.arange(101.0))
    assert middle == 50.0 and low == pytest.approx(40.0, abs=1.0) and high == pytest.approx(61.0, abs=1.0)
