"""Every script of benchmarks/ and every example runs, in a small form, and ends without a traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

import avlmaps
from avlmaps_sim import RecordSettings, open_scene, record_scene
from helpers.made_once import made_once

pytestmark = [pytest.mark.nightly, pytest.mark.timeout(900)]
ROOT = Path(__file__).resolve().parents[1]
# Scripts that are no benchmark of their own; report.py runs the others and writes the page.
PARTS = {"page.py", "timing.py"}
SCRIPTS = {
    "cold_start.py": "--map {MAP} --repeats 1",
    "corrected.py": "--scenes house:1 --frames 16 --size 80 60 --most 60",
    "fusion.py": "--frames 2 --repeats 1",
    "geometry.py": "--scenes house:4 --sensors kinect --frames 8",
    "locate.py": "{REC} --photos 2 --pairs 1",
    "queries.py": "--voxels 20000 --features 5000 --dim 32",
    "report.py": "--check",
    "scale.py": "--folder {OUT} --map {MAP} --photo {PHOTO} --voxels 50000 --only object",
    "sources.py": "",
    "store.py": "--map {MAP} --voxels 50000",
    "tiled.py": "{MAP} {OUT}/tiled.avlmap --voxels 50000",
}
EXAMPLES = {
    "01_ask_a_map.py": "{MAP}",
    "02_build_a_map.py": "{REC} {OUT}/new.avlmap",
    "03_frames_of_a_recording.py": "{REC}",
    "04_your_own_loop.py": "{REC} {OUT}/new.avlmap",
    "05_your_own_encoder.py": "{REC} {OUT}/new.avlmap",
    "06_your_own_features.py": "{REC}",
    "07_heat.py": "{MAP}",
    "08_arrays.py": "{MAP}",
    "09_where_was_this_photo_taken.py": "{MAP} {PHOTO}",
    "10_answers_for_a_program.py": "{MAP} {OUT}/heat.png",
    "11_map_while_you_drive.py": "{REC} {OUT}/new.avlmap",
}


def _make(folder: Path) -> None:
    settings = RecordSettings(size=(160, 120), max_frames=24)
    record_scene(open_scene("house:7"), folder / "REC", settings)
    avlmaps.build_map(folder / "REC", folder / "MAP", progress=False)
    frame = next(iter(avlmaps.open_recording(folder / "REC")))
    Image.fromarray(frame.rgb).save(folder / "PHOTO.png")


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "home-of-examples", _make)


def test_every_script_and_example_is_listed() -> None:
    assert {file.name for file in (ROOT / "benchmarks").glob("*.py")} - PARTS == SCRIPTS.keys()
    assert {file.name for file in (ROOT / "examples").glob("*.py")} == EXAMPLES.keys()


@pytest.mark.parametrize(
    "script", [f"benchmarks/{name}" for name in SCRIPTS] + [f"examples/{name}" for name in EXAMPLES]
)
def test_it_runs(script: str, home: Path, tmp_path: Path) -> None:
    places = {"REC": home / "REC", "MAP": home / "MAP", "PHOTO": home / "PHOTO.png", "OUT": tmp_path}
    words = (SCRIPTS | EXAMPLES)[Path(script).name].format(**places).split()
    command = [sys.executable, str(ROOT / script), *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "benchmarks")}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
