"""What encoders give, held to their protocols before it reaches a map."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.perception.cache import encode_batch
from avlmaps.perception.protocols import UNIT_WITHIN, PixelEncoder
from avlmaps.recordings.types import Frame

_LOOKED_AT = slice(None, None, 8)  # rows and columns of an encoder's grid: one that is wrong is wrong in most


def encode_pixels(encoder: PixelEncoder, frames: Sequence[Frame]) -> list[Float32[np.ndarray, "hf wf d"]]:
    """Return the features of each frame."""
    if not frames:
        return []
    who, names = f"The pixel encoder {encoder.card.id}", ", ".join(frame.name for frame in frames)
    with perceiving(who, names):
        found = encode_batch(encoder, frames)
    if len(found) != len(frames):
        raise BackendError(f"{who} gave features of {len(found)} frames for {len(frames)} ({names}).")
    grids = [as_grid(grid, encoder.card.dim, f"{who} gave", frame) for grid, frame in zip(found, frames, strict=True)]
    for grid, frame in zip(grids, frames, strict=True):
        require_unit(grid[_LOOKED_AT, _LOOKED_AT], f"{who} gave", frame)
    return grids


@contextmanager
def perceiving(who: str, what: str) -> Generator[None]:
    """Turn any error of an encoder into a ``BackendError`` that names it and what it looked at."""
    try:
        yield
    except AvlmapsError:
        raise
    except Exception as fault:
        raise BackendError(f"{who} failed on {what} with {type(fault).__name__}: {fault}") from fault


def as_grid(features: Any, dim: int | None, who: str, frame: Frame) -> np.ndarray:
    """Return features as an array of the right form."""
    wanted = f"float32 of (rows, columns, {'d' if dim is None else dim})"
    try:
        array = np.asarray(features)
    except (ValueError, TypeError, RuntimeError) as fault:  # rows of several lengths, or a tensor of a GPU
        came = type(features).__name__
        raise BackendError(f"{who} no array but {came} for {frame.name} ({fault}); features are {wanted}.") from None
    wrong = array.dtype.kind != "f" or array.ndim != 3 or 0 in array.shape
    if wrong or (dim is not None and array.shape[2] != dim):
        raise BackendError(f"{who} {array.dtype} of {array.shape} for {frame.name}; features are {wanted}.")
    (rows, columns), (height, width) = array.shape[:2], frame.rgb.shape[:2]
    if (rows - columns) * (height - width) < 0 and abs(rows * height - columns * width) <= max(width, height):
        raise BackendError(
            f"{who} {rows} rows and {columns} columns for {frame.name}, whose picture has {height} rows and {width} "
            "columns: they look exchanged; features.swapaxes(0, 1) puts them right."
        )
    return array


def given_features(features: Any, dim: int | None, frame: Frame) -> np.ndarray:
    """Return a copy of the features that a program gives with a frame."""
    who = "The features that were given are"
    grid = as_grid(features, dim, who, frame)
    require_unit(grid, who, frame)
    return np.array(grid)


def require_unit(features: np.ndarray, who: str, frame: Frame) -> None:
    """Raise ``BackendError`` where features are not finite, or not of unit length or zero."""
    lengths = np.sqrt(np.einsum("ijk,ijk->ij", features, features, dtype=np.float64))
    if not np.isfinite(lengths).all():
        raise BackendError(
            f"{who} NaN or infinite features for {frame.name} (in {int((~np.isfinite(lengths)).sum())} of "
            f"{lengths.size} cells); they must be finite, and zero where there is nothing to say."
        )
    off = (lengths > UNIT_WITHIN) & (np.abs(lengths - 1.0) > UNIT_WITHIN)
    if off.any():
        raise BackendError(
            f"{who} features of length {lengths[off].min():.3g} to {lengths[off].max():.3g} for {frame.name}; each has "
            "unit length, or is zero: divide it by its length."
        )


def as_row(found: Any, dim: int, who: str, frame: Frame) -> Float32[np.ndarray, " d"]:
    """Return the one feature of a picture, which has unit length."""
    array = np.asarray(found)
    row = array.reshape(-1) if array.ndim in (1, 2) else array
    if array.dtype.kind != "f" or row.shape != (dim,) or not np.isfinite(row).all():
        raise BackendError(f"{who} gave {array.dtype} of {array.shape} for {frame.name}; it is {dim} finite numbers.")
    if abs((length := float(np.linalg.norm(row))) - 1.0) > UNIT_WITHIN:
        raise BackendError(f"{who} gave a feature of length {length:.3g} for {frame.name}; divide it by its length.")
    return row.astype(np.float32)
