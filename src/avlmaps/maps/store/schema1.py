"""Maps of schema 1, which had a file for each array: read for one release; whatever writes the map writes schema 2."""

import re
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import checked_size, decode_json
from avlmaps.maps.store.tables import RESTORE, FileInfo

_MOST_BYTES = 1 << 42
_SMALL_BYTES = 1 << 20
_OLD_CLIP = "sounds/clips/"
# What a file was called in ``map.json``, and the section and prefix that its array has now.
_PLACES = {
    "keyframes/state/": ("keyframes", "state."),
    **{f"{section}/": (section, "") for section in ("voxels", "keyframes", "sounds")},
    "life/": ("voxels", "life."),
    "submaps/": ("voxels", "submaps."),
    "sources/": ("sounds", "sources."),
}


class _File(msgspec.Struct):
    path: str
    bytes: int
    sha256: str


class _Files(msgspec.Struct):
    files: dict[str, _File]


def files_of(content: bytes, where: Path) -> dict[str, FileInfo]:
    """Return the files that a ``map.json`` of schema 1 lists, by their places in the folder.

    Raises:
        MapError: it is no such JSON, or one lies outside of the folder.
    """
    try:
        files: _Files = decode_json(content, _Files)
    except msgspec.DecodeError as fault:
        raise MapError(f"{where} is damaged: {fault}; {RESTORE}.") from fault
    inside = re.compile(r"[a-z]+/\w+-[0-9a-f]{16}\.\w+")
    if odd := [file.path for file in files.files.values() if not inside.fullmatch(file.path)]:
        raise MapError(f"{where} names a file that is none of a map ({odd[0][:200]}); do not use it.")
    return {file.path: FileInfo(bytes=file.bytes, sha256=file.sha256) for file in files.files.values()}


def read_schema1(path: Path, content: bytes) -> tuple[dict[str, tuple[Path, dict[str, np.ndarray]]], tuple[Path, ...]]:
    """Return the arrays of a map of schema 1, by the sections of schema 2 with their folders, and its clips.

    Raises:
        MapError: a file is missing or damaged.
    """
    listed: _Files = decode_json(content, _Files)
    tables = {section: (path / section, dict[str, np.ndarray]()) for section in ("voxels", "keyframes", "sounds")}
    clips: list[Path] = []
    for name, file in sorted(listed.files.items()):
        if name.startswith(_OLD_CLIP):
            clips.append(path / file.path)
            continue
        folder = next(folder for folder in _PLACES if name.startswith(folder))
        section, prefix = _PLACES[folder]
        tables[section][1][prefix + name.removeprefix(folder)] = _array(path / file.path, file.bytes)
    return tables, tuple(clips)


def _array(path: Path, size: int) -> np.ndarray:
    try:
        if checked_size(path, _MOST_BYTES) != size:
            raise ValueError(f"it has another size than {size} bytes")
        return np.load(path, mmap_mode="r" if size > _SMALL_BYTES else None, allow_pickle=False)
    except (OSError, ValueError) as fault:
        raise MapError(f"{path} is missing or damaged ({fault}); {RESTORE}.") from fault
