"""Sound of several microphones at once, and sound that comes piece by piece: reading, writing, faults of channels."""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.numbers import as_number
from avlmaps.recordings.audio import LOWEST_RATE_HZ, AudioTrack, Sound, require_rate, write_samples
from avlmaps.recordings.containers import channel_power
from avlmaps.recordings.microphones import Microphones

_LOOKS, _LOOK_S = 24, 0.5
_DEAD_DB = 40.0  # a channel this much below the loudest holds nothing of use
_QUIET = 0.01  # share of the loudest's power; a fainter channel is not the one that is heard
_FULL_SCALE, _CLIPPED = 0.999, 1e-3


@dataclass(frozen=True, slots=True)
class ChannelSound:
    """A piece of sound of several channels: (m, n) float32 in [-1, 1], and samples a second."""

    samples: Float[np.ndarray, "m n"]
    rate_hz: int

    def __post_init__(self) -> None:
        if self.samples.ndim != 2 or self.samples.dtype != np.float32:
            raise ValueError(f"samples are {self.samples.dtype} of {self.samples.shape}; they must be float32 (m, n)")
        object.__setattr__(self, "rate_hz", require_rate(self.rate_hz))

    @property
    def duration_s(self) -> float:
        return self.samples.shape[1] / self.rate_hz

    def channel(self, number: int) -> Sound:
        return Sound(np.ascontiguousarray(self.samples[number]), self.rate_hz)


def with_microphones(track: AudioTrack, microphones: Microphones, files: tuple[Path, ...] = ()) -> AudioTrack:
    """Return a track that knows where its channels' microphones are; of several files it is the first.

    As one channel it sounds as its first, or as the first that is not far quieter than others: devices give channels
    of their own processing, or of nothing, beside those of the microphones. RecordingError says that there are more or
    fewer channels than microphones, AudioError that files of channels have another length or rate.
    """
    if files and len(files) != len(microphones):
        raise RecordingError(
            f"{len(files)} files of channels are of {len(microphones)} microphone(s); place each file."
        )
    for path in files[1:]:
        other = AudioTrack.open(path, track.start_s)
        if (track.rate_hz, track.duration_s) != (other.rate_hz, other.duration_s):
            raise AudioError(
                f"The channels disagree: {track.path} has {track.rate_hz} samples a second for {track.duration_s:g} s, "
                f"{path} {other.rate_hz} for {other.duration_s:g} s; export them together, from one clock."
            )
    if files:
        return replace(track, channel=0, microphones=microphones, files=files)
    power = channel_power(track.path, round(track.duration_s * track.rate_hz), track.rate_hz)
    used = microphones.channels or range(len(power))
    if len(used) != len(microphones) or max(used) >= len(power):
        raise RecordingError(
            f"{track.name} has {len(power)} channel(s), and {len(microphones)} microphone(s) are described; give one "
            'position for each, or say which channels they are where others hold no microphone ("channels": [2, 3] '
            "beside positions_m, counted from 1)."
        )
    heard = next((channel for channel in used if power[channel] > _QUIET * power[list(used)].max()), used[0])
    return replace(track, channel=heard, microphones=microphones, files=())


def read_channels(track: AudioTrack, onset_s: float, offset_s: float) -> ChannelSound:
    """Read a piece of every channel, by the recording's time, with silence for what lies outside the track."""
    begin, end = (round((at_s - track.start_s) * track.rate_hz) for at_s in (onset_s, offset_s))
    count = round(track.duration_s * track.rate_hz)
    inside_begin, inside_end = min(max(begin, 0), count), min(max(end, 0), count)
    piece = track.every_channel(inside_begin, inside_end)
    if not np.isfinite(piece).all():
        raise AudioError(f"{track.name} holds samples that are not finite numbers; convert it again from its source.")
    samples = np.zeros((piece.shape[1], max(end - begin, 0)), np.float32)
    if len(piece):
        samples[:, inside_begin - begin : inside_begin - begin + len(piece)] = piece.T
    return ChannelSound(samples, track.rate_hz)


def write_channels(path: Path, sound: ChannelSound) -> None:
    """Write sound of several channels; see ``audio.write_samples``."""
    write_samples(path, [sound.samples.T], sound.rate_hz, len(sound.samples))


def level_faults(track: AudioTrack, name: str = "") -> tuple[list[str], list[str]]:
    """Return what is useless of a track, and which of its channels are clipped: their loud sounds are like others.

    Useless is silence; of an array, a channel that is dead or another's copy, since it shows no direction (exchanged
    ones show along the drive). One in which sounds and silence take turns was put together so.
    """
    samples = _looked_at(track)
    silent = _silent(samples, track, name) if track.microphones is None or not np.ptp(samples) else []
    if silent:
        check = " Check the microphones, and which input was recorded." if track.microphones is not None else ""
        return [silent[0] + check], []
    useless = [] if track.microphones is None else [*_dead(samples, track, name), *_copied(samples, track, name)]
    return useless, _clipped(samples, track)


