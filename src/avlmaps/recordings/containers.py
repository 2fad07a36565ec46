"""Getting mono samples out of sound files and videos: libsndfile for the plain formats, FFmpeg for the rest."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.errors import AudioError, NoAudioStreamError
from avlmaps.core.files import SOUND_BYTES, checked_size

if TYPE_CHECKING:
    import soundfile

_PLAIN = {
    ".wav", ".wave", ".bwf", ".rf64", ".w64", ".flac", ".ogg", ".oga", ".opus", ".aif", ".aiff", ".caf", ".au", ".snd",
}  # fmt: skip
# First bytes of the containers that hold their own samples, and the suffix by which the readers know each.
_SELF_CONTAINED = (
    (0, b"RIFF", ".wav"), (0, b"fLaC", ".flac"), (0, b"OggS", ".ogg"), (4, b"ftyp", ".m4a"), (0, b"ID3", ".mp3"),
    (0, b"\xff\xfb", ".mp3"), (0, b"\xff\xf3", ".mp3"), (0, b"\xff\xf2", ".mp3"), (0, b"\x1a\x45\xdf\xa3", ".mkv"),
)  # fmt: skip
_PIECE_SAMPLES = 1 << 16
_UNKNOWN = 1 << 48  # a FLAC that was written to a pipe may say that it has this many samples or more
_STREAMED_BYTES = 0xFFFFFFFF - 0xFFFF  # of a WAV that says nothing of its length
_PREROLL_S = 1.0  # a decoder that starts in the middle needs a while until its output is right
_RESYNC_S = 0.05  # stamps are rounded (to 1 ms in mkv); only a larger jump is a gap
_LOOKS, _LOOK_S = 20, 0.25  # of a file, to find out which of its channels are heard
_SLACK_S = 0.5  # containers round their durations, encoders drop or pad a few hundred samples


def self_contained_suffix(content: bytes) -> str | None:
    """Return the suffix of a sound that another sent, by its first bytes; None where it may refer to other files.

    A playlist would make FFmpeg open the files that it names. What comes from elsewhere is read only under this suffix.
    """
    return next((suffix for at, magic, suffix in _SELF_CONTAINED if content[at : at + len(magic)] == magic), None)


def truncation_error(path: Path, found_s: float, promised_s: float) -> AudioError:
    """Return the error for a file that ends before it should."""
    return AudioError(f"{path} is truncated: of {promised_s:.2f} s it ends at {found_s:.2f} s; copy it again.")


def examine(path: Path) -> tuple[int, int]:
    """Return samples a second and the number of samples."""
    try:
        checked_size(path, SOUND_BYTES)
    except OSError as error:
        what = "does not exist"
        if path.is_dir():
            what = "is a folder, not a sound file"
        elif not isinstance(error, FileNotFoundError):
            what = f"cannot be read as sound ({error.strerror or error})"
        raise AudioError(f"{path} {what}; give a wav, flac, ogg, mp3, m4a, mp4 or mkv file.") from None
    rate_hz, count = _examine_plain(path) if _is_plain(path) else _examine_video(path)
    if count < 1:
        raise AudioError(f"{path} has an audio stream without a single sample; record or convert it again.")
    return rate_hz, count


def read_piece(path: Path, begin: int, end: int, rate_hz: int, channel: int | None = None) -> Float32[np.ndarray, " n"]:
    """Return the mono samples ``begin:end``; fewer where the file ends before."""
    if not _is_plain(path):
        pieces = list(_placed(path, begin, end, rate_hz, channel))
        return np.concatenate(pieces) if pieces else np.zeros(0, np.float32)
    return _mono(read_all_channels(path, begin, end, rate_hz), channel)


def stream(path: Path, count: int, rate_hz: int, channel: int | None = None) -> Iterator[Float32[np.ndarray, " _"]]:
    """Go through the first ``count`` mono samples in pieces of any length; fewer where the file ends before."""
    if not _is_plain(path):
        yield from _placed(path, 0, count, rate_hz, channel)
        return
    with _opened_plain(path) as file:
        while count > 0:
            try:
                piece = file.read(min(_PIECE_SAMPLES, count), dtype="float32", always_2d=True)
            except RuntimeError as error:
                raise _unreadable(path, error) from None
            if not len(piece):
                return
            count -= len(piece)
            yield _mono(piece, channel)


def channel_power(path: Path, count: int, rate_hz: int) -> Float[np.ndarray, " c"]:
    """Return the mean power of each channel in ``_LOOKS`` pieces spread over a file."""
    length = min(count, round(_LOOK_S * rate_hz))
    begins = np.linspace(0, count - length, min(_LOOKS, max(1, count // max(length, 1)))).astype(int).tolist()
    pieces = [read_all_channels(path, begin, begin + length, rate_hz) for begin in begins]
    return np.mean(
        [(piece**2).mean(axis=0) for piece in pieces if len(piece) and piece.shape[1] == pieces[-1].shape[1]], axis=0
    )


def read_all_channels(path: Path, begin: int, end: int, rate_hz: int) -> Float32[np.ndarray, "n channels"]:
    """Return the samples ``begin:end`` of every channel; fewer where the file ends before."""
    if _is_plain(path):
        with _opened_plain(path) as file:
            try:
                file.seek(begin)
                return file.read(end - begin, dtype="float32", always_2d=True)
            except RuntimeError as error:
                raise _unreadable(path, error) from None
    pieces: list[Float32[np.ndarray, "n channels"]] = []
    for time_s, samples in _frames(path, begin / rate_hz):
        at = round(time_s * rate_hz)
        if not pieces or samples.shape[1] == pieces[0].shape[1]:
            pieces.append(samples[max(begin - at, 0) : max(end - at, 0)])
        if at + len(samples) >= end:
            break
    return np.concatenate(pieces) if pieces else np.zeros((0, 1), np.float32)


def _is_plain(path: Path) -> bool:
    return path.suffix.lower() in _PLAIN


def _mono(samples: Float32[np.ndarray, "n channels"], channel: int | None = None) -> Float32[np.ndarray, " n"]:
    if channel is not None:
        return samples[:, min(channel, samples.shape[1] - 1)].copy()
    return samples[:, 0].copy() if samples.shape[1] == 1 else samples.mean(axis=1, dtype=np.float32)


def _unreadable(path: Path, error: Exception) -> AudioError:
    reason = str(error).strip().rstrip(".") or type(error).__name__
    return AudioError(f"{path} cannot be read as sound ({reason}); convert it again, preferably to FLAC.")


def _opened_plain(path: Path) -> "soundfile.SoundFile":
    import soundfile

    try:
        return soundfile.SoundFile(str(path))
    except (RuntimeError, OSError) as error:
        if path.is_file() and path.stat().st_size == 0:
            raise AudioError(f"{path} is empty (0 bytes); record or copy it again.") from None
        reason = getattr(error, "error_string", None) or error
        raise _unreadable(path, RuntimeError(str(reason))) from None


def _examine_plain(path: Path) -> tuple[int, int]:
    with _opened_plain(path) as file:
        rate_hz, count = int(file.samplerate), int(file.frames)
        if _is_short_wav(path):
            raise AudioError(f"{path} is truncated: it is shorter than its header promises; copy or convert it again.")
        if 0 < count < _UNKNOWN:
            return rate_hz, count
        whole: Any = file
        whole.seek(0)
        return rate_hz, sum(len(piece) for piece in whole.blocks(_PIECE_SAMPLES, dtype="float32"))


def _is_short_wav(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(12)
    promised = int.from_bytes(head[4:8], "little")
    streamed = promised == 0 or promised >= _STREAMED_BYTES
    return head[:4] == b"RIFF" and head[8:] == b"WAVE" and not streamed and promised + 7 > path.stat().st_size


def _examine_video(path: Path) -> tuple[int, int]:
    import av
    from av.error import FFmpegError

    try:
        with av.open(str(path)) as container:
            if not container.streams.audio:
                raise NoAudioStreamError(f"{path} has no audio stream; give a file that has one.")
            audio = container.streams.audio[0]
            rate_hz = int(audio.codec_context.sample_rate)
            zero_s = (container.start_time or 0) / av.time_base
            if container.streams.video and audio.duration is not None and audio.time_base is not None:
                end_s = float((audio.duration + (audio.start_time or 0)) * audio.time_base) - zero_s
            elif container.streams.video and container.duration is not None:
                end_s = container.duration / av.time_base
            else:  # sound alone: going through the packets costs little, and an mp3 knows its length no other way
                end_s = _end_of_packets(container, audio) - zero_s
    except FFmpegError as error:
        raise _unreadable(path, error) from None
    if next(_frames(path, 0.0), None) is None:
        end_s = 0.0
    return rate_hz, round(end_s * rate_hz)


def _end_of_packets(container: Any, audio: Any) -> float:
    end = 0
    for packet in container.demux(audio):
        if packet.pts is not None:
            end = max(end, packet.pts + (packet.duration or 0))
    return float(end * audio.time_base)


def _frames(path: Path, from_s: float) -> Iterator[tuple[float, Float32[np.ndarray, "n channels"]]]:
    import av
    from av.error import FFmpegError

    try:
        with av.open(str(path)) as container:
            audio = container.streams.audio[0]
            zero_s = (container.start_time or 0) / av.time_base
            if from_s > _PREROLL_S and audio.time_base is not None:
                target = int((from_s - _PREROLL_S + zero_s) / audio.time_base)
                container.seek(target, stream=audio, backward=True)
            resampler = av.AudioResampler(format="fltp")
            for frame in container.decode(audio):
                for plain in resampler.resample(frame):
                    if plain.pts is not None and plain.time_base is not None:
                        yield float(plain.pts * plain.time_base) - zero_s, plain.to_ndarray().T
    except FFmpegError as error:
        raise _unreadable(path, error) from None


def _placed(
    path: Path, begin: int, end: int, rate_hz: int, channel: int | None = None
) -> Iterator[Float32[np.ndarray, " _"]]:
    # gaps between the container's stamps are filled with silence
    at, started = begin, False
    for time_s, every in _frames(path, begin / rate_hz):
        samples, index = _mono(every, channel), round(time_s * rate_hz)
        if started and abs(index - at) < _RESYNC_S * rate_hz:
            index = at
        while at < min(index, end):
            gap = np.zeros(min(min(index, end) - at, _PIECE_SAMPLES), np.float32)
            at += len(gap)
            yield gap
        fresh = samples[at - index : end - index] if index < end else samples[:0]
        if len(fresh):
            started = True
            at += len(fresh)
            yield fresh
        if at >= end:
            return
    if end - at <= _SLACK_S * rate_hz:
        yield np.zeros(end - at, np.float32)
