from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from audio_fakes import RATE_HZ, quiet, tone, track_of
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AudioError
from avlmaps.maps.audio.background import band_powers
from avlmaps.maps.audio.segmentation import Segment, segment
from avlmaps.maps.settings import SegmentationSettings
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac

HOP_S = 0.01
BARE = SegmentationSettings(padding_s=0.0)
SILENCE = SegmentationSettings(method="silence", padding_s=0.0, silence_threshold=0.01)


def noise(seconds: float, level: float, seed: int = 0, rate_hz: int = RATE_HZ) -> np.ndarray:
    return (level * np.random.default_rng(seed).standard_normal(round(seconds * rate_hz))).astype(np.float32)


def bounds(segments: list[Segment]) -> list[tuple[float, float]]:
    return [(one.onset_s, one.offset_s) for one in segments]


@pytest.mark.parametrize("rate_hz", [8_000, 16_000, 22_050, 44_100, 48_000])
def test_a_tone_in_silence_is_found_within_two_hops(tmp_path: Path, rate_hz: int) -> None:
    track = track_of(
        tmp_path / "a.flac", quiet(2.0, rate_hz), tone(0.5, rate_hz=rate_hz), quiet(2.0, rate_hz), rate_hz=rate_hz
    )
    [found] = segment(track, BARE)
    assert (found.onset_s, found.offset_s) == pytest.approx((2.0, 2.5), abs=2 * HOP_S)


@pytest.mark.parametrize("level", [0.001, 0.01])
def test_a_tone_in_noise_is_found_within_two_hops(tmp_path: Path, level: float) -> None:
    track = track_of(tmp_path / "a.flac", np.concatenate([quiet(4.0), tone(0.5), quiet(4.0)]) + noise(8.5, level))
    [found] = segment(track, BARE)
    assert (found.onset_s, found.offset_s) == pytest.approx((4.0, 4.5), abs=2 * HOP_S)


def test_the_recordings_clock_counts(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(1.0), tone(0.5), quiet(1.0), start_s=-7.0)
    [found] = segment(track, BARE)
    assert found.onset_s == pytest.approx(-6.0, abs=2 * HOP_S)


@pytest.mark.parametrize("method", ["adaptive", "silence"])
def test_a_silent_track_has_no_sounds(tmp_path: Path, method: str) -> None:
    track = track_of(tmp_path / "a.flac", quiet(3.0))
    assert segment(track, replace(BARE, method=method)) == []  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("level", [0.0001, 0.01, 0.3])
def test_steady_noise_has_no_sounds(tmp_path: Path, level: float) -> None:
    assert segment(track_of(tmp_path / "a.flac", noise(30.0, level))) == []


@pytest.mark.parametrize("seconds", [0.0001, 0.005, 0.02, 0.3])
def test_a_track_shorter_than_a_window_is_no_crash(tmp_path: Path, seconds: float) -> None:
    track = track_of(tmp_path / "a.flac", tone(seconds, hz=3000.0))
    for one in segment(track):
        assert 0.0 <= one.onset_s < one.offset_s <= track.duration_s


def test_a_constant_offset_is_not_heard(tmp_path: Path) -> None:
    pieces = (quiet(2.0), tone(0.5, level=0.1), quiet(2.0))
    plain = track_of(tmp_path / "a.flac", *pieces)
    offset = track_of(tmp_path / "b.flac", *(piece + np.float32(0.4) for piece in pieces))
    [a], [b] = segment(plain, BARE), segment(offset, BARE)
    assert (b.onset_s, b.offset_s) == pytest.approx((a.onset_s, a.offset_s), abs=2 * HOP_S)


def test_a_clipped_sound_is_found(tmp_path: Path) -> None:
    [found] = segment(track_of(tmp_path / "a.flac", quiet(1.0), tone(0.5, level=20.0), quiet(1.0)), BARE)
    assert (found.onset_s, found.offset_s) == pytest.approx((1.0, 1.5), abs=2 * HOP_S)


