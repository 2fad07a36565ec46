"""Encoders that remember: what one of them has made of a frame or a sound it does not make again.

One folder for each model, one ``.safetensors`` file for each frame or sound, its name the hash of all that the model
saw. Files are replaced whole, so that several builds may share the store; one that cannot be read counts as none.
Features of pixels by slow models pass through float16 with the store and without, so that a map is the same, bit by
bit, in both cases.
"""

import hashlib
import re
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from os import getpid, utime
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float32, UInt8
from safetensors import SafetensorError
from safetensors.numpy import load, save

from avlmaps.core.errors import BackendError
from avlmaps.core.files import user_path
from avlmaps.core.numbers import unmasked
from avlmaps.core.progress import say
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import cache_folder, precision_in_force
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
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame

_GB = 1e9
_LARGEST_SHARE = 1e-2  # of the limit: at least a hundred frames find room
_AFTER_SWEEPING = 0.9
_ABANDONED_S = 3600.0
FEATURES = "features"  # the name of an encoder's only array


@dataclass(frozen=True, slots=True)
class CacheSettings:
    """Whether features are stored, and the limit of the store.

    Attributes:
        place: ``auto`` stores those of models on torch in the user's cache folder; a folder stores those of every model
        there; ``off`` stores none.
        limit_gb: room on the disk; what was used longest ago goes first. Features of more than a hundredth of it for
            one frame are not stored.
    """

    place: Path | Literal["auto", "off"] = "auto"
    limit_gb: float = 20.0

    def __post_init__(self) -> None:
        if not self.limit_gb > 0.0:
            raise BackendError(f"The feature cache's limit is {self.limit_gb} GB; choose more than 0, or no cache.")


DEFAULT_CACHE = CacheSettings()


