"""Channels that are not those of the microphones which the geometry says: named by the delays along a drive."""

from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.correlation import SourceSettings, signs_along
from avlmaps.maps.sources.wiring import Wiring, check_wiring
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import ChannelSound, level_faults, with_microphones, write_channels
from avlmaps.recordings.microphones import Microphones, microphones_named
from helpers.heard_in_the_open import curved_drive, heard_in_the_open

SPANS = [(1.0, 4.0), (5.5, 8.5), (10.0, 13.0), (14.5, 17.5), (19.0, 22.0), (23.5, 26.5)]
SKEW = Microphones(np.array([[0.15, 0.0, 0.0], [-0.15, 0.0, 0.0], [-0.08, 0.1, 0.02]]))
PLACES = [[2.5, 1.5, 0.6], [-2.0, 2.0, 1.2], [-1.0, -2.6, 0.4], [3.0, -1.0, 1.0], [0.2, 0.1, 0.3], [-3.0, 0.0, 1.6]]


def heard(array: Microphones, turns: float) -> tuple[ChannelSound, Trajectory]:
    walk = curved_drive(28.0, turns)
    sounds = [(np.array(place), *span) for place, span in zip(PLACES, SPANS, strict=True)]
    return heard_in_the_open(array, walk, sounds, np.random.default_rng(1)), walk


@pytest.fixture(scope="module")
def square() -> tuple[ChannelSound, Trajectory]:
    return heard(microphones_named("square4"), 1.0)


@pytest.fixture(scope="module")
def skew() -> tuple[ChannelSound, Trajectory]:
    return heard(SKEW, 1.0)


@pytest.fixture(scope="module")
def stereo() -> tuple[ChannelSound, Trajectory]:
    return heard(microphones_named("stereo"), 4.0)


def track_of(folder: Path, sound: ChannelSound, array: Microphones, order: tuple[int, ...]) -> AudioTrack:
    path = folder / "track.wav"
    write_channels(path, ChannelSound(sound.samples[list(order)], sound.rate_hz))
    return with_microphones(AudioTrack.open(path), array)


def found(folder: Path, one: tuple[ChannelSound, Trajectory], array: Microphones, order: tuple[int, ...]) -> Wiring:
    wiring = check_wiring(track_of(folder, one[0], array, order), one[1], SPANS)
    assert wiring is not None and wiring.sounds == len(SPANS)
    return wiring


@pytest.mark.few(2)
@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (0, 2, 1), (2, 1, 0), (1, 2, 0), (2, 0, 1)])
def test_every_order_of_an_array_without_symmetry_is_told(
    order: tuple[int, ...], skew: tuple[ChannelSound, Trajectory], tmp_path: Path
) -> None:
    wiring = found(tmp_path, skew, SKEW, order)
    assert wiring.order == order
    assert wiring.best_fit >= wiring.fit


@pytest.mark.few(2)
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (0, 2, 1, 3), (1, 0, 2, 3), (0, 1, 3, 2)])
def test_exchanged_neighbours_of_a_square_are_told(
    order: tuple[int, ...], square: tuple[ChannelSound, Trajectory], tmp_path: Path
) -> None:
    assert found(tmp_path, square, microphones_named("square4"), order).order == order


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_left_and_right_are_told_where_the_robot_turns(
    order: tuple[int, ...], stereo: tuple[ChannelSound, Trajectory], tmp_path: Path
) -> None:
    assert found(tmp_path, stereo, microphones_named("stereo"), order).order == order


def test_left_and_right_cannot_be_told_straight_on(tmp_path: Path) -> None:
    walk, array = curved_drive(28.0), microphones_named("stereo")
    straight = np.tile(walk.world_from_body[:1], (len(walk.stamps_s), 1, 1))
    straight[:, 0, 3] += 0.1 * walk.stamps_s
    drive = Trajectory(walk.stamps_s, straight)
    sounds = [(np.array(place), *span) for place, span in zip(PLACES, SPANS, strict=True)]
    sound = heard_in_the_open(array, drive, sounds, np.random.default_rng(2))
    for order in ((0, 1), (1, 0)):
        assert found(tmp_path, (sound, drive), array, order).is_right


@pytest.mark.few(1)
@pytest.mark.parametrize("turned", [(0,), (3,), (1, 2)])
def test_channels_wired_the_other_way_round_are_told_as_sources_take_them_back(
    turned: tuple[int, ...], square: tuple[ChannelSound, Trajectory], tmp_path: Path
) -> None:
    samples = square[0].samples.copy()
    samples[list(turned)] *= -1.0
    wiring = found(tmp_path, (ChannelSound(samples, square[0].rate_hz), square[1]),
                   microphones_named("square4"), (0, 1, 2, 3))  # fmt: skip
    rest = tuple(channel for channel in range(4) if channel not in turned)
    assert wiring.turned in (turned, rest) and len(wiring.turned) <= 2 and not wiring.is_right
    assert wiring.best_fit > wiring.fit


@pytest.mark.few(1)
@pytest.mark.parametrize("turned", [(), (0,), (3,), (1, 2)])
def test_sources_are_found_though_signs_are_turned(
    turned: tuple[int, ...], square: tuple[ChannelSound, Trajectory], tmp_path: Path
) -> None:
    sound, walk = square
    samples = sound.samples.copy()
    samples[list(turned)] *= -1.0
    track = track_of(tmp_path, ChannelSound(samples, sound.rate_hz), microphones_named("square4"), (0, 1, 2, 3))
    assert track.microphones is not None
    place = np.random.default_rng(3).uniform((-4.0, -4.0, 0.0), (4.0, 4.0, 2.0), (3000, 3))
    signs = signs_along(track, track.microphones, walk, SPANS[:3], place, SourceSettings.of(4))
    wanted = np.ones(4)
    wanted[list(turned)] = -1.0
    assert np.array_equal(signs * signs[1], wanted * wanted[1]), "a sign of all channels is no matter"


def test_noise_turns_no_sign(tmp_path: Path) -> None:
    walk = curved_drive(28.0, 1.0)
    noise = np.random.default_rng(4).standard_normal((4, 28 * 16_000)).astype(np.float32) * 0.01
    track = track_of(tmp_path, ChannelSound(noise, 16_000), microphones_named("square4"), (0, 1, 2, 3))
    assert track.microphones is not None
    place = np.random.default_rng(5).uniform((-4.0, -4.0, 0.0), (4.0, 4.0, 2.0), (3000, 3))
    assert (signs_along(track, track.microphones, walk, SPANS, place, SourceSettings.of(4)) == 1.0).all()


def test_few_sounds_say_nothing(square: tuple[ChannelSound, Trajectory], tmp_path: Path) -> None:
    track = track_of(tmp_path, square[0], microphones_named("square4"), (0, 2, 1, 3))
    assert check_wiring(track, square[1], SPANS[:2]) is None
    assert check_wiring(track, square[1], [(100.0, 103.0)] * 5) is None, "the robot is gone by then"


def test_a_copied_channel_is_named(square: tuple[ChannelSound, Trajectory], tmp_path: Path) -> None:
    samples = square[0].samples.copy()
    samples[2] = 0.7 * samples[0]
    track = track_of(tmp_path, ChannelSound(samples, square[0].rate_hz), microphones_named("square4"), (0, 1, 2, 3))
    (said,), _ = level_faults(track)
    assert "Channel 3" in said and "same sound as channel 1" in said
