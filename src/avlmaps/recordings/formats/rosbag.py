"""ROS 1 bags, ROS 2 bags and MCAP files (of ROS or Foxglove), read in place; no ROS is needed.

Topics are found by type, or named. The pose of the depth camera comes from /tf where the tree reaches from the camera
to a world that it moves in, else from odometry or a pose topic together with the static transforms from the body to
the camera, or a file of poses. World: the tree's root (``map``, ``odom``), which by REP 103 has z up. Where there are
no depth images, the point clouds of a LiDAR are projected into the colour camera.
"""

import shutil
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import apply, inverse
from avlmaps.core.timeline import associate, in_order
from avlmaps.core.wording import option
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.faults import note
from avlmaps.recordings.formats import ros_messages as ros
from avlmaps.recordings.formats import ros_sound
from avlmaps.recordings.formats.bags import Bag
from avlmaps.recordings.formats.file_recording import Shots, StoredRecording, opener
from avlmaps.recordings.formats.ros_transforms import TransformTree, base_height, find_motion, is_tf, no_pose, read_tf
from avlmaps.recordings.images import check_size
from avlmaps.recordings.plausible import repeat_fault

_IMAGE_TYPES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_INFO_TYPES = ("sensor_msgs/msg/CameraInfo",)
_AUDIO_INFO_TYPES = ("audio_common_msgs/msg/AudioInfo",)
_AUDIO_TYPES = ("audio_common_msgs/msg/AudioData", "audio_common_msgs/msg/AudioDataStamped", ros_sound.STAMPED)
# A LiDAR turns ten times a second: the nearest picture is at most half a turn away.
CLOUD_TOLERANCE_S = 0.06


@opener
def open_rosbag(path: Path, topics: Mapping[str, str] | None = None, more: Sequence[Path] = ()) -> StoredRecording:
    """Open a ROS 1 ``.bag``, a ROS 2 bag's folder, an ``.mcap`` or a ``.db3`` file, or the files of one walk."""
    known = [f.name for f in fields(ros.RosTopics)]
    for name in topics or {}:
        if name not in known:
            raise RecordingError(f"There is no {name!r} among the topics that can be named: {', '.join(known)}.")
    try:
        return _opened(Bag(Path(path), more), ros.RosTopics(**(topics or {})))
    except (AttributeError, TypeError) as error:  # a message lacks a field, or a topic's name is no text
        raise RecordingError(f"{path} cannot be read ({error}); its definitions are damaged: reindex it.") from error


@dataclass(eq=False)
class _Pictures:
    bag: Bag
    of_rgb: tuple[str, np.ndarray, np.ndarray]
    of_depth: tuple[str, np.ndarray, np.ndarray]
    camera_from_cloud: np.ndarray | None = None

    def colour(self, name: str, camera: Pinhole) -> np.ndarray:
        return self._fitting(ros.colour_of, self.of_rgb, name, camera)

    def depth(self, name: str, camera: Pinhole) -> np.ndarray:
        moved = self.camera_from_cloud
        if moved is None:
            return self._fitting(ros.depth_of, self.of_depth, name, camera)

        def seen(message: Any, what: str, camera: Pinhole) -> np.ndarray:
            return ros.depth_of_points(apply(moved[int(name)], ros.points_of(message, what)), camera)

        return self._fitting(seen, self.of_depth, name, camera)

    def _fitting(
        self,
        decode: Callable[[Any, str, Pinhole], np.ndarray],
        of: tuple[str, np.ndarray, np.ndarray],
        name: str,
        camera: Pinhole,
    ) -> np.ndarray:
        topic, received_ns, stamp_s = of[0], int(of[1][int(name)]), float(of[2][int(name)])
        with self.bag.readable(topic):
            what = f"{topic} at {stamp_s:.3f} s"
            picture = decode(self.bag.message_at(topic, received_ns, stamp_s), what, camera)
        check_size(f"The picture {what}", picture.shape, camera)
        return picture


