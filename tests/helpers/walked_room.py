"""A short walk in the analytic room with one real-looking sound, as a recording on the disk."""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from helpers.raycast import View, render
from helpers.room import Room

if TYPE_CHECKING:
    import pytest  # an environment of wheels alone, which writes this walk too, has none

CAMERA = Pinhole(160.0, 160.0, 120.0, 90.0, 240, 180)
RATE_HZ = 22050


def beeps(seconds: float = 2.0, pitch_hz: float = 2000.0) -> np.ndarray:
    """Return a beeping tone: half a second on, a quarter off."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    return (0.3 * np.sin(2 * np.pi * pitch_hz * t) * ((t % 0.75) < 0.5)).astype(np.float32)


@cache
def _seen(camera: Pinhole, first: int, end: int, step: int) -> list[tuple[np.ndarray, View]]:
    """Return poses of a walk through the room, each with what is seen from it."""
    room = Room()
    return [(pose, render(room.scene, camera, pose)) for pose in room.walk()[first:end:step]]


def shared_walk(factory: "pytest.TempPathFactory") -> Path:
    """Return a walk that is made once in a run; tests share it and leave it as it is."""
    from helpers.made_once import made_once

    return made_once(factory, "walk", lambda folder: write_walk(folder / "rec")) / "rec"


def walked_map(factory: "pytest.TempPathFactory") -> Path:
    """Return the map of that walk, made once in a run as well: about 3,000 voxels with one sound."""
    from avlmaps.api import build_map
    from avlmaps.maps.settings import BuildSettings
    from helpers.made_once import made_once

    def build(folder: Path) -> None:
        settings = BuildSettings(voxel_size_m=0.1)
        build_map(shared_walk(factory), folder / "room.avlmap", "colours", settings, progress=False)

    return made_once(factory, "walked-room", build) / "room.avlmap"


def write_walk(
    path: Path,
    camera: Pinhole = CAMERA,
    poses: tuple[int, int, int] = (100, 196, 4),
    per_s: float = 4.0,
    beep_s: tuple[int, int, int] | None = (2, 4, 6),
    pitch_hz: float = 2000.0,
) -> Path:
    """Write a recording of 24 frames (6 s) with a sound from 2 to 4 s, or of others."""
    rig = Rig(camera, camera)
    with RecordingWriter(path, rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index, (pose, view) in enumerate(_seen(camera, *poses)):
            writer.add(Frame(index, f"{index:06d}", index / per_s, view.rgb, view.depth_m, pose, rig))
        if beep_s is not None:
            begin, end, whole = (second * RATE_HZ for second in beep_s)
            samples = 0.0005 * np.random.default_rng(0).standard_normal(whole).astype(np.float32)
            samples[begin:end] += beeps((end - begin) / RATE_HZ, pitch_hz)
            writer.set_audio(Sound(samples, RATE_HZ))
    return path
