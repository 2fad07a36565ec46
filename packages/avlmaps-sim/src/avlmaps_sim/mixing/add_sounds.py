"""Putting recorded sounds into the track of a walk, or of a copy of it, with the truth of what sounds where."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.progress import progress, say, silence_progress
from avlmaps.core.progress import progress as shown
from avlmaps.core.wording import option
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.layout import DESCRIPTION
from avlmaps.recordings.types import Recording
from avlmaps.recordings.writer import RecordingWriter, take_file
from avlmaps_sim.mixing.background import background as noise_of
from avlmaps_sim.mixing.background import seconds_of
from avlmaps_sim.mixing.clips import Clip, amplify, audible_part, find_clips, gain_for, loudness_db
from avlmaps_sim.mixing.spacing import Placer, Spacing, Walk, capacity, chosen_spacing


def write_recording(
    recording: Recording,
    out: Path,
    audio: Path | Sound | AudioTrack | None = None,
    link: bool = True,
    origin: str = "",
) -> Path:
    """Write any recording in our own format: the same pictures bit for bit, the same stamps, clock and poses.

    Poses that were interpolated keep their own rate. Pictures that are JPEG or PNG files already are linked or copied;
    others are encoded as PNG, depth in whole millimetres. Truth that lies beside a recording in our own format
    (``semantic/``, ``objects.json``, and ``events.csv`` where the sound track stays) goes along, so that the copy can
    be evaluated as well.

    Args:
        recording: what to copy.
        out: the folder to make.
        audio: another sound track; by default the recording's own goes along, if it has one.
        link: whether hard links will do where the file system can.
        origin: what makes the copy, for its description.

    Raises:
        RecordingError: ``out`` is not empty, or a picture is missing.
    """
    units, up = recording.depth_units_per_m, recording.up_in_world
    origin = origin or f"copied from {recording.format} {recording.path.name}"
    with RecordingWriter(
        out,
        recording.rig,
        up,
        depth_units_per_m=units,
        origin=origin,
        begins_s=recording.begins_s,
        trajectory=recording.trajectory,
        base_height=recording.base_height,
    ) as writer:
        for index in progress(range(len(recording)), "copying frames", total=len(recording)):
            _copy_frame(recording, index, writer, link)
        if recording.format == "folder":
            _take_truth(recording, out, keep_events=audio is None, link=link)
        if audio is not None:
            writer.set_audio(audio)
        elif recording.audio is not None:
            writer.set_audio(recording.audio)
    return out


def _copy_frame(recording: Recording, index: int, writer: RecordingWriter, link: bool) -> None:
    colour, depth = recording.colour_file(index), recording.depth_file(index)
    if colour is None or depth is None:
        writer.add(recording.frame(index))
        return
    stamp_s, pose = float(recording.stamps_s[index]), recording.world_from_camera[index]
    writer.add_files(recording.name(index), stamp_s, pose, colour, depth, link)


def _take_truth(recording: Recording, out: Path, keep_events: bool, link: bool) -> None:
    for name in ("objects.json", *(["events.csv"] if keep_events else [])):
        if (recording.path / name).is_file():
            take_file(recording.path / name, out / name, link=False)
    if not (recording.path / "semantic").is_dir():
        return
    (out / "semantic").mkdir()
    copied = {recording.name(index) for index in range(len(recording))}
    for file in (recording.path / "semantic").iterdir():
        if file.stem in copied:
            take_file(file, out / "semantic" / file.name, link)


EVENTS = "events.csv"
EVENTS_HEADER = ("onset_s", "offset_s", "category", "clip", "x", "y", "z", "gain_db")
_RATE_HZ = 44_100
_LEFT_OUT = "Left out: "
_USUAL_LENGTH_S = 5.0
_WANTED = 4  # where whole clips leave room for fewer sounds than this, they are cut short
_SHORTEST_CUT_S = 2.0
_SNR_DB = 20.0  # the default with a background
_TRIES = 12  # clips that are tried for the last gaps, before the track counts as full


@dataclass(frozen=True, slots=True)
class Event:
    """A sound that was put into a track."""

    onset_s: float  # where it begins, the recording's time
    offset_s: float  # where it ends
    category: str  # what it is
    clip: str  # the clip's name
    position: tuple[float, float, float]  # where the robot was when the sound was half over, metres, world
    gain_db: float  # how much the clip was amplified

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "onset_s": self.onset_s,
            "offset_s": self.offset_s,
            "category": self.category,
            "clip": self.clip,
            "position": list(self.position),
            "gain_db": self.gain_db,
        }


@dataclass(frozen=True, slots=True)
class _Placed:
    clip: Clip
    begin: int
    length: int
    gain_db: float
    loudness_db: float


def add_sounds(
    recording: Recording,
    clips: Path,
    out: Path,
    *,
    categories: Sequence[str] | None = None,
    seed: int = 0,
    interval_s: float = 2.0,
    min_distance_m: float = 2.0,
    loudness_db: float = -20.0,
    background: str | Path | None = None,
    snr_db: float | None = None,
    progress: bool = True,
) -> list[Event]:
    """Copy a recording and put sounds into its track; the same seed gives the same bytes.

    Sounds follow one another along the walk, each as early as the rule allows, no two at the same time. Categories
    are drawn without replacement until each has played, then all again. No two sounds play within
    ``min_distance_m`` of each other in a straight line, as in the paper; in a room too small for three sounds
    by that rule the distance is measured along the walk instead. Where whole clips leave room for fewer than
    four sounds, they are cut short, to no less than two seconds. A notice reports each of these.

    Args:
        recording: the walk; a track that it has already stays below the sounds.
        clips: a folder with a subfolder for each category, or with an index.csv (path, category).
        out: the new recording's folder, in our own format; it must be empty.
        categories: only these.
        seed: of what is drawn at random.
        interval_s: least silence between two sounds, seconds.
        min_distance_m: least distance between two sounds; 0 allows any.
        loudness_db: loudness of each sound (RMS of its loud frames), dB relative to full scale.
        background: ``white``, ``pink``, ``room`` or a sound file, put under the whole track.
        snr_db: how much louder every sound is than the background (20 if None); for it, all sounds are made as
            quiet as the clip with the highest peaks has to be.
        progress: whether to show it on standard error.

    Returns:
        The events, also written to ``events.csv``.

    Raises:
        AudioError: there are no clips, no room for one sound, or options that make no sense.
        RecordingError: the recording cannot be copied, or ``out`` holds one already.
    """
    if snr_db is not None and background is None:
        background = "white"
    _check(interval_s, min_distance_m, loudness_db, snr_db)
    if seed < 0:
        raise AudioError(f"The seed is {seed}; choose 0 or more.")
    if (out / DESCRIPTION).exists():  # reported before the work is done, not after
        raise RecordingError(f"{out} holds a recording already; choose another folder or remove it.")
    rng = np.random.default_rng(seed)
    found = find_clips(clips, categories)
    rate_hz = recording.audio.rate_hz if recording.audio else _RATE_HZ
    walk = Walk.along(recording.stamps_s, recording.world_from_camera[:, :3, 3])
    placer, longest_s, notices = _rule(walk, Spacing(interval_s, min_distance_m))
    placed = _place(found, placer, (rate_hz, loudness_db, longest_s), rng, notices)
    left_out = [notice.removeprefix(_LEFT_OUT) for notice in notices if notice.startswith(_LEFT_OUT)]
    if not placed and left_out:
        raise AudioError(f"No clip that was tried in {clips} can be used; of the first: {left_out[0]}")
    if not placed:
        raise AudioError(
            f"The walk of {recording.path} lasts {recording.duration_s:.1f} s and has no room for a single sound; "
            "choose shorter clips or a longer recording."
        )
    noise = None
    if background is not None:
        placed = _equally_loud(placed, loudness_db, notices)
        noise = noise_of(background, placed[0].loudness_db - (_SNR_DB if snr_db is None else snr_db), rate_hz, rng)
    events = [_event(sound, walk, rate_hz) for sound in placed]
    seconds = _mixed(recording, placed, noise, rate_hz)
    with silence_progress(not progress):
        _write(recording, out, shown(seconds, "mixing", unit="second"), events)
        for notice in notices:
            say(f"note: {notice}")
    return events


def _check(interval_s: float, min_distance_m: float, loudness_db: float, snr_db: float | None) -> None:
    for name, value in (("interval", interval_s), ("least distance", min_distance_m)):
        if not np.isfinite(value) or value < 0.0:
            raise AudioError(f"The {name} between sounds is {value}; choose 0 or more.")
    if not -90.0 <= loudness_db <= 0.0:
        raise AudioError(f"The loudness is {loudness_db} dB; choose between -90 and 0, dB relative to full scale.")
    if snr_db is not None and not -30.0 <= snr_db <= 90.0:
        raise AudioError(f"The signal-to-noise ratio is {snr_db} dB; choose between -30 and 90.")


def _rule(walk: Walk, wanted: Spacing) -> tuple[Placer, float | None, list[str]]:
    notices: list[str] = []
    spacing = chosen_spacing(walk, wanted, _USUAL_LENGTH_S)
    if spacing.measure != wanted.measure:
        notices.append(
            f"The walk stays within so small a place that few sounds are {wanted.distance_m:g} m apart in a straight "
            "line; they are that far apart along the walk instead "
            f"({option('min-distance-m', '0')} allows any distance)."
        )
    lengths_s = np.arange(_USUAL_LENGTH_S, _SHORTEST_CUT_S - 1e-9, -0.5)
    room = [capacity(walk, spacing, float(length_s), _WANTED) for length_s in lengths_s]
    if room[0] >= _WANTED or max(room) <= room[0]:
        return Placer(walk, spacing), None, notices
    longest_s = float(lengths_s[int(np.argmax(room))])
    notices.append(
        f"Sounds of {_USUAL_LENGTH_S:g} s would leave room for {room[0]} of them, so they are cut to {longest_s:g} s, "
        f"which leaves room for {max(room)}; a smaller {option('min-distance-m')} leaves room for more."
    )
    return Placer(walk, spacing), longest_s, notices


def _place(
    clips: Sequence[Clip],
    placer: Placer,
    wanted: tuple[int, float, float | None],
    rng: np.random.Generator,
    notices: list[str],
) -> list[_Placed]:
    rate_hz, wanted_db, longest_s = wanted
    placed: list[_Placed] = []
    failures = 0
    for clip in _draws(clips, rng):
        try:
            sound = audible_part(clip, rate_hz, longest_s)
        except AudioError as error:  # one bad clip in a collection must not keep the others out
            notices.append(f"{_LEFT_OUT}{error}")
            failures += 1
        else:
            onset_s = placer.place(sound.duration_s)
            failures = failures + 1 if onset_s is None else 0
            if onset_s is not None:
                gain_db = gain_for(sound, wanted_db)
                begin, heard_db = round(onset_s * rate_hz), loudness_db(sound) + gain_db
                placed.append(_Placed(clip, begin, len(sound.samples), gain_db, heard_db))
        if failures >= _TRIES:
            return placed
    return placed


def _draws(clips: Sequence[Clip], rng: np.random.Generator) -> Iterator[Clip]:
    stacks: dict[str, list[Clip]] = {clip.category: [] for clip in clips}
    while True:
        for category in rng.permutation(sorted(stacks)):
            if not stacks[category]:
                own = [clip for clip in clips if clip.category == category]
                stacks[category] = [own[i] for i in rng.permutation(len(own))]
            yield stacks[category].pop()


def _equally_loud(placed: list[_Placed], wanted_db: float, notices: list[str]) -> list[_Placed]:
    """Attenuate every sound to the level of the quietest, so that each has the requested signal-to-noise ratio."""
    quietest_db = min(sound.loudness_db for sound in placed)
    if quietest_db < wanted_db - 0.5:
        notices.append(
            f"All sounds have a loudness of {quietest_db:.1f} dB instead of {wanted_db:g}: louder, the peaks of one "
            "would be cut off, and then not all would be equally loud against the background."
        )
    return [
        replace(sound, gain_db=sound.gain_db + quietest_db - sound.loudness_db, loudness_db=quietest_db)
        for sound in placed
    ]


def _event(sound: _Placed, walk: Walk, rate_hz: int) -> Event:
    onset_s, offset_s = sound.begin / rate_hz, (sound.begin + sound.length) / rate_hz
    x, y, z = (round(float(axis), 4) for axis in walk.position[walk.index((onset_s + offset_s) / 2.0)])
    return Event(
        round(onset_s, 6), round(offset_s, 6), sound.clip.category, sound.clip.name, (x, y, z), round(sound.gain_db, 2)
    )


def _mixed(
    recording: Recording, placed: Sequence[_Placed], noise: Iterator[np.ndarray] | None, rate_hz: int
) -> Iterator[Sound]:
    end_s = max(float(recording.stamps_s[-1]), recording.audio.end_s if recording.audio else 0.0)
    end = max(int(np.ceil(end_s * rate_hz)), *(sound.begin + sound.length for sound in placed))
    there, below = _there(recording.audio, rate_hz), seconds_of(noise, rate_hz)
    waiting = list(placed)
    sounding: list[tuple[int, np.ndarray]] = []
    for begin in range(0, end, rate_hz):
        mix = next(there) + next(below).samples
        while waiting and waiting[0].begin < begin + rate_hz:
            sound = waiting.pop(0)
            part = audible_part(sound.clip, rate_hz, sound.length / rate_hz)
            sounding.append((sound.begin, amplify(part, sound.gain_db).samples))
        for at, samples in sounding:
            first, last = max(at, begin), min(at + len(samples), begin + rate_hz)
            if first < last:
                mix[first - begin : last - begin] += samples[first - at : last - at]
        sounding = [(at, samples) for at, samples in sounding if at + len(samples) > begin + rate_hz]
        yield Sound(mix[: end - begin], rate_hz)


def _there(track: AudioTrack | None, rate_hz: int) -> Iterator[Float32[np.ndarray, " second"]]:
    waiting = np.zeros(0, np.float32)
    if track is not None:
        late = round(track.start_s * rate_hz)
        waiting = np.zeros(max(late, 0), np.float32)
        early = max(-late, 0)
        for block in track.blocks(1.0):
            waiting = np.concatenate([waiting, block.samples[early:]])
            early = max(early - len(block.samples), 0)
            while len(waiting) >= rate_hz:
                yield waiting[:rate_hz].copy()
                waiting = waiting[rate_hz:]
    yield np.pad(waiting, (0, rate_hz - len(waiting)))
    while True:
        yield np.zeros(rate_hz, np.float32)


def _write(recording: Recording, out: Path, seconds: Iterable[Sound], events: Sequence[Event]) -> None:

    with TemporaryDirectory() as scratch:
        track = Path(scratch) / "audio.flac"
        write_flac(track, seconds)
        origin = f"{recording.format} {recording.path.name} with {len(events)} sounds put into its track"
        write_recording(recording, out, audio=track, origin=origin)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(EVENTS_HEADER)
    writer.writerows([(e.onset_s, e.offset_s, e.category, e.clip, *e.position, e.gain_db) for e in events])
    write_bytes_atomically(out / EVENTS, text.getvalue().encode("utf-8"))
