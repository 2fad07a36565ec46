"""The output of a verb: one JSON object, or lines for a person."""

import errno
import json
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from avlmaps.core.errors import AskError, AvlmapsError, kind_named
from avlmaps.core.printable import printable, printable_json, shortened
from avlmaps.core.wording import place_text


class UsageError(Exception):
    """The words of a command do not fit together; exit status 2. ``help`` is a command that says what fits."""

    def __init__(self, message: str, help: str = "") -> None:
        super().__init__(message)
        self.help = help


class AnsweredError(Exception):
    """A verb failed and its answer, which is printed already, says why; ``status`` is the exit status."""

    def __init__(self, message: str, status: int = 1) -> None:
        super().__init__(message)
        self.status = status


_SHOWN = 200


NO_MEMORY = (
    "there is not enough memory for this; give the process more (ulimit -v, a container's limit), close other programs "
    "or use smaller inputs"
)
# What libraries say in exceptions of their own, where Python has MemoryError.
_MEMORY_WORDS = re.compile(
    "cannot allocate memory|failed to map segment|insufficient memory|out of memory|bad_alloc|failed to allocate"
    "|unable to allocate|can't start new thread|can't allocate",
    re.IGNORECASE,
)


def is_short_of_memory(error: BaseException) -> bool:
    """Return whether an error, or what it came from, is that there was too little memory."""
    seen: set[int] = set()
    cause: BaseException | None = error
    while cause is not None and id(cause) not in seen:
        seen.add(id(cause))
        if isinstance(cause, MemoryError) or getattr(cause, "errno", None) == errno.ENOMEM:
            return True
        if not isinstance(cause, AvlmapsError) and _MEMORY_WORDS.search(str(cause)):
            return True
        cause = cause.__cause__ or cause.__context__
    return False


def system_sentence(error: OSError) -> str:
    """Return the reason of the system's refusal, without its error number."""
    if error.errno == errno.ENOMEM:
        return NO_MEMORY
    if error.errno == errno.EBADF and error.filename is None:
        return "standard output is closed, so that the answer is lost; send it to a file, or to /dev/null"
    if error.filename is None or error.strerror is None:
        return f"{error.strerror or error}; check the files and the space on the disk."
    name = str(error.filename)
    shown = name if len(name) <= _SHOWN else f"{name[: _SHOWN // 2]}...{name[-_SHOWN // 2 :]}"
    return f"{shown}: {error.strerror}; check the path, its permissions and the space on the disk."


def fault_sentence(fault: Exception) -> str:
    """Return the sentence for an error that is none of ours: of the system, of too little memory, or unforeseen."""
    if is_short_of_memory(fault):
        return NO_MEMORY
    if isinstance(fault, OSError):
        return system_sentence(fault)
    return f"{type(fault).__name__}: {fault}; this is a fault of avlmaps, please report it."


def error_answer(kind: str, message: str) -> dict[str, Any]:
    """Return an error as it stands in an answer, under the key ``error``."""
    return {"kind": kind, "message": message}


def kind_of(error: BaseException) -> str:
    """Return the name of a kind of error for scripts: ``recording``, ``goal-not-found``, ``usage`` and so on."""
    if is_short_of_memory(error):
        return "memory"
    if isinstance(error, AskError):
        return "usage"
    return "system" if isinstance(error, OSError) else kind_named(type(error).__name__)


def emit(answer: Mapping[str, Any], lines: Iterable[str], as_json: bool) -> None:
    """Print the answer as one JSON object, or as lines."""
    if as_json:
        sys.stdout.write(json_line(answer, sys.stdout.encoding) + "\n")
    else:
        for line in lines:
            sys.stdout.write(printable(line) + "\n")


