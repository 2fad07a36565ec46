"""A sound track that comes piece by piece: its samples go to a file, from which it is read like any other track."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.errors import AudioError
from avlmaps.core.numbers import as_number
from avlmaps.recordings.audio import LOWEST_RATE_HZ, AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound

GAP_S = 0.1  # a piece that is later or earlier than this is not in its place; less is the difference of two clocks
LONGEST_GAP_S = 600.0  # a longer one is another clock
_LARGEST = 16.0  # samples beyond this come from another scale
_BYTES = 4
_SILENCE_S = 10


@dataclass(frozen=True, slots=True)
class RawTrack(AudioTrack):
    """A track of float32 samples in a file without a head; more samples may follow those that it has.

    Of several channels, whose samples take turns in the file, it sounds as its first.

    Attributes:
        first: the sample of the file that is its first.
        channels: how many.
    """

    first: int = 0
    channels: int = 1

    def blocks(self, seconds: float = 10.0) -> Iterator[Sound]:
        """Go through the track in pieces; see ``AudioTrack.blocks``."""
        size, count = max(1, round(seconds * self.rate_hz)), round(self.duration_s * self.rate_hz)
        for at in range(0, count, size):
            yield Sound(self._samples(at, min(at + size, count)), self.rate_hz)

    def since(self, sample: int) -> "RawTrack":
        """Return the track from one of its samples on."""
        left = round(self.duration_s * self.rate_hz) - sample
        return replace(
            self,
            first=self.first + sample,
            start_s=self.start_s + sample / self.rate_hz,
            duration_s=left / self.rate_hz,
        )

    def every_channel(self, begin: int, end: int) -> Float32[np.ndarray, "n m"]:
        """Return samples of all channels; see ``AudioTrack.every_channel``."""
        offset = _BYTES * self.channels * (self.first + begin)
        samples = np.fromfile(self.path, np.float32, (end - begin) * self.channels, offset=offset)
        if len(samples) < (end - begin) * self.channels:
            raise AudioError(
                f"{self.path} lost its sound: {(end - begin) * self.channels - len(samples)} samples are missing."
            )
        return samples.reshape(-1, self.channels)

    def _samples(self, begin: int, end: int) -> np.ndarray:
        return np.ascontiguousarray(self.every_channel(begin, end)[:, 0])


class GrowingTrack:
    """Takes pieces of sound, in the order of time, and puts each in its place on the clock of the frames.

    Attributes:
        gaps: how many times a piece came later than the one before ended; silence fills them.
        gap_s: how long these are together.
        overlaps: how many pieces began before the one before ended; what was there already is left out.
        channels: how many each piece has; 0 before the first.
    """

    def __init__(self, file: Path) -> None:
        """Begin without sound; the samples will be in a file of this name."""
        self._file, self._rate_hz, self.channels, self._start_s, self._count = file, 0, 0, 0.0, 0
        self.gaps, self.gap_s, self.overlaps = 0, 0.0, 0

    @property
    def track(self) -> RawTrack | None:
        """The track until now, None before its first sample."""
        if not self._count:
            return None
        return RawTrack(self._file, self._rate_hz, self._count / self._rate_hz, self._start_s, channels=self.channels)

    @property
    def end_s(self) -> float | None:
        """When it ends until now, None before its first sample."""
        return None if not self._count else self._start_s + self._count / self._rate_hz

    def add(self, chunk: Any, stamp_s: Any = None) -> list[Sound]:
        """Take a piece of sound.

        Args:
            chunk: a ``Sound``: mono samples and their rate; or a ``ChannelSound``, of one number of channels.
            stamp_s: when its first sample sounds, on the clock of the frames; None where the one before ended.

        Returns:
            What was added of the first channel, silence before it included.

        Raises:
            AudioError: it is no sound, has another rate or other channels, repeats what came, or is of another clock.
        """
        sound = _checked(chunk, self._rate_hz, self.channels)
        at_s = None if stamp_s is None else as_number(stamp_s)
        if stamp_s is not None and (at_s is None or not isfinite(at_s)):
            raise AudioError(f"stamp_s of a piece of sound must be a finite number of seconds, not {stamp_s!r}.")
        channels, count = sound.samples.shape
        if not count:
            return []
        end_s = self.end_s
        if end_s is None:
            self._rate_hz, self.channels = sound.rate_hz, channels
            self._start_s = 0.0 if at_s is None else at_s
            return self._append([sound])
        late_s = 0.0 if at_s is None else at_s - end_s
        if late_s > LONGEST_GAP_S:
            raise AudioError(
                f"A piece of sound at {at_s:.3f} s comes {late_s:.0f} s after the sound before it ended "
                f"({end_s:.3f} s), more than {LONGEST_GAP_S:.0f} s; give stamps of the frames' clock."
            )
        if late_s >= GAP_S:
            added = self._append([*_silence(channels, round(late_s * sound.rate_hz), sound.rate_hz), sound])
            self.gaps, self.gap_s = self.gaps + 1, self.gap_s + late_s
            return added
        if late_s <= -GAP_S:
            sound = self._rest_of(sound, -late_s, end_s)
            self.overlaps += 1
        return self._append([sound])

    def _rest_of(self, sound: ChannelSound, early_s: float, end_s: float) -> ChannelSound:
        known = round(early_s * sound.rate_hz)
        if known >= sound.samples.shape[1]:
            begin_s = end_s - early_s
            raise AudioError(
                f"A piece of sound from {begin_s:.3f} to {begin_s + sound.duration_s:.3f} s lies before the end of the "
                f"sound that came ({end_s:.3f} s): it is repeated or out of order, and was left out."
            )
        return ChannelSound(sound.samples[:, known:], sound.rate_hz)

    def _append(self, sounds: list[ChannelSound]) -> list[Sound]:
        try:
            with self._file.open("r+b" if self._file.exists() else "xb") as stream:
                stream.seek(_BYTES * self.channels * self._count)  # what a full disk left half written is written again
                for sound in sounds:
                    stream.write(np.ascontiguousarray(sound.samples.T, np.float32).data)
        except OSError as fault:
            raise AudioError(
                f"{self._file} cannot be written ({fault.strerror or fault}), so that a piece of sound is lost; make "
                "room for it."
            ) from fault
        self._count += sum(sound.samples.shape[1] for sound in sounds)
        return [sound.channel(0) for sound in sounds]


def _silence(channels: int, count: int, rate_hz: int) -> Iterator[ChannelSound]:
    step = _SILENCE_S * rate_hz
    for at in range(0, count, step):
        yield ChannelSound(np.zeros((channels, min(step, count - at)), np.float32), rate_hz)


def _checked(chunk: Any, rate_hz: int, channels: int) -> ChannelSound:
    if not isinstance(chunk, Sound | ChannelSound):
        raise AudioError(
            f"A piece of sound must be an avlmaps.Sound(samples, rate_hz), not {type(chunk).__name__}; of several "
            "channels an avlmaps.ChannelSound."
        )
    if chunk.rate_hz < LOWEST_RATE_HZ:
        raise AudioError(f"A piece of sound has {chunk.rate_hz} samples a second; {LOWEST_RATE_HZ} are needed.")
    if rate_hz and chunk.rate_hz != rate_hz:
        raise AudioError(
            f"A piece of sound has {chunk.rate_hz} samples a second, those before {rate_hz}; a map has one track, give "
            "one rate."
        )
    samples = chunk.samples if isinstance(chunk, ChannelSound) else chunk.samples[None]
    if channels and len(samples) != channels:
        raise AudioError(
            f"A piece of sound has {len(samples)} channel(s), those before {channels}; a map has one track, give all "
            "of its channels."
        )
    if not np.isfinite(samples).all():
        raise AudioError("A piece of sound holds samples that are not finite numbers; leave it out.")
    peak = float(np.abs(samples).max(initial=0.0))
    if peak > _LARGEST:
        raise AudioError(f"A piece of sound holds samples as large as {peak:.0f}; they must lie in [-1, 1].")
    return ChannelSound(np.clip(samples, -1.0, 1.0), chunk.rate_hz)
