"""The sound of a ROS bag: `audio_common` messages, gathered into one file that can be read in pieces."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.recordings.audio import AudioTrack


def extract_audio(
    messages: Iterable[tuple[int, Any]], info: Any, topic: str, folder: Path, start_s: float
) -> tuple[AudioTrack | None, tuple[str, ...]]:
    """Write audio messages into a file: PCM as FLAC, a compressed stream (MP3 is the package's default) as it is.

    Args:
        messages: (receive time in ns, AudioData or AudioDataStamped).
        info: the AudioInfo message, or None where the bag has none.
        topic: for sentences.
        folder: where the file goes.
        start_s: the recording's start on the clock of the receive times, seconds.

    Returns:
        The track, or None with a sentence that says why there is none.
    """
    coding = (getattr(info, "coding_format", "") or "mp3").lower()
    if coding in ("wave", "wav", "pcm"):
        sample_format = getattr(info, "sample_format", "") or "S16LE"
        if sample_format.upper() != "S16LE":
            return None, (f"The sound on {topic} is {sample_format}; of plain samples only S16LE is read.",)
        target = folder / "audio.flac"
        first_ns = _write_pcm(messages, target, int(info.sample_rate), int(info.channels))
    else:
        target = folder / f"audio.{coding}"
        first_ns = _write_stream(messages, target)
    if first_ns is None:
        return None, (f"The sound topic {topic} has no message.",)
    return AudioTrack.open(target, start_s=first_ns * 1e-9 - start_s), ()


def _content(message: Any) -> bytes:
    return np.asarray(getattr(message, "audio", message).data, np.uint8).tobytes()


def _write_pcm(messages: Iterable[tuple[int, Any]], target: Path, rate_hz: int, channels: int) -> int | None:
    import soundfile

    first_ns = None
    rest = b""  # a message may end within a sample
    with soundfile.SoundFile(target, "w", rate_hz, channels, "PCM_16") as stream:
        for received_ns, message in messages:
            first_ns = received_ns if first_ns is None else first_ns
            content = rest + _content(message)
            whole = len(content) // (2 * channels) * 2 * channels
            stream.buffer_write(content[:whole], dtype="int16")
            rest = content[whole:]
    return first_ns


def _write_stream(messages: Iterable[tuple[int, Any]], target: Path) -> int | None:
    first_ns = None
    with target.open("wb") as stream:
        for received_ns, message in messages:
            first_ns = received_ns if first_ns is None else first_ns
            stream.write(_content(message))
    return first_ns
