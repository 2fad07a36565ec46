"""Sounds that come piece by piece are, at the end, those of the whole track; before, they are listed soon."""

import contextlib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from audio_fakes import RATE_HZ, FakeEncoder, FakeWalk, straight_walk, track_of
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AudioError
from avlmaps.core.timeline import Trajectory
from avlmaps.maps import hearing
from avlmaps.maps.audio.events import detect_events
from avlmaps.maps.audio.segmentation import segment
from avlmaps.maps.frame_sums import Walked
from avlmaps.maps.hearing import ENDED_S, Hearing
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.types import HeardSounds
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import GAP_S, ChannelSound, GrowingTrack, read_channels

PLAIN = HearingSettings()


def noisy(seconds: float, events: list[tuple[float, float, float]], seed: int = 0) -> np.ndarray:
    """Return faint noise with tones (begin and length in seconds, level), as 16-bit samples hold them."""
    samples = np.random.default_rng(seed).normal(scale=3e-3, size=round(seconds * RATE_HZ))
    for begin_s, length_s, level in events:
        at = round(begin_s * RATE_HZ)
        tone = level * np.sin(2.0 * np.pi * 700.0 * np.arange(round(length_s * RATE_HZ)) / RATE_HZ)
        samples[at : at + len(tone)] += tone[: len(samples) - at]
    return (np.rint(np.clip(samples, -1.0, 1.0) * 32767) / 32768).astype(np.float32)


SAMPLES = noisy(30.0, [(3.0, 0.5, 0.3), (8.0, 2.0, 0.1), (10.6, 0.4, 0.2), (20.0, 1.0, 0.4), (29.5, 0.5, 0.2)])


def require_same(one: HeardSounds, other: HeardSounds) -> None:
    for field in fields(HeardSounds):
        if field.name != "clips":
            np.testing.assert_allclose(getattr(one, field.name), getattr(other, field.name), atol=1e-5)
    assert len(one.clips) == len(other.clips)


def ears() -> Hearing:
    return Hearing(Encoders(sounds=FakeEncoder()), PLAIN, None, name_first=False)


def add(sounds: Hearing, samples: np.ndarray) -> None:
    sounds.add(Sound(samples, RATE_HZ), None, Walked())


def walked(walk: FakeWalk) -> Trajectory:
    return Trajectory(walk.stamps_s, walk.world_from_camera)


def heard_by(sounds: Hearing, walk: FakeWalk) -> HeardSounds:
    return sounds.sounds(walked(walk), final=False)


@pytest.fixture(scope="module")
def track(tmp_path_factory: pytest.TempPathFactory) -> AudioTrack:
    return track_of(tmp_path_factory.mktemp("track") / "a.flac", SAMPLES)


@pytest.fixture(scope="module")
def whole(track: AudioTrack, tmp_path_factory: pytest.TempPathFactory) -> HeardSounds:
    """What is heard in the track at once."""
    walk = straight_walk(30.0, 0.3, track)
    return detect_events(track, walked(walk), FakeEncoder(), PLAIN, tmp_path_factory.mktemp("clips"))


@pytest.mark.slow
@given(cuts=st.lists(st.integers(0, len(SAMPLES)), max_size=30), asked=st.integers(0, 30))
def test_however_the_track_is_cut_the_sounds_are_those_of_the_whole_track(
    track: AudioTrack, whole: HeardSounds, cuts: list[int], asked: int
) -> None:
    walk, sounds = straight_walk(30.0, 0.3, track), ears()
    for number, piece in enumerate(np.split(SAMPLES, sorted(cuts))):
        add(sounds, piece)
        if number == asked:
            heard_by(sounds, walk)  # a question changes nothing
    assert sounds.track is not None
    require_same(sounds.sounds(walked(walk), final=True), whole)
    assert segment(sounds.track) == segment(track) and len(whole) == 4


