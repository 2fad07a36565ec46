"""Tracks divided where what sounds changes, for encoders that give a feature for each step of time."""

from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest
from audio_fakes import RATE_HZ, FakeEncoder, detect_events, quiet, straight_walk, tone, track_of
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AudioError, BackendError
from avlmaps.maps.audio.segmentation import frames_of_track, split_at_changes
from avlmaps.maps.settings import BuildSettings, HearingSettings, SoundChangeSettings
from avlmaps.perception.protocols import FrameSoundEncoder, ModelCard
from avlmaps.recordings.audio import Sound

HOP_S = 0.04
PITCHES = (300.0, 1000.0, 3000.0)


class FakeFrames(FakeEncoder):
    """Tells for every 40 ms which of three pitches sounds, or that none does; quietest and loudest alike."""

    card = ModelCard(id="test/pitches", dim=4, licence="MIT", checksum="0")
    hop_s = HOP_S

    def encode(self, sound: Sound) -> np.ndarray:
        self.heard.append(sound)
        size = round(HOP_S * sound.rate_hz)
        count = -(-len(sound.samples) // size)
        frames = np.pad(sound.samples, (0, count * size - len(sound.samples))).reshape(count, size)
        times = np.arange(size) / sound.rate_hz
        power = np.stack([np.abs(frames @ np.exp(-2j * np.pi * hz * times)) for hz in PITCHES], axis=1)
        loudest = power.max(axis=1, keepdims=True)
        rows = np.where(loudest > 1e-6, power / np.maximum(loudest, 1e-12), 0.0) ** 4
        rows = np.concatenate([rows, loudest <= 1e-6], axis=1).astype(np.float32)
        return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def unit(rows: np.ndarray) -> np.ndarray:
    return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


def spread(rows: np.ndarray, edges: list[int]) -> float:
    """Return the sum over stretches of squared distances from the stretch's mean."""
    return float(sum(((rows[a:b] - rows[a:b].mean(axis=0)) ** 2).sum() for a, b in pairwise(edges)))


def every_division(count: int, shortest: int, longest: int) -> list[list[int]]:
    found = [[0]] if count == 0 else []
    for last in range(shortest, min(longest, count) + 1):
        found += [[*edges, count] for edges in every_division(count - last, shortest, longest)]
    return found


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(3, 11),
    shortest=st.integers(1, 2),
    longest=st.integers(4, 12),
    changes=st.integers(0, 4),
)
def test_no_division_is_better_than_the_one_that_is_found(
    seed: int, count: int, shortest: int, longest: int, changes: int
) -> None:
    rng = np.random.default_rng(seed)
    kind = np.sort(rng.integers(0, changes + 1, count))
    rows = unit(rng.standard_normal((changes + 1, 3))[kind] + 0.2 * rng.standard_normal((count, 3)))
    chosen = SoundChangeSettings(change_s=shortest * HOP_S, max_length_s=longest * HOP_S + 1e-9)
    edges = split_at_changes(rows, HOP_S, chosen).tolist()
    assert edges[0] == 0
    assert edges[-1] == count
    costs = [spread(rows, one) + shortest * (len(one) - 1) for one in every_division(count, shortest, longest)]
    assert spread(rows, edges) + shortest * (len(edges) - 1) == pytest.approx(min(costs), abs=1e-4)


