from pathlib import Path

import numpy as np
import pytest
from audio_fakes import RATE_HZ, FakeEncoder, FakeWalk, detect_events, quiet, straight_walk, tone, track_of
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AudioError, BackendError
from avlmaps.maps.audio.events import track_of as places_of
from avlmaps.maps.audio.segmentation import Segment, segment
from avlmaps.maps.settings import HearingSettings, SegmentationSettings
from avlmaps.recordings.audio import AudioTrack

PLAIN = HearingSettings()


def test_every_sound_has_its_time_its_places_its_feature_and_its_clip(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(2.0), tone(1.0), quiet(3.0), tone(7.0, hz=400.0), quiet(3.0))
    walk = straight_walk(16.0, 0.5, track)
    heard = detect_events(walk, FakeEncoder(), PLAIN, tmp_path / "clips")
    assert len(heard) == 2
    np.testing.assert_allclose(heard.onset_s, [2.0, 6.0], atol=0.05)
    np.testing.assert_allclose(heard.offset_s, [3.0, 13.0], atol=0.05)
    for i, clip in enumerate(heard.clips):
        places = heard.track[heard.track_offsets[i] : heard.track_offsets[i + 1]]
        np.testing.assert_allclose(places[[0, -1], 0], 0.5 * np.array([heard.onset_s[i], heard.offset_s[i]]), atol=1e-5)
        written = AudioTrack.open(clip)
        assert written.duration_s == pytest.approx(heard.offset_s[i] - heard.onset_s[i], abs=1e-3)
    assert heard.clips[0].name == "000001.970-3.030.flac"
    assert np.diff(heard.feature_offsets).tolist() == [1, 7]
    np.testing.assert_allclose(np.linalg.norm(heard.feature, axis=1), 1.0, atol=1e-6)


def test_a_long_sound_is_encoded_whole(tmp_path: Path) -> None:
    encoder = FakeEncoder()
    detect_events(
        straight_walk(20.0, 0.5, track_of(tmp_path / "a.flac", quiet(2.0), tone(12.0), quiet(2.0))),
        encoder,
        PLAIN,
        tmp_path,
    )
    assert encoder.heard[0].duration_s == pytest.approx(12.0, abs=0.1)


@pytest.mark.parametrize("audio", ["none", "silent"])
def test_without_anything_to_hear_the_shapes_are_right(tmp_path: Path, audio: str) -> None:
    track = None if audio == "none" else track_of(tmp_path / "a.flac", quiet(3.0))
    heard = detect_events(straight_walk(3.0, 0.5, track), FakeEncoder(), PLAIN, tmp_path / "clips")
    assert len(heard) == 0
    assert (heard.track.shape, heard.feature.shape, heard.clips) == ((0, 3), (0, 4), ())
    assert (heard.track_offsets.tolist(), heard.feature_offsets.tolist()) == ([0], [0])


def test_sounds_outside_the_frames_get_the_nearest_place_and_a_notice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    track = track_of(tmp_path / "a.flac", tone(0.5), quiet(4.0), tone(0.5), start_s=-3.0)
    walk = FakeWalk(np.array([0.0, 0.5, 1.0]), np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), track)
    heard = detect_events(walk, FakeEncoder(), PLAIN, tmp_path / "clips")
    np.testing.assert_array_equal(heard.track, [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    assert (
        "note: 2 of 2 sounds lie outside the frames, 0.00 to 1.00 s, the first at -3.00 s;" in capsys.readouterr().err
    )


@given(onset=st.floats(-2.0, 6.0), length=st.floats(1e-3, 4.0))
def test_there_is_always_a_place_and_it_is_on_the_walk(onset: float, length: float) -> None:
    walk = straight_walk(4.0, 0.5)
    places = places_of(walk.walk, Segment(onset, onset + length))
    assert len(places) >= 1
    assert (np.diff(places[:, 0]) > 0).all()
    expected = 0.5 * np.clip([onset, onset + length], 0.0, 4.0)
    np.testing.assert_allclose(places[[0, -1], 0], expected, atol=2e-4)


def test_a_robot_that_stands_still_hears_at_one_place(tmp_path: Path) -> None:
    assert len(places_of(straight_walk(4.0, 0.0).walk, Segment(1.0, 3.0))) == 1


def test_noise_is_reduced_before_the_encoder_but_not_in_the_clip(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.02, 9 * RATE_HZ).astype(np.float32)
    track = track_of(tmp_path / "a.flac", np.concatenate([quiet(4.0), tone(1.0), quiet(4.0)]) + noise)
    walk, raw, clean = straight_walk(9.0, 0.5, track), FakeEncoder(), FakeEncoder()
    heard = detect_events(walk, raw, HearingSettings(noise_reduction_db=0.0), tmp_path / "clips")
    detect_events(walk, clean, PLAIN, tmp_path / "clips")
    ideal = tone(9.0)[: len(raw.heard[0].samples)]

    def background(samples: np.ndarray) -> float:
        spectrum = np.abs(np.fft.rfft(samples))
        return float(np.median(spectrum))

    assert background(clean.heard[0].samples) < 0.5 * background(raw.heard[0].samples)
    assert np.std(clean.heard[0].samples) == pytest.approx(np.std(ideal), rel=0.1)
    written = AudioTrack.open(heard.clips[0]).read()
    np.testing.assert_allclose(written.samples, raw.heard[0].samples, atol=1e-4)


@pytest.mark.parametrize("given", [np.zeros((0, 4), np.float32), np.full((2, 4), 3.0, np.float32)])
def test_an_encoder_that_breaks_its_promise_is_named(tmp_path: Path, given: np.ndarray) -> None:
    class Broken(FakeEncoder):
        def encode(self, sound: object) -> np.ndarray:
            return given

    track = track_of(tmp_path / "a.flac", quiet(1.0), tone(0.5), quiet(1.0))
    with pytest.raises(BackendError, match=r"The sound model test/loudness returned features of \(\d, 4\) for 0.5"):
        detect_events(straight_walk(3.0, 0.5, track), Broken(), PLAIN, tmp_path / "clips")


def test_settings_that_make_no_sense_are_told() -> None:
    with pytest.raises(AudioError, match=r"quiet_s of HearingSettings is -1; choose 0 or more\."):
        HearingSettings(quiet_s=-1.0)


def test_the_same_segments_are_heard_as_segmented(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(1.0), tone(0.3), quiet(2.0), tone(0.3), quiet(1.0))
    chosen = HearingSettings(SegmentationSettings(padding_s=0.1))
    heard = detect_events(straight_walk(4.0, 0.5, track), FakeEncoder(), chosen, tmp_path / "clips")
    expected = segment(track, chosen.segmentation)
    np.testing.assert_array_equal(heard.onset_s, [one.onset_s for one in expected])


def test_a_swell_of_the_background_is_encoded_as_it_was_heard(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    noise = (0.02 * rng.standard_normal(12 * RATE_HZ)).astype(np.float32)
    noise[5 * RATE_HZ : 6 * RATE_HZ] *= 4.0
    encoder = FakeEncoder()
    track = track_of(tmp_path / "a.flac", noise)
    heard = detect_events(straight_walk(12.0, 0.5, track), encoder, PLAIN, tmp_path / "clips")
    assert len(heard) == 1
    as_heard = track.read(float(heard.onset_s[0]), float(heard.offset_s[0]))
    np.testing.assert_array_equal(encoder.heard[0].samples, as_heard.samples)
