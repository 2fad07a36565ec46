"""Sound of several microphones at once: reading it, writing it, and what can be wrong with its channels."""

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.recordings.audio import AudioTrack, Sound, require_rate
from avlmaps.recordings.microphones import MicrophoneNumbers, Microphones

_LOOKS, _LOOK_S = 24, 0.5
_DEAD_DB = 40.0  # a channel this much below the loudest holds nothing of use
_PAUSE_S, _PAUSES = 0.05, 200  # of digital silence; the number that is read at once
_FULL_SCALE, _CLIPPED = 0.999, 1e-3
_WAV = ".wav"


@dataclass(frozen=True, slots=True)
class ChannelSound:
    """A piece of sound of several channels.

    Attributes:
        samples: (m, n) float32 in [-1, 1].
        rate_hz: samples a second.
    """

    samples: Float[np.ndarray, "m n"]
    rate_hz: int

    def __post_init__(self) -> None:
        if self.samples.ndim != 2 or self.samples.dtype != np.float32:
            raise ValueError(f"samples are {self.samples.dtype} of {self.samples.shape}; they must be float32 (m, n)")
        object.__setattr__(self, "rate_hz", require_rate(self.rate_hz))

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.samples.shape[1] / self.rate_hz

    def channel(self, number: int) -> Sound:
        """Return one channel."""
        return Sound(np.ascontiguousarray(self.samples[number]), self.rate_hz)


def with_microphones(track: AudioTrack, microphones: Microphones, files: tuple[Path, ...] = ()) -> AudioTrack:
    """Return a track that knows where its channels' microphones are; as one channel it sounds as its first.

    Args:
        track: the sound file, or the first of several.
        microphones: one for each channel.
        files: one for each channel, where they are not channels of one file.

    Raises:
        RecordingError: there are more or fewer channels than microphones.
        AudioError: files of channels have another length or rate.
    """
    from dataclasses import replace

    if files and len(files) != len(microphones):
        raise RecordingError(
            f"The recording has {len(files)} files of channels, but {len(microphones)} microphone(s) are described; "
            "give one position for each."
        )
    if files:
        for path in files[1:]:
            other = AudioTrack.open(path, track.start_s)
            for name, here, there in (
                ("samples a second", track.rate_hz, other.rate_hz),
                ("samples", round(track.duration_s * track.rate_hz), round(other.duration_s * other.rate_hz)),
            ):
                if here != there:
                    raise AudioError(
                        f"The channels disagree: {track.path} has {here} {name}, {path} has {there}; export them "
                        "together, from one clock."
                    )
    elif (count := track.every_channel(0, 1).shape[1]) != len(microphones):
        raise RecordingError(
            f"{track.path} has {count} channel(s), but the recording describes {len(microphones)} microphone(s); give "
            "one position for each channel."
        )
    return replace(track, channel=0, microphones=microphones, files=files)


def tracked(track: AudioTrack, given: MicrophoneNumbers, folder: Path) -> AudioTrack:
    """Return the track of a recording's folder with the microphones that its description gives."""
    files = tuple(folder / name for name in given.files or ())
    return with_microphones(track, given.microphones(), files)


def read_channels(track: AudioTrack, onset_s: float, offset_s: float) -> ChannelSound:
    """Read a piece of every channel, with silence for what lies outside the track.

    Args:
        track: of one channel or several.
        onset_s: where the piece begins, the recording's time.
        offset_s: where it ends.

    Raises:
        AudioError: the file cannot be read, or holds samples that are not finite numbers.
    """
    begin, end = (round((at_s - track.start_s) * track.rate_hz) for at_s in (onset_s, offset_s))
    count = round(track.duration_s * track.rate_hz)
    inside_begin, inside_end = min(max(begin, 0), count), min(max(end, 0), count)
    piece = track.every_channel(inside_begin, inside_end)
    if not np.isfinite(piece).all():
        raise AudioError(f"{track.path} holds samples that are not finite numbers; convert it again from its source.")
    samples = np.zeros((piece.shape[1], max(end - begin, 0)), np.float32)
    if len(piece):
        samples[:, inside_begin - begin : inside_begin - begin + len(piece)] = piece.T
    return ChannelSound(samples, track.rate_hz)


def write_channels(path: Path, sound: ChannelSound) -> None:
    """Write sound of several channels as 16-bit FLAC (up to 8) or WAV, by the file's suffix; all or nothing.

    Raises:
        AudioError: the disk is full.
    """
    import soundfile

    from avlmaps.core.files import replace_atomically

    kind = "WAV" if path.suffix.lower() == _WAV else "FLAC"
    with replace_atomically(path) as stream:
        try:
            with soundfile.SoundFile(
                stream.name, "w", sound.rate_hz, len(sound.samples), "PCM_16", format=kind
            ) as file:
                for at in range(0, sound.samples.shape[1], sound.rate_hz):  # a second at a time: long writes crash
                    file.write(np.clip(sound.samples[:, at : at + sound.rate_hz].T, -1.0, 1.0))
        except (soundfile.SoundFileError, AssertionError) as error:
            raise AudioError(f"{path} could not be written ({error or 'the disk may be full'}).") from error


