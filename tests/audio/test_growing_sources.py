"""Sounds that are located one after the other, while a drive goes on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_bearings import PLACES, SPANS, UP, said, surface

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.frame_sums import Walked
from avlmaps.maps.hearing import Hearing
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.sources.bearings import Device
from avlmaps.maps.sources.find import SourceFinder, find_sources
from avlmaps.maps.types import SourceEvidence
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, with_microphones, write_channels
from avlmaps.recordings.microphones import DirectionTrack, microphones_named
from helpers.heard_in_the_open import curved_drive

WALK = curved_drive(28.0, 2.0)
OFFSET_RAD = np.deg2rad(90.0)


@pytest.fixture(scope="module")
def directions() -> DirectionTrack:
    return said(WALK, OFFSET_RAD, np.random.default_rng(1), 0.2)


def until(end_s: float) -> tuple[AudioTrack, Trajectory, list[tuple[float, float]]]:
    """Return what has come until a moment: the track, the walk, and the sounds that are over."""
    count = int(np.searchsorted(WALK.stamps_s, end_s))
    walk = Trajectory(WALK.stamps_s[:count], WALK.world_from_body[:count])
    return AudioTrack(Path("none"), 16_000, end_s), walk, [span for span in SPANS if span[1] < end_s]


def until_said(directions: DirectionTrack | None, end_s: float) -> AudioTrack:
    """Return the track with what a device has said by then."""
    said_by = directions and replace(directions.between(0.0, end_s), known_rad=directions.known_rad)
    return replace(until(end_s)[0], directions=said_by)


def step(growing: SourceFinder, directions: DirectionTrack, end_s: float) -> SourceEvidence | None:
    _, walk, spans_s = until(end_s)
    return growing.find_next(until_said(directions, end_s), walk, spans_s, surface(), UP)


def off_m(evidence: SourceEvidence) -> np.ndarray:
    total = evidence.heard.astype(float) + evidence.expected.astype(float) + np.log(evidence.prior)
    return np.linalg.norm(evidence.place[total.argmax(axis=1)][:, :2] - PLACES[: len(evidence), :2], axis=1)


def test_a_device_becomes_known_while_sounds_come(directions: DirectionTrack) -> None:
    growing = SourceFinder(3)
    found: SourceEvidence | None = None
    doubt_rad: list[float] = []
    for number, (_, end_s) in enumerate(SPANS):
        found = step(growing, directions, end_s + 0.3)
        assert found is not None and len(found) == number + 1 and growing.waiting == 0
        doubt_rad.append(Device.of(found.device[0]).offset_sd_rad)
        assert step(growing, directions, end_s + 0.4) is found, "nothing came"
        assert growing.known(until(end_s + 0.4)[2]) is found
    assert found is not None
    device = Device.of(found.device[0])
    assert device.sounds == len(SPANS) and doubt_rad[-1] < doubt_rad[0]
    assert abs(np.angle(np.exp(1j * (device.offset_rad - OFFSET_RAD)))) < np.deg2rad(6.0)
    _, walk, spans_s = until(28.0)
    end = find_sources(until_said(directions, 28.0), walk, spans_s, surface(), UP)
    assert end is not None
    assert np.abs(off_m(found) - off_m(end)).max() < 0.3, "all are looked at again with the device of now"


def test_the_offset_of_an_earlier_drive_counts_as_in_a_build(directions: DirectionTrack) -> None:
    known = replace(directions, known_rad=(float(OFFSET_RAD), 0.01))
    end_s = SPANS[0][1] + 0.3
    found, alone = (step(SourceFinder(), one, end_s) for one in (known, directions))
    built = find_sources(until_said(known, end_s), *until(end_s)[1:], surface(), UP)
    assert found is not None and built is not None and alone is not None
    np.testing.assert_array_equal(found.heard, built.heard)
    assert Device.of(found.device[0]).offset_sd_rad < 0.5 * Device.of(alone.device[0]).offset_sd_rad


def test_what_waits_is_located_the_newest_first_and_again_after_a_correction(
    directions: DirectionTrack, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avlmaps.maps.sources.find._RECENT", 0)
    growing = SourceFinder(2)
    found: SourceEvidence | None = None
    assert growing.known(until(28.0)[2]) is None and growing.waiting == len(SPANS)
    for waiting in (4, 2, 0):
        found = step(growing, directions, 28.0)
        assert found is not None and growing.waiting == waiting
        located = (found.heard != 0.0).sum(axis=1) > 0
        assert not located[:waiting].any() and located[waiting:].all()
        one_more = growing.known([*until(28.0)[2], (90.0, 91.0)])
        assert one_more is not None and growing.waiting == waiting + 1
        np.testing.assert_array_equal(one_more.heard[:-1], found.heard)
        assert not (one_more.heard[-1].any() or one_more.expected[-1].any() or one_more.moving[-1])
    growing.forget()
    found = step(growing, directions, 28.0)
    assert found is not None and growing.waiting == 4 and not found.heard[:4].any()


def hearing_until(end_s: float) -> Hearing:
    ears = Hearing(Encoders(), HearingSettings(), None, name_first=False)
    ears.add(Sound(np.zeros(round(end_s * 1000), np.float32), 1000), 0.0, Walked())
    return ears


def test_directions_of_another_clock_are_left_out_and_said(directions: DirectionTrack) -> None:
    ears = hearing_until(28.0)
    ears.add_directions(DirectionTrack.of(directions.stamp_s + 1000.0, directions.azimuth_rad))
    assert ears.placed_track() is None
    assert "lie outside of the sound" in ears.doubts[0]


def test_directions_that_came_before_their_sound_are_used_when_it_has_come(directions: DirectionTrack) -> None:
    ears = hearing_until(2.0)
    ears.add_directions(directions)
    assert ears.placed_track() is None and ears.doubts
    ears.add(Sound(np.zeros(26_000, np.float32), 1000), None, Walked())
    track = ears.placed_track()
    assert track is not None and track.directions is not None and not ears.doubts


def noise_of_four(folder: Path) -> AudioTrack:
    """Return a track of an array that hears nothing in common."""
    noise = np.random.default_rng(2).normal(0.0, 0.05, (4, 28 * 16_000)).astype(np.float32)
    write_channels(folder / "track.flac", ChannelSound(noise, 16_000))
    return with_microphones(AudioTrack.open(folder / "track.flac"), microphones_named("square4"))


def test_a_device_may_begin_to_speak_after_sounds_that_an_array_located(
    directions: DirectionTrack, tmp_path: Path
) -> None:
    growing, recorded = SourceFinder(3), noise_of_four(tmp_path)
    device: list[int] = []
    for begin_s, end_s in SPANS[:2]:
        _, walk, spans_s = until(end_s + 0.3)
        said_now = directions.between(begin_s, end_s) if begin_s > SPANS[0][0] else None
        track = replace(recorded, duration_s=end_s + 0.3, directions=said_now)
        found = growing.find_next(track, walk, spans_s, surface(), UP)
        assert found is not None and len(found) == len(spans_s)
        device.append(Device.of(found.device[0]).sounds if len(found.device) else 0)
    assert device == [0, 1]
