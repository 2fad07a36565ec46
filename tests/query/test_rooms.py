"""Kinds of room: views and things vote, walls bound them, and neither order nor absent things matter."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import FakePixels, FakeSounds, asked, fake_encoders, fake_map, keyframes_at, voxels_of
from walled_rooms import storeys_at, two_rooms, two_rooms_index

from avlmaps.perception.protocols import ModelCard, RoomContents, read_room_contents
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import Room, Whereabouts, own_names, parts_of
from avlmaps.query.factors import NearAnchors
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.lists import extreme_shares
from avlmaps.query.places import describe_place
from avlmaps.query.rooms import InRooms, NamedVoxels, RoomField, Rooms, voting_rows
from avlmaps.query.selection import MapLists, Wanted, page_of_things
from avlmaps.query.settings import QuerySettings, RoomSettings, query_settings
from avlmaps.view.labels import Labels
from avlmaps.view.layout import Layout

KINDS = ("kitchen", "bedroom", "bathroom")
LEFT, RIGHT = np.array([[1.0, 1.5, 1.2]]), np.array([[5.0, 1.5, 1.2]])
KITCHEN, BEDROOM = np.array([[0.8, 0.1, 0.1]]), np.array([[0.1, 0.8, 0.1]])
FURNISHED = read_room_contents()
VIEWS_ALONE = RoomSettings(thing_weight=0.0)


def rooms_of(
    places: np.ndarray,
    door_m: float = 0.0,
    wall: bool = True,
    settings: RoomSettings = VIEWS_ALONE,
    named: NamedVoxels | None = None,
) -> Rooms:
    plan = FloorPlan.of(two_rooms(door_m, wall), storeys_at(0.0))
    assert plan is not None
    return Rooms(plan, places, lambda: named, settings)


def things_at(rooms: FloorPlan, point: np.ndarray, name: str, count: int = 400) -> NamedVoxels:
    """Return voxels about a point that are surely a thing."""
    away = np.linalg.norm(rooms.space.centres - point, axis=1)
    rows = np.argsort(away, kind="stable")[:count]
    return NamedVoxels(rows, (name,), np.ones((count, 1), np.float32), 0.0025, FURNISHED)


def views(seed: int, count: int = 9) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.dirichlet(np.ones(3), count), rng.uniform([0.3, 0.3, 0.3], [5.7, 2.7, 2.0], (count, 3))


@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.8]))
def test_every_place_has_a_distribution_and_views_have_no_order(seed: int, door_m: float) -> None:
    share, places = views(seed)
    field = rooms_of(places, door_m).field(KINDS, share)
    np.testing.assert_allclose(field.share.sum(axis=1), 1.0, rtol=1e-5)
    assert field.share.min() >= 0.0
    order = np.random.default_rng(seed + 1).permutation(len(share))
    again = rooms_of(places[order], door_m).field(KINDS, share[order])
    np.testing.assert_allclose(again.share, field.share, atol=1e-4)


def test_a_wall_keeps_a_view_in_its_room_and_an_open_plan_does_not() -> None:
    places, share = np.r_[LEFT, RIGHT], np.r_[KITCHEN, BEDROOM]
    beside = np.array([[2.8, 1.5, 1.2], [3.2, 1.5, 1.2]])
    walled = rooms_of(places).field(KINDS, share).at(beside)
    np.testing.assert_allclose(walled[0], KITCHEN[0], atol=0.05)
    np.testing.assert_allclose(walled[1], BEDROOM[0], atol=0.05)
    mixed = rooms_of(places, wall=False).field(KINDS, share).at(beside)
    assert abs(mixed[0, 0] - mixed[1, 0]) < 0.4 < walled[0, 0] - walled[1, 0]


def test_a_lone_view_counts_once_and_views_that_agree_count_more() -> None:
    alone = rooms_of(LEFT).field(KINDS, KITCHEN).at(LEFT)[0]
    np.testing.assert_allclose(alone, KITCHEN[0], atol=0.06)  # walls reflect it
    several = rooms_of(np.repeat(LEFT, 4, axis=0)).field(KINDS, np.repeat(KITCHEN, 4, axis=0)).at(LEFT)[0]
    assert several[0] > alone[0] + 0.05


def test_far_from_all_views_any_kind_is_as_likely() -> None:
    field = rooms_of(LEFT).field(KINDS, KITCHEN)
    np.testing.assert_allclose(field.at(RIGHT)[0], 1 / 3, atol=1e-3)


@pytest.mark.parametrize(("thing", "kind"), [("bed", "bedroom"), ("stove", "kitchen"), ("toilet", "bathroom")])
def test_a_thing_decides_where_views_do_not(thing: str, kind: str) -> None:
    unsure = np.full((2, 3), 1 / 3)
    places = np.r_[LEFT, RIGHT]
    plan = rooms_of(places).plan
    rooms = rooms_of(places, settings=RoomSettings(), named=things_at(plan, LEFT[0], thing))
    field = rooms.field(KINDS, unsure)
    assert KINDS[int(field.at(LEFT)[0].argmax())] == kind
    assert field.at(LEFT)[0].max() > 0.6
    np.testing.assert_allclose(field.at(RIGHT)[0], 1 / 3, atol=1e-3)


def test_all_the_things_of_a_place_say_no_more_than_the_limit() -> None:
    plan = rooms_of(LEFT).plan
    few, many = (things_at(plan, LEFT[0], "bed", count) for count in (40, 4000))
    limit = RoomSettings().most_nats
    votes = [
        rooms_of(LEFT, settings=RoomSettings(), named=named).thing_votes(KINDS)[plan.cells_of(LEFT)[0]]
        for named in (few, many)
    ]
    assert 0.0 < np.ptp(votes[0]) < np.ptp(votes[1]) <= limit
    assert (rooms_of(LEFT, named=many).thing_votes(KINDS) == 0.0).all(), "their weight is 0"


def test_walls_and_floors_say_nothing() -> None:
    plan = rooms_of(LEFT).plan
    rooms = rooms_of(LEFT, settings=RoomSettings(), named=things_at(plan, LEFT[0], "wall"))
    assert (rooms.thing_votes(KINDS) == 0.0).all()


def test_a_map_without_names_lets_views_vote() -> None:
    share, places = views(3)
    with_none = rooms_of(places, settings=RoomSettings(), named=None).field(KINDS, share)
    np.testing.assert_array_equal(with_none.share, rooms_of(places).field(KINDS, share).share)


@given(st.integers(1, 400_000), st.integers(1, 200_000))
def test_voters_are_few_enough_and_stand_for_all(count: int, products: int) -> None:
    index = np.stack([np.arange(count) % 97, np.arange(count) % 89, np.arange(count) // 97], axis=1)
    rows, every = voting_rows(index, products)
    assert len(rows) * products <= 1.3 * 200_000_000 + 2 * products * np.ptp(index.sum(axis=1))
    assert (index[rows].sum(axis=1) % every == 0).all()
    if every == 1:
        assert len(rows) == count


class NamedPixels(FakePixels):
    """Knows its scale, so that its scores are probabilities."""

    logit_scale = 20.0


class OpenViews:
    """Any of four names is an axis."""

    card = ModelCard("fake/open", 5, "MIT", "0")
    logit_scale = 6.0
    known = ("kitchen", "bedroom", "bathroom", "office")

    def encode(self, frames: Sequence[object]) -> np.ndarray:
        return np.zeros((len(frames), 5), np.float32)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        rows = np.zeros((len(words), 5), np.float32)
        for row, word in zip(rows, words, strict=True):
            row[self.known.index(word) if word in self.known else 4] = 1.0
        return rows


def home(
    settings: QuerySettings | None = None,
    door_m: float = 0.8,
    things: bool = True,
    two_kitchens: bool = False,
    clocks: Sequence[tuple[int, int]] = (),
) -> AVLMap:
    """A kitchen on the left and a bedroom with a bed on the right, which views hardly tell apart.

    Or, on the right, a second kitchen with a stove. Clocks are 20 cm wide, at x and y in voxels.
    """
    bed = np.argwhere(np.ones((30, 24, 8), bool)) + np.array([80, 18, 1])
    encoder = NamedPixels(("wall", "bed", "stove", "clocks"))
    thing = "stove" if two_kitchens else "bed"
    clock = [np.argwhere(np.ones((4, 4, 6), bool)) + np.array([x, y, 30]) for x, y in clocks]
    whole = np.concatenate([*clock, bed, two_rooms_index(door_m)])
    named = ["clocks"] * sum(map(len, clock)) + [thing if things else "wall"] * len(bed)
    index, first = np.unique(whole, axis=0, return_index=True)
    words = [named[row] if row < len(named) else "wall" for row in first.tolist()]
    places = np.array([[x, y, 1.2] for x in (0.2, 0.8, 3.6, 4.2) for y in (0.8, 2.2)])
    view = OpenViews().encode_words(["kitchen"] * 4 + ["office"] * 4)
    view[:4] += 0.3 * OpenViews().encode_words(["bedroom"])
    view[4:] += 0.7 * OpenViews().encode_words(["bedroom"])
    if two_kitchens:
        view[4:] = OpenViews().encode_words(["kitchen"] * 4)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    voxels = voxels_of(index, encoder.encode_words(words))
    encoders = fake_encoders(encoder, FakeSounds(), OpenViews())
    stored = fake_map(voxels, keyframes=keyframes_at(places, view), encoders=encoders)
    stored.data.info.models = ("views", "pixels")
    return asked(stored, settings=settings)


def test_a_bed_makes_the_bedroom() -> None:
    with_bed, without = home(door_m=0.0), home(door_m=0.0, things=False)
    right, left = np.array([[4.5, 1.5, 0.4]]), np.array([[1.0, 1.5, 0.4]])
    assert with_bed.area("bedroom").factors[0].at(right)[0] > without.area("bedroom").factors[0].at(right)[0] + 0.2
    assert with_bed.area("bedroom").found and not without.area("bedroom").found
    assert with_bed.area("bedroom").factors[0].at(left)[0] < 0.2
    goal = with_bed.area("bedroom", primary=True).goals(1)[0]
    assert goal.position[0] > 3.0


def test_context_heat_is_even_in_its_room_and_ends_at_the_wall() -> None:
    m = home(door_m=0.0)
    factor = m.area("kitchen").factors[0]
    assert isinstance(factor, InRooms)
    heat = m.area("kitchen").values
    x, y = m.points[:, 0], m.points[:, 1]
    inside = (y > 0.3) & (y < 2.7)
    assert heat[inside & (x > 0.3) & (x < 2.8)].min() > 3.0 * heat[inside & (x > 3.3) & (x < 5.6)].max()
    np.testing.assert_allclose(factor.at(m.points), heat, atol=1e-6)
    anchors = factor.anchor_of(np.flatnonzero(inside & (x < 2.8)))
    assert (factor.anchors[anchors, 0] < 3.0).all()


def test_a_query_for_a_thing_in_a_room_takes_the_one_behind_the_right_wall() -> None:
    m = home(door_m=0.0)
    product = m.object("bed", primary=True) * m.area("bedroom")
    elsewhere = m.object("bed", primary=True) * m.area("kitchen")
    assert product.peak > 2.0 * elsewhere.peak


def test_the_rooms_of_the_map_are_listed_by_walls() -> None:
    rooms = home(door_m=0.0).rooms()
    assert sorted(room.name for room in rooms) == ["bedroom", "kitchen"]
    assert {room.name: room.views for room in rooms} == {"kitchen": 4, "bedroom": 4}
    for room in rooms:
        told = room.to_json(("kitchen 1",))
        assert told["probability"] == told["confidence"] == told["names"][0]["probability"]
        assert told["area_m2"] == pytest.approx(8.6, abs=1.0) and len(told["outline"]) >= 4


def test_one_of_two_kitchens_is_asked_for_by_the_number_that_the_lists_give_it() -> None:
    m = home(door_m=0.0, two_kitchens=True)
    x, y = m.points[:, 0], m.points[:, 1]
    inside, sides = (y > 0.3) & (y < 2.7), {False: (x > 0.3) & (x < 2.8), True: (x > 3.3) & (x < 5.6)}
    names = {room.to_json((name,))["room"]: room for room, name in zip(m.rooms(), m.where.names, strict=True)}
    assert set(names) == {"kitchen 1", "kitchen 2"} == set(m.where.numbered)
    for name, room in names.items():
        is_right = room.position[0] > 3.0
        heat = m.area(name).values
        assert (heat[inside & sides[is_right]] == 1.0).all() and (heat[inside & sides[not is_right]] == 0.0).all()
        (goal,) = m.ask(f"where is {name}?").goals
        assert (goal.position[0] > 3.0) == is_right and goal.size[0] < 3.0
        stove = m.ask(f"the stove in {name}")
        assert stove.found == is_right and f"in {name}" in stove.text
        assert ("stove" in m.ask(f"what is in {name}?").text) == is_right
    assert not m.ask("the stove in kitchen 3").found and m.ask("the stove in the kitchen").found
    assert {name for name, _ in own_names(m, "go to kitchen 2")} == set(names)
    for counting in ("the stove", "turn left 2 times", "go to the kitchen 2 m ahead", "drive 2.5 m"):
        assert own_names(m, counting) == ()
    m.forget_edits()
    assert "where" not in vars(m)


def test_a_thing_is_in_one_room_and_counts_add_up() -> None:
    """Wherever it hangs: in a room, at the wall between two, or in it."""
    places = [(5, 8), (29, 32), (53, 8), (56, 24), (59, 40), (62, 50), (69, 48), (93, 8)]  # the wall is from 58 to 62
    m = home(door_m=0.0, clocks=places)
    rooms = [room.name for room in m.rooms()]
    assert sorted(rooms) == ["bedroom", "kitchen"]
    listed = [thing for thing in m.contents().things if thing.name == "clocks"]
    whole = m.ask("how many clocks are there").count
    counts = [m.ask(f"how many clocks are in the {room}").count for room in rooms]
    assert len(listed) == whole == sum(count or 0 for count in counts) == len(places)
    for room, count in zip(rooms, counts, strict=True):
        inside = [thing.position for thing in listed if thing.room == room]
        assert [thing.position for thing in m.things(["clocks"], room=room)] == inside and len(inside) == count
        found = [goal for goal in m.ask(f"the clocks in the {room}", top=20).goals if goal.probability >= 0.5]
        assert len(found) == count
        assert all(np.linalg.norm(np.subtract(inside, goal.position), axis=1).min() < 0.2 for goal in found)
        answered = m.ask(f"what is in the {room}", top=40)
        assert [goal.position for goal in answered.goals if goal.name == "clocks"] == inside


def test_near_what_lies_in_another_room_has_a_note() -> None:
    m = home(door_m=0.0)
    pages = [page_of_things(MapLists(m), Wanted(room=room, near="bed")) for room in ("kitchen", "bedroom")]
    assert [page.get("notes", []) for page in pages][1] == []
    (note,) = pages[0]["notes"]  # pyright: ignore[reportTypedDictNotRequiredAccess]
    assert "No bed lies in the kitchen" in note and "bedroom" in note


def test_a_superlative_is_no_surer_than_what_it_rests_on() -> None:
    m = home(door_m=0.0)
    for words in ("the smallest room", "the largest room"):
        goals = m.ask(words).goals
        names = {room.name: room.confidence for room in m.rooms()}
        assert all(goal.probability <= names[goal.name] for goal in goals)
        assert sum(goal.probability for goal in goals) <= 1.001, "one room is the smallest"
        assert "does not tell these sizes apart" in m.ask(words).text, "they are of one size"


@given(st.lists(st.floats(1.0, 100.0), min_size=1, max_size=6), st.booleans())
def test_the_smallest_of_rooms_is_one_of_them(sizes: list[float], smallest: bool) -> None:
    shares = extreme_shares(np.array(sizes), smallest=smallest)
    assert shares.sum() == pytest.approx(1.0) and shares.min() >= 0.0
    best = min(sizes) if smallest else max(sizes)
    assert shares[sizes.index(best)] == pytest.approx(shares.max(), abs=0.02)


def test_each_voxel_has_the_colour_of_its_room_and_a_question_its_things() -> None:
    m = home(door_m=0.0)
    layout = Layout(m)
    labels, x = Labels.of(layout), m.points[layout.order, 0]
    left, right = labels.voxels[x < 2.8, 1], labels.voxels[x > 3.2, 1]
    assert np.median(left) != np.median(right) and {*np.unique(left)} == {np.median(left)}
    where = m.where
    assert [room.area_m2 for room in where.rooms] == pytest.approx([8.6, 8.6], abs=1.0)
    np.testing.assert_array_equal(where.inside("kitchen", np.r_[LEFT, RIGHT]), [True, False])


def test_an_open_plan_is_one_room_of_two_parts_and_all_tell_it_alike() -> None:
    m = home(door_m=2.8, things=False, clocks=[(5, 8), (29, 32), (93, 8)])
    (room,) = m.rooms()
    assert set(room.parts) == {"kitchen", "office"} and room.name == " and ".join(room.parts)
    where, ends = m.where, np.array([[0.6, 1.5, 1.0], [4.6, 1.5, 1.0]])
    assert where.inside(room.name, ends).all() and (room.area_m2 or 0.0) > 16.0
    assert [where.inside(part, ends).tolist() for part in ("kitchen", "office")] == [[True, False], [False, True]]
    assert m.ask("how many rooms are there").count == 1 and room.name in m.ask("how many rooms are there").text
    listed = [thing for thing in m.contents().things if thing.name == "clocks"]
    for part, likely in room.names:
        answer = m.ask(f"where is the {part}")
        assert answer.found and answer.probability == pytest.approx(likely, abs=2e-3) and likely >= room.confidence
        inside = [thing.position for thing in listed if thing.room == part]
        assert inside == [thing.position for thing in m.things(["clocks"], room=part)]
        assert len(inside) == m.ask(f"how many clocks are in the {part}").count
        goals = m.ask(f"what is in the {part}", top=40).goals
        assert [goal.position for goal in goals if goal.name == "clocks"] == inside
    assert {thing.room for thing in listed} == set(room.parts)
    page = page_of_things(MapLists(m), Wanted(room="kitchen"))["things"]
    assert page and {row.get("room") for row in page} == {"kitchen"}


def test_the_papers_rules_know_no_walls_and_no_things() -> None:
    one, other = home(query_settings("paper")), home(query_settings("paper"), door_m=0.0, things=False)
    for m in (one, other):
        factor = m.area("bedroom").factors[0]
        assert type(factor) is NearAnchors
    np.testing.assert_array_equal(one.area("bedroom").factors[0].scores, other.area("bedroom").factors[0].scores)


def test_an_encoder_that_was_tried_out_in_rooms_says_what_its_names_mean() -> None:
    """What this one calls a bed stands in kitchens."""

    class Surveyed(NamedPixels):
        room_contents = RoomContents(("bed",), ("kitchen", "bedroom"), np.array([[3.0, 0.1]]))

    m = home()
    surveyed = Surveyed(("wall", "bed", "stove", "clocks"))
    m.encoders = m.encoders.having(pixels=surveyed)
    right = np.array([[4.5, 1.5, 0.4]])
    assert m.area("bedroom").factors[0].at(right)[0] < home().area("bedroom").factors[0].at(right)[0]


def test_a_map_of_another_pixel_encoder_lets_views_vote() -> None:
    from avlmaps.core.errors import MapError
    from avlmaps.core.registry import Kind

    m, bare = home(), home(things=False)

    def require(kind: Kind) -> None:
        if kind is Kind.PIXELS:
            raise MapError("built with other pixels")

    m.require_model = require
    right = np.array([[4.5, 1.5, 0.4]])
    assert m.area("bedroom").factors[0].at(right) == pytest.approx(bare.area("bedroom").factors[0].at(right), abs=0.02)


def test_a_field_is_named_by_its_kinds() -> None:
    field = rooms_of(LEFT).field(KINDS, KITCHEN)
    assert isinstance(field, RoomField) and field.kinds == KINDS
    assert field.of_cells(np.array([1.0, 1.0, 1.0])) == pytest.approx(1.0, abs=1e-5)


def test_a_place_outside_of_the_map_is_in_no_room() -> None:
    m = home(door_m=0.0)
    rooms = [describe_place(m, np.array([x, 1.5, 0.4]))["rooms"] for x in (4.5, 6.8, 8.0, 900.0)]
    assert rooms[0][0]["name"] == "bedroom" and [bool(one) for one in rooms] == [True, True, False, False]


def test_the_largest_room_is_the_same_from_everywhere() -> None:
    m = home(door_m=0.0)
    answer = m.ask("which is the largest room?")
    assert len(answer.goals) == 2
    for goal in answer.goals:
        near = m.ask("which is the largest room?", near=goal.position)
        assert (near.goals, near.text) == (answer.goals, answer.text) and "order of its own" in near.notes[-1]


def test_an_open_plan_is_named_by_its_parts_also_where_one_of_them_has_a_number() -> None:
    def room(*kinds: str) -> Room:
        names = tuple((kind, 0.9) for kind in kinds)
        return Room(" and ".join(kinds), 0.9, (0.0, 0.0, 0.0), 1, np.zeros((1, 3)), names, kinds if kinds[1:] else ())

    where = object.__new__(Whereabouts)
    where.rooms = (room("living room", "kitchen"), room("living room"))
    where.parts = parts_of(where.rooms)
    where.names = ("living room 1 and kitchen", "living room 2")
    asked = ("living room and kitchen", "the living room 1 and kitchen", "kitchen", "living room 2", "living room")
    assert list(map(where.numbers_of, asked)) == [[0], [0], [0], [1], [0, 1]]
