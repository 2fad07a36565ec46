"""Other versions, other cameras and other files than a reader knows: each is read rightly or refused by a sentence."""

import json
import re
import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avlmaps.cli.info import describe_path
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.conformance import Truth, check, example_truth
from avlmaps.recordings.open import open_recording
from helpers.bag_writers import BAGS, split_ros1
from helpers.format_writers import HALF_TURN, WRITTEN, write_nerfstudio


def _edit(name: str, change: Callable[[dict[str, Any]], Any]) -> Callable[[Path], Any]:
    def edited(path: Path) -> None:
        content = json.loads((path / name).read_text())
        change(content)
        (path / name).write_text(json.dumps(content))

    return edited


def _replace(name: str, old: str, new: str) -> Callable[[Path], Any]:
    return lambda path: (path / name).write_text((path / name).read_text().replace(old, new)) and None


def _text(pattern: str, content: str | None) -> Callable[[Path], Any]:
    """Return what writes the first file of a pattern anew, or removes it."""

    def run(path: Path) -> None:
        file = sorted(path.glob(pattern))[0]
        file.unlink()
        if content is not None:
            file.write_text(content)

    return run


def _sql(*words: Any) -> Callable[[Path], Any]:
    def run(path: Path) -> None:
        with sqlite3.connect(path) as database:
            database.execute(*words)
        database.close()

    return run


def _calibration(change: Callable[[bytes], bytes]) -> Callable[[Path], Any]:
    def run(path: Path) -> None:
        with sqlite3.connect(path) as database:
            (blob,) = database.execute("SELECT calibration FROM Data").fetchone()
            database.execute("UPDATE Data SET calibration = ?", (change(blob),))
        database.close()

    return run


@pytest.mark.parametrize(
    ("format", "fault", "sentence"),
    [
        ("nerfstudio", _edit("transforms.json", lambda d: [f.pop("depth_file_path") for f in d["frames"]]),
         "names no depth (depth_file_path) for any of its 6 frames"),
        ("nerfstudio", _edit("transforms.json", lambda d: d.update(camera_model="OPENCV_FISHEYE")),
         "is of the camera model 'OPENCV_FISHEYE'; pinholes are read"),
        ("nerfstudio", _edit("transforms.json", lambda d: d.update(depth_scale=5000)), "has the key 'depth_scale'"),
        ("nerfstudio", _edit("transforms.json", lambda d: d.pop("fl_x")), "has no focal length (fl_x, or"),
        ("nerfstudio", _edit("transforms.json", lambda d: d.update(w=48, h=64)), "of another shape: were"),
        ("nerfstudio", _edit("transforms.json", lambda d: d["frames"][0].update(file_path="../x.png")),
         "which lies outside of its folder"),
        ("stray-scanner", _replace("odometry.csv", "qx, qy, qz, qw", "qw, qx, qy, qz"), "where the header"),
        ("stray-scanner", lambda path: np.savetxt(path / "camera_matrix.csv", np.diag([900.0, 900, 1]), delimiter=","),
         "outside of the video's 64x48"),
        ("redwood", _replace("trajectory.log", "0 0 1\n", ""), "no log of three numbers and a matrix each (line 1)"),
        ("redwood", _edit("intrinsic.json", lambda d: d.update(depth_unit=0.1)), "has the key 'depth_unit'"),
        ("icl-nuim", lambda path: (path / "livingRoom0.gt.freiburg").unlink(), "has no poses"),
        ("scannet", lambda path: np.savetxt(path / "intrinsic/intrinsic_color.txt", np.diag([900.0, 900, 1, 1])),
         "were they resized or cropped? Give the intrinsics of these pictures"),
        ("7scenes", _text("*.pose.txt", "1 0 0"), "holds 3 numbers where 4x4 belong; fix the file."),
        ("7scenes", _text("camera-intrinsics.txt", "0 0 0\n" * 3), "camera-intrinsics.txt holds no camera"),
        ("tum", _text("rgb.txt", "1.0 a.png\nnonsense\n"), "line 2: 'nonsense' is not stamp_s,name; fix"),
        ("tum", _text("groundtruth.txt", "1 2 3\n"), "line 1: there are 3 numbers where 8 belong; fix the line."),
        ("tum", _text("groundtruth.txt", None), "groundtruth.txt is missing; the recording needs it."),
        ("replica", _text("traj.txt", ""), "traj.txt holds no usable pose"),
        ("scannet", _text("intrinsic/intrinsic_depth.txt", None), "intrinsic_depth.txt is missing"),
        ("rtabmap", _calibration(lambda blob: blob[:12] + struct.pack("<i", 1) + blob[16:]), "with a stereo camera"),
        ("rtabmap", _calibration(lambda blob: blob * 2), "has several cameras in one picture"),
        ("rtabmap", _sql("DROP TABLE Node"), "without RTAB-Map's Node"),
        ("rtabmap", _sql("ALTER TABLE Data RENAME COLUMN calibration TO fx"), "RTAB-Map's calibration; give one"),
        ("rtabmap", _sql("UPDATE Data SET depth = NULL"), "none with colour, depth and calibration"),
        ("rtabmap", lambda path: path.with_name(path.name + "-wal").write_bytes(b"x"), "that are not in"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_a_sentence(
    tmp_path: Path, format: str, fault: Callable[[Path], Any], sentence: str
) -> None:
    path = WRITTEN[format].write(tmp_path / "walk", WRITTEN[format].truth())
    fault(path)
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(path)


def test_scaled_positions_metres_and_intrinsics_of_each_frame_are_read(tmp_path: Path) -> None:
    truth = example_truth()
    path = write_nerfstudio(tmp_path / "walk", truth)

    def change(content: dict[str, Any]) -> None:
        camera = {name: content.pop(name) for name in ("fl_x", "fl_y", "cx", "cy", "w", "h")}
        content.update(applied_scale=0.5, depth_unit_scale_factor=0.001)
        for frame, pose in zip(content["frames"], truth.world_from_camera, strict=True):
            own = pose @ HALF_TURN
            own[:3, 3] *= 0.5
            frame.update(camera, transform_matrix=own.tolist(), file_path=frame["file_path"].removesuffix(".png"))

    _edit("transforms.json", change)(path)
    recording = check(lambda: open_recording(path), truth, stamps=False)
    assert any("scaled by 0.5; they are scaled back to metres" in notice for notice in recording.notices)


def test_info_takes_the_files_of_a_split_bag_and_bags_of_two_kinds_are_refused(tmp_path: Path) -> None:
    truth: Truth = example_truth()
    files = sorted(split_ros1(tmp_path / "walk", truth).iterdir())
    answer = describe_path(files[0], "auto", verify=False, plot=None, more=files[1:])
    assert answer["frames"] == len(truth) and answer["faults"] == []
    other = BAGS["MCAP of ROS 1"](tmp_path / "other", truth)
    with pytest.raises(RecordingError, match="are bags of two kinds; convert one of them first"):
        open_recording([files[0], other])
