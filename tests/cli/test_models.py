"""Choosing models on the command line, and what `avlmaps profiles` tells of them; no torch is needed for any of it."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from avlmaps.cli.main import _models_in_force as models_in_force
from avlmaps.cli.query import Query
from avlmaps.core.extras import install_command
from avlmaps.core.registry import Backend, Kind, find, forget_loaded
from avlmaps.perception.models import ModelSettings, availability, from_environment, model_settings, using_models
from helpers.light_files import write_light


@pytest.fixture(autouse=True)
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty machine: no models folder, no caches of others; every package is there."""
    for name in ("AVLMAPS_MODELS", "AVLMAPS_DEVICE", "AVLMAPS_PRECISION", "AVLMAPS_BATCH", "HF_HUB_CACHE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HF_HOME", str(tmp_path / "hf"))
    monkeypatch.setenv("TORCH_HOME", str(tmp_path / "torch"))
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "models"
    folder.mkdir()
    yield folder
    forget_loaded()


@pytest.fixture
def every_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Backend, "missing", property(lambda self: ()))


def state_of(kind: Kind, name: str, folder: Path | None = None) -> tuple[str, str]:
    with using_models(ModelSettings(folder=folder)):
        told = availability(find(kind, name))
    return told.state, told.note


def test_the_words_hold_while_the_verb_runs_and_for_processes_that_it_starts(
    empty: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AVLMAPS_BATCH", "7")
    monkeypatch.delenv("HF_HUB_OFFLINE", raising=False)
    with models_in_force(Query(map=Path("m"), models=empty, device="cpu", precision="float32")):
        assert model_settings() == ModelSettings(empty, "cpu", "float32", 7, False)
        code = "from avlmaps.perception.models import model_settings as s; print(s().folder, s().batch)"
        there = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        assert there.split() == [str(empty), "7"]
    assert "AVLMAPS_MODELS" not in os.environ
    assert model_settings() == from_environment() == ModelSettings(batch=7)


WRONG = (
    (("--models", "nowhere"), 1, "The folder of models"),
    (("--model", "pixels"), 2, "--model takes words like pixels="),
    (("--model", "words=embedded"), 2, "the modules are pixels, views"),
    (("--model", "pixels=nope"), 1, "There is no pixels backend called 'nope'"),
    (("--model", "pixels=colours", "--model", "pixels=embedded"), 2, "--model names pixels twice"),
    (("--model", "pixels=colours@large"), 1, "has no models to choose from; leave @large out"),
    (("--feature-cache-gb", "0"), 2, "--feature-cache-gb takes a number over 0"),
    (("--batch", "-1"), 2, "--batch takes a number from 1 on"),
    (("--profile", "best"), 1, "There is no profile called 'best'"),
)


@pytest.mark.parametrize(("words", "status", "sentence"), WRONG)
def test_a_wrong_choice_is_one_sentence(words, status: int, sentence: str, walk: Path, run, tmp_path: Path) -> None:
    told = run("build", walk, "--out", tmp_path / "m.avlmap", *words)
    assert told[0] == status and sentence in told[2]
    assert told[2].count("\n") == 1 and not (tmp_path / "m.avlmap" / "map.json").exists()


@pytest.mark.nightly
def test_chosen_backends_build_the_map_and_info_tells_them(walk: Path, answer, tmp_path: Path) -> None:
    out, store = tmp_path / "m.avlmap", tmp_path / "store"
    words = ("--voxel-size-m", 0.1, "--frame-step", 4, "--model", "pixels=colours", "--feature-cache", store)
    told = answer("build", walk, "--out", out, *words)
    assert told["models"]["pixels"] == "avlmaps/colour-words-1" and told["profile"] == "embedded"
    assert answer("info", out)["models"] == told["models"]
    assert {folder.name.partition("-")[0] for folder in store.iterdir()} >= {"pixels", "views", "local", "place"}


def test_a_missing_package_is_told_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Backend, "missing", property(lambda self: self.needs))
    for kind, name, extra in ((Kind.PIXELS, "tipsv2", "foundation"), (Kind.SOUNDS, "audioclip", "paper")):
        assert state_of(kind, name) == ("package missing", install_command(extra, distribution="avlmaps-models"))


def test_weights_in_the_hubs_cache_are_seen_without_its_library(tmp_path: Path, every_package: None) -> None:
    state, how = state_of(Kind.PIXELS, "clip-patches")
    assert state == "weights missing" and how.startswith("hf download openai/clip-vit-base-patch16")
    snapshot = tmp_path / "hf" / "hub" / "models--openai--clip-vit-base-patch16" / "snapshots" / "abc"
    snapshot.mkdir(parents=True)
    (snapshot / "config.json").write_text("{}")
    assert state_of(Kind.PIXELS, "clip-patches")[0] == "weights missing", "a configuration alone is not a model"
    (snapshot / "model.safetensors").write_bytes(b"")
    assert state_of(Kind.PIXELS, "clip-patches")[0] == "ready"


def test_profiles_prints_state_command_size_and_licence(empty: Path, every_package: None, answer, run) -> None:
    told = answer("profiles", "--models", empty)
    by_name = {entry["name"]: entry for entry in told["profiles"]}
    assert list(by_name)[:2] == ["embedded", "colours"] and by_name.keys() >= {"foundation", "paper"}
    pixels = by_name["foundation"]["backends"][0]
    assert (pixels["name"], pixels["state"], pixels["licence"]) == ("tipsv2", "weights missing", "Apache-2.0")
    assert "hf download google/tipsv2-b14" in pixels["note"]
    licences = {entry["name"]: entry["licence"] for entry in by_name["paper"]["backends"]}
    assert "non-commercial" in licences["superpoint"] and "non-commercial" in run("profiles")[1]


def test_the_light_profile_is_fetched_by_a_verb(empty: Path, answer, run, tmp_path: Path) -> None:
    published = write_light(tmp_path / "published")
    told = answer("profiles", "--fetch", "light", "--from", published, "--models", empty)
    assert told["fetched"] == "avlmaps/light-1" and Path(told["folder"]) == empty / "avlmaps" / "light-1"
    assert told["bytes"] == told["received_bytes"] > 0
    assert answer("profiles", "--fetch", "light", "--from", published, "--models", empty)["received_bytes"] == 0
    light = next(e for e in answer("profiles", "--models", empty)["profiles"] if e["name"] == "light")
    assert [b["state"] for b in light["backends"]] == ["ready"] * 6


def test_fetching_without_a_place_says_how_to_make_the_files(empty: Path, run) -> None:
    status, out, err = run("profiles", "--fetch", "light", "--models", empty)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "No files of the profile light are published yet; make them with python -m training.light" in err
    status, _, err = run("profiles", "--from", "somewhere")
    assert status == 2 and "add --fetch light" in err
