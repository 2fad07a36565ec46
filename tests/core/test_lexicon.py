"""Laws of the lexicon: every spelling leads home, no word names two things unawares, and nothing heavy is loaded."""

import re
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.lexicon import Entry, EntryKind, lexicon, noun_of
from avlmaps.core.words import distance, plural_of, singulars_of, squeezed

KNOWN = lexicon()
ENTRIES = KNOWN.entries()
ENTRY = st.sampled_from(ENTRIES)
WORD = st.text("abcdefgh", max_size=8)


def same(phrase: str, entry: Entry) -> bool:
    return entry in KNOWN.senses(phrase, entry.kind)


@given(ENTRY, st.data())
def test_every_spelling_in_any_case_joined_or_split_names_its_entry(entry: Entry, data: st.DataObject) -> None:
    spelling = data.draw(st.sampled_from(entry.spellings))
    assert same(spelling, entry)
    assert same(spelling.upper(), entry)
    assert same(spelling.replace(" ", "-"), entry)
    assert same(spelling.replace(" ", "").replace("-", ""), entry)
    assert same(f"  {spelling}  ", entry)


@pytest.mark.parametrize("kind", [EntryKind.THING, EntryKind.ROOM])
def test_plurals_name_the_entry_too(kind: EntryKind) -> None:
    for entry in KNOWN.entries(kind):
        assert same(entry.plural, entry), entry
        for spelling in entry.spellings:
            assert same(plural_of(spelling), entry), (entry, spelling)


def test_no_spelling_names_two_entries_of_a_kind_unless_it_is_declared_ambiguous() -> None:
    for kind in EntryKind:
        seen: dict[str, str] = {}
        for entry in KNOWN.entries(kind):
            keys = [squeezed(spelling) for spelling in entry.spellings]
            assert len(set(keys)) == len(keys), f"{entry} repeats a spelling"
            for key in keys:
                assert key in KNOWN.ambiguous[kind] or seen.setdefault(key, entry.name) == entry.name, (key, entry)


def test_names_are_unique_and_ambiguous_words_name_entries() -> None:
    for kind in EntryKind:
        names = [squeezed(entry.name) for entry in KNOWN.entries(kind)]
        assert len(set(names)) == len(names)
        for senses in KNOWN.ambiguous[kind].values():
            assert len(senses) > 1
            assert all(KNOWN.find(name, kind) is not None and KNOWN.find(name, kind).name == name for name in senses)


def test_what_entries_refer_to_are_entries_by_their_names() -> None:
    def is_name(name: str, kind: EntryKind) -> bool:
        entry = KNOWN.find(name, kind)
        return entry is not None and entry.name == name

    for entry in ENTRIES:
        assert all(is_name(name, entry.kind) for name in (*entry.wider, *entry.like)), entry
        assert all(is_name(name, EntryKind.THING) for name in entry.makers), entry
        assert all(is_name(name, EntryKind.SOUND) for name in entry.sounds), entry
        assert all(is_name(name, EntryKind.ROOM) for name in entry.rooms if name != "*"), entry
        assert all(word == word.strip() and word for word in entry.spellings), entry
        assert entry not in KNOWN.wider(entry.name, entry.kind), f"{entry} is wider than itself"


def test_sizes_are_ranges_of_metres() -> None:
    for entry in ENTRIES:
        for low, high in entry.size_m or ():
            assert 0.0 <= low <= high <= 6.0, entry


@given(ENTRY)
def test_wider_kinds_and_members_are_two_sides_of_one_relation(entry: Entry) -> None:
    for wide in KNOWN.wider(entry.name, entry.kind):
        assert entry in KNOWN.members(wide.name)
        assert KNOWN.is_a(entry.name, wide.name)


def test_a_thing_makes_the_sounds_that_name_it_as_their_maker() -> None:
    for sound in KNOWN.entries(EntryKind.SOUND):
        for maker in sound.makers:
            thing = KNOWN.find(maker, EntryKind.THING)
            assert thing is not None
            assert sound.name in thing.sounds


@pytest.mark.parametrize(
    ("phrase", "name"),
    [
        ("red kitchen table", "table"), ("bottle of wine", "bottle"), ("big red chests of drawers", "chest of drawers"),
        ("dining chair", "chair"), ("old arm chair by the window", "armchair"), ("wug", None), ("sofa wug", None),
        ("lamp on the desk", "lamp"),
    ],
)  # fmt: skip
def test_the_head_is_the_longest_known_tail_before_what_describes_it(phrase: str, name: str | None) -> None:
    head = KNOWN.head(phrase, EntryKind.THING)
    assert (head.name if head else None) == name


