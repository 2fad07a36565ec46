"""A short walk in the analytic room with one real-looking sound, and its map: made once, used by every verb's test."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from avlmaps.cli import main
from helpers.plain_numbers import assert_plain
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


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run a command line in this process; return its exit status, standard output and standard error."""

    def call(*words: object) -> tuple[int, str, str]:
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            main([str(word) for word in words])
        said = capsys.readouterr()
        assert_plain(said.out + said.err)
        return int(stop.value.code or 0), said.out, said.err

    return call


@pytest.fixture
def answer(run: Callable[..., tuple[int, str, str]]) -> Callable[..., dict[str, Any]]:
    """Run a command line with --json and return its one object."""

    def call(*words: object) -> dict[str, Any]:
        status, out, err = run(*words, "--json")
        assert status == 0, err
        assert out.count("\n") == 1, "one JSON object on standard output, and nothing else"
        return json.loads(out)

    return call
