"""The profile ``light`` from the command line: built with, queried by any word; its networks are made by hand."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import soundfile

from avlmaps.cli import main
from avlmaps.core.camera import Pinhole
from avlmaps.core.registry import forget_loaded
from avlmaps.maps.keyframes import select_keyframes
from avlmaps.maps.store.folder import read
from avlmaps.recordings.open import open_recording
from helpers.light_files import write_light
from helpers.walked_room import RATE_HZ, beeps, write_walk

CAMERA = Pinhole(80.0, 80.0, 60.0, 45.0, 120, 90)


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten frames in the analytic room, with one sound of a second."""
    return write_walk(tmp_path_factory.mktemp("walk") / "rec", CAMERA, (100, 110, 1), 4.0, (1, 2, 3), 900.0)


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("models")
    write_light(folder)
    return folder


@pytest.fixture(scope="module")
def built(walk: Path, models: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("map") / "m.avlmap"
    words = ("--profile", "light", "--voxel-size-m", "0.1", "--models", models, "--feature-cache", "off")
    with pytest.raises(SystemExit) as stop:
        main([str(word) for word in ("build", walk, "--out", out, *words)])
    assert stop.value.code == 0
    return out


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("AVLMAPS_MODELS", raising=False)
    yield
    forget_loaded()


def test_the_map_names_its_models_and_has_features_of_keyframes_alone(built: Path, walk: Path, answer) -> None:
    told = answer("info", built, "--verify")
    assert told["profile"] == "light"
    models = read(built).info.models
    assert {kind: models[kind].backend for kind in ("pixels", "views", "sounds")} == dict.fromkeys(
        ("pixels", "views", "sounds"), "light@avlmaps/light-1"
    )
    assert models["pixels"].id == "avlmaps/light-1" and models["pixels"].licence == "MIT"
    stored, chosen = read(built), select_keyframes(open_recording(walk))
    assert told["frames"] == 10 and stored.keyframes.view.shape == (len(chosen), 8)
    assert 0 < np.asarray(stored.voxels.feature).any(axis=1).mean() <= 1.0


def test_any_word_a_room_a_sound_and_a_clip_are_queried(built: Path, models: Path, answer, tmp_path: Path) -> None:
    for word in ("chair", "espresso machine"):
        found = answer("query", built, "--object", word, "--models", models)
        assert found["parts"][0]["modality"] == "object" and "known" not in str(found["parts"][0].get("note"))
    assert 0.0 <= answer("query", built, "--area", "observatory", "--models", models)["parts"][0]["peak"] <= 1.0
    assert 0.0 <= answer("query", built, "--sound", "a tuba", "--models", models)["parts"][0]["peak"] <= 1.0
    clip = tmp_path / "beep.wav"
    soundfile.write(clip, beeps(1.0, 900.0), RATE_HZ)
    assert answer("query", built, "--sound-clip", clip, "--models", models)["parts"][0]["peak"] > 0.5


def test_other_weights_are_refused_in_one_sentence(built: Path, run, tmp_path: Path) -> None:
    write_light(tmp_path / "others", seed=1)
    status, out, err = run("query", built, "--object", "chair", "--models", tmp_path / "others")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "was built with avlmaps/light-1 (checksum" in err
    assert "name the folder that holds avlmaps/light-1 as it was (--models DIR)" in err


def test_without_its_files_a_build_is_one_sentence_with_the_command(walk: Path, run, tmp_path: Path) -> None:
    status, out, err = run("build", walk, "--out", tmp_path / "m.avlmap", "--profile", "light")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "get it with: avlmaps profiles --fetch light --from URL|DIR" in err
