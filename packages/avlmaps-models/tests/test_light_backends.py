"""The profile ``light`` round its networks: which files, which words wake the text tower, which frames are encoded."""

import json
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, find, forget_loaded, load
from avlmaps.perception.conformance import check, example_frame, example_sound
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import ModelSettings, availability, using_models
from avlmaps_models.light import bundle as files
from avlmaps_models.light.pixels import LightPixels
from avlmaps_models.light.sounds import LightSounds, log_mel
from avlmaps_models.light.tokens import TokenList, Tokens
from avlmaps_models.light.tower import interpolation
from avlmaps_models.light.views import LightViews
from helpers.light_files import KNOWN, PATCH, write_light, write_manifest


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("AVLMAPS_MODELS", raising=False)
    return tmp_path / "home"


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """The files, in the folder of models that is in force."""
    models = tmp_path / "models"
    out = write_light(models)
    with using_models(ModelSettings(folder=models)):
        yield out
    forget_loaded()


@pytest.mark.parametrize("kind", [Kind.PIXELS, Kind.VIEWS, Kind.SOUNDS])
def test_each_backend_conforms_without_torch(folder: Path, kind: Kind) -> None:
    backend = load(kind, "light")
    check(kind, backend)
    assert availability(find(kind, "light")).state == "ready"


def test_words_that_came_with_the_files_wake_no_text_tower(folder: Path) -> None:
    pixels, views, sounds = LightPixels(), LightViews(), LightSounds()
    with np.load(folder / files.KNOWN_WORDS) as arrays:
        stored = arrays["pixels_rows"].astype(np.float32)
    stored /= np.linalg.norm(stored, axis=1, keepdims=True)
    found = pixels.encode_words([" Office  Chair ", *KNOWN])
    np.testing.assert_allclose(found[1:], stored, atol=1e-6)
    np.testing.assert_array_equal(found[0], found[1 + KNOWN.index("office chair")])
    views.encode_words(["kitchen"])
    sounds.encode_words(["dog"])
    assert not (pixels.text.loaded or views.text.loaded or sounds.text.loaded)
    pixels.encode_words(["a chair that nobody named"])
    assert pixels.text.loaded and not views.text.loaded


def test_a_new_word_is_read_once_on_this_machine(folder: Path) -> None:
    first = LightPixels().encode_words(["zebra"])
    again = LightPixels()
    np.testing.assert_array_equal(again.encode_words(["zebra"]), first)
    assert not again.text.loaded, "it is stored in the user's cache"


def test_a_blank_word_has_no_feature(folder: Path) -> None:
    assert not LightPixels().encode_words(["  "]).any()


def test_the_view_of_a_picture_that_was_encoded_costs_no_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pixels, views, frame = LightPixels(), LightViews(), example_frame(1)
    alone = views.encode([example_frame(2)])
    pixels.encode(frame)
    pixels.encode(example_frame(2))

    def no_run(rgb: np.ndarray) -> None:
        raise AssertionError("the network ran again")

    monkeypatch.setattr(views._tower, "_run", no_run)
    assert views.encode([frame]).shape == (1, views.card.dim)
    np.testing.assert_allclose(views.encode([example_frame(2)]), alone, atol=1e-6)
    with pytest.raises(AssertionError, match="ran again"):
        views.encode([example_frame(3)])


def test_the_grid_covers_the_picture_in_its_shape(folder: Path) -> None:
    assert LightPixels().encode(example_frame(width=640, height=480)).shape[:2] == (
        56 // PATCH,
        round(56 / 0.75) // PATCH,
    )


def test_a_long_sound_has_a_window_every_half_window_and_one_at_its_end(folder: Path) -> None:
    assert len(LightSounds().encode(example_sound(seconds=5.5, rate_hz=8000))) == 5
    assert len(LightSounds().encode(example_sound(seconds=0.1, rate_hz=8000))) == 1


def test_cards_depend_on_the_networks_and_not_on_the_words_that_came_with_them(folder: Path) -> None:
    before = [LightPixels().card, LightViews().card, LightSounds().card]
    assert len({card.checksum for card in before}) == 3
    (folder / files.KNOWN_WORDS).write_bytes((folder / files.KNOWN_WORDS).read_bytes() + b" ")
    write_manifest(folder)
    assert [LightPixels().card, LightViews().card, LightSounds().card] == before


def damage_missing(folder: Path) -> None:
    (folder / files.SOUNDS).unlink()


def damage_short(folder: Path) -> None:
    (folder / files.SOUNDS).write_bytes((folder / files.SOUNDS).read_bytes()[:-9])


def damage_bit(folder: Path) -> None:
    content = bytearray((folder / files.SOUNDS).read_bytes())
    content[40] ^= 1
    (folder / files.SOUNDS).write_bytes(content)


def damage_manifest(folder: Path) -> None:
    (folder / files.MANIFEST).write_bytes(b"{")


def damage_format(folder: Path) -> None:
    said = json.loads((folder / files.MANIFEST).read_text())
    (folder / files.MANIFEST).write_text(json.dumps({**said, "format": 9}))


