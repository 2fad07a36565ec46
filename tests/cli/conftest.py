"""A short walk in the analytic room with one real-looking sound, and its map: made once, used by every verb's test."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avlmaps.cli import main
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from helpers.plain_numbers import assert_plain
from helpers.raycast import render
from helpers.room import Room

CAMERA = Pinhole(160.0, 160.0, 120.0, 90.0, 240, 180)
RATE_HZ = 22050


def beeps(seconds: float = 2.0, pitch_hz: float = 2000.0) -> np.ndarray:
    """Return a beeping tone: half a second on, a quarter off."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    return (0.3 * np.sin(2 * np.pi * pitch_hz * t) * ((t % 0.75) < 0.5)).astype(np.float32)


@pytest.fixture(scope="session")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 24 frames (6 s) with a sound from 2 to 4 s."""
    path, room, rig = tmp_path_factory.mktemp("walk") / "rec", Room(), Rig(CAMERA, CAMERA)
    poses = room.walk()[100:196:4]
    samples = 0.0005 * np.random.default_rng(0).standard_normal(6 * RATE_HZ).astype(np.float32)
    samples[2 * RATE_HZ : 4 * RATE_HZ] += beeps()
    with RecordingWriter(path, rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index, pose in enumerate(poses):
            view = render(room.scene, CAMERA, pose)
            writer.add(Frame(index, f"{index:06d}", index / 4.0, view.rgb, view.depth_m, pose, rig))
        writer.set_audio(Sound(samples, RATE_HZ))
    return path


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