class FeatureStore:
    """The features on the disk; safe to use from several threads and processes.

    A file that cannot be read or written is not an error: its features are made again, or not stored.

    Attributes:
        found: how many features of each module came from here.
    """

    def __init__(self, folder: Path, limit_bytes: float = 20 * _GB) -> None:
        """Use a folder, which is made when the first feature is stored."""
        self.folder, self.limit_bytes = user_path(folder), limit_bytes
        self.found: dict[Kind, int] = {}
        self._opened_s = time.time()
        self._total: float | None = None
        self._full = False
        self._warned: set[str] = set()
        self._lock = threading.Lock()

    def get(self, kind: Kind, card: ModelCard, key: str) -> Mapping[str, np.ndarray] | None:
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

    def put(self, kind: Kind, card: ModelCard, key: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Store arrays by name, if there is room for them."""
        if self._full:
            return
        content = save({name: np.ascontiguousarray(array) for name, array in arrays.items()})
        if len(content) > _LARGEST_SHARE * self.limit_bytes:
            needed = len(content) / _LARGEST_SHARE / _GB
            self._tell(
                f"Features of {card.id} are not cached: they take {len(content) / 1e6:.0f} MB a frame, and a hundred "
                f"frames must find room ({option('feature-cache-gb', f'{needed:.0f}')})."
            )
            return
        path = self._path(kind, card, key)
        try:
            if not self._make_room(len(content)):
                return
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_name(f"{key}.{getpid()}-{threading.get_ident()}.partial")
            try:
                partial.write_bytes(content)
                partial.replace(path)
            finally:
                partial.unlink(missing_ok=True)
        except OSError as fault:
            self._full = True
            self._tell(f"Features are not cached any longer: {self.folder}: {fault.strerror or fault}.")

    def _path(self, kind: Kind, card: ModelCard, key: str) -> Path:
        named = re.sub(r"[^A-Za-z0-9._-]+", "-", card.id).strip(".-")[:60]
        return self.folder / f"{kind}-{named}-{card.checksum[:16]}" / f"{key}.safetensors"

    def _make_room(self, size: int) -> bool:
        with self._lock:
            if self._total is None:
                self._total = float(sum(entry[1] for entry in self._entries()))
            if self._total + size > self.limit_bytes:
                self._total = self._sweep(_AFTER_SWEEPING * self.limit_bytes - size)
            if self._total + size > self.limit_bytes:
                self._full = True
                self._tell(
                    f"The feature cache is full with what this build needs itself; further frames are not stored "
                    f"({self.limit_bytes / _GB:g} GB in {self.folder}; {option('feature-cache-gb')})."
                )
                return False
            self._total += size
            return True

    def _sweep(self, wanted: float) -> float:
        """Remove what was used longest ago, but nothing that was used since this store was opened; return the size.

        A recording that is larger than the store would otherwise push out its own first frames before their turn
        comes again, and nothing would ever be found.
        """
        entries = sorted(self._entries())
        total = float(sum(size for _, size, _ in entries))
        for used_s, size, path in entries:
            if total <= wanted or used_s >= self._opened_s:
                break
            with suppress(OSError):
                path.unlink(missing_ok=True)
                total -= size
        return total

    def _entries(self) -> list[tuple[float, int, Path]]:
        """Return (last use, bytes, file) of all stored files; remove what broken-off writes left."""
        found: list[tuple[float, int, Path]] = []
        for path in self.folder.glob("*/*"):
            with suppress(OSError):  # another process may have removed it
                if path.parent.is_symlink():
                    continue
                state = path.stat()
                if path.suffix != ".partial":
                    found.append((state.st_mtime, state.st_size, path))
                elif time.time() - state.st_mtime > _ABANDONED_S:
                    path.unlink()
        return found

    def _tell(self, sentence: str) -> None:
        if sentence not in self._warned:
            self._warned.add(sentence)
            say(f"note: {sentence}")


def key_of(*seen: np.ndarray | str | float | int | None) -> str:
    """Return the hex SHA-256 of arrays (their types and shapes with them), words and numbers."""
    found = hashlib.sha256()
    for one in seen:
        if isinstance(one, np.ndarray):
            found.update(f"array {one.dtype.str} {one.shape}:".encode())
            found.update(np.ascontiguousarray(one).data)
        else:
            found.update(f"{type(one).__name__} {one!r};".encode())
    return found.hexdigest()


def with_cache(used: Encoders, settings: CacheSettings) -> Encoders:
    """Return the encoders with a store before them, as the settings say.

    A matcher's matches are not stored, nor the features of an encoder whose card does not distinguish it from others.
    """
    slow = frozenset(kind for kind in used if used.sources[kind].is_slow)
    storable = frozenset(kind for kind in used if kind is not Kind.MATCHER and used.sources[kind].has_card)
    kept = {"off": frozenset[Kind](), "auto": slow}.get(str(settings.place), frozenset(used)) & storable
    folder = cache_folder() / "features" if isinstance(settings.place, str) else settings.place
    store = FeatureStore(folder, 1e9 * settings.limit_gb)
    sources = dict(used.sources)
    for kind in kept | (slow & {Kind.PIXELS}):  # features of slow pixels are rounded as with the store
        encoder = cached(kind, used.load(kind), store if kind in kept else None, half=kind in slow)
        sources[kind] = replace(used.sources[kind], given=encoder)
    return used if sources == used.sources else Encoders.of(used.name, sources, used.weight_variance_m2)


def cache_note(used: Encoders, kind: Kind) -> str:
    """Return how many features of a module came from the store, for a progress bar; ``""`` where none can."""
    store = getattr(used.sources[kind].given, "store", None) if kind in used else None
    return f"{store.found.get(kind, 0)} from the cache" if isinstance(store, FeatureStore) else ""


class _Memory:
    """What one model made before; without a store it forgets all."""

    def __init__(self, kind: Kind, card: ModelCard, store: FeatureStore | None) -> None:
        self.kind, self.card, self.store = kind, card, store

    def once(self, make: Callable[[], np.ndarray], *seen: Any) -> np.ndarray:
        """Return the features that are made of what is seen, made once."""
        return self.each(lambda _: [{FEATURES: make()}], [seen])[0][FEATURES]

    def each(
        self, make: Callable[[list[int]], Sequence[Mapping[str, np.ndarray]]], seen: Sequence[Sequence[Any]]
    ) -> list[Mapping[str, np.ndarray]]:
        """Return what is made of each that is seen; those that are not in the store are made together.

        Args:
            make: returns what is made of the ones of these numbers.
            seen: all that the model looks at, for each.
        """
        if self.store is None:
            return list(make(list(range(len(seen)))))
        model = (__version__, self.kind, self.card.id, self.card.checksum, precision_in_force())
        keys = [key_of(*model, *one) for one in seen]
        kept = [self.store.get(self.kind, self.card, key) for key in keys]
        missing = [number for number, one in enumerate(kept) if one is None]
        made = list(make(missing)) if missing else []
        for number in reversed(missing):  # pixels of a frame take 150 MB: none is held twice for long
            kept[number] = fresh = made.pop()
            self.store.put(self.kind, self.card, keys[number], fresh)
        return [one for one in kept if one is not None]


def cached(kind: Kind, encoder: Any, store: FeatureStore | None, *, half: bool = False) -> Any:
    """Return an encoder that makes the features of each frame, picture or sound once.

    Args:
        kind: the module.
        encoder: the real one.
        store: where its features are stored; None stores none.
        half: features of pixels are rounded to float16.
    """
    memory = _Memory(kind, encoder.card, store)

    def pixels(frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
        rounded = np.float16 if half else np.float32
        made = memory.each(
            lambda rows: [
                {FEATURES: one.astype(rounded)} for one in encode_batch(encoder, [frames[row] for row in rows])
            ],
            [_seen_in(frame) for frame in frames],
        )
        return [one[FEATURES].astype(np.float32, copy=False) for one in made]

    def views(frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        seen = [_seen_in(frame) for frame in frames]
        made = memory.each(
            lambda rows: [{FEATURES: one} for one in unmasked(encoder.encode([frames[row] for row in rows]))], seen
        )
        return np.stack([one[FEATURES] for one in made]) if made else np.zeros((0, encoder.card.dim), np.float32)

    def sounds(sound: Sound) -> Float32[np.ndarray, "windows d"]:
        return memory.once(lambda: _features(encoder.encode(sound)), sound.samples, sound.rate_hz)

    def places(
        rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        learnt = [part for name in sorted(state) for part in (name, np.asarray(state[name]))]
        seen = (rgb, local.xy, local.descriptors, local.score, *learnt)
        return memory.once(lambda: _features(encoder.encode(rgb, local, state)), *seen)

    def keypoints(rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        (made,) = memory.each(lambda _: [_arrays_of(encoder.encode(rgb))], [[rgb]])
        width, height = made["size"].tolist()
        return LocalFeatures(made["xy"], made["descriptors"], made["score"], (width, height))

    names = (*members_of(FrameSoundEncoder if kind is Kind.SOUNDS else PROTOCOLS[kind]), "keyframes_only")
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


def encode_batch(encoder: PixelEncoder, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
    """Return the features of each frame, made in one go where the encoder can."""
    if len(frames) > 1 and isinstance(encoder, BatchPixelEncoder):
        made = encoder.encode_batch([frame.copy() for frame in frames])
    else:
        made = [encoder.encode(frame.copy()) for frame in frames]
    return [unmasked(features) for features in made]


def _features(made: Any) -> Float32[np.ndarray, "..."]:
    return np.asarray(unmasked(made), np.float32)


def _seen_in(frame: Frame) -> list[np.ndarray | str | float | None]:
    """Return all of a frame that an encoder may look at: everything but its number, name and time."""
    rig, ground = frame.rig, frame.ground
    stands = (None,) if ground is None else (ground.up_in_world, ground.camera_m, ground.floor_m)
    cameras = f"{rig.rgb} {rig.depth}"
    return [frame.rgb, frame.depth_m, frame.world_from_camera, cameras, np.asarray(rig.rgb_from_depth), *stands]


def _arrays_of(local: LocalFeatures) -> dict[str, np.ndarray]:
    columns = {name: np.asarray(getattr(local, name), np.float32) for name in ("xy", "descriptors", "score")}
    return {**columns, "size": np.array(local.size)}
