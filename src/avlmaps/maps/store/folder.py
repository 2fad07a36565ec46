"""A map's folder: ``map.json``, files of arrays, the clips, and what people edit.

New files are written beside the old ones under free names, then ``map.json`` is replaced in one step, then the old
files go. So a kill at any instant leaves the old map or the new one.
"""

import re
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import (
    MANIFEST_BYTES,
    checked_size,
    decode_json,
    read_regular,
    replacing,
    sha256_of_file,
    sync_folder,
    user_path,
    write_bytes_atomically,
)
from avlmaps.core.words import near_path
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.edits import EDITS
from avlmaps.maps.store.life import life_arrays, read_life
from avlmaps.maps.store.manifest import SCHEMA_VERSION, MapInfo
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.tables import (
    EDITING,
    LOCK,
    MOST_BYTES,
    RESTORE,
    SMALL_BYTES,
    SUFFIX,
    FileInfo,
    as_kind,
    explain_write_errors,
    fields_of,
    is_locked,
    read_arrays,
    sync_file,
    write_arrays,
)
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Submaps, Voxels

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
    """Return the files that a ``map.json`` of schema 1 lists, by their places in the folder, which are inside of it."""
    try:
        files: _Files = decode_json(content, _Files)
    except msgspec.DecodeError as fault:
        raise MapError(f"{where} is damaged: {fault}; {RESTORE}.") from fault
    inside = re.compile(r"[a-z]+/\w+-[0-9a-f]{16}\.\w+")
    if odd := [file.path for file in files.files.values() if not inside.fullmatch(file.path)]:
        raise MapError(f"{where} names a file that is none of a map ({odd[0][:200]}); do not use it.")
    return {file.path: FileInfo(bytes=file.bytes, sha256=file.sha256) for file in files.files.values()}


def read_schema1(path: Path, content: bytes) -> tuple[dict[str, tuple[Path, dict[str, np.ndarray]]], tuple[Path, ...]]:
    """Return the arrays of a map of schema 1, by the sections of schema 2 with their folders, and its clips."""
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
        if checked_size(path, MOST_BYTES) != size:
            raise ValueError(f"it has another size than {size} bytes")
        return np.load(path, mmap_mode="r" if size > SMALL_BYTES else None, allow_pickle=False)
    except (OSError, ValueError) as fault:
        raise MapError(f"{path} is missing or damaged ({fault}); {RESTORE}.") from fault


MANIFEST = "map.json"
PARTS = "parts"
_PART = re.compile(r"[a-z_]+-[0-9a-f]{12}|clips|clips\.unfinished")  # the folders that builds make there
SECTIONS = ("voxels", "keyframes", "sounds")
_NAMES = "names"  # a file of maps before 1.0, whose arrays are in that of the voxels now
CLIPS = "clips"
_LIFE, _SUBMAPS, _STATE, _SOURCES, _FOUND = "life.", "submaps.", "state.", "sources.", "found."
_TABLE = re.compile(rf"({'|'.join((*SECTIONS, _NAMES))})(\.2)?\.safetensors")
_CLIP = re.compile(r"\d{6}-[0-9a-f]{16}\.\w+")
_PARTIAL = re.compile(rf"\.({re.escape(MANIFEST)}|{'|'.join((*SECTIONS, _NAMES))})\..*\.part(ial|\.safetensors|\.json)")
_MOST_CLIP_BYTES = 1 << 40
# Folders and files of a map of schema 1.
_OLD_SECTIONS = (*SECTIONS, "life", "submaps", "sources", ".derived")
_OLD = re.compile(r"[A-Za-z0-9_]+-[0-9a-f]{16}(\.[^./]+)?|\..+\.partial|[a-z_]+\.json")

T = TypeVar("T")
Stamp = tuple[int, int, int, int]


class _Ident(msgspec.Struct):
    format: str = ""
    schema_version: int = 0


