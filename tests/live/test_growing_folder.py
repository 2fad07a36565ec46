"""A recording that is being written is followed, frame by frame, until it is finished or its writer stops."""

import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from live_frames import ENCODERS, UP, frame

import avlmaps
from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.live import growing_folder
from avlmaps.live.growing_folder import growing_frames, is_being_written
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import follow
from avlmaps.recordings.layout import FRAMES, POSES, UNFINISHED


def test_what_is_followed_is_what_is_recorded(tmp_path: Path) -> None:
    begun = threading.Event()

    def write() -> None:
        with avlmaps.RecordingWriter(tmp_path / "rec", frame(0).rig, np.array(UP)) as writer:
            for number in range(12):
                writer.add(frame(number))
                begun.set()
                time.sleep(0.02)

    thread = threading.Thread(target=write)
    thread.start()
    assert begun.wait(30.0)
    was_unfinished = is_being_written(tmp_path / "rec")
    came = list(growing_frames(tmp_path / "rec"))
    thread.join()
    recording = avlmaps.open_recording(tmp_path / "rec")
    assert was_unfinished and not is_being_written(tmp_path / "rec")
    assert [one.stamp_s for one in came] == recording.stamps_s.tolist()
    for one, other in zip(came, recording, strict=True):
        np.testing.assert_array_equal(one.rgb, other.rgb)
        np.testing.assert_array_equal(one.depth_m, other.depth_m)
        np.testing.assert_allclose(one.world_from_camera, other.world_from_camera, atol=1e-12)


def test_poses_at_their_own_rate_replace_those_of_frames_behind_a_follower(tmp_path: Path) -> None:
    poses = np.stack([frame(number).world_from_camera for number in range(12)])
    poses[:, :3, 3] += 1.0 / 3.0
    dense = Trajectory(np.arange(12) / 7.0, poses)
    writer = avlmaps.RecordingWriter(tmp_path / "rec", frame(0).rig, np.array(UP), trajectory=dense)
    with writer:
        for number in range(3):
            writer.add(frame(number))
        followed = growing_frames(tmp_path / "rec", give_up_s=30.0)
        came = [next(followed) for _ in range(3)]
    assert len((tmp_path / "rec" / POSES).read_text().splitlines()) == 13
    assert len(came) == 3 and not list(followed)


def test_a_writer_that_stalls_or_stops_is_said_and_what_came_is_mapped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(growing_folder, "STALLED_S", 0.1)
    writer = avlmaps.RecordingWriter(tmp_path / "rec", frame(0).rig, np.array(UP))
    writer.__enter__()
    for number in range(4):
        writer.add(frame(number))
    with (tmp_path / "rec" / FRAMES).open("a", encoding="utf-8") as stream:
        stream.write("ghost,0.35\n000009,0.9")  # a frame without a pose, and a line that is not whole
    said: list[str] = []
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=avlmaps.LiveSettings(gates=False)) as live:
        follow(tmp_path / "rec", live, give_up_s=0.5, tell=said.append)
    assert len(said) == 3 and "ghost of" in said[0] and "has no pose" in said[0]
    assert "waiting up to" in said[1] and "its writer seems to have stopped" in said[2]
    assert live.status().frames_in == 4
    (tmp_path / "rec" / UNFINISHED).write_text("A recording is being written here.\n")
    with pytest.raises(RecordingError, match="is not JSON"):
        next(growing_frames(tmp_path / "rec"))
    writer.add(replace(frame(5), name="later"))


@pytest.mark.parametrize(
    ("table", "row"),
    [
        (FRAMES, b"000003"),
        (FRAMES, b"000003,soon"),
        (POSES, b"0.3,1,2"),
        (POSES, b"0.3,0,0,0,0,0,0,0"),
        (POSES, b"\xff\xfe"),
    ],
)
def test_a_damaged_row_is_one_sentence(tmp_path: Path, table: str, row: bytes) -> None:
    writer = avlmaps.RecordingWriter(tmp_path / "rec", frame(0).rig, np.array(UP))
    writer.__enter__()
    for number in range(3):
        writer.add(frame(number))
    with (tmp_path / "rec" / table).open("ab") as stream:
        stream.write(row + b"\n")
    with pytest.raises(RecordingError, match=r"holds a row that is none .* damaged"):
        list(growing_frames(tmp_path / "rec", give_up_s=0.2))
