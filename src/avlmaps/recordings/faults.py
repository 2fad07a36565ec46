"""Faults of a recording and their reports: opening stops at the first fault, the validator lists them all."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from avlmaps.core.errors import RecordingError


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing wrong with a recording.

    Attributes:
        sentence: what, where and what to do; it names the file and the line.
        file: the file, where there is one.
        line: the line in it, counted from 1.
        fatal: whether the recording cannot be opened because of it.
    """

    sentence: str
    file: Path | None = None
    line: int | None = None
    fatal: bool = True

    def __str__(self) -> str:
        return self.sentence


Report = Callable[[Fault], None]


def stop_at_first(fault: Fault) -> None:
    """Refuse to continue where a fault is fatal; pass over any other.

    Raises:
        RecordingError: the fault is fatal.
    """
    if fault.fatal:
        raise RecordingError(fault.sentence)


@contextmanager
def readable(path: Path, missing: str = "") -> Generator[None]:
    """Say why a file cannot be read that is read within.

    Args:
        path: the file.
        missing: what is to be done where there is none, the end of a sentence.

    Raises:
        RecordingError: it is missing or cannot be read.
    """
    try:
        yield
    except OSError as error:
        if missing and isinstance(error, FileNotFoundError):
            raise RecordingError(f"{path} is missing; {missing}.") from None
        raise RecordingError(f"{path} cannot be read ({error.strerror or error}); check the file.") from None
