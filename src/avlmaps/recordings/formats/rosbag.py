"""ROS 1 bags, ROS 2 bags and MCAP files (of ROS or Foxglove), read in place; no ROS is needed.

Topics are found by type, or named: ``{"rgb": "/camera/color/image_raw", "pose": "/odom"}``. The pose of the
depth camera comes from /tf where the tree reaches from the camera to a world that it moves in, else from odometry
or a pose topic together with the static transforms from the body to the camera, or a file of poses. World: the tree's
root (``map``, ``odom``), which by ROS's own convention (REP 103) has z up. Where there are no depth images, the point
clouds of a LiDAR are projected into the colour camera.
"""

import hashlib
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import apply, inverse
from avlmaps.core.timeline import associate, gap_notices, in_order
from avlmaps.core.wording import option
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.formats.bags import Bag
from avlmaps.recordings.formats.file_recording import add_files, stamp_of
from avlmaps.recordings.formats.ros_messages import (
    CLOUD_TYPES,
    PAIRING_TOLERANCE_S,
    RosTopics,
    camera_of,
    cloud_camera,
    colour_of,
    depth_of,
    depth_of_points,
    info_beside,
    is_grey,
    is_rectified,
    pair_images,
    points_of,
    require_encoding,
    shared_namespace,
)
from avlmaps.recordings.formats.ros_sound import (
    DIRECTION_TYPES,
    STAMPED,
    Pcm,
    PictureClock,
    SoundTopic,
    directions_of,
    extract_audio,
)
from avlmaps.recordings.formats.ros_transforms import TransformTree, base_height, find_motion, is_tf, no_pose, read_tf
from avlmaps.recordings.plausible import plausible_walk, repeat_fault
from avlmaps.recordings.types import Frame, Recording

_IMAGE_TYPES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_INFO_TYPES = ("sensor_msgs/msg/CameraInfo",)
_AUDIO_INFO_TYPES = ("audio_common_msgs/msg/AudioInfo",)
_AUDIO_TYPES = ("audio_common_msgs/msg/AudioData", "audio_common_msgs/msg/AudioDataStamped", STAMPED)
# A LiDAR turns ten times a second: the nearest picture is at most half a turn away.
CLOUD_TOLERANCE_S = 0.06


def open_rosbag(path: Path, topics: Mapping[str, str] | None = None, more: Sequence[Path] = ()) -> "RosbagRecording":
    """Open a ROS 1 ``.bag``, a ROS 2 bag's folder, an ``.mcap`` or a ``.db3`` file, or the files of one walk."""
    known = [f.name for f in fields(RosTopics)]
    for name in topics or {}:
        if name not in known:
            raise RecordingError(f"There is no {name!r} among the topics that can be named: {', '.join(known)}.")
    try:
        return RosbagRecording(Path(path), RosTopics(**(topics or {})), more)
    except AttributeError as error:
        raise RecordingError(
            f"A message of {path} lacks a field ({error}); the bag's definition of it is damaged, or of another "
            "version."
        ) from error


