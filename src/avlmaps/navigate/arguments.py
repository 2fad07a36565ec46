"""Checks of what a program hands to a skill, and their sentences."""

from numbers import Real
from typing import cast

from avlmaps.core.errors import ProgramError


def text_of(value: object, skill: str) -> str:
    """Return words, or raise ``ProgramError`` where it is something else."""
    if not isinstance(value, str):
        raise ProgramError(f"{skill} takes words, not {kind_of(value)}.")
    return value


def number_of(value: object, skill: str, most: float, unit: str) -> float:
    """Return a number, or raise ``ProgramError`` where it is none, not finite or beyond ``most`` on either side."""
    # NumPy's numbers are real ones too; NaN fails every comparison.
    if isinstance(value, bool) or not isinstance(value, Real) or not abs(cast("float", value)) <= most:
        shown = value if isinstance(value, float) else kind_of(value)
        if isinstance(value, int) and not isinstance(value, bool):
            shown = value if abs(value) < 10**12 else "a larger one"  # an integer may have any number of digits
        raise ProgramError(f"{skill} takes a number of at most {most:g} {unit}, not {shown}.")
    return float(value)


def kind_of(value: object) -> str:
    """Return the kind of a value, for the sentence of an error."""
    return f"a {type(value).__name__.lower()}"
