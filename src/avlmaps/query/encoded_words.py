"""Words as an encoder of pixels or views encodes them, checked: people bring encoders of their own."""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.perception.protocols import PixelEncoder, ViewEncoder

_UNIT = 0.02  # by as much a length may differ from one, as in features of pixels


def encoded_words(encoder: PixelEncoder | ViewEncoder, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
    """Return a row for each word, zero for one that the encoder does not know.

    Raises:
        BackendError: the encoder failed, or gave other than finite rows, one for each word, of unit length or zero.
    """
    what = f"encode_words of the encoder {encoder!r}"
    try:
        rows = np.asarray(encoder.encode_words(list(words)), np.float32)
    except AvlmapsError:
        raise
    except Exception as fault:
        raise BackendError(f"{what} failed on {len(words)} words with {type(fault).__name__}: {fault}") from fault
    if rows.ndim != 2 or len(rows) != len(words):
        raise BackendError(f"{what} gave {rows.shape} for {len(words)} words; it gives a row for each.")
    card = getattr(encoder, "card", None)
    if card is not None and card.dim and rows.shape[1] != card.dim:
        raise BackendError(f"{what} gave {rows.shape} for {len(words)} words; its features have {card.dim} numbers.")
    if not np.isfinite(rows).all():
        raise BackendError(f"{what} gave NaN or infinity for {len(words)} words; what it does not know is zero.")
    lengths = np.linalg.norm(rows, axis=1)
    off = lengths[(lengths > _UNIT) & (np.abs(lengths - 1.0) > _UNIT)]
    if len(off):
        raise BackendError(
            f"{what} gave rows of length {off.min():.3g} to {off.max():.3g}; each has unit length, or is zero: divide "
            "it by its length."
        )
    return rows
