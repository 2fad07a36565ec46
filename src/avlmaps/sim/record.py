"""Recording the room: a robot walks, its camera and its microphone run, and truth is written beside."""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float64

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.progress import progress
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from avlmaps.sim.raycast import render
from avlmaps.sim.room import Room

CAMERA = Pinhole(fx=260.0, fy=260.0, cx=160.0, cy=120.0, width=320, height=240)
FRAME_RATE_HZ = 10.0
# A quiet room is not silent: without this the pauses would be digital zeros, which no microphone gives.
ROOM_NOISE_RMS = 0.0006


@dataclass(frozen=True, slots=True)
class Source:
    """A thing that makes a sound once, when the robot comes by.

    Attributes:
        category: what it sounds like.
        sound: the sound itself.
        position: where it stands, metres, world.
    """

    category: str
    sound: Sound
    position: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Heard:
    """One event in the track (truth; mapping never reads it).

    Attributes:
        category: what was heard.
        onset_s: start.
        offset_s: end.
        track: where the robot was from onset to offset, one place a frame, at least one.
    """

    category: str
    onset_s: float
    offset_s: float
    track: tuple[tuple[float, float, float], ...]

    @property
    def robot(self) -> tuple[float, float, float]:
        """Where the robot was at the onset."""
        return self.track[0]


def record_room(
    room: Room, out: Path, sources: Sequence[Source], rng: np.random.Generator, rate_hz: int = 22050
) -> list[Heard]:
    """Walk through the room and write a recording in our folder format, with events.csv and objects.json beside it.

    Sounds are overlaid as the paper did it: each is heard, at full length, from the moment the robot is nearest to
    its source, louder the nearer it is; two never overlap.

    Args:
        room: the room and its walk.
        out: the folder to make.
        sources: what makes sounds.
        rng: draws the room's noise.
        rate_hz: of the track.
    """
    walk = room.walk(rate_hz=FRAME_RATE_HZ)
    track, heard = mix(walk[:, :3, 3], sources, rng, rate_hz)
    rig = Rig(CAMERA, CAMERA)
    with RecordingWriter(out, rig, up_in_world=np.array([0.0, 0.0, 1.0]), origin="avlmaps analytic room") as writer:
        for index, pose in progress(list(enumerate(walk)), "recording"):
            view = render(room.scene, CAMERA, pose)
            writer.add(Frame(index, f"{index:06d}", index / FRAME_RATE_HZ, view.rgb, view.depth_m, pose, rig))
        writer.set_audio(track)
    _write_truth(out, room, heard)
    return heard


def mix(
    robot: Float64[np.ndarray, "n 3"], sources: Sequence[Source], rng: np.random.Generator, rate_hz: int
) -> tuple[Sound, list[Heard]]:
    """Overlay each source on the track from where the robot comes nearest to it."""
    samples = ROOM_NOISE_RMS * rng.standard_normal(round(len(robot) / FRAME_RATE_HZ * rate_hz))
    heard: list[Heard] = []
    free_s = 0.0
    nearest = [np.linalg.norm(robot - source.position, axis=1) for source in sources]
    for source, distance_m in sorted(zip(sources, nearest, strict=True), key=lambda pair: int(pair[1].argmin())):
        frame = int(distance_m.argmin())
        onset_s = max(frame / FRAME_RATE_HZ - source.sound.duration_s / 2, free_s + 0.8)
        start = round(onset_s * rate_hz)
        piece = _at_rate(source.sound, rate_hz)[: max(0, len(samples) - start)]
        if len(piece) < rate_hz // 10:
            continue
        gain = 0.25 / max(float(distance_m[frame]), 1.0) / max(float(np.abs(piece).max()), 1e-6)
        samples[start : start + len(piece)] += gain * piece
        free_s = (start + len(piece)) / rate_hz
        first = min(round(onset_s * FRAME_RATE_HZ), len(robot) - 1)
        along = robot[first : max(round(free_s * FRAME_RATE_HZ), first + 1)]
        track = tuple((float(x), float(y), float(z)) for x, y, z in along)
        heard.append(Heard(source.category, start / rate_hz, free_s, track))
    return Sound(np.clip(samples, -1.0, 1.0).astype(np.float32), rate_hz), heard


def _at_rate(sound: Sound, rate_hz: int) -> Float[np.ndarray, " n"]:
    from avlmaps.recordings.resample import resampled

    return resampled(sound, rate_hz).samples


def _write_truth(out: Path, room: Room, heard: Sequence[Heard]) -> None:
    with (out / "events.csv").open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(("onset_s", "offset_s", "category", "x", "y", "z"))
        table.writerows(
            (f"{h.onset_s:.4f}", f"{h.offset_s:.4f}", h.category, *(f"{c:.4f}" for c in h.robot)) for h in heard
        )
    objects = [
        {"instance": i, "category": t.category, "colour": t.colour, "centre": t.centre, "size": t.size}
        for i, t in enumerate(room.things)
    ]
    (out / "objects.json").write_text(json.dumps(objects, indent=1) + "\n", encoding="utf-8")