class RosbagRecording(Recording):
    """See the module's docstring."""

    format = "rosbag"

    def __init__(self, path: Path, topics: RosTopics, more: Sequence[Path] = ()) -> None:
        self.path = path
        self._bag = Bag(path, more)
        self._rgb_topic, self._depth_topic = _image_topics(self._bag, topics)
        self._of_points = self._depth_topic in self._bag.topics_of(CLOUD_TYPES)
        named_tf = topics.pose if topics.pose and is_tf(self._bag, topics.pose) else ""
        transforms, tf_topic = read_tf(self._bag, self._rgb_topic, named_tf)
        mounts = transforms.mounts()
        self.rig, rig_notices, camera_frame = _read_rig(self._bag, self._rgb_topic, self._depth_topic, mounts)
        rgb_s, rgb_ns = _stamps(self._bag, self._rgb_topic)
        depth_s, depth_ns = _stamps(self._bag, self._depth_topic)
        what = "point clouds" if self._of_points else "depth images"
        rgb_order, depth_order = in_order(rgb_s, "colour images"), in_order(depth_s, what)
        rgb, depth = rgb_order.index, depth_order.index
        tolerance_s = CLOUD_TOLERANCE_S if self._of_points else PAIRING_TOLERANCE_S
        a, b = associate(depth_s[depth], rgb_s[rgb], tolerance_s)
        others = () if topics.depth else _other_cameras(self._bag, self._rgb_topic, self._depth_topic)
        notices = [*self._bag.notices, *others, *rig_notices, *rgb_order.notices, *depth_order.notices]
        if len(a) < len(depth):
            lost, within = len(depth) - len(a), f"{1000 * tolerance_s:.0f} ms"
            notices.append(f"{lost} of {len(depth)} {what} have no colour image within {within}.")
        stamps_s = rgb_s[rgb][b] if self._of_points else depth_s[depth][a]
        motion = find_motion(self._bag, topics.pose, camera_frame, transforms, tf_topic, topics.directions)
        tree = motion.tree
        self.topics = {"rgb": self._rgb_topic, "depth": self._depth_topic, "pose": motion.topic}
        if cycle := tree.cycle(camera_frame):
            raise RecordingError(
                f"The transforms of {path} go round in a circle ({cycle}), so that the camera {camera_frame!r} is "
                "nowhere; record /tf with one parent for each frame, or name odometry (pose=/odom)."
            )
        poses, known = tree.root_from(camera_frame, stamps_s)
        if not known.any():
            raise RecordingError(no_pose(path, camera_frame, stamps_s, tree))
        if self._of_points:
            self._camera_from_cloud, seen = _clouds_in_cameras(
                self._bag, self._depth_topic, camera_frame, tree, depth_s[depth][a], poses
            )
            known &= seen
        if not known.all():
            notices.append(
                f"{int((~known).sum())} of {len(known)} frames lie outside of the known poses and are left out."
            )
        self.posed = float(known.mean()) * min(len(rgb) / len(rgb_s), len(depth) / len(depth_s))
        rows = np.flatnonzero(known)
        walk = plausible_walk(stamps_s[rows], poses[rows, :3, 3], [f"{i:06d}" for i in range(len(rows))])
        if walk.fault:
            raise RecordingError(f"{path}: {walk.fault}")
        rows = rows[walk.index]
        notices += [*motion.notices, *tree.notices, *walk.notices]
        if self._of_points:
            self._camera_from_cloud = self._camera_from_cloud[rows]
        self.begins_s = float(stamps_s[rows[0]])
        self.stamps_s = stamps_s[rows] - self.begins_s
        self.world_from_camera = poses[rows]
        self._rgb_at = [(int(rgb_ns[rgb[i]]), float(rgb_s[rgb[i]])) for i in b[rows]]
        self._depth_at = [(int(depth_ns[depth[i]]), float(depth_s[depth[i]])) for i in a[rows]]
        self.up_in_world = np.array([0.0, 0.0, 1.0]) if motion.z_is_up else None
        self.base_height = base_height(tree, camera_frame, float(stamps_s[rows[0]]))
        clock = PictureClock.of(depth_ns[depth][a][rows], stamps_s[rows], self.begins_s)
        self.audio, audio_notices = self._read_audio(topics, clock)
        if topics.directions:
            self.audio, said = self._with_directions(topics.directions, clock)
            audio_notices = (*audio_notices, *said)
        self.notices = (*notices, *gap_notices(self.stamps_s, "frames"), *audio_notices)

    def frame(self, index: int) -> Frame:
        """Read one frame."""
        received_ns, stamp_s = self._rgb_at[index]
        name = f"{self._rgb_topic} at {stamp_s:.3f} s"
        with self._bag.readable(self._rgb_topic):
            rgb = colour_of(self._bag.message_at(self._rgb_topic, received_ns, stamp_s), name, self.rig.rgb)
        received_ns, stamp_s = self._depth_at[index]
        name = f"{self._depth_topic} at {stamp_s:.3f} s"
        with self._bag.readable(self._depth_topic):
            message = self._bag.message_at(self._depth_topic, received_ns, stamp_s)
            if self._of_points:
                points = apply(self._camera_from_cloud[index], points_of(message, name))
                depth_m = depth_of_points(points, self.rig.depth)
            else:
                depth_m = depth_of(message, name, self.rig.depth)
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
        if self._of_points:
            return 1.0
        received_ns, stamp_s = self._depth_at[0]
        message = self._bag.message_at(self._depth_topic, received_ns, stamp_s)
        encoding = getattr(message, "encoding", None) or getattr(message, "format", "")
        return 1.0 if encoding.startswith("32F") else 1.0 / self.depth_units_per_m

    def change_stamp(self) -> str:
        """See ``Recording.change_stamp``."""
        return stamp_of(self.path.parent, (), self._files())

    def _files(self) -> list[Path]:
        inside = (sorted(file.rglob("*")) if file.is_dir() else [file] for file in self._bag.files)
        return [file for files in inside for file in files if file.is_file()]

    def _read_audio(self, topics: RosTopics, clock: PictureClock) -> tuple[AudioTrack | None, tuple[str, ...]]:
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
        folder = Path(tempfile.mkdtemp(prefix="avlmaps-rosbag-"))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        infos = self._bag.topics_of(_AUDIO_INFO_TYPES)
        info = next((message for topic in infos for _, message in self._bag.messages(topic)), None)
        sound = SoundTopic(found[0], lambda: self._bag.messages(found[0]), clock)
        return extract_audio(sound, info, folder, pcm)

    def _with_directions(self, topic: str, clock: PictureClock) -> tuple[AudioTrack, tuple[str, ...]]:
        """Return the track with the directions on a topic."""
        known = self._bag.topics_of(DIRECTION_TYPES)
        if topic not in known:
            has = ", ".join(known) or "none"
            raise RecordingError(
                f"{self.path} has no topic {topic!r} of directions (std_msgs numbers or geometry_msgs/PoseStamped: "
                f"{has}); name one of them."
            )
        if self.audio is None:
            raise RecordingError(
                f"{self.path} has no sound, so that the directions on {topic} are of nothing; leave them out."
            )
        found, notices = directions_of(topic, lambda: self._bag.messages(topic), clock)
        found.require_beside(self.audio.start_s, self.audio.end_s, f"{self.path}, {topic}")
        self.topics = {**self.topics, "directions": topic}
        return replace(self.audio, directions=found), notices