def damage_names(folder: Path) -> None:
    said = json.loads((folder / files.MANIFEST).read_text())
    said["files"]["../evil"] = said["files"].pop(files.SOUNDS)
    (folder / files.MANIFEST).write_text(json.dumps(said))


def damage_network(folder: Path) -> None:
    (folder / files.SOUNDS).write_bytes(b"no network")
    write_manifest(folder)


DAMAGES = {
    damage_missing: "cannot be read",
    damage_short: "is not the file that manifest.json describes",
    damage_bit: "another checksum",
    damage_manifest: "is no manifest of the profile light",
    damage_format: "has the format 9, and this release reads 1",
    damage_names: "names the files ../evil",
    damage_network: "cannot be run by onnxruntime",
}


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda f: f.__name__)
def test_bad_files_are_one_sentence(folder: Path, damage) -> None:
    damage(folder)
    with pytest.raises(BackendError) as stop:
        LightSounds().encode(example_sound())
    said = str(stop.value)
    assert DAMAGES[damage] in said and "get" in said and "\n" not in said


def test_a_table_of_words_that_is_none_is_one_sentence(folder: Path) -> None:
    (folder / files.KNOWN_WORDS).write_bytes(b"PK nothing")
    write_manifest(folder)
    with pytest.raises(BackendError, match="is no table of words"):
        LightPixels().encode_words(["chair"])


def test_without_the_files_the_sentence_names_the_command(tmp_path: Path) -> None:
    with using_models(ModelSettings(folder=tmp_path)):
        told = availability(find(Kind.PIXELS, "light"))
        assert (told.state, told.note) == ("weights missing", f"{files.HOW_TO_GET} (250 MB)")
        with pytest.raises(BackendError, match="avlmaps profiles --fetch light --from"):
            Encoders.named("light").load(Kind.PIXELS)


def test_a_folder_of_files_may_be_named_itself(folder: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    folder.rename(elsewhere)
    assert load(Kind.PIXELS, f"light@{elsewhere}").card.dim == 8
    assert availability(find(Kind.PIXELS, "light"), str(elsewhere)).state == "ready"


@given(st.integers(1, 40), st.integers(1, 80))
def test_interpolation_keeps_what_is_even_and_where_it_lies(given_cells: int, wanted: int) -> None:
    weights = interpolation(given_cells, wanted)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert (weights >= 0.0).all()
    np.testing.assert_allclose(weights, weights[::-1, ::-1], atol=1e-6)
    if wanted == given_cells:
        np.testing.assert_allclose(weights, np.eye(wanted), atol=1e-6)
    lies = weights @ (np.arange(given_cells) + 0.5) / given_cells
    assert (np.diff(lies) > -1e-6).all()


def test_a_tone_is_in_its_band_and_repeated_sound_is_the_same_sound() -> None:
    note = files.MelNote(
        rate_hz=48_000, window=48_000, fft=1024, hop=480, bands=64, lowest_hz=50.0, highest_hz=14_000.0
    )
    t = np.arange(12_000) / 48_000
    tone = np.sin(2 * np.pi * 1000.0 * t).astype(np.float32)
    bands = log_mel(tone, note)
    assert bands.shape == (101, 64)
    np.testing.assert_array_equal(bands, log_mel(np.tile(tone, 4), note))
    strongest = {log_mel(np.sin(2 * np.pi * hz * t).astype(np.float32), note)[50].argmax() for hz in (300, 1000, 5000)}
    assert len(strongest) == 3
    assert log_mel(np.zeros(5, np.float32), note).max() == -100.0


def test_bytes_are_cut_as_gpt_does() -> None:
    known = TokenList(
        "bytes", ["<unk>", *sorted({*"adogs'23!Ġ", "Ġdogs", "Ġd", "do"})], [("Ġ", "d"), ("d", "o")], unknown=0
    )
    tokens = Tokens(known, 50)
    names = ["".join(known.vocabulary[n] for n in tokens.encode(text)) for text in ("a dog's 23!", " a")]
    assert names == ["aĠdog'sĠ23!", "Ġa"]
    assert known.vocabulary[tokens.encode("a dog")[1]] == "Ġd", "the first merge goes first"


@given(st.text(max_size=40))
def test_any_text_has_tokens_up_to_the_most(text: str) -> None:
    for known in (
        TokenList("words", ["<unk>", "▁", "a", "▁a"], [("▁", "a")], unknown=0),
        TokenList("bytes", ["<s>", "</s>", "a"], [], start=0, end=1, unknown=2),
    ):
        numbers = Tokens(known, 8).encode(text)
        assert len(numbers) <= 8
        assert all(0 <= number < len(known.vocabulary) for number in numbers)


def test_a_list_of_tokens_travels(tmp_path: Path) -> None:
    known = TokenList("words", ["<unk>", "▁a"], [("▁", "a")], unknown=0)
    assert msgspec.json.decode(msgspec.json.encode(known), type=TokenList) == known
