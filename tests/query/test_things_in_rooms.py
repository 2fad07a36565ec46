"""The kind of room speaks for and against a thing that seems to stand in it, and never decides alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walled_rooms import storeys_at, two_rooms

from avlmaps.core.arrays import Float
from avlmaps.perception.protocols import RoomContents, read_room_contents
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.objects import with_rooms
from avlmaps.query.rooms import RoomField, ThingsInRooms, commonness
from avlmaps.query.settings import ObjectSettings, query_settings

FURNISHED = read_room_contents()
KINDS = ("kitchen", "bedroom")
SHARES = st.floats(0.0, 1.0)


def kitchen_and_bedroom(sure: float = 0.95) -> RoomField:
    """Two rooms with a wall between them; the left one is a kitchen."""
    plan = FloorPlan.of(two_rooms(0.0, True), storeys_at(0.0))
    assert plan is not None
    middles = plan.space.centres
    left = np.zeros(len(plan), bool)
    left[plan.voxel_cells[middles[:, 0] < 3.0]] = True
    share = np.where(left[:, None], [[sure, 1.0 - sure]], [[1.0 - sure, sure]]).astype(np.float32)
    return RoomField(plan, KINDS, share)


def nats_left_and_right(name: str, field: RoomField) -> Float[np.ndarray, "2"]:
    x = field.plan.space.centres[:, 0]
    rows = np.flatnonzero((x < 2.5) | (x > 3.5))
    nats = ThingsInRooms(field, FURNISHED).nats((name,), rows, (x[rows] > 3.0).astype(np.int64), 2)
    assert nats is not None
    return nats


@given(st.lists(SHARES, min_size=1, max_size=20), st.floats(-3, 3), st.floats(0, 1))
def test_evidence_moves_the_log_odds_and_nothing_else(confidence: list[float], nats: float, cost: float) -> None:
    before = np.array(confidence)
    after = with_rooms(before, np.full(len(before), nats), cost)
    assert (after >= 0.0).all() and (after <= 1.0).all()
    assert (np.sign(np.round(after - before, 12)) * np.sign(nats - cost) >= 0.0).all()
    inside = (before > 1e-6) & (before < 1.0 - 1e-6)
    log_odds = np.log(after[inside] / (1.0 - after[inside])) - np.log(before[inside] / (1.0 - before[inside]))
    np.testing.assert_allclose(log_odds, nats - cost, atol=1e-6)


def test_certainty_stays_certain() -> None:
    np.testing.assert_array_equal(with_rooms(np.array([0.0, 1.0]), np.array([1.0, -3.0]), 0.4), [0.0, 1.0])


@pytest.mark.parametrize(("thing", "at_home"), [("stove", 0), ("refrigerator", 0), ("bed", 1), ("wardrobe", 1)])
def test_a_thing_is_likelier_where_such_things_stand(thing: str, at_home: int) -> None:
    nats = nats_left_and_right(thing, kitchen_and_bedroom())
    assert nats[at_home] > 0.3
    assert nats[1 - at_home] < 0.0


def test_an_unsure_room_says_little() -> None:
    sure, unsure = (nats_left_and_right("stove", kitchen_and_bedroom(share)) for share in (0.95, 0.5))
    assert abs(unsure[0] - unsure[1]) < 1e-5
    assert sure[0] >= unsure[0] > sure[1] + 0.5


def test_a_kitchen_cabinet_is_a_cabinet() -> None:
    alone = RoomContents(("cabinet",), FURNISHED.kinds, FURNISHED.surface_m2[[FURNISHED.things.index("cabinet")]])
    narrow, wide = commonness(["cabinet"], KINDS, alone), commonness(["cabinet"], KINDS, FURNISHED)
    assert narrow is not None and wide is not None
    assert wide[0] > 0.0


def test_of_what_the_table_lacks_rooms_say_nothing() -> None:
    assert commonness(["spaceship"], KINDS, FURNISHED) is None
    evidence = ThingsInRooms(kitchen_and_bedroom(), FURNISHED)
    assert evidence.nats(("spaceship",), np.zeros(1, np.int64), np.zeros(1, np.int64), 1) is None


def test_no_room_says_more_than_the_limits() -> None:
    for thing in FURNISHED.things:
        nats = nats_left_and_right(thing, kitchen_and_bedroom(1.0))
        assert (nats >= -3.0).all() and (nats <= 1.0).all()


def test_the_papers_rules_do_not_consult_rooms() -> None:
    assert query_settings("paper").objects.room_weight == 0.0
    assert ObjectSettings().room_weight > 0.0
