"""The sound of a ROS bag, gathered into one file that can be read in pieces, and directions that a device published.

Two packages are called ``audio_common_msgs``. That of ROS 1 (and its port) has AudioData or AudioDataStamped with
bytes, and an AudioInfo on a topic of its own that says how they are coded. That of ROS 2 has AudioStamped, each with
samples and an AudioInfo (PortAudio's numbers of formats). What they declare is held against when the messages came.
"""

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.wording import option
from avlmaps.recordings.audio import LOWEST_RATE_HZ, AudioTrack, write_samples
from avlmaps.recordings.faults import note
from avlmaps.recordings.formats.ros_messages import pose_of, stamp_of
from avlmaps.recordings.microphones import DirectionTrack

STAMPED = "audio_common_msgs/msg/AudioStamped"
_PCM = ("wave", "wav", "pcm")
_HIGHEST_RATE_HZ = 400_000
_MOST_CHANNELS = 64
_FLAC_CHANNELS = 8
GAP_S = 0.1  # less is the difference of two clocks
COMPRESSED_GAP_S = 1.0
_SILENT_BLOCK = 1 << 16
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


# Rates that recorders use, the likeliest first: with some channels one of them fits what came.
_USUAL_RATES_HZ = (16_000, 48_000, 44_100, 32_000, 8_000, 24_000, 22_050, 11_025, 96_000)
_USUAL_CHANNELS = (1, 2, 4, 6, 7, 8, 3, 16)
_FITS, _AGREES, _FEWEST_MESSAGES, _SHORTEST_S = 0.04, 1.25, 8, 1.0
# A clock that is this far from the pictures' is worth a notice.
_APART_S = 0.5
_NUMBERS = tuple(f"std_msgs/msg/{name}" for name in ("Int32", "Int16", "Float32", "Float64"))
DIRECTION_TYPES = (*_NUMBERS, "geometry_msgs/msg/PoseStamped")
BEYOND_A_TURN_RAD = 2.0 * np.pi + 1e-3


