"""Listing what a map holds: things, sounds and rooms against a furnished map whose contents are known."""

import re
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import (
    FakePixels,
    FakeSounds,
    FakeViews,
    asked,
    box,
    fake_encoders,
    fake_map,
    furnished_map,
    sounds_of,
    voxels_of,
)
from walled_rooms import storeys_at, two_rooms

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Role
from avlmaps.language.intents import Target, TargetKind
from avlmaps.language.list_questions import Listed, ListQuestion
from avlmaps.perception.embedded.pixels import EmbeddedPixels, features_of
from avlmaps.query.answer import Answer, PartAnswer
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import SoundEvent, Thing, find_things
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.goals import Goal
from avlmaps.query.lists import answer_list
from avlmaps.query.objects import Instances
from avlmaps.query.selection import MapLists, Wanted, page_of_things
from avlmaps.query.settings import QuerySettings


@pytest.fixture
def furnished() -> AVLMap:
    track = np.array([[1.0, 1.0, 1.0], [2.0, 1.0, 1.0]])
    return furnished_map(sounds=sounds_of([track], [0.8]))


def test_each_thing_is_listed_once_with_its_voxels(furnished: AVLMap) -> None:
    things = furnished.things(least_confidence=0.3)
    assert sorted(thing.name for thing in things) == ["chair", "chair", "table"]
    chair = max((thing for thing in things if thing.name == "chair"), key=lambda thing: len(thing.rows))
    assert len(chair.points) == len(chair.rows) == 4 * 4 * 8
    assert chair.size == pytest.approx((0.2, 0.2, 0.4))
    assert chair.position == pytest.approx((0.6, 0.6, 0.25), abs=0.06)
    assert chair.color == (120, 90, 60)


def test_things_share_no_voxel_and_the_most_confident_come_first(furnished: AVLMap) -> None:
    things = furnished.things(least_confidence=0.0, structure=True)
    rows = np.concatenate([thing.rows for thing in things])
    assert len(np.unique(rows)) == len(rows)
    assert [t.confidence for t in things] == sorted((t.confidence for t in things), reverse=True)


def test_structure_is_listed_on_request_alone(furnished: AVLMap) -> None:
    assert "floor" not in {thing.name for thing in furnished.things(least_confidence=0.0)}
    assert "floor" in {thing.name for thing in furnished.things(least_confidence=0.0, structure=True)}


def test_two_names_of_one_thing_are_one_thing() -> None:
    encoder = FakePixels(("chair", "seat"))
    index = box((0, 0, 0), (6, 6, 8))
    feature = np.tile(encoder.encode_words(["chair"]) * 0.8 + encoder.encode_words(["seat"]) * 0.6, (len(index), 1))
    things = asked(fake_map(voxels_of(index, feature), encoders=fake_encoders(encoder))).things(
        ["chair", "chair seat", "seat"], least_confidence=0.0
    )
    assert len(things) == 1


def test_a_narrower_thing_answers_to_the_wider_name_and_is_listed_by_its_own() -> None:
    encoder = EmbeddedPixels()
    index = np.r_[box((0, 0, 0), (10, 10, 16)), box((40, 0, 0), (50, 10, 16))]
    likely = np.zeros((len(index), len(encoder.names)))
    for rows, name in ((np.s_[:1600], "office chair"), (np.s_[1600:], "sofa")):
        likely[rows, encoder.names.index(name)] = 0.9
        likely[rows, encoder.names.index("other")] = 0.1
    stored = fake_map(voxels_of(index, features_of(likely, encoder.codes)), encoders=fake_encoders(encoder))
    avlmap = asked(stored)
    chair, exact = (avlmap.object(word, primary=True) for word in ("chair", "office chair"))
    assert chair.found and exact.found
    assert chair.goals(1)[0].position == exact.goals(1)[0].position
    assert [thing.name for thing in avlmap.things()].count("office chair") == 1
    assert {thing.name for thing in avlmap.things()} == {"office chair", "sofa"}
    assert not avlmap.object("armchair", primary=True).found, "an office chair is no armchair"


