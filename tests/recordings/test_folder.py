"""Our own folder format: written by hand, written by the writer, cut short, and asked for a lot of frames."""

import json
import os
import re
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from recording_scenes import CAMERA, metres, pose_line, rig, save_depth, shot, shots, write_folder, write_seven_scenes

import avlmaps
from avlmaps.core.camera import Rig
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.open import open_recording, validate
from avlmaps.recordings.types import Frame, Recording
from avlmaps.recordings.writer import RecordingWriter
from avlmaps_sim.mixing.add_sounds import write_recording


def _frame(index: int, stamp_s: float, name: str | None = None) -> Frame:
    taken = shot(index)
    return Frame(
        index, name or f"{index:06d}", stamp_s, taken.rgb, metres(taken.depth_mm), taken.world_from_camera, rig()
    )


def _describe(path: Path, **changes: object) -> None:
    described = json.loads((path / "recording.json").read_text())
    (path / "recording.json").write_text(json.dumps(described | changes))


def _assert_same_frames(recording: Recording, count: int = 5) -> None:
    assert len(recording) == count
    for index, frame in enumerate(recording.frames()):
        taken = shot(index)
        assert np.array_equal(frame.rgb, taken.rgb)
        assert np.array_equal(frame.depth_m, metres(taken.depth_mm))
        assert np.allclose(frame.world_from_camera, taken.world_from_camera, atol=1e-12)


def test_a_folder_written_by_hand_opens(tmp_path: Path):
    recording = avlmaps.open_recording(write_folder(tmp_path / "walk"))
    _assert_same_frames(recording)
    assert recording.format == "folder" and recording.audio is None and recording.notices == ()
    assert recording.rig.rgb == CAMERA and recording.rig.registered
    assert np.array_equal(recording.up_in_world, [0.0, 0.0, 1.0])
    assert recording.stamps_s.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert recording.frame(3).name == recording.name(3) == "000003"


def test_what_the_writer_writes_is_read_back(tmp_path: Path):
    rng = np.random.default_rng(0)
    sound = Sound((0.1 * rng.standard_normal(8000)).astype(np.float32), 8000)
    rotated = Rig(CAMERA, CAMERA, shot(2).world_from_camera)
    with RecordingWriter(tmp_path / "walk", rotated, up_in_world=np.array([0.0, -1.0, 0.0])) as writer:
        for index, stamp_s in enumerate([0.5, 0.75, 1.25]):
            taken = shot(index)
            depth_m, pose = metres(taken.depth_mm), taken.world_from_camera
            writer.add(Frame(index, f"kitchen-{9 - index}", stamp_s, taken.rgb, depth_m, pose, rotated))
        writer.set_audio(sound, start_s=0.25)
    recording = open_recording(tmp_path / "walk")
    _assert_same_frames(recording, 3)
    assert recording.stamps_s.tolist() == [0.5, 0.75, 1.25]
    assert [recording.name(i) for i in range(3)] == ["kitchen-9", "kitchen-8", "kitchen-7"]
    assert np.array_equal(recording.up_in_world, [0.0, -1.0, 0.0])
    assert np.array_equal(recording.rig.rgb_from_depth, rotated.rgb_from_depth)
    assert recording.audio is not None and recording.audio.start_s == 0.25
    assert recording.audio.duration_s == pytest.approx(1.0)


def test_depth_beyond_the_range_of_the_format_is_left_out(tmp_path: Path):
    frame = _frame(0, 0.0)
    frame.depth_m[5, 5], frame.depth_m[6, 6] = 80.0, 65.534
    with RecordingWriter(tmp_path / "walk", rig()) as writer:
        writer.add(frame)
    depth_m = open_recording(tmp_path / "walk").frame(0).depth_m
    assert depth_m[5, 5] == 0.0 and depth_m[6, 6] == pytest.approx(65.534)


def test_a_recording_that_was_cut_short_is_refused_and_can_be_written_again(tmp_path: Path):
    with pytest.raises(RuntimeError), RecordingWriter(tmp_path / "walk", rig()) as writer:
        writer.add(_frame(0, 0.0))
        raise RuntimeError("the robot fell over")
    sentence = f"{tmp_path / 'walk'} was never finished: its writer stopped before the end; record it again."
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        open_recording(tmp_path / "walk")
    with RecordingWriter(tmp_path / "walk", rig()) as writer:
        writer.add(_frame(1, 0.0, "other"))
    recording = open_recording(tmp_path / "walk")
    assert len(recording) == 1 and recording.name(0) == "other"
    assert not (tmp_path / "walk/rgb/000000.png").exists()


