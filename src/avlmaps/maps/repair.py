"""Giving a damaged map back the files that it was built with, from the recording that it was built from."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.maps.build import build_map
from avlmaps.maps.pipeline.plan import make_plan
from avlmaps.maps.store.array_files import FileInfo, explain_write_errors, refuse_links, sync_files, verify_file
from avlmaps.maps.store.integrity import IntegrityCheck, remember_checked
from avlmaps.maps.store.lock import lock_folder
from avlmaps.maps.store.manifest import MapInfo
from avlmaps.maps.store.manifest_file import MANIFEST, parse_manifest, read_manifest, write_manifest
from avlmaps.maps.store.reader import encoders_of_map, open_stored
from avlmaps.maps.store.writer import sweep
from avlmaps.recordings.types import Recording

_WORKSHOP = ".repair"
_SHOWN = 3


@dataclass(frozen=True, slots=True)
class Repaired:
    """The result of a repair.

    Attributes:
        files: what the damaged files hold (``voxels/feature``); empty where nothing was damaged.
        rebuilt: whether the whole map was replaced, since the processor at hand computes other last bits.
    """

    files: tuple[str, ...]
    rebuilt: bool = False


def damaged_files(path: Path) -> dict[str, str]:
    """Return every file of a map that is missing or not what was written, by what it holds, with a sentence each.

    Raises:
        MapError: there is no map, or ``map.json`` itself is damaged.
    """
    info = _manifest(path)
    found: dict[str, str] = {}
    for name, file in sorted(info.files.items()):
        try:
            verify_file(path, file, verify=True)
            IntegrityCheck(path, {name: file}, trusting=False).require_whole()
        except MapError as fault:
            found[name] = str(fault)
    return found


def repair_map(path: Path | str, recording: Recording | None) -> Repaired:
    """Compare every file of a map with its checksum and build the damaged ones again.

    The map is built again beside itself with its own settings and models, from the last finished part if an earlier
    repair was stopped. Where the damaged files come out bit by bit as they were, only they are replaced; else the whole
    map is. Until then nothing of the map is touched.

    Args:
        path: the map's folder.
        recording: that it was built from; None where it is not at hand.

    Raises:
        MapError: files are damaged and there is no recording, or it is not the one, or the models are other ones.
    """
    path = user_path(path)
    refuse_links(path)
    info, damaged = _manifest(path), damaged_files(path)
    if not damaged:
        shutil.rmtree(path / _WORKSHOP, ignore_errors=True)
        remember_checked(path, info.files.values())
        return Repaired(())
    for fault in damaged.values():
        say(f"damaged: {fault}")
    if recording is None:
        some = ", ".join(list(damaged)[:_SHOWN]) + (" ..." if len(damaged) > _SHOWN else "")
        raise MapError(
            f"{len(damaged)} of {len(info.files)} files of {path} are damaged ({some}); give the recording "
            f"{info.recording.name!r} that it was built from: avlmaps info {path} --repair --recording REC"
        )
    used = encoders_of_map(info)
    if recording.fingerprint != info.recording.fingerprint:
        raise MapError(
            f"{path} was built from another recording than {recording.path}, or that has changed since; give "
            f"{info.recording.name!r} as it was, or build a new map."
        )
    workshop = path / _WORKSHOP
    if make_plan(recording, workshop, used, info.settings).key != info.build_key:
        raise MapError(
            f"{path} was built with another sound track, with other models or by another avlmaps "
            f"({info.avlmaps_version}); build it again in its place ({option('overwrite')})."
        )
    made = build_map(recording, workshop, used, info.settings).info
    with lock_folder(path):
        return _put_back(path, info, made, damaged)


def _put_back(path: Path, info: MapInfo, made: MapInfo, damaged: dict[str, str]) -> Repaired:
    same = all(name in made.files and made.files[name].sha256 == info.files[name].sha256 for name in damaged)
    wanted = {
        name: info.files[name] if same else file for name, file in made.files.items() if not same or name in damaged
    }
    with explain_write_errors(path):
        for name, file in wanted.items():
            _replace(path / _WORKSHOP, made.files[name], path, file)
        sync_files(path, wanted.values())
    if not same:
        write_manifest(path, made)
    whole = info if same else made
    sweep(path, whole)
    remember_checked(path, whole.files.values())
    shutil.rmtree(path / _WORKSHOP, ignore_errors=True)
    open_stored(path, verify=True)
    return Repaired(tuple(damaged), rebuilt=not same)


def _replace(source_folder: Path, source: FileInfo, folder: Path, target: FileInfo) -> None:
    at = folder / target.path
    at.parent.mkdir(parents=True, exist_ok=True)
    if at.is_dir() and not at.is_symlink():
        shutil.rmtree(at)
    (source_folder / source.path).replace(at)


def _manifest(path: Path) -> MapInfo:
    try:
        return parse_manifest(read_manifest(path / MANIFEST), path / MANIFEST)
    except (FileNotFoundError, NotADirectoryError):
        raise MapError(f"{path} is not a finished map (no {MANIFEST}); there is nothing to repair.") from None
