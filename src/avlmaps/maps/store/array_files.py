"""Immutable array files, named by their content: what maps, parts and checkpoints are made of.

A file is written under a temporary name and renamed to ``<name>-<sha256>.npy``. A name therefore never stands for two
contents, an old manifest's files are never touched by a new build, and the same build gives the same names. All files
are put on the disk together, before the manifest that lists them is written: one by one takes four times as long.
"""

import errno
import hashlib
import io
import itertools
import os
import re
from collections.abc import Generator, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import BinaryIO

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import checked_size, linked_folder, open_new, sha256_of_file, sync_folder
from avlmaps.core.npy import load_npy

SMALL_BYTES = 1 << 20  # files up to this size are read whole and always compared with their checksum
MOST_BYTES = 1 << 42
TO_BUILD = "choose another folder. What was finished there stays, and a second try continues from it."
TO_EDIT = "edit a copy that lies where you may write; the map is as it was."
_QUOTED = 200  # characters of what a damaged manifest says
_CHUNK_BYTES = 1 << 24
_SYNCED_AT_ONCE = 8
# Only files that are named so are ever removed: a name, sixteen digits of its checksum, its suffix. People have folders
# called ``sounds`` of their own, and choose the folder above them for a map.
_STORED = re.compile(r"[A-Za-z0-9_]+-[0-9a-f]{16}(\.[^./]+)?|\..+\.\d+\.partial")
MEND = "repair it with `avlmaps info MAP --repair --recording REC`, or restore it from a copy"


class FileInfo(msgspec.Struct, frozen=True, kw_only=True):
    """One file of a manifest.

    Attributes:
        path: below the manifest's folder, with ``/``.
        bytes: its size.
        sha256: hex checksum of the whole file.
        dtype: numpy's name of the elements' type, little-endian (``<f2``); ``""`` for a file that is not an array.
        shape: of the array.
    """

    path: str
    bytes: int
    sha256: str
    dtype: str = ""
    shape: tuple[int, ...] = ()


@contextmanager
def explain_write_errors(folder: Path, then: str = TO_BUILD) -> Generator[None]:
    """Turn a full disk, a missing permission and their like into one sentence, which ends with what to do then."""
    try:
        yield
    except OSError as fault:
        place = Path(fault.filename or folder)
        why = fault.strerror or fault
        if fault.errno == errno.EEXIST and place.is_symlink():
            why = "it is a symbolic link that leads nowhere"
        make_room = "make room or " if fault.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) else ""
        raise MapError(f"Cannot write {place}: {why}; {make_room}{then}") from fault


def refuse_links(folder: Path) -> None:
    """Raise ``MapError`` where a symbolic link inside a map's folder leads to another: nothing is written there."""
    if (link := linked_folder(folder)) is not None:
        raise MapError(
            f"{link} is a symbolic link to a folder; avlmaps neither writes nor removes anything behind a link: remove "
            "it, or give the folder a place of its own. A map's folder itself may be a link."
        )


def write_array(folder: Path, name: str, array: np.ndarray) -> FileInfo:
    """Write an array as ``<folder>/<name>-<checksum>.npy`` and return its entry for the manifest.

    Args:
        folder: the manifest's folder.
        name: such as ``voxels/feature``; its folder is made.
        array: any numeric array, memory-mapped or not; it is never copied whole unless it is not contiguous.
    """
    array = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).reshape(array.shape)
    if array.dtype.hasobject:
        raise ValueError(f"{name} holds Python objects; only numbers can be stored")
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(array))
    flat = array.reshape(-1).view(np.uint8)
    body = (flat[start : start + _CHUNK_BYTES].data for start in range(0, flat.size, _CHUNK_BYTES))
    path, size, checksum = _write(folder, name, ".npy", itertools.chain([header.getvalue()], body))
    return FileInfo(path=path, bytes=size, sha256=checksum, dtype=array.dtype.str, shape=array.shape)


def write_copy(folder: Path, name: str, source: Path) -> FileInfo:
    """Copy a file to ``<folder>/<name>-<checksum><its suffix>`` and return its entry for the manifest."""
    with source.open("rb") as stream:
        path, size, checksum = _write(folder, name, source.suffix, iter(lambda: stream.read(_CHUNK_BYTES), b""))
    return FileInfo(path=path, bytes=size, sha256=checksum)


