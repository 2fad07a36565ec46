"""Clocks in another unit, poses out of place and walks that no camera makes are seen before a map is made of them."""

from pathlib import Path

import numpy as np
import pytest
from recording_scenes import write_folder

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.plausible import date_fault, pace_fault, plausible_walk, repeat_fault

FRAMES_S = np.arange(150) / 30.0


def test_dates_are_seconds() -> None:
    assert "milliseconds since 1970" in date_fault(np.array([1.7e12]), "frames")
    assert "nanoseconds since 1970" in date_fault(np.array([1.7e18]), "frames")
    assert not date_fault(np.array([1.7e9, np.nan]), "frames") and not date_fault(np.zeros(0), "frames")


@pytest.mark.few(4)
@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 30.0, 120.0])
@pytest.mark.parametrize(("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
def test_the_pace_of_a_camera_tells_the_unit(rate_hz: float, factor: float, unit: str) -> None:
    stamps_s = np.arange(60) / rate_hz * factor
    if np.median(np.diff(stamps_s)) > 10.0 and stamps_s[-1] <= 1e10:  # later stamps are dates
        assert f"look like {unit};" in pace_fault(stamps_s, "frames")
        assert f"look like {unit};" in pace_fault(stamps_s, "frames", 1.0 / rate_hz)
    later = stamps_s + 1e13  # since a robot was started, no date
    assert f"reach {later[-1]:.6g}, which are {unit}, not seconds" in date_fault(later, "frames")
    assert "which are another unit, not seconds" in date_fault(later[:1], "frames")
    dates = stamps_s + 1.7e9 * factor
    assert f"which are {unit} since 1970, not seconds" in date_fault(dates, "frames")


def test_an_even_pace_of_half_a_minute_is_no_walk_unless_the_recording_says_so() -> None:
    assert "look like milliseconds" in pace_fault(FRAMES_S * 1e3, "frames")
    assert not pace_fault(FRAMES_S, "frames") and not pace_fault(FRAMES_S * 1e3, "frames", 33.0)
    stops_s = np.cumsum(np.random.default_rng(0).uniform(5.0, 60.0, 40))  # scans at stops
    assert not pace_fault(stops_s, "frames")


def _walk(count: int = 200) -> tuple[np.ndarray, np.ndarray, list[str]]:
    stamps_s = np.arange(count) / 30.0
    positions = np.stack([0.8 * stamps_s, np.sin(stamps_s), np.full(count, 1.2)], axis=1)
    return stamps_s, positions, [f"{i:06d}" for i in range(count)]


@pytest.mark.few(4)
@pytest.mark.parametrize("away_m", [10.0, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("at", [[0], [57], [199], [57, 58, 120]])
def test_far_poses_are_left_out_by_name(away_m: float, at: list[int]) -> None:
    stamps_s, positions, names = _walk()
    positions[at, 0] += away_m
    found = plausible_walk(stamps_s, positions, names)
    assert not found.fault and np.array_equal(found.index, np.setdiff1d(np.arange(200), at))
    assert len(found.notices) == 1 and names[at[0]] in found.notices[0] and "left out" in found.notices[0]


def test_a_plain_walk_is_used_whole() -> None:
    stamps_s, positions, names = _walk()
    found = plausible_walk(stamps_s, positions, names)
    assert len(found.index) == 200 and not found.notices and not found.fault
    assert not len(plausible_walk(stamps_s[:0], positions[:0], []).index)


def test_a_shift_of_metres_is_told_and_one_of_kilometres_is_refused() -> None:
    stamps_s, positions, names = _walk()
    positions[100:] += 5.0
    found = plausible_walk(stamps_s, positions, names)
    assert len(found.index) == 200 and "between frames 000099 and 000100" in found.notices[0] and not found.fault
    positions[100:] += 1e4
    assert "between frames 000099 and 000100; fix those poses" in plausible_walk(stamps_s, positions, names).fault


def test_walks_too_wide_or_too_far_from_the_origin_are_refused() -> None:
    stamps_s, positions, names = _walk()
    assert "subtract the first position" in plausible_walk(stamps_s, positions + 5e6, names).fault
    long = np.stack([np.linspace(0, 3000, 3000), np.zeros(3000), np.zeros(3000)], axis=1)
    assert "a map has at most 2,000 m" in plausible_walk(np.arange(3000.0), long, [str(i) for i in range(3000)]).fault


def test_a_folder_with_poses_in_milliseconds_is_refused_in_one_sentence(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk", count=8)
    (path / "frames.csv").write_text("name,stamp_s\n" + "".join(f"{i:06d},{i / 10}\n" for i in range(8)))
    lines = (path / "poses.csv").read_text().splitlines()
    for factor, unit in ((1e3, "milliseconds"), (1e9, "nanoseconds")):
        scaled = [f"{float(a) * factor!r},{b}" for a, b in (line.split(",", 1) for line in lines[1:])]
        (path / "poses.csv").write_text("\n".join([lines[0], *scaled]))
        with pytest.raises(RecordingError, match=f"poses of poses.csv are .* apart, so their stamps look like {unit}"):
            open_recording(path)


@pytest.mark.parametrize(
    ("stamps_s", "said"),
    [
        (np.floor(np.arange(60) / 10.0), "whole seconds"),
        ((1.7e9 + np.arange(60) / 10.0).astype(np.float32).astype(np.float64), "single precision"),
        (np.tile(np.arange(20) / 7.0, 3), ""),
        (np.arange(60.0), ""),
    ],
    ids=["whole", "single precision", "a looped bag", "one a second"],
)
def test_stamps_that_lost_their_fractions_are_named(stamps_s: np.ndarray, said: str) -> None:
    found = repeat_fault(stamps_s, "frames")
    assert said in found and bool(found) == bool(said)
