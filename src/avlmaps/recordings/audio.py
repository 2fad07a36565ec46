"""The audio track: float32 mono in [-1, 1], read in pieces from any container."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AudioError
from avlmaps.core.numbers import as_whole
from avlmaps.recordings.microphones import DirectionTrack, Microphones

LOWEST_RATE_HZ = 1000


@dataclass(frozen=True, slots=True)
class Sound:
    """A piece of sound: float32 mono in [-1, 1], and samples a second."""

    samples: Float[np.ndarray, " n"]
    rate_hz: int

    def __post_init__(self) -> None:
        if not isinstance(self.samples, np.ndarray):  # pyright: ignore[reportUnnecessaryIsInstance] - people's own
            raise TypeError(f"samples are a {type(self.samples).__name__}; they must be an array of float32 of (n,)")
        if self.samples.ndim != 1 or self.samples.dtype != np.float32:
            raise ValueError(
                f"samples are {self.samples.dtype} of {self.samples.shape}; they must be float32 of (n,) in [-1, 1]: "
                "of several channels the first, of 16 bits divided by 32768"
            )
        object.__setattr__(self, "rate_hz", require_rate(self.rate_hz))

    @property
    def duration_s(self) -> float:
        return len(self.samples) / self.rate_hz


def require_rate(rate_hz: Any) -> int:
    """Return how many samples a second has, as a number of Python; ValueError where it is no positive whole number."""
    rate = as_whole(rate_hz)
    if rate is None or rate < 1:
        raise ValueError(f"rate_hz is {rate_hz!r}; it must be a positive whole number of samples a second")
    return rate


@dataclass(frozen=True, slots=True)
class AudioTrack:
    """An audio file, or the audio stream of a video, placed on a recording's clock.

    Nothing is read before it is needed, so a track may be hours long. Several channels become one, their mean.

    Attributes:
        start_s: the recording's time at which its first sample sounds.
        channel: the one that is read; None for the mean of all.
        microphones: where those of the channels are (``channels.read_channels`` reads them all).
        files: one for each channel, where they are not channels of one file.
        directions: what a device said of where its sounds came from, where there is one.
        label: what sentences call it, where its file is not one that a user knows.
    """

    path: Path
    rate_hz: int
    duration_s: float
    start_s: float = 0.0
    channel: int | None = None
    microphones: Microphones | None = None
    files: tuple[Path, ...] = ()
    directions: DirectionTrack | None = None
    label: str = ""

    @classmethod
    def open(cls, path: Path | str, start_s: float = 0.0, label: str = "") -> "AudioTrack":
        """Find out what a sound file, or a video with sound, holds, without reading it; AudioError: it is no sound."""
        from avlmaps.recordings import containers

        path = Path(path)
        rate_hz, count = containers.examine(path)
        if rate_hz < LOWEST_RATE_HZ:
            raise AudioError(f"{path} has {rate_hz} samples a second; sounds need at least {LOWEST_RATE_HZ}.")
        return cls(path, rate_hz, count / rate_hz, start_s, label=label)

    @property
    def name(self) -> str:
        return self.label or str(self.path)

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s

    def read(self, onset_s: float = 0.0, offset_s: float | None = None) -> Sound:
        """Read a piece by the recording's time, to the end if None; what lies outside of the track is silent.

        AudioError says that the file cannot be read any more, or holds samples that are not finite numbers.
        """
        begin = round((onset_s - self.start_s) * self.rate_hz)
        count = round(self.duration_s * self.rate_hz)
        end = count if offset_s is None else round((offset_s - self.start_s) * self.rate_hz)
        if offset_s is not None and end < begin:
            raise ValueError(f"the piece from {onset_s} s to {offset_s} s ends before it begins")
        samples = np.zeros(max(end - begin, 0), np.float32)
        inside_begin, inside_end = max(begin, 0), min(end, count)
        if inside_begin < inside_end:
            piece = self._samples(inside_begin, inside_end)
            samples[inside_begin - begin : inside_begin - begin + len(piece)] = piece
        return Sound(samples, self.rate_hz)

    def _samples(self, begin: int, end: int) -> np.ndarray:
        from avlmaps.recordings import containers

        piece = containers.read_piece(self.path, begin, end, self.rate_hz, self.channel)
        return _checked(piece, self.path, self.rate_hz, begin)

    def every_channel(self, begin: int, end: int) -> Float[np.ndarray, "n m"]:
        """Return samples of all channels with microphones, as they are stored; fewer where the track ends before."""
        from avlmaps.recordings.containers import read_all_channels

        parts = [read_all_channels(path, begin, end, self.rate_hz) for path in self.files or (self.path,)]
        length = min(len(part) for part in parts)
        samples = np.concatenate([part[:length] for part in parts], axis=1)
        return samples[:, self.microphones.channels] if self.microphones and self.microphones.channels else samples

    def blocks(self, seconds: float = 10.0) -> Iterator[Sound]:
        """Go through the whole track in pieces of one length (the last may be shorter), one in memory at a time."""
        from avlmaps.recordings import containers

        size = max(1, round(seconds * self.rate_hz))
        count, at = round(self.duration_s * self.rate_hz), 0
        for block in _regrouped(containers.stream(self.path, count, self.rate_hz, self.channel), size):
            yield Sound(_checked(block, self.path, self.rate_hz, at), self.rate_hz)
            at += len(block)
        if at < count:
            raise containers.truncation_error(self.path, at / self.rate_hz, count / self.rate_hz)


def write_flac(path: Path, sound: Sound | Iterable[Sound]) -> None:
    """Write a sound, or the blocks of a long one (of one rate, AudioError without any), as 16-bit FLAC."""
    blocks = iter([sound] if isinstance(sound, Sound) else sound)
    first = next(blocks, None)
    if first is None:
        raise AudioError(f"There is no sound to write to {path}; give at least one block.")

    def samples() -> Iterator[np.ndarray]:
        for block in chain([first], blocks):
            if block.rate_hz != first.rate_hz:
                raise ValueError(f"a block has {block.rate_hz} samples a second, the first had {first.rate_hz}")
            yield block.samples[:, None]

    write_samples(path, samples(), first.rate_hz, 1)


def write_samples(path: Path, blocks: Iterable[Float[np.ndarray, "n m"]], rate_hz: int, channels: int) -> None:
    """Write samples of channels, clipped to [-1, 1], as 16-bit FLAC (up to 8), or WAV by the suffix; all or nothing."""
    import soundfile

    from avlmaps.core.files import replace_atomically

    kind = "WAV" if path.suffix.lower() == ".wav" else "FLAC"
    # Written by name: through a stream of ours, libsndfile would report a full disk on standard error by itself.
    with replace_atomically(path) as stream:
        try:
            with soundfile.SoundFile(stream.name, "w", rate_hz, channels, "PCM_16", format=kind) as file:
                for block in blocks:
                    for at in range(0, len(block), rate_hz):  # a second at a time: long writes have crashed
                        file.write(np.clip(block[at : at + rate_hz], -1.0, 1.0))
        except (soundfile.SoundFileError, AssertionError) as error:  # it asserts that all samples were taken
            raise AudioError(f"{path} could not be written ({error or 'the disk may be full'}).") from error


def _checked(samples: Float[np.ndarray, " n"], path: Path, rate_hz: int, at: int) -> Float[np.ndarray, " n"]:
    finite = np.isfinite(samples)
    if not finite.all():
        where_s = (at + int(np.argmin(finite))) / rate_hz
        raise AudioError(f"{path} holds samples that are not finite, the first at {where_s:.3f} s; convert it again.")
    peak = float(np.abs(samples).max(initial=0.0))
    if peak > 16.0:
        raise AudioError(f"{path} holds samples as large as {peak:.0f}; floating-point sound must lie in [-1, 1].")
    return np.clip(samples, -1.0, 1.0) if peak > 1.0 else samples


def _regrouped(pieces: Iterable[Float[np.ndarray, " _"]], size: int) -> Iterator[Float[np.ndarray, " _"]]:
    waiting: list[np.ndarray] = []
    length = 0
    for piece in pieces:
        waiting.append(piece)
        length += len(piece)
        if length >= size:
            joined = np.concatenate(waiting)
            whole = length // size * size
            for at in range(0, whole, size):
                yield joined[at : at + size]
            waiting, length = [joined[whole:]], length - whole
    if length:
        yield np.concatenate(waiting)


# librosa's default (``soxr_hq``), with which the published models were made: flat up to 0.91 of the lower Nyquist
# rate, and above it nothing that 20 bits could show.
_QUALITY = "HQ"


def resample(sound: Sound, rate_hz: int) -> Sound:
    """Return the sound at another rate as ``librosa.resample`` does: without delay, its length rounded up."""
    if sound.rate_hz == rate_hz:
        return sound
    length = -(-len(sound.samples) * rate_hz // sound.rate_hz)
    if length == 0:
        return Sound(np.zeros(0, np.float32), rate_hz)
    import soxr

    found = soxr.resample(np.ascontiguousarray(sound.samples, np.float32), sound.rate_hz, rate_hz, _QUALITY)[:length]
    # soxr rounds the length to the nearest sample
    samples = found if len(found) == length else np.pad(found, (0, length - len(found)))
    return Sound(samples, rate_hz)