def _write(folder: Path, name: str, suffix: str, chunks: Iterable[bytes | memoryview]) -> tuple[str, int, str]:
    stem = folder / name
    with explain_write_errors(folder):
        stem.parent.mkdir(parents=True, exist_ok=True)
        partial = stem.with_name(f".{stem.name}.{os.getpid()}.partial")
        try:
            with open_new(partial) as stream:
                size, checksum = _hashed(stream, chunks)
                final = stem.with_name(f"{stem.name}-{checksum[:16]}{suffix}")
                if final.exists():  # of another manifest, whose file a power cut must not take
                    os.fsync(stream.fileno())
            partial.replace(final)
        finally:
            partial.unlink(missing_ok=True)
    return final.relative_to(folder).as_posix(), size, checksum


def sync_files(folder: Path, files: Iterable[FileInfo]) -> None:
    """Put written files and their names on the disk; to be called before the manifest that lists them is written.

    Raises:
        MapError: the disk is full.
    """
    paths = [folder / file.path for file in files]
    folders = {above for path in paths for above in (path.parent, path.parent.parent)}
    with explain_write_errors(folder), ThreadPoolExecutor(_SYNCED_AT_ONCE) as pool:
        list(itertools.chain(pool.map(_sync, paths), pool.map(sync_folder, folders)))


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)  # Windows syncs what can be written
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _hashed(stream: BinaryIO, chunks: Iterable[bytes | memoryview]) -> tuple[int, str]:
    digest, size = hashlib.sha256(), 0
    for chunk in chunks:
        digest.update(chunk)
        size += stream.write(chunk)
    stream.flush()
    return size, digest.hexdigest()


def read_array(folder: Path, info: FileInfo, *, verify: bool = False) -> np.ndarray:
    """Return an array of a manifest: small ones read and compared with their checksum, large ones memory-mapped.

    Raises:
        MapError: the file is missing, truncated, changed, or not the array that the manifest describes.
    """
    path = verify_file(folder, info, verify=verify)
    try:
        array = load_npy(path, info.bytes, mapped=info.bytes > SMALL_BYTES)
    except PermissionError as fault:
        raise MapError(f"{path} cannot be read ({fault.strerror}); check its permissions.") from fault
    except OSError as fault:  # of the system or the drive: the file may be as it was written
        raise MapError(f"{path} cannot be read ({fault.strerror or fault}); check the drive and the memory.") from fault
    except ValueError as fault:
        raise MapError(f"{path} is damaged: it is not an array that numpy can read ({fault}); {MEND}.") from fault
    if array.dtype.str != info.dtype or array.shape != info.shape:
        raise MapError(
            f"{path} is damaged: it holds {array.dtype} of {array.shape}, the map says {_type_name(info.dtype)} of "
            f"{info.shape}; {MEND}."
        )
    if not array.flags.c_contiguous:
        raise MapError(f"{path} is damaged: its elements are not in the order that avlmaps writes; {MEND}.")
    return array


def _type_name(said: str) -> str:
    """Return numpy's name of a type; what a damaged manifest says, as it stands there."""
    try:
        return str(np.dtype(said))
    except (TypeError, ValueError, SyntaxError):
        return said[:_QUOTED]


def verify_file(folder: Path, info: FileInfo, *, verify: bool = False) -> Path:
    """Return where a file is, its size checked, and its checksum if it is small or ``verify`` is set.

    Raises:
        MapError: it is missing, has another size or content, or its name leads out of the folder.
    """
    parts = PurePosixPath(info.path).parts
    if not parts or ".." in parts or "\\" in info.path or ":" in info.path or info.path.startswith("/"):
        raise MapError(
            f"{folder} names a file outside itself ({info.path[:_QUOTED]}); do not use a map from that source."
        )
    path = folder.joinpath(*parts)
    try:
        size = checked_size(path, MOST_BYTES)
    except FileNotFoundError:
        raise MapError(f"{path} is missing from the map; {MEND}.") from None
    except OSError as fault:
        raise MapError(f"{path} cannot be read ({fault.strerror or fault}); {MEND}.") from fault
    if size != info.bytes:
        raise MapError(f"{path} is damaged: it has {size} bytes, {info.bytes} were written; {MEND}.")
    if (verify or size <= SMALL_BYTES) and sha256_of_file(path) != info.sha256:
        raise MapError(f"{path} is damaged: its checksum is not the one that was written; {MEND}.")
    return path


def is_stored_file(path: Path) -> bool:
    """Return whether a file of a section has a name that avlmaps gives."""
    return _STORED.fullmatch(path.name) is not None and path.is_file()
