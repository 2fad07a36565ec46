"""Sentences that ask where a sound came from, and others."""

import pytest

from avlmaps.language.list_questions import Listed, read_list
from avlmaps.language.source_words import asks_for_source

ORIGIN = (
    "where does the barking come from?", "Where did that noise come from", "where is the beeping coming from?",
    "from where did the doorbell ring?", "where do you hear the barking from?", "what made that noise?",
    "which room does the barking come from?", "where is the source of the alarm?",
    "the chair near where the bark came from",
)  # fmt: skip
OTHERS = (
    "where is the dog?", "where did you hear the barking?", "the chair near the sound of a dog", "the last sound",
    "how far is the sofa from the kitchen?", "what can be seen from here?", "go to the sound of water", "",
)  # fmt: skip


@pytest.mark.parametrize("sentence", ORIGIN)
def test_an_origin_is_asked_for(sentence: str) -> None:
    assert asks_for_source(sentence)


@pytest.mark.parametrize("sentence", OTHERS)
def test_others_ask_for_no_origin(sentence: str) -> None:
    assert not asks_for_source(sentence)


@pytest.mark.parametrize(
    ("sentence", "first"),
    [
        ("where did the noise come from?", False), ("what made that sound", False), ("who is making the noise?", False),
        ("where did the last sound come from", False), ("from where did the first noise come?", True),
    ],
)  # fmt: skip
def test_a_noise_without_a_name_is_a_sound_by_time(sentence: str, first: bool) -> None:
    read = read_list(sentence)
    assert read is not None and read.of is Listed.SOUND_BY_TIME and read.first is first


@pytest.mark.parametrize("sentence", ["where did the noise of water come from?", "what made the noise in the kitchen?"])
def test_a_noise_that_is_described_is_read_as_a_sentence(sentence: str) -> None:
    assert read_list(sentence) is None
