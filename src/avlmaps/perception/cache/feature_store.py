"""Features stored on the disk under a key of their inputs, so that nothing is encoded twice.

One folder for each model, one ``.npy`` file for each frame or sound, its name the hash of all that the model saw.
Behind the array stand four bytes, the CRC-32 of what is before them: a file that a power cut has spoiled counts as
none. Files are replaced whole, so that several builds may share the store.
"""

import hashlib
import io
import re
import threading
import time
import zlib
from contextlib import suppress
from dataclasses import dataclass
from os import getpid, utime
from pathlib import Path
from typing import Literal

import numpy as np

from avlmaps.core.errors import BackendError
from avlmaps.core.files import user_path
from avlmaps.core.progress import say
from avlmaps.core.registry import Kind
from avlmaps.core.wording import option
from avlmaps.perception.protocols import ModelCard

_GB = 1e9
_LARGEST_SHARE = 1e-2  # of the limit: at least a hundred frames find room
_AFTER_SWEEPING = 0.9
_ABANDONED_S = 3600.0
_CRC_BYTES = 4


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

    def get(self, kind: Kind, card: ModelCard, key: str) -> np.ndarray | None:
        """Return stored features, None where there are none that can be read."""
        path = self._path(kind, card, key)
        try:
            content = path.read_bytes()
        except OSError:
            return None
        array = _unpacked(content)
        if array is None:
            with suppress(OSError):
                path.unlink()
            return None
        with suppress(OSError):
            utime(path)  # used now, which is what sweeping goes by
        with self._lock:
            self.found[kind] = self.found.get(kind, 0) + 1
        return array

    def put(self, kind: Kind, card: ModelCard, key: str, array: np.ndarray) -> None:
        """Store features, if there is room for them."""
        if self._full:
            return
        if array.nbytes > _LARGEST_SHARE * self.limit_bytes:
            needed = array.nbytes / _LARGEST_SHARE / _GB
            self._tell(
                f"Features of {card.id} are not cached: they take {array.nbytes / 1e6:.0f} MB a frame, and a hundred "
                f"frames must find room ({option('feature-cache-gb', f'{needed:.0f}')})."
            )
            return
        content = _packed(array)
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
        return self.folder / f"{kind}-{named}-{card.checksum[:16]}" / f"{key}.npy"

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
                if path.suffix == ".npy":
                    found.append((state.st_mtime, state.st_size, path))
                elif path.suffix == ".partial" and time.time() - state.st_mtime > _ABANDONED_S:
                    path.unlink()
        return found

    def _tell(self, sentence: str) -> None:
        if sentence not in self._warned:
            self._warned.add(sentence)
            say(f"note: {sentence}")


def _packed(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.ascontiguousarray(array), allow_pickle=False)
    content = stream.getvalue()
    return content + zlib.crc32(content).to_bytes(_CRC_BYTES, "little")


def _unpacked(content: bytes) -> np.ndarray | None:
    body, crc = content[:-_CRC_BYTES], content[-_CRC_BYTES:]
    if len(crc) < _CRC_BYTES or zlib.crc32(body).to_bytes(_CRC_BYTES, "little") != crc:
        return None
    try:
        return np.lib.format.read_array(io.BytesIO(body), allow_pickle=False)
    except (ValueError, EOFError):
        return None


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
