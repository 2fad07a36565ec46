"""Encoders that remember: what one of them has made of a frame or a sound it does not make again.

Features of pixels by slow models pass through float16 with the store and without, so that a map is the same, bit by
bit, in both cases; all others are stored as they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Float32, UInt8

from avlmaps.core.numbers import unmasked
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.perception.cache.feature_store import CacheSettings, FeatureStore, key_of
from avlmaps.perception.encoders import Encoders, Source
from avlmaps.perception.models.settings import precision_in_force
from avlmaps.perception.protocols import BatchPixelEncoder, FrameSoundEncoder, LocalFeatures, PixelEncoder
from avlmaps.perception.user_folder import cache_folder
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame


@dataclass(frozen=True, slots=True)
class CachedSource(Source):
    """An encoder with a store of features before it.

    Attributes:
        real: where the encoder comes from.
        store: where its features are stored; None stores none.
    """

    real: Source
    store: FeatureStore | None

    def load(self) -> Any:
        """Return the encoder behind the store."""
        encoder, store = self.real.load(), self.store
        if self.kind is Kind.PIXELS:
            return CachedPixels(encoder, store, self.is_slow)
        if self.kind is Kind.SOUNDS and isinstance(encoder, FrameSoundEncoder):
            return CachedFrameSounds(encoder, store)
        return _CACHED[self.kind](encoder, store)

    @property
    def chosen(self) -> str:
        """The name of the real one with its model."""
        return self.real.chosen

    @property
    def on_torch(self) -> bool:
        """Whether the real one is a large model on torch."""
        return self.real.on_torch

    @property
    def is_slow(self) -> bool:
        """Whether the features of the real one take longer to make than to store and read."""
        return self.real.is_slow

    @property
    def keyframes_only(self) -> bool:
        """Whether only keyframes are given to it."""
        return self.real.keyframes_only

    def note(self) -> str:
        """Return how many features came from the store; ``""`` where none can."""
        return "" if self.store is None else f"{self.store.found.get(self.kind, 0)} from the cache"


def with_cache(used: Encoders, settings: CacheSettings) -> Encoders:
    """Return the encoders with a store before them, as the settings say.

    A matcher's matches are not stored, nor the features of an encoder whose card does not distinguish it from others.
    """
    slow = frozenset(kind for kind in used if used.sources[kind].is_slow)
    storable = frozenset(kind for kind in used if kind is not Kind.MATCHER and used.sources[kind].may_be_stored)
    kept = {"off": frozenset[Kind](), "auto": slow}.get(str(settings.place), frozenset(used)) & storable
    if not kept and Kind.PIXELS not in slow:
        return used
    folder = cache_folder() / "features" if isinstance(settings.place, str) else settings.place
    store = FeatureStore(folder, 1e9 * settings.limit_gb) if kept else None
    stored = {kind: CachedSource(kind, used.name_of(kind), used.sources[kind], store) for kind in kept}
    if Kind.PIXELS in slow and Kind.PIXELS not in kept:  # rounded as with the store
        stored[Kind.PIXELS] = CachedSource(Kind.PIXELS, used.name_of(Kind.PIXELS), used.sources[Kind.PIXELS], None)
    return Encoders.of(used.name, {**used.sources, **stored}, used.weight_variance_m2)


def cache_note(used: Encoders, kind: Kind) -> str:
    """Return how many features of a module came from the store, for a progress bar; ``""`` where none can."""
    return used.sources[kind].note() if kind in used else ""


class _Remembering:
    """An encoder in front of another one.

    What is not remembered goes straight to that, written out for each protocol: ``isinstance`` sees no ``__getattr__``.
    """

    kind: Kind

    def __init__(self, encoder: Any, store: FeatureStore | None) -> None:
        self._encoder, self._store = encoder, store
        self.card = encoder.card

    def _key(self, *seen: np.ndarray | str | float | int | None) -> str:
        """Return the key of what is seen, by this model, in this precision, by this release's code."""
        return key_of(__version__, self.kind, self.card.id, self.card.checksum, precision_in_force(), *seen)

    def _get(self, key: str) -> np.ndarray | None:
        return None if self._store is None else self._store.get(self.kind, self.card, key)

    def _put(self, key: str, array: np.ndarray) -> None:
        if self._store is not None:
            self._store.put(self.kind, self.card, key, array)


