"""Bags of both ROSes and MCAP open in place: topics by type, poses by /tf or odometry, sound, and plain sentences."""

import gc
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
import soundfile
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import from_quaternion, inverse
from avlmaps.recordings.audio import Sound, write_flac
from avlmaps.recordings.formats.ros_messages import camera_of, depth_of
from avlmaps.recordings.formats.rosbag import open_rosbag
from avlmaps.recordings.open import open_recording

WIDTH, HEIGHT, RATE_HZ = 32, 24, 8000
BODY_FROM_CAMERA = np.array([[0.0, 0, 1, 0.1], [-1, 0, 0, 0.0], [0, -1, 0, 0.9], [0, 0, 0, 1]])
START_S = 1000.0


class BagMaker:
    """Writes one second of a robot that drives along x, in any of the three containers."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.kind, self.is2 = kind, kind != "ros1"
        self.store = get_typestore(Stores.ROS2_HUMBLE if self.is2 else Stores.ROS1_NOETIC)
        audio = {
            **get_types_from_msg("uint8[] data", "audio_common_msgs/msg/AudioData"),
            **get_types_from_msg(
                "uint8 channels\nuint32 sample_rate\nstring sample_format\nuint32 bitrate\nstring coding_format",
                "audio_common_msgs/msg/AudioInfo",
            ),
        }
        if not self.is2:  # ROS 1's store leaves tf2 out
            audio |= get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
        self.store.register(audio)
        self.path = folder / ("walk.bag" if kind == "ros1" else "walk")
        if self.is2:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(self.path, version=9, storage_plugin=plugin)
        else:
            self.writer = Writer1(self.path)
        self.connections: dict[str, object] = {}

    def t(self, name: str, *arguments):
        return self.store.types[name](*arguments)

    def header(self, stamp_s: float, frame: str):
        stamp = self.t("builtin_interfaces/msg/Time", int(stamp_s), round(stamp_s % 1 * 1e9))
        sequence = () if self.is2 else (0,)
        return self.t("std_msgs/msg/Header", *sequence, stamp, frame)

    def write(self, topic: str, message, stamp_s: float) -> None:
        kind = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        raw = self.store.serialize_cdr(message, kind) if self.is2 else self.store.serialize_ros1(message, kind)
        self.writer.write(self.connections[topic], round(stamp_s * 1e9) + 2_000_000, raw)

    def image(self, topic: str, stamp_s: float, pixels: np.ndarray, encoding: str, frame: str) -> None:
        flat = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
        step = pixels.shape[1] * pixels.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
        head = self.header(stamp_s, frame)
        self.write(topic, self.t("sensor_msgs/msg/Image", head, HEIGHT, WIDTH, encoding, 0, step, flat), stamp_s)

    def camera_info(self, topic: str, stamp_s: float) -> None:
        k = np.array([30.0, 0, 15.5, 0, 30.0, 11.5, 0, 0, 1])
        roi = self.t("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
        head = self.header(stamp_s, "camera_optical")
        d, r, p = np.zeros(5), np.eye(3).reshape(-1), np.zeros(12)
        info = self.t("sensor_msgs/msg/CameraInfo", head, HEIGHT, WIDTH, "plumb_bob", d, k, r, p, 0, 0, roi)
        self.write(topic, info, stamp_s)

    def pose(self, world_from_body: np.ndarray):
        x, y, z = world_from_body[:3, 3]
        from avlmaps.core.poses import to_quaternion

        q = to_quaternion(world_from_body)
        return (x, y, z), self.t("geometry_msgs/msg/Quaternion", *q)

    def tf(self, topic: str, stamp_s: float, parent: str, child: str, parent_from_child: np.ndarray) -> None:
        xyz, rotation = self.pose(parent_from_child)
        transform = self.t("geometry_msgs/msg/Transform", self.t("geometry_msgs/msg/Vector3", *xyz), rotation)
        stamped = self.t("geometry_msgs/msg/TransformStamped", self.header(stamp_s, parent), child, transform)
        self.write(topic, self.t("tf2_msgs/msg/TFMessage", [stamped]), stamp_s)

    def odometry(self, stamp_s: float, parent: str, child: str, parent_from_child: np.ndarray) -> None:
        xyz, rotation = self.pose(parent_from_child)
        pose = self.t("geometry_msgs/msg/Pose", self.t("geometry_msgs/msg/Point", *xyz), rotation)
        with_covariance = self.t("geometry_msgs/msg/PoseWithCovariance", pose, np.zeros(36))
        zero = self.t("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
        twist = self.t(
            "geometry_msgs/msg/TwistWithCovariance", self.t("geometry_msgs/msg/Twist", zero, zero), np.zeros(36)
        )
        head = self.header(stamp_s, parent)
        self.write("/odom", self.t("nav_msgs/msg/Odometry", head, child, with_covariance, twist), stamp_s)


def world_from_body(stamp_s: float) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 3] = stamp_s - START_S
    return pose


def write_bag(
    folder: Path,
    kind: str,
    poses: str = "tf",
    sound: bool = False,
    depth: bool = True,
    depth_info: bool = True,
    colour_topic: str = "/camera/color/image_raw",
    more: Callable[[BagMaker], None] = lambda maker: None,
) -> Path:
    maker = BagMaker(kind, folder)
    with maker.writer:
        if poses != "odometry without mount":
            maker.tf("/tf_static", START_S, "base_link", "camera_optical", BODY_FROM_CAMERA)
        for i in range(11):  # poses at 10 Hz, images at 5 Hz in between
            stamp_s = START_S + i * 0.1
            if poses == "tf":
                maker.tf("/tf", stamp_s, "map", "base_link", world_from_body(stamp_s))
            elif poses.startswith("odometry"):
                maker.odometry(stamp_s, "odom", "base_link", world_from_body(stamp_s))
        for i in range(5):
            stamp_s = START_S + 0.05 + i * 0.2
            rgb = np.full((HEIGHT, WIDTH, 3), (10 * i, 100, 200), np.uint8)
            millimetres = np.full((HEIGHT, WIDTH), 1000 + i, np.uint16)
            maker.camera_info("/camera/color/camera_info", stamp_s)
            if depth_info:
                maker.camera_info("/camera/depth/camera_info", stamp_s)
            maker.image(colour_topic, stamp_s + 0.004, rgb, "rgb8", "camera_optical")
            if depth:
                maker.image("/camera/depth/image_raw", stamp_s, millimetres, "16UC1", "camera_optical")
        if sound:
            info = maker.t("audio_common_msgs/msg/AudioInfo", 1, RATE_HZ, "S16LE", 0, "wave")
            maker.write("/audio/audio_info", info, START_S)
            tone = (8000 * np.sin(np.arange(RATE_HZ) * 0.3)).astype("<i2").view(np.uint8)
            for piece in range(10):
                part = tone[piece * len(tone) // 10 : (piece + 1) * len(tone) // 10]
                maker.write("/audio/audio", maker.t("audio_common_msgs/msg/AudioData", part), START_S + piece * 0.1)
        more(maker)
    return maker.path


def test_a_bag_knows_how_far_the_robots_base_lies_below_the_camera(tmp_path: Path) -> None:
    recording = open_recording(write_bag(tmp_path, "mcap"))
    base = recording.base_height
    assert base is not None and not base.on_floor
    assert base.below_camera_m == pytest.approx(BODY_FROM_CAMERA[2, 3])
    assert recording.begins_s == pytest.approx(START_S, abs=1.0)


@pytest.mark.few(3)
@pytest.mark.parametrize("kind", ["ros1", "ros2", "mcap"])
@pytest.mark.parametrize("poses", ["tf", "odometry"])
def test_a_bag_opens_with_interpolated_poses_of_the_camera(tmp_path: Path, kind: str, poses: str) -> None:
    recording = open_rosbag(write_bag(tmp_path, kind, poses))
    assert len(recording) == 5
    assert recording.stamps_s == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8])
    expected = np.stack([world_from_body(START_S + 0.05 + s) @ BODY_FROM_CAMERA for s in recording.stamps_s])
    assert recording.world_from_camera == pytest.approx(expected, abs=1e-9)
    frame = recording.frame(3)
    assert frame.rgb[0, 0].tolist() == [30, 100, 200]
    assert frame.depth_m[5, 5] == pytest.approx(1.003)
    assert (recording.rig.rgb.fx, recording.rig.rgb.cx) == (30.0, 16.0)
    assert recording.up_in_world == pytest.approx((0.0, 0.0, 1.0))


def test_the_sound_of_a_bag_is_on_the_clock_of_its_frames(tmp_path: Path) -> None:
    recording = open_rosbag(write_bag(tmp_path, "ros2", sound=True))
    assert recording.audio is not None
    assert recording.audio.rate_hz == RATE_HZ
    assert recording.audio.duration_s == pytest.approx(1.0)
    assert recording.audio.start_s == pytest.approx(-0.05, abs=0.005)


def test_the_file_of_its_sound_goes_with_a_bag_and_warns_nobody(tmp_path: Path) -> None:
    recording = open_rosbag(write_bag(tmp_path, "ros2", sound=True))
    assert recording.audio is not None
    file = recording.audio.path
    gc.collect()  # what tests before this one left behind warns now
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ResourceWarning)
        assert file.is_file()
        del recording
        gc.collect()
    left = [str(one.message) for one in said if one.category is ResourceWarning and file.name in str(one.message)]
    assert not file.exists() and left == []


def test_a_topic_that_yaml_reads_as_a_number_is_a_sentence(tmp_path: Path) -> None:
    path = write_bag(tmp_path, "ros2")
    metadata = path / "metadata.yaml"
    text = metadata.read_text()
    assert "/camera/depth/camera_info" in text
    metadata.write_text(text.replace("/camera/depth/camera_info", "12"))
    with pytest.raises(RecordingError, match="reindex it"):
        open_rosbag(path)


def test_compressed_depth_is_undone() -> None:
    millimetres = np.arange(12, dtype=np.uint16).reshape(3, 4) * 500
    png = cv2.imencode(".png", millimetres)[1].tobytes()
    message = SimpleNamespace(
        __msgtype__="sensor_msgs/msg/CompressedImage",
        format="16UC1; compressedDepth png",
        data=np.frombuffer(b"\0" * 12 + png, np.uint8),
    )
    assert depth_of(message, "x") == pytest.approx(millimetres / 1000.0)


def test_a_static_chain_is_inverted_where_the_tree_asks() -> None:
    from avlmaps.recordings.formats.ros_transforms import TransformTree

    tree = TransformTree()
    base_from_a = from_quaternion(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.6, 0.8]))
    base_from_b = from_quaternion(np.array([-1.0, 0.5, 0.0]), np.array([0.6, 0.0, 0.0, 0.8]))
    tree.add("base", "a", base_from_a, 0.0, static=True)
    tree.add("base", "b", base_from_b, 0.0, static=True)
    assert tree.fixed("a", "b") == pytest.approx(inverse(base_from_a) @ base_from_b)
    assert tree.fixed("a", "elsewhere") is None


def test_topics_can_be_named_when_any_recording_is_opened(tmp_path: Path) -> None:
    path = write_bag(tmp_path, "ros2", poses="odometry")
    recording = open_recording(path, topics={"pose": "/odom", "depth": "/camera/depth/image_raw"})
    assert len(recording) == 5


def test_a_calibration_of_no_camera_is_refused() -> None:
    info = SimpleNamespace(k=[1e300, 0, 16, 0, 30, 12, 0, 0, 1], d=[], width=32, height=24)
    with pytest.raises(RecordingError, match=r"^The camera calibration /info is not a camera: .*; calibrate it again"):
        camera_of(info, "/info")


def test_registered_depth_without_a_calibration_takes_that_of_colour(tmp_path: Path) -> None:
    recording = open_rosbag(write_bag(tmp_path, "ros2", depth_info=False))
    assert recording.rig.depth == recording.rig.rgb
    assert any("that of /camera/color/image_raw is used" in notice for notice in recording.notices)


def _sound(maker: BagMaker, topic: str = "/audio/audio") -> None:
    tone = (8000 * np.sin(np.arange(RATE_HZ) * 0.3)).astype("<i2").view(np.uint8)
    for piece in range(10):
        part = tone[piece * len(tone) // 10 : (piece + 1) * len(tone) // 10]
        maker.write(topic, maker.t("audio_common_msgs/msg/AudioData", part), START_S + piece * 0.1)


def bag_with(folder: Path, kind: str, monkeypatch: pytest.MonkeyPatch, more, **settings) -> Path:
    """Write the usual bag and let ``more(maker)`` add messages to it."""
    camera_info, done = BagMaker.camera_info, []

    def first_then_more(self: BagMaker, topic: str, stamp_s: float) -> None:
        if not done:
            done.append(more(self))
        camera_info(self, topic, stamp_s)

    monkeypatch.setattr(BagMaker, "camera_info", first_then_more)
    return write_bag(folder, kind, **settings)


@pytest.mark.parametrize("kind", ["ros1", pytest.param("ros2", marks=pytest.mark.nightly)])
def test_plain_samples_without_audio_info_say_how_to_name_them(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = bag_with(tmp_path, kind, monkeypatch, _sound)
    with pytest.raises(
        RecordingError, match=r"has no AudioInfo and is not an MP3.*audio_pcm=8000,1.*audio=FILE.*audio=none"
    ):
        open_rosbag(path)
    recording = open_rosbag(path, {"audio_pcm": f"{RATE_HZ}"})
    audio = recording.audio
    assert audio is not None and audio.rate_hz == RATE_HZ and audio.duration_s == pytest.approx(1.0)
    assert np.abs(audio.read().samples).max() == pytest.approx(8000 / 32768, rel=0.02)
    assert open_rosbag(path, {"audio": "none"}).audio is None
    own = tmp_path / "own.flac"
    write_flac(own, Sound(np.full(16_000, 0.1, np.float32), 16_000))
    assert open_recording(path, audio=own).audio.path == own  # pyright: ignore[reportOptionalMemberAccess]
    for words in ("fast", "16000,x", "0", "16000,0"):
        with pytest.raises(RecordingError, match="audio_pcm"):
            open_rosbag(path, {"audio_pcm": words})


@pytest.mark.parametrize(
    ("kind", "declared", "said"),
    [
        ("FLAC", (2, 44_100, "", 0, "flac"), "says 44100 samples a second, the stream itself 16000"),
        ("OGG", (1, 16_000, "", 0, "mp3"), ""),
        ("WAV", (2, 44_100, "S16LE", 0, "wave"), "says 44100 samples a second, the stream itself 16000"),
        ("RAW", (1, 16_000, "S16LE", 0, "mp3"), r"no mp3 stream, .*audio_pcm=16000,1"),
        ("RAW", (1, 8_000, "S16LE", 0, "wave"), "does not agree with itself"),
    ],
)
def test_what_audio_info_declares_is_held_against_the_stream(
    tmp_path: Path, kind: str, declared: tuple[object, ...], said: str
) -> None:
    tone = 0.25 * np.sin(np.arange(16_000) * 0.2)
    soundfile.write(tmp_path / "tone", tone, 16_000, format=kind, subtype="VORBIS" if kind == "OGG" else "PCM_16")
    content = np.frombuffer((tmp_path / "tone").read_bytes(), np.uint8)

    def more(maker: BagMaker) -> None:
        maker.write("/audio/audio_info", maker.t("audio_common_msgs/msg/AudioInfo", *declared), START_S)
        for piece, part in enumerate(np.array_split(content, 10)):
            maker.write("/audio/audio", maker.t("audio_common_msgs/msg/AudioData", part), START_S + piece * 0.1)

    path = write_bag(tmp_path, "ros2", more=more)
    if kind == "RAW":
        with pytest.raises(RecordingError, match=said):
            open_rosbag(path)
        return
    recording = open_rosbag(path)
    assert recording.audio is not None and recording.audio.rate_hz == 16_000
    assert recording.audio.duration_s == pytest.approx(1.0, abs=0.02) and said in " ".join(recording.notices)


def test_the_samples_of_ros_2_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = "float32[] float32_data\nint32[] int32_data\nint16[] int16_data\nint8[] int8_data\nuint8[] uint8_data"
    name = "audio_common_msgs/msg/"
    types = {
        **get_types_from_msg(samples, name + "AudioData"),
        **get_types_from_msg("int16 format\nint16 channels\nint32 rate\nint32 chunk", name + "AudioInfo"),
        **get_types_from_msg(f"{name}AudioData audio_data\n{name}AudioInfo info", name + "Audio"),
        **get_types_from_msg(f"std_msgs/msg/Header header\n{name}Audio audio", name + "AudioStamped"),
    }
    rates = [RATE_HZ]

    def more(maker: BagMaker) -> None:
        store = get_typestore(Stores.ROS2_HUMBLE)
        store.register(types)
        maker.store = store
        none = {np.float32: 0, np.int32: 0, np.int8: 0, np.uint8: 0}
        tone = (8000 * np.sin(np.arange(RATE_HZ // 10) * 0.3)).astype(np.int16)
        f4, i4, i1, u1 = (np.zeros(0, kind) for kind in none)
        for piece in range(10):
            content = maker.t(name + "AudioData", f4, i4, tone, i1, u1)
            info = maker.t(name + "AudioInfo", 8, 1, rates[piece % len(rates)], 512)
            audio = maker.t(name + "Audio", content, info)
            stamp_s = START_S + piece * 0.1
            maker.write("/mic", maker.t(name + "AudioStamped", maker.header(stamp_s, "mic"), audio), stamp_s)

    (tmp_path / "one").mkdir()
    path = bag_with(tmp_path / "one", "ros2", monkeypatch, more)
    for topics in ({}, {"audio": "/mic"}):
        recording = open_rosbag(path, topics)
        audio = recording.audio
        assert audio is not None and audio.rate_hz == RATE_HZ and audio.duration_s == pytest.approx(1.0)
        assert np.abs(audio.read().samples).max() == pytest.approx(8000 / 32768, rel=0.02)
    monkeypatch.undo()
    for wrong, said in (([0], "says 0 samples a second"), ([RATE_HZ, 16_000], "changes from 8000 to 16000 samples")):
        rates[:] = wrong
        (tmp_path / str(len(wrong))).mkdir()
        with monkeypatch.context() as patch, pytest.raises(RecordingError, match=said):
            open_rosbag(bag_with(tmp_path / str(len(wrong)), "ros2", patch, more))


def test_a_cycle_of_transforms_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = bag_with(
        tmp_path,
        "ros2",
        monkeypatch,
        lambda maker: maker.tf("/tf", START_S, "base_link", "map", world_from_body(START_S)),
    )
    with pytest.raises(RecordingError, match=r"go round in a circle \(base_link -> map -> base_link\)"):
        open_rosbag(path)


def test_a_nan_in_tf_is_told_and_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = world_from_body(START_S)
    broken[0, 3] = np.nan
    path = bag_with(
        tmp_path, "ros2", monkeypatch, lambda maker: maker.tf("/tf", START_S + 0.05, "map", "base_link", broken)
    )
    recording = open_rosbag(path)
    assert "1 transform(s) from 'base_link' to 'map' are none (NaN, or no rotation) and left out." in recording.notices
    assert np.isfinite(recording.world_from_camera).all()


def test_poses_on_another_clock_name_both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tf = BagMaker.tf
    monkeypatch.setattr(
        BagMaker, "tf", lambda self, topic, stamp_s, *rest: tf(self, topic, stamp_s + 500 * (topic == "/tf"), *rest)
    )
    with pytest.raises(
        RecordingError, match=r"from 1000\.050 to .* s\); its poses go from 1500\.000 to 1501\.000 s, so check"
    ):
        open_rosbag(write_bag(tmp_path, "ros2"))


# What a bag lacks or what is named of it, and what is said.
REFUSED: list[tuple[dict[str, Any], dict[str, str], str]] = [
    ({"depth": False}, {}, r"no topic of depth images \(image topics: /camera/color/image_raw\)"),
    ({"colour_topic": "/camera/depth/second"}, {}, r"no topic of colour images .*; name it \(rgb=TOPIC\)"),
    ({"poses": "none"}, {}, "has no poses: no /tf that moves 'camera_optical', no odometry"),
    ({"poses": "odometry without mount"}, {}, "no static transform from there to the camera 'camera_optical'"),
    ({}, {"rgb": "/left/image"}, "has no image topic '/left/image'"),
    ({}, {"pose": "/camera/color/image_raw"}, "is of the type sensor_msgs/msg/Image, which holds no poses; name one"),
    ({}, {"audio": "/ear"}, r"has no sound topic '/ear' \(it has: none\); name one of them\.$"),
    ({}, {"lidar": "/scan"}, "no 'lidar' among the topics that can be named: rgb, depth, pose"),
]


@pytest.mark.parametrize(("settings", "topics", "said"), REFUSED)
def test_what_a_bag_lacks_is_said(tmp_path: Path, settings: dict[str, Any], topics: dict[str, str], said: str) -> None:
    with pytest.raises(RecordingError, match=said):
        open_rosbag(write_bag(tmp_path, "ros2", **settings), topics)
