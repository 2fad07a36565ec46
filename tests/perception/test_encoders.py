"""Encoders as a value: names of the registry or objects, and what is made for an object that lacks it."""

import importlib
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import avlmaps
from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Backend, Kind, register
from avlmaps.perception.encoders import MODULES, Encoders, encoders_of, profile, profiles
from avlmaps.perception.protocols import PixelEncoder
from helpers.walked_room import shared_walk


class Words:
    """Three words, an axis each; nothing else of the protocol."""

    def __init__(self, scale: float = 1.0, table: np.ndarray | None = None) -> None:
        self.scale, self.table = scale, table

    def encode_words(self, words) -> np.ndarray:
        rows = np.zeros((len(words), 3), np.float32)
        for row, word in zip(rows, words, strict=True):
            if word in ("chair", "sofa", "table"):
                row[("chair", "sofa", "table").index(word)] = 1.0
        return rows


@pytest.mark.parametrize("name", [one.name for one in profiles() if one.name != "fake"])
def test_a_profile_by_name_has_its_encoders_and_loads_none(name: str) -> None:
    used = Encoders.named(name)
    assert used.name == name and used == encoders_of(profile(name))
    assert {kind: used.name_of(kind) for kind in MODULES} == {k: profile(name).name_of(k) for k in MODULES}
    assert used.weight_variance_m2 == profile(name).weight_variance_m2


@given(st.dictionaries(st.sampled_from(MODULES), st.sampled_from(["", None]), max_size=6))
def test_what_is_put_in_the_place_of_a_module_changes_that_one_alone(instead: dict) -> None:
    used = Encoders.named("embedded", **{kind.value: one for kind, one in instead.items()})
    assert set(used) == set(Encoders.named("embedded")) - set(instead)
    for kind in used:
        assert used.sources[kind] == Encoders.named("embedded").sources[kind]


def test_an_object_needs_no_registry_and_brings_a_vocabulary_and_a_card() -> None:
    mine = Words()
    used = Encoders.named("embedded", pixels=mine)
    assert used.pixels is used.pixels and used.name_of(Kind.PIXELS) == "given:Words"
    assert (used.pixels.card.id, used.pixels.card.dim) == ("Words", 3) and len(used.pixels.card.checksum) == 64
    assert set(used.pixels.vocabulary) == {"chair", "sofa"}
    assert (used.pixels.understood("sofa"), used.pixels.understood("moon")) == ("sofa", "")
    assert isinstance(used.pixels, PixelEncoder)


def test_a_profile_takes_an_object_too() -> None:
    assert Encoders.named(Encoders("mine", pixels=Words())).pixels.card.id == "Words"
    assert Encoders("mine", pixels=Words()).name_of(Kind.PIXELS) == "given:Words"


@given(st.floats(0.1, 9.0), st.floats(0.1, 9.0))
def test_a_made_card_tells_encoders_apart_by_what_they_hold(one: float, other: float) -> None:
    def checksum(scale: float, table: np.ndarray | None = None) -> str:
        return Encoders(pixels=Words(scale, table)).card(Kind.PIXELS).checksum

    assert checksum(one) == checksum(one)
    assert (checksum(one) == checksum(other)) == (one == other)
    assert checksum(one, np.zeros(3)) != checksum(one, np.ones(3))


def test_what_an_object_lacks_is_named() -> None:
    with pytest.raises(BackendError, match=r"An encoder of pixels needs encode_words; the object that was given"):
        Encoders(pixels=object())
    with pytest.raises(BackendError, match=r"is the class Words; give an object: Words\(\)"):
        Encoders(pixels=Words)
    with pytest.raises(BackendError, match="encoder Words of pixels has no encode"):
        Encoders(pixels=Words()).pixels.encode(None)  # pyright: ignore[reportArgumentType]
    with pytest.raises(BackendError, match="no module called 'pixel'"):
        Encoders.named("embedded", pixel=Words())
    with pytest.raises(BackendError, match=r"no profile called 'embeded'.*Did you mean embedded"):
        Encoders.named("embeded")
    with pytest.raises(BackendError, match="given have no views backend"):
        Encoders(pixels=Words()).load(Kind.VIEWS)


def test_words_that_are_no_rows_are_refused() -> None:
    class Flat(Words):
        def encode_words(self, words) -> np.ndarray:
            return np.zeros(3, np.float32)

    class Raising(Words):
        def encode_words(self, words) -> np.ndarray:
            raise KeyError("chair")

    with pytest.raises(BackendError, match=r"Flat must give a row for each word, shape \(1, d\) for one; .* \(3,\)"):
        Encoders(pixels=Flat())
    with pytest.raises(BackendError, match="Raising raised KeyError"):
        Encoders(pixels=Raising())
    knows_none = type("Hues", (Words,), {"encode_words": lambda self, words: np.zeros((len(words), 3), np.float32)})
    with pytest.raises(BackendError, match=r"Hues has no vocabulary, .* give it one"):
        Encoders(pixels=knows_none())


GUIDE = Path(__file__).parents[2] / "docs"


def test_the_guides_encoder_answers_as_an_object_and_as_a_package(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says nothing of what its protocol needs besides; that is made for it, whichever way it comes."""
    (page,) = [one for one in GUIDE.rglob("*.md") if "class Hues" in one.read_text(encoding="utf-8")]
    blocks = page.read_text(encoding="utf-8").split("```python\n")[1:]
    (code,) = [block.partition("```")[0] for block in blocks if "class Hues" in block]
    (tmp_path / "hues_of_the_guide.py").write_text(code.partition("encoders =")[0], encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    register(Backend(Kind.PIXELS, "hues", "hues_of_the_guide:Hues"))
    encoders = Encoders.named("colours", pixels="hues")
    assert encoders.pixels is encoders.pixels
    few = avlmaps.BuildSettings(voxel_size_m=0.1, frames=avlmaps.FrameSettings(step=6))
    built = avlmaps.build_map(shared_walk(tmp_path_factory), tmp_path / "map", encoders=encoders, settings=few)
    assert built.ask("something red").text
    hues = Encoders.named("colours", pixels=importlib.import_module("hues_of_the_guide").Hues())
    assert avlmaps.open_map(tmp_path / "map", encoders=hues).ask("something red").text


def test_a_package_that_lacks_what_nobody_can_make_is_named_by_the_build_and_by_the_check(
    monkeypatch: pytest.MonkeyPatch, run: Any
) -> None:
    package = ModuleType("mute")
    package.Mute = type("Mute", (), {"encode": lambda self, frame: None})  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "mute", package)
    register(Backend(Kind.PIXELS, "mute", "mute:Mute"))
    with pytest.raises(BackendError, match=r"Mute .* has no encode_words"):
        _ = Encoders.named("colours", pixels="mute").pixels
    status, out, err = run("profiles", "--check", "mute", "mutual-ratio", "--json")
    told = {one["name"]: one["fault"] for one in json.loads(out)["checks"]}
    assert status == 1 and "encode_words" in told["mute"] and told["mutual-ratio"] == ""
    assert "encode_words" in err
