"""The tables of what stands where, and the votes that follow from them."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.perception.embedded.pixels import EmbeddedPixels, EmbeddedViews
from avlmaps.perception.protocols import FURNISHED as FOLDER
from avlmaps.perception.protocols import RoomContents, SurveyedEncoder, read_room_contents
from avlmaps.query.rooms import commonness
from avlmaps.query.rooms import votes as votes_of

FURNISHED = read_room_contents()
NAMED = read_room_contents(FOLDER / "embedded")
KINDS = FURNISHED.kinds


def votes(things: Sequence[str], kinds: Sequence[str], contents: RoomContents = FURNISHED) -> np.ndarray:
    return votes_of(things, kinds, contents)


@pytest.mark.parametrize("table", [FURNISHED, NAMED], ids=["furnished", "named"])
def test_a_table_names_things_and_rooms_of_the_lexicon(table: RoomContents) -> None:
    known = lexicon()
    assert all(known.find(thing, EntryKind.THING).name == thing for thing in table.things)  # pyright: ignore[reportOptionalMemberAccess]
    assert all(known.find(kind, EntryKind.ROOM).name == kind for kind in table.kinds)  # pyright: ignore[reportOptionalMemberAccess]
    assert table.surface_m2.shape == (len(table.things), len(table.kinds))
    assert (table.surface_m2 >= 0.0).all()
    assert (table.surface_m2.sum(axis=1) > 0.0).all() and (table.surface_m2.sum(axis=0) > 0.0).all()


def test_the_embedded_table_holds_its_encoders_names_and_rooms() -> None:
    encoder = EmbeddedPixels()
    assert isinstance(encoder, SurveyedEncoder) and encoder.room_contents is NAMED
    assert set(NAMED.things) <= set(encoder.names)
    assert set(NAMED.kinds) == set(EmbeddedViews().names)
    assert not {"wall", "floor", "ceiling", "other"} & set(NAMED.things)


@pytest.mark.few(6)
@pytest.mark.parametrize(
    ("thing", "kind"),
    [
        ("stove", "kitchen"), ("bed", "bedroom"), ("toilet", "bathroom"), ("sofa", "living room"),
        ("washing machine", "laundry room"), ("crib", "children's room"), ("dumbbell", "gym"), ("desk", "office"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("table", [FURNISHED, NAMED], ids=["furnished", "named"])
def test_things_speak_for_the_rooms_they_stand_in(thing: str, kind: str, table: RoomContents) -> None:
    home = [room for room in KINDS if room not in ("reception", "meeting room", "open-plan office", "copy room")]
    row = votes([thing], home, table)[0]
    assert home[int(row.argmax())] == kind
    assert row.max() > 0.5 > 0.0 > row.min()


@given(st.permutations(KINDS))
def test_votes_follow_their_kinds(kinds: list[str]) -> None:
    order = [KINDS.index(kind) for kind in kinds]
    np.testing.assert_array_equal(votes(["bed", "stove"], kinds), votes(["bed", "stove"], KINDS)[:, order])


def test_other_words_for_a_thing_or_a_room_vote_alike() -> None:
    np.testing.assert_array_equal(votes(["couch"], KINDS), votes(["sofa"], KINDS))
    np.testing.assert_array_equal(votes(["bed"], ["corridor"]), votes(["bed"], ["hallway"]))
    np.testing.assert_array_equal(votes(["stove"], ["kitchenette"]), votes(["stove"], ["kitchen"]))


def test_what_the_table_does_not_hold_speaks_for_none() -> None:
    assert (votes(["wall", "flying saucer"], KINDS) == 0.0).all()


def test_a_kind_that_the_table_does_not_hold_gets_the_mean() -> None:
    mean = votes(["bed"], KINDS).mean()
    assert votes(["bed"], ["cathedral of light"])[0, 0] == pytest.approx(mean)
    assert mean < 0.0, "a bed speaks against most kinds of room"


@pytest.mark.parametrize("table", [FURNISHED, read_room_contents(FOLDER / "embedded")])
def test_nothing_speaks_against_a_room_that_the_lexicon_places_it_in(table: RoomContents) -> None:
    """The homes that are counted have no table to dine at in a kitchen; real ones do."""
    kinds = table.kinds
    for thing in table.things:
        entry = lexicon().named(thing, EntryKind.THING)
        usual = np.array([kind in entry.rooms for kind in kinds])
        common = commonness([thing], kinds, table)
        assert (votes([thing], kinds, table)[0][usual] >= 0.0).all(), thing
        assert common is None or (common[usual] >= 0.0).all(), thing
    assert votes(["dining table"], ["kitchen"], table)[0, 0] == 0.0
    assert votes(["dining table"], ["bathroom"], table)[0, 0] < 0.0
