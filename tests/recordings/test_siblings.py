"""Files of others' formats that are nearly right: each is read by what it says, or refused, never passed over."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.conformance import Truth, check, example_truth
from avlmaps.recordings.formats.ros_transforms import _tree_of_file  # pyright: ignore[reportPrivateUsage]
from avlmaps.recordings.open import open_recording
from helpers.format_writers import (
    numbers,
    quaternion,
    write_avlmaps,
    write_folder,
    write_hov_sg,
    write_nerfstudio,
    write_polycam,
    write_record3d_exr,
    write_redwood,
    write_seven_scenes,
)

TRUTH = example_truth(frames=6)
Writer = Callable[[Path, Truth], Path]
Edit = Callable[[dict[str, Any]], object]


def edited(write: Writer, path: Path, files: str, edit: Edit) -> Path:
    write(path, TRUTH)
    for file in path.glob(files):
        plain = json.loads(file.read_text())
        edit(plain)
        file.write_text(json.dumps(plain))
    return path


def of_frames(**more: Any) -> Edit:
    return lambda plain: [frame.update(more) for frame in plain["frames"][1:]]


def turned(plain: dict[str, Any]) -> None:
    for frame in plain["frames"]:
        frame["transform_matrix"] = np.array(frame["transform_matrix"]).T.tolist()


NERF = (write_nerfstudio, "transforms.json")
R3D = (write_record3d_exr, "EXR_RGBD/metadata.json")
CAMERAS = (write_polycam, "keyframes/cameras/*.json")


@pytest.mark.parametrize(
    ("kind", "edit", "said"),
    [
        (NERF, of_frames(depth_scale=0.001), "has the key 'depth_scale', which is not read"),
        (NERF, of_frames(fx=26.0), "has the key 'fx', which is not read"),
        (NERF, of_frames(w=128, h=96), "has frames of 64x48 and 128x96"),
        (NERF, of_frames(is_fisheye=True), "camera model 'fisheye'"),
        (NERF, turned, "looks written column by column: transpose it"),
        (NERF, lambda p: p.update(integer_depth_scale=0.001, depth_unit_scale_factor=0.25), "one positive number"),
        (R3D, lambda p: p.update(frameTimestamps=p["frameTimestamps"][:3]), "3 frameTimestamps for 6 poses"),
        (R3D, lambda p: p.update(frameTimestamps=[1e3 * s for s in p["frameTimestamps"]]), "look like milliseconds"),
        (R3D, lambda p: p.update(perFrameIntrinsicCoeffs=[p["K"]] * 6), "a row of perFrameIntrinsicCoeffs of"),
    ],
)
def test_what_may_change_the_map_is_refused(tmp_path: Path, kind: tuple[Writer, str], edit: Edit, said: str) -> None:
    path = edited(kind[0], tmp_path / "scan", kind[1], edit)
    with pytest.raises(RecordingError) as fault:
        open_recording(path)
    assert said in str(fault.value)


@pytest.mark.parametrize(
    ("kind", "edit", "said"),
    [
        (NERF, of_frames(k1=0.2), "lens distortion"),
        (R3D, lambda p: p.update(depthScale=1000), "may change the map: depthScale"),
        (R3D, lambda p: [p.pop("frameTimestamps"), p.pop("fps")], "no stamps; 60 frames/s are assumed"),
        (CAMERAS, lambda p: p.update(depth_scale=0.001, k1=0.2), "may change the map: depth_scale, k1"),
    ],
)
def test_what_is_assumed_or_not_read_is_said(tmp_path: Path, kind: tuple[Writer, str], edit: Edit, said: str) -> None:
    notices = open_recording(edited(kind[0], tmp_path / "scan", kind[1], edit)).notices
    assert any(said in notice for notice in notices)


@pytest.mark.parametrize(
    ("kind", "edit"),
    [
        (NERF, of_frames(colmap_im_id=3, mask_path="m.png", depth_mask_path="d.png")),
        (CAMERAS, lambda p: p.update(t_30=0, t_31=0, t_32=0, t_33=1, center_depth=1.0, neighbors=[])),
    ],
)
def test_what_says_nothing_about_the_map_is_passed_over(tmp_path: Path, kind: tuple[Writer, str], edit: Edit) -> None:
    with_more = edited(kind[0], tmp_path / "more", kind[1], edit)
    without = edited(kind[0], tmp_path / "plain", kind[1], lambda _: None)
    assert open_recording(with_more).notices == open_recording(without).notices


def poses_of(lines: list[str], kept: list[int]) -> str:
    return "\n".join(line for at in kept for line in lines[5 * at : 5 * at + 5])


@pytest.mark.parametrize(
    ("poses", "no_colour", "no_depth"),
    [([0, 1, 3, 5], [], []), ([5, 4, 3, 2, 1, 0], [], []), (list(range(6)), [2], []), (list(range(5)), [1], [3])],
)
def test_a_log_and_pictures_with_gaps_belong_together_by_their_numbers(
    tmp_path: Path, poses: list[int], no_colour: list[int], no_depth: list[int]
) -> None:
    path = write_redwood(tmp_path / "scene", TRUTH)
    log = path / "trajectory.log"
    log.write_text(poses_of(log.read_text().splitlines(), poses))
    for folder, gone in (("color", no_colour), ("depth", no_depth)):
        files = sorted((path / folder).iterdir())
        for at in gone:
            files[at].unlink()
    recording = open_recording(path)
    whole = [at for at in sorted(poses) if at not in (*no_colour, *no_depth)]
    assert [int(recording.name(i)[:5]) - 1 for i in range(len(recording))] == whole
    assert recording.stamps_s == pytest.approx(TRUTH.stamps_s[whole] - TRUTH.stamps_s[whole[0]])
    for i, at in enumerate(whole):
        assert np.allclose(recording.world_from_camera[i], TRUTH.world_from_camera[at], atol=1e-9)
        assert np.allclose(recording.frame(i).depth_m, TRUTH.depth_m[at], atol=1e-3)
    assert any("by their numbers in the log" in n or "by the numbers in their names" in n for n in recording.notices)


def test_a_transform_between_the_cameras_is_rigid(tmp_path: Path) -> None:
    moved = np.eye(4)
    moved[3, 0] = 0.025

    def edit(plain: dict[str, Any]) -> None:
        plain["intrinsics"]["rgb_from_depth"] = moved.tolist()

    with pytest.raises(RecordingError, match=r"rgb_from_depth.*0\.025 0 0 1.*column by column"):
        open_recording(edited(write_folder, tmp_path / "walk", "recording.json", edit))


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 7, 4, 5, 6), (0, 4, 5, 6, 7, 1, 2, 3)])
def test_the_header_of_a_file_of_poses_for_a_bag_is_followed(tmp_path: Path, order: tuple[int, ...]) -> None:
    names = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]
    lines = [" ".join(names[at] for at in order)]
    for stamp_s, pose in zip(TRUTH.stamps_s, TRUTH.world_from_camera, strict=True):
        row = numbers([stamp_s, *pose[:3, 3], *quaternion(pose)]).split()
        lines.append(" ".join(row[at] for at in order))
    (tmp_path / "poses.txt").write_text("\n".join(lines))
    tree = _tree_of_file(tmp_path / "poses.txt", "camera")
    found, known = tree.root_from("camera", TRUTH.stamps_s)
    assert known.all() and np.allclose(found, TRUTH.world_from_camera, atol=1e-9)


def in_kind(folder: str, suffix: str) -> Callable[[Path], object]:
    """Return what writes the pictures of a folder as files of another kind."""

    def change(path: Path) -> None:
        for file in sorted((path / folder).iterdir()):
            if suffix == ".npz":
                np.savez(file.with_suffix(suffix), depth=np.zeros((48, 64), np.uint16))
            else:
                Image.open(file).save(file.with_suffix(suffix))
            file.unlink()

    return change


def packed(path: Path) -> None:
    for file in path.glob("*.depth.png"):
        file.rename(file.with_suffix(".pgm"))


def half(path: Path) -> None:
    names = [file.stem for file in sorted((path / "rgb").iterdir())]
    rows = [f"{name},{stamp_s}" for name, stamp_s in zip(names, TRUTH.stamps_s, strict=True)]
    (path / "frames.csv").write_text("\n".join(["name,stamp_s", *rows]))
    first = path / f"rgb/{names[0]}.png"
    Image.open(first).save(first.with_suffix(".gif"))
    first.unlink()
    open_recording(path).frame(0)


@pytest.mark.parametrize(
    ("write", "change", "said"),
    [
        (write_folder, in_kind("rgb", ".gif"), "holds 6 files of the kind .gif (000000.gif), and none that is read"),
        (write_folder, in_kind("rgb", ".jp2"), "of the kind .jp2"),
        (write_folder, in_kind("depth", ".npz"), "of the kind .npz (000000.npz), and none that is read: .png, .npy"),
        (write_folder, half, "000000.gif is a GIF"),
        (write_hov_sg, in_kind("rgb", ".ppm"), "of the kind .ppm"),
        (write_avlmaps, in_kind("rgb", ".ppm"), "of the kind .ppm"),
        (write_seven_scenes, packed, "unpack the .sens with the Python reader"),
    ],
)  # fmt: skip
def test_a_file_of_another_kind_is_never_called_missing(
    tmp_path: Path, write: Writer, change: Callable[[Path], object], said: str
) -> None:
    path = write(tmp_path / "scene", TRUTH)
    with pytest.raises(RecordingError) as fault:
        change(path)
        open_recording(path)
    assert said in str(fault.value) and "missing" not in str(fault.value)


@pytest.mark.parametrize(
    ("write", "names"),
    [
        (write_hov_sg, {"pose": "poses"}),
        (write_hov_sg, {"rgb": "Images", "depth": "Depths", "pose": "Poses"}),
        (write_avlmaps, {"rgb": "images", "depth": "depths"}),
    ],
)
def test_folders_of_other_names_are_read(tmp_path: Path, write: Writer, names: dict[str, str]) -> None:
    path = write(tmp_path / "scene", TRUTH)
    for name, other in names.items():
        (path / name).rename(path / other)
    check(lambda: open_recording(path), TRUTH, stamps="pose" not in names)