@pytest.mark.parametrize(
    ("phrase", "placed"),
    [
        ("red kitchen chairs", ("red chairs", "kitchen")), ("bathroom sink", ("sink", "bathroom")),
        ("living room sofa", ("sofa", "living room")), ("kitchen chest of drawers", ("chest of drawers", "kitchen")),
        *dict.fromkeys(["kitchen cabinet", "kitchen cabinets", "office chair", "sofa bed", "office kitchen", "gym bag",
                        "garden chair", "toilet brush", "kitchen", "chair", "bottle of kitchen cleaner"]).items(),
    ],
)  # fmt: skip
def test_a_room_before_a_thing_says_where_it_is_unless_the_whole_is_a_thing(
    phrase: str, placed: tuple[str, str] | None
) -> None:
    assert KNOWN.in_room(phrase) == placed


@given(st.sampled_from(ENTRIES))
def test_an_entry_is_in_no_room(entry: Entry) -> None:
    assert all(KNOWN.in_room(name) is None for name in (entry.name, *entry.synonyms))


def test_one_word_may_have_several_senses_and_several_kinds() -> None:
    assert [entry.name for entry in KNOWN.senses("hall", EntryKind.ROOM)] == ["hallway", "entrance hall"]
    assert {entry.kind for entry in KNOWN.senses("toilet")} == {EntryKind.THING, EntryKind.ROOM}
    assert KNOWN.find("toilet").kind is EntryKind.THING


def test_a_kind_takes_in_its_kinds_and_not_the_other_way_round() -> None:
    assert KNOWN.is_a("office chair", "chair")
    assert not KNOWN.is_a("chair", "office chair")
    assert KNOWN.is_a("red desks", "table")
    assert KNOWN.is_a("wug holder", "holder")
    assert {"chair", "sofa", "stool"} <= {entry.name for entry in KNOWN.members("seats")}


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("labtop", "laptop"), ("sofaa", "sofa"), ("chiar", "chair"), ("refridgerator", "refrigerator"), ("tabel", "table"),
     ("matress", "mattress"), ("bokshelf", "bookshelf")],
)  # fmt: skip
def test_a_misspelt_word_is_corrected(wrong: str, right: str) -> None:
    assert KNOWN.find(wrong) is None
    assert KNOWN.suggest(wrong)[0][0] == right


def test_a_word_that_is_like_none_is_not_corrected() -> None:
    for word in ("elephant", "zebra", "dragon", "wug", "xyz"):
        assert KNOWN.suggest(word, EntryKind.THING) == ()


@given(ENTRY)
def test_a_known_spelling_is_the_first_suggestion_for_itself(entry: Entry) -> None:
    if len(squeezed(entry.name)) > 3:
        assert squeezed(KNOWN.suggest(entry.name, entry.kind)[0][0]) == squeezed(entry.name)


@given(WORD, WORD)
def test_edit_distance_is_symmetric_bounded_and_zero_for_equals(one: str, other: str) -> None:
    assert distance(one, one) == 0.0
    assert distance(one, other) == distance(other, one)
    assert distance(one, other) <= max(len(one), len(other))
    assert (distance(one, other) == 0.0) == (one == other)
    assert distance(one + "z", other + "z") <= distance(one, other)
    letters, others = set(one), set(other)
    assert distance(one, other) >= max(len(letters - others), len(others - letters)), "as suggestions rely on"


def test_a_swap_counts_once_and_a_doubled_letter_half() -> None:
    assert distance("chair", "chiar") == 1.0
    assert distance("sofa", "soffa") == 0.5
    assert distance("matress", "mattress") == 0.5
    assert distance("lamp", "damp") == 1.0


@pytest.mark.parametrize(
    ("one", "many"),
    [("chest of drawers", "chests of drawers"), ("shelf", "shelves"), ("knife", "knives"), ("box", "boxes"),
     ("pantry", "pantries"), ("toy", "toys"), ("piano", "pianos"), ("child", "children"), ("postman", "postmen"),
     ("ottoman", "ottomans"), ("scissors", "scissors"), ("computer mouse", "computer mice"), ("bench", "benches")],
)  # fmt: skip
def test_plurals_of_nouns_and_phrases(one: str, many: str) -> None:
    assert plural_of(one) == many
    assert one == many or one in singulars_of(many)


def test_nouns_end_before_their_description() -> None:
    assert noun_of("blue zebra in a cage") == "zebra"
    assert noun_of("") == ""


def test_every_single_word_is_listed() -> None:
    assert {"dining", "chair", "couch", "red", "wooden", "barking"} <= KNOWN.words
    assert all(re.fullmatch(r"\S+", word) and word == word.lower() for word in KNOWN.words)


def test_the_lexicon_loads_nothing_heavy() -> None:
    code = (
        "import sys; from avlmaps.core.lexicon import lexicon; lexicon().find('chair'); "
        "print([m for m in ('numpy', 'scipy', 'cv2', 'onnxruntime', 'msgspec') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
