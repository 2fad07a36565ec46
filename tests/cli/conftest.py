"""A short walk in the analytic room with one real-looking sound, and its map: made once, used by every verb's test."""

import shutil
from pathlib import Path

import pytest

from helpers.walked_room import shared_walk, walked_map


@pytest.fixture(scope="session")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 24 frames (6 s) with a sound from 2 to 4 s."""
    return shared_walk(tmp_path_factory)


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The map of the walk."""
    return walked_map(tmp_path_factory)


@pytest.fixture
def dated(walk: Path, tmp_path: Path) -> Path:
    """The walk as a drive of another day: the first frame is missing, and its clock is one."""
    path = shutil.copytree(walk, tmp_path / "dated")
    for table, stamp in (("poses.csv", 0), ("frames.csv", 1)):
        head, _, *rows = [line.split(",") for line in (path / table).read_text().splitlines()]
        for row in rows:
            row[stamp] = str(float(row[stamp]) + 1.7e9)
        (path / table).write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n")
    for folder in ("rgb", "depth"):
        (path / folder / "000000.png").unlink()
    return path
