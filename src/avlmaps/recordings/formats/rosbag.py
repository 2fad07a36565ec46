"""ROS 1 bags, ROS 2 bags and MCAP files, read in place through `rosbags`; no ROS is needed.

Topics are found by type, or named: ``{"rgb": "/camera/color/image_raw", "pose": "/odom"}``. The pose of the
depth camera comes from /tf where the tree reaches from the camera to a world that it moves in, else from odometry
or a pose topic together with the static transforms from the body to the camera. World: the tree's root (``map``,
``odom``), which by ROS's own convention (REP 103) has z up.
"""

import hashlib
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import associate, gap_notices, in_order
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.content import add_files, stamp_of
from avlmaps.recordings.formats.bag_files import Bag, check_files
from avlmaps.recordings.formats.ros_audio import STAMPED, Pcm, extract_audio
from avlmaps.recordings.formats.ros_messages import camera_of, colour_of, depth_of, pose_of
from avlmaps.recordings.formats.ros_transforms import TransformTree
from avlmaps.recordings.plausible import plausible_walk
from avlmaps.recordings.types import BaseHeight, Frame, Recording

_IMAGE_TYPES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_INFO_TYPES = ("sensor_msgs/msg/CameraInfo",)
_POSE_TYPES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/PoseStamped",
)
_TRANSFORM_TYPE = "geometry_msgs/msg/TransformStamped"
_AUDIO_INFO_TYPES = ("audio_common_msgs/msg/AudioInfo",)
_AUDIO_TYPES = ("audio_common_msgs/msg/AudioData", "audio_common_msgs/msg/AudioDataStamped", STAMPED)
# A colour and a depth picture at most this far apart are taken for one moment.
PAIRING_TOLERANCE_S = 0.05


@dataclass(frozen=True, slots=True)
class RosTopics:
    """Topics by name; empty ones are found by type.

    Attributes:
        rgb: colour images (raw or compressed).
        depth: depth images (raw or compressedDepth).
        pose: odometry, or poses of the camera or the body; empty: /tf first.
        audio: audio data; ``none`` leaves the sound out.
        audio_pcm: no topic: ``16000,1`` says that audio data are plain 16-bit samples, 16,000 a second, in one channel.
    """

    rgb: str = ""
    depth: str = ""
    pose: str = ""
    audio: str = ""
    audio_pcm: str = ""


def open_rosbag(path: Path, topics: Mapping[str, str] | None = None) -> "RosbagRecording":
    """Open a ROS 1 ``.bag``, a ROS 2 bag's folder, an ``.mcap`` or a ``.db3`` file.

    Args:
        path: the file or folder.
        topics: names by what they are for, see ``RosTopics``; the others are found by type.

    Raises:
        RecordingError: it cannot be read, has no depth or colour images, no calibration or no poses.
    """
    known = [f.name for f in fields(RosTopics)]
    for name in topics or {}:
        if name not in known:
            raise RecordingError(f"There is no {name!r} among the topics that can be named: {', '.join(known)}.")
    return RosbagRecording(Path(path), RosTopics(**(topics or {})))


