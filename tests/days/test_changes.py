"""What a map of several days answers: the changes since a day, the things of a day, and where a thing was last seen."""

from pathlib import Path
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import QueryError
from avlmaps.language.list_questions import Listed, list_question, read_list
from avlmaps.language.questions import read_question
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.life import Life, Stay
from avlmaps.maps.store.manifest import RecordingInfo, RigInfo, Visit
from avlmaps.query import changes
from avlmaps.query.changes import Days, changes_answer, last_seen, last_seen_text, text_of, usual
from avlmaps.query.edits import means
from avlmaps.query.goals import Goal
from avlmaps.query.lists import lies
from avlmaps.query.voxel_space import Space

CAMERA = Pinhole(fx=1.0, fy=1.0, cx=0.5, cy=0.5, width=1, height=1)
ROWS = tuple(tuple(float(value) for value in row) for row in np.eye(4))
DATES = ("2026-11-23", "2026-11-24", "2026-11-26")


def visit(number: int, day: str) -> Visit:
    recording = RecordingInfo(name="walk", format="folder", fingerprint="", frames=9, duration_s=60.0)
    begin_s = 86_400.0 * number
    return Visit(
        day=day, recording=recording, begin_s=begin_s, end_s=begin_s + 60.0, shift_s=begin_s, map_from_recording=ROWS,
        rig=RigInfo(rgb=CAMERA, depth=CAMERA, rgb_from_depth=ROWS), frames=9,
    )  # fmt: skip


def stay(name: str, first: int, last: int, **more: object) -> Stay:
    known: dict[str, object] = {"confidence": 0.8, "size": (0.3, 0.3, 0.3), "color": (9, 9, 9), "looked": last}
    known |= {"position": (float(first), 0.0, 0.3), "last_seen_s": 86_400.0 * last + 30.0, **more}
    return Stay(name=name, first=first, last=last, **known)  # pyright: ignore[reportArgumentType]


STAYS = [
    stay("sofa", 0, 2),
    stay("bag", 0, 0, gone=1, looked=1, moved_to=2),
    stay("bag", 1, 1, appeared=True, moved_from=1, gone=2, looked=2),
    stay("plant", 1, 2, appeared=True),
    stay("stool", 0, 0, gone=2, looked=2),
    stay("clock", 0, 0),  # nobody looked again
    stay("picture", 2, 2),  # nobody had looked before
]


def days(dates: tuple[str, ...] = DATES) -> Days:
    voxels = [np.full((2, 3), number, np.int32) for number in range(len(STAYS))]
    return Days(tuple(visit(number, day) for number, day in enumerate(dates)), Life.of(STAYS, voxels))


def kinds(since: int) -> list[tuple[str, str, int]]:
    known = days()
    return [(one.kind, one.stay(known.life.stays).name, one.visit) for one in known.changes(since)]


def test_changes_come_with_their_day_and_count_since_another() -> None:
    assert kinds(0) == [
        ("new", "plant", 1), ("moved", "bag", 1), ("gone", "bag", 2), ("gone", "stool", 2),
        ("first seen", "picture", 2),
    ]  # fmt: skip
    assert kinds(1) == [("gone", "bag", 2), ("gone", "stool", 2), ("first seen", "picture", 2)]
    assert kinds(2) == []


def test_a_day_holds_what_was_there_and_what_nothing_speaks_against() -> None:
    known = days()
    names = [[known.life.stays[number].name for number in known.at(day)] for day in range(3)]
    assert names[0] == ["sofa", "bag", "stool", "clock"]
    assert names[1] == ["sofa", "bag", "plant", "stool", "clock"]
    assert names[2] == ["sofa", "plant", "clock", "picture"]


