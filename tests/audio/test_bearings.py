"""Directions that a device says: offset and outliers found along the walk, and regions as wide as that is unsure."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.bearings import Bearings, Device, evidence_of_bearings, expected_alone
from avlmaps.maps.sources.candidates import Candidates, Walls, candidates_of
from avlmaps.maps.sources.correlation import SourceSettings
from avlmaps.maps.sources.find import find_sources
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.microphones import DirectionTrack
from helpers.heard_in_the_open import curved_drive

UP = np.array([0.0, 0.0, 1.0])
SPANS = [(1.0, 4.0), (5.5, 8.5), (10.0, 13.0), (14.5, 17.5), (19.0, 22.0), (23.5, 26.5)]
PLACES = np.array(
    [[2.5, 1.5, 0.6], [-2.0, 2.0, 1.2], [-1.0, -2.3, 0.4], [2.8, -1.0, 1.0], [0.2, 0.1, 0.3], [-2.8, 0, 1]]
)


def surface() -> np.ndarray:
    """Return the floor and the things that sound, in a room of 6 x 5 m round the origin, metres."""
    floor = [(x, y, 0.0) for x in np.arange(-3, 3, 0.1) for y in np.arange(-2.5, 2.5, 0.1)]
    things = PLACES[:, None] + np.random.default_rng(0).uniform(-0.1, 0.1, (len(PLACES), 60, 3))
    return np.concatenate([floor, things.reshape(-1, 3)])


def said(walk: Trajectory, offset_rad: float, rng: np.random.Generator, outliers: float = 0.1) -> DirectionTrack:
    """Return azimuths, ten a second, of what sounds then."""
    stamps: list[float] = []
    azimuth: list[float] = []
    for place, (begin_s, end_s) in zip(PLACES, SPANS, strict=True):
        at_s = np.arange(begin_s, end_s, 0.1)
        for stamp_s, pose in zip(at_s, walk.at(at_s), strict=True):
            away = place - pose[:3, 3]
            true = np.arctan2(away[1], away[0]) - np.arctan2(pose[1, 2], pose[0, 2])
            value = (
                rng.uniform(-np.pi, np.pi) if rng.random() < outliers else true + np.deg2rad(8) * rng.standard_normal()
            )
            stamps.append(float(stamp_s))
            azimuth.append(float(np.angle(np.exp(1j * (value + offset_rad)))))
    return DirectionTrack.of(stamps, azimuth)


def evidence(track: DirectionTrack, walk: Trajectory, spans: list[tuple[float, float]] = SPANS):
    candidates = candidates_of(surface(), walk.world_from_body[:, :3, 3])
    walls = Walls.of(surface(), 1.1)
    heard = [Bearings.of(track, walk, span) for span in spans]
    expected = [expected_alone(walk, span, candidates, walls, SourceSettings.of(0)) for span in spans]
    return candidates, *evidence_of_bearings(heard, [walls] * len(spans), candidates, expected, track.known_rad)


def errors_m(candidates: Candidates, values: list[np.ndarray], places: np.ndarray) -> np.ndarray:
    found = np.array([candidates.place_m[int(np.argmax(value + np.log(candidates.prior)))] for value in values])
    return np.linalg.norm(found[:, :2] - places[:, :2], axis=1)


@pytest.mark.parametrize("offset_deg", [0.0, 90.0, 180.0, -37.0])
def test_offset_and_places_are_found_along_a_walk(offset_deg: float) -> None:
    walk = curved_drive(28.0, 2.0)
    track = said(walk, np.deg2rad(offset_deg), np.random.default_rng(1), 0.2)
    candidates, values, device = evidence(track, walk)
    assert device is not None and device.sounds == len(SPANS)
    off = np.angle(np.exp(1j * (device.offset_rad - np.deg2rad(offset_deg))))
    assert abs(np.rad2deg(off)) < 6.0 and np.rad2deg(device.offset_sd_rad) < 10.0
    assert np.median(errors_m(candidates, values, PLACES)) < 0.4
    assert "degrees off" in device.sentence


def test_what_is_turned_with_its_offset_says_the_same() -> None:
    walk, rng = curved_drive(28.0, 2.0), np.random.default_rng(2)
    track = said(walk, 0.0, rng)
    turned = replace(track, azimuth_rad=np.angle(np.exp(1j * (track.azimuth_rad + np.pi / 2))))
    _, plain, _ = evidence(track, walk)
    _, other, device = evidence(turned, walk)
    assert device is not None and abs(np.rad2deg(device.offset_rad) - 90.0) < 6.0
    for one, two in zip(plain, other, strict=True):
        assert np.allclose(one - one.max(), two - two.max(), atol=1e-3)


def test_an_offset_that_the_walk_does_not_show_widens_the_region_unless_it_is_known() -> None:
    walk = curved_drive(28.0)
    still = Trajectory(walk.stamps_s, np.tile(walk.world_from_body[:1], (len(walk.stamps_s), 1, 1)))
    track = said(still, 0.6, np.random.default_rng(3))
    _, values, device = evidence(track, still, SPANS[:1])
    assert device is not None and np.rad2deg(device.offset_sd_rad) > 30.0 and "not determined" in device.sentence
    assert np.ptp(values[0]) < 2.0, "no place is told from another"
    _, values, device = evidence(replace(track, known_rad=(0.6, 0.1)), still, SPANS[:1])
    assert device is not None and np.rad2deg(device.offset_sd_rad) < 25.0
    assert np.ptp(values[0]) > 2.0, "now places are told from one another"


def test_a_device_that_was_put_on_anew_is_found_though_another_offset_was_known() -> None:
    walk = curved_drive(28.0, 2.0)
    track = replace(said(walk, 1.5, np.random.default_rng(1)), known_rad=(-1.0, 0.05))
    _, _, device = evidence(track, walk)
    assert device is not None and abs(device.offset_rad - 1.5) < 0.1


def test_outliers_alone_say_nothing() -> None:
    walk = curved_drive(28.0, 2.0)
    track = said(walk, 0.0, np.random.default_rng(4), outliers=1.0)
    _, values, _ = evidence(track, walk)
    sure = said(walk, 0.0, np.random.default_rng(4), outliers=0.0)
    _, told, _ = evidence(sure, walk)
    assert np.mean([np.ptp(value) for value in values]) < 0.5 * np.mean([np.ptp(value) for value in told])


@pytest.mark.nightly
def test_a_sound_without_directions_and_doubtful_ones_count_less() -> None:
    walk = curved_drive(28.0, 2.0)
    track = said(walk, 0.0, np.random.default_rng(5))
    _, values, _ = evidence(track, walk, [*SPANS[:2], (26.8, 27.5)])
    assert not values[2].any()
    doubtful = replace(track, confidence=np.full(len(track), 0.2))
    _, less, _ = evidence(doubtful, walk)
    _, more, _ = evidence(track, walk)
    assert np.ptp(less[0]) < np.ptp(more[0])


def test_elevations_tell_high_from_low() -> None:
    walk = curved_drive(28.0, 2.0)
    track = said(walk, 0.0, np.random.default_rng(6))
    candidates = candidates_of(surface(), walk.world_from_body[:, :3, 3])
    high = Bearings.of(replace(track, elevation_rad=np.full(len(track), 0.3)), walk, SPANS[0])
    low = Bearings.of(replace(track, elevation_rad=np.full(len(track), -0.6)), walk, SPANS[0])
    place = candidates.place_m.astype(float)
    assert place[np.argmax(high.elevations(place)), 2] > 1.1 > place[np.argmax(low.elevations(place)), 2]
    assert not Bearings.of(track, walk, SPANS[0]).elevations(place).any()


def test_a_track_of_directions_alone_gives_sources(capsys: pytest.CaptureFixture[str]) -> None:
    walk = curved_drive(28.0, 2.0)
    track = AudioTrack(Path("none.flac"), 16_000, 28.0, directions=said(walk, 1.5, np.random.default_rng(7)))
    found = find_sources(track, walk, SPANS, surface(), UP)
    assert found is not None and len(found) == len(SPANS) and found.channels[0] == 0
    assert "+8" in capsys.readouterr().err, "86 degrees are reported"
    assert abs(Device.of(found.device[0]).offset_rad - 1.5) < 0.1 and Device.of(found.device[0]).sounds == len(SPANS)
    best = found.place[np.argmax(found.heard.astype(float) + np.log(found.prior), axis=1)]
    assert np.median(np.linalg.norm(best[:, :2] - PLACES[:, :2], axis=1)) < 0.4