def stamp(path: Path | str) -> Stamp | None:
    """Return size, times of change and inode of a file, which tell whether it was replaced; None where it is not."""
    try:
        found = Path(path).stat()
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino


def read(path: Path | str) -> MapData:
    """Return the map of a folder; its large arrays stay on the disk until they are used.

    Raises:
        MapError: there is no map, it is half built, of another schema, or a file is missing or damaged.
    """
    path = user_path(path)
    content = _manifest(path)
    while True:
        try:
            data = _read(path, content)
        except MapError:
            newer = _manifest(path)
            if newer == content:
                raise
        else:
            newer = _manifest(path)
            if newer == content:
                return data
        content = newer  # it was replaced meanwhile, and the old files may be gone


def read_info(path: Path) -> MapInfo | None:
    """Return what ``map.json`` in a folder says; None where there is none, ``MapError`` where it is damaged."""
    try:
        return _info(path, read_regular(path / MANIFEST, MANIFEST_BYTES))
    except (FileNotFoundError, NotADirectoryError):
        return None


def damaged_files(path: Path) -> list[str]:
    """Return a sentence for each file of a map that is missing, or not what was written."""
    info, faults = _info(path, _manifest(path)), list[str]()
    for name, file in info.files.items():
        try:
            size = checked_size(path / name, _MOST_CLIP_BYTES)
            same = size == file.bytes and sha256_of_file(path / name) == file.sha256
        except OSError as fault:
            faults.append(f"{path / name} is missing or cannot be read ({fault.strerror or fault}).")
        else:
            faults += [] if same else [f"{path / name} is damaged: its checksum is not the one that was written."]
    return faults


def write(path: Path, data: MapData) -> MapInfo:
    """Make a folder, whose lock the caller holds, this map; return what ``map.json`` says now.

    What the folder held as a map is replaced. Where it cannot be written (``MapError``), the old map is still there.
    """
    files, taken = dict[str, FileInfo](), _listed(path)
    with explain_write_errors(path):
        path.mkdir(parents=True, exist_ok=True)
        for section, arrays in _sections(data).items():
            name = section + SUFFIX if section + SUFFIX not in taken else f"{section}.2{SUFFIX}"
            write_arrays(path / name, arrays)
            files[name] = FileInfo.of(path / name)
        for number, clip in enumerate(data.sounds.clips):
            file = FileInfo.of(clip)
            name = f"{CLIPS}/{number:06d}-{file.sha256[:16]}{clip.suffix}"
            _copy_clip(clip, path / name, file.bytes)
            files[name] = file
        size = sum(file.bytes for file in files.values())
        info = msgspec.structs.replace(data.info, schema_version=SCHEMA_VERSION, files=files, bytes=size)
        write_bytes_atomically(path / MANIFEST, msgspec.json.format(msgspec.json.encode(info), indent=2) + b"\n")
        sweep(path, info)
        return info


def sweep(path: Path, info: MapInfo) -> None:
    """Remove the parts of a build and the files of maps before; only what avlmaps has named, and what can be."""
    kept = {path / name for name in info.files}
    ours = [file for file in path.glob(f"*{SUFFIX}") if _TABLE.fullmatch(file.name) or file.name[0] == "."]
    ours += [file for file in (path / CLIPS).glob("*") if _CLIP.fullmatch(file.name) or file.name[0] == "."]
    ours += [file for section in _OLD_SECTIONS for file in (path / section).glob("*") if _OLD.fullmatch(file.name)]
    ours += [*path.glob(f".{MANIFEST}.*.part*"), path / ".checked.json"]
    for file in ours:
        if file not in kept:
            with suppress(OSError):
                file.unlink()
    for section in (CLIPS, *_OLD_SECTIONS):
        with suppress(OSError):
            (path / section).rmdir()
    remove_parts(path)


def _parts(path: Path) -> list[Path]:
    parts = path / PARTS
    if parts.is_symlink() or not parts.is_dir():
        return []
    return [entry for entry in parts.iterdir() if _PART.fullmatch(entry.name) and entry.is_dir()]