def _looked_at(track: AudioTrack) -> Float[np.ndarray, "k m n"]:
    count = round(track.duration_s * track.rate_hz)
    length = min(round(_LOOK_S * track.rate_hz), count)
    begins = np.linspace(0, count - length, _LOOKS).round().astype(int)  # whole samples, so that all are as long
    edges_s = track.start_s + np.stack([begins, begins + length], axis=1) / track.rate_hz
    looks = [read_channels(track, *edges).samples for edges in edges_s.tolist()]
    return np.stack(looks).astype(np.float64)


def _named(track: AudioTrack, channel: int, name: str = "") -> str:
    return str(track.files[channel]) if track.files else f"Channel {_number(track, channel)} of {name or track.name}"


def _number(track: AudioTrack, channel: int) -> int:
    channels = track.microphones.channels if track.microphones else ()
    return 1 + (channels[channel] if channels else channel)


def _silent(samples: Float[np.ndarray, "k m n"], track: AudioTrack, name: str) -> list[str]:
    if samples.shape[2] < 2:
        return []
    still = np.ptp(samples, axis=2).max(axis=1) == 0.0
    if still.all() and not any(np.ptp(block.samples) for block in track.blocks()):
        return [f"{name or track.name} is silent throughout: every sample is {samples[0, 0, 0]:g}."]
    where = np.flatnonzero(still)
    # Digital silence between sounds as well is of a gate, or of a track that was put together so.
    if still.all() or len(where) < len(still) / 2 or where[-1] - where[0] >= len(where):
        return []
    edges_s = track.start_s + np.linspace(0.0, track.duration_s, len(still) + 1)
    from_s, to_s = edges_s[[where[0], where[-1] + 1]].tolist()
    return [
        f"{name or track.name} is silent in one piece from about {from_s:.0f} to {to_s:.0f} s "
        f"({len(where) / len(still):.0%}): every sample is {samples[where[0], 0, 0]:g} there, and not elsewhere."
    ]


def _dead(samples: Float[np.ndarray, "k m n"], track: AudioTrack, name: str = "") -> list[str]:
    level_db = 10.0 * np.log10((samples**2).mean(axis=(0, 2)) + 1e-20)
    dead = np.flatnonzero(level_db < level_db.max() - _DEAD_DB)
    return [
        f"{_named(track, int(i), name)} is {level_db.max() - level_db[i]:.0f} dB below the loudest, as of a microphone "
        "that is not connected; check it, or leave it out."
        for i in dead
    ]


def _copied(samples: Float[np.ndarray, "k m n"], track: AudioTrack, name: str = "") -> list[str]:
    power = (samples**2).mean(axis=(0, 2))
    said: dict[int, str] = {}
    for one, other in itertools.combinations(range(len(power)), 2):
        if one in said or other in said:
            continue
        scale = float((samples[:, one] * samples[:, other]).mean()) / max(float(power[one]), 1e-20)
        rest = float(((samples[:, other] - scale * samples[:, one]) ** 2).mean())
        if power[one] > 0.0 and 10.0 * np.log10((rest + 1e-20) / (float(power[other]) + 1e-20)) < -_DEAD_DB:
            said[other] = (
                f"{_named(track, other, name)} holds the same sound as channel {_number(track, one)}, as of one "
                "microphone that was copied, so that both together show no direction; record each microphone's own "
                "channel."
            )
    return list(said.values())


def _clipped(samples: Float[np.ndarray, "k m n"], track: AudioTrack) -> list[str]:
    full = np.abs(samples) >= _FULL_SCALE
    held = (full[..., 1:] & full[..., :-1]).mean(axis=(0, 2))
    return [
        f"{_named(track, int(i))} is clipped in {held[i]:.1%} of its samples; record with less gain."
        for i in np.flatnonzero(held > _CLIPPED)
    ]


# A track that grows: its samples go to a file, from which it is read like any other

GAP_S = 0.1  # a piece that is later or earlier than this is not in its place; less is the difference of two clocks
LONGEST_GAP_S = 600.0  # a longer one is another clock
_LARGEST = 16.0  # samples beyond this come from another scale
_BYTES = 4
_SILENCE_S = 10