def _image_topics(bag: Bag, topics: RosTopics) -> tuple[str, str]:
    images, clouds = bag.topics_of(_IMAGE_TYPES), bag.topics_of(CLOUD_TYPES)
    every = ", ".join(images) or "none"
    for topic, known in ((topics.rgb, images), (topics.depth, [*images, *clouds])):
        if topic and topic not in known:
            raise RecordingError(f"{bag.path} has no image topic {topic!r}; its image topics are: {every}.")
    depths = [topics.depth] if topics.depth else [t for t in images if "depth" in t.lower()]
    colours = [topics.rgb] if topics.rgb else [t for t in images if t not in depths and "depth" not in t.lower()]
    rgb, depth = pair_images(colours, depths)
    depth = depth or next(iter(clouds), "")
    if not depth or not rgb:
        missing, name = ("depth", "depth") if not depth else ("colour", "rgb")
        raise RecordingError(
            f"{bag.path} has no topic of {missing} images (image topics: {every}); name it "
            f"({name}=TOPIC).{_other_topics(bag)}"
        )
    return rgb, depth


def _other_topics(bag: Bag) -> str:
    types = sorted(set(bag.topics.values()))
    if bag.topics_of(_IMAGE_TYPES) or not types:
        return ""
    return f" It holds messages of: {', '.join(types[:8])}{' ...' if len(types) > 8 else ''}."


def _other_cameras(bag: Bag, rgb_topic: str, depth_topic: str) -> tuple[str, ...]:
    images = [topic for topic in bag.topics_of(_IMAGE_TYPES) if "depth" in topic.lower()]
    own = shared_namespace(rgb_topic, depth_topic)
    others = [topic for topic in images if shared_namespace(topic, depth_topic) < max(own, 1)]
    if not others:
        return ()
    return (
        f"Of several cameras that of {rgb_topic} and {depth_topic} is used; for another name both topics "
        f"({option('topics', f'rgb=... depth={others[0]}')}).",
    )


