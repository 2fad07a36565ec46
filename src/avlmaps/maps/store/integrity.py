"""Whether a map's large files are still what was written, found out once and not at every opening.

Large files are memory-mapped, and comparing them with their checksums takes a second for 1.5 GB. A thread does it when
a map is opened for the first time, and code that reads the arrays waits for its outcome. ``.checked.json`` in the map's
folder then stores each file's size, inode and times of change; files whose entries are the same at the next opening are
not read again. A copied map is checked again. ``avlmaps info MAP --verify`` heeds no such note.
"""

import hashlib
import math
import os
import threading
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, open_regular, read_regular, write_bytes_atomically
from avlmaps.maps.store import array_files as shards
from avlmaps.maps.store.array_files import MEND, FileInfo
from avlmaps.maps.store.array_validation import content_fault

CHECKED = ".checked.json"
_CHUNK_BYTES = 1 << 22

Stamp = tuple[int, int, int, int]


class _Checked(msgspec.Struct, kw_only=True):
    files: dict[str, Stamp] = {}


def stamp(path: Path | str) -> Stamp | None:
    """Return size, time of change, time of change of the entry, and inode; None where there is no such file."""
    try:
        found = os.stat(path)  # noqa: PTH116 - at every access to a map
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino


def is_large(info: FileInfo) -> bool:
    """Return whether a file is so large that opening a map does not compare it with its checksum."""
    return info.bytes > shards.SMALL_BYTES


def remember_checked(folder: Path, files: Iterable[FileInfo]) -> None:
    """Note that these large files are whole, as they are now; where the folder cannot be written, nothing is noted."""
    stamps = {file.path: found for file in files if is_large(file) and (found := stamp(folder / file.path))}
    if not stamps:
        return
    with suppress(OSError):
        write_bytes_atomically(folder / CHECKED, msgspec.json.encode(_Checked(files=stamps)))


def _remembered(folder: Path) -> dict[str, Stamp]:
    try:
        return decode_json(read_regular(folder / CHECKED, DESCRIPTION_BYTES), _Checked).files
    except (OSError, msgspec.DecodeError, UnicodeDecodeError):
        return {}


class IntegrityCheck:
    """Watches over the large files of an opened map."""

    def __init__(self, folder: Path, files: Mapping[str, FileInfo], *, trusting: bool = True) -> None:
        """Begin to check, in a thread, the large files that are not known to be whole.

        Args:
            folder: the map's.
            files: the manifest's entries by what they hold.
            trusting: whether files that are noted as whole are not read again.
        """
        self._folder = folder
        self._large = {name: file for name, file in files.items() if is_large(file)}
        places = {name: f"{folder}{os.sep}{file.path}" for name, file in self._large.items()}
        self._stamps = {place: stamp(place) for place in places.values()}
        known = _remembered(folder) if trusting else {}
        self._unknown = {n: f for n, f in self._large.items() if known.get(f.path) != self._stamps[places[n]]}
        self._faults: list[str] = []
        self._thread: threading.Thread | None = None
        if self._unknown:
            self._thread = threading.Thread(target=self._check, name="avlmaps-integrity", daemon=True)
            self._thread.start()

    @property
    def faults(self) -> tuple[str, ...]:
        """The faults of the files, one sentence each; waits until all are checked."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        return tuple(self._faults)

    def require_whole(self) -> None:
        """Refuse to continue with files that are damaged, or that were changed or cut off since the map was opened.

        Files that were replaced or removed are another matter: their old content stays readable.

        Raises:
            MapError: a file is damaged or has changed.
        """
        if self.faults:
            raise MapError(self._faults[0])
        for path, then in self._stamps.items():
            now = stamp(path)
            if now is not None and then is not None and now[3] == then[3] and now[:2] != then[:2]:
                raise MapError(
                    f"{path} was written while the map was open (it had {then[0]} bytes, now {now[0]}); "
                    f"{MEND}, then open the map again."
                )

    def _check(self) -> None:
        for name, file in self._unknown.items():
            try:
                fault = _fault_of(self._folder / file.path, name, file)
            except OSError as error:
                fault = f"it cannot be read ({error.strerror or error})"
            if fault:
                self._faults.append(f"{self._folder / file.path} is damaged: {fault}; {MEND}.")
        if not self._faults and all(stamp(p) == then for p, then in self._stamps.items()):
            remember_checked(self._folder, self._large.values())


def _fault_of(path: Path, name: str, info: FileInfo) -> str:
    """Compare a file with its checksum and look at its numbers, a chunk at a time; say what is wrong, or nothing."""
    dtype = np.dtype(info.dtype or np.uint8)
    header = info.bytes - math.prod(info.shape) * dtype.itemsize if info.dtype else 0
    digest, odd = hashlib.sha256(), ""
    row = info.shape[1:]
    row_bytes = max(1, math.prod(row) * dtype.itemsize)
    with open_regular(path, info.bytes) as stream:
        digest.update(stream.read(header))
        while chunk := stream.read(max(1, _CHUNK_BYTES // row_bytes) * row_bytes):
            digest.update(chunk)
            if not odd and len(chunk) % row_bytes == 0:
                odd = content_fault(name, np.frombuffer(chunk, dtype).reshape(-1, *row))
    return odd if digest.hexdigest() == info.sha256 else "its checksum is not the one that was written"
