"""Both profiles from a recording to answers, by the command line, on tiny random checkpoints in a folder of models.

Random weights find nothing rightly; what is held here is that everything fits together, and what is said when it
does not.
"""

# pyright: reportMissingImports=false
# torch lies in an environment of its own.

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from tiny.aliked import write_aliked
from tiny.audioclip import write_audioclip
from tiny.clap import write_clap
from tiny.clip import write_clip
from tiny.clip_patches import write_clip_patches
from tiny.disk import write_disk
from tiny.lightglue import write_lightglue
from tiny.lseg import write_lseg
from tiny.megaloc import write_megaloc
from tiny.netvlad import write_netvlad
from tiny.siglip2 import write_siglip2
from tiny.superglue import write_superglue
from tiny.superpoint import write_superpoint
from tiny.tipsv2 import write_tipsv2

from avlmaps.cli import main
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.registry import Backend, Kind, backends, load
from avlmaps.maps.store.folder import read
from avlmaps.perception.models import availability
from helpers.walked_room import RATE_HZ, beeps, write_walk

CAMERA = Pinhole(80.0, 80.0, 60.0, 45.0, 120, 90)
WRITERS: dict[str, tuple[Callable[[Path], None], ...]] = {
    "foundation": (write_tipsv2, write_siglip2, write_clap, write_disk, write_megaloc, write_lightglue),
    "paper": (write_lseg, write_clip, write_audioclip, write_superpoint, write_netvlad, write_superglue),
}
PROFILES = tuple(WRITERS)


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six frames in the analytic room, with one sound of a second."""
    return write_walk(tmp_path_factory.mktemp("walk") / "rec", CAMERA, (100, 148, 8), 2.0, (1, 2, 3), 900.0)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder of models for each profile."""
    import torch

    made: dict[str, Path] = {}
    for name, writers in WRITERS.items():
        made[name] = tmp_path_factory.mktemp(name)
        for write in writers:
            torch.manual_seed(0)
            write(made[name])
    return made


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    def call(*words: object) -> tuple[int, str, str]:
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            main([str(word) for word in words])
        said = capsys.readouterr()
        return int(stop.value.code or 0), said.out, said.err

    return call


@pytest.fixture
def answer(run: Callable[..., tuple[int, str, str]]) -> Callable[..., dict[str, Any]]:
    def call(*words: object) -> dict[str, Any]:
        status, out, err = run(*words, "--json")
        assert status == 0, err
        assert out.count("\n") == 1
        return json.loads(out)

    return call


class Maps:
    """The walk's map by each profile, built from the command line when it is first asked for."""

    def __init__(self, walk: Path, folders: dict[str, Path], cache: Path) -> None:
        self.walk, self.folders, self.cache = walk, folders, cache

    def __getitem__(self, name: str) -> Path:
        out = self.walk.parent / f"{name}.avlmap"
        if not out.exists():
            words = ("--profile", name, "--voxel-size-m", "0.1", "--feature-cache", self.cache)
            with pytest.raises(SystemExit) as stop:
                main([str(word) for word in ("build", self.walk, "--out", out, *words, *here(self.folders[name]))])
            assert stop.value.code == 0
        return out


@pytest.fixture(scope="module")
def maps(walk: Path, folders: dict[str, Path], cache: Path) -> Maps:
    return Maps(walk, folders, cache)


def here(folder: Path) -> tuple[object, ...]:
    return "--models", folder, "--device", "cpu"


@pytest.mark.parametrize("name", PROFILES)
def test_the_map_is_whole_and_names_its_models(name: str, maps: Maps, answer) -> None:
    told = answer("info", maps[name], "--verify")
    assert told["profile"] == name
    assert told["frames"] == 6
    assert set(told["models"]) == {"pixels", "views", "sounds", "local", "place", "matcher"}
    assert len(told["sounds"]) == 1
    stored = read(maps[name])
    assert np.asarray(stored.voxels.feature).any(axis=1).mean() > 0.5, "features lie on most of the surface"
    assert stored.keyframes.view.shape[1] == stored.info.models["views"].dim
    for model in stored.info.models.values():
        assert "@" in model.backend and model.licence and len(model.checksum) == 64


@pytest.mark.parametrize("name", PROFILES)
def test_no_path_of_this_machine_is_in_the_map(name: str, maps: Maps, folders: dict[str, Path], walk: Path) -> None:
    said = (maps[name] / "map.json").read_text()
    assert str(folders[name]) not in said
    assert str(walk.parent) not in said


