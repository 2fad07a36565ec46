"""What follows from a map's files, stored beside them so that it is computed once: the map itself stays what it is.

``.derived/NAME.json`` lists the arrays of one derivation under a key: a digest of the checksums of the files that they
were made from, of the source text that made them, and of all else that they depend on. With any other key they are not
read, so that a map that was built again, edited, or opened by another avlmaps never answers from old ones. Only a large
map has any: those of a small one are computed as fast as they are read. Where the folder cannot be written, nothing is
stored and every process computes them. A build stores them at its end; of a map that came otherwise (merged, imported,
repaired, older) the first question that needs them all does.
"""

import hashlib
import importlib.util
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular, write_bytes_atomically
from avlmaps.core.version import __version__
from avlmaps.maps.store.array_files import FileInfo, is_stored_file, read_array, sync_files, write_array
from avlmaps.maps.store.integrity import Stamp, stamp
from avlmaps.maps.store.manifest import MapInfo

DERIVED = ".derived"
_TEXTS = (".py", ".toml", ".json", ".csv", ".txt")  # of a package; its weights are known by the cards of their models
LEAST_VOXELS = 250_000
"""A map of fewer voxels has no derivations."""


def is_large(info: MapInfo) -> bool:
    """Return whether a map has derivations: it lies on the disk and has many voxels."""
    return bool(info.files) and info.counts.voxels >= LEAST_VOXELS


class _Entry(msgspec.Struct, kw_only=True):
    """One ``NAME.json``; ``stamps`` are those of files whose checksums are known to be right."""

    key: str
    files: dict[str, FileInfo]
    stamps: dict[str, Stamp] = {}


@dataclass(frozen=True, slots=True)
class Derivation:
    """Where arrays that follow from a map are stored, and what they follow from.

    Attributes:
        folder: the map's.
        name: of the derivation, an identifier.
        key: digest of all that the arrays depend on.
    """

    folder: Path
    name: str
    key: str

    @classmethod
    def of(
        cls, folder: Path, info: MapInfo, name: str, files: Sequence[str], modules: Sequence[str], given: Any
    ) -> "Derivation | None":
        """Return where a derivation of a map is stored; None for a map in memory, or one too small to need it.

        Args:
            folder: the map's.
            info: its manifest.
            name: of the derivation.
            files: what it reads of the map, as the manifest names it (``voxels/feature``).
            modules: full names of the modules, and of whole packages, that compute it.
            given: all else that it depends on; anything that msgspec turns into JSON.
        """
        if not all(file in info.files for file in files) or not is_large(info):
            return None
        made_from = {file: info.files[file].sha256 for file in files}
        said = [name, made_from, [_source_digest(module) for module in modules], given]
        return cls(folder, name, hashlib.sha256(msgspec.json.encode(said, order="deterministic")).hexdigest())

    @property
    def _place(self) -> Path:
        return self.folder / DERIVED

    def read(self) -> dict[str, np.ndarray] | None:
        """Return the arrays, in memory; None where they are not stored, are of another key, or are damaged."""
        entry = _entry(self._place / f"{self.name}.json")
        if entry is None or entry.key != self.key:
            return None
        stamps = {file.path: stamp(self._place / file.path) for file in entry.files.values()}
        known = {path: then for path, then in stamps.items() if then is not None and entry.stamps.get(path) == then}
        try:
            arrays = {
                name: np.array(read_array(self._place, file, verify=file.path not in known))
                for name, file in entry.files.items()
            }
        except MapError:
            return None
        if len(known) < len(stamps):  # a copied map: its files are known from now on
            self._write_entry(entry.files)
        return arrays

    def write(self, arrays: Mapping[str, np.ndarray]) -> bool:
        """Store the arrays in the place of older ones; return whether that was possible.

        A kill at any instant leaves the older ones or these.
        """
        if self._place.is_symlink():
            return False
        try:
            files = {name: write_array(self._place, f"{self.name}_{name}", array) for name, array in arrays.items()}
            sync_files(self._place, files.values())
        except (MapError, OSError):
            return False
        if not self._write_entry(files):
            return False
        kept = {self._place / file.path for file in files.values()}
        old = [*self._place.glob(f"{self.name}_*"), *self._place.glob(f".{self.name}*.partial")]
        _remove(file for file in old if file not in kept and is_stored_file(file))
        return True

    def _write_entry(self, files: Mapping[str, FileInfo]) -> bool:
        paths = [file.path for file in files.values()]
        stamps = {path: found for path in paths if (found := stamp(self._place / path)) is not None}
        content = msgspec.json.encode(_Entry(key=self.key, files=dict(files), stamps=stamps))
        try:
            write_bytes_atomically(self._place / f"{self.name}.json", content)
        except OSError:
            return False
        return True


def remove_derived(folder: Path) -> None:
    """Remove the derivations of the map that a folder held before, and nothing that avlmaps did not name."""
    place = folder / DERIVED
    if place.is_symlink() or not place.is_dir():
        return
    _remove(file for file in place.iterdir() if is_stored_file(file) or _entry(file) is not None)
    with suppress(OSError):
        place.rmdir()


def _entry(path: Path) -> _Entry | None:
    try:
        return decode_json(read_regular(path, DESCRIPTION_BYTES), _Entry)
    except (OSError, msgspec.DecodeError, UnicodeDecodeError):
        return None


def _remove(files: Iterable[Path]) -> None:
    for file in list(files):
        with suppress(OSError):
            file.unlink()


@cache
def _source_digest(module: str) -> str:
    """Return a digest of a module's source text, of a package's with its data; of the release where there is none."""
    found = importlib.util.find_spec(module)
    if found is None or found.origin is None:
        return __version__
    origin = Path(found.origin)
    files = [origin]
    if found.submodule_search_locations is not None:
        files = sorted(file for file in origin.parent.rglob("*") if file.suffix in _TEXTS)
    total = hashlib.sha256()
    try:
        for file in files:
            total.update(f"{file.relative_to(origin.parent)}\n".encode() + hashlib.sha256(file.read_bytes()).digest())
    except OSError:
        return __version__
    return total.hexdigest()