class CachedPixels(_Remembering):
    """A ``BatchPixelEncoder`` that encodes each frame once; features of slow models are rounded to float16."""

    kind = Kind.PIXELS

    def __init__(self, encoder: PixelEncoder, store: FeatureStore | None, half: bool) -> None:
        """Stand before an encoder.

        Args:
            encoder: the real one.
            store: where its features are stored; None stores none.
            half: round to float16.
        """
        super().__init__(encoder, store)
        self._kept_as = np.float16 if half else np.float32

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Names that compete with a queried word."""
        return self._encoder.vocabulary

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each word, or zero."""
        return self._encoder.encode_words(words)

    def understood(self, word: str) -> str:
        """Return the part of the phrase that the encoder can act on."""
        return self._encoder.understood(word)

    @property
    def batch(self) -> int:
        """How many frames it likes to be given at once."""
        return int(getattr(self._encoder, "batch", 1))

    def encode(self, frame: Frame) -> Float32[np.ndarray, "hf wf d"]:
        """Return the features of a frame."""
        return self.encode_batch([frame])[0]

    def encode_batch(self, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
        """Return the features of each frame; those that are not in the store are encoded together."""
        keys = ["" if self._store is None else self._key(*_seen_in(frame)) for frame in frames]
        kept = [self._known(key) for key in keys]
        missing = [i for i, features in enumerate(kept) if features is None]
        fresh = encode_batch(self._encoder, [frames[i] for i in missing])
        for i in reversed(missing):  # a frame's features can take 150 MB: none is held twice for long
            rounded = fresh.pop().astype(self._kept_as)
            self._put(keys[i], rounded)
            kept[i] = rounded.astype(np.float32, copy=False)
        return [cast(np.ndarray, features) for features in kept]

    def _known(self, key: str) -> Float32[np.ndarray, "hf wf d"] | None:
        found = self._get(key)
        if found is None or found.ndim != 3 or found.shape[2] != self.card.dim:
            return None
        return found.astype(np.float32, copy=False)


class CachedViews(_Remembering):
    """A view encoder that encodes each frame once."""

    kind = Kind.VIEWS

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        keys = [self._key(*_seen_in(frame)) for frame in frames]
        kept = [self._get(key) for key in keys]
        missing = [i for i, features in enumerate(kept) if features is None]
        if missing:
            for i, row in zip(missing, unmasked(self._encoder.encode([frames[i] for i in missing])), strict=True):
                kept[i] = row
                self._put(keys[i], row)
        rows = [cast(np.ndarray, row) for row in kept]
        return np.stack(rows) if rows else np.zeros((0, self.card.dim), np.float32)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase."""
        return self._encoder.encode_words(words)


class CachedSounds(_Remembering):
    """A sound encoder that encodes each sound once."""

    kind = Kind.SOUNDS

    def encode(self, sound: Sound) -> Float32[np.ndarray, "windows d"]:
        """Return a unit vector for each window of a sound."""
        key = self._key(sound.samples, sound.rate_hz)
        kept = self._get(key)
        if kept is None:
            kept = np.asarray(unmasked(self._encoder.encode(sound)), np.float32)
            self._put(key, kept)
        return kept

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """The kinds of sound that it knows."""
        return self._encoder.vocabulary

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase."""
        return self._encoder.encode_words(words)

    def score_words(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], words: Sequence[str]
    ) -> Float32[np.ndarray, "sounds words"]:
        """Return how likely each sound is what each phrase names."""
        return self._encoder.score_words(sounds, words)

    def score_sounds(
        self, sounds: Sequence[Float32[np.ndarray, "windows d"]], asked: Float32[np.ndarray, "windows d"]
    ) -> Float32[np.ndarray, " sounds"]:
        """Return how likely each sound is of the same kind as the queried one."""
        return self._encoder.score_sounds(sounds, asked)


