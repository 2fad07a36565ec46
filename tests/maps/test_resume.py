"""SIGKILL at random instants, and just before chosen steps on the disk: nothing that was finished is lost."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from build_fakes import content_of, register_fakes

from avlmaps.core.errors import MapError
from avlmaps.maps.store.folder import read

register_fakes()
OLD, NEW = 1, 2  # seeds of the walks
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL, which this system lacks")


@dataclass
class Builder:
    """The process that forks builds and kills them."""

    process: subprocess.Popen[str]
    folder: Path

    def build(
        self, path: Path, seed: int, *, delay_s: float | None = None, step: int | None = None
    ) -> tuple[int, float]:
        """Return the exit code (-9 for killed) and the seconds that it ran."""
        assert self.process.stdin is not None and self.process.stdout is not None
        order = {"path": str(path), "seed": seed, "delay_s": delay_s, "step": step, "log": str(self.folder / "steps")}
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        assert answer["code"] in (0, -signal.SIGKILL)
        return answer["code"], answer["seconds"]


@pytest.fixture(scope="module")
def builder() -> Iterator[Builder]:
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        command = [sys.executable, str(Path(__file__).with_name("build_and_die.py"))]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        with process:
            yield Builder(process, Path(folder))
            assert process.stdin is not None
            process.stdin.close()


@dataclass
class Undisturbed:
    old: Path
    new: Path
    seconds: float
    steps: list[str]


@pytest.fixture(scope="module")
def undisturbed(builder: Builder) -> Undisturbed:
    old, new = builder.folder / "old.avlmap", builder.folder / "new.avlmap"
    builder.build(old, OLD)
    shutil.copytree(old, new)
    code, seconds = builder.build(new, NEW)
    assert code == 0
    return Undisturbed(old, new, seconds, json.loads((builder.folder / "steps").read_text()))


def check_between(path: Path, known: Undisturbed, *, had_old: bool) -> None:
    """After a kill the folder is the old map, whole, or the new one, whole; or, without an old one, says what it is."""
    try:
        found = read(path)
    except MapError as fault:
        # Killed before its first file there is no folder; the error may then name the map of the round before.
        assert not had_old
        assert any(said in str(fault) for said in ("is a half-built map", "a folder without a map", "is not there"))
        return
    keys = {read(known.new).info.build_key} | ({read(known.old).info.build_key} if had_old else set())
    assert found.info.build_key in keys


def begin(path: Path, known: Undisturbed, *, had_old: bool) -> None:
    if had_old:
        shutil.copytree(known.old, path)


@pytest.mark.nightly  # by day a build that an error ended is resumed in test_cluster
@pytest.mark.parametrize("had_old", [True, False])
def test_a_build_killed_at_random_instants_ends_with_the_same_map(
    builder: Builder, undisturbed: Undisturbed, had_old: bool
) -> None:
    rng, kills, rounds = np.random.default_rng(20), 0, 0
    while kills < 3:
        path = builder.folder / f"random-{had_old}-{rounds}.avlmap"
        begin(path, undisturbed, had_old=had_old)
        while builder.build(path, NEW, delay_s=rng.uniform(0.0, undisturbed.seconds))[0] != 0:
            kills += 1
            check_between(path, undisturbed, had_old=had_old)
        assert content_of(path) == content_of(undisturbed.new)
        rounds += 1


@pytest.mark.nightly
def test_a_build_killed_before_any_step_on_the_disk_ends_with_the_same_map(
    builder: Builder, undisturbed: Undisturbed
) -> None:
    last = len(undisturbed.steps) - 1
    manifest = undisturbed.steps.index("manifest")  # from it on the new map is there, whole
    for step in sorted({0, int(np.random.default_rng(3).integers(last)), manifest, manifest + 1, last}):
        path = builder.folder / f"step-{step}.avlmap"
        begin(path, undisturbed, had_old=True)
        assert builder.build(path, NEW, step=step)[0] == -signal.SIGKILL
        check_between(path, undisturbed, had_old=True)
        assert builder.build(path, NEW)[0] == 0
        assert content_of(path) == content_of(undisturbed.new)
        shutil.rmtree(path)
