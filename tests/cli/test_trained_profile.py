"""The profile ``trained`` from the command line: listed, built with, queried, and other weights refused."""

import shutil
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import msgspec
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.core.registry import forget_loaded
from avlmaps.maps.store.folder import read
from avlmaps.perception.embedded.scene_network import SYNTHETIC_WEIGHTS, Notes, checksum_of
from helpers.walked_room import write_walk

CAMERA = Pinhole(80.0, 80.0, 60.0, 45.0, 120, 90)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """Five frames in the analytic room."""
    return write_walk(tmp_path / "rec", CAMERA, (100, 105, 1), beep_s=None)


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of models with eyes in it, as ``python -m training.pixels`` writes them without real frames."""
    monkeypatch.delenv("AVLMAPS_MODELS", raising=False)
    write_eyes(tmp_path / "models" / "eyes", temperature=1.5)
    yield tmp_path / "models"
    forget_loaded()


def write_eyes(folder: Path, temperature: float) -> None:
    """Write the network that ships as if it had been trained and calibrated anew."""
    folder.mkdir(parents=True)
    shipped = Path(str(files("avlmaps.perception.embedded") / "weights"))
    weights = (shipped / f"{SYNTHETIC_WEIGHTS}.onnx").read_bytes()
    shutil.copy(shipped / f"{SYNTHETIC_WEIGHTS}.onnx", folder)
    notes = msgspec.json.decode((shipped / f"{SYNTHETIC_WEIGHTS}.json").read_bytes(), type=Notes)
    notes = msgspec.structs.replace(notes, id="own/pixels-1", temperature=temperature)
    notes = msgspec.structs.replace(notes, checksum=checksum_of(weights, notes))
    (folder / f"{SYNTHETIC_WEIGHTS}.json").write_bytes(msgspec.json.encode(notes))


@pytest.mark.nightly
def test_a_map_is_built_with_them_and_queried(walk: Path, models: Path, run, answer, tmp_path: Path) -> None:
    listed = {one["name"]: one for one in answer("profiles", "--models", models)["profiles"]}
    assert [b["state"] for b in listed["trained"]["backends"][:2]] == ["ready", "ready"]
    home = tmp_path / "m.avlmap"
    answer("build", walk, "--out", home, "--profile", "trained", "--voxel-size-m", "0.1", "--models", models)
    made_by = read(home).info.models
    assert (made_by["pixels"].id, made_by["pixels"].backend) == ("own/pixels-1", "trained@eyes")
    assert (made_by["views"].id, made_by["views"].licence) == ("own/views-1", "your own")
    assert 0.0 <= answer("query", home, "--object", "wall", "--models", models)["parts"][0]["peak"] <= 1.0

    status, out, err = run("query", home, "--object", "wall")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "The model eyes is not here" in err and "--models DIR" in err

    write_eyes(tmp_path / "others" / "eyes", temperature=2.5)
    status, out, err = run("query", home, "--object", "wall", "--models", tmp_path / "others")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "was built with own/pixels-1 (checksum" in err and "as it was (--models DIR)" in err