@pytest.mark.parametrize("name", PROFILES)
def test_words_sounds_areas_and_photos_are_asked_of_it(
    name: str, maps: Maps, folders: dict[str, Path], walk: Path, answer, tmp_path: Path
) -> None:
    clip, photo = tmp_path / "beep.wav", sorted((walk / "rgb").iterdir())[2]
    soundfile.write(clip, beeps(1.0, 900.0), RATE_HZ)
    sentence = answer("query", maps[name], "the red cabinet near the sound of a dog barking", *here(folders[name]))
    assert [part["modality"] for part in sentence["parts"]] == ["object", "sound"]
    assert isinstance(sentence["found"], bool)
    by_clip = answer("query", maps[name], "--sound-clip", clip, *here(folders[name]))
    assert by_clip["parts"][0]["peak"] > 0.5, "the very sound is like itself"
    assert by_clip["found"]
    area = answer("query", maps[name], "--area", "kitchen", *here(folders[name]))
    assert 0.0 <= area["parts"][0]["peak"] <= 1.0
    assert "world_from_camera" in answer("locate", maps[name], photo, *here(folders[name]))


@pytest.mark.parametrize("name", PROFILES)
def test_the_same_build_again_makes_the_same_map_and_another_voxel_size_encodes_nothing(
    name: str, maps: Maps, folders: dict[str, Path], walk: Path, cache: Path, run, tmp_path: Path
) -> None:
    words = ("--profile", name, *here(folders[name]), "--feature-cache")
    assert run("build", walk, "--out", tmp_path / "again", "--voxel-size-m", 0.1, *words, "off")[0] == 0
    first, again = read(maps[name]), read(tmp_path / "again")
    for one, other in ((first.voxels.feature, again.voxels.feature), (first.keyframes.view, again.keyframes.view)):
        np.testing.assert_allclose(one.astype(np.float32), other, atol=2e-3, err_msg="with the cache and without")
    before = {file: file.stat().st_mtime_ns for file in cache.rglob("*.npy")}
    status, _, err = run("build", walk, "--out", tmp_path / "finer", "--voxel-size-m", 0.07, *words, cache)
    assert status == 0
    assert "6 from the cache" in err
    assert {file for file in cache.rglob("*.npy")} == set(before), "nothing new was encoded"


def test_a_model_of_another_profile_is_one_option(
    walk: Path, folders: dict[str, Path], answer, run, tmp_path: Path
) -> None:
    import torch

    torch.manual_seed(0)
    models = tmp_path / "models"
    shutil.copytree(folders["foundation"], models)
    for write in (write_clip_patches, write_aliked, write_clip, lambda folder: write_lightglue(folder, "aliked")):
        write(models)
    shutil.copytree(models / "openai" / "clip-vit-base-patch16", tmp_path / "mine" / "patches")
    out = tmp_path / "m.avlmap"
    chosen = (f"pixels=clip-patches@{tmp_path}/mine/patches", "views=clip", "local=aliked", "place=vlad")
    words = ("--profile", "foundation", *here(models), "--model", *chosen, "--feature-cache", "off")
    told = answer("build", walk, "--out", out, "--voxel-size-m", 0.1, *words)
    assert told["models"]["pixels"] == "patches"
    assert told["models"]["matcher"].startswith("lightglue/aliked"), "the matcher follows the keypoints"
    assert str(tmp_path) not in (out / "map.json").read_text()
    status, _, err = run("query", out, "--object", "chair", *here(models))
    assert status == 1 and "patches" in err, "a model that lay elsewhere is asked for by its name"
    assert answer("query", out, "--object", "chair", *here(tmp_path / "mine"))["parts"]
    assert answer("query", out, "--area", "kitchen", *here(models))["parts"], "only the model that is asked is loaded"


def test_another_models_weights_are_refused_in_one_sentence(
    maps: Maps, folders: dict[str, Path], run, tmp_path: Path
) -> None:
    from safetensors.torch import load_file, save_file

    write_tipsv2(tmp_path)
    (file,) = (tmp_path / "google" / "tipsv2-b14").glob("*.safetensors")
    weights = load_file(file)
    save_file({name: weight * 1.01 for name, weight in weights.items()}, file, {"format": "pt"})
    status, out, err = run("query", maps["foundation"], "--object", "chair", *here(tmp_path))
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert "was built with google/tipsv2-b14 (checksum" in err
    assert "build it again, or name the folder that holds google/tipsv2-b14 as it was (--models DIR)" in err
    assert "KeyError" not in err


