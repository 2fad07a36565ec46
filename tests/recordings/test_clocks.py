"""Sound and pictures on one clock: simulated time, missing messages, tracks elsewhere, videos that start late."""

import json
import struct
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import av
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from recording_scenes import CAMERA, save_depth, shot, write_folder
from test_rosbag import HEIGHT, RATE_HZ, START_S, WIDTH, BagMaker, world_from_body

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.recordings.audio import Sound, write_flac
from avlmaps.recordings.faults import noted
from avlmaps.recordings.formats.ros_sound import GAP_S, Pcm, PictureClock, SoundTopic, extract_audio, silences
from avlmaps.recordings.formats.rosbag import open_rosbag
from avlmaps.recordings.images import DisplayTurn, exif_turn
from avlmaps.recordings.open import open_recording

CHUNK_S = 0.1


def clock(apart_s: float = 0.0, start_s: float = 100.0) -> PictureClock:
    received_s = np.arange(start_s, start_s + 10.0, 0.1)
    return PictureClock.of(received_s * 1e9, received_s + apart_s, start_s + apart_s)


def beep_at(times_s: np.ndarray, content: np.ndarray, header: bool = False) -> SoundTopic:
    """Return messages of plain samples, a chunk each."""
    chunks = np.split(content.astype("<i2"), len(times_s))

    def messages() -> Iterator[tuple[int, Any]]:
        for time_s, chunk in zip(times_s.tolist(), chunks, strict=True):
            stamp = SimpleNamespace(sec=int(time_s), nanosec=int(time_s % 1 * 1e9))
            message = SimpleNamespace(data=chunk.view(np.uint8))
            if header:
                message = SimpleNamespace(audio=message, header=SimpleNamespace(stamp=stamp))
            yield round(time_s * 1e9), message

    return SoundTopic("/audio", messages, clock())


def loudest_s(samples: np.ndarray, start_s: float) -> float:
    return start_s + float(np.argmax(np.abs(samples))) / RATE_HZ


def tone(seconds: float, click_s: float) -> np.ndarray:
    samples = np.zeros(round(seconds * RATE_HZ), np.int16)
    samples[round(click_s * RATE_HZ)] = 30_000
    return samples


def test_missing_messages_leave_their_time_silent(tmp_path: Path) -> None:
    content = tone(3.0, 2.5)
    kept = np.r_[0:10, 20:30]  # a second was never published
    chunks = content.reshape(30, -1)[kept].ravel()
    with noted() as notices:
        track = extract_audio(beep_at(100.0 + kept * CHUNK_S, chunks), None, tmp_path, Pcm(RATE_HZ, 1))
    assert track is not None and track.duration_s == pytest.approx(3.0, abs=0.01)
    assert loudest_s(track.read().samples, track.start_s) == pytest.approx(2.5, abs=0.01)
    assert "1 gap(s) in the sound of /audio, 1 s together (the first of 1 s at 1.00 s)" in notices[0]


def test_messages_that_arrive_late_and_catch_up_are_no_gap(tmp_path: Path) -> None:
    times_s = 100.0 + np.arange(30) * CHUNK_S
    times_s[10:18] = times_s[18] - 1e-3 * np.arange(8, 0, -1)  # a burst after a stall
    with noted() as notices:
        track = extract_audio(beep_at(times_s, tone(3.0, 2.5)), None, tmp_path, Pcm(RATE_HZ, 1))
    assert track is not None and track.duration_s == pytest.approx(3.0) and notices == []
    assert loudest_s(track.read().samples, track.start_s) == pytest.approx(2.5, abs=0.01)