@dataclass(frozen=True, slots=True)
class RawTrack(AudioTrack):
    """A track of float32 samples in a file without a head, from sample ``first`` on; more may follow those that it has.

    Of several channels, whose samples take turns in the file, it sounds as its first.
    """

    first: int = 0
    channels: int = 1

    def blocks(self, seconds: float = 10.0) -> Iterator[Sound]:
        size, count = max(1, round(seconds * self.rate_hz)), round(self.duration_s * self.rate_hz)
        for at in range(0, count, size):
            yield Sound(self._samples(at, min(at + size, count)), self.rate_hz)

    def since(self, sample: int) -> "RawTrack":
        left = round(self.duration_s * self.rate_hz) - sample
        return replace(
            self,
            first=self.first + sample,
            start_s=self.start_s + sample / self.rate_hz,
            duration_s=left / self.rate_hz,
        )

    def every_channel(self, begin: int, end: int) -> Float32[np.ndarray, "n m"]:
        offset = _BYTES * self.channels * (self.first + begin)
        samples = np.fromfile(self.path, np.float32, (end - begin) * self.channels, offset=offset)
        if len(samples) < (end - begin) * self.channels:
            lost = (end - begin) * self.channels - len(samples)
            raise AudioError(f"{self.path} lost its sound: {lost} samples are missing.")
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
        self._file, self._rate_hz, self.channels, self._start_s, self._count = file, 0, 0, 0.0, 0
        self.gaps, self.gap_s, self.overlaps = 0, 0.0, 0

    @property
    def track(self) -> RawTrack | None:
        if not self._count:
            return None
        return RawTrack(self._file, self._rate_hz, self._count / self._rate_hz, self._start_s, channels=self.channels)

    @property
    def end_s(self) -> float | None:
        return None if not self._count else self._start_s + self._count / self._rate_hz

    def add(self, chunk: Any, stamp_s: Any = None) -> None:
        """Take a ``Sound`` or a ``ChannelSound``, and when its first sample sounds on the frames' clock.

        AudioError: it is no sound, has another rate or other channels, repeats what came, or is of another clock.
        """
        sound = _checked_piece(chunk, self._rate_hz, self.channels)
        at_s = None if stamp_s is None else as_number(stamp_s)
        if stamp_s is not None and (at_s is None or not isfinite(at_s)):
            raise AudioError(f"stamp_s of a piece of sound must be a finite number of seconds, not {stamp_s!r}.")
        channels, count = sound.samples.shape
        if not count:
            return
        end_s = self.end_s
        if end_s is None:
            self._rate_hz, self.channels = sound.rate_hz, channels
            self._start_s = 0.0 if at_s is None else at_s
            self._append([sound])
            return
        late_s = 0.0 if at_s is None else at_s - end_s
        if late_s > LONGEST_GAP_S:
            raise AudioError(
                f"A piece of sound at {at_s:.3f} s comes {late_s:.0f} s after the sound before it ended "
                f"({end_s:.3f} s), more than {LONGEST_GAP_S:.0f} s; give stamps of the frames' clock."
            )
        if late_s >= GAP_S:
            self._append(_filling(channels, round(late_s * sound.rate_hz), sound.rate_hz))
            self.gaps, self.gap_s = self.gaps + 1, self.gap_s + late_s
        if late_s <= -GAP_S:
            known = round(-late_s * sound.rate_hz)
            if known >= sound.samples.shape[1]:
                begin_s = end_s + late_s
                raise AudioError(
                    f"A piece of sound from {begin_s:.3f} to {begin_s + sound.duration_s:.3f} s lies before the end of "
                    f"the sound that came ({end_s:.3f} s): it is repeated or out of order, and was left out."
                )
            sound = ChannelSound(sound.samples[:, known:], sound.rate_hz)
            self.overlaps += 1
        self._append([sound])

    def _append(self, sounds: Iterable[ChannelSound]) -> None:
        count = 0
        try:
            with self._file.open("r+b" if self._file.exists() else "xb") as stream:
                stream.seek(_BYTES * self.channels * self._count)  # what a full disk left half written is written again
                for sound in sounds:
                    stream.write(np.ascontiguousarray(sound.samples.T, np.float32).data)
                    count += sound.samples.shape[1]
        except OSError as fault:
            raise AudioError(
                f"{self._file} cannot be written ({fault.strerror or fault}), so that sound is lost; make room for it."
            ) from fault
        self._count += count


def _filling(channels: int, count: int, rate_hz: int) -> Iterator[ChannelSound]:
    step = _SILENCE_S * rate_hz
    for at in range(0, count, step):
        yield ChannelSound(np.zeros((channels, min(step, count - at)), np.float32), rate_hz)


def _checked_piece(chunk: Any, rate_hz: int, channels: int) -> ChannelSound:
    if not isinstance(chunk, Sound | ChannelSound):
        raise AudioError(
            f"A piece of sound must be an avlmaps.Sound(samples, rate_hz), not {type(chunk).__name__}; of several "
            "channels an avlmaps.ChannelSound."
        )
    samples = chunk.samples if isinstance(chunk, ChannelSound) else chunk.samples[None]
    wanted_hz, wanted = rate_hz or max(chunk.rate_hz, LOWEST_RATE_HZ), channels or len(samples)
    if (chunk.rate_hz, len(samples)) != (wanted_hz, wanted):
        raise AudioError(
            f"A piece of sound has {chunk.rate_hz} samples a second in {len(samples)} channel(s); {wanted_hz} in "
            f"{wanted} are needed: a map has one track, of one rate with all of its channels."
        )
    peak = float(np.abs(samples).max(initial=0.0))
    if not peak <= _LARGEST:  # NaN is not
        raise AudioError(f"A piece of sound holds samples as large as {peak:.3g}; they must lie in [-1, 1].")
    return ChannelSound(np.clip(samples, -1.0, 1.0), chunk.rate_hz)