def test_what_is_surely_a_chair_but_of_no_sure_kind_is_listed_as_a_chair() -> None:
    encoder = EmbeddedPixels()
    index = box((0, 0, 0), (5, 5, 10))
    likely = np.zeros((len(index), len(encoder.names)))
    for name, share in (("chair", 0.3), ("office chair", 0.3), ("armchair", 0.3), ("other", 0.1)):
        likely[:, encoder.names.index(name)] = share
    avlmap = asked(fake_map(voxels_of(index, features_of(likely, encoder.codes)), encoders=fake_encoders(encoder)))
    chairs = avlmap.instances("chair")
    assert avlmap.instances("chair", alone=True).best < 0.5 < chairs.best
    for least in (0.0, 0.5):
        (chair,) = avlmap.things(least_confidence=least)
        assert (chair.name, len(chair.rows)) == ("chair", len(index))
        assert chair.confidence == pytest.approx(chairs.best, abs=1e-3)


@pytest.mark.parametrize("least", [-0.1, 1.5, float("nan")])
def test_a_confidence_outside_zero_to_one_is_refused(furnished: AVLMap, least: float) -> None:
    with pytest.raises(QueryError, match="between 0 and 1"):
        furnished.things(least_confidence=least)


def test_sounds_have_names_times_and_the_robots_positions(furnished: AVLMap) -> None:
    (sound,) = furnished.sounds()
    assert sound.names == ("dog",)
    assert sound.confidences == pytest.approx((0.8,))
    assert (sound.onset_s, sound.offset_s) == (0.0, 0.5)
    assert sound.position == pytest.approx((1.5, 1.0, 1.0))
    assert sound.track.shape == (2, 3)


def test_an_empty_map_holds_nothing() -> None:
    encoders = fake_encoders(FakePixels(("chair",)), FakeSounds(), FakeViews())
    nothing = asked(fake_map(voxels_of(np.zeros((0, 3), int), np.zeros((0, 2))), encoders=encoders))
    assert (nothing.things(), nothing.sounds(), nothing.rooms()) == ([], [], [])
    assert nothing.points.shape == (0, 3)


def test_a_side_is_neither_yes_nor_no_and_a_choice_is_no_yes(furnished: AVLMap) -> None:
    for side in ("under", "behind", "south of", "on"):
        with pytest.raises(QueryError, match=f"'{side}': a map finds what is near"):
            furnished.ask(f"is there a chair {side} the table?")
    assert furnished.ask("is there a chair near the table?").text.startswith("Yes. ")
    assert furnished.ask("is the chair near the table or near the floor?").text.startswith(
        "The chair near the table is"
    )


def test_what_is_next_to_a_thing_is_as_far_as_the_list_says(furnished: AVLMap) -> None:
    (near,) = page_of_things(MapLists(furnished), Wanted(name=["chair"], near="table", top=1))["things"]
    found = re.fullmatch(r"Next to the table: chair \((.+) m\)\.", furnished.ask("what is next to the table?").text)
    assert found is not None and near.get("distance_m") == pytest.approx(float(found[1]), abs=0.051)


def test_a_thing_that_two_searches_for_a_name_find_is_listed_once() -> None:
    avlmap = fake_map(
        voxels_of(box((0, 0, 0), (5, 5, 10)), np.zeros((250, 1))), encoders=fake_encoders(EmbeddedPixels())
    )

    def search(name: str, alone: bool) -> Instances:
        rows = np.arange(0, 250, 3 if alone else 1)
        zeros = np.zeros(len(rows), np.float32)
        return Instances(rows, zeros.astype(np.int64), zeros, zeros, np.array([0.9 if alone else 0.8], np.float32))

    assert [len(chair.rows) for chair in find_things(avlmap, search, ["chair"])] == [84]