@given(st.lists(st.floats(0.02, 0.3), min_size=2, max_size=40), st.data(), st.floats(-5.0, 5.0))
def test_silences_put_every_message_at_its_time(lengths: list[float], data: st.DataObject, start_s: float) -> None:
    """Whatever is dropped and however late the others come, a message that came in time is placed when it came."""
    lengths_s = np.array(lengths)
    true_s = start_s + np.concatenate([[0.0], np.cumsum(lengths_s)[:-1]])
    kept = sorted(data.draw(st.sets(st.integers(0, len(lengths) - 1), min_size=1)))
    late_s = np.array([data.draw(st.floats(0.0, 2.0)) if i != kept[-1] else 0.0 for i in kept])
    first_s, silence_s = silences(true_s[kept] + late_s, lengths_s[kept])
    placed_s = first_s + np.cumsum(silence_s) + np.concatenate([[0.0], np.cumsum(lengths_s[kept])[:-1]])
    in_time = np.flatnonzero(late_s == 0.0)
    assert (silence_s >= 0.0).all()
    assert (np.abs(placed_s - true_s[kept])[in_time] <= GAP_S + 1e-9).all()


def test_sound_without_stamps_is_placed_by_the_pictures_clock() -> None:
    assert clock(apart_s=-90.0).of_received(np.array([103.0])) == pytest.approx([3.0])


def test_stamps_of_sound_are_used_where_they_lie_among_the_pictures(tmp_path: Path) -> None:
    times_s = 102.0 + np.arange(10) * CHUNK_S
    topic = beep_at(times_s, tone(1.0, 0.5), header=True)
    assert topic.times_s()[0] == pytest.approx(2.0)
    elsewhere = SoundTopic("/audio", topic.messages, clock(apart_s=-90.0))
    with noted() as notices:
        assert elsewhere.times_s()[0] == pytest.approx(2.0), "by when they were received: stamps of another clock"
    assert "are -90 s from when the bag received them" in notices[0]


def test_a_full_disk_for_temporary_files_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import soundfile

    def full(*_: object) -> None:
        raise soundfile.LibsndfileError(2)

    monkeypatch.setattr(soundfile.SoundFile, "write", full)
    with pytest.raises(AudioError, match=r"sound of /audio cannot be written to .*TMPDIR.*audio=none"):
        extract_audio(beep_at(100.0 + np.arange(10) * CHUNK_S, tone(1.0, 0.5)), None, tmp_path, Pcm(RATE_HZ, 1))


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_a_bag_in_simulated_time_has_its_sound_where_it_was_heard(tmp_path: Path, kind: str) -> None:
    maker, wall_s = BagMaker(kind, tmp_path), 1.7e9

    def later(topic: str, message: Any, stamp_s: float) -> None:
        write(topic, message, stamp_s - START_S + wall_s)

    write, maker.write = maker.write, later  # pyright: ignore[reportAttributeAccessIssue]
    with maker.writer:
        maker.tf("/tf_static", START_S, "base_link", "camera_optical", np.eye(4))
        for i in range(21):
            stamp_s = START_S + i * 0.1
            maker.tf("/tf", stamp_s, "map", "base_link", world_from_body(stamp_s))
            maker.camera_info("/camera/color/camera_info", stamp_s)
            maker.image(
                "/camera/color/image_raw", stamp_s, np.zeros((HEIGHT, WIDTH, 3), np.uint8), "rgb8", "camera_optical"
            )
            maker.image(
                "/camera/depth/image_raw", stamp_s, np.full((HEIGHT, WIDTH), 900, np.uint16), "16UC1", "camera_optical"
            )
        content = tone(1.0, 0.5).view(np.uint8).reshape(10, -1)
        for piece in range(10):
            part = maker.t("audio_common_msgs/msg/AudioData", content[piece])
            maker.write("/audio/audio", part, START_S + 1.0 + piece * 0.1)
    recording = open_rosbag(maker.path, {"audio_pcm": f"{RATE_HZ},1"})
    track = recording.audio
    assert track is not None and track.start_s == pytest.approx(1.0, abs=0.02)
    assert any("placed as they are" in notice for notice in recording.notices)


