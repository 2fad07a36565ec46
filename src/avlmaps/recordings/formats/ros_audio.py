"""The sound of a ROS bag, gathered into one file that can be read in pieces.

Two packages are called ``audio_common_msgs``. That of ROS 1 (and its port) has AudioData or AudioDataStamped with
bytes, and an AudioInfo on a topic of its own that says how they are coded. That of ROS 2 has AudioStamped, each with
samples and an AudioInfo (PortAudio's numbers of formats).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.audio import LOWEST_RATE_HZ, AudioTrack

STAMPED = "audio_common_msgs/msg/AudioStamped"
_PCM = ("wave", "wav", "pcm")
_HIGHEST_RATE_HZ = 400_000
_MOST_CHANNELS = 64
_FLAC_CHANNELS = 8
# PortAudio's paFloat32, paInt32, paInt16, paInt8, paUInt8: the field that holds the samples, their type and full scale.
_SAMPLES = {
    1: ("float32_data", "<f4", 1.0),
    2: ("int32_data", "<i4", 2.0**31),
    8: ("int16_data", "<i2", 2.0**15),
    16: ("int8_data", "i1", 2.0**7),
    32: ("uint8_data", "u1", 2.0**7),
}
# How files and streams begin that FFmpeg and libsndfile know.
_BEGINNINGS = {b"ID3": "mp3", b"RIFF": "wav", b"OggS": "ogg", b"fLaC": "flac"}


@dataclass(frozen=True, slots=True)
class Pcm:
    """Plain samples: how many a second, and how many channels."""

    rate_hz: int
    channels: int

    @classmethod
    def parse_rate(cls, words: str) -> "Pcm":
        """Read ``16000`` or ``16000,2`` (samples a second, channels).

        Raises:
            RecordingError: it is not that, or no sound has such numbers.
        """
        rate, _, channels = words.partition(",")
        if not (rate.strip().isdecimal() and (not channels or channels.strip().isdecimal())):
            raise RecordingError(f"audio_pcm takes samples a second and channels, such as 16000,1; not {words!r}.")
        return cls.check_rate(int(rate), int(channels or 1), "audio_pcm")

    @classmethod
    def check_rate(cls, rate_hz: int, channels: int, what: str) -> "Pcm":
        """Return the numbers, or raise ``RecordingError`` where no sound has them."""
        if not (LOWEST_RATE_HZ <= rate_hz <= _HIGHEST_RATE_HZ and 1 <= channels <= _MOST_CHANNELS):
            raise RecordingError(
                f"{what} says {rate_hz} samples a second and {channels} channel(s), which no sound has; name the right "
                "ones (audio_pcm=16000,1), give a file (--audio), or leave the sound out (audio=none)."
            )
        return cls(rate_hz, channels)


def extract_audio(
    messages: Iterable[tuple[int, Any]], info: Any, topic: str, folder: Path, start_s: float, pcm: Pcm | None = None
) -> tuple[AudioTrack | None, tuple[str, ...]]:
    """Write audio messages into a file: samples as FLAC, a compressed stream (MP3 is the package's default) as it is.

    Args:
        messages: (receive time in ns, AudioData, AudioDataStamped or AudioStamped).
        info: the AudioInfo message, or None where the bag has none.
        topic: for sentences.
        folder: where the file goes.
        start_s: the recording's start on the clock of the receive times, seconds.
        pcm: says that the messages are plain 16-bit samples, against AudioInfo if need be.

    Returns:
        The track, or None with a sentence that says why there is none.

    Raises:
        RecordingError: nothing says how the samples are coded, or what is said cannot be.
        AudioError: what was gathered cannot be read as sound.
    """
    rest = iter(messages)
    first = next(rest, None)
    if first is None:
        return None, (f"The sound topic {topic} has no message.",)
    every, start_s = chain([first], rest), first[0] * 1e-9 - start_s
    target = folder / "audio.flac"
    if getattr(first[1], "__msgtype__", "") == STAMPED:
        _write_samples(every, topic, target)
        return AudioTrack.open(target, start_s=start_s), ()
    coding = (getattr(info, "coding_format", "") or "").lower()
    if pcm is None and coding in _PCM:
        sample_format = getattr(info, "sample_format", "") or "S16LE"
        if sample_format.upper() != "S16LE":
            return None, (f"The sound on {topic} is {sample_format}; of plain samples only S16LE is read.",)
        pcm = Pcm.check_rate(int(info.sample_rate), int(info.channels), f"The AudioInfo of {topic}")
    if pcm is not None:
        _write_pcm(every, target, pcm)
        return AudioTrack.open(target, start_s=start_s), ()
    target = folder / f"audio.{_coding_of(_content(first[1]), coding, topic)}"
    with target.open("wb") as stream:
        for _, message in every:
            stream.write(_content(message))
    return AudioTrack.open(target, start_s=start_s), ()


def _coding_of(beginning: bytes, said: str, topic: str) -> str:
    """Return the coding of a stream: what AudioInfo says, or what it begins like."""
    if said:
        if not (said.isalnum() and len(said) < 10):
            raise RecordingError(
                f"The AudioInfo of {topic} says that the sound is coded as {said[:20]!r}, which is no coding; give a "
                "file (--audio FILE) or leave it out (--topics audio=none)."
            )
        return said
    for start, coding in _BEGINNINGS.items():
        if beginning.startswith(start):
            return coding
    if len(beginning) > 2 and beginning[0] == 0xFF and beginning[1] & 0xE6 == 0xE2:  # an MPEG frame of layer 3
        return "mp3"
    raise RecordingError(
        f"The sound on {topic} has no AudioInfo and is not an MP3, FLAC, OGG or WAV stream; if it is plain 16-bit "
        "samples, say how many a second and in how many channels (--topics audio_pcm=16000,1), else give a file "
        "(--audio FILE) or leave it out (--topics audio=none)."
    )


def _content(message: Any) -> bytes:
    return np.asarray(getattr(message, "audio", message).data, np.uint8).tobytes()


def _write_pcm(messages: Iterable[tuple[int, Any]], target: Path, pcm: Pcm) -> None:
    import soundfile

    rest = b""  # a message may end within a sample
    with soundfile.SoundFile(target, "w", pcm.rate_hz, min(pcm.channels, _FLAC_CHANNELS), "PCM_16") as stream:
        for _, message in messages:
            content = rest + _content(message)
            whole = len(content) // (2 * pcm.channels) * 2 * pcm.channels
            stream.write(np.frombuffer(content[:whole], "<i2").reshape(-1, pcm.channels)[:, :_FLAC_CHANNELS])
            rest = content[whole:]


def _write_samples(messages: Iterable[tuple[int, Any]], topic: str, target: Path) -> None:
    """Write AudioStamped messages, which must all be of one rate and number of channels."""
    import soundfile

    pieces = _pieces(messages, topic)
    pcm, samples = next(pieces)
    with soundfile.SoundFile(target, "w", pcm.rate_hz, min(pcm.channels, _FLAC_CHANNELS), "PCM_16") as stream:
        stream.write(samples)
        for other, more in pieces:
            if other != pcm:
                raise RecordingError(
                    f"The sound on {topic} changes from {pcm.rate_hz} to {other.rate_hz} samples a second, or from "
                    f"{pcm.channels} to {other.channels} channel(s); give one file instead (--audio FILE)."
                )
            stream.write(more)


def _pieces(messages: Iterable[tuple[int, Any]], topic: str) -> Iterator[tuple[Pcm, np.ndarray]]:
    for _, message in messages:
        audio, info = message.audio.audio_data, message.audio.info
        if int(info.format) not in _SAMPLES:
            raise RecordingError(
                f"The sound on {topic} has PortAudio's format {info.format}; of samples "
                f"{', '.join(map(str, _SAMPLES))} are read (8 is 16-bit). Give a file instead (--audio FILE)."
            )
        name, dtype, scale = _SAMPLES[int(info.format)]
        pcm = Pcm.check_rate(int(info.rate), int(info.channels), f"The AudioInfo of {topic}")
        samples = np.asarray(getattr(audio, name)).astype(dtype).astype(np.float64)
        whole = samples[: len(samples) // pcm.channels * pcm.channels].reshape(-1, pcm.channels)[:, :_FLAC_CHANNELS]
        middle = 128.0 if dtype == "u1" else 0.0
        yield pcm, np.clip(np.nan_to_num((whole - middle) / scale), -1.0, 1.0)
