"""`info --verify`, and a build that is given the camera's height, by the command line."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., tuple[int, str, str]]
Answer = Callable[..., dict[str, Any]]


def damaged(built: Path, copy: Path) -> tuple[Path, str]:
    """Copy a map and flip a bit in the middle of one of its arrays; return the map and the file's name."""
    shutil.copytree(built, copy)
    file = max(copy.rglob("*.safetensors"), key=lambda path: path.stat().st_size)
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 16
    file.write_bytes(content)
    return copy, file.name


def test_a_damaged_map_is_found_out(built: Path, tmp_path: Path, run: Run) -> None:
    copy, name = damaged(built, tmp_path / "copy.avlmap")
    status, _, said = run("info", copy, "--verify")
    assert status == 1
    assert name in said


@pytest.mark.nightly
def test_the_cameras_height_puts_the_floor_where_it_says(walk: Path, tmp_path: Path, answer: Answer) -> None:
    made = answer(
        "build", walk, "--out", tmp_path / "told.avlmap", "--voxel-size-m", "0.1", "--profile", "colours",
        "--camera-height-m", "1.1",
    )  # fmt: skip
    assert made["ground"]["camera_height_m"] == 1.1
    assert answer("info", tmp_path / "told.avlmap")["ground"]["camera_height_m"] == 1.1