class CachedFrameSounds(CachedSounds):
    """The same for an encoder that gives a vector for each step of time."""

    @property
    def hop_s(self) -> float:
        """Seconds of a step."""
        return self._encoder.hop_s


class CachedPlaces(_Remembering):
    """A place encoder that encodes each picture once (with the same keypoints, after the same learning)."""

    kind = Kind.PLACE

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Learn what the encoder needs from the map's own keyframes."""
        return self._encoder.fit(local, rng)

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return a unit vector (zero where the picture has no keypoints)."""
        learnt = [part for name in sorted(state) for part in (name, np.asarray(state[name]))]
        points = (local.xy, local.descriptors, local.scale, local.score)
        key = self._key(rgb, *points, *learnt)
        kept = self._get(key)
        if kept is None:
            kept = np.asarray(unmasked(self._encoder.encode(rgb, local, state)), np.float32)
            self._put(key, kept)
        return kept


class CachedKeypoints(_Remembering):
    """A keypoint encoder that encodes each picture once; stored in float32, because keypoints are sub-pixel."""

    kind = Kind.LOCAL

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return the picture's keypoints."""
        key = self._key(rgb)
        kept = self._get(key)
        if kept is not None and kept.dtype.names:
            return _keypoints(kept, (rgb.shape[1], rgb.shape[0]))
        local = self._encoder.encode(rgb)
        if local.size in ((0, 0), (rgb.shape[1], rgb.shape[0])):
            self._put(key, _as_rows(local))
        return local


_CACHED = {Kind.VIEWS: CachedViews, Kind.SOUNDS: CachedSounds, Kind.LOCAL: CachedKeypoints, Kind.PLACE: CachedPlaces}


def encode_batch(encoder: PixelEncoder, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
    """Return the features of each frame, made in one go where the encoder can."""
    if len(frames) > 1 and isinstance(encoder, BatchPixelEncoder):
        made = encoder.encode_batch([frame.copy() for frame in frames])
    else:
        made = [encoder.encode(frame.copy()) for frame in frames]
    return [unmasked(features) for features in made]


def _seen_in(frame: Frame) -> list[np.ndarray | str | float | None]:
    """Return all of a frame that an encoder may look at: everything but its number, name and time."""
    rig, ground = frame.rig, frame.ground
    stands = (None,) if ground is None else (ground.up_in_world, ground.camera_m, ground.floor_m)
    cameras = f"{rig.rgb} {rig.depth}"
    return [frame.rgb, frame.depth_m, frame.world_from_camera, cameras, np.asarray(rig.rgb_from_depth), *stands]


def _as_rows(local: LocalFeatures) -> np.ndarray:
    """Pack keypoints into rows; what is not known has no column."""
    columns = [("xy", local.xy), ("descriptors", local.descriptors)]
    columns += [(name, getattr(local, name)) for name in ("scale", "score") if len(getattr(local, name))]
    layout = [(name, "<f4", column.shape[1:]) for name, column in columns]
    rows = np.zeros(len(local.xy), np.dtype([*layout, *([("sized", "u1")] if local.size != (0, 0) else [])]))
    for name, column in columns:
        rows[name] = column
    return rows


def _keypoints(rows: np.ndarray, size: tuple[int, int]) -> LocalFeatures:
    names = [name for name in rows.dtype.names or () if name != "sized"]
    columns = {name: np.ascontiguousarray(rows[name]) for name in names}
    return LocalFeatures(**columns, size=size if "sized" in (rows.dtype.names or ()) else (0, 0))
