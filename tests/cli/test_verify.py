"""`info --verify`, and a build that is given the camera's height, by the command line."""

import shutil
from pathlib import Path

import pytest


def test_a_map_with_a_flipped_bit_is_found_out(built: Path, tmp_path: Path, run) -> None:
    copy = shutil.copytree(built, tmp_path / "copy.avlmap")
    file = max(copy.rglob("*.safetensors"), key=lambda path: path.stat().st_size)
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 16
    file.write_bytes(content)
    status, _, said = run("info", copy, "--verify")
    assert status == 1 and file.name in said


@pytest.mark.nightly
def test_the_cameras_height_puts_the_floor_where_it_says(walk: Path, tmp_path: Path, answer) -> None:
    made = answer(
        "build", walk, "--out", tmp_path / "told.avlmap", "--voxel-size-m", "0.1", "--profile", "colours",
        "--camera-height-m", "1.1",
    )  # fmt: skip
    assert made["ground"]["camera_height_m"] == 1.1
    assert answer("info", tmp_path / "told.avlmap")["ground"]["camera_height_m"] == 1.1
