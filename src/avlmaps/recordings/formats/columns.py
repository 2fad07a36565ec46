"""The first line of a table, read by what it says: names of columns in any order, with their units."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

POSE = ("stamp_s", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
NAMED_FILE = ("name", "stamp_s")
_TIME = frozenset(["t", "time", "timestamp", "timestamps", "stamp", "stamps", "ts", "sec", "secs", "second", "seconds"])
_FILE = frozenset(["name", "names", "file", "files", "filename", "frame", "image", "picture", "rgb", "color", "colour"])
_PLACE = frozenset(["t", "p", "pos", "position", "trans", "translation", "loc", "location", "xyz"])
_TURN = frozenset(["q", "quat", "quaternion", "rot", "rotation", "orientation", "o", "r"])
_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_UNIT = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
# A comment above the numbers is taken for their header where it names at least this share of them.
_COMMENT_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class ColumnOrder:
    """Where each wanted column stands in the file, and the factor that takes it to seconds or metres."""

    columns: tuple[int, ...]
    factors: tuple[float, ...]

    def applied(self, values: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "n c"]:
        """Return rows of the file in the wanted order and units."""
        return values[:, self.columns] * np.array(self.factors)


def split_header(text: str) -> list[str]:
    """Return the fields of a line of names; a name may hold spaces where commas or semicolons part the names."""
    text = text.lstrip("#%").strip()
    separator = next((sign for sign in ";,\t" if sign in text), None)
    return [field.strip() for field in text.split(separator)]


def named_order(fields: Sequence[str], wanted: Sequence[str]) -> ColumnOrder:
    """Return where the wanted columns stand.

    Raises:
        ValueError: a name is not known, comes twice, is missing, or has a unit that is none; the text says which.
    """
    found: dict[str, tuple[int, float]] = {}
    for at, field in enumerate(fields):
        column, factor = _column(field)
        if column not in wanted:
            raise ValueError(f"{field!r} is none of the columns {','.join(wanted)}, which may stand in any order")
        if column in found:
            raise ValueError(f"{fields[found[column][0]]!r} and {field!r} both name the column {column}")
        found[column] = (at, factor)
    if missing := [column for column in wanted if column not in found]:
        raise ValueError(f"the column {missing[0]} is missing; {','.join(wanted)} are needed")
    return ColumnOrder(tuple(found[column][0] for column in wanted), tuple(found[column][1] for column in wanted))


def is_header_in_comment(fields: Sequence[str], wanted: Sequence[str]) -> bool:
    """Return whether a comment is a list of columns: as many as are wanted, of which it names some."""
    known = sum(_column_or_none(field) in wanted for field in fields)
    return len(fields) == len(wanted) and known >= _COMMENT_SHARE * len(wanted)


def _column_or_none(field: str) -> str:
    try:
        return _column(field)[0]
    except ValueError:
        return ""


def _column(field: str) -> tuple[str, float]:
    """Return the column that a name stands for (``""`` for none) and its unit as a factor."""
    word, unit = field.strip(" '\"#%").lower(), ""
    if bracket := _UNIT.search(word):
        word, unit = word[: bracket.start()], bracket.group(1)
    word = re.sub(r"[\s./-]+", "_", word).strip("_")
    stem, _, suffix = word.rpartition("_")
    if not unit and stem and suffix in {**_SECONDS, **_METRES}:
        word, unit = stem, suffix
    if word in _TIME:
        return "stamp_s", _factor(field, unit, _SECONDS)
    if word in _FILE:
        return "name", 1.0
    prefix, axis = word[:-1].strip("_"), word[-1:]
    kinds = [kind for part in prefix.split("_") for kind, words in (("t", _PLACE), ("q", _TURN)) if part in words]
    kind = kinds[0] if kinds else "q" if axis == "w" and not prefix else "t" if not prefix else ""
    if not kind or axis not in ("xyz" if kind == "t" else "xyzw"):
        return "", 1.0
    return kind + axis, _factor(field, unit, _METRES) if kind == "t" else 1.0


def _factor(field: str, unit: str, units: dict[str, float]) -> float:
    if unit and unit not in units:
        raise ValueError(f"{field!r} has the unit {unit!r}; known are {', '.join(units)}")
    return units.get(unit, 1.0)