class RosbagRecording(Recording):
    """See the module's docstring."""

    format = "rosbag"

    def __init__(self, path: Path, topics: RosTopics) -> None:
        check_files(path)
        self.path = path
        self._bag = Bag(path)
        self._rgb_topic, self._depth_topic = _image_topics(self._bag, topics)
        tree = TransformTree()
        _add_tf(self._bag, "/tf_static", tree)
        self.rig, rig_notices, camera_frame = _read_rig(self._bag, self._rgb_topic, self._depth_topic, tree)
        rgb_s, rgb_ns = self._bag.stamps(self._rgb_topic)
        depth_s, depth_ns = self._bag.stamps(self._depth_topic)
        rgb_order, depth_order = in_order(rgb_s, "colour images"), in_order(depth_s, "depth images")
        rgb, depth = rgb_order.index, depth_order.index
        a, b = associate(depth_s[depth], rgb_s[rgb], PAIRING_TOLERANCE_S)
        notices = [*rig_notices, *rgb_order.notices, *depth_order.notices]
        if len(a) < len(depth):
            notices.append(f"{len(depth) - len(a)} of {len(depth)} depth images have no colour image within 50 ms.")
        stamps_s = depth_s[depth][a]
        pose_topic = _add_motion(self._bag, topics, camera_frame, tree)
        self.topics = {"rgb": self._rgb_topic, "depth": self._depth_topic, "pose": pose_topic}
        if cycle := tree.cycle(camera_frame):
            raise RecordingError(
                f"The transforms of {path} go round in a circle ({cycle}), so that the camera {camera_frame!r} is "
                "nowhere; record /tf with one parent for each frame, or name odometry (pose=/odom)."
            )
        poses, known = tree.root_from(camera_frame, stamps_s)
        if not known.any():
            raise RecordingError(_no_pose(path, camera_frame, stamps_s, tree))
        if not known.all():
            notices.append(
                f"{int((~known).sum())} of {len(known)} frames lie outside of the known poses and are left out."
            )
        rows = np.flatnonzero(known)
        walk = plausible_walk(stamps_s[rows], poses[rows, :3, 3], [f"{i:06d}" for i in range(len(rows))])
        if walk.fault:
            raise RecordingError(f"{path}: {walk.fault}")
        rows = rows[walk.index]
        notices += [*tree.notices, *walk.notices]
        self._start_s = float(stamps_s[rows[0]])
        self.stamps_s = stamps_s[rows] - self._start_s
        self.world_from_camera = poses[rows]
        self._rgb_at = [(int(rgb_ns[rgb[i]]), float(rgb_s[rgb[i]])) for i in b[rows]]
        self._depth_at = [(int(depth_ns[depth[i]]), float(depth_s[depth[i]])) for i in a[rows]]
        self.up_in_world = np.array([0.0, 0.0, 1.0])
        self.base_height = _base_height(tree, camera_frame, float(stamps_s[rows[0]]))
        self.audio, audio_notices = self._read_audio(topics)
        self.notices = (*notices, *gap_notices(self.stamps_s, "frames"), *audio_notices)

    def frame(self, index: int) -> Frame:
        """Read one frame."""
        received_ns, stamp_s = self._rgb_at[index]
        name = f"{self._rgb_topic} at {stamp_s:.3f} s"
        rgb = colour_of(self._bag.message_at(self._rgb_topic, received_ns, stamp_s), name, self.rig.rgb)
        received_ns, stamp_s = self._depth_at[index]
        name = f"{self._depth_topic} at {stamp_s:.3f} s"
        depth_m = depth_of(self._bag.message_at(self._depth_topic, received_ns, stamp_s), name, self.rig.depth)
        for picture, camera in ((rgb, self.rig.rgb), (depth_m, self.rig.depth)):
            if picture.shape[:2] != (camera.height, camera.width):
                raise RecordingError(
                    f"The picture {name} is {picture.shape[1]}x{picture.shape[0]}; "
                    f"its calibration says {camera.width}x{camera.height}."
                )
        return Frame(
            index, f"{index:06d}", float(self.stamps_s[index]), rgb, depth_m, self.world_from_camera[index], self.rig
        )

    @cached_property
    def fingerprint(self) -> str:
        """See ``Recording.fingerprint``."""
        digest = hashlib.sha256()
        for file in self._files():
            add_files(digest, file.parent, [file.name])
        digest.update(self.stamps_s.tobytes() + self.world_from_camera.tobytes() + repr(self.rig).encode())
        return digest.hexdigest()

    @property
    def stored_depth_unit_m(self) -> float:
        """Metres of one unit of the depth messages: 1 for floats, which are metres (REP 118), else a millimetre."""
        received_ns, stamp_s = self._depth_at[0]
        message = self._bag.message_at(self._depth_topic, received_ns, stamp_s)
        encoding = getattr(message, "encoding", None) or getattr(message, "format", "")
        return 1.0 if encoding.startswith("32F") else 1.0 / self.depth_units_per_m

    def change_stamp(self) -> str:
        """See ``Recording.change_stamp``."""
        return stamp_of(self.path.parent, (), self._files())

    def _files(self) -> list[Path]:
        return sorted(file for file in self.path.rglob("*") if file.is_file()) if self.path.is_dir() else [self.path]

    def _read_audio(self, topics: RosTopics) -> tuple[AudioTrack | None, tuple[str, ...]]:
        pcm = Pcm.parse_rate(topics.audio_pcm) if topics.audio_pcm else None
        known = self._bag.topics_of(_AUDIO_TYPES)
        found = [topics.audio] if topics.audio else known
        if not found or topics.audio == "none":
            return None, ()
        if found[0] not in known:
            has = ", ".join(known) or "none"
            raise RecordingError(f"{self.path} has no sound topic {found[0]!r} (it has: {has}); name one of them.")
        self.topics = {**self.topics, "audio": found[0]}
        # The bag's sound goes to a file of its own for as long as this recording is open: a track is read by pieces.
        self._folder = tempfile.TemporaryDirectory(prefix="avlmaps-rosbag-")
        infos = self._bag.topics_of(_AUDIO_INFO_TYPES)
        info = next((message for topic in infos for _, message in self._bag.messages(topic)), None)
        folder = Path(self._folder.name)
        return extract_audio(self._bag.messages(found[0]), info, found[0], folder, self._start_s, pcm)


