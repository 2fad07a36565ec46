"""Directions that a device says: files of them read as written, topics of bags, and a sentence for each fault."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_rosbag import START_S, BagMaker, write_bag

from avlmaps.cli.build import Build, _openings
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import from_quaternion
from avlmaps.maps import hearing
from avlmaps.maps.plan import audio_key
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.microphones import DIRECTIONS, DirectionTrack, read_directions, write_directions
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from avlmaps_sim.mixing.add_sounds import write_recording

RIG = Rig(*(Pinhole(50.0, 50.0, 32.0, 24.0, 64, 48),) * 2)
TRACK = DirectionTrack.of([0.1, 0.2, 1.5], [0.5, -3.1, 6.2], np.array([0.1, np.nan, -0.2]), np.array([1.0, 0.5, 0.0]))


def recorded(folder: Path, audio: bool = True) -> Path:
    with RecordingWriter(folder, RIG, np.array([0.0, 0.0, 1.0])) as writer:
        for index in range(3):
            picture = np.full((48, 64, 3), 9 * index, np.uint8)
            depth_m = np.full((48, 64), 1.0, np.float32)
            writer.add(Frame(index, f"{index}", index * 1.0, picture, depth_m, np.eye(4), RIG))
        if audio:
            writer.set_audio(Sound((0.1 * np.random.default_rng(0).standard_normal(32_000)).astype(np.float32), 16_000))
    return folder


def same(one: DirectionTrack, other: DirectionTrack) -> bool:
    names = ("stamp_s", "azimuth_rad", "elevation_rad", "confidence")
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in names)


@pytest.mark.parametrize("track", [TRACK, DirectionTrack.of([0.0, 0.5], [1.0, 2.0]), DirectionTrack.of([], [])])
def test_a_track_is_read_as_it_was_written(track: DirectionTrack, tmp_path: Path) -> None:
    write_directions(tmp_path / DIRECTIONS, track)
    assert same(read_directions(tmp_path / DIRECTIONS), track)


def test_a_recording_has_its_directions_and_a_copy_too(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "rec")
    plain = audio_key(open_recording(folder))
    write_directions(folder / DIRECTIONS, TRACK)
    for path in (folder, write_recording(open_recording(folder), tmp_path / "copy")):
        audio = open_recording(path).audio
        assert audio is not None and audio.directions is not None and same(audio.directions, TRACK)
    assert audio_key(open_recording(folder)) != plain, "another map is made of it"
    assert len(TRACK.between(0.15, 1.0)) == 1


def test_what_opens_a_recording_on_another_machine_knows_its_device(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = recorded(tmp_path / "rec")
    write_directions(folder / DIRECTIONS, TRACK)
    earlier = SimpleNamespace(sources=SimpleNamespace(device=np.array([[0.5, 0.1, 0.0, 3.0]])))
    monkeypatch.setattr(hearing, "read", lambda path: earlier)
    (opened,) = _openings(Build(recording=folder, out=tmp_path / "map", same_device=tmp_path / "earlier"))
    audio = opened().audio
    assert audio is not None and audio.directions is not None and audio.directions.known_rad == (0.5, 0.1)
    assert audio_key(opened()) != audio_key(open_recording(folder)), "another map is made of it"


def test_directions_without_a_sound_are_left_out_with_a_notice(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "rec", audio=False)
    write_directions(folder / DIRECTIONS, TRACK)
    recording = open_recording(folder)
    assert recording.audio is None and any(DIRECTIONS in notice for notice in recording.notices)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("stamp_s,azimuth_rad\n0,0.1\n0,0.2\n", "stamp of row 2 is 0, not after the one before; stamps must rise"),
        ("stamp_s,azimuth_rad\n1,0.1\n0.5,0.2\n", "stamps must rise"),
        ("stamp_s,azimuth_rad\n0,nan\n", "azimuth of row 1 is nan, which is NaN"),
        ("stamp_s,azimuth_rad\ninf,0\n", "stamp of row 1 is inf, which is NaN or infinite"),
        ("stamp_s,azimuth_rad\n0,1\n1,270\n", "azimuth of row 2 is 270, .* look like degrees"),
        ("stamp_s,azimuth_rad,elevation_rad\n0,1,30\n", "elevation of row 1 is 30, .* look like degrees"),
        ("stamp_s,azimuth_rad,confidence\n0,1,1.5\n", "confidence of row 1 is 1.5, and it must be from 0 to 1"),
        ("stamp_s,azimuth_rad\n0,x\n", "row 1: '0,x' is not 2 numbers"),
        ("stamp_s,azimuth_rad\n0.7\n", "row 1: '0.7' is not 2 numbers"),
        ("stamp_s,azimuth_rad\n0,1,2\n", "row 1: '0,1,2' is not 2 numbers"),
        ("time,azimuth\n0,1\n", "first line names the columns"),
        ("stamp_s,azimuth_deg\n0,1\n", "first line names the columns"),
        ("", "first line names the columns"),
        ("stamp_s,azimuth_rad\n500,1\n501,1\n", "2 of 2 stamps, from 500.00 to 501.00 s, lie outside of the sound"),
    ],
)
def test_each_fault_is_a_sentence(content: str, said: str, tmp_path: Path) -> None:
    folder = recorded(tmp_path / "rec")
    (folder / DIRECTIONS).write_text(content)
    with pytest.raises(RecordingError, match=rf"directions\.csv.*{said}"):
        open_recording(folder)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / DIRECTIONS).write_bytes(b"stamp_s,azimuth_rad\n\xff\xfe,1\n")
    with pytest.raises(RecordingError, match="not UTF-8"):
        read_directions(tmp_path / DIRECTIONS)


def add_directions(maker: BagMaker) -> None:
    """Write the angles 10, 20, ... 90 degrees as numbers and as poses."""
    for step in range(1, 10):
        at_s, angle = START_S + 0.1 * step, 10.0 * step
        maker.write("/doa", maker.t("std_msgs/msg/Int32", round(angle)), at_s)
        maker.write("/doa_rad", maker.t("std_msgs/msg/Float32", float(np.deg2rad(angle))), at_s)
        maker.write("/doa_deg", maker.t("std_msgs/msg/Float32", angle), at_s)
        half = np.deg2rad(angle) / 2.0
        turned = from_quaternion(np.zeros(3), np.array([0.0, 0.0, np.sin(half), np.cos(half)]))
        away = np.eye(4)
        away[:2, 3] = np.cos(2 * half), np.sin(2 * half)
        for topic, pose in (("/doa_pose", turned), ("/doa_place", away)):
            xyz, rotation = maker.pose(pose)
            own = maker.t("geometry_msgs/msg/Pose", maker.t("geometry_msgs/msg/Point", *map(float, xyz)), rotation)
            maker.write(topic, maker.t("geometry_msgs/msg/PoseStamped", maker.header(at_s, "array"), own), at_s)


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_a_topic_of_a_bag_gives_directions(kind: str, tmp_path: Path) -> None:
    path = write_bag(tmp_path, kind, sound=True, more=add_directions)
    for topic in ("/doa", "/doa_rad", "/doa_deg", "/doa_pose", "/doa_place"):
        recording = open_recording(path, topics={"directions": topic})
        assert recording.audio is not None and recording.audio.directions is not None
        found = recording.audio.directions
        assert np.allclose(np.rad2deg(found.azimuth_rad), np.arange(10.0, 91.0, 10.0), atol=0.01)
        assert np.allclose(np.diff(found.stamp_s), 0.1, atol=1e-3) and abs(found.stamp_s[0] - 0.05) < 0.02
        assert recording.topics["directions"] == topic
        assert any("degrees" in notice for notice in recording.notices) == (topic in ("/doa", "/doa_deg"))


def test_topics_that_give_no_directions_are_refused(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "one", "mcap", sound=True, more=add_directions)
    with pytest.raises(RecordingError, match=r"no topic '/nowhere' of directions .*/doa"):
        open_recording(path, topics={"directions": "/nowhere"})
    silent = write_bag(tmp_path / "two", "mcap", more=add_directions)
    with pytest.raises(RecordingError, match="has no sound"):
        open_recording(silent, topics={"directions": "/doa"})
    audio = open_recording(path).audio
    assert audio is not None and audio.directions is None, "a topic of numbers may be anything"
