"""Sentences that are not English: they are known as such, and their language is named only where its words decide."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language.commands import read_command
from avlmaps.language.intents import Clarify
from avlmaps.language.sentence import language_of

NAMED = {
    "va a la cocina": "Spanish", "va en la cuisine": "French", "va alla porta": "Italian", "alto!": "Spanish",
    "gehe in die Küche": "German", "va para a cozinha": "Portuguese", "ga naar de keuken": "Dutch",
    "gå till köket": "Swedish", "idź do kuchni": "Polish", "mutfağa git": "Turkish", "pergi ke dapur": "Indonesian",
}  # fmt: skip
# Words of several languages, or of one that the book does not hold.
UNNAMED = [
    "va a la x", "vai a la porta", "ir a la mesa", "gå til køkkenet", "jdi do kuchyně", "menj a konyhába", "台所へ",
    "去厨房", "иди на кухню", "اذهب إلى المطبخ",
]  # fmt: skip
ENGLISH = ["go to the café", "find the piñata", "dove", "the metro", "a sedan", "the chaise longue", "go to the salón"]


@pytest.mark.parametrize("sentence", NAMED)
def test_a_language_is_named_where_its_words_decide(sentence: str) -> None:
    assert language_of(sentence) == NAMED[sentence]


@pytest.mark.parametrize("sentence", UNNAMED)
def test_a_sentence_of_several_languages_is_foreign_and_of_none_by_name(sentence: str) -> None:
    assert language_of(sentence) == "another language than English"
    (back,) = read_command(sentence).intents
    assert isinstance(back, Clarify) and "English" in back.question


@pytest.mark.parametrize("sentence", ENGLISH)
def test_a_borrowed_word_is_english(sentence: str) -> None:
    assert language_of(sentence) is None


@given(st.lists(st.sampled_from(["va", "a", "la", "en", "de", "para", "un", "al", "da"]), min_size=1, max_size=6))
def test_words_that_languages_share_name_none(shared: list[str]) -> None:
    # Each of these words is of two languages of the book at least.
    assert language_of(" ".join(shared)) in (None, "another language than English")
