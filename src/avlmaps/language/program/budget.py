"""The limits of a program, and the sentence of a program that was stopped."""

from dataclasses import dataclass, fields

from avlmaps.core.errors import ProgramError


def refused(line: int, text: str) -> ProgramError:
    """Return the error that says what is wrong on a line of a program."""
    return ProgramError(f"Line {line}: {text}.")


LARGEST = 10**15
"""No number in a program is further from zero: below it, whole numbers and floats are both exact."""


def bounded(line: int, value: int | float) -> int | float:
    """Return a number, unless it is too far from zero, infinite or none at all."""
    # Not a number is on neither side.
    if not -LARGEST <= value <= LARGEST:
        raise refused(line, "a number came out beyond 1e15 in size; programs reckon in metres and degrees")
    return value


@dataclass(frozen=True, slots=True)
class Budget:
    """The limits of one run of a program; running past any of them stops it."""

    steps: int = 100_000
    """Parts of the program that are computed; going through a collection counts each of its elements."""
    skill_calls: int = 200
    """Skills called."""
    elements: int = 200_000
    """Elements of collections and characters of strings made, also those in the trace; never given back."""
    factors: int = 16
    """Heatmaps multiplied into one."""
    seconds: float = 1800.0
    """Wall time, the skills' own included; looked at before each skill and now and then between."""

    def __post_init__(self) -> None:
        for limit in fields(self):
            if not getattr(self, limit.name) > 0:
                raise ValueError(f"a budget needs some {limit.name}, not {getattr(self, limit.name)}")