def channel_faults(track: AudioTrack) -> list[str]:
    """Return a sentence for each fault of a track's channels: dead, copied or clipped.

    Looks at pieces spread over the track. Channels that are exchanged show only where they are compared with the
    geometry along the drive (``avlmaps.maps.sources.wiring``).
    """
    samples = _looked_at(track)
    return [*_dead(samples, track), *_copied(samples, track), *_clipped(samples, track)]


def level_faults(track: AudioTrack, name: str = "") -> tuple[list[str], list[str]]:
    """Return what is silent about a track, and which of its channels are clipped: their loud sounds are like others.

    Looks at pieces spread over the track. One in which sounds and silence take turns was put together so.

    Args:
        track: to look at.
        name: of the track in the sentences; its path if empty.
    """
    samples = _looked_at(track)
    silent = _silent(samples, track, name)
    return silent, [] if silent else _clipped(samples, track)


def useless_channels(track: AudioTrack, name: str = "") -> list[str]:
    """Return those of the faults with which an array shows no direction: channels that are dead, or another's copy.

    Args:
        track: to look at.
        name: of the track in the sentences; its path if empty.
    """
    samples = _looked_at(track)
    if not np.ptp(samples) and (silent := _silent(samples, track, name)):
        return [f"{silent[0]} Check the microphones, and which input was recorded."]
    return [*_dead(samples, track, name), *_copied(samples, track, name)]


def _looked_at(track: AudioTrack) -> Float[np.ndarray, "k m n"]:
    count = round(track.duration_s * track.rate_hz)
    length = min(round(_LOOK_S * track.rate_hz), count)
    begins = np.linspace(0, count - length, _LOOKS).round().astype(int)  # whole samples, so that all are as long
    edges_s = track.start_s + np.stack([begins, begins + length], axis=1) / track.rate_hz
    looks = [read_channels(track, *edges).samples for edges in edges_s.tolist()]
    return np.stack(looks).astype(np.float64)


def _named(track: AudioTrack, channel: int, name: str = "") -> str:
    return str(track.files[channel]) if track.files else f"Channel {channel + 1} of {name or track.path}"


def _silent(samples: Float[np.ndarray, "k m n"], track: AudioTrack, name: str) -> list[str]:
    """Find that no sample differs from the others, throughout or in one stretch of half of the track and more.

    A track that is digitally silent at other times as well, between its sounds, is of a gate (or was put together so).
    """
    if samples.shape[2] < 2:
        return []
    still = np.ptp(samples, axis=2).max(axis=1) == 0.0
    if still.all() and not any(np.ptp(block.samples) for block in track.blocks()):
        return [f"{name or track.path} is silent throughout: every sample is {samples[0, 0, 0]:g}."]
    where = np.flatnonzero(still)
    if still.all() or len(where) < len(still) / 2 or where[-1] - where[0] >= len(where):
        return []
    look_s = min(_LOOK_S, track.duration_s)
    begins_s = np.linspace(0.0, track.duration_s - look_s, len(still))
    before_s, behind_s = np.r_[0.0, begins_s][where[0]], np.r_[begins_s, track.duration_s][where[-1] + 1] + look_s
    if _has_pauses(track, float(before_s), float(behind_s)):
        return []
    edges_s = track.start_s + np.linspace(0.0, track.duration_s, len(still) + 1)
    from_s, to_s = edges_s[[where[0], where[-1] + 1]].tolist()
    return [
        f"{name or track.path} is silent in one piece from about {from_s:.0f} to {to_s:.0f} s "
        f"({len(where) / len(still):.0%}): every sample is {samples[where[0], 0, 0]:g} there, and not elsewhere."
    ]


def _has_pauses(track: AudioTrack, before_s: float, behind_s: float) -> bool:
    size = round(_PAUSE_S * track.rate_hz)
    for number, block in enumerate(track.blocks(_PAUSES * _PAUSE_S)):
        begin_s = _PAUSE_S * (number * _PAUSES + np.arange(len(block.samples) // size))
        pieces = block.samples[: len(begin_s) * size].reshape(-1, size)
        if (np.ptp(pieces, axis=1)[(begin_s + _PAUSE_S < before_s) | (begin_s > behind_s)] == 0.0).any():
            return True
    return False


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
    said: list[str] = []
    for one, other in itertools.combinations(range(len(power)), 2):
        scale = float((samples[:, one] * samples[:, other]).mean()) / max(float(power[one]), 1e-20)
        rest = float(((samples[:, other] - scale * samples[:, one]) ** 2).mean())
        if power[one] > 0.0 and 10.0 * np.log10((rest + 1e-20) / (float(power[other]) + 1e-20)) < -_DEAD_DB:
            said.append(
                f"{_named(track, other, name)} holds the same sound as channel {one + 1}, as of one microphone that "
                "was copied, so that both together show no direction; record each microphone's own channel."
            )
    return said


def _clipped(samples: Float[np.ndarray, "k m n"], track: AudioTrack) -> list[str]:
    full = np.abs(samples) >= _FULL_SCALE
    held = (full[..., 1:] & full[..., :-1]).mean(axis=(0, 2))
    return [
        f"{_named(track, int(i))} is clipped in {held[i]:.1%} of its samples; record with less gain."
        for i in np.flatnonzero(held > _CLIPPED)
    ]