def test_a_track_that_lies_elsewhere_is_refused(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    write_flac(path / "audio.flac", Sound(np.zeros(8000, np.float32), 8000))
    described = json.loads((path / "recording.json").read_text())
    for start_s in (-30.0, 30.0, 3600.0):
        (path / "recording.json").write_text(json.dumps({**described, "audio_start_s": start_s}))
        with pytest.raises(RecordingError, match=r"sound track audio.flac of .* so that no sound has a place"):
            open_recording(path)
    (path / "recording.json").write_text(json.dumps({**described, "audio_start_s": -0.85}))
    assert any("the rest has no sound" in notice for notice in open_recording(path).notices)
    (path / "recording.json").write_text(json.dumps({**described, "audio_start_s": -0.1}))
    assert open_recording(path).notices == ()


def write_video(path: Path, frames: list[np.ndarray], delay_s: float = 0.0, sound_delay_s: float | None = None) -> None:
    ms = Fraction(1, 1000)
    with av.open(str(path), "w") as container:
        video = container.add_stream("libx264", rate=10, options={"crf": "10"})
        video.height, video.width, video.pix_fmt, video.time_base = *frames[0].shape[:2], "yuv420p", ms
        audio = None if sound_delay_s is None else container.add_stream("aac", rate=8000, layout="mono")
        for index, picture in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = round((index * 0.1 + delay_s) * 1000), ms
            container.mux(video.encode(frame))
        container.mux(video.encode())
        if audio is not None:
            for at in range(0, 8000, 1000):
                sound = av.AudioFrame.from_ndarray(np.zeros((1, 1000), np.float32), format="fltp", layout="mono")
                sound.sample_rate, sound.pts = 8000, at + round(sound_delay_s * 8000)
                sound.time_base = Fraction(1, 8000)
                container.mux(audio.encode(sound))
            container.mux(audio.encode())


def video_walk(path: Path, **delays: float) -> Path:
    write_folder(path)
    for file in (path / "rgb").iterdir():
        file.unlink()
    (path / "rgb").rmdir()
    write_video(path / "rgb.mp4", [shot(i).rgb for i in range(5)], **delays)
    return path


@pytest.mark.parametrize(("delay_s", "sound_delay_s", "start_s"), [(0.0, 0.0, 0.0), (0.3, 0.0, -0.3), (0.0, 0.2, 0.0)])
def test_the_sound_of_a_video_keeps_its_distance_from_the_pictures(
    tmp_path: Path, delay_s: float, sound_delay_s: float, start_s: float
) -> None:
    recording = open_recording(video_walk(tmp_path / "walk", delay_s=delay_s, sound_delay_s=sound_delay_s))
    assert recording.audio is not None and recording.stamps_s[0] == 0.0
    assert recording.audio.start_s == pytest.approx(start_s, abs=0.15), "AAC begins with a block of silence"


def set_display_matrix(path: Path, a: int, b: int, c: int, d: int) -> None:
    content = bytearray(path.read_bytes())
    at = content.find(b"tkhd") + 44
    one, (width, height) = 1 << 16, (CAMERA.width, CAMERA.height)
    shift = (width if a < 0 else height if c < 0 else 0) << 16, (height if d < 0 else width if b < 0 else 0) << 16
    content[at : at + 36] = struct.pack(">9i", a * one, b * one, 0, c * one, d * one, 0, *shift, 1 << 30)
    path.write_bytes(content)


def corner(picture: np.ndarray) -> tuple[bool, bool]:
    """Return whether the bright corner of a picture is below and to the right of its middle."""
    rows, columns = (picture.mean(axis=2).sum(axis=axis) for axis in (1, 0))
    return bool(np.argmax(rows) > len(rows) / 2), bool(np.argmax(columns) > len(columns) / 2)


@pytest.mark.parametrize(
    ("matrix", "below", "right"),
    [((1, 0, 0, 1), False, False), ((-1, 0, 0, -1), True, True), ((-1, 0, 0, 1), False, True)],
)
def test_a_display_matrix_is_followed_as_players_do(
    tmp_path: Path, matrix: tuple[int, int, int, int], below: bool, right: bool
) -> None:
    path = video_walk(tmp_path / "walk")
    marked = np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8)
    marked[:12, :16] = 255
    write_video(path / "rgb.mp4", [marked] * 5)
    set_display_matrix(path / "rgb.mp4", *matrix)
    recording = open_recording(path)
    assert corner(recording.frame(3).rgb) == (below, right)
    assert any("is to be shown" in notice for notice in recording.notices) == (matrix != (1, 0, 0, 1))


