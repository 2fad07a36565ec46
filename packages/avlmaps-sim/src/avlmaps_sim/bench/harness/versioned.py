"""JSON files with a schema version: tasks, missions, answers."""

from pathlib import Path
from typing import TypeVar

import msgspec

from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.wording import option
from avlmaps_sim.bench.harness.settings import TaskError

T = TypeVar("T")


def save_versioned(tasks: object, path: Path) -> None:
    """Write a dataclass that has a ``schema_version`` as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(path, msgspec.json.format(msgspec.json.encode(tasks), indent=1) + b"\n")


def load_versioned(path: Path, kind: type[T], schema_version: int) -> T:
    """Read what ``save_versioned`` wrote.

    Raises:
        TaskError: there is nothing, it is of another schema, or damaged.
    """
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise TaskError(f"The tasks {path} cannot be read ({fault.strerror}); check the name.") from fault
    try:
        version = msgspec.json.decode(content).get("schema_version")
        if version == schema_version:
            return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, msgspec.ValidationError, AttributeError) as fault:
        raise TaskError(
            f"The tasks {path} are damaged ({fault}); save them again with {option('save-tasks')}."
        ) from fault
    raise TaskError(f"The tasks {path} are of schema {version}, this avlmaps reads {schema_version}; save them again.")
