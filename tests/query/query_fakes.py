"""A made-up map that can be asked, and encoders whose answers are known."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.registry import Kind
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import HeardSounds, Keyframes, Voxels
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import ModelCard
from avlmaps.query.avlmap import AVLMap

UP = np.array([0.0, 0.0, 1.0])


class FakePixels:
    """Knows some words; each is an axis of the feature space."""

    def __init__(self, words: Sequence[str], other: bool = True) -> None:
        self.words = tuple(words)
        self.other = other
        self.card = ModelCard("fake/pixels", len(words) + 1, "MIT", "0", note="it is made up")

    @property
    def vocabulary(self) -> tuple[str, ...]:
        return self.words

    def encode(self, frame: Any) -> np.ndarray:
        return np.zeros((1, 1, self.card.dim), np.float32)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        rows = np.zeros((len(words), len(self.words) + 1), np.float32)
        for row, word in zip(rows, words, strict=True):
            if self.understood(word):
                row[self.words.index(self.understood(word))] = 1.0
            elif word == "other" and self.other:
                row[-1] = 1.0
        return rows

    def understood(self, word: str) -> str:
        return next((known for known in self.words if known in word.split()), "")


class FakeSounds:
    """Scores a sound of kind k by the first number of its feature for any word, and knows what is silent."""

    card = ModelCard("fake/sounds", 4, "MIT", "0")
    vocabulary = ("dog",)

    def encode(self, sound: Any) -> np.ndarray:
        return np.ones((1, 4), np.float32)

    def score_words(self, sounds: Sequence[np.ndarray], words: Sequence[str]) -> np.ndarray:
        known = np.array([[word in self.vocabulary for word in words]], np.float32)
        return np.array([[sound[0, 0]] for sound in sounds], np.float32).reshape(-1, 1) * known

    def score_sounds(self, sounds: Sequence[np.ndarray], asked: np.ndarray) -> np.ndarray:
        return np.array([sound[0, 0] for sound in sounds], np.float32)


class FakeViews:
    """Any name is an axis: kitchen the first, everything else the second."""

    card = ModelCard("fake/views", 2, "MIT", "0")

    def encode(self, frames: Sequence[Any]) -> np.ndarray:
        return np.zeros((len(frames), 2), np.float32)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        return np.array([[1.0, 0.0] if word == "kitchen" else [0.0, 1.0] for word in words], np.float32)


def fake_encoders(pixels: Any = None, sounds: Any = None, views: Any = None) -> Any:
    return Encoders("fake", pixels=pixels, sounds=sounds, views=views)


def voxels_of(index: np.ndarray, feature: np.ndarray) -> Voxels:
    """Sort voxels, and give them a feature each."""
    order = np.lexsort((index[:, 2], index[:, 1], index[:, 0]))
    n = len(index)
    rgb = np.tile(np.array([[120, 90, 60]], np.uint8), (n, 1))
    return Voxels(
        index[order].astype(np.int32), feature[order].astype(np.float16), np.ones(n, np.float32), rgb,
        np.zeros(n), np.ones(n, np.int64),
    )  # fmt: skip


def sounds_of(tracks: Sequence[np.ndarray], scores: Sequence[float]) -> HeardSounds:
    """Hear a sound along each track; its feature begins with its score."""
    n = len(tracks)
    feature = np.zeros((n, 4), np.float32)
    feature[:, 0] = scores
    offsets = np.concatenate([[0], np.cumsum([len(track) for track in tracks])]).astype(np.int64)
    track = np.concatenate(tracks).astype(np.float32) if n else np.zeros((0, 3), np.float32)
    onset = np.arange(n, dtype=np.float64)
    clips = tuple(f"{k}.flac" for k in range(n))
    return HeardSounds(onset, onset + 0.5, offsets, track, np.arange(n + 1, dtype=np.int64), feature, clips)


def keyframes_at(places: np.ndarray, view: np.ndarray | None = None) -> Keyframes:
    """Put keyframes at places."""
    k = len(places)
    poses = np.tile(np.eye(4), (k, 1, 1))
    poses[:, :3, 3] = places
    none = np.zeros((0, 2), np.float32)
    return Keyframes(
        np.arange(k, dtype=np.float64), poses, (places + np.array([1.0, 0.0, 0.0])).astype(np.float32),
        np.zeros((k, 0), np.float32) if view is None else view, np.zeros((k, 0), np.float32),
        np.zeros(k + 1, np.int64), none, none.astype(np.float16), np.zeros((0, 3), np.float32),
        np.zeros(k + 1, np.int64), np.zeros(0, np.uint8),
    )  # fmt: skip


def fake_map(
    voxels: Voxels, sounds: HeardSounds | None = None, keyframes: Keyframes | None = None, encoders: Any = None
) -> Any:
    """Return what a query needs of a stored map."""
    camera = Pinhole(100.0, 100.0, 32.0, 24.0, 64, 48)
    data: Any = SimpleNamespace(
        grid=GridSpec(0.05),
        up_in_world=UP,
        voxels=voxels,
        sounds=sounds or sounds_of([], []),
        keyframes=keyframes if keyframes is not None else keyframes_at(np.zeros((0, 3))),
        place_state={},
        info=SimpleNamespace(
            ground=None,
            doubts=(),
            files={},
            models={"pixels": None},
            visits=(),
            recording=SimpleNamespace(name="walk", fingerprint="f"),
        ),
        rig=Rig(camera, camera),
        sources=None,
        sources_wait=0,
        findings={},
    )
    return FakeMap(data, encoders or fake_encoders(), path=Path("fake.avlmap"))


class FakeMap(AVLMap):
    """A map whose encoders are never refused."""

    def require_model(self, kind: Kind) -> None:
        del kind


def asked(fake: AVLMap, **chosen: Any) -> AVLMap:
    """Return a map that is queried otherwise."""
    return type(fake)(fake.data, fake.encoders, path=fake.path, **chosen)


def box(low: Sequence[int], high: Sequence[int]) -> np.ndarray:
    """Return all voxels from ``low`` to ``high``, the latter left out."""
    axes = [np.arange(a, b) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def furnished_map(**parts: Any) -> Any:
    """Return a floor of 6 by 4 metres with two chairs (4 x 4 x 8 and 4 x 4 x 6 voxels) and a table on it."""
    pieces = {
        "floor": [box((0, 0, 0), (120, 80, 1))],
        "chair": [box((10, 10, 1), (14, 14, 9)), box((100, 60, 1), (104, 64, 7))],
        "table": [box((20, 10, 1), (36, 26, 4))],
    }
    encoder = FakePixels(tuple(pieces))
    index = np.concatenate([piece for name in pieces for piece in pieces[name]])
    words = np.concatenate([[name] * len(piece) for name in pieces for piece in pieces[name]])
    encoders = fake_encoders(encoder, FakeSounds(), parts.pop("views", None))
    return fake_map(voxels_of(index, encoder.encode_words(list(words))), encoders=encoders, **parts)
