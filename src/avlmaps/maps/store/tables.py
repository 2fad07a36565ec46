"""Files of arrays: safetensors, read by memory-mapping, written so that a kill leaves the old file or the new one."""

import dataclasses
import errno
import hashlib
import mmap
import os
import re
import sys
import time
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from avlmaps.core.columns import axes_of, ragged
from avlmaps.core.errors import MapError
from avlmaps.core.files import checked_size, linked_folder, open_new, open_regular, replacing, sha256_of_file

SUFFIX = ".safetensors"
TO_BUILD = "choose another folder. What was finished there stays, and a second try continues from it."
TO_EDIT = "edit a copy that lies where you may write; the map is as it was."
RESTORE = "restore it from a copy, or build the map again in its place"
MOST_BYTES = 1 << 42
SMALL_BYTES = 1 << 20  # arrays up to this size are read, larger ones are memory-mapped
_NOTE = "avlmaps"
_TYPES = {
    "BOOL": np.bool_, "U8": np.uint8, "U16": np.uint16, "U32": np.uint32, "U64": np.uint64, "I8": np.int8,
    "I16": np.int16, "I32": np.int32, "I64": np.int64, "F16": np.float16, "F32": np.float32, "F64": np.float64,
}  # fmt: skip

T = TypeVar("T")


class FileInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Size and hex SHA-256 of a file."""

    bytes: int
    sha256: str

    @classmethod
    def of(cls, path: Path) -> "FileInfo":
        """Return those of a file."""
        return cls(bytes=path.stat().st_size, sha256=sha256_of_file(path))


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


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray], note: str = "") -> None:
    """Write arrays, and a note, as one file; its folder must be there."""
    from safetensors import SafetensorError
    from safetensors.numpy import save_file  # pyright: ignore[reportUnknownVariableType]

    whole = {name: np.ascontiguousarray(array).reshape(array.shape) for name, array in arrays.items()}
    with replacing(path) as part:
        open_new(part).close()  # not through a link; and with the mode of other files, which the package's lack
        mode = part.stat().st_mode
        try:
            save_file(whole, part, {_NOTE: note} if note else None)
        except SafetensorError as fault:
            code = re.search(r"os error (\d+)", str(fault))
            number = int(code[1]) if code else errno.EIO
            raise OSError(number, os.strerror(number), str(path)) from fault
        part.chmod(mode)
        sync_file(part)


def read_arrays(path: Path) -> tuple[dict[str, np.ndarray], str]:
    """Return the arrays of a file by name, the large ones memory-mapped, and its note."""
    from safetensors import SafetensorError, safe_open

    try:
        checked_size(path, MOST_BYTES)
        opening: Any = safe_open(path, "np")  # holds the header against the file's size
        with opening as file:
            metadata: dict[str, str] = file.metadata() or {}
        with open_regular(path, MOST_BYTES) as stream:
            header = int.from_bytes(stream.read(8), "little")
            entries: dict[str, Any] = msgspec.json.decode(stream.read(header))
            content = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    except FileNotFoundError:  # safetensors says so of what may not be read, too
        what = "may not be read; give yourself the right to, or" if path.exists() else "is missing;"
        raise MapError(f"{path} {what} {RESTORE}.") from None
    except (SafetensorError, msgspec.DecodeError, ValueError) as fault:
        raise MapError(f"{path} is damaged ({fault}); {RESTORE}.") from fault
    except OSError as fault:
        raise MapError(f"{path} cannot be read ({fault.strerror or fault}); check the drive.") from fault
    entries.pop("__metadata__", None)
    return {name: _array(content, 8 + header, entry) for name, entry in entries.items()}, metadata.get(_NOTE, "")


def _array(content: mmap.mmap, begin: int, entry: Mapping[str, Any]) -> np.ndarray:
    kind, shape, at = np.dtype(_TYPES[entry["dtype"]]), tuple(entry["shape"]), begin + entry["data_offsets"][0]
    count = prod(shape)
    if not count:
        return np.zeros(shape, kind)
    array = np.frombuffer(content, kind, count, at).reshape(shape)
    return array.copy() if array.nbytes <= SMALL_BYTES else array


def key_of(*ingredients: Any) -> str:
    """Return the hex SHA-256 of numbers, words, dataclasses, structs, and lists and dictionaries of them."""
    return hashlib.sha256(msgspec.json.encode(ingredients, order="deterministic")).hexdigest()


def sync_file(path: Path) -> None:
    """Put a written file on the disk."""
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)  # Windows syncs what can be written
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def fields_of(whole: object, prefix: str = "") -> dict[str, np.ndarray]:
    """Return the arrays of a dataclass by name."""
    return {prefix + name: np.asarray(getattr(whole, name)) for name in axes_of(type(whole))}


def as_kind(kind: type[T], arrays: Mapping[str, np.ndarray], where: Path, prefix: str = "", **others: Any) -> T:
    """Return the dataclass of these arrays; one that has a default may be missing."""
    of: Any = kind
    fields: dict[str, Any] = {field.name: field for field in dataclasses.fields(of)}
    found, sizes = dict[str, np.ndarray](), dict[str, int]()
    for name in axes_of(kind):
        array, declared = arrays.get(prefix + name), fields[name].type
        if array is None and callable(fields[name].default_factory):
            continue
        axes = declared.dim_str.split()
        fits = array is not None and array.dtype.name in declared.dtypes and array.ndim == len(axes)
        if array is None or not fits or not _fits(axes, array.shape, sizes):
            what = "is missing" if array is None else f"is {array.dtype} of {array.shape}"
            raise MapError(f"{where} is damaged: {prefix}{name} {what}, not {declared.dim_str.strip()}; {RESTORE}.")
        found[name] = array
    whole: Any = kind(**found, **others)
    for offsets, rows in ragged(kind):
        ends: np.ndarray = getattr(whole, offsets)
        if not len(ends) or ends[0] != 0 or ends[-1] != len(getattr(whole, rows)):
            raise MapError(f"{where} is damaged: {prefix}{offsets} does not divide {rows}; {RESTORE}.")
    return whole


def _fits(axes: list[str], shape: tuple[int, ...], sizes: dict[str, int]) -> bool:
    for axis, size in zip(axes, shape, strict=True):
        if axis.endswith("_or_0"):
            if size and size != sizes.setdefault(axis.removesuffix("_or_0"), size):
                return False
        elif axis.endswith("1") and len(axis) == 2:
            if size != sizes.setdefault(axis[0], size - 1) + 1:
                return False
        elif size != (int(axis) if axis.isdigit() else sizes.setdefault(axis, size)):
            return False
    return True


LOCK = ".lock"
EDITING = ".edits.lock"
_PATIENCE_S = {LOCK: 0.06, EDITING: 5.0}  # an edit takes milliseconds, and several come at once
_BUSY = {
    LOCK: "is being built by {} at this moment; {}, or build into another folder.",
    EDITING: "is being edited by {} at this moment; try again.",
}
_UNWRITTEN = {LOCK: TO_BUILD, EDITING: TO_EDIT}

if sys.platform == "win32":  # pragma: no cover - tried on Windows only
    import msvcrt

    def _grab(descriptor: int) -> None:
        os.lseek(descriptor, 1 << 20, os.SEEK_SET)  # beyond the text, which others may then still read
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _grab(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _grab_patiently(descriptor: int, patience_s: float) -> None:
    for _ in range(round(patience_s / 0.02)):
        try:
            return _grab(descriptor)
        except OSError:
            time.sleep(0.02)
    return _grab(descriptor)


@contextmanager
def lock_folder(folder: Path, name: str = LOCK) -> Generator[None]:
    """Hold a folder's ``LOCK``, of a build, or ``EDITING``, of its edits, which need not wait for a build.

    The folder is made if it is not there.
    """
    refuse_links(folder)
    with explain_write_errors(folder, _UNWRITTEN[name]):
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / name).is_symlink():  # it would be emptied
            (folder / name).unlink()
        descriptor = os.open(folder / name, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
    try:
        try:
            _grab_patiently(descriptor, _PATIENCE_S[name])
        except OSError as fault:
            holder = os.pread(descriptor, 32, 0).decode("ascii", "replace").strip() if hasattr(os, "pread") else ""
            own = holder == str(os.getpid())
            who = "this program" if own else f"another process ({holder})" if holder else "another process"
            wait = "end that first" if own else "wait for it"
            raise MapError(f"{folder} {_BUSY[name].format(who, wait)}") from fault
        with explain_write_errors(folder, _UNWRITTEN[name]):
            os.ftruncate(descriptor, 0)
            os.write(descriptor, f"{os.getpid()}\n".encode())
        yield
    finally:
        os.close(descriptor)


def is_locked(folder: Path) -> bool:
    """Return whether a build is running in the folder at this moment."""
    try:
        descriptor = os.open(folder / LOCK, os.O_RDWR)
    except OSError:
        return False
    try:
        _grab(descriptor)
    except OSError:
        return True
    finally:
        os.close(descriptor)
    return False