def test_a_sound_is_listed_within_a_second_of_its_end() -> None:
    walk, sounds, step = straight_walk(30.0, 0.3), ears(), RATE_HZ // 2
    listed: dict[int, float] = {}
    for at in range(0, len(SAMPLES), step):
        add(sounds, SAMPLES[at : at + step])
        heard = heard_by(sounds, walk)
        for number, end_s in enumerate((3.5, 10.0, 21.0)):
            if np.any(np.abs(heard.offset_s - end_s) < 0.1):
                listed.setdefault(number, (at + step) / RATE_HZ - end_s)
    assert sorted(listed) == [0, 1, 2]  # the second, before the third tone made it longer
    assert all(ENDED_S <= late_s <= 1.0 for late_s in listed.values())
    assert heard_by(sounds, walk).offset_s[1] == pytest.approx(11.0, abs=0.1)


@pytest.mark.nightly
def test_the_window_of_a_long_track_moves_on_and_keeps_what_was_heard(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(hearing, "_WINDOW_S", 45.0)
    samples = noisy(240.0, [(float(at), 0.5, 0.3) for at in range(5, 240, 10)])
    walk, sounds = straight_walk(240.0, 0.1), ears()
    for at in range(0, len(samples), 5 * RATE_HZ):
        add(sounds, samples[at : at + 5 * RATE_HZ])
        live = heard_by(sounds, walk)
    assert sounds._window > 140 * RATE_HZ and len(live) == 24
    track = track_of(tmp_path / "a.flac", samples)
    whole = detect_events(track, walked(walk), FakeEncoder(), PLAIN, tmp_path / "clips")
    np.testing.assert_allclose(live.onset_s, whole.onset_s, atol=0.03)


# The clock of a microphone


@given(late_s=st.floats(-1.0, 3.0), jitter_s=st.floats(-0.05, 0.05))
def test_gaps_become_silence_overlaps_are_left_out_and_jitter_changes_nothing(
    tmp_path_factory: pytest.TempPathFactory, late_s: float, jitter_s: float
) -> None:
    track = GrowingTrack(tmp_path_factory.mktemp("growing") / "track.f32")
    piece = np.full(2 * RATE_HZ, 0.5, np.float32)
    track.add(Sound(piece, RATE_HZ), 10.0)
    track.add(Sound(piece, RATE_HZ), 12.0 + jitter_s)
    assert track.end_s == 14.0 and (track.gaps, track.overlaps) == (0, 0)
    track.add(Sound(piece, RATE_HZ), 14.0 + late_s)
    moved_s = late_s if abs(late_s) >= GAP_S else 0.0
    assert track.end_s == pytest.approx(16.0 + moved_s, abs=1e-3)
    assert (track.gaps, track.overlaps) == (int(late_s >= GAP_S), int(late_s <= -GAP_S))
    assert track.track is not None
    samples = track.track.read(10.0, track.end_s).samples
    assert (samples == 0.5).sum() + round(max(moved_s, 0.0) * RATE_HZ) == len(samples)


@pytest.mark.nightly
def test_a_clock_that_drifts_stays_within_the_gap(tmp_path: Path) -> None:
    track = GrowingTrack(tmp_path / "track.f32")
    for number in range(600):  # 60 s of pieces whose microphone is 1 % slow
        track.add(Sound(np.zeros(RATE_HZ // 10, np.float32), RATE_HZ), 0.101 * number)
    assert track.end_s == pytest.approx(60.6, abs=GAP_S + 0.01) and track.gaps > 0


@pytest.mark.parametrize(
    ("chunk", "stamp_s", "said"),
    [
        (np.zeros(5), None, r"must be an avlmaps.Sound\(samples, rate_hz\), not ndarray"),
        (Sound(np.zeros(5, np.float32), 8000), None, r"8000 samples a second in 1 channel\(s\); 16000"),
        (Sound(np.zeros(5, np.float32), 500), None, r"500 samples a second in 1 channel\(s\); "),
        (Sound(np.full(5, np.nan, np.float32), RATE_HZ), None, "as large as nan"),
        (Sound(np.full(5, 900.0, np.float32), RATE_HZ), None, r"as large as 900; they must lie in \[-1, 1\]"),
        (Sound(np.zeros(5, np.float32), RATE_HZ), "now", "must be a finite number of seconds, not 'now'"),
        (ChannelSound(np.zeros((2, 5), np.float32), RATE_HZ), None, r"in 2 channel\(s\); 16000 in 1"),
        (Sound(np.zeros(1600, np.float32), RATE_HZ), 0.2, r"lies before the end of the sound that came \(1.000 s\)"),
        (Sound(np.zeros(5, np.float32), RATE_HZ), 1.7e9, "after the sound before it ended"),
    ],
)
def test_what_is_no_piece_of_the_track_is_refused_and_costs_nothing(
    tmp_path: Path, chunk: object, stamp_s: object, said: str
) -> None:
    track = GrowingTrack(tmp_path / "track.f32")
    track.add(Sound(np.zeros(RATE_HZ, np.float32), RATE_HZ))
    with pytest.raises(AudioError, match=said):
        track.add(chunk, stamp_s)
    assert track.end_s == 1.0
    track.add(Sound(np.zeros(RATE_HZ, np.float32), RATE_HZ))
    assert track.end_s == 2.0


def test_a_gap_of_half_a_minute_is_silence_on_every_channel(tmp_path: Path) -> None:
    track, piece = GrowingTrack(tmp_path / "track.f32"), ChannelSound(np.full((2, 100), 0.5, np.float32), RATE_HZ)
    track.add(piece, 0.0)
    track.add(piece, 25.5)
    whole = track.track
    assert whole is not None and (track.gaps, track.gap_s) == (1, pytest.approx(25.49375))
    every = read_channels(whole, 0.0, whole.end_s).samples
    assert every.shape == (2, 25.5 * RATE_HZ + 100)
    np.testing.assert_array_equal(np.flatnonzero(every[1]), [*range(100), *range(408_000, 408_100)])


@given(pieces=st.lists(st.tuples(st.integers(1, 4000), st.integers(-300, 600)), min_size=1, max_size=6))
def test_channels_stay_beside_one_another_however_the_track_is_cut(
    pieces: list[tuple[int, int]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """What every channel holds is what the first holds, plus its number: through gaps and overlaps."""
    track = GrowingTrack(tmp_path_factory.mktemp("channels") / "track.f32")
    rng, at_s = np.random.default_rng(len(pieces)), 0.0
    off = np.array([0.0, 0.25, 0.5], np.float32)
    for count, gap_ms in pieces:
        first = rng.uniform(-0.5, 0.2, count).astype(np.float32)
        with contextlib.suppress(AudioError):  # a piece that came already
            track.add(ChannelSound(first + off[:, None], RATE_HZ), at_s)
        at_s = (track.end_s or 0.0) + gap_ms / 1000.0
    whole = track.track
    assert whole is not None and whole.channels == 3
    every = read_channels(whole, whole.start_s, whole.end_s).samples
    sounds = every.any(axis=0)
    np.testing.assert_allclose((every - every[0])[:, sounds], np.tile(off[:, None], sounds.sum()), atol=1e-6)
    np.testing.assert_array_equal(whole.read(whole.start_s, whole.end_s).samples, every[0])
    half = whole.since(every.shape[1] // 2)
    np.testing.assert_array_equal(
        read_channels(half, half.start_s, half.end_s).samples, every[:, every.shape[1] // 2 :]
    )


def test_a_track_alone_on_a_walk_without_sounds_has_none() -> None:
    walk = FakeWalk(np.array([0.0, 1.0]), np.zeros((2, 3)))
    sounds = ears()
    assert len(heard_by(sounds, walk)) == 0
    add(sounds, np.zeros(RATE_HZ, np.float32))
    assert len(heard_by(sounds, walk)) == 0