@given(lengths=st.lists(st.integers(6, 60), min_size=1, max_size=8), seed=st.integers(0, 1000))
def test_edges_are_where_the_features_change_whatever_the_noise_on_them(lengths: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = np.arange(len(lengths)) % 4
    rows = unit(np.eye(64)[np.repeat(kinds, lengths)] + 0.05 * rng.standard_normal((sum(lengths), 64)))
    edges = split_at_changes(rows, HOP_S, SoundChangeSettings(max_length_s=60 * HOP_S))
    np.testing.assert_array_equal(edges, np.cumsum([0, *lengths]))


@given(seed=st.integers(0, 1000), count=st.integers(0, 700))
def test_stretches_are_disjoint_whole_and_of_the_asked_lengths(seed: int, count: int) -> None:
    rows = unit(np.random.default_rng(seed).standard_normal((count, 6)))
    edges = split_at_changes(rows, HOP_S, SoundChangeSettings(change_s=0.2, max_length_s=2.0))
    assert edges[0] == 0
    assert edges[-1] == count
    if count > 5:
        assert np.diff(edges).min() >= 5
        assert np.diff(edges).max() <= 50


def test_what_does_not_change_is_cut_only_because_it_is_long() -> None:
    rows = np.tile(np.eye(4, dtype=np.float32)[0], (250, 1))
    assert len(split_at_changes(rows, HOP_S, SoundChangeSettings(max_length_s=20.0))) == 2
    assert len(split_at_changes(rows, HOP_S, SoundChangeSettings(max_length_s=5.0))) == 3


def test_a_track_is_divided_by_its_sounds_loud_or_hardly_audible(tmp_path: Path) -> None:
    pieces = [tone(2.0, 300.0), tone(1.2, 1000.0, level=0.001), tone(1.6, 3000.0), tone(1.2, 300.0, level=0.002)]
    track = track_of(tmp_path / "a.flac", *pieces)
    heard = detect_events(straight_walk(6.0, 0.5, track), FakeFrames(), HearingSettings(), tmp_path / "clips")
    np.testing.assert_allclose(heard.onset_s, [0.0, 2.0, 3.2, 4.8], atol=1e-6)
    np.testing.assert_allclose(heard.offset_s, [2.0, 3.2, 4.8, 6.0], atol=1e-6)
    np.testing.assert_array_equal(np.diff(heard.feature_offsets), [50, 30, 40, 30])
    kinds = [int(heard.feature[a:b].mean(axis=0).argmax()) for a, b in pairwise(heard.feature_offsets)]
    assert kinds == [0, 1, 2, 0]
    for i, (onset_s, offset_s) in enumerate(zip(heard.onset_s, heard.offset_s, strict=True)):
        places = heard.track[heard.track_offsets[i] : heard.track_offsets[i + 1]]
        np.testing.assert_allclose(places[[0, -1], 0], [0.5 * onset_s, 0.5 * offset_s], atol=1e-5)
        assert heard.clips[i].is_file()


def test_other_encoders_and_the_choice_of_energy_cut_as_before(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(2.0), tone(1.0), quiet(3.0))
    walk = straight_walk(6.0, 0.5, track)
    plain = detect_events(walk, FakeEncoder(), HearingSettings(), tmp_path / "1")
    by_energy = detect_events(walk, FakeFrames(), HearingSettings(cut="energy"), tmp_path / "2")
    np.testing.assert_array_equal(plain.onset_s, by_energy.onset_s)
    np.testing.assert_allclose(plain.onset_s, [1.97], atol=0.03)
    assert isinstance(FakeFrames(), FrameSoundEncoder)
    assert not isinstance(FakeEncoder(), FrameSoundEncoder)
    with pytest.raises(BackendError, match=r"test/loudness gives no feature for each step of time .* hearing.cut auto"):
        detect_events(walk, FakeEncoder(), HearingSettings(cut="changes"), tmp_path / "3")


def test_only_digital_silence_is_no_sound(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(2.0), tone(1.0, level=0.0005), quiet(2.0))
    heard = detect_events(straight_walk(5.0, 0.5, track), FakeFrames(), HearingSettings(), tmp_path / "clips")
    np.testing.assert_allclose([heard.onset_s[0], heard.offset_s[0]], [2.0, 3.0], atol=1e-6)
    assert len(heard) == 1
    silent = track_of(tmp_path / "b.flac", quiet(3.0))
    assert len(detect_events(straight_walk(3.0, 0.5, silent), FakeFrames(), HearingSettings(), tmp_path / "none")) == 0


@pytest.mark.parametrize("seconds", [0.01, 0.5, 25.99, 26.0, 61.3])
def test_blocks_leave_no_trace_in_the_features(tmp_path: Path, seconds: float) -> None:
    rng = np.random.default_rng(0)
    pieces = [tone(0.52, PITCHES[rng.integers(3)]) for _ in range(int(seconds / 0.5) + 1)]
    samples = np.concatenate(pieces)[: round(seconds * RATE_HZ)]
    track = track_of(tmp_path / "a.flac", samples, start_s=100.0)
    encoder = FakeFrames()
    features = frames_of_track(track, encoder)
    np.testing.assert_allclose(features, FakeFrames().encode(track.read(100.0)), atol=1e-3)
    assert max(sound.duration_s for sound in encoder.heard) <= 30.0 + 1e-6


@pytest.mark.parametrize("rate_hz", [11_025, 22_050, 44_100, 48_000])
def test_every_usual_rate_has_its_frames(tmp_path: Path, rate_hz: int) -> None:
    track = track_of(tmp_path / "a.flac", tone(27.1, rate_hz=rate_hz), rate_hz=rate_hz)
    assert frames_of_track(track, FakeFrames()).shape == (678, 4)


def test_an_encoder_that_breaks_its_promise_is_named(tmp_path: Path) -> None:
    class Broken(FakeFrames):
        def encode(self, sound: Sound) -> np.ndarray:
            return super().encode(sound)[::2]

    track = track_of(tmp_path / "a.flac", tone(2.0))
    with pytest.raises(BackendError, match=r"test/pitches returned features of \(25, 4\) for 2.00 s; .* of \(50, 4\)"):
        detect_events(straight_walk(2.0, 0.5, track), Broken(), HearingSettings(), tmp_path / "clips")


def test_settings_that_make_no_sense_are_told_and_old_maps_lack_them() -> None:
    with pytest.raises(AudioError, match=r"change_s of SoundChangeSettings is 0; choose a positive number\."):
        SoundChangeSettings(change_s=0.0)
    with pytest.raises(AudioError, match=r"max_length_s is 0.3; choose at least twice change_s \(0.2\)\."):
        SoundChangeSettings(max_length_s=0.3)
    written = msgspec.to_builtins(BuildSettings())
    del written["hearing"]["cut"], written["hearing"]["changes"]
    assert msgspec.convert(written, BuildSettings) == BuildSettings()
