"""A simulated device that says directions: azimuths of the sources, with the offset and the outliers asked for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import RecordingError
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import replay
from avlmaps.live.status import LiveSettings
from avlmaps.maps.build import build_map
from avlmaps.maps.hearing import take_device
from avlmaps.maps.store.folder import read
from avlmaps.recordings.open import open_recording
from avlmaps_sim.hearing.directions import ERROR_DEG, said_directions
from avlmaps_sim.mesh import Triple
from avlmaps_sim.recorder import RecordSettings, record_scene
from helpers.hearing_scenes import flat, shoebox, two_rooms

LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def sounding(place: Triple, onset_s: float, offset_s: float) -> tuple[float, float, Triple]:
    return onset_s, offset_s, place


def standing(place: tuple[float, float, float], seconds: float) -> tuple[np.ndarray, np.ndarray]:
    stamps_s = np.arange(round(seconds * 10)) / 10.0
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = LEVEL, place  # looks along x
    return stamps_s, poses


@pytest.mark.parametrize("offset_deg", [0.0, 90.0, -170.0])
def test_azimuths_are_those_of_the_source_with_the_offset(offset_deg: float) -> None:
    walk = standing((2.0, 2.0, 1.2), 40.0)
    made = said_directions(
        shoebox(), [sounding((2.0, 4.5, 1.0), 1.0, 39.0)], *walk, np.random.default_rng(0), np.deg2rad(offset_deg), 0.0
    )
    off = np.rad2deg(np.angle(np.exp(1j * (made.azimuth_rad - np.pi / 2 - np.deg2rad(offset_deg)))))
    assert abs(off.mean()) < 3.0 and off.std() == pytest.approx(ERROR_DEG, rel=0.2)
    assert made.stamp_s[0] == pytest.approx(1.0) and np.allclose(np.diff(made.stamp_s), 0.1)
    assert np.allclose(np.rint(np.rad2deg(made.azimuth_rad)), np.rad2deg(made.azimuth_rad)), "whole degrees"


def test_a_share_of_outliers_is_anything() -> None:
    walk = standing((2.0, 2.0, 1.2), 60.0)
    made = said_directions(shoebox(), [sounding((4.5, 2.0, 1.0), 0.0, 60.0)], *walk, np.random.default_rng(1), 0.0, 0.4)
    far = np.abs(made.azimuth_rad) > np.deg2rad(5 * ERROR_DEG)
    assert far.mean() == pytest.approx(0.4 * (1.0 - 5 * ERROR_DEG / 180.0), abs=0.08)


def test_behind_a_wall_it_is_the_doorway() -> None:
    walk = standing((2.0, 1.0, 1.2), 20.0)
    made = said_directions(
        two_rooms(), [sounding((6.0, 1.0, 1.0), 0.0, 20.0)], *walk, np.random.default_rng(2), 0.0, 0.0
    )
    mean = np.rad2deg(np.angle(np.exp(1j * made.azimuth_rad).mean()))
    assert 35.0 < mean < 60.0, "the doorway from y = 3 to 3.9 at x = 4, not the source straight ahead"


def test_of_sounds_at_once_it_says_one_and_nothing_between() -> None:
    walk = standing((2.0, 2.0, 1.2), 20.0)
    both = [
        sounding((4.5, 2.0, 1.0), 1.0, 3.0),
        sounding((2.0, 4.0, 1.0), 2.0, 5.0),
        sounding((1.0, 1.0, 1.0), 8.0, 9.0),
    ]
    made = said_directions(shoebox(), both, *walk, np.random.default_rng(3))
    assert (np.diff(made.stamp_s) > 0.0).all()
    assert not ((made.stamp_s > 5.0) & (made.stamp_s < 8.0)).any()


def test_a_recording_has_them_and_settings_that_cannot_be_are_refused(tmp_path: Path) -> None:
    settings = RecordSettings(
        size=(32, 24), fps=2.0, sources=2, workers=1, max_frames=20, directions=True, directions_offset_deg=90.0
    )
    made = record_scene(flat(), tmp_path / "rec", settings, seed=1)
    audio = open_recording(tmp_path / "rec").audio
    assert audio is not None and audio.directions is not None and made.heard
    spans = [(one.onset_s, one.offset_s) for one in made.heard]
    assert all(any(a - 1e-9 <= at <= b + 1e-9 for a, b in spans) for at in audio.directions.stamp_s)
    with pytest.raises(RecordingError, match="0 to 1"):
        RecordSettings(directions_outliers=1.5)
    with pytest.raises(RecordingError, match="Hearing none"):
        RecordSettings(directions=True, hearing="none")


def test_an_offset_of_no_device_is_refused() -> None:
    with pytest.raises(RecordingError, match="give both or neither"):
        RecordSettings(directions_offset_deg=90.0)


@pytest.mark.nightly
def test_the_next_map_begins_with_the_offset_that_the_first_one_stored(tmp_path: Path) -> None:
    settings = RecordSettings(
        size=(64, 48), fps=4.0, sources=2, workers=1, max_frames=30, directions=True, directions_offset_deg=60.0
    )
    record_scene(flat(), tmp_path / "rec", settings, seed=1)
    first = tmp_path / "first.avlmap"
    found = build_map(open_recording(tmp_path / "rec"), first, "colours", progress=False).sources
    assert found is not None and found.device.shape == (1, 4)
    again = read(first).sources
    assert again is not None and np.array_equal(again.device, found.device)
    record_scene(flat(), tmp_path / "next", settings, seed=2)
    recording = open_recording(tmp_path / "next")
    take_device(recording, first)
    assert recording.audio is not None and recording.audio.directions is not None
    assert recording.audio.directions.known_rad == tuple(found.device[0, :2].tolist())
    after = build_map(recording, tmp_path / "next.avlmap", "colours", progress=False).sources
    assert after is not None and len(after.device) == 1
    live = LiveMap(
        tmp_path / "live.avlmap", "colours", up_in_world=recording.up_in_world, live=LiveSettings(gates=False),
        same_device=first,
    )  # fmt: skip
    replay(open_recording(tmp_path / "next"), live, rate=None)
    ended = live.close().data.sources
    assert ended is not None
    np.testing.assert_allclose(ended.device, after.device, atol=1e-3)
    recording.audio = replace(recording.audio, directions=None)
    with pytest.raises(RecordingError, match="no directions"):
        take_device(recording, first)
