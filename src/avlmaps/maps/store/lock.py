"""One build at a time in a folder. The system lets go of the lock when a process ends, however it ends."""

import os
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from avlmaps.core.errors import MapError
from avlmaps.maps.store.tables import TO_BUILD, TO_EDIT, explain_write_errors, refuse_links

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
    """Hold one of the folder's locks; the folder is made if it is not there.

    Args:
        folder: the map's.
        name: ``LOCK`` of a build, ``EDITING`` of its edits, which need not wait for a build.

    Raises:
        MapError: another process holds it, the folder cannot be written, or holds a link to another folder.
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
