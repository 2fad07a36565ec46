"""What strangers hand in: each time one sentence, on a line of its own, and nothing on standard output."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def test_an_error_in_the_middle_of_a_loop_stands_on_its_own_last_line(walk: Path, run, tmp_path: Path) -> None:
    copy = tmp_path / "rec"
    shutil.copytree(walk, copy)
    for depth in sorted((copy / "depth").iterdir())[:12]:
        depth.write_bytes(depth.read_bytes()[:200])
    status, out, err = run("build", copy, "--out", tmp_path / "map")
    assert (status, out) == (1, "")
    last = err.rstrip("\n").replace("\r", "\n").split("\n")[-1]
    assert last.startswith("avlmaps: ")
    assert "frames cannot be read" in last


def test_a_name_that_the_system_refuses_is_told_without_its_number_for_it(built: Path, run) -> None:
    status, out, err = run("query", built, "--image", "x" * 300 + ".png")
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert "Errno" not in err
    assert "File name too long; check the path" in err


def test_a_truncated_photo_is_told_in_our_words_alone(built: Path, walk: Path, tmp_path: Path) -> None:
    photo = tmp_path / "photo.png"
    photo.write_bytes(next((walk / "rgb").iterdir()).read_bytes()[:1500])
    words = [sys.executable, "-m", "avlmaps", "locate", str(built), str(photo)]
    plain = {name: value for name, value in os.environ.items() if name != "OPENCV_LOG_LEVEL"}
    told = subprocess.run(words, capture_output=True, text=True, env=plain, check=False)
    assert (told.returncode, told.stdout) == (1, "")
    assert told.stderr == f"avlmaps: The picture {photo} cannot be read as an image; use a PNG or a JPEG.\n"


def test_a_broken_package_does_not_hide_the_other_backends(answer, run, monkeypatch: pytest.MonkeyPatch) -> None:
    from avlmaps.core import registry

    broken = registry.Backend(registry.Kind.VIEWS, "broken", "no_such_module_here:Model")
    monkeypatch.setitem(registry._registered, (broken.kind, broken.name), broken)
    told = answer("profiles")
    (other,) = [entry for entry in told["other_backends"] if entry["name"] == "broken"]
    assert other["state"] == "broken"
    assert "cannot be loaded from no_such_module_here:Model" in other["note"]
    assert told["profiles"][0]["name"] == "embedded"
    assert "broken" in run("profiles")[1].split("in no profile:")[1]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_under_standard_output_is_one_sentence(walk: Path) -> None:
    with Path("/dev/full").open("wb") as full:
        words = [sys.executable, "-m", "avlmaps", "info", str(walk), "--json"]
        told = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    last = told.stderr.replace("\r", "\n").rstrip("\n").split("\n")[-1]
    assert last == "avlmaps: No space left on device; check the files and the space on the disk."
    assert told.returncode == 1
