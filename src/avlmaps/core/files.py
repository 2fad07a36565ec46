"""Writing files so that a kill at any instant leaves the old or the new one, and reading files with suspicion.

Every file that a user gives is opened by ``open_regular``: a pipe, a device, a socket or a file of 20 GB where a
picture belongs is refused before a byte is read. Refusals are ``OSError``; readers put them into their own sentences.
"""

import errno
import hashlib
import os
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from threading import get_native_id
from typing import Any, BinaryIO, TypeVar

import msgspec

T = TypeVar("T")

MB = 1_000_000
GB = 1000 * MB
_BLOCK_BYTES = 4096
_MOST_BLOCKS = 1024
# Most bytes of a file by what it holds; larger ones are mistakes or attacks.
DESCRIPTION_BYTES = 16 * MB  # JSON and matrices
MANIFEST_BYTES = 256 * MB  # map.json of a million frames
PICTURE_BYTES = 256 * MB
TABLE_BYTES = 2 * GB  # poses and lists, read line by line
SOUND_BYTES = 32 * GB  # sound and video, read in pieces
SAMPLED_BYTES = 1 << 62  # a bag may be of any size
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def state_file(name: str) -> Path:
    """Return a file of avlmaps in the user's state folder (XDG)."""
    named = Path(os.environ.get("XDG_STATE_HOME", ""))
    return (named if named.is_absolute() else Path.home() / ".local" / "state") / "avlmaps" / name


def user_path(path: Path | str) -> Path:
    """Return a path that a user gave, its ``~`` the home as in a shell; where there is no such home it stays a name."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def lasting_path(path: Path | str) -> Path:
    """Return a path that a user gave as one that names the same place when the program changes its folder later."""
    try:
        return user_path(path).absolute()
    except OSError:  # the folder that it is in is gone
        return user_path(path)


class RefusedFileError(OSError):
    """A file that is not read: it is not a regular file, or larger than its kind may be; ``strerror`` says why."""

    def __init__(self, path: Path | str, why: str, code: int = errno.EINVAL) -> None:
        super().__init__(code, why, str(path))


def open_regular(path: Path | str, limit_bytes: int) -> BinaryIO:
    """Open a regular file of at most ``limit_bytes`` for reading; a link to one will do.

    Raises:
        FileNotFoundError: there is nothing there, not even a link.
        OSError: it is a dangling link, no regular file, too large or cannot be opened; ``strerror`` says why in words.
    """
    checked_size(path, limit_bytes)
    # Never waits for a writer, should the file become a pipe between the look and the opening.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        _refuse(path, os.fstat(descriptor), limit_bytes)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def checked_size(path: Path | str, limit_bytes: int) -> int:
    """Return the size of a regular file; errors as of ``open_regular``. For readers that open files themselves."""
    try:
        found = os.stat(path)  # noqa: PTH116
    except FileNotFoundError:
        if os.path.islink(path):  # noqa: PTH114
            raise RefusedFileError(path, "it is a link to a file that does not exist", errno.ENOLINK) from None
        raise
    except ValueError:  # a NUL in the name
        raise RefusedFileError(path, "its name holds a zero byte") from None
    _refuse(path, found, limit_bytes)
    return found.st_size


def _refuse(path: Path | str, found: os.stat_result, limit_bytes: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        what = next((words for test, words in _KINDS if test(found.st_mode)), "no file")
        raise RefusedFileError(path, f"it is {what}, not a regular file")
    if found.st_size > limit_bytes:
        raise RefusedFileError(
            path, f"it has {found.st_size:,} bytes, more than the {limit_bytes:,} of the largest such file", errno.EFBIG
        )


def read_regular(path: Path | str, limit_bytes: int) -> bytes:
    """Return the content of a regular file of limited size; errors as of ``open_regular``."""
    with open_regular(path, limit_bytes) as stream:
        return stream.read(os.fstat(stream.fileno()).st_size)


def decode_json(content: bytes, type: type[T] | Any = Any) -> Any:
    """Decode JSON to a type; nested too deeply, not JSON or not of the type: ``msgspec.DecodeError``.

    Bytes that are not UTF-8 are a ``UnicodeDecodeError``.
    """
    try:
        return msgspec.json.decode(content, type=type)
    except RecursionError:
        raise msgspec.DecodeError("it is nested too deeply") from None


def sampled_digest(path: Path | str, budget_bytes: int) -> bytes:
    """Return a SHA-256 over a file's size and content: all of it, or evenly spread blocks, ``budget_bytes`` (4096 on).

    The last block reaches to the end of the file, where a PNG has the checksum of all its pixels. A file that is
    missing or refused has a digest of its own.
    """
    try:
        with open_regular(path, SAMPLED_BYTES) as stream:
            size = os.fstat(stream.fileno()).st_size
            digest = hashlib.sha256(size.to_bytes(8, "little"))
            if size <= budget_bytes:
                while chunk := stream.read(1 << 20):
                    digest.update(chunk)
                return digest.digest()
            blocks = min(_MOST_BLOCKS, max(2, budget_bytes // _BLOCK_BYTES))
            length = max(1, budget_bytes // blocks)
            for number in range(blocks):
                stream.seek((size - length) * number // (blocks - 1))
                digest.update(stream.read(length))
            return digest.digest()
    except OSError as fault:
        return f"unreadable {fault.errno}".encode()


@contextmanager
def replacing(path: Path) -> Generator[Path]:
    """Yield the name of a new file beside one, for a library that writes by name; what it wrote then takes its place.

    The new name is of this thread alone and has the same suffix. Nothing is left of it where writing fails. The folder
    is synced, so that the name survives a power cut; the content is the writer's to sync.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}-{get_native_id()}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
        sync_folder(path.parent)
    except OSError as fault:
        if fault.filename is None:  # of a full disk
            fault.filename = str(path)
        raise
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def replace_atomically(path: Path) -> Generator[BinaryIO]:
    """Open a new file that takes the place of ``path`` on success, its content and its name synced."""
    with replacing(path) as part, open_new(part) as stream:
        yield stream
        stream.flush()
        os.fsync(stream.fileno())


def open_new(path: Path) -> BinaryIO:
    """Make a file and open it for writing; what has its name goes, a link without what it points to."""
    path.unlink(missing_ok=True)
    return path.open("xb")


def linked_folder(folder: Path) -> Path | None:
    """Return the first symbolic link to a folder that lies somewhere below a folder, None where there is none.

    What is written or removed below such a link would be someone else's. To be called before a folder of ours is
    written. A link to a file does no harm: files are replaced by new ones, never opened for writing.
    """
    if not folder.is_dir():
        return None
    for at, folders, _ in os.walk(folder):
        for name in folders:
            if (found := Path(at, name)).is_symlink():
                return found
    return None


def write_bytes_atomically(path: Path, content: bytes) -> None:
    """Write a whole small file so that readers see the old or the new content, never a mixture."""
    with replace_atomically(path) as stream:
        stream.write(content)


def sync_folder(folder: Path) -> None:
    """Ask the system to put a folder's names on the disk; systems that cannot sync a folder are left alone."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:  # pragma: no cover - Windows
        return
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sha256_of_file(path: Path, chunk_bytes: int = 1 << 20) -> str:
    """Return the hex SHA-256 of a file, read in chunks."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(chunk_bytes):
            digest.update(chunk)
    return digest.hexdigest()
