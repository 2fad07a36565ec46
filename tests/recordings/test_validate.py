"""The validator names every fault it finds, each in one sentence with its file and line."""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import soundfile
from recording_scenes import save_depth, save_rgb, write_folder, write_seven_scenes

from avlmaps.cli.info import counted
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.open import open_recording, validate


def _replace_line(path: Path, number: int, text: str) -> None:
    lines = path.read_text().splitlines()
    lines[number - 1] = text
    path.write_text("\n".join(lines) + "\n")


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:120])


def _list_frames(path: Path) -> None:
    (path / "frames.csv").write_text("name,stamp_s\n" + "".join(f"{i:06d},{i / 10}\n" for i in range(5)))


def _lose_a_frame(path: Path) -> None:
    _list_frames(path)
    (path / "rgb/000002.png").unlink()


def _short_sound(path: Path) -> None:
    lines = [f"{0.5 * i},0,0,0,0,0,0,1" for i in range(5)]
    (path / "poses.csv").write_text("\n".join(lines))
    soundfile.write(path / "audio.flac", np.zeros(8000), 8000)


FAULTS: list[tuple[Callable[[Path], object], str, str, int | None, bool]] = [
    (_lose_a_frame, "rgb/000002.png is missing; restore it", "rgb/000002.png", None, False),
    (lambda p: _cut(p / "depth/000003.png"), "000003.png is truncated (120 bytes)", "depth/000003.png", None, False),
    (lambda p: save_rgb(p / "rgb/000001.png", np.zeros((24, 32, 3), np.uint8)),
     "000001.png is 32x24, but the recording's camera is 64x48", "rgb/000001.png", None, False),
    (lambda p: save_depth(p / "depth/000004.png", np.zeros((48, 64))),
     "000004.png: the depth is zero everywhere, so this frame adds nothing to a map.", "depth/000004.png", None, False),
    (lambda p: _replace_line(p / "poses.csv", 3, "0.1,nan,0,0,0,0,0,1"),
     "poses.csv, line 3: this is no pose, and not used; it is NaN or infinite.", "poses.csv", 3, False),
    (lambda p: _replace_line(p / "poses.csv", 4, "0.2,0,0,0,0,0,0,1.5"),
     "poses.csv, line 4: this is no pose, and not used; the quaternion has length 1.5,", "poses.csv", 4, False),
    (lambda p: _replace_line(p / "poses.csv", 5, "0.15,0,0,0,0,0,0,1"),
     "poses.csv, line 5: stamp 0.150000 s is not after that of the line before (0.200000 s);", "poses.csv", 5, False),
    (_short_sound, "audio.flac ends at 1.00 s, but the frames continue to 2.00 s;", "audio.flac", None, False),
    (lambda p: _replace_line(p / "recording.json", 1, '{"schema_version": 9}'),
     "recording.json has schema version 9; this avlmaps reads version 1: update", "recording.json", None, True),
]  # fmt: skip


@pytest.mark.parametrize(("damage", "sentence", "file", "line", "fatal"), FAULTS)
def test_each_fault_is_named_with_its_file_and_line(
    tmp_path: Path, damage: Callable[[Path], object], sentence: str, file: str, line: int | None, fatal: bool
):
    path = write_folder(tmp_path / "walk")
    damage(path)
    found = [fault for fault in validate(path) if sentence in str(fault)]
    assert len(found) == 1, [str(fault) for fault in validate(path)]
    assert found[0].file == path / file and found[0].line == line and found[0].fatal == fatal
    assert str(path / file) in str(found[0])
    if fatal:
        with pytest.raises(RecordingError):
            open_recording(path)
    else:
        assert len(open_recording(path)) >= 4


def test_a_sound_recording_has_no_fault(tmp_path: Path):
    assert validate(write_folder(tmp_path / "walk")) == []
    assert validate(write_seven_scenes(tmp_path / "scene")) == []


def test_all_faults_are_named_at_once(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    _list_frames(path)
    _cut(path / "rgb/000000.png")
    _cut(path / "depth/000000.png")
    (path / "depth/000001.png").unlink()
    _replace_line(path / "poses.csv", 5, "0.3,0,0,0,0,0,0,7")
    _replace_line(path / "poses.csv", 6, "0.4,0,0,zero,0,0,0,1")
    sentences = [str(fault) for fault in validate(path)]
    assert len(sentences) == 5
    for part in ("rgb/000000.png", "depth/000000.png", "depth/000001.png", "poses.csv, line 5", "poses.csv, line 6"):
        assert sum(part in sentence for sentence in sentences) == 1


def test_every_bad_pose_of_a_sequence_is_named_by_its_file(tmp_path: Path):
    path = write_seven_scenes(tmp_path / "scene")
    np.savetxt(path / "frame-000002.pose.txt", np.diag([1.0, 1.0, -1.0, 1.0]))
    np.savetxt(path / "frame-000006.pose.txt", np.diag([3.0, 1.0, 1.0, 1.0]))
    (path / "frame-000008.pose.txt").write_text("nan " * 16)
    faults = validate(path)
    assert [fault.file.name for fault in faults if fault.file] == [
        "frame-000008.pose.txt",
        "frame-000002.pose.txt",
        "frame-000006.pose.txt",
    ]
    assert [fault.fatal for fault in faults] == [False, True, True]


def test_a_file_without_rights_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path, denied = write_folder(tmp_path / "walk"), PermissionError(13, "Permission denied")
    monkeypatch.setattr("avlmaps.recordings.layout.read_regular", Mock(side_effect=denied))
    with pytest.raises(RecordingError, match=r"recording\.json cannot be read \(Permission denied\); check the file"):
        open_recording(path)


def test_faults_of_one_kind_are_counted(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    for name in range(5):
        _cut(path / f"depth/{name:06d}.png")
    lines = counted([str(fault) for fault in validate(path)])
    assert len(lines) == 4 and "000002.png is truncated" in lines[2] and lines[3] == "and 2 more like it"


def test_without_decoding_a_cut_picture_is_found_all_the_same(tmp_path: Path):
    path = write_folder(tmp_path / "walk")
    _cut(path / "depth/000002.png")
    save_depth(path / "depth/000003.png", np.zeros((48, 64)))
    assert [fault.file for fault in validate(path, max_decoded=0)] == [path / "depth/000002.png"]


def test_what_is_no_recording_is_one_fault(tmp_path: Path):
    faults = validate(tmp_path / "gone")
    assert len(faults) == 1 and faults[0].fatal and "There is nothing at" in str(faults[0])


def test_the_red_kitchen_has_no_fault(shared_data: Path):
    assert validate(shared_data / "data/redkitchen", max_decoded=5) == []