def remove_parts(path: Path) -> None:
    """Remove what a build stored of a map that it had not finished."""
    for folder in _parts(path):
        shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        (path / PARTS).rmdir()


def is_map_or_free(path: Path) -> bool:
    """Return whether a build may write here: nothing there, an empty folder, or a map, whole or half-built."""
    if not path.exists():
        return True
    if not path.is_dir():
        return False
    names = {entry.name for entry in path.iterdir()}
    if MANIFEST in names or any(_parts(path)):
        return True
    names = {name for name in names if not (_TABLE.fullmatch(name) or _PARTIAL.fullmatch(name))}
    if not names <= {EDITS, PARTS, CLIPS, LOCK, EDITING}:
        return False
    return all(_CLIP.fullmatch(entry.name) for entry in (path / CLIPS).glob("[!.]*")) and not any(
        (path / PARTS).glob("*")
    )


def has_unfinished_build(path: Path | str) -> bool:
    """Return whether a build in this folder is not finished, so that building again resumes it."""
    parts = user_path(path) / PARTS
    return parts.is_dir() and any(parts.iterdir())


def _manifest(path: Path) -> bytes:
    try:
        return read_regular(path / MANIFEST, MANIFEST_BYTES)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as fault:
        raise MapError(f"{path / MANIFEST} cannot be read ({fault.strerror or fault}); check the file.") from fault
    if is_locked(path):
        raise MapError(f"{path} is being built at this moment; wait until the build has finished.")
    if has_unfinished_build(path):
        raise MapError(
            f"{path} is a half-built map (its build was stopped); run the same `avlmaps build` again with --resume, "
            "and it resumes from there."
        )
    if path.is_dir():
        raise MapError(f"{path} is a folder without a map in it (no {MANIFEST}); make one with `avlmaps build`.")
    close = near_path(path, lambda beside: (beside / MANIFEST).is_file())
    meant = f"did you mean {close}?" if close else "make one with `avlmaps build`."
    raise MapError(f"{path} is not there, or is not a map's folder; {meant}")


def _info(path: Path, content: bytes) -> MapInfo:
    where = path / MANIFEST
    try:
        ident: _Ident = decode_json(content, _Ident)
        known = ident.format == "avlmap" and ident.schema_version in (1, SCHEMA_VERSION)
        info: MapInfo | None = decode_json(content, MapInfo) if known else None
        if info is not None:
            _ = info.rig.rig(), GridSpec(info.voxel_size_m)
    except (msgspec.DecodeError, ValueError, MapError) as fault:  # of bytes that are not UTF-8 as well
        raise MapError(f"{where} is damaged: {str(fault).rstrip('.')}; {RESTORE}.") from fault
    if info is None:
        if ident.format != "avlmap":
            raise MapError(f"{where} belongs to no map of avlmaps; give the folder that `avlmaps build` wrote.")
        how = "upgrade avlmaps" if ident.schema_version > SCHEMA_VERSION else "build the map again in its place"
        raise MapError(
            f"{where} has schema version {ident.schema_version}, this avlmaps reads {SCHEMA_VERSION} and 1; {how}."
        )
    if info.schema_version == 1:
        return msgspec.structs.replace(info, files=files_of(content, where))
    if odd := [name for name in info.files if not (_TABLE.fullmatch(name) or _is_clip(name))]:
        raise MapError(f"{where} names a file that is none of a map ({odd[0][:200]}); do not use it.")
    return info


def _is_clip(name: str) -> bool:
    folder, _, file = name.partition("/")
    return folder == CLIPS and _CLIP.fullmatch(file) is not None