def test_a_sentence_is_answered_like_its_parts(furnished: AVLMap) -> None:
    answer = furnished.ask("the chair near the sound of a dog")
    assert answer.parts[0].part.query == "chair"
    assert answer.goals[0].position == pytest.approx(furnished.things(["chair"])[0].position, abs=0.3)


def test_a_wall_hides_what_an_open_plan_shows_and_who_asks_for_sounds_is_told_sounds() -> None:
    def thing(name: str, x: float) -> Thing:
        return Thing(name, 0.9, (x, 1.5, 0.5), (0.4, 0.4, 0.4), (0, 0, 0), np.zeros(0, np.int64), np.zeros((0, 3)))

    def told(walled: bool, question: ListQuestion) -> list[str]:
        plan = FloorPlan.of(two_rooms(0.0, walled), storeys_at(0.0))
        assert plan is not None
        lists = {"space": plan.space, "things": lambda: there, "sounds": lambda: heard}
        rooms = SimpleNamespace(rooms_of=lambda at: at[:, 0] > 2.95)  # the window's number is that of the other side
        avlmap: Any = SimpleNamespace(
            **lists, where=rooms, room_votes=SimpleNamespace(plan=plan), settings=QuerySettings(), has=bool
        )
        answer = answer_list(avlmap, question, 9, lambda words: sofa)
        return [goal.name for goal in answer.goals]

    heard = [SoundEvent((f"dog {x}",), (0.9,), x, 9.0, (x, 1.5, 0.5), np.zeros((0, 3)), Path()) for x in (2.2, 3.8)]
    there = [thing("sink", 3.5), thing("chair", 1.9), thing("window", 3.0), thing("picture", 3.0)]
    part = PartAnswer(Part(Modality.OBJECT, "sofa", Role.PRIMARY), 1.0, True)
    sofa = Answer((Goal((2.5, 1.5, 0.5), 0.8, (0.4, 0.4, 0.4), {}, 0.8),), True, (part,))
    near_sofa = Target(TargetKind.SOUND, near=(Target(TargetKind.OBJECT, "sofa"),))
    beside, near = ListQuestion(Listed.BESIDE, "sofa"), ListQuestion(Listed.HEARD, sounds=(near_sofa,))
    assert told(True, beside) == ["window", "chair"] and told(True, near) == ["dog 2.2"]
    assert told(False, beside) == ["window", "picture", "chair", "sink"] and told(False, near) == ["dog 2.2", "dog 3.8"]