def test_barks_with_short_pauses_are_one_sound(tmp_path: Path) -> None:
    bark = tone(0.2)
    track = track_of(tmp_path / "a.flac", quiet(2.0), bark, quiet(0.6), bark, quiet(0.6), bark, quiet(2.0), bark)
    assert len(segment(track, BARE)) == 2
    assert len(segment(track, replace(BARE, merge_gap_s=0.3))) == 4


def test_a_click_is_no_sound_but_a_footstep_is(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(2.0), tone(0.08), quiet(2.0), tone(0.4), quiet(2.0))
    assert len(segment(track, BARE)) == 2
    assert len(segment(track, replace(BARE, min_length_s=0.2))) == 1


def test_a_long_sound_is_cut_at_its_quietest_moment(tmp_path: Path) -> None:
    loud, soft = noise(4.0, 0.1), noise(0.1, 0.02, seed=1)
    track = track_of(tmp_path / "a.flac", quiet(8.0), loud, soft, loud, quiet(8.0))
    found = segment(track, replace(BARE, max_length_s=6.0, merge_gap_s=0.0))
    assert len(found) == 2
    assert found[0].offset_s == pytest.approx(12.05, abs=0.1)
    assert all(one.duration_s <= 6.0 for one in found)


def test_padding_stays_between_neighbours_and_within_the_track(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", tone(0.3), quiet(1.4), tone(0.3))
    first, second = segment(track, replace(BARE, padding_s=1.0))
    assert first.onset_s == 0.0
    assert second.offset_s == track.duration_s
    assert first.offset_s == pytest.approx(1.0, abs=HOP_S)
    assert first.offset_s <= second.onset_s


def test_a_background_that_swells_slowly_is_followed(tmp_path: Path) -> None:
    swell = np.exp(np.linspace(np.log(0.003), np.log(0.03), 120 * RATE_HZ)).astype(np.float32)  # 20 dB in two minutes
    samples = noise(120.0, 1.0) * swell
    samples[60 * RATE_HZ : 61 * RATE_HZ] += tone(1.0, level=0.1)
    [found] = segment(track_of(tmp_path / "a.flac", samples), BARE)
    assert (found.onset_s, found.offset_s) == pytest.approx((60.0, 61.0), abs=0.05)


def test_how_the_track_is_cut_into_blocks_changes_nothing() -> None:
    samples = noise(3.0, 0.1)
    whole = band_powers([Sound(samples, RATE_HZ)])
    for cuts in ([1], [7, 8, 9, 30_000], list(range(100, 48_000, 997))):
        pieces = band_powers(Sound(piece, RATE_HZ) for piece in np.split(samples, cuts))
        np.testing.assert_allclose(pieces, whole, rtol=1e-4, atol=1e-12)
    assert len(whole) == 300


def test_segments_do_not_depend_on_the_size_of_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = [part for i in range(12) for part in (noise(0.9 + 0.13 * i, 0.003, i), noise(0.4, 0.1, i + 50))]
    track = track_of(tmp_path / "a.flac", *parts)
    expected = {
        method: segment(track, replace(BARE, method=method, silence_threshold=0.02))
        for method in ("adaptive", "silence")
    }  # pyright: ignore[reportArgumentType]
    for seconds in (0.07, 1.0, 3.3):
        monkeypatch.setattr("avlmaps.maps.audio.segmentation._BLOCK_S", seconds)
        for method, found in expected.items():
            assert segment(track, replace(BARE, method=method, silence_threshold=0.02)) == found  # pyright: ignore[reportArgumentType]
    assert len(expected["adaptive"]) > 3


BURSTS = st.lists(st.tuples(st.floats(0.05, 2.5), st.floats(0.05, 1.0), st.floats(0.01, 0.5)), min_size=0, max_size=5)


def bursts(parts: list[tuple[float, float, float]]) -> np.ndarray:
    pieces = [quiet(0.5, 8_000)]
    for i, (pause_s, length_s, level) in enumerate(parts):
        pieces += [quiet(pause_s, 8_000), noise(length_s, level, i, 8_000)]
    return np.concatenate([*pieces, quiet(0.5, 8_000)])


@given(
    parts=BURSTS, method=st.sampled_from(["adaptive", "silence"]), merge=st.floats(0.0, 2.0), pad=st.floats(0.0, 1.0)
)
def test_segments_are_ordered_disjoint_and_within_the_track(
    tmp_path_factory: pytest.TempPathFactory,
    parts: list[tuple[float, float, float]],
    method: str,
    merge: float,
    pad: float,
) -> None:
    track = track_of(tmp_path_factory.getbasetemp() / "bursts.flac", bursts(parts), rate_hz=8_000, start_s=3.0)
    chosen = SegmentationSettings(method=method, merge_gap_s=merge, padding_s=pad, max_length_s=1.5)  # pyright: ignore[reportArgumentType]
    edges = np.array(bounds(segment(track, chosen))).ravel()
    assert (np.diff(edges) >= 0.0).all()
    assert (np.diff(edges)[::2] > 0.0).all()
    assert not len(edges) or (edges[0] >= 3.0 and edges[-1] <= track.end_s)
    assert bool(len(edges)) == bool(parts)


@given(parts=BURSTS, gain_db=st.floats(-30.0, 0.0))
def test_a_constant_gain_does_not_change_the_segments(
    tmp_path_factory: pytest.TempPathFactory, parts: list[tuple[float, float, float]], gain_db: float
) -> None:
    import soundfile

    path, samples = tmp_path_factory.getbasetemp() / "gain.wav", np.clip(bursts(parts), -0.99, 0.99)
    found = []
    for gain in (1.0, 10.0 ** (gain_db / 20.0)):
        soundfile.write(path, samples * np.float32(gain), 8_000, subtype="FLOAT")
        found.append(bounds(segment(AudioTrack.open(path), BARE)))
    assert found[0] == found[1]


@given(parts=BURSTS, hops=st.integers(1, 500), method=st.sampled_from(["adaptive", "silence"]))
def test_silence_before_shifts_the_segments(
    tmp_path_factory: pytest.TempPathFactory, parts: list[tuple[float, float, float]], hops: int, method: str
) -> None:
    path, samples = tmp_path_factory.getbasetemp() / "shift.flac", bursts(parts)
    chosen = replace(BARE, method=method)  # pyright: ignore[reportArgumentType]
    plain = bounds(segment(track_of(path, samples, rate_hz=8_000), chosen))
    later = bounds(segment(track_of(path, quiet(hops * HOP_S, 8_000), samples, rate_hz=8_000), chosen))
    np.testing.assert_allclose(np.array(later).ravel() - hops * HOP_S, np.array(plain).ravel(), atol=1e-9)


def test_the_papers_rule_splits_at_a_second_of_silence(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", quiet(1.0), tone(0.5), quiet(0.8), tone(0.5), quiet(1.2), tone(0.5))
    found = segment(track, SILENCE)
    np.testing.assert_allclose(bounds(found), [(1.0, 2.8), (4.0, 4.5)], atol=1e-3)


def test_the_papers_rule_hears_both_signs(tmp_path: Path) -> None:
    [found] = segment(track_of(tmp_path / "a.flac", quiet(1.0), -np.abs(tone(0.5)), quiet(1.0)), SILENCE)
    assert found.onset_s == pytest.approx(1.0, abs=1e-3)


def test_settings_that_make_no_sense_are_told() -> None:
    with pytest.raises(AudioError, match=r"max_length_s of SegmentationSettings is -1; choose a positive number\."):
        SegmentationSettings(max_length_s=-1.0)
    with pytest.raises(AudioError, match=r"onset_db is 1.0, less than release_db \(2.5\); choose more."):
        SegmentationSettings(onset_db=1.0)


@pytest.mark.nightly
def test_a_minute_more_is_searched_in_half_a_megabyte_more(tmp_path: Path) -> None:
    import tracemalloc

    def minutes(count: int) -> Path:
        minute = np.concatenate([noise(57.0, 0.003), noise(3.0, 0.1)])
        write_flac(tmp_path / f"{count}.flac", (Sound(minute, RATE_HZ) for _ in range(count)))
        return tmp_path / f"{count}.flac"

    peaks = []
    for count in (2, 10):
        track = AudioTrack.open(minutes(count))
        tracemalloc.start()
        assert len(segment(track)) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 8 * 500_000
