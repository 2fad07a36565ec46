"""A format of somebody else's package: installed, found by its entry point, held to the truth, built into a map."""

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import RecordingError
from avlmaps.recordings import open as known_formats
from avlmaps.recordings.conformance import NonConformanceError, Truth, check, check_damage, example_truth
from avlmaps.recordings.open import FORMATS, Format, find_format, formats, open_recording, register

SOURCE = Path(__file__).parent / "example_format"
USED = """
import json, sys
from pathlib import Path
from avlmaps.recordings.open import formats
from avlmaps.recordings.open import open_recording
recording = open_recording(sys.argv[1])
print(json.dumps({"format": recording.format, "frames": len(recording), "known": [f.name for f in formats()]}))
"""


def write(path: Path, truth: Truth) -> Path:
    path.mkdir(parents=True)
    c = truth.rig.rgb
    for i in range(len(truth)):
        np.savez(
            path / f"shot_{i:03d}.npz",
            rgb=truth.rgb[i],
            depth_m=truth.depth_m[i],
            world_from_camera=truth.world_from_camera[i],
            stamp_s=truth.stamps_s[i],
            k=(c.fx, c.fy, c.cx, c.cy),
        )
    return path


@pytest.fixture
def shoebox(monkeypatch: pytest.MonkeyPatch) -> Format:
    """Register the example for one test."""
    monkeypatch.syspath_prepend(str(SOURCE))
    monkeypatch.setattr(known_formats, "_registered", {})
    brought: Format = import_module("shoebox_recordings").FORMAT
    register(brought)
    return brought


def test_a_registered_format_is_found_and_keeps_its_promises(tmp_path: Path, shoebox: Format) -> None:
    truth = example_truth()
    path = write(tmp_path / "walk", truth)
    assert find_format(path) is shoebox and find_format(path, "shoebox") is shoebox
    assert shoebox in formats() and shoebox not in FORMATS
    check(lambda: open_recording(path), truth)
    check_damage(path, open_recording, tmp_path / "damaged", most_files=2)
    nothing = tmp_path / "nothing"
    (nothing / "photos").mkdir(parents=True)
    with pytest.raises(RecordingError, match=r"looked for: folder: .*; shoebox: shot_\*\.npz\."):
        open_recording(nothing)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"depth_m": lambda d: d * 2.0}, "the depths of frame 000005 are 2 times the true ones"),
        ({"rgb": lambda rgb: rgb[..., ::-1]}, "red and blue are swapped"),
        ({"world_from_camera": np.linalg.inv}, "the camera moves otherwise than it did"),
        ({"stamp_s": lambda s: s * 1000.0}, "stamps are"),
        ({"k": lambda k: (k[0], k[1], k[2] - 0.5, k[3] - 0.5)}, "the centre of the first pixel lies at 0.5, 0.5"),
        (
            {"world_from_camera": lambda p: np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]) @ p},
            "up is",
        ),
    ],
)
def test_a_reader_that_is_wrong_is_told_how(tmp_path: Path, shoebox: Format, change: dict, said: str) -> None:
    truth = example_truth()
    path = write(tmp_path / "walk", truth)
    for file in path.iterdir():
        content = dict(np.load(file))
        for name, changed in change.items():
            content[name] = np.asarray(changed(content[name]), content[name].dtype)
        np.savez(file, **content)
    with pytest.raises(NonConformanceError, match=said):
        check(lambda: open_recording(path), truth)


def test_a_package_that_cannot_be_imported_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    broken = EntryPoint("gone", "no_such_package:FORMAT", known_formats.ENTRY_POINT_GROUP)
    monkeypatch.setattr(known_formats, "entry_points", lambda group: [broken])
    known_formats._brought_formats.cache_clear()
    try:
        with pytest.raises(RecordingError, match=r"The format 'gone' cannot be loaded from no_such_package"):
            find_format(tmp_path)
    finally:
        known_formats._brought_formats.cache_clear()


@pytest.mark.nightly
def test_an_installed_package_brings_its_format(tmp_path: Path) -> None:
    source = tmp_path / "source"
    shutil.copytree(SOURCE, source, ignore=shutil.ignore_patterns("__pycache__"))
    words = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    quiet = {**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_CACHE_DIR": "1"}
    subprocess.run([*words, "--target", str(tmp_path / "site"), str(source)], check=True, env=quiet)
    path = write(tmp_path / "walk", example_truth())
    there = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path / "site"), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        [sys.executable, "-c", USED, str(path)], capture_output=True, text=True, env=there, check=False
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["format"] == "shoebox" and told["frames"] == 6
    assert told["known"] == [*(known.name for known in FORMATS), "shoebox"]
