"""The trace of a program: each skill that it called, its result, and how the program ended."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Step:
    """One call of a skill.

    Attributes:
        skill: its name.
        arguments: what each parameter was given, as JSON has it: text, numbers, {"place": [x, y, z]} in metres,
            {"heat": the calls that made it}, {"picture": file} and {"clip": file}.
        result: what it returned, shown in the same way; None where it failed.
        line: of the program, from 1.
        elapsed_s: how long it took.
        error: why it failed, in one sentence; None where it did not.
    """

    skill: str
    arguments: Mapping[str, Any]
    result: Any
    line: int
    elapsed_s: float
    error: str | None = None

    @property
    def text(self) -> str:
        """The call as a person reads it."""
        return f"{self.skill}({', '.join(f'{name}={told(given)}' for name, given in self.arguments.items())})"

    def to_json(self) -> dict[str, Any]:
        """Return the step as JSON has it."""
        return asdict(self) | {"elapsed_s": round(self.elapsed_s, 3)}


@dataclass(frozen=True, slots=True)
class Trace:
    """The trace of one run of a program.

    Attributes:
        steps: the skills that it called, in their order, a failed one last.
        error: why it stopped early, in one sentence that names the line; None where it ran to its end.
        error_type: the class of that error, such as "GoalNotFoundError" or "ProgramError".
        elapsed_s: how long the run took.
    """

    steps: tuple[Step, ...]
    error: str | None
    error_type: str | None
    elapsed_s: float

    @property
    def ok(self) -> bool:
        """Whether the program ran to its end."""
        return self.error is None

    def to_json(self) -> dict[str, Any]:
        """Return the trace as JSON has it."""
        return {
            "ok": self.ok,
            "error": self.error,
            "error_type": self.error_type,
            "steps": [step.to_json() for step in self.steps],
            "elapsed_s": round(self.elapsed_s, 3),
        }

    def lines(self) -> list[str]:
        """Return the trace as lines for people: every call, what it returned, and the error at the end."""
        lines = []
        for step in self.steps:
            is_heat = isinstance(step.result, dict) and "heat" in step.result
            came = "" if step.result is None else " -> a Heat" if is_heat else f" -> {told(step.result)}"
            lines.append(f"line {step.line}: {step.text}{came}" + (" failed" if step.error else ""))
        return lines + ([self.error] if self.error else [])


def told(content: Any) -> str:
    """Return a value of a trace as a person reads it."""
    match content:
        case {"place": coordinates}:
            return f"({', '.join(f'{value:.2f}' for value in coordinates)})"
        case {"heat": how}:
            return how
        case {"picture": path}:
            return f"picture {path!r}"
        case {"clip": path}:
            return f"clip {path!r}"
        case list():
            few = ", ".join(told(each) for each in content[:3])
            return f"[{few}, ... {len(content)} in all]" if len(content) > 3 else f"[{few}]"
        case float():  # NumPy's are floats, too, and write their type into their repr
            return repr(float(content))
    return repr(content)
