"""Sounds on their way into a network: usable samples, windows of one length, some of them at once. Needs no torch."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import AudioError
from avlmaps.recordings.audio import Sound, resample

T = TypeVar("T")
WORDS_AT_ONCE = 64


def usable_samples(sound: Sound, rate_hz: int) -> Float32[np.ndarray, " n"]:
    """Return a sound's samples at a rate, at least one of them.

    Raises:
        AudioError: the sound has no samples, or some that are not finite numbers.
    """
    if not len(sound.samples):
        raise AudioError("The sound has no samples; give a sound of at least a few milliseconds.")
    bad = int((~np.isfinite(sound.samples)).sum())
    if bad:
        raise AudioError(
            f"The sound has {bad} samples of {len(sound.samples)} that are not finite numbers; convert it again from "
            "its source."
        )
    return resample(sound, rate_hz).samples


def windows(samples: Float32[np.ndarray, " n"], length: int, step: int) -> list[Float32[np.ndarray, " m"]]:
    """Return a sound in windows, evenly, the last one at its end; a sound that is no longer than one is left whole.

    They are views of the sound, which is not copied.
    """
    count = len(samples)
    starts = [*range(0, count - length, step), count - length] if count > length else [0]
    return [samples[at : at + length] for at in starts]


def by_portions(
    items: Sequence[T], size: int, dim: int, encode: Callable[[Sequence[T]], Float32[np.ndarray, "n d"]]
) -> Float32[np.ndarray, "n d"]:
    """Return a row of ``dim`` numbers for each item, some of them going through at once."""
    parts = [np.zeros((0, dim), np.float32)]
    parts.extend(encode(items[at : at + size]) for at in range(0, len(items), size))
    return np.concatenate(parts)
