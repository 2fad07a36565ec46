"""What strangers hand in: each time one sentence, on a line of its own, and nothing on standard output."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import soundfile


def test_an_error_in_the_middle_of_a_loop_stands_on_its_own_last_line(walk: Path, run, tmp_path: Path) -> None:
    copy = tmp_path / "rec"
    shutil.copytree(walk, copy)
    for depth in sorted((copy / "depth").iterdir())[:12]:
        depth.write_bytes(depth.read_bytes()[:200])
    status, out, err = run("build", copy, "--out", tmp_path / "map")
    assert (status, out) == (1, "")
    last = err.rstrip("\n").replace("\r", "\n").split("\n")[-1]
    assert last.startswith("avlmaps: ") and "frames cannot be read" in last


def test_a_name_that_the_system_refuses_is_told_without_its_number_for_it(built: Path, run) -> None:
    status, out, err = run("query", built, "--image", "x" * 300 + ".png")
    assert (status, out) == (1, "") and err.count("\n") == 1
    assert "Errno" not in err and "File name too long; check the path" in err


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


def test_a_track_of_one_sample_a_second_is_no_sound(built: Path, run, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "slow.wav", np.zeros(20), 1)
    status, _, err = run("query", built, "--sound-clip", tmp_path / "slow.wav")
    assert status == 1 and "has 1 samples a second" in err
