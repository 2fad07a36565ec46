"""A small walk past a coloured wall, and models that cost nothing, for tests of the store and the build."""

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.settings import BuildSettings, FrameSettings, KeyframeSettings
from avlmaps.perception.encoders import Encoders, register_profile
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.types import Frame, Recording

RIG = Rig(Pinhole(20.0, 20.0, 16.0, 12.0, 32, 24), Pinhole(20.0, 20.0, 16.0, 12.0, 32, 24))
SETTINGS = BuildSettings(
    frames=FrameSettings(per_part=4, max_bad_share=0.2), keyframes=KeyframeSettings(translation_m=0.35)
)


class Walk(Recording):
    """Sideways past a wall whose colours are random squares; the same seed gives the same walk."""

    def __init__(
        self,
        frames: int = 22,
        *,
        seed: int = 0,
        bad: tuple[int, ...] = (),
        name: str = "walk",
        audio: Path | None = None,
        slow_s: float = 0.0,
    ) -> None:
        self.path = Path("/nowhere/of/mine") / name
        self.format = "fake"
        self.rig = RIG
        self.stamps_s = np.arange(frames) * 0.1
        self.world_from_camera = np.tile(np.eye(4), (frames, 1, 1))
        self.world_from_camera[:, :3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # looks along +y, up is +z
        self.world_from_camera[:, 0, 3] = 0.1 * np.arange(frames)
        self.up_in_world = np.array([0.0, 0.0, 1.0])
        self.audio = AudioTrack.open(audio) if audio else None
        self.notices = (f"{self.path} is made up.",)
        self.seed, self.bad, self.slow_s = seed, bad, slow_s

    def frame(self, index: int) -> Frame:
        if index in self.bad:
            raise RecordingError(f"{self.path}/{index:06d}.png is truncated; leave that frame out.")
        time.sleep(self.slow_s)
        rng = np.random.default_rng([self.seed, index])
        rgb = np.kron(rng.integers(0, 256, (6, 8, 3)), np.ones((4, 4, 1))).astype(np.uint8)
        depth = (2.0 + rng.uniform(0.0, 0.5, (24, 32))).astype(np.float32)
        depth[rng.uniform(size=depth.shape) < 0.1] = 0.0
        return Frame(
            index, self.name(index), float(self.stamps_s[index]), rgb, depth, self.world_from_camera[index], RIG
        )

    @cached_property
    def fingerprint(self) -> str:
        return hashlib.sha256(f"{self.path.name} {len(self)} {self.seed}".encode()).hexdigest()


def open_walk(audio: Path | None = None, *, seed: int = 0, bad: tuple[int, ...] = (5,), slow_s: float = 0.0) -> Walk:
    """Open the walk as each worker of a cluster does; its models are known from then on."""
    register_fakes()
    return Walk(seed=seed, bad=bad, audio=audio, slow_s=slow_s)


def content_of(path: Path) -> dict[str, bytes]:
    """Return every file of a map, and map.json without its timings."""
    files = {
        str(file.relative_to(path)).replace(".2.", "."): file.read_bytes()
        for file in path.rglob("*")
        if file.is_file() and file.name != ".lock"
    }
    manifest = json.loads(files.pop("map.json").replace(b".2.safetensors", b".safetensors"))
    manifest.pop("timings")
    return {**files, "map.json": json.dumps(manifest, sort_keys=True).encode()}


def write_beeps(path: Path, onsets_s: tuple[float, ...] = (0.3, 2.0)) -> Path:
    """Write a track of four seconds with a beep of 0.4 s at each onset, in faint noise."""
    rate_hz = 16_000
    samples = np.random.default_rng(0).normal(scale=1e-4, size=4 * rate_hz).astype(np.float32)
    tone = (0.3 * np.sin(2 * np.pi * 800.0 * np.arange(int(0.4 * rate_hz)) / rate_hz)).astype(np.float32)
    for onset_s in onsets_s:
        start = int(onset_s * rate_hz)
        samples[start : start + len(tone)] += tone
    write_flac(path, Sound(samples, rate_hz))
    return path


def _card(name: str, dim: int) -> ModelCard:
    return ModelCard(f"fake/{name}", dim, "CC0-1.0", hashlib.sha256(name.encode()).hexdigest(), ("a {}",), "a fake")


@dataclass
class Pixels:
    card = _card("pixels", 4)
    vocabulary = ("red", "green")

    def encode(self, frame: Frame) -> np.ndarray:
        colours = frame.rgb[::4, ::4] / 255.0
        cells = np.concatenate([colours, np.full((*colours.shape[:2], 1), 0.1)], axis=2)
        return (cells / np.linalg.norm(cells, axis=2, keepdims=True)).astype(np.float32)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        return np.array([[word == "red", word == "green", 0.0, 0.0] for word in words], np.float32)


@dataclass
class Corners:
    card = _card("corners", 3)

    def encode(self, rgb: np.ndarray) -> LocalFeatures:
        xy = np.array([[2.0, 2.0], [10.0, 6.0], [30.0, 20.0]], np.float32) % np.array(rgb.shape[1::-1], np.float32)
        descriptors = rgb[tuple(xy.astype(int).T[::-1])] + np.float32(1.0)
        return LocalFeatures(xy, (descriptors / np.linalg.norm(descriptors, axis=1, keepdims=True)).astype(np.float32))


@dataclass
class Places:
    card = _card("places", 3)

    def fit(self, local: list[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        return {"centres": rng.normal(size=(2, 3)).astype(np.float32)}

    def encode(self, rgb: np.ndarray, local: LocalFeatures, state: dict[str, np.ndarray]) -> np.ndarray:
        whole = local.descriptors.sum(axis=0) + state["centres"][0]
        return (whole / np.linalg.norm(whole)).astype(np.float32)


@dataclass
class Ears:
    card = _card("ears", 2)
    vocabulary = ()

    def encode(self, sound: Sound) -> np.ndarray:
        angle = 0.9 + 0.1 * np.sin(1e3 * np.mean(sound.samples**2))  # features that are all the same are a doubt
        return np.array([[np.cos(angle), np.sin(angle)]], np.float32)

    def score_words(self, sounds: Sequence[np.ndarray], words: Sequence[str]) -> np.ndarray:
        return np.zeros((len(sounds), len(words)), np.float32)


class Words(Pixels):
    """The fake pixels, which know a word."""

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        return np.tile(np.float32([0.5, 0.5, 0.5, 0.5]), (len(words), 1))


class Hears(Ears):
    """The fake ears, which can be asked."""

    def score_words(self, sounds: list[np.ndarray], words: list[str]) -> np.ndarray:
        return np.ones((len(sounds), len(words)), np.float32)

    def score_sounds(self, sounds: list[np.ndarray], asked: np.ndarray) -> np.ndarray:
        return np.ones(len(sounds), np.float32)


def register_fakes() -> str:
    """Make the profile ``fake`` known; return its name."""
    for kind, maker in ((Kind.PIXELS, Pixels), (Kind.LOCAL, Corners), (Kind.PLACE, Places), (Kind.SOUNDS, Ears)):
        register(Backend(kind, "fake", f"{__name__}:{maker.__name__}"))
    register_profile(Encoders("fake", pixels="fake", local="fake", place="fake", sounds="fake"))
    return "fake"
