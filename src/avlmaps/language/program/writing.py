"""From intents to a program in the robot's vocabulary, by the rows of `intents.toml`.

A target that is needed more than once, or in a loop, is looked up once, so that all steps mean the same instance.
"""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from keyword import kwlist
from typing import Any

from avlmaps.language import intents as act
from avlmaps.language.intents import Intent, Pick, Target, TargetKind, blocks_of, targets_of
from avlmaps.language.program.parser import BUILTINS
from avlmaps.language.program.vocabulary import skills
from avlmaps.language.word_classes import table

_RESERVED = frozenset({*map(str.lower, kwlist), *BUILTINS, "robot", "start", "place", "print"})


def write_program(intents: Sequence[Intent]) -> str:
    """Return the program for some intents; none of them is a refusal or a question."""
    heads = dict.fromkeys(act.row_of(intent).head for intent in act.every(intents))
    writer = _Writer(intents)
    writer.block(intents)
    return "\n".join([*filter(None, heads), *writer.lines]) + "\n"


class _Writer(act.Filled):
    def __init__(self, intents: Sequence[Intent]) -> None:
        self.lines: list[str] = []
        self.names: dict[Target, str] = {}  # the variable that holds the place of a target
        self.taken = Counter[str]()
        self.indent = ""
        self.needed = Counter[Target]()
        for intent in act.every(intents):
            said = act.paths_in(act.row_of(intent).program)
            values = act.values_of(intent).items()
            self.needed.update(_targets([intent]))
            self.needed.update(one for name, one in values if isinstance(one, Target) and said.count(name) > 1)
            self.needed.update(_targets(blocks_of(intent)))

    def add(self, line: str) -> None:
        self.lines.append(self.indent + line)

    def variable(self, stem: str) -> str:
        plain = "".join(mark if mark.isascii() and mark.isalnum() else "_" for mark in stem.lower()).strip("_")
        is_free = plain[:1].isalpha() and plain not in _RESERVED and plain not in skills()
        plain = plain if is_free else f"place_{plain}".rstrip("_")
        self.taken[plain] += 1
        return plain if self.taken[plain] == 1 else f"{plain}{self.taken[plain]}"

    def block(self, intents: Sequence[Intent]) -> None:
        for intent in intents:
            program, values = act.row_of(intent).program, act.values_of(intent)
            if program.startswith("for"):
                visited = {one.of for one in act.every(blocks_of(intent)) if isinstance(one, act.VisitEach)}
                for target in _targets(blocks_of(intent)):
                    if target not in visited:
                        self.value(target)
            for line in program.splitlines():
                inner = values.get(line.strip(" {}"))
                if inner is None:
                    self.add(self.vformat(line, (), values))
                else:
                    named = dict(self.names)
                    self.indent += "    "
                    self.block(inner)
                    self.indent = self.indent[:-4]
                    if program.startswith("if"):  # what is looked up in a block that may not run has no name behind it
                        self.names = named

    def get_value(self, key: int | str, args: Sequence[Any], kwargs: Any) -> Any:
        if key not in kwargs:
            kwargs[key] = self.variable(str(key))
        return kwargs[key]

    def format_field(self, value: Any, format_spec: str) -> str:
        if not isinstance(value, Target):
            return super().format_field(value, format_spec)
        if format_spec == "any" and value.pick is Pick.NEAREST:
            value = replace(value, pick=Pick.ANY)
        forms = {"go": self.way, "place": self.bound, "all": self.query}
        return forms.get(format_spec, self.value)(value)

    def way(self, target: Target) -> str:
        value = self.value(target)
        if target.kind is TargetKind.OBJECT and not target.near:
            return f"robot.move_to_object({value})"
        return f"robot.move_to({value if target in self.names else f'robot.get_max_pos_3d({value})'})"

    def bound(self, target: Target) -> str:
        """Return the variable that holds the place of a target, written where it is first needed."""
        if target not in self.names:
            query = self.query(target)
            name = self.variable(target.name.split()[-1] if not target.is_file else "place")
            number = 2 if target.pick is Pick.OTHER else target.number
            if target.pick is Pick.ANY:
                one = "get_pos" if target.kind is TargetKind.OBJECT else "get_max_pos_3d"
            elif target.pick is Pick.NEAREST and number == 1:
                one = "get_nearest_pos"
            else:
                one = "get_nth_pos"
                query += f", {number}" if target.pick in (Pick.OTHER, Pick.NEAREST) else f', {number}, "{target.pick}"'
            self.add(f"{name} = robot.{one}({query})")
            self.names[target] = name
        return self.names[target]

    def value(self, target: Target) -> str:
        """Return a skill's argument for a target: a phrase, a heatmap's best place, or its variable."""
        if target.kind is TargetKind.HERE:
            return "robot.current_pos()"
        if target in self.names or self.needed[target] > 1 or target.pick is not Pick.ANY:
            return self.bound(target)
        return self.query(target)

    def query(self, target: Target) -> str:
        if target.kind is TargetKind.OBJECT and not target.near:
            return _quoted(target.name)
        factors = [
            f"robot.get_major_map({_argument(target)})",
            *(f"robot.get_map({_argument(n)})" for n in target.near),
        ]
        if len(factors) == 1:
            return factors[0]
        self.taken["heat"] += 1
        heat = f"heat{self.taken['heat']}"
        self.add(f"{heat} = {' * '.join(factors)}")
        return heat


def _targets(intents: Sequence[Intent]) -> Iterator[Target]:
    return (target for intent in intents for target in targets_of(intent) if target.kind is not TargetKind.HERE)


_quoted = partial(json.dumps, ensure_ascii=False)


def _argument(target: Target) -> str:
    if target.kind is TargetKind.HERE:
        raise ValueError("a program cannot look up where the robot stands")
    at = "" if target.at is None else f', at="{target.at}"'
    return table("intents")["names"]["arguments"][target.kind].format(_quoted(target.name)) + at
