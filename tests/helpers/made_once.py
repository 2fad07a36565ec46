"""Recordings and maps that one worker of a test run makes, and of which each of the others takes a copy."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return a folder of the caller's own with what ``make`` wrote into an empty one, once in a run of the tests."""
    base = factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "made-once"
    shared.mkdir(exist_ok=True)
    made, begun = shared / name, shared / f"{name}-begun"
    with locked(shared / f"{name}.lock"):
        if not made.exists():
            shutil.rmtree(begun, ignore_errors=True)
            begun.mkdir()
            make(begun)
            begun.rename(made)
    own = factory.mktemp(name) / name
    shutil.copytree(made, own)
    return own


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock against the other workers while the block runs; the system lets go of it where one is killed."""
    with path.open("a") as file:
        try:
            import fcntl
        except ImportError:
            import msvcrt  # Windows

            msvcrt.locking(file.fileno(), msvcrt.LK_LOCK, 1)  # pyright: ignore
        else:
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
