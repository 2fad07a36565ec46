"""Faults of a recording and their reports: opening stops at the first fault, the validator lists them all."""

from collections.abc import Generator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from avlmaps.core.errors import RecordingError
from avlmaps.core.wording import option

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing wrong with a recording: a sentence with file and line (from 1); a fatal one forbids to open it."""

    sentence: str
    file: Path | None = None
    line: int | None = None
    fatal: bool = True

    def __str__(self) -> str:
        return self.sentence


_listed: ContextVar[list[Fault] | None] = ContextVar("_listed", default=None)


def report(sentence: str, file: Path | None = None, line: int | None = None, *, fatal: bool = True) -> None:
    """Add a fault to the list of ``listed``; without one, raise RecordingError if it is fatal, else pass over it."""
    found = _listed.get()
    if found is not None:
        found.append(Fault(sentence, file, line, fatal))
    elif fatal:
        raise RecordingError(sentence)


_noted: ContextVar[list[str] | None] = ContextVar("_noted", default=None)


def note(*sentences: str) -> None:
    """Add sentences to the notices of the recording that is being opened."""
    if (found := _noted.get()) is not None:
        found += sentences


_unfit: ContextVar[list[str] | None] = ContextVar("_unfit", default=None)


def misfit(sentence: str, of: str = "these pictures") -> None:
    """Refuse pictures that the files' intrinsics do not fit; within ``unfit`` whoever opens decides."""
    numbers = " ".join(["FX,FY,CX,CY"] * (2 if of.startswith("both") else 1))
    sentence += f" Give the intrinsics of {of} ({option('intrinsics', numbers)})."
    if (found := _unfit.get()) is None:
        raise RecordingError(sentence)
    found.append(sentence)


@contextmanager
def _gathered(where: ContextVar[list[T] | None]) -> Generator[list[T]]:
    found: list[T] = []
    token = where.set(found)
    try:
        yield found
    finally:
        where.reset(token)


def noted() -> AbstractContextManager[list[str]]:
    """Gather what is noted within."""
    return _gathered(_noted)


def unfit() -> AbstractContextManager[list[str]]:
    """Gather what is said of intrinsics that pictures do not fit; the cameras are stretched to these meanwhile."""
    return _gathered(_unfit)


def listed() -> AbstractContextManager[list[Fault]]:
    """List every fault that is reported within, in place of stopping at the first."""
    return _gathered(_listed)


@contextmanager
def readable(path: Path, missing: str = "") -> Generator[None]:
    """Raise RecordingError where a file cannot be read within; ``missing`` says what to do where there is none."""
    try:
        yield
    except OSError as error:
        if missing and isinstance(error, FileNotFoundError):
            raise RecordingError(f"{path} is missing; {missing}.") from None
        raise RecordingError(f"{path} cannot be read ({error.strerror or error}); check the file.") from None
