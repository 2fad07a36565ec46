"""The audio track: float32 mono in [-1, 1], read in pieces, whatever the container."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, slots=True)
class Sound:
    """A piece of sound.

    Attributes:
        samples: float32 mono in [-1, 1].
        rate_hz: samples a second.
    """

    samples: Float[np.ndarray, " n"]
    rate_hz: int

    def __post_init__(self) -> None:
        if self.samples.ndim != 1 or self.samples.dtype != np.float32:
            raise ValueError(f"samples are {self.samples.dtype} of {self.samples.shape}; they must be float32 of (n,)")
        if self.rate_hz < 1:
            raise ValueError(f"rate_hz is {self.rate_hz}; it must be positive")

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return len(self.samples) / self.rate_hz


@dataclass(frozen=True, slots=True)
class AudioTrack:
    """An audio file, or the audio stream of a video, placed on a recording's clock. To be written by the audio work.

    Attributes:
        path: the file.
        rate_hz: samples a second.
        duration_s: length in seconds.
        start_s: the recording's time at which its first sample sounds.
    """

    path: Path
    rate_hz: int
    duration_s: float
    start_s: float = 0.0

    def read(self, onset_s: float = 0.0, offset_s: float | None = None) -> Sound:
        """Read a piece, in the recording's time."""
        raise NotImplementedError

    def blocks(self, seconds: float = 10.0) -> Iterator[Sound]:
        """Go through the whole track in pieces."""
        raise NotImplementedError
