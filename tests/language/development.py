"""The development lists: 1,394 commands with programs that do what they mean, written by several hands.

A command counts as right where its program does the same as one of the list's; it may also be asked about.
"""

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from program_equality import canonical

from avlmaps.core.errors import LanguageError
from avlmaps.language.commands import read_command
from avlmaps.language.program.writing import write_program

LISTS = Path(__file__).parent / "commands"
NAMES = ("commands.tsv", "free.tsv", *(f"paraphrases{n}.jsonl" for n in ("", "_2", "_3", "_4")))


def rows(name: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the commands of a list with the programs that are right."""
    for line in (LISTS / name).read_text(encoding="utf-8").splitlines():
        if name.endswith(".tsv"):
            if line and not line.startswith("#"):
                command, program = line.split("\t")
                yield command.replace("\\n", "\n"), [program.replace(" | ", "\n")]
        else:
            row = json.loads(line)
            yield row["command"], row.get("programs") or [row["program"]]


def counted(commands: Iterable[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """Return commands, each with the programs that are right, by what became of them: right, asked, other."""
    found: dict[str, list[str]] = {"right": [], "asked": [], "other": []}
    for command, programs in commands:
        try:
            read = read_command(command)
        except LanguageError:
            found["asked"].append(command)
            continue
        if read.stops is not None:
            found["asked"].append(command)
            continue
        told = done_by(write_program(read.intents))
        found["right" if any(told == done_by(program) for program in programs) else "other"].append(command)
    return found


def done_by(program: str) -> Any:
    """Return what a program does; waits, who made a sound, and where an instance is looked up make no difference."""
    lines = [line for line in program.splitlines() if "robot.wait" not in line]
    plain = _plain(canonical("\n".join(lines) or "pass"))
    return sorted(re.findall(r"\w+", repr(plain))) if "product" in repr(plain) else plain


def _plain(value: Any) -> Any:
    if isinstance(value, list | tuple):
        if len(value) == 2 and value[0] in ("get_pos", "get_nearest_pos") and isinstance(value[1], tuple):
            return _plain(value[1][1])
        parts = tuple(_plain(part) for part in value)
        if parts[:1] in (("move_to",), ("move_to_object",)) and len(parts) == 2 and isinstance(parts[1], tuple):
            return ("move_to", *parts[1][1:])
        is_map = len(parts) == 2 and parts[0] == "get_major_map" and isinstance(parts[1], tuple)
        return parts[1][1] if is_map and parts[1][0] == "obj" else parts
    if isinstance(value, str):
        return re.sub(r"\b(someone|somebody|the|an?|person) ", "", value.lower())
    return value


if __name__ == "__main__":
    import sys

    for name in NAMES:
        found = counted(rows(name))
        sys.stdout.write(f"{name}: {', '.join(f'{len(commands)} {what}' for what, commands in found.items())}\n")
        for what in ("asked", "other"):
            sys.stdout.writelines(f"  {what}: {command}\n" for command in found[what])
