"""Headers, keys and names of files are read by what they say, or refused with what is not understood."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recording_scenes import CAMERA, pose_line, save_depth, shot, shots, write_folder

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.formats.file_recording import natural_key
from avlmaps.recordings.formats.tables import POSE, named_order, read_table, split_fields
from avlmaps.recordings.open import open_recording

# How others call the eight columns of a pose.
SPELLINGS = (
    ("stamp_s", "tx", "ty", "tz", "qx", "qy", "qz", "qw"),
    ("timestamp", "x", "y", "z", "q_x", "q_y", "q_z", "q_w"),
    ("#timestamp [s]", "p_RS_R_x [m]", "p_RS_R_y [m]", "p_RS_R_z [m]", "q_RS_x []", "q_RS_y []", "q_RS_z []", "q_RS_w"),
    ("time", "pos.x", "pos.y", "pos.z", "orientation.x", "orientation.y", "orientation.z", "orientation.w"),
    ("t", "px", "py", "pz", "rot_x", "rot_y", "rot_z", "rot_w"),
)


@given(st.permutations(range(8)), st.sampled_from(SPELLINGS), st.sampled_from([",", ";", "\t"]))
def test_named_columns_stand_in_any_order(
    tmp_path_factory: pytest.TempPathFactory, order: list[int], names: tuple[str, ...], separator: str
) -> None:
    file = tmp_path_factory.mktemp("t") / "poses.csv"
    rows = np.arange(24.0).reshape(3, 8) + 0.5
    lines = [separator.join(names[at] for at in order)]
    lines += [separator.join(repr(float(row[at])) for at in order) for row in rows]
    file.write_text("\n".join(lines))
    assert np.array_equal(read_table(file, (8,), names=POSE).values, rows)


@pytest.mark.parametrize("comment", ["# timestamp tx ty tz qw qx qy qz", "#time, x, y, z, q_w, q_x, q_y, q_z"])
def test_a_comment_that_names_the_columns_is_followed(tmp_path: Path, comment: str) -> None:
    file = tmp_path / "groundtruth.txt"
    file.write_text(f"# ground truth\n{comment}\n0 1 2 3 1 0 0 0\n# the end\n")
    table = read_table(file, (8,), names=POSE)
    assert table.values.tolist() == [[0, 1, 2, 3, 0, 0, 0, 1]]


def test_a_comment_that_names_no_columns_is_none(tmp_path: Path) -> None:
    file = tmp_path / "groundtruth.txt"
    file.write_text("# a walk of eight words in the kitchen\n# file: 'rgbd.bag'\n0 1 2 3 0 0 0 1\n")
    assert read_table(file, (8,), names=POSE).values.tolist() == [[0, 1, 2, 3, 0, 0, 0, 1]]


def test_units_in_a_header_are_followed() -> None:
    _, factors = named_order(split_fields("#timestamp [ns],tx_mm,ty_mm,tz [cm],qx,qy,qz,qw"), POSE)
    assert factors == pytest.approx([1e-9, 1e-3, 1e-3, 1e-2, 1, 1, 1, 1])


def test_semicolons_and_decimal_commas_are_read(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    text = (path / "poses.csv").read_text()
    (path / "poses.csv").write_text(text.replace(",", ";").replace(".", ","))
    assert np.allclose(open_recording(path).world_from_camera[3], shot(3).world_from_camera, atol=1e-9)


@pytest.mark.parametrize(
    "lines",
    [
        ["name,stamp_s", "{name},{stamp}"],
        ["name,stamp_s", "{name}.png,{stamp}"],
        ["timestamp;filename", "{stamp};{name}.png"],
        ["{name},{stamp}"],
        ["file,time_ms", "{name},{ms}"],
    ],
)
def test_lists_of_frames_are_read_as_people_write_them(tmp_path: Path, lines: list[str]) -> None:
    path = write_folder(tmp_path / "walk")
    rows = [lines[-1].format(name=f"{i:06d}", stamp=i / 10, ms=i * 100) for i in range(5)]
    (path / "frames.csv").write_text("\n".join([*lines[:-1], *rows]))
    recording = open_recording(path)
    assert recording.stamps_s.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert [recording.name(i) for i in range(5)] == [f"{i:06d}" for i in range(5)]
    assert len(recording.frame(4).depth_m)


@given(st.lists(st.integers(0, 10**9), unique=True, min_size=2), st.sampled_from(["{}.png", "f{}.jpg", "a_{}_b.png"]))
def test_natural_order_is_that_of_the_numbers(numbers: list[int], pattern: str) -> None:
    names = [pattern.format(number) for number in numbers]
    assert sorted(names, key=natural_key) == [pattern.format(number) for number in sorted(numbers)]


def replica(path: Path, params: object) -> Path:
    (path / "results").mkdir(parents=True)
    lines = []
    for index, taken in enumerate(shots()):
        import cv2

        cv2.imwrite(str(path / f"results/frame{index:06d}.jpg"), taken.rgb)
        save_depth(path / f"results/depth{index:06d}.png", taken.depth_mm)
        lines.append(" ".join(map(repr, taken.world_from_camera.ravel().tolist())))
    (path / "traj.txt").write_text("\n".join(lines))
    (path / "cam_params.json").write_text(json.dumps(params))
    return path


NUMBERS = {"fx": CAMERA.fx, "fy": CAMERA.fy, "cx": CAMERA.cx - 0.5, "cy": CAMERA.cy - 0.5}


@pytest.mark.parametrize(
    "params",
    [
        {"camera": {**NUMBERS, "w": 64, "h": 48, "png_depth_scale": 1000.0}},
        {"cam": {**NUMBERS, "W": 64, "H": 48, "png_depth_scale": 1000.0, "crop_edge": 0}},
        {**NUMBERS, "scale": 1000.0},
        {"dataset_name": "replica", "camera_params": {**NUMBERS, "image_width": 64, "image_height": 48, "scale": 1000}},
    ],
)
def test_the_scale_of_depth_is_read_under_every_name(tmp_path: Path, params: object) -> None:
    recording = open_recording(replica(tmp_path / "room0", params))
    assert recording.depth_units_per_m == 1000.0 and recording.rig.rgb == CAMERA


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"camera": {**NUMBERS, "depth_scale": 1000.0}}, "has the key 'depth_scale', which is not read here"),
        ({"camera": {**NUMBERS, "distortion": [0.1]}}, "has the key 'distortion'"),
        ({"camera": NUMBERS, "depth_unit_mm": 1}, "has the key 'depth_unit_mm'"),
        ({"camera": {**NUMBERS, "scale": 6553.5, "png_depth_scale": 1000.0}}, "has scale twice"),
        ({"camera": {"fx": 60.0, "fy": 60.0, "cx": 1.0}}, "missing required field `cy`"),
        ({"intrinsics": NUMBERS}, "has the key 'intrinsics'"),
    ],
)
def test_a_key_about_the_camera_is_read_or_refused(tmp_path: Path, params: object, said: str) -> None:
    with pytest.raises(RecordingError, match=r"cam_params.json") as fault:
        open_recording(replica(tmp_path / "room0", params))
    assert said in str(fault.value)


def test_a_key_about_nothing_that_matters_is_a_notice(tmp_path: Path) -> None:
    recording = open_recording(replica(tmp_path / "room0", {"camera": {**NUMBERS, "scale": 1000.0}, "author": "me"}))
    assert "cam_params.json has keys that are not read: author." in recording.notices


@pytest.mark.parametrize(("separator", "slash"), [(" ", "\\"), ("\t", "/"), (",", "/")])
def test_lists_of_pictures_have_any_blanks_and_slashes(tmp_path: Path, separator: str, slash: str) -> None:
    path, stamps = tmp_path / "rgbd", [1.0 + 0.1 * i for i in range(5)]
    for index, taken in enumerate(shots()):
        import cv2

        for folder in ("rgb", "depth"):
            (path / folder).mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path / f"rgb/{index}.png"), taken.rgb)
        save_depth(path / f"depth/{index}.png", taken.depth_mm)
    for folder in ("rgb", "depth"):
        lines = [f"{stamp}{separator}{folder}{slash}{index}.png" for index, stamp in enumerate(stamps)]
        (path / f"{folder}.txt").write_text("\n".join(lines))
    poses = [f"{stamp} {pose_line(shot(index).world_from_camera)}" for index, stamp in enumerate(stamps)]
    (path / "groundtruth.txt").write_text("\n".join(poses))
    recording = open_recording(path)
    assert len(recording) == 5 and recording.frame(2).rgb.shape == (48, 64, 3)
