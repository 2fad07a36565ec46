"""The result of a finished build stage, stored in a folder of its own so that a stopped build resumes from there.

Its arrays are one file, written last and in one step: without it the folder does not count. Its note holds the key,
the hash of everything that the stage's outcome depends on, and the facts; one with another key is passed over.
"""

import hashlib
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import decode_json
from avlmaps.maps.store.tables import explain_write_errors, read_arrays, sync_file, write_arrays

DONE = "done.safetensors"
# What a build names the folder of a stage: the stage and twelve digits of its key; clips wait for their stage.
_STAGE = re.compile(r"[a-z_]+-[0-9a-f]{12}|clips|clips\.unfinished")

F = TypeVar("F", bound=msgspec.Struct)


class _Done(msgspec.Struct, kw_only=True):
    key: str
    facts: msgspec.Raw
    files: list[str]


@dataclass(frozen=True, slots=True)
class Checkpoint(Generic[F]):
    """A finished stage, read back.

    Attributes:
        folder: where it lies.
        key: hash of all that it depends on.
        facts: what is not an array.
        arrays: memory-mapped where large.
        files: other files (clips), in the order of their names.
    """

    folder: Path
    key: str
    facts: F
    arrays: dict[str, np.ndarray]
    files: dict[str, Path]


@dataclass(frozen=True, slots=True)
class Computed(Generic[F]):
    """What a stage computed, for its checkpoint.

    Attributes:
        facts: all that is not an array.
        arrays: by name.
        files: other files by name; they are copied.
    """

    facts: F
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    files: Mapping[str, Path] = field(default_factory=dict[str, Path])


def key_of(*ingredients: Any) -> str:
    """Return the hex SHA-256 of numbers, words, dataclasses, structs, and lists and dictionaries of them."""
    return hashlib.sha256(msgspec.json.encode(ingredients, order="deterministic")).hexdigest()


def save_checkpoint(
    folder: Path,
    key: str,
    facts: msgspec.Struct,
    arrays: Mapping[str, np.ndarray],
    files: Mapping[str, Path] | None = None,
) -> None:
    """Write a finished stage; a kill at any instant leaves a checkpoint or none."""
    done = _Done(key=key, facts=msgspec.Raw(msgspec.json.encode(facts)), files=sorted(files or {}))
    with explain_write_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for name, source in (files or {}).items():
            (folder / name).parent.mkdir(exist_ok=True)
            shutil.copyfile(source, folder / name)
            sync_file(folder / name)
        write_arrays(folder / DONE, arrays, msgspec.json.encode(done).decode())


def load_checkpoint(folder: Path, facts: type[F], key: str | None = None) -> Checkpoint[F]:
    """Read a finished stage.

    Args:
        folder: that ``save_checkpoint`` wrote.
        facts: type of its facts.
        key: that it must have; None takes any.

    Raises:
        MapError: it is not finished, damaged, or has another key.
    """
    path = folder / DONE
    if not path.is_file():
        raise MapError(f"{folder} holds no finished part of a map (no readable {DONE}).")
    arrays, note = read_arrays(path)
    try:
        done: _Done = decode_json(note.encode(), _Done)
        said = decode_json(bytes(done.facts), facts)
    except msgspec.DecodeError as fault:
        raise MapError(f"{path} is damaged ({fault}); remove {folder} and build it again.") from fault
    if key is not None and done.key != key:
        raise MapError(f"{folder} was made from another recording, with other settings or with other models.")
    files = {name: folder / name for name in done.files}
    if lost := [path for path in files.values() if not path.is_file()]:
        raise MapError(f"{lost[0]} is missing; remove {folder} and build it again.")
    return Checkpoint(folder, done.key, said, arrays, files)


def find_checkpoint(folder: Path, facts: type[F], key: str) -> Checkpoint[F] | None:
    """Return a finished stage, or None where there is none that can be used; what is left of one is removed."""
    try:
        return load_checkpoint(folder, facts, key)
    except MapError:
        shutil.rmtree(folder, ignore_errors=True)
        return None


def load_or_compute(
    folder: Path,
    key: str,
    facts: type[F],
    compute: Callable[[], Computed[F]],
    usable: Callable[[F], bool] = lambda _: True,
) -> Checkpoint[F]:
    """Return the checkpoint of a stage; compute and store it where there is none.

    A stage is read back even when it was computed a moment ago, so that a resumed build sees the same.

    Args:
        folder: of this stage alone.
        key: see ``key_of``.
        facts: type of its facts.
        compute: runs the stage; what it puts beside its folder it removes itself.
        usable: whether a checkpoint may stand; else it is computed again.
    """
    found = find_checkpoint(folder, facts, key)
    if found is not None and usable(found.facts):
        return found
    done = compute()
    save_checkpoint(folder, key, done.facts, done.arrays, done.files)
    return load_checkpoint(folder, facts, key)


def stage_folders(parts: Path) -> Iterator[Path]:
    """Yield the folders of stages that a build stores below ``parts/``; none where that is a link or is not there."""
    if parts.is_dir() and not parts.is_symlink():
        yield from (entry for entry in parts.iterdir() if _STAGE.fullmatch(entry.name) and entry.is_dir())


def remove_stages(parts: Path) -> None:
    """Remove what a build stored below ``parts/``, and that folder if nothing else is in it."""
    for folder in list(stage_folders(parts)):
        shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        parts.rmdir()
