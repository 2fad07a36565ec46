"""Recordings with several microphones: read as written, and each fault of geometry or channels is a sentence."""

import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import soundfile
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, GrowingTrack, level_faults, read_channels, with_microphones
from avlmaps.recordings.microphones import Microphones, microphones_named
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from avlmaps_sim.mixing.add_sounds import write_recording

RATE_HZ = 16_000
RIG = Rig(*(Pinhole(50.0, 50.0, 32.0, 24.0, 64, 48),) * 2)


def noise(channels: int, seconds: float = 2.0, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return (0.1 * rng.standard_normal((channels, round(seconds * RATE_HZ)))).astype(np.float32)


def recorded(folder: Path, audio: ChannelSound | Sound | None, microphones: Microphones | None) -> Path:
    with RecordingWriter(folder, RIG, np.array([0.0, 0.0, 1.0])) as writer:
        for index in range(3):
            pose = np.eye(4)
            pose[0, 3] = index
            picture = np.full((48, 64, 3), 9 * index, np.uint8)
            writer.add(Frame(index, f"{index}", index * 1.0, picture, np.full((48, 64), 1.0, np.float32), pose, RIG))
        if audio is not None:
            writer.set_audio(audio, microphones=microphones)
    return folder


def test_an_array_is_read_as_it_was_written(tmp_path: Path) -> None:
    array, samples = microphones_named("square4"), noise(4)
    track = open_recording(recorded(tmp_path / "rec", ChannelSound(samples, RATE_HZ), array)).audio
    assert track is not None and track.microphones is not None
    assert np.allclose(track.microphones.position_m, array.position_m)
    piece = read_channels(track, 0.5, 1.0)
    assert np.allclose(piece.samples, samples[:, 8000:16000], atol=1e-4)
    assert np.array_equal(track.read(0.5, 1.0).samples, piece.samples[0]), "as one channel it sounds as its first"
    outside = read_channels(track, -0.5, 0.25).samples
    assert not outside[:, :8000].any() and outside[:, 8000:].any()


def test_a_copy_keeps_the_array_and_files_of_channels(tmp_path: Path) -> None:
    first = recorded(tmp_path / "one", ChannelSound(noise(2), RATE_HZ), microphones_named("stereo"))
    copy = open_recording(write_recording(open_recording(first), tmp_path / "two")).audio
    assert copy is not None and copy.microphones is not None and len(copy.microphones) == 2
    apart = recorded(tmp_path / "apart", None, None)
    for number, samples in enumerate(noise(2)):
        soundfile.write(apart / f"{number}.wav", samples, RATE_HZ)
    describe(apart, positions_m=[[0, 0.1, 0], [0, -0.1, 0]], files=["0.wav", "1.wav"])
    for path in (apart, write_recording(open_recording(apart), tmp_path / "again")):
        track = open_recording(path).audio
        assert track is not None
        assert np.allclose(read_channels(track, 0.0, 2.0).samples, noise(2), atol=1e-4)


def test_channels_without_a_microphone_are_left_out_and_the_sound_is_kept(tmp_path: Path) -> None:
    heard = np.concatenate([np.zeros((1, 2 * RATE_HZ), np.float32), noise(2), 1e-3 * noise(1)])
    first = recorded(tmp_path / "one", ChannelSound(heard, RATE_HZ), None)
    for file in (first, write_recording(open_recording(first), tmp_path / "two")):
        array = tmp_path / "array.json"
        array.write_text('{"positions_m": [[0, 0.1, 0], [0, -0.1, 0]], "channels": [2, 3]}')
        track = open_recording(file, microphones=array).audio
        assert track is not None and np.allclose(read_channels(track, 0.0, 2.0).samples, noise(2), atol=1e-4)
        assert np.allclose(track.read().samples, noise(2)[0], atol=1e-4)
    array.write_text('{"positions_m": [[0, 0, 0], [0, 0.1, 0], [0, -0.1, 0], [0, 0.2, 0]]}')
    track = open_recording(first, microphones=array).audio
    assert track is not None and np.allclose(track.read().samples, noise(2)[0], atol=1e-4)
    for channels in ("", ', "channels": [2, 2]', ', "channels": [2, 9]', ', "channels": [0, 1]'):
        array.write_text('{"positions_m": [[0, 0.1, 0], [0, -0.1, 0]]' + channels + "}")
        with pytest.raises(RecordingError, match="counted from 1"):
            open_recording(first, microphones=array)


def describe(folder: Path, **microphones: object) -> None:
    path = folder / "recording.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "microphones": microphones}))


@pytest.mark.parametrize(
    ("positions", "said"),
    [
        ([[0, 0, 0], [0, 0, 0]], "0 m apart"),
        ([[0, 0, 0], [0, 10, 0]], "10 m apart"),
        ([[0, 0.1, 0]], "2 channel"),
        ([[0, 0.1], [0, 0]], "three numbers"),
        ([[0, 0.1, 1e999], [0, 0, 0]], "recording.json"),
    ],
)
def test_geometry_that_cannot_be_is_refused(tmp_path: Path, positions: list[list[float]], said: str) -> None:
    folder = recorded(tmp_path / "rec", ChannelSound(noise(2), RATE_HZ), microphones_named("stereo"))
    describe(folder, positions_m=positions)
    with pytest.raises(RecordingError, match=said):
        open_recording(folder)


@pytest.mark.parametrize(("seconds", "rate_hz", "said"), [(1.0, RATE_HZ, "samples"), (2.0, 8000, "samples a second")])
def test_files_of_channels_must_agree(tmp_path: Path, seconds: float, rate_hz: int, said: str) -> None:
    folder = recorded(tmp_path / "rec", None, None)
    soundfile.write(folder / "0.wav", noise(1)[0], RATE_HZ)
    soundfile.write(folder / "1.wav", noise(1)[0, : round(seconds * rate_hz)], rate_hz)
    describe(folder, positions_m=[[0, 0.1, 0], [0, -0.1, 0]], files=["0.wav", "1.wav"])
    with pytest.raises(AvlmapsError, match=rf"disagree.*{said}"):
        open_recording(folder)


@pytest.mark.parametrize("name", ["../other.wav", "/etc/passwd", ""])
def test_files_of_channels_lie_beside_the_description(tmp_path: Path, name: str) -> None:
    folder = recorded(tmp_path / "rec", None, None)
    describe(folder, positions_m=[[0, 0.1, 0]], files=[name])
    with pytest.raises(RecordingError, match="beside"):
        open_recording(folder)


def faults(folder: Path, samples: np.ndarray) -> list[str]:
    soundfile.write(folder / "track.wav", samples.T, RATE_HZ, subtype="FLOAT")
    track = AudioTrack.open(folder / "track.wav")
    track = with_microphones(track, Microphones(microphones_named("square4").position_m[: len(samples)]))
    return [sentence for kind in level_faults(track) for sentence in kind]


def test_faults_of_channels_are_named_and_a_sound_array_has_none(tmp_path: Path) -> None:
    good = noise(4)
    assert not faults(tmp_path, good)
    dead = good.copy()
    dead[2] = 0.0
    assert [said for said in faults(tmp_path, dead) if "Channel 3" in said and "not connected" in said]
    clipped = good.copy()
    clipped[1] = np.clip(clipped[1] * 30.0, -1.0, 1.0)
    assert [said for said in faults(tmp_path, clipped) if "Channel 2" in said and "clipped" in said]


def test_an_array_that_recorded_nothing_is_said_once(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "track.wav", np.zeros((RATE_HZ, 4)), RATE_HZ)
    track = with_microphones(AudioTrack.open(tmp_path / "track.wav"), microphones_named("square4"))
    (said,), _ = level_faults(track, "the sound")
    assert said.startswith("the sound is silent throughout: every sample is 0. Check the microphones")


@given(st.integers(1, 60_000), st.sampled_from([8_000, 11_025, 22_050, 44_100]), st.floats(0.0, 2e9))
def test_tracks_of_any_length_and_rate_are_looked_at_for_faults(count: int, rate_hz: int, start_s: float) -> None:
    with TemporaryDirectory() as folder:
        growing = GrowingTrack(Path(folder) / "track.f32")
        one = np.random.default_rng(count).normal(0.0, 0.1, count).astype(np.float32)
        growing.add(ChannelSound(np.stack([one, one]), rate_hz), start_s)
        assert growing.track is not None
        track = replace(growing.track, microphones=microphones_named("stereo"))
        (said,), _ = level_faults(track, "the sound")
    assert said.startswith("Channel 2 of the sound holds the same sound as channel 1")


def test_an_unknown_array_is_refused_with_what_to_write(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="square4"):
        microphones_named("ring6")
    path = tmp_path / "array.json"
    path.write_text('{"positions_m": [[0, 0.05, 0.2], [0, -0.05, 0.2]]}')
    assert microphones_named(str(path)).position_m.shape == (2, 3)
    path.write_text("{}")
    with pytest.raises(RecordingError, match="positions_m"):
        microphones_named(str(path))


def unchecked(position_m: object, delay_s: object = None) -> Microphones:
    """Make an array as a program does, whose types nobody checks."""
    made = object.__new__(Microphones)
    for name, value in (
        ("position_m", position_m),
        ("camera_from_robot", np.eye(4)),
        ("delay_s", delay_s),
        ("channels", ()),
    ):
        object.__setattr__(made, name, value)
    made.__post_init__()
    return made


def test_an_array_is_given_as_a_list_or_refused_in_a_sentence() -> None:
    listed = unchecked([[0, 0.05, 0.2], [0, -0.05, 0.2]], [0, 0.001])
    assert listed.position_m.dtype == np.float64 and listed.take([1]).delay_s == [0.001]
    for one in ([[0, 0]], 5, [[0, 0, 0], [0, 0]], "stereo", None, [[True, False, True]]):
        with pytest.raises(RecordingError, match=r"positions have shape|position_m of microphones must be an array"):
            unchecked(one)
