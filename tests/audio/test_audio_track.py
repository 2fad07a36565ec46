import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
from audio_fakes import RATE_HZ, quiet, tone, track_of
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AudioError
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac

STEP = 1.0 / 32768.0  # of 16-bit sound


def write_video(path: Path, samples: np.ndarray, rate_hz: int, codec: str, with_picture: bool) -> None:
    import av

    with av.open(str(path), "w") as container:
        audio = container.add_stream(codec, rate=rate_hz, layout="stereo")
        if with_picture:
            video = container.add_stream("mpeg4", rate=10)
            video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
            for _ in range(round(len(samples) / rate_hz * 10)):
                picture = av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24")
                container.mux(video.encode(picture))
            container.mux(video.encode())
        for at in range(0, len(samples), 1024):
            both = np.stack([samples[at : at + 1024]] * 2)
            frame = av.AudioFrame.from_ndarray(both, format="fltp", layout="stereo")
            frame.rate, frame.pts = rate_hz, at
            container.mux(audio.encode(frame))
        container.mux(audio.encode())


def whole(track: AudioTrack, seconds: float = 1.0) -> np.ndarray:
    return np.concatenate([block.samples for block in track.blocks(seconds)])


@pytest.mark.parametrize("suffix", ["wav", "flac", "ogg"])
def test_a_plain_file_is_opened_with_its_rate_and_length(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    soundfile.write(path, tone(1.5), RATE_HZ)
    track = AudioTrack.open(path, start_s=2.0)
    assert (track.rate_hz, track.duration_s, track.end_s) == (RATE_HZ, 1.5, 3.5)
    assert np.abs(track.read(2.0).samples - tone(1.5)).max() < (0.05 if suffix == "ogg" else STEP)


@pytest.mark.parametrize("channels", [1, 2, 6])
def test_channels_become_one_by_their_mean(tmp_path: Path, channels: int) -> None:
    rng = np.random.default_rng(0)
    samples = rng.uniform(-0.9, 0.9, (4000, channels)).astype(np.float32)
    soundfile.write(tmp_path / "a.wav", samples, RATE_HZ, subtype="FLOAT")
    track = AudioTrack.open(tmp_path / "a.wav")
    np.testing.assert_allclose(track.read().samples, samples.mean(axis=1), atol=1e-6)
    np.testing.assert_allclose(whole(track, 0.03), samples.mean(axis=1), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "codec", "picture"),
    [("a.mp4", "aac", True), ("a.mkv", "aac", True), ("a.m4a", "aac", False), ("a.mp3", "libmp3lame", False)],
)
def test_the_sound_of_a_video_lies_where_it_was_recorded(tmp_path: Path, name: str, codec: str, picture: bool) -> None:
    samples = np.concatenate([quiet(1.0, 44_100), tone(2.0, rate_hz=44_100), quiet(1.0, 44_100)])
    write_video(tmp_path / name, samples, 44_100, codec, picture)
    track = AudioTrack.open(tmp_path / name)
    heard = whole(track)
    assert len(heard) == round(track.duration_s * track.rate_hz)
    assert track.duration_s == pytest.approx(4.0, abs=0.05)
    loud = np.flatnonzero(np.abs(heard) > 0.15) / track.rate_hz
    assert loud[0] == pytest.approx(1.0, abs=0.005)
    assert loud[-1] == pytest.approx(3.0, abs=0.005)
    piece = track.read(2.5, 3.5).samples
    assert len(piece) == 44_100
    assert np.flatnonzero(np.abs(piece) > 0.15)[-1] / track.rate_hz == pytest.approx(0.5, abs=0.005)