@pytest.mark.parametrize(
    ("said", "visit"),
    [("1", 0), (3, 2), ("2026-11-23", 0), ("2026-11-25", 1), ("2026-12-01", 2), ("visit 2", 1), ("Day 3", 2),
     ("yesterday", 2), ("today", 2)],
)  # fmt: skip
def test_a_day_is_a_date_a_number_or_said_as_people_do(said: str | int, visit: int) -> None:
    assert days().visit_of(said) == visit


@pytest.mark.parametrize(
    ("said", "why"),
    [("0", "no visit 0"), ("4", "has 3"), ("monday", "no day"), ("2026-11-22", "first day is 2026-11-23")],
)
def test_another_day_is_refused(said: str, why: str) -> None:
    with pytest.raises(QueryError, match=why):
        days().visit_of(said)
    with pytest.raises(QueryError, match="number them"):
        days(("", "", "")).visit_of("2026-11-22")


def test_the_answer_is_json_with_the_days_and_what_is_unknown() -> None:
    answer = changes_answer(days(), "home", 0, lambda place: "kitchen")
    assert msgspec.json.decode(msgspec.json.encode(answer)) == answer
    assert [one["kind"] for one in answer["changes"]] == ["new", "moved", "gone", "gone"]
    moved = answer["changes"][1]
    assert moved["from"] == [0.0, 0.0, 0.3] and moved["position"] == [1.0, 0.0, 0.3] and moved["room"] == "kitchen"
    assert answer["changes"][0]["noticed"] == {"visit": 2, "day": "2026-11-24"}
    assert answer["unknown"] == 1, "the clock"
    assert "a bag has moved (kitchen), noticed on 2026-11-24" in text_of(answer)
    assert text_of(answer, ("new",)) == "Since 2026-11-23: a plant is new (kitchen), noticed on 2026-11-24."


def test_where_a_thing_was_last_seen_is_where_its_last_stay_was() -> None:
    answer = last_seen(days(), "bag", means("bag"), lambda place: None)
    (one,) = answer["seen"]
    assert one["position"] == [1.0, 0.0, 0.3]
    assert one["last_seen"] == {"visit": 2, "day": "2026-11-24", "stamp_s": 30.0}
    assert last_seen_text(answer).endswith("On 2026-11-26 it was gone from there.")
    clock = last_seen(days(), "clock", means("clock"), lambda place: None)
    assert last_seen_text(clock).endswith("Nobody has looked at its place since.")
    sofa = last_seen(days(), "sofa", means("sofa"), lambda place: None)
    assert last_seen_text(sofa).startswith("The sofa was last seen on 2026-11-26")
    assert "since" not in last_seen_text(sofa)
    assert last_seen(days(), "piano", means("piano"), lambda place: None)["seen"] == []


def test_a_name_that_is_not_known_is_asserted_nowhere() -> None:
    doubtful = stay("sofa", 0, 0, gone=1, looked=1, confidence=0.04)
    life = Life.of([doubtful, stay("cup", 0, 1)], [np.full((2, 3), number, np.int32) for number in range(2)])
    known = Days(tuple(visit(number, day) for number, day in enumerate(DATES[:2])), life)
    assert text_of(changes_answer(known, "home")) == "Since 2026-11-23: something is gone, noticed on 2026-11-24."
    seen = last_seen(known, "sofa", means("sofa"), lambda place: None)
    assert last_seen_text(seen).startswith("What may be a sofa (probability 0.04) was last seen on 2026-11-23")
    often = usual(known, lambda _: True)
    assert changes.usual_text(often, "here") == "Usually here: cup (2 of 2 days). Seen there on 1 day only: something."


def test_what_a_map_of_colours_calls_red_is_the_red_thing() -> None:
    assert means("red thing")("red") and means("red")("red")
    assert not means("red thing")("blue") and not means("red chair")("red") and not means("thing")("")


