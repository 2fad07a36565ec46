"""A backend of somebody else's package: installed, found by its entry point, held to its protocol, used in a map."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).parent / "example_backend"
USED = """
import json, sys
from avlmaps.core.registry import Kind, find, load
from avlmaps.query.avlmap import AVLMap
from avlmaps.perception.conformance import check

backend = load(Kind.PLACE, "thumbnail")
check(Kind.PLACE, backend)
avlmap = AVLMap.open(sys.argv[1])
avlmap.require_model(Kind.PLACE)
print(json.dumps({
    "target": find(Kind.PLACE, "thumbnail").target,
    "profile": [avlmap.encoders.name, *map(avlmap.encoders.name_of, (Kind.PLACE, Kind.PIXELS))],
    "model": avlmap.data.info.models["place"].id,
    "descriptors": list(avlmap.data.keyframes.place.shape),
}))
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the package into a folder of its own, without a network."""
    folder = tmp_path_factory.mktemp("installed")
    source = folder / "source"
    shutil.copytree(SOURCE, source, ignore=shutil.ignore_patterns("__pycache__"))
    words = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    quiet = {**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_CACHE_DIR": "1"}
    subprocess.run([*words, "--target", str(folder / "site"), str(source)], check=True, env=quiet)
    return folder / "site"


@pytest.fixture(scope="module")
def mapped(installed: Path) -> tuple[Path, Path]:
    """Return a recording, and the map that the command line builds of it with the package's backend."""
    recording, out = installed.with_name("rec"), installed.with_name("map")
    _write_recording(recording)
    words = ["-m", "avlmaps", "build", recording, "--out", out, "--profile", "colours", "--model", "place=thumbnail"]
    done = _run(installed, *words)
    assert done.returncode == 0, done.stderr
    return recording, out


def _run(installed: Path, *words: object) -> subprocess.CompletedProcess[str]:
    there = {**os.environ, "PYTHONPATH": str(installed)}
    command = [sys.executable, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, env=there, check=False)


def test_the_example_is_as_short_as_is_said() -> None:
    assert len((SOURCE / "thumbnail_places.py").read_text().splitlines()) <= 30


@pytest.mark.nightly  # by day: test_registry (entry points), test_conformance, test_remembered_models (its map)
def test_it_is_found_held_to_its_protocol_and_makes_a_map_that_remembers_it(
    installed: Path, mapped: tuple[Path, Path]
) -> None:
    done = _run(installed, "-c", USED, mapped[1])
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["target"] == "thumbnail_places:ThumbnailPlaces"
    assert told["profile"] == ["colours", "thumbnail", "colours"]
    assert told["model"] == "example/thumbnail-1"
    assert told["descriptors"][1] == 144


@pytest.mark.nightly
def test_the_command_line_lists_it_and_a_map_without_it_is_told_plainly(
    installed: Path, mapped: tuple[Path, Path], tmp_path: Path
) -> None:
    recording, out = mapped
    listed = json.loads(_run(installed, "-m", "avlmaps", "profiles", "--json").stdout)
    (mine,) = [entry for entry in listed["other_backends"] if entry["name"] == "thumbnail"]
    assert (mine["state"], mine["model"], mine["dim"]) == ("ready", "example/thumbnail-1", 144)
    without = tmp_path / "empty"
    without.mkdir()
    assert _run(without, "-m", "avlmaps", "info", out).returncode == 0, "what is in a map is told without its models"
    refused = _run(without, "-m", "avlmaps", "locate", out, next((recording / "rgb").iterdir()))
    assert refused.returncode == 1
    assert refused.stderr.startswith("avlmaps: There is no place backend called 'thumbnail'; known are:")


def _write_recording(path: Path) -> None:
    import numpy as np

    from avlmaps.core.camera import Pinhole, Rig
    from avlmaps.recordings.types import Frame
    from avlmaps.recordings.writer import RecordingWriter

    rng, camera = np.random.default_rng(0), Pinhole(60.0, 60.0, 40.0, 30.0, 80, 60)
    rig = Rig(camera, camera)
    wall = np.kron(rng.integers(0, 256, (6, 11, 3)), np.ones((10, 10, 1))).astype(np.uint8)
    with RecordingWriter(path, rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index in range(4):
            rgb = wall[:, 9 * index :][:, :80]  # 0.3 m at a distance of 2 m are 9 pixels
            pose = np.array([[1, 0, 0, 0.3 * index], [0, 0, 1, 0], [0, -1, 0, 1.2], [0, 0, 0, 1]], float)
            depth_m = np.linspace(1.9, 2.1, 60, dtype=np.float32)[:, None] * np.ones((1, 80), np.float32)
            writer.add(Frame(index, f"{index:06d}", 0.5 * index, rgb, depth_m, pose, rig))