@given(onset=st.floats(-1.0, 3.0), length=st.floats(0.0, 3.0), start=st.floats(-1.0, 1.0))
def test_a_piece_is_the_whole_cut_out_with_silence_around(
    tmp_path_factory: pytest.TempPathFactory, onset: float, length: float, start: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "whole.flac"
    samples = np.random.default_rng(0).uniform(-0.5, 0.5, 2 * RATE_HZ).astype(np.float32)
    if not path.exists():
        write_flac(path, Sound(samples, RATE_HZ))
    track = AudioTrack.open(path, start)
    piece = track.read(onset, onset + length).samples
    begin, end = (round((at - start) * RATE_HZ) for at in (onset, onset + length))
    around = np.pad(samples, 5 * RATE_HZ)[begin + 5 * RATE_HZ : end + 5 * RATE_HZ]
    np.testing.assert_allclose(piece, around, atol=STEP)


@pytest.mark.parametrize("seconds", [0.013, 0.5, 60.0])
def test_blocks_joined_are_the_whole(tmp_path: Path, seconds: float) -> None:
    track = track_of(tmp_path / "a.flac", tone(1.7))
    blocks = list(track.blocks(seconds))
    assert {len(block.samples) for block in blocks[:-1]} <= {round(seconds * RATE_HZ)}
    np.testing.assert_array_equal(np.concatenate([b.samples for b in blocks]), track.read().samples)


def test_a_flac_written_in_blocks_is_the_flac_written_at_once(tmp_path: Path) -> None:
    samples = tone(3.3)
    write_flac(tmp_path / "a.flac", Sound(samples, RATE_HZ))
    write_flac(tmp_path / "b.flac", (Sound(piece, RATE_HZ) for piece in np.split(samples, [5, 20_000])))
    np.testing.assert_array_equal(*(AudioTrack.open(tmp_path / name).read().samples for name in ("a.flac", "b.flac")))


def test_loud_samples_are_clipped_not_wrapped(tmp_path: Path) -> None:
    track = track_of(tmp_path / "a.flac", np.array([2.0, -2.0, 0.5], np.float32))
    np.testing.assert_allclose(track.read().samples, [1.0, -1.0, 0.5], atol=2 * STEP)


def refusal(path: Path) -> str:
    with pytest.raises(AudioError) as caught:
        whole(AudioTrack.open(path))
    return str(caught.value).replace(str(path), "FILE")


def test_bad_files_are_told_in_a_sentence(tmp_path: Path) -> None:
    missing, folder, empty, text, silent = (tmp_path / name for name in ("a.wav", "b.wav", "c.wav", "d.ogg", "e.wav"))
    folder.mkdir()
    empty.touch()
    text.write_text("this is not a sound")
    soundfile.write(silent, np.zeros(0, np.float32), RATE_HZ)
    formats = "give a wav, flac, ogg, mp3, m4a, mp4 or mkv file."
    assert refusal(missing) == f"FILE does not exist; {formats}"
    assert refusal(folder) == f"FILE is a folder, not a sound file; {formats}"
    assert refusal(empty) == "FILE is empty (0 bytes); record or copy it again."
    assert refusal(text).startswith("FILE cannot be read as sound (")
    assert refusal(silent) == "FILE has an audio stream without a single sample; record or convert it again."


def test_a_video_without_sound_is_told(tmp_path: Path) -> None:
    import av

    with av.open(str(tmp_path / "a.mp4"), "w") as container:
        video = container.add_stream("mpeg4", rate=10)
        video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
        container.mux(video.encode(av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24")))
        container.mux(video.encode())
    assert refusal(tmp_path / "a.mp4") == "FILE has no audio stream; give a file that has one."


def test_a_video_that_was_cut_off_is_told(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mp4", tone(2.0, rate_hz=44_100), 44_100, "aac", True)
    content = (tmp_path / "a.mp4").read_bytes()
    (tmp_path / "a.mp4").write_bytes(content[: len(content) // 2])
    assert refusal(tmp_path / "a.mp4").startswith("FILE cannot be read as sound (")


@pytest.mark.parametrize("suffix", ["wav", "flac"])
def test_a_truncated_file_is_told(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    soundfile.write(path, np.random.default_rng(0).uniform(-0.5, 0.5, 4 * RATE_HZ), RATE_HZ)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert re.match("FILE is truncated: it is shorter than|FILE cannot be read as sound", refusal(path))


def test_samples_that_are_no_numbers_are_told_with_their_time(tmp_path: Path) -> None:
    samples = tone(1.0)
    samples[RATE_HZ // 2] = np.nan
    soundfile.write(tmp_path / "a.wav", samples, RATE_HZ, subtype="FLOAT")
    sentence = "FILE holds samples that are not finite, the first at 0.500 s; convert it again."
    assert refusal(tmp_path / "a.wav") == sentence


def test_samples_of_another_scale_are_told(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "a.wav", tone(0.1, level=30_000.0), RATE_HZ, subtype="FLOAT")
    assert "floating-point sound must lie in [-1, 1]." in refusal(tmp_path / "a.wav")


def test_a_wav_from_a_pipe_that_never_knew_its_length_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.wav"
    soundfile.write(path, tone(1.0), RATE_HZ)
    content = bytearray(path.read_bytes())
    at = content.index(b"data") + 4
    content[at : at + 4] = b"\xff\xff\xff\xff"
    path.write_bytes(content)
    assert AudioTrack.open(path).duration_s == pytest.approx(1.0)