def _no_pose(path: Path, camera_frame: str, stamps_s: np.ndarray, tree: TransformTree) -> str:
    span = tree.span_s(camera_frame)
    when = f" (they go from {stamps_s[0]:.3f} to {stamps_s[-1]:.3f} s)" if len(stamps_s) else ""
    poses = f"; its poses go from {span[0]:.3f} to {span[1]:.3f} s, so check that both use one clock" if span else ""
    return (
        f"{path} has no pose of its camera frame {camera_frame!r} at the time of any of its {len(stamps_s)} "
        f"images{when}{poses}; record /tf, /tf_static or odometry, or name the topic (pose=/odom)."
    )


def _base_height(tree: TransformTree, camera_frame: str, stamp_s: float) -> BaseHeight | None:
    """Return how far the robot's base lies below the camera; by REP 120 ``base_footprint`` lies on the floor."""
    at_s = np.array([stamp_s])
    camera, _ = tree.root_from(camera_frame, at_s)
    for name, on_floor in (("base_footprint", True), ("base_link", False)):
        if tree.root(name) != tree.root(camera_frame):  # the bag has no such frame, or not in this tree
            continue
        base, known = tree.root_from(name, at_s)
        below_m = float(camera[0, 2, 3] - base[0, 2, 3])
        if known[0] and below_m > 0.0:
            return BaseHeight(below_m, on_floor)
    return None


def _image_topics(bag: Bag, topics: RosTopics) -> tuple[str, str]:
    images = bag.topics_of(_IMAGE_TYPES)
    every = ", ".join(images) or "none"
    for topic in (topics.rgb, topics.depth):
        if topic and topic not in images:
            raise RecordingError(f"{bag.path} has no image topic {topic!r}; its image topics are: {every}.")
    depth = topics.depth or _pick([t for t in images if "depth" in t.lower()], ("align", "registered"))
    rgb = topics.rgb or _pick(
        [t for t in images if t != depth and "depth" not in t.lower()], ("color", "rgb", "colour")
    )
    if not depth or not rgb:
        missing, name = ("depth", "depth") if not depth else ("colour", "rgb")
        raise RecordingError(
            f"{bag.path} has no topic of {missing} images (image topics: {every}); name it ({name}=TOPIC)."
        )
    return rgb, depth


def _pick(candidates: list[str], better: tuple[str, ...]) -> str:
    """Return the topic that speaks most for itself, raw before compressed (the order of the list)."""
    likely = [topic for topic in candidates if any(word in topic.lower() for word in better)]
    return next(iter(likely or candidates), "")


