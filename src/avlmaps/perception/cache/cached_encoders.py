"""Encoders that remember: what one of them has made of a frame or a sound it does not make again.

Features of pixels by slow models pass through float16 with the store and without, so that a map is the same, bit by
bit, in both cases; all others are stored as they are.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
from jaxtyping import Float32, UInt8

from avlmaps.core.numbers import unmasked
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.perception.cache.feature_store import CacheSettings, FeatureStore, key_of
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models.settings import precision_in_force
from avlmaps.perception.own_encoder import with_members
from avlmaps.perception.protocols import (
    PROTOCOLS,
    BatchPixelEncoder,
    FrameSoundEncoder,
    LocalFeatures,
    ModelCard,
    PixelEncoder,
    members_of,
)
from avlmaps.perception.user_folder import cache_folder
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame


def with_cache(used: Encoders, settings: CacheSettings) -> Encoders:
    """Return the encoders with a store before them, as the settings say.

    A matcher's matches are not stored, nor the features of an encoder whose card does not distinguish it from others.
    """
    slow = frozenset(kind for kind in used if used.sources[kind].is_slow)
    storable = frozenset(kind for kind in used if kind is not Kind.MATCHER and used.sources[kind].has_card)
    kept = {"off": frozenset[Kind](), "auto": slow}.get(str(settings.place), frozenset(used)) & storable
    if not kept and Kind.PIXELS not in slow:
        return used
    folder = cache_folder() / "features" if isinstance(settings.place, str) else settings.place
    store = FeatureStore(folder, 1e9 * settings.limit_gb) if kept else None
    stored = {kind: replace(used.sources[kind], remembering=cached, store=store) for kind in kept}
    if Kind.PIXELS in slow and Kind.PIXELS not in kept:  # rounded as with the store
        stored[Kind.PIXELS] = replace(used.sources[Kind.PIXELS], remembering=cached)
    return Encoders.of(used.name, {**used.sources, **stored}, used.weight_variance_m2)


def cache_note(used: Encoders, kind: Kind) -> str:
    """Return how many features of a module came from the store, for a progress bar; ``""`` where none can."""
    store = used.sources[kind].store if kind in used else None
    return "" if store is None else f"{store.found.get(kind, 0)} from the cache"


class _Memory:
    """What one model made before; without a store it forgets all."""

    def __init__(self, kind: Kind, card: ModelCard, store: FeatureStore | None) -> None:
        self.kind, self.card, self.store = kind, card, store

    def key(self, *seen: np.ndarray | str | float | int | None) -> str:
        """Return the key of what is seen, by this model, in this precision, by this release's code."""
        if self.store is None:
            return ""
        return key_of(__version__, self.kind, self.card.id, self.card.checksum, precision_in_force(), *seen)

    def get(self, key: str) -> np.ndarray | None:
        return None if self.store is None else self.store.get(self.kind, self.card, key)

    def put(self, key: str, array: np.ndarray) -> None:
        if self.store is not None:
            self.store.put(self.kind, self.card, key, array)

    def once(self, make: Callable[[], np.ndarray], *seen: Any) -> Float32[np.ndarray, "..."]:
        """Return what is made of what is seen, made once."""
        key = self.key(*seen)
        kept = self.get(key)
        if kept is None:
            kept = np.asarray(unmasked(make()), np.float32)
            self.put(key, kept)
        return kept


def cached(kind: Kind, encoder: Any, store: FeatureStore | None, *, half: bool = False) -> Any:
    """Return an encoder that makes the features of each frame, picture or sound once.

    Args:
        kind: the module.
        encoder: the real one.
        store: where its features are stored; None stores none.
        half: features of pixels are rounded to float16.
    """
    memory = _Memory(kind, encoder.card, store)
    names = members_of(FrameSoundEncoder if kind is Kind.SOUNDS else PROTOCOLS[kind])
    if kind is Kind.PIXELS:
        batch = partial(_pixels, encoder, memory, np.float16 if half else np.float32)
        one_by_one = {"encode": lambda frame: batch([frame])[0], "encode_batch": batch}
        return with_members(encoder, names, {**one_by_one, "batch": int(getattr(encoder, "batch", 1))})
    return with_members(encoder, names, {"encode": partial(_ENCODE[kind], encoder, memory)})


def _pixels(
    encoder: PixelEncoder, memory: _Memory, kept_as: type, frames: Sequence[Frame]
) -> list[Float32[np.ndarray, "hf wf d"]]:
    """Return the features of each frame; those that are not in the store are encoded together."""
    keys = [memory.key(*_seen_in(frame)) for frame in frames]
    kept = [memory.get(key) for key in keys]
    fits = [one is not None and one.ndim == 3 and one.shape[2] == memory.card.dim for one in kept]
    fresh = encode_batch(encoder, [frame for frame, here in zip(frames, fits, strict=True) if not here])
    for i in reversed(np.flatnonzero(np.logical_not(fits))):  # 150 MB a frame: none is held twice for long
        kept[i] = fresh.pop().astype(kept_as)
        memory.put(keys[i], kept[i])
    return [cast(np.ndarray, features).astype(np.float32, copy=False) for features in kept]


def _views(encoder: Any, memory: _Memory, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
    keys = [memory.key(*_seen_in(frame)) for frame in frames]
    kept = [memory.get(key) for key in keys]
    missing = [i for i, features in enumerate(kept) if features is None]
    if missing:
        for i, row in zip(missing, unmasked(encoder.encode([frames[i] for i in missing])), strict=True):
            kept[i] = row
            memory.put(keys[i], row)
    rows = [cast(np.ndarray, row) for row in kept]
    return np.stack(rows) if rows else np.zeros((0, memory.card.dim), np.float32)


def _sounds(encoder: Any, memory: _Memory, sound: Sound) -> Float32[np.ndarray, "windows d"]:
    return memory.once(lambda: encoder.encode(sound), sound.samples, sound.rate_hz)


def _places(
    encoder: Any, memory: _Memory, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
) -> Float32[np.ndarray, " d"]:
    learnt = [part for name in sorted(state) for part in (name, np.asarray(state[name]))]
    points = (local.xy, local.descriptors, local.scale, local.score)
    return memory.once(lambda: encoder.encode(rgb, local, state), rgb, *points, *learnt)


def _keypoints_of(encoder: Any, memory: _Memory, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
    """Return a picture's keypoints; stored in float32, because they are sub-pixel."""
    key = memory.key(rgb)
    kept = memory.get(key)
    if kept is not None and kept.dtype.names:
        return _keypoints(kept, (rgb.shape[1], rgb.shape[0]))
    local = encoder.encode(rgb)
    if local.size in ((0, 0), (rgb.shape[1], rgb.shape[0])):
        memory.put(key, _as_rows(local))
    return local


_ENCODE: dict[Kind, Callable[..., Any]] = {
    Kind.VIEWS: _views,
    Kind.SOUNDS: _sounds,
    Kind.LOCAL: _keypoints_of,
    Kind.PLACE: _places,
}


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