def _opened(bag: Bag, topics: ros.RosTopics) -> StoredRecording:
    rgb_topic, depth_topic = _image_topics(bag, topics)
    of_points = depth_topic in bag.topics_of(ros.CLOUD_TYPES)
    transforms, tf_topic = read_tf(bag, rgb_topic, topics.pose if is_tf(bag, topics.pose) else "")
    rig, camera_frame = _read_rig(bag, rgb_topic, depth_topic, transforms.mounts())
    (rgb_s, rgb_ns), (depth_s, depth_ns) = _stamps(bag, rgb_topic), _stamps(bag, depth_topic)
    what = "point clouds" if of_points else "depth images"
    rgb_order, depth_order = in_order(rgb_s, "colour images"), in_order(depth_s, what)
    rgb, depth = rgb_order.index, depth_order.index
    tolerance_s = CLOUD_TOLERANCE_S if of_points else ros.PAIRING_TOLERANCE_S
    a, b = associate(depth_s[depth], rgb_s[rgb], tolerance_s)
    posed = min(len(rgb) / len(rgb_s), len(depth) / len(depth_s))
    if not topics.depth:
        _note_other_cameras(bag, rgb_topic, depth_topic)
    note(*bag.notices, *rgb_order.notices, *depth_order.notices)
    if len(a) < len(depth):
        lost, within = len(depth) - len(a), f"{1000 * tolerance_s:.0f} ms"
        note(f"{lost} of {len(depth)} {what} have no colour image within {within}.")
    rgb, depth = rgb[b], depth[a]
    stamps_s = rgb_s[rgb] if of_points else depth_s[depth]
    motion = find_motion(bag, topics.pose, camera_frame, transforms, tf_topic, topics.directions)
    tree = motion.tree
    if cycle := tree.cycle(camera_frame):
        raise RecordingError(
            f"The transforms of {bag.path} go round in a circle ({cycle}), so that the camera {camera_frame!r} is "
            "nowhere; record /tf with one parent for each frame, or name odometry (pose=/odom)."
        )
    poses, known = tree.root_from(camera_frame, stamps_s)
    camera_from_cloud = None
    if of_points:
        first = bag.first(depth_topic)
        frame = first.header.frame_id if first else ""
        if tree.root(frame) != tree.root(camera_frame):
            raise RecordingError(
                f"{bag.path} does not link the LiDAR {frame!r} to the camera {camera_frame!r}; record /tf_static with "
                "both."
            )
        world_from_cloud, seen = tree.root_from(frame, depth_s[depth])
        camera_from_cloud, known = inverse(poses) @ world_from_cloud, known & seen
    if not known.any():
        raise RecordingError(no_pose(bag.path, camera_frame, stamps_s, tree))
    if not known.all():
        note(f"{int((~known).sum())} of {len(known)} frames lie outside of the known poses and are left out.")
    rows = np.flatnonzero(known)
    rgb, depth, stamps_s = rgb[rows], depth[rows], stamps_s[rows]
    begins_s = float(stamps_s[0])
    pictures = _Pictures(
        bag,
        (rgb_topic, rgb_ns[rgb], rgb_s[rgb]),
        (depth_topic, depth_ns[depth], depth_s[depth]),
        None if camera_from_cloud is None else camera_from_cloud[rows],
    )
    names = [f"{number:06d}" for number in range(len(rows))]
    shots = Shots(names, names, names, stamps_s - begins_s, poses[rows])
    used = {"rgb": rgb_topic, "depth": depth_topic, "pose": motion.topic}
    note(*motion.notices, *tree.notices)
    audio = _sound(bag, topics, ros_sound.PictureClock.of(depth_ns[depth], stamps_s, begins_s), pictures, used)
    return StoredRecording.settled(
        bag.path, "rosbag", rig, shots, None,
        pictures=pictures, stored_depth_unit_m=_unit_m(bag.first(depth_topic), of_points), topics=used, audio=audio,
        files=[file for given in bag.files for file in (sorted(given.rglob("*")) if given.is_dir() else [given])
               if file.is_file()],
        up_in_world=np.array([0.0, 0.0, 1.0]) if motion.z_is_up else None, begins_s=begins_s,
        base_height=base_height(tree, camera_frame, begins_s), posed=posed * float(known.mean()),
    )  # fmt: skip


def _unit_m(message: Any, of_points: bool) -> float:
    encoding = getattr(message, "encoding", None) or getattr(message, "format", "")
    return 1.0 if of_points or encoding.startswith("32F") else 1e-3  # floats are metres (REP 118)


def _sound(
    bag: Bag, topics: ros.RosTopics, clock: ros_sound.PictureClock, owner: object, used: dict[str, str]
) -> AudioTrack | None:
    pcm = ros_sound.Pcm.parse_rate(topics.audio_pcm) if topics.audio_pcm else None
    known = bag.topics_of(_AUDIO_TYPES)
    name = topics.audio or next(iter(known), "none")
    audio: AudioTrack | None = None
    if name != "none":
        _require_topic(bag, name, known, "sound topic", "")
        used["audio"] = name
        # The sound goes to a file of its own for as long as the recording is open: a track is read by pieces.
        folder = Path(tempfile.mkdtemp(prefix="avlmaps-rosbag-"))
        weakref.finalize(owner, shutil.rmtree, folder, ignore_errors=True)
        infos = bag.topics_of(_AUDIO_INFO_TYPES)
        info = next((message for topic in infos for _, message in bag.messages(topic)), None)
        audio = ros_sound.extract_audio(
            ros_sound.SoundTopic(name, lambda: bag.messages(name), clock), info, folder, pcm
        )
    if not (topic := topics.directions):
        return audio
    numbers, what = bag.topics_of(ros_sound.DIRECTION_TYPES), " of directions (std_msgs numbers or PoseStamped)"
    _require_topic(bag, topic, numbers, "topic", what)
    if audio is None:
        raise RecordingError(f"{bag.path} has no sound, to which the directions on {topic} belong; leave them out.")
    found = ros_sound.directions_of(topic, lambda: bag.messages(topic), clock)
    found.require_beside(audio.start_s, audio.end_s, f"{bag.path}, {topic}")
    used["directions"] = topic
    return replace(audio, directions=found)