def _read(path: Path, content: bytes) -> MapData:
    info = _info(path, content)
    if info.schema_version == 1:
        return assembled(info, *read_schema1(path, content))
    tables = dict[str, tuple[Path, dict[str, np.ndarray]]]()
    for name, file in info.files.items():
        _require_size(path / name, file)
        if table := _TABLE.fullmatch(name):
            tables[table[1]] = path / name, read_arrays(path / name)[0]
    if missing := [section for section in SECTIONS if section not in tables]:
        raise MapError(f"{path / MANIFEST} is damaged: it lists no file of {missing[0]}; {RESTORE}.")
    clips = tuple(path / name for name in sorted(info.files) if _is_clip(name))
    data = assembled(info, tables, clips)
    counts = info.counts
    if (len(data.voxels), len(data.keyframes), len(data.sounds), len(clips)) != (
        counts.voxels, counts.keyframes, counts.sounds, counts.sounds,
    ):  # fmt: skip
        raise MapError(f"{path / MANIFEST} is damaged: its counts are not those of the files; {RESTORE}.")
    return data


def assembled(
    info: MapInfo, tables: Mapping[str, tuple[Path, Mapping[str, np.ndarray]]], clips: tuple[Path, ...]
) -> MapData:
    """Return the map of the arrays of each section, which come with the file that an error names."""
    (at_voxels, voxels), (at_keyframes, keyframes), (at_sounds, sounds) = (tables[section] for section in SECTIONS)
    life = {name.removeprefix(_LIFE): array for name, array in voxels.items() if name.startswith(_LIFE)}
    return MapData(
        info,
        as_kind(Voxels, voxels, at_voxels),
        as_kind(Keyframes, keyframes, at_keyframes),
        as_kind(HeardSounds, sounds, at_sounds, clips=clips),
        _named(keyframes, _STATE),
        _optional(SourceEvidence, sounds, at_sounds, _SOURCES),
        submaps=_optional(Submaps, voxels, at_voxels, _SUBMAPS),
        life=read_life(life, f"{at_voxels}") if life else None,
        findings=dict(tables[_NAMES][1]) if _NAMES in tables else _named(voxels, _FOUND),
    )


def _optional(kind: type[T], arrays: Mapping[str, np.ndarray], where: Path, prefix: str) -> T | None:
    held = any(name.startswith(prefix) for name in arrays)
    return as_kind(kind, arrays, where, prefix) if held else None


def _named(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _sections(data: MapData) -> dict[str, dict[str, np.ndarray]]:
    voxels, keyframes, sounds = fields_of(data.voxels), fields_of(data.keyframes), fields_of(data.sounds)
    voxels |= {} if data.submaps is None else fields_of(data.submaps, _SUBMAPS)
    voxels |= {} if data.life is None else {_LIFE + name: array for name, array in life_arrays(data.life).items()}
    keyframes |= {_STATE + name: array for name, array in data.place_state.items()}
    sounds |= {} if data.sources is None else fields_of(data.sources, _SOURCES)
    voxels |= {_FOUND + name: array for name, array in data.findings.items()}
    return dict(zip(SECTIONS, (voxels, keyframes, sounds), strict=True))


def _listed(path: Path) -> frozenset[str]:
    try:
        info = read_info(path)
    except MapError:
        return frozenset()
    return frozenset(() if info is None else info.files)


def _require_size(path: Path, file: FileInfo) -> None:
    try:
        size = checked_size(path, _MOST_CLIP_BYTES)
    except FileNotFoundError:
        raise MapError(f"{path} is missing; {RESTORE}.") from None
    except OSError as fault:
        raise MapError(f"{path} cannot be read ({fault.strerror or fault}); {RESTORE}.") from fault
    if size != file.bytes:
        raise MapError(f"{path} is damaged: it has {size} bytes, {file.bytes} were written; {RESTORE}.")


def _copy_clip(source: Path, target: Path, size: int) -> None:
    if target.is_file() and target.stat().st_size == size:  # its name holds its checksum
        return
    target.parent.mkdir(exist_ok=True)
    with replacing(target) as part:
        part.unlink(missing_ok=True)
        part.write_bytes(source.read_bytes())
        sync_file(part)
    sync_folder(target.parent.parent)