@pytest.mark.parametrize(("names", "count"), [(None, 4), (["couch"], 1), (["sofa", "bag"], 2), (["piano"], 0)])
def test_things_of_a_day_are_meant_by_other_words_as_well(names: list[str] | None, count: int) -> None:
    space = Space(GridSpec(0.05), np.zeros((0, 3), np.int32), np.array([0.0, 0.0, 1.0]))
    assert len(changes.things_at(space, days(), 1, names, 0.5)) == count


@pytest.mark.parametrize(
    ("sentence", "of", "name", "change", "since"),
    [
        ("what is new in the kitchen?", Listed.CHANGES, "kitchen", "new", ""),
        ("What is gone?", Listed.CHANGES, "", "gone", ""),
        ("what has moved since 2026-11-24?", Listed.CHANGES, "", "moved", "2026-11-24"),
        ("what's missing from the bedroom", Listed.CHANGES, "bedroom", "gone", ""),
        ("what has changed in the house since visit 2", Listed.CHANGES, "", "", "2"),
        ("what is new since yesterday?", Listed.CHANGES, "", "new", "yesterday"),
        ("what has moved since day 3", Listed.CHANGES, "", "moved", "3"),
        ("where was the suitcase last seen?", Listed.LAST_SEEN, "suitcase", "", ""),
        ("where did you last see my bag?", Listed.LAST_SEEN, "bag", "", ""),
    ],
)
def test_questions_about_days_are_read(sentence: str, of: Listed, name: str, change: str, since: str) -> None:
    read = read_list(sentence) or list_question(read_question(sentence).inquiry)
    assert read is not None
    assert (read.of, read.name, read.change, read.since) == (of, name, change, since)


# What is usual.


def lived(name: str, there: tuple[int, ...], absent: tuple[int, ...] = (), **more: object) -> Stay:
    known: dict[str, object] = {"there_on": there, "absent_on": absent, "position": (1.0, 1.0, 0.8), **more}
    return stay(name, there[0], there[-1], **known)


def usual_of(*stays: Stay) -> list[tuple[str, int, int, bool]]:
    voxels = [np.full((2, 3), number, np.int32) for number in range(len(stays))]
    known = Days(tuple(visit(number, day) for number, day in enumerate(DATES)), Life.of(stays, voxels))
    return [(one.stay.name, one.there, one.looked, one.is_usual) for one in usual(known, lambda _: True)]


def test_usual_is_what_most_of_the_days_that_looked_saw_and_more_than_one() -> None:
    assert usual_of(lived("bag", (0, 1, 2))) == [("bag", 3, 3, True)]
    assert usual_of(lived("bag", (0, 2))) == [("bag", 2, 2, True)], "a day that did not look counts neither way"
    assert usual_of(lived("bag", (0,))) == [("bag", 1, 1, False)], "one day is no habit"
    assert usual_of(lived("bag", (0,), (1, 2))) == [("bag", 1, 3, False)]


def test_a_thing_that_comes_and_goes_is_one_by_its_place() -> None:
    came_back = (lived("bag", (0,), (1,)), lived("bag", (2,), (1,), position=(1.4, 1.0, 0.8)))
    assert usual_of(*came_back) == [("bag", 2, 3, True)]
    elsewhere = (lived("bag", (0, 1), (2,)), lived("bag", (2,), position=(9.0, 1.0, 0.8)))
    assert usual_of(*elsewhere) == [("bag", 2, 3, True), ("bag", 1, 1, False)]
    assert usual_of(lived("person", (0, 1, 2))) == [], "people come and go"


def test_the_order_of_stays_changes_nothing() -> None:
    stays = [lived("bag", (0, 1), (2,)), lived("bag", (2,), position=(9.0, 1.0, 0.8)), lived("cup", (0, 1, 2))]
    assert usual_of(*stays) == usual_of(*reversed(stays))


def test_maps_of_before_know_the_first_and_the_last_day() -> None:
    assert usual_of(stay("bag", 0, 2)) == [("bag", 2, 2, True)]
    assert usual_of(stay("bag", 1, 1, appeared=True, gone=2)) == [("bag", 1, 3, False)]


