"""A map is asked with the models that built it, whatever a profile of that name holds by now."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import pytest
from build_fakes import SETTINGS, Pixels, Walk, register_fakes
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.registry import Backend, Kind, forget_loaded, register
from avlmaps.maps.build import build_map
from avlmaps.maps.store.manifest import ModelInfo
from avlmaps.perception.encoders import Encoders, profile, register_profile
from avlmaps.perception.models import public_choice, public_name
from avlmaps.query.avlmap import AVLMap

PROFILE = register_fakes()
WEIGHTS: dict[str, str] = {}
LOADED: list[str] = []


class Chosen(Pixels):
    """Runs several models; features depend on which."""

    def __init__(self, model: str) -> None:
        LOADED.append(model)
        weights = WEIGHTS.get(model, model)
        dim = Pixels.card.dim + weights.count("names")
        self.card = replace(Pixels.card, id=model, dim=dim, checksum=hashlib.sha256(weights.encode()).hexdigest())


class Unwanted(Chosen):
    """A model that nobody asked for."""

    def __init__(self, model: str) -> None:
        raise AssertionError("this model is not needed for the question")


@pytest.fixture(autouse=True)
def _chosen() -> None:
    register(Backend(Kind.PIXELS, "chosen", f"{__name__}:Chosen", model="org/small"))
    WEIGHTS.clear()
    LOADED.clear()
    forget_loaded()


def used_with(choice: str) -> Encoders:
    return profile(PROFILE).choosing({Kind.PIXELS: choice})


def test_a_map_opens_with_the_model_that_was_chosen(tmp_path: Path) -> None:
    build_map(Walk(), tmp_path / "map", used_with("chosen@org/large"), SETTINGS)
    stored = AVLMap.open(tmp_path / "map")
    assert stored.data.info.models["pixels"].backend == "chosen@org/large"
    assert stored.encoders.name == PROFILE
    assert stored.encoders.name_of(Kind.PIXELS) == "chosen@org/large"
    assert stored.encoders.pixels.card.id == "org/large"
    stored.require_model(Kind.PIXELS)


def test_the_default_model_is_remembered_by_name_so_that_it_may_change(tmp_path: Path) -> None:
    build_map(Walk(), tmp_path / "map", used_with("chosen"), SETTINGS)
    register(Backend(Kind.PIXELS, "chosen", f"{__name__}:Chosen", model="org/newer"))
    stored = AVLMap.open(tmp_path / "map")
    assert stored.encoders.name_of(Kind.PIXELS) == "chosen@org/small"
    stored.require_model(Kind.PIXELS)


def changing(pixels: str, views: str = "") -> Encoders:
    others = {kind.value: profile(PROFILE).name_of(kind) for kind in profile(PROFILE)}
    return Encoders("changing", **others | {"pixels": pixels, "views": views})


def test_a_profile_may_come_to_hold_other_backends(tmp_path: Path) -> None:
    register_profile(changing("chosen@org/a"))
    build_map(Walk(), tmp_path / "map", "changing", SETTINGS)
    register_profile(changing("chosen@org/b", "none-such"))
    stored = AVLMap.open(tmp_path / "map")
    assert stored.encoders.name_of(Kind.PIXELS) == "chosen@org/a"
    assert Kind.VIEWS not in stored.encoders, "a module that the map has no features of is not asked"


def test_maps_of_earlier_releases_open_unchanged(tmp_path: Path) -> None:
    build_map(Walk(), tmp_path / "map", PROFILE, SETTINGS)
    told = json.loads((tmp_path / "map" / "map.json").read_text())
    assert {kind: model["backend"] for kind, model in told["models"].items()} == {
        kind: "fake" for kind in ("pixels", "local", "place", "sounds")
    }, "a backend without models is written as before"
    assert AVLMap.open(tmp_path / "map").encoders == Encoders.named(PROFILE)


@pytest.mark.parametrize("weights", ["trained once more", "trained once more, with more names"])
def test_another_model_of_the_same_name_is_refused_in_one_sentence(tmp_path: Path, weights: str) -> None:
    build_map(Walk(), tmp_path / "map", used_with("chosen@org/large"), SETTINGS)
    WEIGHTS["org/large"] = weights
    forget_loaded()
    with pytest.raises(MapError, match=r"was built with org/large \(checksum .*build it again, or name the folder"):
        AVLMap.open(tmp_path / "map").require_model(Kind.PIXELS)


def test_only_the_model_that_a_question_needs_is_loaded(tmp_path: Path) -> None:
    build_map(Walk(), tmp_path / "map", used_with("chosen@org/large"), SETTINGS)
    register(Backend(Kind.SOUNDS, "fake", f"{__name__}:Unwanted", model="x"))
    try:
        AVLMap.open(tmp_path / "map").require_model(Kind.PIXELS)
    finally:
        register_fakes()


@pytest.mark.parametrize("place", ["/data/of/mine/large.pt", "~/models/large.pt", "./large.pt", "C:\\m\\large.pt"])
def test_where_a_model_lay_is_nobodys_business(tmp_path: Path, place: str) -> None:
    data = build_map(Walk(), tmp_path / "map", used_with(f"chosen@{place}"), SETTINGS)
    assert data.info.models["pixels"].backend == "chosen@large.pt"
    assert data.info.models["pixels"].id == "large.pt"
    for file in (tmp_path / "map").rglob("*.json"):
        assert place not in json.loads(f"[{json.dumps(file.read_text())}]")[0]
        assert "of/mine" not in file.read_text()
    WEIGHTS["large.pt"] = place  # the same file, found under its name
    AVLMap.open(tmp_path / "map").require_model(Kind.PIXELS)


def test_a_path_in_a_strangers_map_is_not_followed(tmp_path: Path) -> None:
    build_map(Walk(), tmp_path / "map", used_with("chosen@org/large"), SETTINGS)
    manifest = tmp_path / "map" / "map.json"
    manifest.write_text(manifest.read_text().replace("chosen@org/large", "chosen@../../etc/large"))
    assert AVLMap.open(tmp_path / "map").encoders.name_of(Kind.PIXELS) == "chosen@large"


@given(st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,20}(/[A-Za-z0-9][A-Za-z0-9._-]{0,20})?", fullmatch=True))
def test_ids_and_file_names_stay_as_they_are(model: str) -> None:
    assert public_name(model) == model
    assert public_choice(f"name@{model}") == f"name@{model}"
    assert public_name(f"/some/folder/{model}") == model.rpartition("/")[2]


def test_a_path_is_called_by_its_last_name() -> None:
    assert public_choice("clip@/data/me/clip/") == "clip@clip"
    assert public_choice("clip@/data/me/clip#last") == "clip@clip#last"
    assert public_choice("clip@openai/clip#a/b/c") == "clip@openai/clip#a/b/c"
    assert public_choice("clip") == "clip"
    assert ModelInfo.of("clip@/a/b/c", replace(Pixels.card, id="/a/b/c")).id == "c"


def test_other_keypoints_bring_the_matcher_that_was_made_for_them() -> None:
    foundation, paper = profile("foundation"), profile("paper")
    assert foundation.choosing({Kind.LOCAL: "aliked@aliked-n32"}).name_of(Kind.MATCHER) == "lightglue-aliked"
    assert foundation.choosing({Kind.LOCAL: "xfeat"}).name_of(Kind.MATCHER) == "xfeat"
    assert paper.choosing({Kind.LOCAL: "disk"}).name_of(Kind.MATCHER) == "lightglue-disk"
    assert paper.choosing({Kind.LOCAL: "disk", Kind.MATCHER: "mutual-ratio"}).name_of(Kind.MATCHER) == "mutual-ratio"
    assert paper.choosing({Kind.PIXELS: "tipsv2"}).name_of(Kind.MATCHER) == "superglue"


def test_an_unknown_choice_is_told_before_anything_is_built() -> None:
    with pytest.raises(BackendError, match="no pixels backend called 'nope'"):
        profile("foundation").choosing({Kind.PIXELS: "nope@x"})
