"""Writing a map: new files beside the old ones, then ``map.json``, then the old files go.

Until ``map.json`` is replaced, in one step, the folder is the old map (or none); from then on it is the new one.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.maps.store.array_files import FileInfo, is_stored_file, sync_files, write_array, write_copy
from avlmaps.maps.store.array_validation import array_fields
from avlmaps.maps.store.checkpoints import remove_stages, stage_folders
from avlmaps.maps.store.derived import remove_derived
from avlmaps.maps.store.edits import EDITS
from avlmaps.maps.store.integrity import remember_checked
from avlmaps.maps.store.life import LIFE, Life, life_arrays
from avlmaps.maps.store.lock import EDITING, LOCK
from avlmaps.maps.store.manifest import MapInfo
from avlmaps.maps.store.manifest_file import MANIFEST, write_manifest
from avlmaps.maps.store.reader import CLIPS, PARTS, SOURCES, STATE, SUBMAPS
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Submaps, Voxels

# What each file of a map was written of, by its name in the manifest: an array or a file that nobody changes any more.
Written = dict[str, tuple[np.ndarray | Path, FileInfo]]
SECTIONS = ("voxels", "keyframes", "sounds")
_ALL_SECTIONS = (*SECTIONS, LIFE.rstrip("/"), SUBMAPS.rstrip("/"), SOURCES.rstrip("/"))


@dataclass(frozen=True, slots=True)
class MapContent:
    """The arrays of a map.

    Attributes:
        voxels: occupied voxels.
        keyframes: stored pictures.
        place_state: what the place encoder learned from them.
        sounds: what was heard; ``clips`` are file names below ``clips_folder``.
        clips_folder: where the clips lie now.
        life: what became of its things over several days; None of one day.
        submaps: by which it can follow corrected poses; None where it cannot.
        sources: what the microphones say of where each sound began; None where their places are not known.
    """

    voxels: Voxels
    keyframes: Keyframes
    place_state: dict[str, np.ndarray]
    sounds: HeardSounds
    clips_folder: Path
    life: Life | None = None
    submaps: Submaps | None = None
    sources: SourceEvidence | None = None


def write_map(path: Path, content: MapContent, info: MapInfo, written: Written | None = None) -> MapInfo:
    """Make the folder this map.

    Args:
        path: the map's folder; what it held as a map is replaced.
        content: the arrays.
        info: the manifest but for ``files`` and ``bytes``.
        written: of the last call for this folder, which is the map that is there: what is the same object is not
            written again. It becomes that of this call.

    Returns:
        The whole manifest, as written.

    Raises:
        MapError: the disk is full, or the folder cannot be written; the old map is then still there.
    """
    before, now = written or {}, Written()
    for name, source, write in _writes(path, content):
        known = before.get(name)
        same = known is not None and (known[0] is source or (isinstance(source, Path) and known[0] == source))
        now[name] = known if known is not None and same else (source, write())
    files = {name: file for name, (_, file) in now.items()}
    size = sum(file.bytes for file in files.values())
    whole = msgspec.structs.replace(info, files=dict(sorted(files.items())), bytes=size)
    sync_files(path, files.values())
    write_manifest(path, whole)
    remember_checked(path, files.values())  # their checksums are those of what was written just now
    sweep(path, whole)
    if written is not None:
        written.clear()
        written.update(now)
    return whole


def as_written(path: Path, content: MapContent, files: Mapping[str, FileInfo]) -> Written:
    """Return the content of a map as it was opened, for `write_map`: what of it the new map has is not written again.

    Args:
        path: the map's folder, whose lock the caller holds.
        content: the arrays and clips that were read from it.
        files: of its manifest.
    """
    there = Written()
    for name, source, _ in _writes(path, content):
        file = files.get(name)
        if file is None or not (path / file.path).is_file():
            continue
        # What was written otherwise was converted as it was read.
        if isinstance(source, Path) or (source.dtype.str, source.shape) == (file.dtype, file.shape):
            there[name] = source, file
    return there


def _writes(path: Path, content: MapContent) -> Iterator[tuple[str, np.ndarray | Path, Callable[[], FileInfo]]]:
    """Yield the files of a map: their names in the manifest, what they hold, and what writes them."""
    for section, whole in zip(SECTIONS, (content.voxels, content.keyframes, content.sounds), strict=True):
        for field in array_fields(type(whole)):
            name = f"{section}/{field}"
            array = getattr(whole, field)
            yield name, array, partial(write_array, path, name, array)
    for name, array in content.place_state.items():
        if not name.isidentifier():
            raise ValueError(f"the place encoder calls an array {name!r}; its name must be an identifier")
        yield STATE + name, array, partial(write_array, path, f"keyframes/state_{name}", array)
    if content.life is not None:
        for name, array in life_arrays(content.life).items():
            yield LIFE + name, array, partial(write_array, path, LIFE + name, array)
    for prefix, table in ((SUBMAPS, content.submaps), (SOURCES, content.sources)):
        for field in () if table is None else array_fields(type(table)):
            array = getattr(table, field)
            yield prefix + field, array, partial(write_array, path, prefix + field, array)
    for number, clip in enumerate(content.sounds.clips):
        source = content.clips_folder / Path(clip).name
        yield f"{CLIPS}{number:06d}", source, partial(write_copy, path, f"sounds/{number:06d}", source)


def sweep(path: Path, info: MapInfo) -> None:
    """Remove from a map's folder the parts of its build and the files of maps before it.

    Only files are removed that avlmaps has named, and one that cannot be removed is left.
    """
    kept = {path / file.path for file in info.files.values()}
    for section in _ALL_SECTIONS:
        for old in (path / section).glob("*"):
            if old not in kept and is_stored_file(old):
                with suppress(OSError):
                    old.unlink()
    for unfinished in path.glob(f".{MANIFEST}.*.partial"):
        with suppress(OSError):
            unfinished.unlink()
    remove_stages(path / PARTS)
    remove_derived(path)


def is_map_or_free(path: Path) -> bool:
    """Return whether a build may write here: nothing there, an empty folder, or a map, whole or half-built."""
    if not path.exists():
        return True
    if not path.is_dir():
        return False
    names = {entry.name for entry in path.iterdir()}
    if MANIFEST in names or any(stage_folders(path / PARTS)):
        return True
    if not names <= {LOCK, EDITING, EDITS, PARTS, *_ALL_SECTIONS}:
        return False
    inside = [entry for name in names & {PARTS, *_ALL_SECTIONS} for entry in (path / name).glob("*")]
    return all(is_stored_file(entry) for entry in inside)