def _require_topic(bag: Bag, topic: str, known: Sequence[str], what: str, of: str) -> None:
    if topic not in known:
        has = ", ".join(known) or "none"
        raise RecordingError(f"{bag.path} has no {what} {topic!r}{of} (it has: {has}); name one of them.")


def _image_topics(bag: Bag, topics: ros.RosTopics) -> tuple[str, str]:
    images, clouds = bag.topics_of(_IMAGE_TYPES), bag.topics_of(ros.CLOUD_TYPES)
    every = ", ".join(images) or "none"
    for topic, known in ((topics.rgb, images), (topics.depth, [*images, *clouds])):
        if topic and topic not in known:
            raise RecordingError(f"{bag.path} has no image topic {topic!r}; its image topics are: {every}.")
    depths = [topics.depth] if topics.depth else [t for t in images if "depth" in t.lower()]
    colours = [topics.rgb] if topics.rgb else [t for t in images if t not in depths and "depth" not in t.lower()]
    rgb, depth = ros.pair_images(colours, depths)
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


def _note_other_cameras(bag: Bag, rgb_topic: str, depth_topic: str) -> None:
    images = [topic for topic in bag.topics_of(_IMAGE_TYPES) if "depth" in topic.lower()]
    own = ros.shared_namespace(rgb_topic, depth_topic)
    others = [topic for topic in images if ros.shared_namespace(topic, depth_topic) < max(own, 1)]
    if others:
        note(
            f"Of several cameras that of {rgb_topic} and {depth_topic} is used; for another name both topics "
            f"({option('topics', f'rgb=... depth={others[0]}')})."
        )


def _read_rig(bag: Bag, rgb_topic: str, depth_topic: str, mounts: TransformTree) -> tuple[Rig, str]:
    cameras: dict[str, Any] = {}
    frames: dict[str, str] = {}
    of_points = depth_topic in bag.topics_of(ros.CLOUD_TYPES)
    for topic in (rgb_topic,) if of_points else (rgb_topic, depth_topic):
        info_topic = _info_topic(bag, topic)
        if not info_topic and topic == depth_topic:  # drivers that register depth often publish one calibration
            info_topic = _info_topic(bag, rgb_topic)
            note(f"{depth_topic} has no CameraInfo; that of {rgb_topic} is used, as for registered depth.")
        if not info_topic:
            has = ", ".join(bag.topics_of(_INFO_TYPES)) or "none"
            raise RecordingError(f"{bag.path} has no CameraInfo beside {topic} (it has: {has}); record it too.")
        first = bag.first(info_topic)
        if first is None:
            raise RecordingError(f"{bag.path} has no message on {info_topic}, the calibration of {topic}.")
        cameras[topic], distorted = ros.camera_of(first, info_topic, ros.is_rectified(topic))
        if distorted:
            remedy = "its P is empty" if ros.is_rectified(topic) else "rectified images make a better map"
            note(f"{topic} has lens distortion, which a pinhole leaves out; {remedy}.")
        image = bag.first(topic)
        ros.require_encoding(None if of_points and topic == depth_topic else image, topic, colour=topic == rgb_topic)
        if topic == rgb_topic and ros.is_grey(image, topic):
            note(f"The pictures of {topic} have no colour (infrared, or grey); colours tell nothing apart.")
        frames[topic] = (image or first).header.frame_id
    if of_points:
        rgb = cameras[rgb_topic]
        note(f"Depth is that of the points of {depth_topic}, as the camera of {rgb_topic} sees them.")
        return Rig(rgb, ros.cloud_camera(rgb)), frames[rgb_topic]
    rgb_from_depth = mounts.fixed(frames[rgb_topic], frames[depth_topic])
    if rgb_from_depth is None:
        rgb_from_depth = np.eye(4)
        note(f"No static transform links {frames[rgb_topic]} and {frames[depth_topic]}; they are taken for one place.")
    return Rig(cameras[rgb_topic], cameras[depth_topic], rgb_from_depth), frames[depth_topic]


def _info_topic(bag: Bag, image_topic: str) -> str:
    infos = bag.topics_of(_INFO_TYPES)
    if beside := ros.info_beside(image_topic, infos):
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