def _read_rig(bag: Bag, rgb_topic: str, depth_topic: str, mounts: TransformTree) -> tuple[Rig, list[str], str]:
    """Return the cameras, the notices about them, and the depth camera's frame; ``mounts`` links the two."""
    cameras: dict[str, Any] = {}
    notices: list[str] = []
    frames: dict[str, str] = {}
    of_points = depth_topic in bag.topics_of(CLOUD_TYPES)
    for topic in (rgb_topic,) if of_points else (rgb_topic, depth_topic):
        info_topic = _info_topic(bag, topic)
        if not info_topic and topic == depth_topic:  # drivers that register depth often publish one calibration
            info_topic = _info_topic(bag, rgb_topic)
            notices.append(f"{depth_topic} has no CameraInfo; that of {rgb_topic} is used, as for registered depth.")
        if not info_topic:
            has = ", ".join(bag.topics_of(_INFO_TYPES)) or "none"
            raise RecordingError(f"{bag.path} has no CameraInfo beside {topic} (it has: {has}); record it too.")
        first = bag.first(info_topic)
        if first is None:
            raise RecordingError(f"{bag.path} has no message on {info_topic}, the calibration of {topic}.")
        cameras[topic], distorted = camera_of(first, info_topic, is_rectified(topic))
        if distorted:
            remedy = "its P is empty" if is_rectified(topic) else "rectified images make a better map"
            notices.append(f"{topic} has lens distortion, which a pinhole leaves out; {remedy}.")
        image = bag.first(topic)
        require_encoding(None if of_points and topic == depth_topic else image, topic, colour=topic == rgb_topic)
        if topic == rgb_topic and is_grey(image, topic):
            notices.append(f"The pictures of {topic} have no colour (infrared, or grey); colours tell nothing apart.")
        frames[topic] = (image or first).header.frame_id
    if of_points:
        rgb = cameras[rgb_topic]
        notices.append(f"Depth is that of the points of {depth_topic}, as the camera of {rgb_topic} sees them.")
        return Rig(rgb, cloud_camera(rgb)), notices, frames[rgb_topic]
    rgb_from_depth = mounts.fixed(frames[rgb_topic], frames[depth_topic])
    if rgb_from_depth is None:
        rgb_from_depth = np.eye(4)
        notices.append(
            f"No static transform links {frames[rgb_topic]} and {frames[depth_topic]}; they are taken for one place."
        )
    return Rig(cameras[rgb_topic], cameras[depth_topic], rgb_from_depth), notices, frames[depth_topic]


def _info_topic(bag: Bag, image_topic: str) -> str:
    infos = bag.topics_of(_INFO_TYPES)
    if beside := info_beside(image_topic, infos):
        return beside
    image = bag.first(image_topic)
    frame = image.header.frame_id if image else ""
    others = [topic for topic in infos if frame and not topic.endswith("/camera_info")]
    alike = [t for t in others if (info := bag.first(t)) is not None and info.header.frame_id == frame]
    return max(alike, key=lambda topic: sum(a == b for a, b in zip(topic, image_topic, strict=False)), default="")


def _stamps(bag: Bag, topic: str) -> tuple[np.ndarray, np.ndarray]:
    stamps_s, received_ns = bag.stamps(topic)
    if len(stamps_s) > 1 and not stamps_s.any():
        raise RecordingError(
            f"All {len(stamps_s)} header stamps of {topic} in {bag.path} are zero, so that nothing says where its "
            "camera was; let its driver set them, and record again."
        )
    if fault := repeat_fault(stamps_s, f"messages of {topic}"):
        raise RecordingError(f"{bag.path}: {fault}")
    return stamps_s, received_ns


def _clouds_in_cameras(
    bag: Bag, topic: str, camera_frame: str, tree: TransformTree, stamps_s: np.ndarray, world_from_camera: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    first = bag.first(topic)
    frame = first.header.frame_id if first else ""
    if tree.root(frame) != tree.root(camera_frame):
        raise RecordingError(
            f"No transform of {bag.path} links the LiDAR {frame!r} of {topic} to the camera {camera_frame!r}; record "
            "/tf_static with both."
        )
    world_from_cloud, known = tree.root_from(frame, stamps_s)
    return inverse(world_from_camera) @ world_from_cloud, known