def test_what_is_usual_is_said_with_its_days() -> None:
    voxels = [np.full((2, 3), number, np.int32) for number in range(3)]
    stays = (lived("bag", (0, 1), (2,)), lived("cup", (1,), (0, 2)), lived("book", (0, 1, 2)))
    known = Days(tuple(visit(number, day) for number, day in enumerate(DATES)), Life.of(stays, voxels))
    found = usual(known, lambda _: True)
    assert changes.usual_text(found, "on the table") == (
        "Usually on the table: book (3 of 3 days), bag (2 of 3 days). Seen there on 1 day only: cup."
    )
    assert changes.usual_text([found[0], found[0]], "here") == "Usually here: 2 books (3 of 3 days)."
    bag = usual(known, lambda one: one.name == "bag")
    assert changes.usual_place_text(known, "bag", bag, lambda _: "hall") == (
        "The bag is usually in the hall, at (1.00, 1.00, 0.80) m: on 2 of 3 days on which its place was looked at."
    )
    cup = usual(known, lambda one: one.name == "cup")
    assert changes.usual_place_text(known, "cup", cup, lambda _: None) == (
        "The cup was seen on 1 day only, 2026-11-24, at (1.00, 1.00, 0.80) m; that says nothing of what is usual."
    )
    assert changes.usual_place_text(known, "ski", [], lambda _: None) == "No ski was seen on any day."
    with pytest.raises(QueryError, match="on one day alone, so that nobody knows what is usual"):
        Days.of(
            SimpleNamespace(data=SimpleNamespace(life=None), path=Path("home.avlmap")), "nobody knows what is usual"
        )  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("sentence", "how", "name"),
    [
        ("what is usually on the table?", "on", "table"),
        ("What usually stands next to the sofa?", "near", "sofa"),
        ("what is in the kitchen most of the time?", "in", "kitchen"),
        ("where is the suitcase usually?", "", "suitcase"),
        ("where is the suitcase usually kept", "", "suitcase"),
        ("Where do you normally find the keys?", "", "keys"),
        ("where does the bag usually stand?", "", "bag"),
    ],
)
def test_a_sentence_asks_what_is_usual(sentence: str, how: str, name: str) -> None:
    read = read_list(sentence)
    assert read is not None and (read.of, read.how, read.name) == (Listed.USUAL, how, name)


@pytest.mark.parametrize(
    "sentence",
    ["what is in the kitchen", "where is the bag", "the new chair", "what moved there", "what is on the table?",
     "is the bag usually red?"],
)  # fmt: skip
def test_other_questions_are_not_of_days(sentence: str) -> None:
    read = read_list(sentence)
    assert read is None or read.of not in (Listed.CHANGES, Listed.LAST_SEEN, Listed.USUAL)


def test_on_a_thing_lies_what_stands_over_its_middle_and_not_what_hangs_or_stands_beside() -> None:
    table = Goal((2.0, 2.0, 0.4), 0.9, (1.2, 0.8, 0.8), {}, 0.9, "table")
    flat = SimpleNamespace(space=SimpleNamespace(level=lambda points: points))

    def on(name: str, x: float, z: float, size: tuple[float, float, float] = (0.2, 0.2, 0.2), how: str = "on") -> bool:
        return lies(flat, how, lived(name, (0, 1), position=(x, 2.0, z), size=size), table)  # pyright: ignore[reportArgumentType]

    assert on("book", 2.0, 0.9) and on("book", 2.5, 0.75)
    assert not on("book", 2.0, 0.15), "under it"
    assert not on("book", 3.0, 0.9) and on("book", 3.0, 0.9, how="near"), "beside it"
    assert not on("book", 2.0, 1.5) and not on("picture", 2.0, 1.0)
    assert not on("desk", 2.0, 0.4, (1.2, 0.8, 0.8)), "itself by another name"