def json_line(answer: Mapping[str, Any], encoding: str | None = "utf-8") -> str:
    """Return an answer as one line of JSON that an encoding can hold; what it lacks is escaped as JSON has it."""
    answer = shortened(answer)
    line = printable_json(json.dumps(answer, allow_nan=False, ensure_ascii=False))
    try:
        line.encode(encoding or "utf-8")
    except UnicodeEncodeError:
        return json.dumps(answer, allow_nan=False)
    return line


def table_lines(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Lay out rows under columns, padded with spaces."""
    cells = [[str(column) for column in columns], *[[printable(cell) for cell in row] for row in rows]]
    widths = [max(len(row[i]) for row in cells) for i in range(len(columns))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]


Column = str | Callable[[Mapping[str, Any]], object]
"""What a column shows of a row: the value of a key, or what a function makes of it."""


def table(columns: Mapping[str, Column], rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Lay out the entries of an answer under columns."""
    read = [(lambda row, key=one: row.get(key)) if isinstance(one, str) else one for one in columns.values()]
    return table_lines(tuple(columns), [[_cell(column(row)) for column in read] for row in rows])


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.2f}"
    if isinstance(value, list | tuple):
        return place_text(value)
    return "" if value is None else str(value)


def likely(entries: Iterable[Mapping[str, Any]], name: str = "name") -> str:
    """Lay out names with their probabilities."""
    return ", ".join(f"{one[name]} {one['probability']:.2f}" for one in entries)


def size_text(sides: Sequence[float]) -> str:
    """Lay out a size in metres; "" where there is none."""
    return " x ".join(f"{side:.2f}" for side in sides) if any(sides) else ""


def size_of(count: int) -> str:
    """Write a number of bytes as people read it."""
    size = float(count)
    for unit in ("B", "kB", "MB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} GB"


def ground_lines(ground: Mapping[str, Any]) -> list[str]:
    """Lay out where the floor is: the one that most cameras stood over, the runner-up, and every floor there is."""
    source = {"surfaces": "", "user": ", as given", "recording": ", from the robot's frames"}[ground["known_from"]]
    unseen = "" if ground["in_view"] else ", not in view"
    sure = f"confidence {ground['confidence']:.2f}"
    lines = [f"floor: {ground['camera_height_m']:.2f} m under the camera, {sure}{unseen}{source}"]
    if (second := ground["runner_up"]) is not None:
        lines.append(f"  runner-up: {second['camera_height_m']:.2f} m, confidence {second['confidence']:.2f}")
    if len(ground["floors"]) > 1:
        lines += [
            f"  at height {floor['height_m']:.2f} m: {floor['cameras']:.0%} of the frames looked at, "
            f"confidence {floor['confidence']:.2f}"
            for floor in ground["floors"]
        ]
    return lines


def query_lines(answer: Mapping[str, Any]) -> list[str]:
    """Lay out the answer of `query`."""
    parts = ", ".join(f"{part['modality']} {part['query']!r} ({part['role']})" for part in answer["parts"])
    lines = [f"query: {parts}"] if parts else []
    lines += [f"note: {part['note']}" for part in answer["parts"] if part.get("note")]
    lines += [f"note: {note}" for note in answer.get("notes", [])]
    lines += [f"count: {answer['count']}"] if "count" in answer else []
    lines.append(f"{'found' if answer['found'] else 'not found here'}: {answer['text']}")
    others = answer.get("alternatives", []) if answer["found"] else []
    others = [f"{one['query']} ({one['probability']:.2f})" for one in others if one["found"]]
    lines += [f"or: {', '.join(others)}"] if others else []
    if answer["goals"]:
        named = {"name": "name"} if any("name" in goal for goal in answer["goals"]) else {}
        columns: dict[str, Column] = {
            "": "number", **named, f"place ({answer['frame']} frame)": "position", "probability": "probability",
            "size in m (level axes)": lambda goal: size_text(goal["size"]),
        }  # fmt: skip
        lines += table(columns, [{"number": number, **goal} for number, goal in enumerate(answer["goals"], start=1)])
    return [*lines, f"wrote {answer['plot']}"] if "plot" in answer else lines
