"""Dataclasses of arrays, row by row: some of their rows, and several of them one after the other.

An array belongs to an axis, the first that its type declares. ``RAGGED`` of a class names the fields of offsets and the
field whose rows each divides: row k has the rows ``offsets[k]:offsets[k + 1]`` of that. An axis such as ``k_or_0`` is
that of ``k``, or empty where nothing is known.
"""

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache
from typing import Any, TypeVar

import numpy as np

from avlmaps.core.arrays import Bool, Int, Int64

T = TypeVar("T")
_OR_NONE = "_or_0"


@cache
def axes_of(kind: Any) -> dict[str, str]:
    """Return the fields of a dataclass that hold arrays, each with the first axis that its type declares."""
    types: dict[str, Any] = {field.name: field.type for field in fields(kind)}
    return {name: declared.dim_str.split()[0] for name, declared in types.items() if hasattr(declared, "dim_str")}


def ragged(kind: Any) -> tuple[tuple[str, str], ...]:
    """Return the fields of offsets of a dataclass, each with the field whose rows it divides."""
    return getattr(kind, "RAGGED", ())


def rows_or_none(kind: Any) -> list[tuple[str, str]]:
    """Return the fields of arrays that are empty where nothing is known, each with a field that has their rows."""
    axes = axes_of(kind)
    fields_of = {axis: name for name, axis in reversed(axes.items())}
    return [(name, fields_of[axis.removesuffix(_OR_NONE)]) for name, axis in axes.items() if axis.endswith(_OR_NONE)]


def take(whole: T, rows: Int[np.ndarray, " r"] | Bool[np.ndarray, " n"] | slice) -> T:
    """Return a dataclass with some of its rows; arrays of other axes and what is no array stay."""
    kind: Any = type(whole)
    axes = axes_of(kind)
    of, changed = {next(iter(axes.values())): rows}, dict[str, np.ndarray]()
    for offsets, divided in ragged(kind):
        changed[offsets], of[axes[divided]] = _taken(np.asarray(getattr(whole, offsets)), rows)
    for name, axis in axes.items():
        array = np.asarray(getattr(whole, name))
        if axis in of or (axis.endswith(_OR_NONE) and len(array)):
            changed[name] = array[of[axis.removesuffix(_OR_NONE)]]
    made: Any = whole
    return replace(made, **changed)


def concat(parts: Sequence[T], **others: Any) -> T:
    """Put dataclasses of one kind, at least one, one after the other; ``others`` are the fields that are no arrays."""
    kind: Any = type(parts[0])
    arrays = {name: [np.asarray(getattr(part, name)) for part in parts] for name in axes_of(kind)}
    for offsets, _ in ragged(kind):
        arrays[offsets] = [offsets_of(np.concatenate([np.diff(piece) for piece in arrays[offsets]]))]
    for name, rows in rows_or_none(kind):
        known = sum(map(len, arrays[name])) == sum(map(len, arrays[rows]))
        if not known or len({piece.shape[1:] for piece in arrays[name]}) > 1:  # not known of every piece, or otherwise
            arrays[name] = [arrays[name][0][:0]]
    return kind(**{name: np.concatenate(pieces) for name, pieces in arrays.items()}, **others)


def offsets_of(lengths: Sequence[int] | Int[np.ndarray, " k"]) -> Int64[np.ndarray, " k1"]:
    """Return where each of some pieces begins that lie one after the other, and where the last ends."""
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _taken(offsets: Int[np.ndarray, " k1"], rows: Any) -> tuple[np.ndarray, np.ndarray]:
    size: Int[np.ndarray, " r"] = np.diff(offsets)[rows]
    ends = offsets_of(size)
    first: Int[np.ndarray, " m"] = np.repeat(offsets[:-1][rows] - ends[:-1], size)
    return ends, first + np.arange(len(first))