def _read_rig(bag: Bag, rgb_topic: str, depth_topic: str, mounts: TransformTree) -> tuple[Rig, list[str], str]:
    """Return the cameras, the notices about them, and the depth camera's frame; ``mounts`` links the two."""
    cameras: dict[str, Any] = {}
    notices: list[str] = []
    frames: dict[str, str] = {}
    for topic in (rgb_topic, depth_topic):
        info_topic = _info_topic(bag, topic)
        if not info_topic and topic == depth_topic:  # drivers that register depth often publish one calibration
            info_topic = _info_topic(bag, rgb_topic)
            notices.append(f"{depth_topic} has no CameraInfo; that of {rgb_topic} is used, as for registered depth.")
        if not info_topic:
            has = ", ".join(bag.topics_of(_INFO_TYPES)) or "none"
            raise RecordingError(f"{bag.path} has no CameraInfo beside {topic} (it has: {has}); record it too.")
        first = next(iter(bag.messages(info_topic)), None)
        if first is None:
            raise RecordingError(f"{bag.path} has no message on {info_topic}, the calibration of {topic}.")
        cameras[topic], distorted = camera_of(first[1], info_topic)
        if distorted:
            notices.append(
                f"{topic} has lens distortion, which a pinhole leaves out; rectified images make a better map."
            )
        image = next(iter(bag.messages(topic)), None)
        frames[topic] = (image[1] if image else first[1]).header.frame_id
    rgb_from_depth = mounts.fixed(frames[rgb_topic], frames[depth_topic])
    if rgb_from_depth is None:
        rgb_from_depth = np.eye(4)
        notices.append(
            f"No static transform links {frames[rgb_topic]} and {frames[depth_topic]}; they are taken for one place."
        )
    return Rig(cameras[rgb_topic], cameras[depth_topic], rgb_from_depth), notices, frames[depth_topic]


def _info_topic(bag: Bag, image_topic: str) -> str:
    """Return the calibration published beside an image topic, or nothing."""
    infos = bag.topics_of(_INFO_TYPES)
    parts = image_topic.split("/")
    for length in range(len(parts) - 1, 0, -1):
        beside = "/".join([*parts[:length], "camera_info"])
        if beside in infos:
            return beside
    return ""


def _add_tf(bag: Bag, topic: str, tree: TransformTree) -> None:
    for _, message in bag.messages(topic):
        for transform in message.transforms:
            stamp = transform.header.stamp
            stamp_s = stamp.sec + stamp.nanosec * 1e-9
            static = topic == "/tf_static"
            tree.add(transform.header.frame_id, transform.child_frame_id, pose_of(transform), stamp_s, static)


def _check_pose_topic(bag: Bag, topic: str) -> None:
    found = sorted({connection.msgtype for connection in bag.connections(topic)})
    if not found:
        raise RecordingError(f"{bag.path} has no topic {topic!r}; name one that it has (pose=TOPIC).")
    if not set(found) & {*_POSE_TYPES, _TRANSFORM_TYPE}:
        known = ", ".join(kind.rsplit("/", 1)[1] for kind in (*_POSE_TYPES, _TRANSFORM_TYPE))
        raise RecordingError(
            f"{topic!r} of {bag.path} is of the type {found[0]}, which holds no poses; name a topic of {known}."
        )


def _add_motion(bag: Bag, topics: RosTopics, camera_frame: str, tree: TransformTree) -> str:
    """Add to the tree of mounts what moves the camera: /tf, else odometry or a pose topic; return which."""
    if not topics.pose:
        _add_tf(bag, "/tf", tree)
        if tree.moves(camera_frame):
            return "/tf"
    if topics.pose:
        _check_pose_topic(bag, topics.pose)
    candidates = [topics.pose] if topics.pose else bag.topics_of(_POSE_TYPES)
    if not candidates:
        raise RecordingError(
            f"{bag.path} has no poses: no /tf that moves {camera_frame!r}, no odometry and no pose topic; "
            "record one of them."
        )
    body = ""
    for _, message in bag.messages(candidates[0]):
        stamp = message.header.stamp
        body = getattr(message, "child_frame_id", "") or camera_frame
        tree.add(
            message.header.frame_id or "world", body, pose_of(message), stamp.sec + stamp.nanosec * 1e-9, static=False
        )
    if not tree.moves(camera_frame):
        raise RecordingError(
            f"{bag.path} has poses of {body!r} on {candidates[0]} but no static transform from there to the camera "
            f"{camera_frame!r}; record /tf_static."
        )
    return candidates[0]