def test_a_folder_that_holds_something_is_never_written_into(tmp_path: Path):
    write_folder(tmp_path / "walk")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(RecordingError, match=r"walk is not empty \(it holds .*\); choose another folder or empty it."):
        RecordingWriter(tmp_path / "walk", rig()).__enter__()
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("second", "sentence"),
    [
        (("000000", 1.0), "cannot hold a frame called '000000': the name is taken or no file name."),
        (("a/b", 1.0), "cannot hold a frame called 'a/b'"),
        (("000001", 0.0), "Frame 000001 has the stamp 0.0 s after 0.0 s; stamps must rise."),
        (("000001", float("nan")), "Frame 000001 has the stamp nan s"),
    ],
)
def test_the_writer_refuses_what_could_not_be_read_back(tmp_path: Path, second: tuple[str, float], sentence: str):
    with RecordingWriter(tmp_path / "walk", rig()) as writer:
        writer.add(_frame(0, 0.0))
        with pytest.raises(RecordingError, match=re.escape(sentence)):
            writer.add(_frame(1, second[1], second[0]))
    assert len(open_recording(tmp_path / "walk")) == 1


def test_poses_at_another_rate_are_interpolated_at_the_frames(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    (path / "frames.csv").write_text("name,stamp_s\n" + "".join(f"{i:06d},{0.05 + 0.1 * i}\n" for i in range(5)))
    lines = [f"{0.1 * i}, {0.1 * i}, 0, 0, 0, 0, {np.sin(0.05 * i)}, {np.cos(0.05 * i)}" for i in range(8)]
    (path / "poses.csv").write_text("\n".join(lines))
    recording = open_recording(path)
    assert np.allclose(recording.world_from_camera[:, 0, 3], [0.05, 0.15, 0.25, 0.35, 0.45])
    angle = np.arctan2(recording.world_from_camera[:, 1, 0], recording.world_from_camera[:, 0, 0])
    assert np.allclose(angle, [0.05, 0.15, 0.25, 0.35, 0.45])


def test_frames_outside_the_poses_are_left_out_and_told(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    (path / "poses.csv").write_text("".join(f"{t},0,0,0,0,0,0,1\n" for t in (0.0, 0.1, 0.2)))
    _describe(path, rgb_rate_hz=10.0)
    recording = open_recording(path)
    assert recording.stamps_s.tolist() == [0.0, 0.1, 0.2] and recording.posed == pytest.approx(0.6)
    assert recording.notices[0] == (
        "2 of 5 frame(s) lie outside poses.csv (0.00 to 0.20 s) or in a gap of it; left out."
    )


def test_stamps_that_are_dates_are_counted_from_the_first(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    lines = [f"{1.7e9 + 0.1 * i},{pose_line(s.world_from_camera).replace(' ', ',')}" for i, s in enumerate(shots())]
    (path / "poses.csv").write_text("\n".join(lines))
    recording = open_recording(path)
    assert np.allclose(recording.stamps_s, [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-6)
    assert recording.notices == ("The stamps are dates; time 0 is the first frame's, 1700000000.000000 s since 1970.",)
    assert recording.begins_s == 1.7e9


def test_frames_without_a_pose_are_left_out_and_told(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    lines = (path / "poses.csv").read_text().splitlines()
    lines[2] = "0.1,nan,nan,nan,nan,nan,nan,nan"
    (path / "poses.csv").write_text("\n".join(lines))
    recording = open_recording(path)
    assert [recording.name(i) for i in range(len(recording))] == ["000000", "000002", "000003", "000004"]
    assert recording.notices[-1] == "1 frame(s) without a pose (lost tracking) are left out: 000001."
    assert np.allclose(recording.frame(1).world_from_camera, shot(2).world_from_camera)


def test_a_clock_that_was_set_back_costs_the_shorter_part_and_no_more(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    lines = (path / "poses.csv").read_text().splitlines()
    poses_only = [line.split(",", 1)[1] for line in lines[1:]]
    stamps = [50.0, 50.1, 7.0, 7.1, 7.2]
    (path / "poses.csv").write_text("\n".join(f"{s},{p}" for s, p in zip(stamps, poses_only, strict=True)))
    recording = open_recording(path)
    assert recording.stamps_s.tolist() == [7.0, 7.1, 7.2]
    assert recording.notices[0].startswith("The clock of the frames jumps back 1 time(s), by up to 43.1 s; the longest")


def test_a_broken_frame_is_met_when_it_is_asked_for_and_named(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    (path / "depth/000002.png").write_bytes((path / "depth/000002.png").read_bytes()[:100])
    (path / "rgb/000003.png").unlink()
    (path / "frames.csv").write_text("".join(f"{i:06d},{i / 10}\n" for i in range(5)))
    recording = open_recording(path)
    with pytest.raises(RecordingError, match=r"depth/000002.png is truncated \(100 bytes\)"):
        recording.frame(2)
    with pytest.raises(RecordingError, match=r"rgb/000003.png is missing"):
        recording.frame(3)
    assert recording.frame(4).index == 4
    with pytest.raises(IndexError, match="there is no frame 5; the recording has 5"):
        recording.frame(5)


def test_pictures_may_be_of_any_kind(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    for index, (colour, depth) in enumerate([(".bmp", ".npy"), (".tiff", ".tiff")]):
        rgb, deep = path / f"rgb/{index:06d}.png", path / f"depth/{index:06d}.png"
        rgb.unlink(), deep.unlink()
        cv2.imwrite(str(rgb.with_suffix(colour)), shot(index).rgb[..., ::-1])
        if depth == ".npy":
            np.save(deep.with_suffix(depth), metres(shot(index).depth_mm))
        else:
            cv2.imwrite(str(deep.with_suffix(depth)), shot(index).depth_mm)
    _assert_same_frames(open_recording(path))
    assert not validate(path)


def test_a_video_may_hold_the_colour(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    import av

    with av.open(str(path / "rgb.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for index in range(5):
            grey = np.full((48, 64, 3), 40 * index + 20, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(grey, format="rgb24")))
        container.mux(stream.encode())
    for file in (path / "rgb").iterdir():
        file.unlink()
    (path / "rgb").rmdir()
    recording = open_recording(path)
    assert np.allclose(recording.stamps_s, [0.0, 0.1, 0.2, 0.3, 0.4])
    levels = [float(recording.frame(i).rgb.mean()) for i in (4, 0, 2)]
    assert np.allclose(levels, [180, 20, 100], atol=6)
    assert recording.audio is None and recording.colour_file(0) is None
    copy = open_recording(write_recording(recording, tmp_path / "copy"))
    assert np.array_equal(copy.frame(2).rgb, recording.frame(2).rgb)
    (path / "depth/000004.png").unlink()
    with pytest.raises(RecordingError, match=r"rgb.mp4 has 5 frames, but .*depth 4 pictures"):
        open_recording(path)


def test_the_fingerprint_follows_the_recording_and_not_its_place(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    first = open_recording(path).fingerprint
    assert re.fullmatch("[0-9a-f]{64}", first)
    path.rename(tmp_path / "moved")
    path = tmp_path / "moved"
    assert open_recording(path).fingerprint == first
    with (path / "rgb/000001.png").open("ab") as stream:
        stream.write(b"x")
    changed = open_recording(path).fingerprint
    assert changed != first
    lines = (path / "poses.csv").read_text().splitlines()
    (path / "poses.csv").write_text("\n".join([*lines[:-1], lines[-1].replace("0.4,", "0.45,", 1)]))
    assert open_recording(path).fingerprint not in (first, changed)


def test_a_copy_is_the_same_recording_bit_for_bit(tmp_path: Path):
    original = open_recording(write_seven_scenes(tmp_path / "scene"))
    write_recording(original, tmp_path / "copy", audio=Sound(np.zeros(8000, np.float32), 8000))
    copy = open_recording(tmp_path / "copy")
    assert np.array_equal(copy.stamps_s, original.stamps_s)
    assert np.allclose(copy.world_from_camera, original.world_from_camera, atol=1e-14)
    assert copy.up_in_world is None and copy.rig.rgb == original.rig.rgb and copy.rig.depth == original.rig.depth
    assert copy.audio is not None and copy.audio.duration_s == pytest.approx(1.0)
    for index in range(len(original)):
        source = original.colour_file(index)
        target = copy.colour_file(index)
        assert source is not None and target is not None
        assert source.read_bytes() == target.read_bytes()
        assert np.array_equal(original.frame(index).depth_m, copy.frame(index).depth_m)
        assert original.name(index) == copy.name(index)


@pytest.mark.slow
@pytest.mark.nightly
def test_opening_five_thousand_frames_opens_few_pictures_and_takes_little_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    count = 5_000
    path = write_folder(tmp_path / "walk", count=1)
    picture = path / "depth/000000.png"
    for folder in ("rgb", "depth"):
        (path / folder / "000000.png").rename(tmp_path / f"{folder}.png")
        for index in range(count):
            (path / folder / f"{index:06d}.png").symlink_to(tmp_path / f"{folder}.png")
    (path / "poses.csv").write_text("".join(f"{i / 30},{i / 100},0,0,0,0,0,1\n" for i in range(count)))
    monkeypatch.setattr(cv2, "imdecode", None)
    opened: list[Path] = []
    real_open = os.open
    monkeypatch.setattr(os, "open", lambda path, *rest: (opened.append(Path(path)), real_open(path, *rest))[1])
    tracemalloc.start()
    recording = open_recording(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(recording) == count
    assert [file.name for file in opened if file.suffix != ".png"] == ["recording.json", "poses.csv"]
    assert len(opened) <= 2 + 2 * 9, "the heads of a few pictures, for their size"
    assert peak < 2000 * count
    monkeypatch.undo()
    assert picture.exists()
    assert recording.frame(count - 1).world_from_camera[0, 3] == pytest.approx((count - 1) / 100)


def test_a_copy_takes_truth_along_but_not_the_events_of_another_track(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    (path / "objects.json").write_text("[]")
    (path / "events.csv").write_text("category,onset_s\n")
    for index in (0, 7):
        save_depth(path / f"semantic/{index:06d}.png", np.zeros((48, 64)))
    recording = open_recording(path)
    same = write_recording(recording, tmp_path / "same")
    other = write_recording(recording, tmp_path / "other", audio=Sound(np.zeros(80, np.float32), 8000))
    assert (same / "events.csv").exists() and not (other / "events.csv").exists()
    for copy in (same, other):
        assert (copy / "objects.json").read_text() == "[]"
        assert [file.name for file in (copy / "semantic").iterdir()] == ["000000.png"]


def test_a_recording_whose_writer_was_killed_is_refused(tmp_path: Path):
    program = (
        "import os, sys; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path\n"
        "from recording_scenes import CAMERA, rig, shot, metres\n"
        "from avlmaps.recordings.types import Frame\n"
        "from avlmaps.recordings.writer import RecordingWriter\n"
        "with RecordingWriter(Path(sys.argv[2]), rig()) as writer:\n"
        "    for i in range(3):\n"
        "        s = shot(i)\n"
        "        frame = Frame(i, str(i), float(i), s.rgb, metres(s.depth_mm), s.world_from_camera, rig())\n"
        "        writer.add(frame)\n"
        "    os.kill(os.getpid(), 9)\n"
    )
    here = str(Path(__file__).parent)
    done = subprocess.run([sys.executable, "-c", program, here, str(tmp_path / "walk")], check=False)
    assert done.returncode == -9
    with pytest.raises(RecordingError, match="walk was never finished: its writer stopped before the end"):
        open_recording(tmp_path / "walk")
    (fault,) = validate(tmp_path / "walk")
    assert fault.fatal and fault.file == tmp_path / "walk/UNFINISHED"


def test_a_frame_that_would_lose_its_depth_or_its_pose_is_refused(tmp_path: Path):
    whole = _frame(0, 0.0)
    turned = np.eye(4)
    turned[3] = 1.0, 2.0, 3.0, 1.0
    with RecordingWriter(tmp_path / "walk", rig()) as writer:
        with pytest.raises(RecordingError, match="looks like millimetres"):
            writer.add(replace(whole, depth_m=np.full_like(whole.depth_m, 2500.0)))
        with pytest.raises(RecordingError, match="not a rigid transform"):
            writer.add(replace(whole, world_from_camera=turned))
        with pytest.raises(RecordingError, match="not a rigid transform"):
            writer.add_files("000000", 0.0, turned, tmp_path / "a.png", tmp_path / "b.png")
        writer.add(whole)
    assert len(open_recording(tmp_path / "walk")) == 1
    assert len(open_recording(one for one in [tmp_path / "walk"])) == 1


def test_a_track_is_given_by_its_name_and_what_is_none_is_refused(tmp_path: Path):
    with RecordingWriter(tmp_path / "first", rig()) as writer:
        writer.add(_frame(0, 0.0))
        writer.set_audio(Sound(np.full(800, 0.25, np.float32), 8000))
    with RecordingWriter(tmp_path / "walk", rig()) as writer:
        writer.add(_frame(0, 0.0))
        with pytest.raises(AudioError, match=r"an avlmaps\.Sound or an avlmaps\.ChannelSound, not ndarray"):
            writer.set_audio(np.zeros(800, np.float32))
        writer.set_audio(str(tmp_path / "first/audio.flac"))
    assert open_recording(tmp_path / "walk").audio is not None


@pytest.mark.parametrize("path", [None, 5, [], [5]])
def test_what_is_no_path_opens_no_recording(path: object):
    with pytest.raises(RecordingError, match="A recording is opened by its path"):
        open_recording(path)  # pyright: ignore[reportArgumentType]


def describe(**changes: object) -> Callable[[Path], None]:
    return lambda path: _describe(path, **changes)


def with_line(line: str, at: int = 2) -> Callable[[Path], None]:
    """Return what replaces a line of poses.csv."""

    def change(path: Path) -> None:
        lines = (path / "poses.csv").read_text().splitlines()
        lines[at] = line
        (path / "poses.csv").write_text("\n".join(lines))

    return change


def with_file(name: str, content: bytes) -> Callable[[Path], None]:
    return lambda path: (path / name).write_bytes(content) and None


def with_depth_of(height: int, width: int) -> Callable[[Path], None]:
    return lambda path: [save_depth(f, np.full((height, width), 900)) for f in (path / "depth").iterdir()] and None


# What is changed in a right folder, and what is said: the file, the line or field, the number, the remedy.
REFUSED: list[tuple[Callable[[Path], object], str]] = [
    (describe(schema_version=2), "has schema version 2; this avlmaps reads version 1: update avlmaps."),
    (describe(depth_units_per_m="1000"), "recording.json at depth_units_per_m: Expected `float`, got `str`"),
    (describe(depth_units_per_m=0), "depth_units_per_m is 0; it must be positive and at most 1e+06"),
    (describe(rgb_rate_hz=-1), "recording.json: rgb_rate_hz is -1.0; it must be positive; fix the file."),
    (describe(depth_scale=5000), "recording.json: the key 'depth_scale' is not known; known there are schema_version"),
    (describe(distortion=[0.1]), "the key 'distortion' is not known"),
    (describe(up_in_world=[0, 0, 9.81]), "it must be a unit vector, or null where up is not known"),
    (describe(intrinsics={}), "recording.json at intrinsics: Object missing required field `rgb`"),
    (with_file("recording.json", b"{"), "recording.json is not JSON (Input data was truncated); fix the file."),
    (with_file("recording.json", b'{"schema_version": 1,\n "origin": "caf\xe9"}'), "line 2: this is not UTF-8 text"),
    (with_line("0.1,0,0"), "poses.csv, line 3: there are 3 numbers where 8 belong; fix the line."),
    (with_line("0.1,0,0,zero,0,0,0,1"), "poses.csv, line 3: '0.1,0,0,zero,0,0,0,1' is not all numbers"),
    (with_file("poses.csv", b"0,0,0,0,0,0,0,1\n"), "5 pictures in rgb/ and 1 lines in poses.csv; add frames.csv (name"),
    (with_file("poses.csv", b"nan,0,0,0,0,0,0,1\n" * 5), "holds no usable pose"),
    (with_line("stamp_s,tx,ty,tz,roll,pitch,yaw,w", 0), "line 1: 'roll' is none of the columns stamp_s,tx"),
    (with_line("stamp_s,tx,ty,tz,qx,qy,qz,qx", 0), "'qx' and 'qx' both name the column qx"),
    (with_line("stamp_s,tx,ty,tz,qx,qy,qz", 0), "the column qw is missing"),
    (with_line("stamp_s,tx [ft],ty [ft],tz [ft],qx,qy,qz,qw", 0), "'tx [ft]' is none of the columns"),
    (with_depth_of(24, 32), "intrinsics of rgb only, but colour is 64x48 and depth 32x24; add intrinsics.depth"),
    (with_depth_of(64, 48), "and depth 48x64"),
    (with_file("frames.csv", b"name,stamp_s\nnone,0\n"), "the first picture '000000.png'); write the names of"),
    (
        with_file("frames.csv", b"000001,100\n000002,100.1\n"),
        "No frame lies within poses.csv (0.00 to 0.40 s): the frames go from 100.00 to 100.10 s; check that both",
    ),
]


@pytest.mark.parametrize(("change", "said"), REFUSED)
def test_what_cannot_be_is_refused_by_file_line_and_number(
    tmp_path: Path, change: Callable[[Path], object], said: str
) -> None:
    path = write_folder(tmp_path / "walk")
    change(path)
    with pytest.raises(RecordingError, match=re.escape(said)):
        open_recording(path)


@pytest.mark.parametrize(
    ("name", "given"), [("colour", "bmp"), ("depth_units_per_m", 0.0), ("up_in_world", np.zeros(3)), ("rig", CAMERA)]
)
def test_what_no_reader_would_take_is_refused_before_the_drive(tmp_path: Path, name: str, given: object) -> None:
    writer = RecordingWriter(tmp_path / "walk", rig())
    setattr(writer, name, given)
    with pytest.raises(RecordingError, match=f"{name}|unit vector"):
        writer.__enter__()
    assert not (tmp_path / "walk").exists()
