"""Checks of what a program hands to a skill, and their sentences."""

from math import isfinite

from avlmaps.core.errors import ProgramError


def text_of(value: object, skill: str) -> str:
    """Return words, or raise ``ProgramError`` where it is something else."""
    if not isinstance(value, str):
        raise ProgramError(f"{skill} takes words, not {kind_of(value)}.")
    return value


def number_of(value: object, skill: str, most: float, unit: str) -> float:
    """Return a number, or raise ``ProgramError`` where it is none, not finite or beyond ``most`` on either side."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or abs(value) > most:
        shown = value if isinstance(value, int | float) else kind_of(value)
        raise ProgramError(f"{skill} takes a number of at most {most:g} {unit}, not {shown}.")
    return float(value)


def kind_of(value: object) -> str:
    """Return what a value is, for the sentence of an error."""
    return f"a {type(value).__name__.lower()}"