@pytest.mark.parametrize("name", PROFILES)
def test_a_missing_model_is_one_sentence_with_the_command(
    name: str, walk: Path, maps: Maps, run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable in ("HF_HOME", "HF_HUB_CACHE", "TORCH_HOME"):
        monkeypatch.setenv(variable, str(tmp_path / "nothing"))
    (tmp_path / "models").mkdir()
    said = []
    for words in (
        ("build", walk, "--out", tmp_path / "m.avlmap", "--profile", name),
        ("query", maps[name], "--object", "chair"),
    ):
        status, out, err = run(*words, *here(tmp_path / "models"))
        assert (status, out, err.count("\n")) == (1, "", 1), err
        said.append(err)
    command = {"foundation": "hf download google/tipsv2-b14", "paper": "demo_e200.ckpt"}[name]
    assert command in said[1] and all("is not here" in sentence and "get it" in sentence for sentence in said)


def test_a_missing_package_is_one_sentence_with_the_command(walk: Path, run, monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setattr(Backend, "missing", property(lambda self: self.needs))
    status, out, err = run("build", walk, "--out", tmp_path / "m", "--profile", "paper")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.endswith(f"get it with: {install_command('paper', distribution='avlmaps-models')}\n")


@pytest.mark.parametrize("name", PROFILES)
def test_profiles_tells_what_is_here(name: str, folders: dict[str, Path], answer, monkeypatch, tmp_path: Path) -> None:
    for variable in ("HF_HOME", "TORCH_HOME"):
        monkeypatch.setenv(variable, str(tmp_path))

    def states(*words: object) -> set[str]:
        listed = {entry["name"]: entry for entry in answer("profiles", *words)["profiles"]}
        return {backend["state"] for backend in listed[name]["backends"]}

    assert states("--models", folders[name]) == {"ready"}
    assert states() == {"weights missing"}


@pytest.mark.parametrize("backend", [b for b in backends() if "torch" in b.needs], ids=lambda b: f"{b.kind}-{b.name}")
def test_the_list_names_the_command_that_loading_names(backend: Backend, models: Path, monkeypatch) -> None:
    for variable in ("HF_HOME", "TORCH_HOME"):
        monkeypatch.setenv(variable, str(models))
    told = availability(backend)
    assert told.state == "weights missing"
    with pytest.raises(BackendError) as stop:
        load(backend.kind, backend.name)
    command = told.note.partition(" (")[0]
    assert command in str(stop.value)


def test_a_device_that_is_not_there_is_one_sentence(walk: Path, folders: dict[str, Path], run, tmp_path: Path) -> None:
    words = ("--profile", "foundation", "--models", folders["foundation"], "--device", "cuda:77")
    status, _, err = run("build", walk, "--out", tmp_path / "m", *words)
    assert status == 1
    assert "The device 'cuda:77' cannot be used here" in err and "choose --device" in err


def test_large_models_have_all_cores_unless_threads_are_named(run, monkeypatch: pytest.MonkeyPatch) -> None:
    import torch

    from avlmaps_models.common import device

    for variable in ("AVLMAPS_TORCH_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.setenv(variable, "")
        monkeypatch.delenv(variable)
    assert run("profiles")[0] == 0
    assert os.environ["AVLMAPS_TORCH_THREADS"] == str(os.cpu_count())
    assert os.environ["OMP_NUM_THREADS"] == "1"
    monkeypatch.setenv("AVLMAPS_TORCH_THREADS", "2")
    device._use_cores.cache_clear()
    try:
        device.select_device()
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(1)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("AVLMAPS_TORCH_THREADS")
    assert run("profiles")[0] == 0
    assert "AVLMAPS_TORCH_THREADS" not in os.environ, "who sets threads for all means torch, too"


@pytest.mark.shared
@pytest.mark.slow
@pytest.mark.parametrize("name", PROFILES)
def test_the_red_kitchen_runs_through(
    name: str, shared_data: Path, folders: dict[str, Path], answer, tmp_path: Path
) -> None:
    kitchen, out = tmp_path / "redkitchen", tmp_path / "kitchen.avlmap"
    kitchen.mkdir()
    for file in (shared_data / "data" / "redkitchen").iterdir():
        if file.name.startswith(("camera", "frame-000000", "frame-000400")):
            shutil.copy(file, kitchen)
    words = ("--profile", name, *here(folders[name]), "--voxel-size-m", 0.1, "--feature-cache", "off")
    told = answer("build", kitchen, "--out", out, *words)
    assert told["frames"] == 2 and told["voxels"] > 1000
    assert answer("query", out, "--object", "red cabinet", *here(folders[name]))["goals"] is not None
    assert "inliers" in answer("locate", out, kitchen / "frame-000000.color.jpg", *here(folders[name]))
    assert read(out).info.models[Kind.PIXELS.value].dim == read(out).voxels.feature.shape[1]
