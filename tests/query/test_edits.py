"""What a person corrected: the laws of edits, and what questions, lists and rooms make of them."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import (
    FakePixels,
    FakeSounds,
    asked,
    box,
    fake_encoders,
    fake_map,
    furnished_map,
    keyframes_at,
    sounds_of,
    voxels_of,
)
from test_named_areas import Rooms
from walled_rooms import two_rooms_index

from avlmaps.core.errors import MapError, QueryError
from avlmaps.core.poses import apply as moved
from avlmaps.core.poses import plain_point
from avlmaps.language.commands import read_command
from avlmaps.language.intents import targets_of
from avlmaps.language.sentence import Attachments, stand_ins
from avlmaps.maps.store.edits import (
    EDITS,
    Edit,
    EditedSpot,
    World,
    append_edit,
    carried_edits,
    in_force,
    read_edits,
    write_edits,
)
from avlmaps.perception.embedded.pixels import features_of
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.edits import means, said
from avlmaps.query.factors import NearAnchors

STORED = furnished_map()
RAW = asked(STORED, edits=())
THINGS = sorted(RAW.things(least_confidence=0.2), key=lambda one: one.rows[0])
A, B = (one for one in THINGS if one.name == "chair")
TABLE = next(one for one in THINGS if one.name == "table")
WORDS = ("chair", "table", "stool", "furniture", "my dock")
DAY = "2026-11-26T10:00:00.000+00:00"


def spot(thing: Any) -> EditedSpot:
    return RAW.edited.spot_of(thing.name, thing.rows)


def edit(does: Any, *things: Any, **more: Any) -> Edit:
    return Edit.new(does, [spot(one) for one in things], made=DAY, **more)


STOOL = edit("rename", A, name="stool")
BENCH = edit("rename", TABLE, name="bench")
PAIR = edit("merge", A, B)
HALVES = edit("split", TABLE, cut=[(1.4, 0.0, 0.1), (1.4, 2.0, 0.1)])
DOCK = Edit.new("pin", [EditedSpot(middle=(3.0, 1.0, 0.0))], name="My dock", made=DAY)
LOST = Edit.new(
    "rename", [EditedSpot(name="sofa", middle=(4.0, 0.5, 0.2), size=(1.0, 1.0, 1.0))], name="couch", made=DAY
)
EVERY = (STOOL, BENCH, PAIR, HALVES, DOCK, LOST)


def state(edits: Sequence[Edit]) -> list[Any]:
    """Return all that a map of these edits lists and answers."""
    m = asked(STORED, edits=edits)
    out: list[Any] = [(one.name, one.confidence, one.position, one.rows.tolist()) for one in m.things(None, 0.2)]
    out.sort()
    for word in WORDS:
        try:
            heat = m.object(word, primary=True)
        except QueryError as refused:
            out.append((word, str(refused)))
            continue
        goals = [(goal.position, goal.probability) for goal in heat.goals(9)]
        out.append((word, heat.found, heat.values.tobytes(), goals, heat.factors[0].note))
        out.append(sorted(m.instances("chair").confidence.tolist()))
    return out


def test_an_empty_log_changes_nothing_bit_for_bit() -> None:
    assert state(()) == state([edit("undo", of="nothing")])
    m, listed = asked(STORED, edits=()), RAW.things()
    assert m.edited.things(listed, None, 0.5) is listed
    found = RAW.instances("chair")
    assert m.edited.instances(found, "chair") is found


@pytest.mark.nightly
@given(edits=st.lists(st.sampled_from(EVERY), max_size=5))
def test_the_same_edits_twice_are_as_once(edits: list[Edit]) -> None:
    again = [msgspec.structs.replace(one, id=f"{one.id}-2") for one in edits]  # not even told by their ids
    once = state(edits)
    assert once == state([*edits, *edits])
    if len(set(edits)) == len(edits) and not {STOOL, PAIR} <= set(edits) and not {BENCH, HALVES} <= set(edits):
        assert once == state([*edits, *again])


@pytest.mark.few(1)
@pytest.mark.parametrize("independent", [(STOOL, BENCH, DOCK), (PAIR, HALVES, LOST), (STOOL, HALVES, DOCK)])
def test_independent_edits_come_in_any_order(independent: tuple[Edit, ...]) -> None:
    assert all(state(order) == state(independent) for order in permutations(independent))


@given(edits=st.lists(st.sampled_from(EVERY), max_size=4, unique=True), one=st.sampled_from(EVERY))
def test_an_edit_that_is_undone_is_nothing_and_undone_again_is_back(edits: list[Edit], one: Edit) -> None:
    others = [each for each in edits if each != one]
    undo = Edit.new("undo", of=one.id, made=DAY)
    redo = Edit.new("undo", of=undo.id, made=DAY)
    assert in_force([*others, one, undo]) == tuple(others)
    assert in_force([*others, one, undo, redo]) == (*others, one)
    assert state([one, undo]) == state(())


def test_a_thing_that_was_renamed_is_found_by_its_name_alone() -> None:
    m = asked(STORED, edits=[STOOL])
    listed = {one.name: one for one in m.things(least_confidence=0.2)}
    assert listed["stool"].rows.tolist() == A.rows.tolist()
    assert (listed["stool"].confidence, listed["stool"].edited) == (1.0, "named by a person on 2026-11-26")
    assert listed["stool"].to_json()["edited"] == "named by a person on 2026-11-26"
    assert listed["chair"].rows.tolist() == B.rows.tolist()
    assert [one.name for one in m.things(["stool"])] == ["stool"]
    heat = m.object("stool", primary=True)
    assert heat.found and heat.probability == 1.0 and len(heat.goals(5)) == 1
    chairs = m.object("chair", primary=True)
    assert not chairs.lead.mask[A.rows].any() and chairs.lead.mask[B.rows].all()
    assert not m.object("chair").include_uncertain().lead.mask[A.rows].any()
    assert m.knows("stool") and not RAW.knows("stool")


def test_an_answer_says_that_a_person_named_it() -> None:
    m = asked(STORED, edits=[STOOL, edit("rename", TABLE, name="bench", by="Anna")])
    assert m.ask(object="stool").notes == ("The stool was named by a person on 2026-11-26.",)
    assert m.ask(object="bench").notes == ("The bench was named by Anna on 2026-11-26.",)
    assert m.ask(object="chair").notes == ()


def test_a_count_that_is_not_reached_says_who_corrected_what_there_is() -> None:
    m = asked(STORED, edits=[STOOL])
    answer = m.ask("are there three stools")
    assert not answer.found and answer.notes == ("The stool was named by a person on 2026-11-26.",)


def test_things_are_merged_and_split() -> None:
    one = asked(STORED, edits=[PAIR]).things(["chair"], 0.2)
    assert [sorted(each.rows.tolist()) for each in one] == [sorted([*A.rows.tolist(), *B.rows.tolist()])]
    two = asked(STORED, edits=[HALVES]).things(["table"], 0.2)
    assert sorted(np.concatenate([each.rows for each in two]).tolist()) == TABLE.rows.tolist()
    assert sorted(float(each.points[:, 0].min() > 1.4) for each in two) == [0.0, 1.0]
    apart = asked(STORED, edits=[PAIR, edit("split", A, B, cut=[])]).things(["chair"], 0.2)
    assert sorted(each.rows[0] for each in apart) == [A.rows[0], B.rows[0]]


def test_a_place_of_ones_own_is_a_goal_and_a_landmark() -> None:
    m = asked(STORED, edits=[DOCK])
    answer = m.ask("where is my dock?")
    assert answer.found and answer.goals[0].position == (3.0, 1.0, 0.0)
    assert answer.notes == ("The dock was named by a person on 2026-11-26.",)
    assert isinstance(m.object("My dock").factors[0], NearAnchors)
    near = m.object("chair", primary=True) * m.object("my dock")
    assert near.goals(1)[0].position == B.position or near.goals(1)[0].position == A.position
    assert m.things()[0].name == "My dock"


def test_an_edit_that_finds_nothing_is_reported_with_the_reason() -> None:
    (lost,) = asked(STORED, edits=[STOOL, LOST]).edited.lost
    assert lost.edit is LOST and lost.why == "nothing like the sofa is at (4.00, 0.50, 0.20) m any more"
    said_so = f"Edit {LOST.id} of 2026-11-26 (rename sofa to couch) finds nothing to apply to: {lost.why}."
    assert str(lost) == said_so
    assert said_so in asked(STORED, edits=[LOST, STOOL]).edited.said_of([], ["couch"])
    other = msgspec.structs.replace(STOOL, world=World(name="other", fingerprint="g"))
    m = asked(STORED, edits=[other])
    assert state([other]) == state(())
    assert "another recording, other" in m.edited.lost[0].why
    again = msgspec.structs.replace(STOOL, world=World(name="walk", fingerprint="of a recording that was mended"))
    assert not asked(STORED, edits=[again]).edited.lost


def test_a_map_without_pixel_features_asks_for_no_pixel_model() -> None:
    stored = furnished_map(sounds=sounds_of([np.array([[1.0, 1.0, 0.0]])], [0.9]))
    stored.encoders, stored.data.info.models = fake_encoders(sounds=FakeSounds()), {"sounds": None}
    m = asked(stored, edits=[STOOL, DOCK])
    assert m.ask(sound="dog").found
    (lost,) = m.edited.lost
    assert lost.why.startswith("nothing like the chair is at")
    assert m.ask("where is my dock?").goals[0].position == (3.0, 1.0, 0.0)


def test_what_edits_are_about_is_searched_once_however_often_it_is_edited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searched: list[Any] = []
    search = AVLMap.unedited_things

    def counted(self: AVLMap, names: Any = None, least: float = 0.5, *more: Any) -> Any:
        searched.append((least, None if names is None else tuple(names)))
        return search(self, names, least, *more)

    m = editable(tmp_path)
    at = "0.6,0.6"
    m.edit.rename("chair", "stool", at=at)
    monkeypatch.setattr(AVLMap, "unedited_things", counted)
    m.edit.history()
    m.edit.split("table", box=(0.0, 0.0, 1.4, 2.0))
    m.as_edited_now().edit.history()
    m.edit.undo()
    m.edit.history()
    assert searched.count((0.2, ("chair",))) == 1 == searched.count((0.2, ("table",)))


def shifted(by: int) -> Any:
    """Return the map after its poses were corrected: all of it lies elsewhere."""
    stored = furnished_map()
    stored.data.voxels = replace(
        stored.data.voxels, index=np.asarray(stored.data.voxels.index) + np.array([by, 0, 0], np.int32)
    )
    return stored


def test_edits_follow_poses_that_are_corrected() -> None:
    places = np.array([[0.6, 0.3, 0.5], [4.0, 3.0, 0.5]])
    before, after = furnished_map(keyframes=keyframes_at(places)), shifted(40)
    after.data.keyframes = keyframes_at(places + np.array([2.0, 0.0, 0.0]))
    own = asked(before, edits=()).edited.spot_of(A.name, A.rows)
    m = asked(after, edits=[Edit.new("rename", [own], name="stool", made=DAY)])
    (stool,) = m.things(["stool"])
    assert stool.rows.tolist() == A.rows.tolist()
    np.testing.assert_allclose(stool.points, A.points + np.array([2.0, 0.0, 0.0]), atol=1e-9)
    assert own.now(before.data.keyframes) is own


def test_edits_are_carried_into_the_map_of_all_days() -> None:
    places = np.array([[0.6, 0.3, 0.5], [4.0, 3.0, 0.5]])
    turn = np.array([[0.0, -1.0, 0.0, 3.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    onto = keyframes_at(moved(turn, places))
    world = World(name="monday", fingerprint="m")
    own = msgspec.structs.replace(STOOL, world=World(name="tuesday", fingerprint="t"))
    strange = msgspec.structs.replace(STOOL, world=World(name="another house", fingerprint="x"))
    (made, foreign) = carried_edits([own, strange], keyframes_at(places), own.world, world, onto, turn)
    assert foreign == strange, "an edit of another building does not become one of this"
    assert made.at[0].middle == pytest.approx(tuple(moved(turn, np.array(own.at[0].middle))))
    assert (made.id, made.world) == (own.id, world)
    assert made.at[0].now(onto) == made.at[0]


def test_a_name_is_meant_by_its_own_words_and_by_wider_ones() -> None:
    assert means("my mug")("The Mug") and means("furniture")("chair") and means("mug")("my blue mug")
    assert not means("chair")("table") and not means("mug")("table")
    assert said(edit("rename", A, name="x", by="Anna")) == "named by Anna on 2026-11-26"


# Rooms.


def two_named_rooms(edits: Sequence[Edit]) -> AVLMap:
    """Return two rooms with a doorway between them; views say kitchen in the one and bedroom in the other."""
    encoder = Rooms()
    xy = [(x + 0.4 * i, 0.8 + 0.4 * j) for x in (0.3, 3.3) for i in range(4) for j in range(4)]
    places = np.array([[x, y, 1.2] for x, y in xy])
    kitchen = np.array([place[0] < 2.5 for place in places])  # what each saw lies 1 m ahead
    share = np.where(kitchen[:, None], [0.85, 0.05, 0.05, 0.05], [0.05, 0.85, 0.05, 0.05])
    frames = keyframes_at(places, features_of(share, encoder.codes))
    index = two_rooms_index(0.9)
    voxels = voxels_of(index, np.zeros((len(index), 1)))
    voxels = replace(voxels, hits=np.full(len(index), 9, np.int64))
    stored = fake_map(voxels, keyframes=frames, encoders=fake_encoders(views=encoder))
    stored.data.info.models = {"views": None}
    return asked(stored, edits=edits)


def room_edit(m: AVLMap, room: str, to: str) -> Edit:
    return Edit.new("rename room", [m.edit._room(room)], name=to, made=DAY)


def test_a_room_has_the_name_that_a_person_gave_it() -> None:
    raw = two_named_rooms(())
    assert sorted(room.name for room in raw.rooms()) == ["bedroom", "kitchen"]
    m = two_named_rooms([room_edit(raw, "kitchen", "studio")])
    named = {room.name: room for room in m.rooms()}
    assert sorted(named) == ["bedroom", "studio"]
    assert (named["studio"].confidence, named["studio"].edited) == (1.0, "named by a person on 2026-11-26")
    studio, kitchen = m.area("studio", primary=True), m.area("kitchen", primary=True)
    assert studio.found and studio.goals(1)[0].position[0] < 3.0
    assert not kitchen.found
    inside = m.area("the studio").values > 0.5
    assert inside.any() and (m.points[inside][:, 0] < 3.1).all()
    np.testing.assert_array_equal(m.area("bedroom").values[~inside], raw.area("bedroom").values[~inside])
    assert m.ask(area="studio").notes == ("The studio was named by a person on 2026-11-26.",)
    assert m.object("studio", primary=True).goals(1)[0].position[0] < 3.0


def test_a_known_kind_takes_the_place_of_another() -> None:
    raw = two_named_rooms(())
    m = two_named_rooms([room_edit(raw, "bedroom", "kitchen")])
    assert [room.name for room in m.rooms()] == ["kitchen", "kitchen"]
    inside = ((m.points[:, :2] > [3.5, 0.5]) & (m.points[:, :2] < [5.5, 2.5])).all(axis=1)
    assert m.area("kitchen").values[inside].min() > 0.99 > raw.area("kitchen").values[inside].max()
    twice = two_named_rooms([room_edit(raw, "bedroom", "kitchen"), room_edit(raw, "bedroom", "bedroom")])
    assert sorted(room.name for room in twice.rooms()) == ["bedroom", "kitchen"]


def test_a_room_that_is_no_more_is_reported() -> None:
    raw = two_named_rooms(())
    gone = Edit.new("rename room", [EditedSpot(name="attic", middle=(90.0, 0.0, 1.0))], name="studio", made=DAY)
    small = [(0.5, 0.5, 0.0), (0.9, 0.5, 0.0), (0.9, 0.9, 0.0), (0.5, 0.9, 0.0)]
    nook = Edit.new(
        "rename room", [EditedSpot(name="nook", middle=(0.7, 0.7, 0.0), corners=tuple(small))], name="den", made=DAY
    )
    m = two_named_rooms([gone, nook])
    assert [one.edit.name for one in m.edited.lost] == ["studio", "den"]
    assert [room.name for room in m.rooms()] == [room.name for room in raw.rooms()]


def test_a_room_is_found_by_its_outline_where_its_middle_lies_in_another() -> None:
    raw = two_named_rooms(())
    (kitchen,) = (room for room in raw.rooms() if room.name == "kitchen")
    (bedroom,) = (room for room in raw.rooms() if room.name == "bedroom")
    moved_away = EditedSpot(name="kitchen", middle=bedroom.position, corners=tuple(map(plain_point, kitchen.outline)))
    m = two_named_rooms([Edit.new("rename room", [moved_away], name="studio", made=DAY)])
    assert not m.edited.lost
    assert {room.name: room.position for room in m.rooms()} == {
        "studio": kitchen.position, "bedroom": bedroom.position,
    }  # fmt: skip


# Own names in sentences.


def test_a_command_and_a_question_speak_of_own_names() -> None:
    own = (("wobble pad", False), ("studio seven", True))
    (intent,) = read_command("go to my wobble pad", Attachments(own=own)).intents
    assert [target.name for target in targets_of(intent)] == ["wobble pad"]
    (intent,) = read_command("drive to the studio seven", Attachments(own=own)).intents
    assert [(target.kind.value, target.name) for target in targets_of(intent)] == [("area", "studio seven")]
    assert stand_ins("go to the sofa", own).text == "go to the sofa"
    assert stand_ins("where is the chair", (("chair", False),)).own == {}
    stand = stand_ins("the lamp near My Wobble Pad", own)
    assert "lamp" not in stand.own and stand.back(stand.text) == "the lamp near the wobble pad"


# The log.


def test_a_log_is_read_as_it_was_written(tmp_path: Path) -> None:
    assert read_edits(tmp_path) == ()
    for one in EVERY:
        append_edit(tmp_path, one)
    assert read_edits(tmp_path) == EVERY
    assert len((tmp_path / EDITS).read_text().splitlines()) == len(EVERY)
    first = (tmp_path / EDITS).read_bytes()
    append_edit(tmp_path, STOOL)
    assert (tmp_path / EDITS).read_bytes().startswith(first)
    write_edits(tmp_path, EVERY)
    assert (tmp_path / EDITS).read_bytes() == first


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ('{"schema":2,"id":"a","does":"pin","made":""}', "no edit of schema 1"),
        ('{"schema":1,"id":"a","does":"explode","made":""}', "no edit of schema 1"),
        ('{"schema":1,"id":"a","does":"pin","made":"","more":1}', "no edit of schema 1"),
        ('{"schema":1,"id":"a","does":"pin","made":"","at":[{"middle":[1e9,0,0]}]}', "not in metres"),
    ],
)
def test_a_damaged_line_is_named_and_never_skipped(tmp_path: Path, line: str, why: str) -> None:
    append_edit(tmp_path, STOOL)
    with (tmp_path / EDITS).open("a") as log:
        log.write(f"{line}\n")
    with pytest.raises(MapError, match=f"Line 2 of .*{why}"):
        read_edits(tmp_path)


def test_a_disk_that_fails_leaves_the_log_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    append_edit(tmp_path, STOOL)
    before = (tmp_path / EDITS).read_bytes()

    def full(*_: object) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(MapError, match="No space left on device"):
        append_edit(tmp_path, BENCH)
    monkeypatch.undo()
    assert (tmp_path / EDITS).read_bytes() == before and not list(tmp_path.glob("*.part*"))
    append_edit(tmp_path, BENCH)
    assert read_edits(tmp_path) == (STOOL, BENCH)


# Making edits.


def editable(tmp_path: Path) -> AVLMap:
    stored = furnished_map()
    stored.path, stored.data.info.files = tmp_path, {}
    m = asked(stored)
    stored.data.info.files = {"voxels/index": None}
    return m


def test_the_editor_says_what_it_cannot_do(tmp_path: Path) -> None:
    m = editable(tmp_path)
    for call, why in (
        (lambda: m.edit.rename("chair", "stool"), "There are 2 things called chair: say which"),
        (lambda: m.edit.rename("sofa", "stool"), "The map shows no sofa"),
        (lambda: m.edit.rename("chair", "stool", at="5.9,0.1"), "no chair within 1 m"),
        (lambda: m.edit.rename(None, "stool"), "Which thing"),
        (lambda: m.edit.rename("table", "  "), "is no name"),
        (lambda: m.edit.rename("table", 5), "must be text, not 5"),
        (lambda: m.edit.pin("dock", at=5), "A place is x,y or x,y,z in metres"),
        (lambda: m.edit.merge((0.6, 0.6), (0.6, 0.6)), "fewer than two"),
        (lambda: m.edit.split("table"), "stays whole: it is one connected piece"),
        (lambda: m.edit.split("table", plane=["4,0", "4,1"]), "stays whole: the cut does not meet it"),
        (lambda: m.edit.split("table", plane=["4,0"]), "a plane through two places"),
        (lambda: m.edit.forbid("x"), "by a box x0,y0,x1,y1 or by a room"),
        (lambda: m.edit.forbid("x", box=(0.0, 0.0, 0.0, 5.0)), "has no area"),
        (lambda: m.edit.forbid("x", box=5), "A box is x0,y0,x1,y1 in metres"),
        (lambda: m.edit.forbid("x", room="kitchen"), "no floor plan"),
        (lambda: m.edit.pin("dock", "nowhere"), "A place is x,y"),
        (lambda: m.edit.pin("dock", (500.0, 1.0)), "m outside of the map, which goes from"),
        (lambda: m.edit.forbid("x", box=(900.0, 900.0, 901.0, 901.0)), "m outside of the map"),
        (lambda: m.edit.rename("table", "table"), "called so already"),
        (lambda: m.edit.merge((0.6, 0.6), (5.1, 3.1)), "from the others, more than 3 m"),
        (lambda: m.edit.undo(), "no edit in force"),
        (lambda: m.edit.undo("12345678"), "no edit '12345678'"),
    ):
        with pytest.raises(QueryError, match=why):
            call()
    assert not (tmp_path / EDITS).exists()
    m.data.info.files = {}
    with pytest.raises(MapError, match="in memory alone"):
        m.edit.pin("dock", (1.0, 1.0))


def test_what_is_merged_hangs_together_in_any_order(tmp_path: Path) -> None:
    chairs = [box((x, 10, 1), (x + 4, 14, 9)) for x in (10, 24, 116, 130)]
    floor = box((0, 0, 0), (150, 40, 1))
    encoder = FakePixels(("floor", "chair"))
    words = ["floor"] * len(floor) + ["chair"] * sum(map(len, chairs))
    stored = fake_map(
        voxels_of(np.concatenate([floor, *chairs]), encoder.encode_words(words)), encoders=fake_encoders(encoder)
    )
    stored.path, stored.data.info.files = tmp_path, {"voxels/index": None}
    places = [(0.6, 0.6), (1.3, 0.6), (5.9, 0.6), (6.6, 0.6)]
    for order in (places, places[::-1], [*places[1:], places[0]], [places[2], places[0], places[3], places[1]]):
        with pytest.raises(QueryError, match=r"is 4\.5 m from the others"):
            asked(stored, edits=()).edit.merge(*order)
    assert not (tmp_path / EDITS).exists()
    asked(stored, edits=()).edit.merge(*places[2:])


def test_an_edit_does_not_bring_back_the_folder_of_a_map_that_is_gone(tmp_path: Path) -> None:
    m = editable(tmp_path)
    m.path = tmp_path / "gone.avlmap"
    with pytest.raises(MapError, match="is gone"):
        m.edit.pin("dock", (1.0, 1.0))
    assert not m.path.exists()


def test_the_editor_makes_the_edits_and_the_map_knows_them_at_once(tmp_path: Path) -> None:
    m = editable(tmp_path)
    assert m.edit.rename("chair", "stool", at="0.6,0.6", by="Anna").by == "Anna"
    assert [one.name for one in m.things(["stool"])] == ["stool"]
    m.edit.split("table", box=(0.0, 0.0, 1.4, 2.0))
    assert len(m.things(["table"], 0.2)) == 2
    m.edit.merge("1.2,0.9", "1.6,0.9", to="long table")
    assert [one.name for one in m.things(["long table"])] == ["long table"]
    m.edit.pin("dock", (3.0, 1.0))
    undone = m.edit.undo()
    assert undone.of == m.edit.history()["edits"][3]["id"]
    assert [one["state"] for one in m.edit.history()["edits"]] == ["applied", "applied", "applied", "undone", "undo"]
    assert [edit.does for edit in read_edits(tmp_path)] == ["rename", "split", "merge", "pin", "undo"]


@pytest.mark.parametrize(
    "name", ["stop", "Halt!", "left", "the left", "5 m", "near the bed", "go to", "it", "not here"]
)
def test_words_of_orders_are_no_names(name: str, tmp_path: Path) -> None:
    m = editable(tmp_path)
    with pytest.raises(QueryError, match="a word of orders to a robot"):
        m.edit.pin(name, (1.0, 1.0))
    assert not read_edits(tmp_path)


@pytest.mark.parametrize("name", ["home", "left shelf", "point A", "bus stop", "Anna's place", "start", "room 5"])
def test_other_names_are_names(name: str, tmp_path: Path) -> None:
    m = editable(tmp_path)
    m.edit.pin(name, (1.0, 1.0))
    assert m.ask(f"where is my {name}?").found


def test_areas_of_one_name_all_hold_and_a_pin_of_one_name_is_the_last(tmp_path: Path) -> None:
    m = editable(tmp_path)
    boxes = [(2.5, 1.0, 3.5, 2.0), (0.5, 0.5, 1.0, 1.0), (4.0, 2.0, 4.5, 3.0)]
    for one in boxes:
        m.edit.forbid("the wet floor", box=one)
    lows = sorted(tuple(area.corners.min(axis=0).round(3)) for area in m.edited.forbidden)
    assert lows == sorted(one[:2] for one in boxes)
    m.edit.pin("my dock", (1.0, 1.0))
    m.edit.pin("the dock", (3.0, 1.0))
    assert [one["state"] for one in m.edit.history()["edits"]] == ["applied"] * 3 + ["moved", "applied"]
    m.edit.undo()
    assert [one["state"] for one in m.edit.history()["edits"]][3:5] == ["applied", "undone"]


def test_a_forbidden_area_is_occupied_and_its_goals_are_refused(tmp_path: Path) -> None:
    from avlmaps.maps.obstacles import CellState
    from avlmaps.navigate.costmap import obstacles_for

    m = editable(tmp_path)
    m.data.voxels = replace(m.data.voxels, hits=np.full(len(m.space), 9, np.int64))  # pyright: ignore[reportAttributeAccessIssue]
    before = obstacles_for(m)
    m.edit.forbid("the wet floor", box=(2.5, 1.0, 3.5, 2.0))
    after = obstacles_for(m)
    inside, outside = np.array([3.0, 1.5, 0.0]), np.array([2.0, 2.5, 0.0])
    assert before.elsewhere(inside) == "" == after.elsewhere(outside)
    assert after.elsewhere(inside) == (
        "it lies in the wet floor, forbidden by a person on "
        f"{read_edits(tmp_path)[0].day}; `avlmaps edit MAP --undo` allows it again"
    )
    changed = np.argwhere(before.states != after.states)
    at = (changed + 0.5) * after.cell_size_m + after.origin_m
    assert (at > [2.4, 0.9]).all() and (at < [3.6, 2.1]).all()
    assert len(changed) >= 20 * 20 and (after.states[tuple(changed.T)] == CellState.OCCUPIED).all()
    m.edit.undo()
    np.testing.assert_array_equal(obstacles_for(m).states, before.states)
