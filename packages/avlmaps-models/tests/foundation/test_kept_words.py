"""Features of words outlive a process, by model, weights, sentences and precision."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tiny.clip import write_clip

from avlmaps.perception.models import ModelSettings, cache_folder, using_models
from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.kept_words import KeptWords
from avlmaps_models.common.prompts import Prompted
from avlmaps_models.foundation.clip import ClipViews

CARD = ModelCard("made/up", 3, "MIT", "0" * 64, ("a {}", "the {}"))


def _reader() -> tuple[list[str], Callable[[list[str]], np.ndarray]]:
    read: list[str] = []

    def encode(texts: list[str]) -> np.ndarray:
        read.extend(texts)
        return np.array([[len(text), 1.0, ord(text[0])] for text in texts], np.float32)

    return read, encode


def test_a_word_is_encoded_once_for_all_processes() -> None:
    read, encode = _reader()
    first = Prompted(encode, 3, CARD.prompts, KeptWords(CARD)).encode(["Kitchen", "hall"])
    assert len(read) == 4
    again = Prompted(encode, 3, CARD.prompts, KeptWords(CARD)).encode(["hall", "kitchen ", "hall"])
    assert len(read) == 4
    assert again.tobytes() == first[[1, 0, 1]].tobytes()
    without = Prompted(encode, 3, CARD.prompts).encode(["kitchen"])
    assert len(read) == 6 and without.tobytes() == first[:1].tobytes()


@pytest.mark.parametrize("other", [{"checksum": "1" * 64}, {"id": "another"}, {"prompts": ("a {}",)}])
def test_another_model_has_its_own(other: dict) -> None:
    read, encode = _reader()
    Prompted(encode, 3, CARD.prompts, KeptWords(CARD)).encode(["kitchen"])
    Prompted(encode, 3, CARD.prompts, KeptWords(replace(CARD, **other))).encode(["kitchen"])
    assert len(read) == 4


def test_another_precision_has_its_own() -> None:
    read, encode = _reader()
    for precision in ("float32", "bfloat16"):
        with using_models(ModelSettings(device="cpu", precision=precision)):
            Prompted(encode, 3, CARD.prompts, KeptWords(CARD)).encode(["kitchen"])
    assert len(read) == 4


def test_what_is_spoiled_is_made_again() -> None:
    read, encode = _reader()
    first = Prompted(encode, 3, CARD.prompts, KeptWords(CARD)).encode(["kitchen"])
    (path,) = (cache_folder() / "words").glob("*/*.safetensors")
    path.write_bytes(path.read_bytes()[:-9])
    again = Prompted(encode, 3, CARD.prompts, KeptWords(CARD)).encode(["kitchen"])
    assert len(read) == 4 and again.tobytes() == first.tobytes()


def test_views_ask_their_text_tower_once(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_clip(models)
    first = ClipViews().encode_words(["kitchen", "hall"])
    later = ClipViews()
    monkeypatch.setattr(later, "_read", lambda texts: pytest.fail(f"{texts} read again"))
    assert later.encode_words(["hall", "kitchen"]).tobytes() == first[::-1].tobytes()
