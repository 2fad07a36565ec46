"""A short walk in the analytic room with one real-looking sound, and its map: made once, used by every verb's test."""

from pathlib import Path

import pytest

from avlmaps.cli import main
from helpers.walked_room import write_walk


@pytest.fixture(scope="session")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 24 frames (6 s) with a sound from 2 to 4 s."""
    return write_walk(tmp_path_factory.mktemp("walk") / "rec")


@pytest.fixture(scope="session")
def built(walk: Path) -> Path:
    """The map of the walk, built from the command line."""
    out = walk.parent / "room.avlmap"
    with pytest.raises(SystemExit) as stop:
        main(["build", str(walk), "--out", str(out), "--voxel-size-m", "0.1", "--profile", "colours"])
    assert stop.value.code == 0
    return out