@pytest.mark.parametrize(
    ("sentence", "of"),
    [
        ("what is next to the sound system?", Listed.BESIDE), ("what is next to the sound bar?", Listed.BESIDE),
        ("what sounds are near the sofa?", Listed.HEARD), ("what did you hear near the sound system?", Listed.HEARD),
    ],
)  # fmt: skip
def test_a_thing_whose_name_holds_sound_is_a_thing(
    sentence: str, of: Listed, furnished: AVLMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked_for: list[Listed] = []

    def answered(avlmap: AVLMap, question: ListQuestion, *_: object) -> Answer:
        asked_for.append(question.of)
        return Answer((), False, ())

    monkeypatch.setattr("avlmaps.query.lists.answer_list", answered)
    furnished.ask(sentence)
    assert asked_for == [of]


EVENTS = st.lists(
    st.tuples(st.sampled_from(["dog bark", "glass breaking", "rain"]), st.floats(0.0, 99.0),
              st.sampled_from([0.4, 0.9]), st.booleans()),
    max_size=9, unique_by=lambda one: one[1],
)  # fmt: skip


def answered(events: Sequence[tuple[str, float, float, bool]], keeps: bool | None = None, **question: Any) -> Answer:
    """Answer a question in a map of these sounds, some in the hall on the right; `keeps`: only those there, or not."""
    sounds = [
        SoundEvent((name,), (sure,), at, at + 0.5, (float(right), 0.0, 0.0), np.zeros((0, 3)), Path())
        for name, at, sure, right in events
    ]
    rooms: Any = [SimpleNamespace(position=(float(right), 0.0, 0.0), confidence=0.9) for right in (False, True)]
    where = SimpleNamespace(
        rooms=rooms, names=("kitchen", "hall"), require=str, name_of=lambda at: ("kitchen", "hall")[int(at[0])],
        rooms_of=lambda at: at[:, 0].astype(int),
        inside=lambda name, at: np.array([place[0] == (name == "hall") for place in at], bool),
    )  # fmt: skip
    avlmap: Any = SimpleNamespace(sounds=lambda: sounds, where=where, settings=QuerySettings())
    whole = answer_list(avlmap, ListQuestion(**question), 99, lambda words: Answer((), False, ()))
    assert whole.again is not None
    return whole if keeps is None else whole.again(lambda at: bool(at[0]) is keeps)


def sound(name: str, *rooms: str) -> Target:
    return Target(TargetKind.SOUND, name, tuple(Target(TargetKind.AREA, room) for room in rooms))


@given(EVENTS, st.sampled_from([None, True, False]), st.sampled_from(["before", "after"]))
def test_which_came_first_agrees_with_every_pair(
    events: list[tuple[str, float, float, bool]], keeps: bool | None, how: str
) -> None:
    here = [one for one in events if keeps is None or one[3] is keeps]
    dogs, glass = ([one for one in here if one[0] == name] for name in ("dog bark", "glass breaking"))
    asked = (sound("dog bark"), sound("glass breaking"))
    answer = answered(events, keeps, of=Listed.HEARD, how=how, sounds=asked)
    pairs = [(a, b) for a in dogs for b in glass if (a[1] < b[1] if how == "before" else a[1] > b[1])]
    assert answer.found == any(min(a[2], b[2]) > 0.5 for a, b in pairs)
    if dogs and glass:
        said = "No" if not pairs else "Yes" if answer.found else "Perhaps"
        assert answer.text.startswith(f"{said}: dog bark ")
        assert not pairs or any(f"at {a[1]:.1f} s, glass" in answer.text for a, _ in pairs)


@given(EVENTS, st.sampled_from([None, True, False]), st.integers(1, 4), st.sampled_from([(), ("hall",), ("kitchen",)]))
def test_how_often_at_least_and_in_which_rooms_agree(
    events: list[tuple[str, float, float, bool]], keeps: bool | None, number: int, rooms: tuple[str, ...]
) -> None:
    said = (sound("dog bark", *rooms),)
    often = answered(events, keeps, of=Listed.HEARD, sounds=said)
    dogs = [one for one in events if one[0] == "dog bark" and (keeps is None or one[3] is keeps)]
    dogs = [one for one in dogs if not rooms or one[3] == (rooms == ("hall",))]
    assert (often.count or 0) == len(dogs) and often.found == any(one[2] > 0.5 for one in dogs)
    assert [goal.position[0] == 1.0 for goal in often.goals] == [one[3] for one in sorted(dogs, key=lambda one: one[1])]
    enough = answered(events, keeps, of=Listed.AT_LEAST, number=number, sounds=said)
    assert enough.count == len(dogs) and enough.found == (sum(one[2] > 0.5 for one in dogs) >= number)
    assert enough.text.startswith("No") == (len(dogs) < number)
    those = answered(events, keeps, of=Listed.ROOMS_WITH, number=number, sounds=said)
    in_rooms = [sum(one[3] is right for one in dogs) for right in (False, True)]
    assert those.count == sum(count >= number for count in in_rooms)
    most = answered(events, keeps, of=Listed.ROOMS_WITH, number=0, sounds=said)
    assert most.count == (in_rooms.count(max(in_rooms)) if any(in_rooms) else 0)


def test_one_sound_under_two_names_is_no_order() -> None:
    with pytest.raises(QueryError, match=r"The sound at 4\.0 s is meant by both names"):
        answered([("dog bark", 4.0, 0.9, True)], of=Listed.HEARD, how="after", sounds=(sound("dog bark"), sound("dog")))
