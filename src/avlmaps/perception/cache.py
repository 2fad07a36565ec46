"""Encoders that remember: what one of them has made of a frame or a sound it does not make again.

One folder for each model, one ``.safetensors`` file for each frame or sound, its name the hash of all that the model
saw. Files are replaced whole, so that several builds may share the store; one that cannot be read counts as none.
Features of pixels by slow models pass through float16 with the store and without, so that a map is the same, bit by
bit, in both cases.
"""

import re
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from os import utime
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float32, UInt8
from safetensors import SafetensorError
from safetensors.numpy import load, save

from avlmaps.core.errors import BackendError
from avlmaps.core.files import replacing, user_path
from avlmaps.core.progress import say
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.perception import protocols
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import cache_folder, precision_in_force
from avlmaps.perception.networks import key_of, seen_in
from avlmaps.perception.own_encoder import with_members
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame

_GB = 1e9
_AFTER_SWEEPING = 0.9
FEATURES = "features"  # the name of an encoder's only array


@dataclass(frozen=True, slots=True)
class CacheSettings:
    """Whether features are stored, and the limit of the store; what was used longest ago goes first.

    ``auto`` stores those of models on torch in the user's cache folder; a folder stores those of every model there.
    """

    place: Path | Literal["auto", "off"] = "auto"
    limit_gb: float = 20.0

    def __post_init__(self) -> None:
        if not self.limit_gb > 0.0:
            raise BackendError(f"The feature cache's limit is {self.limit_gb} GB; choose more than 0, or no cache.")


DEFAULT_CACHE = CacheSettings()


