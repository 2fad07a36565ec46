"""Calibration of an array in place: what was put wrong is recovered, and what a drive does not show is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.calibrate import calibrate
from avlmaps.maps.sources.correlation import correlate
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import ChannelSound, with_microphones, write_channels
from avlmaps.recordings.microphones import Microphones, microphones_named, write_microphones
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from helpers.heard_in_the_open import RATE_HZ, curved_drive, heard_in_the_open

PLACE = np.array([0.3, 2.2, 0.9])


def wrong(true: Microphones, rng: np.random.Generator, off_m: float = 0.025) -> Microphones:
    """Return an array whose places are off; their mean stays."""
    off = off_m * rng.standard_normal((len(true), 3)) * [1.0, 1.0, 0.4]
    return Microphones(true.position_m + off - off.mean(axis=0))


def heard(true: Microphones, walk: Trajectory, late_s: np.ndarray, rng: np.random.Generator) -> ChannelSound:
    return heard_in_the_open(true, walk, [(PLACE, 0.0, float(walk.stamps_s[-1]))], rng, late_s=late_s)


def track_of(folder: Path, sound: ChannelSound, array: Microphones) -> AudioTrack:
    write_channels(folder / "track.wav", sound)
    return with_microphones(AudioTrack.open(folder / "track.wav"), array)


@pytest.mark.nightly  # by day the verb finds such an array, by the same numbers
@pytest.mark.parametrize(("name", "seed"), [("square4", 0), ("square4", 1), ("stereo", 2)])
def test_places_off_by_centimetres_and_a_delay_are_recovered(name: str, seed: int, tmp_path: Path) -> None:
    rng, true, walk = np.random.default_rng(seed), microphones_named(name), curved_drive(25.0, 2.0)
    late_s = 80e-6 * rng.standard_normal(len(true))
    late_s -= late_s.mean()
    given = wrong(true, rng)
    found = calibrate(track_of(tmp_path, heard(true, walk, late_s, rng), given), walk)
    assert np.linalg.norm(given.position_m - true.position_m, axis=1).max() > 0.02
    assert np.linalg.norm((found.microphones.position_m - true.position_m)[:, :2], axis=1).max() < 0.003
    assert found.microphones.delay_s is not None
    assert np.abs(found.microphones.delay_s - late_s).max() < 8e-6
    assert found.after_s < 4e-6 < found.before_s
    assert np.linalg.norm((found.source_m - PLACE)[:2]) < 0.05
    assert np.allclose(found.microphones.position_m.mean(axis=0), given.position_m.mean(axis=0))
    if found.held_heights:
        assert np.array_equal(found.microphones.position_m[:, 2], given.position_m[:, 2])


@pytest.mark.nightly
@pytest.mark.parametrize("turned", [(0,), (1, 3)])
def test_turned_signs_are_taken_back_and_the_array_is_found_as_without(turned: tuple[int, ...], tmp_path: Path) -> None:
    rng, true, walk = np.random.default_rng(0), microphones_named("square4"), curved_drive(25.0, 2.0)
    given, sound = wrong(true, rng), heard(true, walk, np.zeros(4), rng)
    plain = calibrate(track_of(tmp_path, sound, given), walk)
    samples = sound.samples.copy()
    samples[list(turned)] *= -1.0
    found = calibrate(track_of(tmp_path, ChannelSound(samples, RATE_HZ), given), walk)
    rest = tuple(channel for channel in range(4) if channel not in turned)
    assert plain.turned == () and found.turned in (turned, rest) and len(found.turned) <= 2
    assert np.allclose(found.microphones.position_m, plain.microphones.position_m, atol=1e-3)


@pytest.mark.nightly
def test_a_right_array_stays(tmp_path: Path) -> None:
    rng, true, walk = np.random.default_rng(4), microphones_named("square4"), curved_drive(20.0)
    found = calibrate(track_of(tmp_path, heard(true, walk, np.zeros(4), rng), true), walk)
    assert found.moved_m.max() < 0.01 and found.microphones.delay_s is not None
    assert np.abs(found.microphones.delay_s).max() < 5e-6


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> tuple[AudioTrack, Trajectory]:
    rng, true, walk = np.random.default_rng(5), microphones_named("square4"), curved_drive(9.0)
    poses = np.tile(walk.world_from_body[:1], (len(walk.stamps_s), 1, 1))
    poses[:, 0, 3] += 0.02 * walk.stamps_s
    drive = Trajectory(walk.stamps_s, poses)
    return track_of(tmp_path_factory.mktemp("straight"), heard(true, drive, np.zeros(4), rng), true), drive


@pytest.mark.slow
def test_a_drive_that_does_not_turn_is_refused_with_what_is_unknown(straight: tuple[AudioTrack, Trajectory]) -> None:
    with pytest.raises(RecordingError, match=r"does not determine the array: .*known to .* cm .*turn on the spot"):
        calibrate(*straight)


@pytest.mark.parametrize(
    ("between", "said"),
    [((2.0, 3.0), "Too little sounds"), ((5.0, 400.0), "no sound with poses"), ((6.0, 2.0), "no sound with poses")],
)
def test_too_little_sound_is_refused(
    between: tuple[float, float], said: str, straight: tuple[AudioTrack, Trajectory]
) -> None:
    with pytest.raises(RecordingError, match=said):
        calibrate(*straight, between)


@pytest.mark.nightly
def test_several_sources_are_refused(tmp_path: Path) -> None:
    rng, true, walk = np.random.default_rng(9), microphones_named("square4"), curved_drive(24.0)
    others = [(PLACE, 0.0, 14.0), (np.array([-2.5, -1.0, 1.0]), 14.0, 19.0), (np.array([3.0, -2.0, 1.0]), 19.0, 24.0)]
    sound = heard_in_the_open(true, walk, others, rng)
    with pytest.raises(RecordingError, match="several things sounded"):
        calibrate(track_of(tmp_path, sound, true), walk)


@pytest.mark.nightly
def test_a_source_that_moves_with_the_robot_is_refused(tmp_path: Path) -> None:
    rng, array, walk = np.random.default_rng(3), microphones_named("square4"), curved_drive(20.0)
    late_s = np.linalg.norm(array.position_m - [1.0, 0.4, -0.3], axis=1) / 343.0
    sound = 1e-4 * rng.standard_normal((4, 20 * RATE_HZ))
    hertz = np.fft.rfftfreq(4096, 1.0 / RATE_HZ)
    for begin in range(RATE_HZ // 2, 19 * RATE_HZ, RATE_HZ // 4):
        burst = np.fft.rfft(rng.standard_normal(800) * np.exp(-np.arange(800) / 200.0), 4096)
        sound[:, begin : begin + 4096] += np.fft.irfft(burst * np.exp(-2j * np.pi * hertz * late_s[:, None]), 4096)
    track = track_of(tmp_path, ChannelSound((0.1 * sound).astype(np.float32), RATE_HZ), array)
    with pytest.raises(RecordingError, match=r"would lie \d+ cm from its given place"):
        calibrate(track, walk)


def test_silence_and_one_microphone_are_refused(tmp_path: Path) -> None:
    walk, array = curved_drive(6.0), microphones_named("square4")
    with pytest.raises(RecordingError, match="Too little sounds"):
        calibrate(track_of(tmp_path, ChannelSound(np.zeros((4, 6 * RATE_HZ), np.float32), RATE_HZ), array), walk)
    with pytest.raises(RecordingError, match="no array to calibrate"):
        mono = ChannelSound(np.zeros((1, 6 * RATE_HZ), np.float32), RATE_HZ)
        calibrate(track_of(tmp_path, mono, microphones_named("mono")), walk)


@pytest.mark.parametrize("late_s", [0.0, 3.1e-5, -2.4e-4])
def test_a_delay_that_is_known_is_taken_back(late_s: float) -> None:
    plain = np.random.default_rng(6).standard_normal(4000)
    turned = np.fft.rfft(plain) * np.exp(-2j * np.pi * np.fft.rfftfreq(4000, 1.0 / RATE_HZ) * late_s)
    both = np.stack([plain, np.fft.irfft(turned, 4000)])
    found = correlate(both, RATE_HZ, 0.0, 0.0, 0.2, np.array([0.0, late_s]))
    middle = found.curve.sum(axis=0)[0]
    assert abs(found.first_s + int(np.argmax(middle)) * found.step_s) < found.step_s


def recorded(folder: Path, given: Microphones) -> Path:
    rng, true, walk = np.random.default_rng(7), microphones_named("square4"), curved_drive(22.0, 2.0)
    rig = Rig(*(Pinhole(50.0, 50.0, 32.0, 24.0, 64, 48),) * 2)
    with RecordingWriter(folder, rig, np.array([0.0, 0.0, 1.0])) as writer:
        for index, (at_s, pose) in enumerate(zip(walk.stamps_s, walk.world_from_body, strict=True)):
            picture = np.full((48, 64, 3), index % 200, np.uint8)
            writer.add(Frame(index, f"{index}", at_s, picture, np.full((48, 64), 1.0, np.float32), pose, rig))
        writer.set_audio(heard(true, walk, np.array([60e-6, -60e-6, 0.0, 0.0]), rng), microphones=given)
    return folder


def test_the_verb_writes_a_geometry_that_a_recording_can_be_read_with(run, tmp_path: Path) -> None:
    given = wrong(microphones_named("square4"), np.random.default_rng(8))
    folder, out = recorded(tmp_path / "rec", given), tmp_path / "array.json"
    before = (folder / "recording.json").read_bytes()
    status, said, _ = run("calibrate", folder, "--out", out, "--json")
    answer = json.loads(said)
    assert status == 0 and answer["residual_after_s"] < 0.1 * answer["residual_before_s"]
    assert (folder / "recording.json").read_bytes() == before, "the recording stays as it is"
    refined = open_recording(folder, microphones=out)
    assert refined.audio is not None and refined.audio.microphones is not None
    array = refined.audio.microphones
    off = array.position_m - microphones_named("square4").position_m
    assert np.linalg.norm(off[:, :2], axis=1).max() < 0.003
    assert array.delay_s is not None and np.allclose(array.delay_s, [60e-6, -60e-6, 0.0, 0.0], atol=8e-6)
    assert any("array.json" in notice for notice in refined.notices)
    status, _, err = run("calibrate", folder, "--out", out)
    assert status == 1 and "is there already" in err
    status, text, _ = run("calibrate", folder, "--out", out, "--overwrite", "--microphones", out)
    assert status == 0 and "wrote" in text and "before" in text


def test_delays_of_channels_that_cannot_be_are_refused(tmp_path: Path) -> None:
    array = microphones_named("stereo")
    with pytest.raises(RecordingError, match=r"at most .* either way"):
        replace(array, delay_s=np.array([0.0, 0.4]))
    with pytest.raises(RecordingError, match=r"at most .* either way"):
        replace(array, delay_s=np.array([0.0, np.nan]))
    with pytest.raises(RecordingError, match="one for each of the 2"):
        replace(array, delay_s=np.zeros(3))
    late = replace(array, delay_s=np.array([1e-4, 0.0]))
    write_microphones(tmp_path / "late.json", late)
    again = microphones_named(str(tmp_path / "late.json"))
    assert again.delay_s is not None and np.allclose(again.delay_s, [1e-4, 0.0])
    assert again.take([1]).delay_s == np.array([0.0])
    with pytest.raises(RecordingError, match="cannot be written"):
        write_microphones(tmp_path / "nowhere" / "late.json", late)