def test_a_quarter_turn_is_followed_where_the_intrinsics_are_of_the_turned_size(tmp_path: Path) -> None:
    path = video_walk(tmp_path / "walk")
    set_display_matrix(path / "rgb.mp4", 0, 1, -1, 0)
    stored = open_recording(path)
    assert stored.frame(0).rgb.shape == (48, 64, 3)
    assert "the intrinsics are of the frames as stored" in stored.notices[0]
    described = json.loads((path / "recording.json").read_text())
    described["intrinsics"]["rgb"] |= {"width": 48, "height": 64, "cx": 24.0, "cy": 32.0}
    (path / "recording.json").write_text(json.dumps(described))
    for index in range(5):
        save_depth(path / f"depth/{index:06d}.png", np.full((64, 48), 900))
    turned = open_recording(path)
    assert np.abs(turned.frame(0).rgb.astype(int) - np.rot90(shot(0).rgb, -1)).mean() < 12
    assert "turned by 90° clockwise" in turned.notices[0]


ORIENTATIONS = {
    1: lambda p: p, 2: np.fliplr, 3: lambda p: np.rot90(p, 2), 4: np.flipud, 5: lambda p: np.swapaxes(p, 0, 1),
    6: lambda p: np.rot90(p, -1), 7: lambda p: np.rot90(np.swapaxes(p, 0, 1), 2), 8: lambda p: np.rot90(p),
}  # fmt: skip


@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_eight_orientations_of_exif(tmp_path: Path, orientation: int) -> None:
    picture = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(picture).save(tmp_path / "a.jpg", exif=exif)
    turn = exif_turn((tmp_path / "a.jpg").read_bytes())
    assert np.array_equal(turn.applied(picture), ORIENTATIONS[orientation](picture))
    assert turn.size(8, 6) == turn.applied(picture).shape[1::-1]
    assert (turn.words == "mirrored") == (orientation in (2, 4, 5, 7))
    assert turn == DisplayTurn.of_exif(orientation)


@pytest.mark.parametrize("orientation", [3, 6])
def test_pictures_with_an_orientation_are_read_as_stored_and_that_is_said(tmp_path: Path, orientation: int) -> None:
    path = write_folder(tmp_path / "walk")
    exif = Image.Exif()
    exif[0x0112] = orientation
    for file in list((path / "rgb").iterdir()):
        Image.fromarray(cv2.cvtColor(cv2.imread(str(file)), cv2.COLOR_BGR2RGB)).save(
            file.with_suffix(".jpg"), exif=exif
        )
        file.unlink()
    recording = open_recording(path)
    assert recording.frame(0).rgb.shape == (48, 64, 3)
    assert np.abs(recording.frame(0).rgb.astype(int) - shot(0).rgb).mean() < 12
    assert "(its EXIF), as 5 of 5 pictures looked at; they are read as they are stored" in recording.notices[0]


def test_a_portrait_of_exif_is_turned_where_only_that_fits(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    described = json.loads((path / "recording.json").read_text())
    described["intrinsics"]["rgb"] |= {"width": 48, "height": 64, "cx": 24.0, "cy": 32.0}
    (path / "recording.json").write_text(json.dumps(described))
    exif = Image.Exif()
    exif[0x0112] = 6
    for index in range(5):
        (path / f"rgb/{index:06d}.png").unlink()
        Image.fromarray(shot(index).rgb).save(path / f"rgb/{index:06d}.jpg", exif=exif)
        save_depth(path / f"depth/{index:06d}.png", np.full((64, 48), 900))
    rgb = open_recording(path).frame(2).rgb
    assert rgb.shape == (64, 48, 3)
    assert np.abs(rgb.astype(int) - np.rot90(shot(2).rgb, -1)).mean() < 12
