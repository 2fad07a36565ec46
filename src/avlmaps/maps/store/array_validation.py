"""Holding arrays that were read from a disk against what ``maps.types`` declares of them."""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from avlmaps.core.columns import axes_of, ragged, rows_or_none
from avlmaps.core.errors import MapError
from avlmaps.maps.grid import index_ends
from avlmaps.maps.types import Voxels

T = TypeVar("T")

# The keypoints' points are NaN where there was no depth.
# Features: of unit length, or zero where there is nothing to say.
UNIT_ROWS = frozenset({"voxels/feature", "sounds/feature", "keyframes/view", "keyframes/descriptors"})
_UNIT = 0.02
MAY_BE_NAN = frozenset({"keyframes/points_world"})
MOST_EXTENT_M = 10_000.0
MOST_AWAY_M = 1e6
_MEND = "build the map again in its place"


def array_fields(kind: type) -> list[str]:
    """Return the names of a dataclass's fields that hold arrays."""
    return list(axes_of(kind))


def validate_arrays(kind: type[T], values: Mapping[str, Any], where: str) -> T:
    """Return the dataclass of these fields, each array of the type and shape of its annotation.

    Args:
        kind: ``Voxels``, ``Keyframes``, ``HeardSounds`` or another dataclass with jaxtyping annotations.
        values: its fields; one with a default may be missing, as maps written before it was thought of lack it.
        where: the file or folder that the error names.

    Raises:
        MapError: a field is missing, has another type or shape, sizes disagree, or ragged offsets do not fit.
    """
    sizes: dict[str, int] = {}
    for field in dataclasses.fields(kind):  # pyright: ignore[reportArgumentType]
        if field.name not in values and _has_default(field):
            continue
        if field.name not in values:
            raise MapError(f"{where} is damaged: it has no {field.name}; {_MEND}.")
        if hasattr(field.type, "dim_str"):
            _check_array(f"{where}, {field.name}", values[field.name], field.type, sizes)
    whole = kind(**values)
    for offsets, rows in ragged(kind):
        _check_offsets(f"{where}, {offsets}", getattr(whole, offsets), len(getattr(whole, rows)), len(whole))  # pyright: ignore[reportArgumentType]
    for some, rows in rows_or_none(kind):
        count, wanted = len(getattr(whole, some)), len(getattr(whole, rows))
        if count not in (0, wanted):
            raise MapError(f"{where}, {some} has {count} rows; {rows} has {wanted}; {_MEND}.")
    return whole


def _has_default(field: "dataclasses.Field[Any]") -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def _check_array(where: str, array: np.ndarray, declared: Any, sizes: dict[str, int]) -> None:
    """Compare an array with a jaxtyping annotation; ``sizes`` stores what each letter stands for."""
    dims = declared.dim_str.split()
    if array.dtype.name not in declared.dtypes or array.ndim != len(dims):
        raise MapError(
            f"{where} is {array.dtype} of {array.shape}; a map has {' or '.join(declared.dtypes)} of "
            f"({', '.join(dims)}) there; {_MEND}."
        )
    for dim, size in zip(dims, array.shape, strict=True):
        wanted = int(dim) if dim.isdigit() else sizes.setdefault(dim, size)
        if size != wanted:
            raise MapError(f"{where} has shape {array.shape}; {dim} is {wanted} in the rest of the map; {_MEND}.")


def _check_offsets(where: str, offsets: np.ndarray, rows: int, count: int) -> None:
    fits = len(offsets) == count + 1 and offsets[0] == 0 and offsets[-1] == rows and bool((np.diff(offsets) >= 0).all())
    if not fits:
        raise MapError(f"{where} do not divide {rows} rows among {count}; {_MEND}.")


def content_fault(name: str, array: np.ndarray) -> str:
    """Return the fault in the numbers of an array, or of a piece of one, in words; nothing where all is well.

    Args:
        name: what it holds, such as ``voxels/feature``.
        array: of any shape; of a piece of an array of features, whole rows.
    """
    if name == "voxels/index" and array.ndim == 2 and not _is_sorted(array):
        return "its voxels are not sorted by index, or one comes twice"
    if array.dtype.kind != "f":
        return ""
    if name in MAY_BE_NAN:
        return "a place in it is no place" if (np.abs(array) > MOST_AWAY_M).any() else ""
    if array.dtype == np.float16:  # by its bits, several times as fast
        finite = bool(((array.view(np.uint16) & 0x7C00) != 0x7C00).all())
    else:
        finite = bool(np.isfinite(array).all())
    if not finite:
        return "it holds numbers that are NaN or infinite"
    if name in UNIT_ROWS and array.ndim == 2 and array.shape[1]:
        rows = array.astype(np.float32)
        square = np.einsum("ij,ij->i", rows, rows)
        if not ((np.abs(square - 1.0) < 2.0 * _UNIT) | (square == 0.0)).all():
            return "it holds features that have neither unit length nor are zero"
    return ""


def check_extent(index: np.ndarray, voxel_size_m: float, where: str) -> None:
    """Raise ``MapError`` where voxels are further apart than in any building, or further away than places can be."""
    if not len(index):
        return
    low, high = (end.astype(np.float64) for end in index_ends(index))
    extent_m, away_m = float((high - low).max()) * voxel_size_m, float(max(abs(low).max(), abs(high).max()))
    if extent_m > MOST_EXTENT_M or away_m * voxel_size_m > MOST_AWAY_M:
        raise MapError(
            f"{where} is damaged: voxels extend over {extent_m:,.0f} m, up to {away_m * voxel_size_m:,.0f} m from the "
            f"origin; a map has at most {MOST_EXTENT_M:,.0f} m; {_MEND}."
        )


def check_order(voxels: Voxels, where: str) -> None:
    """Raise ``MapError`` unless the voxels are sorted by index and none comes twice."""
    if not _is_sorted(np.asarray(voxels.index)):
        raise MapError(f"{where} are not sorted by index, or one comes twice; {_MEND}.")


def _is_sorted(index: np.ndarray) -> bool:
    step = np.diff(index.astype(np.int64), axis=0)
    if not step.size:
        return True
    first = np.take_along_axis(step, (step != 0).argmax(axis=1)[:, None], axis=1)
    return bool((first > 0).all())
