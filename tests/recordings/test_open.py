"""Opening by content: every format is found, and what is none gets a sentence that helps."""

import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
from recording_scenes import save_rgb, shot, write_folder, write_seven_scenes

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.recordings.open import FORMATS, find_format, open_recording


def _touch(path: Path, *names: str) -> Path:
    for name in names:
        file = path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.mkdir() if name.endswith("/") else file.touch()
    return path


@pytest.mark.parametrize(
    ("names", "format"),
    [
        (("recording.json",), "folder"),
        (("UNFINISHED",), "folder"),
        (("frame-000000.pose.txt",), "7scenes"),
        (("frame-000000.color.png", "camera-intrinsics.txt"), "7scenes"),
        (("rgb.txt", "depth.txt", "groundtruth.txt", "rgb/", "depth/"), "tum"),
        (("traj.txt", "results/"), "replica"),
        (("color/", "depth/", "pose/", "intrinsic/"), "scannet"),
        (("poses.txt", "rgb/", "depth/"), "avlmaps"),
        (("metadata.yaml", "walk_0.db3"), "rosbag"),
        (("metadata.yaml", "walk_0.mcap"), "rosbag"),
    ],
)
def test_a_folder_is_known_by_what_it_holds(tmp_path: Path, names: tuple[str, ...], format: str):
    assert find_format(_touch(tmp_path / "x", *names)).name == format


@pytest.mark.parametrize("name", ["walk.bag", "walk.mcap", "walk.db3", "WALK.BAG"])
def test_a_bag_is_known_by_its_name(tmp_path: Path, name: str):
    assert find_format(_touch(tmp_path, name) / name).name == "rosbag"


def test_a_named_format_is_taken_at_its_word(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    assert open_recording(path, format="folder").format == "folder"
    with pytest.raises(RecordingError, match=r"no frame with all of colour, depth, pose"):
        open_recording(path, format="7scenes")


def test_another_sound_track_takes_the_place_of_the_recordings_own(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    soundfile.write(path / "audio.wav", np.zeros(4000), 8000)
    soundfile.write(tmp_path / "other.flac", np.zeros(16000), 8000)
    own, other = open_recording(path), open_recording(path, audio=tmp_path / "other.flac")
    assert own.audio is not None and own.audio.duration_s == pytest.approx(0.5)
    assert other.audio is not None and other.audio.duration_s == pytest.approx(2.0)
    assert own.fingerprint != other.fingerprint
    with pytest.raises(AudioError):
        open_recording(path, audio=tmp_path / "gone.wav")


def test_nothing_there_is_told(tmp_path: Path):
    with pytest.raises(RecordingError, match=r"There is nothing at .*gone; give the folder or file of a recording."):
        open_recording(tmp_path / "gone")


def test_an_unknown_format_lists_the_known_ones(tmp_path: Path):
    names = ", ".join(known.name for known in FORMATS)
    sentence = f"There is no format 'kitti'; known: auto, {names}."
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(tmp_path, format="kitti")


def test_a_folder_of_nothing_known_is_told_what_each_format_looks_for(tmp_path: Path):
    save_rgb(tmp_path / "pictures/holiday.jpg", shot(0).rgb)
    with pytest.raises(RecordingError, match="pictures is of no known format; looked for: ") as caught:
        open_recording(tmp_path / "pictures")
    for known in FORMATS:
        assert f"{known.name}: {known.looks_for}" in str(caught.value)


def test_a_folder_of_recordings_names_them(tmp_path: Path):
    for name in ("seq-01", "seq-02"):
        write_seven_scenes(tmp_path / "kitchen" / name)
    sentence = "kitchen holds recordings but is none itself; open one of them: seq-01, seq-02."
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(tmp_path / "kitchen")


def test_a_bare_video_is_told_what_it_lacks(tmp_path: Path):
    (tmp_path / "walk.MP4").write_bytes(b"")
    sentence = "walk.MP4 is a video, which has neither depth nor poses; make a folder of it, as rgb.mp4 beside"
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(tmp_path / "walk.MP4")


def test_a_map_is_told_from_a_recording(tmp_path: Path):
    (tmp_path / "map.json").write_text("{}")
    with pytest.raises(
        RecordingError, match=r"is a map, not a recording; ask it with `avlmaps query`, or give its rec"
    ):
        open_recording(tmp_path)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (("mav0/imu0/data.csv",), "or measurements of an IMU alone: there is no depth"),
        (("imu0/data.csv", "cam0/data.csv"), "is of EuRoC's layout"),
        (
            ("frame-000000.color.jpg", "frame-000000.depth.pgm", "_info.txt"),
            "or unpacked by ScanNet's C++ reader: its .depth.pgm is not read",
        ),
        (("images/0.jpg", "sparse/0/cameras.bin"), "is a reconstruction of COLMAP"),
    ],
)
def test_what_is_recognised_and_not_read_says_why(tmp_path: Path, names: tuple[str, ...], sentence: str):
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(_touch(tmp_path / "x", *names))


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("x.sens", "is ScanNet's packed recording; unpack it with ScanNet's SensReader"),
        ("x.svo2", "is a packed recording that its own software alone reads"),
        ("x.db", "is no database of RTAB-Map (it is no SQLite file)"),
        ("x.ply", "is a finished model, without the pictures that a map is built from"),
    ],
)
def test_a_file_that_is_recognised_and_not_read_says_why(tmp_path: Path, name: str, sentence: str):
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(tmp_path / name)