class FeatureStore:
    """The features on the disk; safe to use from several threads and processes.

    A file that cannot be read or written is not an error: its features are made again, or not stored. ``found`` counts
    by module the features that came from here.
    """

    def __init__(self, folder: Path, limit_bytes: float = 20 * _GB) -> None:
        self.folder, self.limit_bytes = user_path(folder), limit_bytes
        self.found: dict[Kind, int] = {}
        self._opened_s = time.time()
        self._total: float | None = None
        self._full = False
        self._lock = threading.Lock()

    def get(self, kind: Kind, card: protocols.ModelCard, key: str) -> Mapping[str, np.ndarray] | None:
        """Return stored arrays by name, None where there are none that can be read."""
        path = self._path(kind, card, key)
        try:
            arrays = load(path.read_bytes())
        except (OSError, SafetensorError):
            return None
        with suppress(OSError):
            utime(path)  # used now, which is what sweeping goes by
        with self._lock:
            self.found[kind] = self.found.get(kind, 0) + 1
        return arrays

    def put(self, kind: Kind, card: protocols.ModelCard, key: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Store arrays by name, if there is room for them."""
        if self._full:
            return
        content = save({name: np.ascontiguousarray(array) for name, array in arrays.items()})
        path = self._path(kind, card, key)
        try:
            if self._has_room(len(content)):
                path.parent.mkdir(parents=True, exist_ok=True)
                with replacing(path) as part:
                    part.write_bytes(content)
        except OSError as fault:
            self._stop(f"Features are not cached any longer: {self.folder}: {fault.strerror or fault}.")

    def _path(self, kind: Kind, card: protocols.ModelCard, key: str) -> Path:
        named = re.sub(r"[^A-Za-z0-9._-]+", "-", card.id).strip(".-")[:60]
        return self.folder / f"{kind}-{named}-{card.checksum[:16]}" / f"{key}.safetensors"

    def _has_room(self, size: int) -> bool:
        with self._lock:
            if not self._full and (self._total is None or self._total + size > self.limit_bytes):
                self._total = self._sweep(size)
                if self._total + size > self.limit_bytes:
                    self._stop(
                        f"The feature cache is full with what this build needs itself; further frames are not stored "
                        f"({self.limit_bytes / _GB:g} GB in {self.folder}; {option('feature-cache-gb')})."
                    )
            self._total = (self._total or 0.0) + size
            return not self._full

    def _stop(self, sentence: str) -> None:
        if not self._full:
            say(f"note: {sentence}")
        self._full = True

    def _sweep(self, size: int) -> float:
        # What was used longest ago goes first, but nothing that was used since this store was opened: a recording
        # larger than the store would push out its own first frames before their turn comes again.
        entries: list[tuple[float, int, Path]] = []
        for path in self.folder.glob("*/*"):
            with suppress(OSError):  # another process may have removed it
                if not path.parent.is_symlink():
                    entries.append((path.stat().st_mtime, path.stat().st_size, path))
        total = float(sum(own for _, own, _ in entries))
        wanted = _AFTER_SWEEPING * self.limit_bytes - size if total + size > self.limit_bytes else total
        for used_s, own, path in sorted(entries):
            if total <= wanted or used_s >= self._opened_s:
                break
            with suppress(OSError):
                path.unlink(missing_ok=True)
                total -= own
        return total


def with_cache(used: Encoders, settings: CacheSettings) -> Encoders:
    """Return the encoders with a store before them, as the settings say.

    A matcher's matches are not stored, nor the features of an encoder whose card does not distinguish it from others.
    """
    slow = frozenset(kind for kind in used if used.sources[kind].is_slow)
    storable = frozenset(kind for kind in used if kind is not Kind.MATCHER and used.sources[kind].has_card)
    kept = {"off": frozenset[Kind](), "auto": slow}.get(str(settings.place), frozenset(used)) & storable
    folder = cache_folder() / "features" if isinstance(settings.place, str) else settings.place
    store = FeatureStore(folder, _GB * settings.limit_gb)
    sources = dict(used.sources)
    for kind in kept | (slow & {Kind.PIXELS}):  # features of slow pixels are rounded as with the store
        encoder = cached(kind, used.load(kind), store if kind in kept else None, half=kind in slow)
        sources[kind] = replace(used.sources[kind], given=encoder)
    if sources == used.sources:
        return used
    return Encoders(used.name, sources=sources, weight_variance_m2=used.weight_variance_m2)


def cache_note(used: Encoders, kind: Kind) -> str:
    """Return how many features of a module came from the store, for a progress bar; ``""`` where none can."""
    store = getattr(used.sources[kind].given, "store", None) if kind in used else None
    return f"{store.found.get(kind, 0)} from the cache" if isinstance(store, FeatureStore) else ""


_Made = Mapping[str, np.ndarray]


def _each(
    kind: Kind,
    card: protocols.ModelCard,
    store: FeatureStore | None,
    make: Callable[[list[int]], Sequence[_Made]],
    seen: Sequence[Sequence[Any]],
) -> list[_Made]:
    if store is None:
        return list(make(list(range(len(seen)))))
    model = (__version__, kind, card.id, card.checksum, precision_in_force())
    keys = [key_of(*model, *one) for one in seen]
    kept = [store.get(kind, card, key) for key in keys]
    missing = [number for number, one in enumerate(kept) if one is None]
    made = list(make(missing)) if missing else []
    for number in reversed(missing):  # pixels of a frame take 150 MB: none is held twice for long
        kept[number] = fresh = made.pop()
        store.put(kind, card, keys[number], fresh)
    return [one for one in kept if one is not None]


def cached(kind: Kind, encoder: Any, store: FeatureStore | None, *, half: bool = False) -> Any:
    """Return an encoder of a module that makes the features of each frame, picture or sound once.

    They are stored in ``store``, if any; ``half`` rounds those of pixels to float16.
    """
    card = encoder.card

    each = partial(_each, kind, card, store)

    def once(make: Callable[[], Any], *seen: Any) -> Float32[np.ndarray, "..."]:
        return each(lambda _: [{FEATURES: np.asarray(make(), np.float32)}], [seen])[0][FEATURES]

    def pixels(frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
        def make(rows: list[int]) -> list[_Made]:
            found = encode_batch(encoder, [frames[row] for row in rows])
            return [{FEATURES: one.astype(np.float16 if half else np.float32)} for one in found]

        return [
            one[FEATURES].astype(np.float32, copy=False) for one in each(make, [seen_in(frame) for frame in frames])
        ]

    def views(frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        def make(rows: list[int]) -> list[_Made]:
            return [{FEATURES: one} for one in encoder.encode([frames[row] for row in rows])]

        made = each(make, [seen_in(frame) for frame in frames])
        return np.stack([one[FEATURES] for one in made]) if made else np.zeros((0, card.dim), np.float32)

    def sounds(sound: Sound) -> Float32[np.ndarray, "windows d"]:
        return once(lambda: encoder.encode(sound), sound.samples, sound.rate_hz)

    def places(
        rgb: UInt8[np.ndarray, "h w 3"], local: protocols.LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        learnt = [part for name in sorted(state) for part in (name, np.asarray(state[name]))]
        seen = (rgb, local.xy, local.descriptors, local.score, *learnt)
        return once(lambda: encoder.encode(rgb, local, state), *seen)

    def keypoints(rgb: UInt8[np.ndarray, "h w 3"]) -> protocols.LocalFeatures:
        (made,) = each(lambda _: [_arrays_of(encoder.encode(rgb))], [[rgb]])
        width, height = made["size"].tolist()
        return protocols.LocalFeatures(made["xy"], made["descriptors"], made["score"], (width, height))

    protocol = protocols.FrameSoundEncoder if kind is Kind.SOUNDS else protocols.PROTOCOLS[kind]
    names = (*protocols.members_of(protocol), "keyframes_only")
    others: dict[Kind, dict[str, Any]] = {
        Kind.PIXELS: {
            "encode": lambda frame: pixels([frame])[0],
            "encode_batch": pixels,
            "batch": int(getattr(encoder, "batch", 1)),
        },
        Kind.VIEWS: {"encode": views},
        Kind.SOUNDS: {"encode": sounds},
        Kind.LOCAL: {"encode": keypoints},
        Kind.PLACE: {"encode": places},
    }
    return with_members(encoder, names, {**others[kind], "store": store})


def encode_batch(encoder: protocols.PixelEncoder, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
    """Return the features of each frame, made in one go where the encoder can."""
    if len(frames) > 1 and isinstance(encoder, protocols.BatchPixelEncoder):
        return encoder.encode_batch([frame.copy() for frame in frames])
    return [encoder.encode(frame.copy()) for frame in frames]


def _arrays_of(local: protocols.LocalFeatures) -> dict[str, np.ndarray]:
    columns = {name: np.asarray(getattr(local, name), np.float32) for name in ("xy", "descriptors", "score")}
    return {**columns, "size": np.array(local.size)}