@dataclass(frozen=True, slots=True)
class PictureClock:
    """Turns the times at which a bag received messages into seconds of the recording, which begins at ``start_s``.

    Pictures carry stamps, and a bag notes when it received them. In simulation, and where a bag is replayed into
    another, the two are different clocks; what has no stamp of its own is placed as the pictures around it are, whose
    stamps are ``apart_s`` ahead (their median) and go from ``first_s`` to ``last_s``.
    """

    apart_s: float
    first_s: float
    last_s: float
    start_s: float

    @classmethod
    def of(cls, received_ns: np.ndarray, stamps_s: Float[np.ndarray, " n"], start_s: float) -> "PictureClock":
        apart_s = float(np.median(stamps_s - received_ns * 1e-9))
        return cls(apart_s, float(stamps_s.min()), float(stamps_s.max()), start_s)

    def of_received(self, received_s: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return the recording's time of messages without a stamp, by when they were received."""
        return received_s + self.apart_s - self.start_s

    def of_stamps(self, stamps_s: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        return stamps_s - self.start_s

    def overlaps(self, times_s: Float[np.ndarray, " k"]) -> bool:
        """Return whether times of the recording lie among its pictures, at least some."""
        first, last = self.first_s - self.start_s, self.last_s - self.start_s
        return bool(((times_s >= first) & (times_s <= last)).any())


@dataclass(frozen=True, slots=True)
class Pcm:
    """Plain samples: how many a second, and how many channels."""

    rate_hz: int
    channels: int

    @classmethod
    def parse_rate(cls, words: str) -> "Pcm":
        rate, _, channels = words.partition(",")
        if not (rate.strip().isdecimal() and (not channels or channels.strip().isdecimal())):
            raise RecordingError(f"audio_pcm takes samples a second and channels, such as 16000,1; not {words!r}.")
        return cls.check_rate(int(rate), int(channels or 1), "audio_pcm")

    @classmethod
    def check_rate(cls, rate_hz: int, channels: int, what: str) -> "Pcm":
        if not (LOWEST_RATE_HZ <= rate_hz <= _HIGHEST_RATE_HZ and 1 <= channels <= _MOST_CHANNELS):
            raise RecordingError(
                f"{what} says {rate_hz} samples a second and {channels} channel(s), which no sound has; name the right "
                f"ones (audio_pcm=16000,1), give a file ({option('audio')}), or leave the sound out (audio=none)."
            )
        return cls(rate_hz, channels)


@dataclass(frozen=True, slots=True)
class SoundTopic:
    """The sound messages of a bag, which are read twice: for their times, and for what they hold.

    ``messages`` gives (receive time in ns, AudioData, AudioDataStamped or AudioStamped) from the first on.
    """

    name: str
    messages: Callable[[], Iterable[tuple[int, Any]]]
    clock: PictureClock

    def times_s(self) -> Float[np.ndarray, " n"]:
        """Return when each message sounds, seconds of the recording.

        By the stamps in the messages where they lie among the pictures, else by when they were received.
        """
        received: list[int] = []
        stamps: list[float] = []
        for received_ns, message in self.messages():
            received.append(received_ns)
            stamps.append(stamp_of(message) if getattr(message, "header", None) is not None else float("nan"))
        by_stamp = self.clock.of_stamps(np.array(stamps))
        if len(stamps) and np.isfinite(by_stamp).all() and self.clock.overlaps(by_stamp):
            return by_stamp
        if abs(apart_s := self.clock.apart_s) > _APART_S:
            note(
                f"The stamps of the pictures are {apart_s:+.6g} s from when the bag received them; {self.name} has no "
                "stamps on their clock and is placed as they are."
            )
        return self.clock.of_received(np.array(received) * 1e-9)


def silences(
    times_s: Float[np.ndarray, " n"], lengths_s: Float[np.ndarray, " n"]
) -> tuple[float, Float[np.ndarray, " n"]]:
    """Return when the first message sounds, and how much silence belongs before each.

    Only what none of the later messages catches up is missing sound, of ``GAP_S`` and more: clocks differ a little.
    """
    before_s = np.concatenate([[0.0], np.cumsum(lengths_s)[:-1]])
    behind_s = np.minimum.accumulate((times_s - before_s)[::-1])[::-1]
    silence_s = np.zeros(len(times_s))
    filled_s = behind_s[0]
    for at in np.flatnonzero(np.diff(behind_s, prepend=behind_s[0]) > 0.0).tolist():
        if behind_s[at] - filled_s >= GAP_S:
            silence_s[at] = behind_s[at] - filled_s
            filled_s = behind_s[at]
    return float(behind_s[0]), silence_s


def extract_audio(sound: SoundTopic, info: Any, folder: Path, pcm: Pcm | None = None) -> AudioTrack | None:
    """Write audio messages into a file: samples as FLAC, a compressed stream (MP3 is the package's default) as it is.

    Where messages are missing the file is silent. ``info`` is the AudioInfo, and ``pcm`` says that the messages are
    plain 16-bit samples, against it if need be. Without a track, why is noted.
    """
    first = next(iter(sound.messages()), None)
    if first is None:
        note(f"The sound topic {sound.name} has no message.")
        return None
    times_s = sound.times_s()
    if getattr(first[1], "__msgtype__", "") == STAMPED:
        return _sampled(lambda: sampled_pieces(_messages(sound), sound.name), sound.name, folder, times_s)
    content = _content(first[1])
    coding = next((known for start, known in _BEGINNINGS.items() if content.startswith(start)), "")
    coding = coding or (getattr(info, "coding_format", "") or "").lower()
    if pcm is None and coding in _PCM and not content.startswith(b"RIFF"):
        sample_format = getattr(info, "sample_format", "") or "S16LE"
        if sample_format.upper() != "S16LE":
            note(f"The sound on {sound.name} is {sample_format}; of plain samples only S16LE is read.")
            return None
        pcm = Pcm.check_rate(int(info.sample_rate), int(info.channels), f"The AudioInfo of {sound.name}")
    if pcm is not None:
        return _sampled(lambda: _plain(_messages(sound), pcm), sound.name, folder, times_s)
    track = _compressed(sound, _coding_of(sound, content, coding, times_s), folder, times_s)
    if info is not None and int(info.sample_rate) not in (0, track.rate_hz):
        note(
            f"The AudioInfo of {sound.name} says {info.sample_rate} samples a second, the stream itself "
            f"{track.rate_hz}, which count."
        )
    return track


def _messages(sound: SoundTopic) -> Iterator[Any]:
    return (message for _, message in sound.messages())


def _sampled(
    pieces: Callable[[], Iterator[tuple[Pcm, np.ndarray]]], topic: str, folder: Path, times_s: Float[np.ndarray, " n"]
) -> AudioTrack:
    measured = [(len(samples), pcm) for pcm, samples in pieces()]
    pcm, lengths_s = measured[0][1], np.array([count / pcm.rate_hz for count, pcm in measured])
    require_pace(topic, pcm, lengths_s, times_s)
    start_s, silence_s = silences(times_s, lengths_s)

    def same() -> Iterator[list[np.ndarray]]:
        for own, samples in pieces():
            if own != pcm:
                raise RecordingError(
                    f"The sound on {topic} changes from {pcm.rate_hz} to {own.rate_hz} samples a second, or from "
                    f"{pcm.channels} to {own.channels} channel(s); give one file instead ({option('audio', 'FILE')})."
                )
            yield [samples]

    track = _joined(topic, folder, pcm, start_s, lengths_s, silence_s, same())
    if pcm.channels > 1:
        note(
            f"The sound of {topic} has {pcm.channels} channels, of which the mean is heard; where their microphones "
            f"are ({option('microphones', 'FILE')}) would show where sounds come from."
        )
    return track


def _joined(
    topic: str,
    folder: Path,
    pcm: Pcm,
    start_s: float,
    lengths_s: Float[np.ndarray, " n"],
    silence_s: Float[np.ndarray, " n"],
    pieces: Iterable[Iterable[np.ndarray]],
) -> AudioTrack:
    target, channels = folder / "audio.flac", min(pcm.channels, _FLAC_CHANNELS)

    def blocks() -> Iterator[np.ndarray]:
        for missing_s, piece in zip(silence_s.tolist(), pieces, strict=True):
            missing = round(missing_s * pcm.rate_hz)
            for at in range(0, missing, _SILENT_BLOCK):
                yield np.zeros((min(_SILENT_BLOCK, missing - at), channels), np.float32)
            yield from piece

    with _room_for(topic, folder):
        write_samples(target, blocks(), pcm.rate_hz, channels)
    if len(gaps := np.flatnonzero(silence_s)):
        first = int(gaps[0])
        note(
            f"{len(gaps)} gap(s) in the sound of {topic}, {silence_s.sum():.4g} s together (the first of "
            f"{silence_s[first]:.3g} s at {start_s + lengths_s[:first].sum():.2f} s), are filled with silence."
        )
    return AudioTrack.open(target, start_s=start_s, label=topic)


def require_pace(topic: str, said: Pcm, lengths_s: Float[np.ndarray, " n"], times_s: Float[np.ndarray, " n"]) -> None:
    """Hold how long messages sound, as their declared rate and channels have it, against when they came.

    Lost messages leave gaps; a wrong rate or number of channels makes all longer or shorter than until the next.
    """
    lasts_s, came_s = float(lengths_s.sum()), float(np.ptp(times_s)) + float(lengths_s.mean())
    if len(times_s) < _FEWEST_MESSAGES or came_s < _SHORTEST_S:
        return
    between_s = float(np.median(np.diff(np.sort(times_s))))
    shorter = lasts_s * _AGREES < came_s and float(np.median(lengths_s)) * _AGREES < between_s
    if not shorter and lasts_s <= _AGREES * came_s:
        return
    total = lasts_s * said.rate_hz * said.channels / came_s
    raise RecordingError(
        f"The sound of {topic} does not agree with itself: at {said.rate_hz} samples a second in {said.channels} "
        f"channel(s) its {len(times_s)} messages last {lasts_s:.1f} s, but they came within {came_s:.1f} s. "
        f"{_fits(total)} {_otherwise()}"
    )


def _otherwise() -> str:
    return f"Give a file instead ({option('audio', 'FILE')}), or leave it out ({option('topics', 'audio=none')})."


def _fits(total: float) -> str:
    found = [
        f"{rate},{channels}"
        for rate in _USUAL_RATES_HZ
        for channels in _USUAL_CHANNELS
        if abs(total / (rate * channels) - 1.0) < _FITS
    ]
    named = f", as {' or '.join(found[:3])} has ({option('topics', f'audio_pcm={found[0]}')})" if found else ""
    return f"They hold {total:,.0f} samples of 16 bits a second in all channels{named}."


@contextmanager
def _room_for(topic: str, folder: Path) -> Generator[None]:
    try:
        yield
    except (AudioError, OSError) as error:
        reason = str(error).strip().rstrip(".") or "no room"
        raise AudioError(
            f"The sound of {topic} cannot be written to {folder} ({reason}); make room there, choose another folder "
            f"for temporary files (TMPDIR), or leave the sound out ({option('topics', 'audio=none')})."
        ) from None


def _compressed(sound: SoundTopic, suffix: str, folder: Path, times_s: Float[np.ndarray, " n"]) -> AudioTrack:
    """Write a compressed stream; where messages are missing it is cut, and each part decoded to its own place."""
    interval_s = np.diff(times_s)
    usual_s = float(np.median(interval_s)) if len(interval_s) else 0.0
    cuts = np.flatnonzero(interval_s > max(COMPRESSED_GAP_S, 5.0 * usual_s)) + 1
    if len(cuts) and suffix != "mp3":  # other codings have a head that the later parts lack
        raise RecordingError(
            f"{len(cuts)} gap(s) in the sound of {sound.name} leave out {float(interval_s[cuts - 1].sum()):.3g} s, and "
            f"{suffix} cannot be cut there, so that the rest would sound too early. {_otherwise()}"
        )
    edges = [0, *cuts.tolist(), len(times_s)]
    parts = [folder / f"part-{number}.{suffix}" for number in range(len(edges) - 1)]
    every = _messages(sound)
    with _room_for(sound.name, folder):
        for part, (begin, end) in zip(parts, pairwise(edges), strict=True):
            with part.open("wb") as stream:
                stream.writelines(_content(message) for message in islice(every, end - begin))
    try:
        tracks = [
            AudioTrack.open(part, start_s=float(times_s[at]), label=sound.name)
            for part, at in zip(parts, edges[:-1], strict=True)
        ]
    except AudioError:
        raise RecordingError(
            f"The sound on {sound.name} is no {suffix} stream, though it is declared as one; if it is plain 16-bit "
            f"samples, say how many a second and in how many channels ({option('topics', 'audio_pcm=16000,1')}). "
            f"{_otherwise()}"
        ) from None
    first = tracks[0]
    if len(tracks) == 1:
        came_s = float(np.ptp(times_s)) + usual_s
        if len(times_s) >= _FEWEST_MESSAGES and came_s >= _SHORTEST_S and first.duration_s > _AGREES * came_s:
            raise RecordingError(
                f"The sound of {sound.name} does not agree with itself: its {len(times_s)} messages came within "
                f"{came_s:.1f} s, and as {suffix} they last {first.duration_s:.1f} s. {_otherwise()}"
            )
        return first
    silence_s = np.array([0.0, *(max(b.start_s - a.end_s, 0.0) for a, b in pairwise(tracks))])
    lengths_s = np.array([track.duration_s for track in tracks])
    pieces = ((block.samples[:, None] for block in track.blocks()) for track in tracks)
    return _joined(sound.name, folder, Pcm(first.rate_hz, 1), first.start_s, lengths_s, silence_s, pieces)


def _coding_of(sound: SoundTopic, beginning: bytes, said: str, times_s: Float[np.ndarray, " n"]) -> str:
    if said:
        if not (said.isalnum() and len(said) < 10):
            raise RecordingError(
                f"The AudioInfo of {sound.name} says {said[:20]!r}, no coding of sound. {_otherwise()}"
            )
        return said
    if len(beginning) > 2 and beginning[0] == 0xFF and beginning[1] & 0xE6 == 0xE2:  # an MPEG frame of layer 3
        return "mp3"
    size = sum(len(_content(message)) for message in _messages(sound))
    usual_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else 0.0
    total = size / 2 / (float(np.ptp(times_s)) + usual_s) if usual_s > 0.0 else 0.0
    raise RecordingError(
        f"The sound on {sound.name} has no AudioInfo and is not an MP3, FLAC, OGG or WAV stream; if it is plain 16-bit "
        f"samples, say how many a second and in how many channels (audio_pcm=RATE,CHANNELS). {_fits(total)} "
        f"{_otherwise()}"
    )


def _content(message: Any) -> bytes:
    return np.asarray(getattr(message, "audio", message).data, np.uint8).tobytes()


def _plain(messages: Iterable[Any], pcm: Pcm) -> Iterator[tuple[Pcm, np.ndarray]]:
    rest = b""  # a message may end within a sample
    for message in messages:
        content = rest + _content(message)
        whole = len(content) // (2 * pcm.channels) * 2 * pcm.channels
        samples = np.frombuffer(content[:whole], "<i2").reshape(-1, pcm.channels)[:, :_FLAC_CHANNELS]
        yield pcm, samples.astype(np.float32) / np.float32(1 << 15)
        rest = content[whole:]


def sampled_pieces(messages: Iterable[Any], topic: str) -> Iterator[tuple[Pcm, np.ndarray]]:
    """Yield of each AudioStamped its numbers and its samples, (n, channels) in [-1, 1]."""
    for message in messages:
        audio, info = message.audio.audio_data, message.audio.info
        if int(info.format) not in _SAMPLES:
            raise RecordingError(
                f"The sound on {topic} has PortAudio's format {info.format}; of samples "
                f"{', '.join(map(str, _SAMPLES))} are read (8 is 16-bit). Give a file instead "
                f"({option('audio', 'FILE')})."
            )
        name, dtype, scale = _SAMPLES[int(info.format)]
        pcm = Pcm.check_rate(int(info.rate), int(info.channels), f"The AudioInfo of {topic}")
        samples = np.asarray(getattr(audio, name)).astype(dtype).astype(np.float64)
        whole = samples[: len(samples) // pcm.channels * pcm.channels].reshape(-1, pcm.channels)[:, :_FLAC_CHANNELS]
        middle = 128.0 if dtype == "u1" else 0.0
        yield pcm, np.clip(np.nan_to_num((whole - middle) / scale), -1.0, 1.0)


def directions_of(topic: str, messages: Callable[[], Iterator[tuple[int, Any]]], clock: PictureClock) -> DirectionTrack:
    """Return the directions on a topic: whole numbers are degrees, and so are floats beyond a turn.

    A pose's yaw is its azimuth, or, where it is not turned, the direction to its position.
    """
    rows = [
        (received_ns * 1e-9, stamp_of(message) if hasattr(message, "pose") else np.nan, *angle_of(message))
        for received_ns, message in messages()
    ]
    if not rows:
        raise RecordingError(f"The topic {topic} has no messages, so that it says no directions; name another.")
    received, stamped, azimuth, whole = np.array(rows, np.float64).T
    at_s = clock.of_stamps(stamped) if np.isfinite(stamped).all() else clock.of_received(received)
    order = np.argsort(at_s, kind="stable")
    at_s, azimuth = at_s[order], azimuth[order]
    used = np.isfinite(azimuth) & np.append(np.diff(at_s) > 0.0, True)
    if not used.all():
        note(f"{int((~used).sum())} of {len(used)} directions of {topic} are no numbers, or came at one moment.")
    at_s, azimuth = at_s[used], azimuth[used]
    if whole.all() or np.abs(azimuth).max(initial=0.0) > BEYOND_A_TURN_RAD:
        azimuth = np.deg2rad(azimuth)
        note(f"The directions of {topic} are taken as degrees.")
    return DirectionTrack.of(at_s, np.angle(np.exp(1j * azimuth)))


def angle_of(message: Any) -> tuple[float, bool]:
    """Return the angle that a message says, a pose in radians, and whether it is a whole number."""
    if hasattr(message, "pose"):
        return _yaw(message), False
    return float(message.data), isinstance(message.data, int | np.integer)


def _yaw(message: Any) -> float:
    pose = pose_of(message)
    yaw = float(np.arctan2(pose[1, 0], pose[0, 0]))
    away = pose[:2, 3]
    return float(np.arctan2(away[1], away[0])) if abs(yaw) < 1e-9 and np.linalg.norm(away) > 1e-6 else yaw
