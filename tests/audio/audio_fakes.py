"""What the audio tests share: sounds of known shape, a walk without pictures, an encoder without a network."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio import events
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.types import HeardSounds
from avlmaps.perception.protocols import ModelCard, SoundEncoder
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.types import Frame, Recording

RATE_HZ = 16_000


def tone(seconds: float, hz: float = 1000.0, level: float = 0.3, rate_hz: int = RATE_HZ) -> np.ndarray:
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    return (level * np.sin(2.0 * np.pi * hz * time_s)).astype(np.float32)


def quiet(seconds: float, rate_hz: int = RATE_HZ) -> np.ndarray:
    return np.zeros(round(seconds * rate_hz), np.float32)


def track_of(path: Path, *pieces: np.ndarray, rate_hz: int = RATE_HZ, start_s: float = 0.0) -> AudioTrack:
    """Write pieces one after the other into a file, and open it."""
    write_flac(path, Sound(np.concatenate(pieces), rate_hz))
    return AudioTrack.open(path, start_s)


class FakeWalk(Recording):
    """A walk along given places, one a stamp; its frames are tiny and grey."""

    def __init__(self, stamps_s: np.ndarray, position: np.ndarray, audio: AudioTrack | None = None) -> None:
        camera = Pinhole(8.0, 8.0, 4.0, 3.0, 8, 6)
        self.path, self.format, self.rig = Path("walk"), "fake", Rig(camera, camera)
        self.stamps_s = np.asarray(stamps_s, np.float64)
        self.world_from_camera = np.tile(np.eye(4), (len(stamps_s), 1, 1))
        self.world_from_camera[:, :3, 3] = position
        self.up_in_world, self.audio, self.notices = None, audio, ()

    def frame(self, index: int) -> Frame:
        picture, depth = np.full((6, 8, 3), 128, np.uint8), np.ones((6, 8), np.float32)
        pose = self.world_from_camera[index]
        return Frame(index, f"{index:06d}", float(self.stamps_s[index]), picture, depth, pose, self.rig)

    @cached_property
    def fingerprint(self) -> str:
        return "0" * 64


def straight_walk(seconds: float, speed_m_s: float, audio: AudioTrack | None = None, rate_hz: float = 2.0) -> FakeWalk:
    stamps_s = np.arange(0.0, seconds + 1e-9, 1.0 / rate_hz)
    position = np.stack([speed_m_s * stamps_s, np.zeros_like(stamps_s), np.zeros_like(stamps_s)], axis=1)
    return FakeWalk(stamps_s, position, audio)


def detect_events(walk: FakeWalk, encoder: SoundEncoder, settings: HearingSettings, clips: Path) -> HeardSounds:
    """Return the sounds of a walk's track."""
    if walk.audio is None:
        return events.collect([], encoder.card.dim)
    walked = Trajectory(walk.stamps_s, walk.world_from_camera)
    return events.detect_events(walk.audio, walked, encoder, settings, clips)


class FakeEncoder:
    """Gives every second of a sound a unit vector that tells how loud it was."""

    card = ModelCard(id="test/loudness", dim=4, licence="MIT", checksum="0")
    vocabulary: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.heard: list[Sound] = []

    def encode(self, sound: Sound) -> np.ndarray:
        self.heard.append(sound)
        windows = max(1, round(sound.duration_s))
        feature = np.tile([1.0, float(np.abs(sound.samples).mean()), 0.0, 0.0], (windows, 1)).astype(np.float32)
        return feature / np.linalg.norm(feature, axis=1, keepdims=True)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        return np.eye(4, dtype=np.float32)[np.zeros(len(words), int)]

    def score_words(self, sounds: Sequence[np.ndarray], words: Sequence[str]) -> np.ndarray:
        return np.ones((len(sounds), len(words)), np.float32)

    def score_sounds(self, sounds: Sequence[np.ndarray], asked: np.ndarray) -> np.ndarray:
        return np.ones(len(sounds), np.float32)
