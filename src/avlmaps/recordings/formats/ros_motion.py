"""What moves the camera of a bag: /tf of any namespace, odometry, or a topic of poses."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import MAX_ROTATION_FAULT, from_quaternion
from avlmaps.recordings.faults import stop_at_first
from avlmaps.recordings.formats.bags import Bag
from avlmaps.recordings.formats.ros_messages import pose_of, stamp_of
from avlmaps.recordings.formats.ros_transforms import TransformTree
from avlmaps.recordings.formats.tables import POSE, read_table
from avlmaps.recordings.types import BaseHeight

_POSE_TYPES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/PoseStamped",
)
_TRANSFORM_TYPE = "geometry_msgs/msg/TransformStamped"
# What a robot calls its base (REP 105, REP 120).
_BASES = ("base_footprint", "base_link")
_TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
_STATIC = "tf_static"


def read_tf(bag: Bag, image_topic: str, named: str = "") -> tuple[TransformTree, str]:
    """Return the tree of a bag's transforms, and the topic that moves it (``/tf``), if any.

    Of several robots' topics (``/robot1/tf``) those count whose namespace the image topic is in; all, if none is.

    Args:
        bag: the bag.
        image_topic: of the camera whose poses are wanted.
        named: a topic of moving transforms that someone named.
    """
    topics = bag.topics_of(_TF_TYPES)
    beside = [topic for topic in topics if image_topic.startswith(_namespace(topic))]
    moving = [topic for topic in beside or topics if topic.rsplit("/", 1)[-1] != _STATIC]
    static = [topic for topic in beside or topics if topic not in moving]
    if named:
        moving, static = [named], [t for t in topics if t.endswith(_STATIC) and named.startswith(_namespace(t))]
    tree = TransformTree()
    for topic in (*static, *moving):
        _add_tf(bag, topic, tree, static=topic in static)
    return tree, max(moving, key=len, default="")


def _namespace(topic: str) -> str:
    return topic.rsplit("/", 1)[0] + "/"


def is_tf(bag: Bag, topic: str) -> bool:
    """Return whether a topic is one of transforms."""
    return topic in bag.topics_of(_TF_TYPES)


def no_pose(path: Path, camera_frame: str, stamps_s: np.ndarray, tree: TransformTree) -> str:
    """Return the sentence for a camera that has no pose at the time of any image."""
    span = tree.span_s(camera_frame)
    when = f" (they go from {stamps_s[0]:.3f} to {stamps_s[-1]:.3f} s)" if len(stamps_s) else ""
    poses = f"; its poses go from {span[0]:.3f} to {span[1]:.3f} s, so check that both use one clock" if span else ""
    return (
        f"{path} has no pose of its camera frame {camera_frame!r} at the time of any of its {len(stamps_s)} "
        f"images{when}{poses}; record /tf, /tf_static or odometry, or name the topic (pose=/odom)."
    )


def base_height(tree: TransformTree, camera_frame: str, stamp_s: float) -> BaseHeight | None:
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


def _add_tf(bag: Bag, topic: str, tree: TransformTree, static: bool) -> None:
    for _, message in bag.messages(topic):
        for transform in message.transforms:
            pose, at_s = pose_of(transform), stamp_of(transform)
            tree.add(transform.header.frame_id, transform.child_frame_id, pose, at_s, static)


def _check_pose_topic(bag: Bag, topic: str) -> None:
    found = sorted({connection.msgtype for connection in bag.connections(topic)})
    if not found:
        raise RecordingError(f"{bag.path} has no topic {topic!r}; name one that it has (pose=TOPIC).")
    if not set(found) & {*_POSE_TYPES, *_TF_TYPES, _TRANSFORM_TYPE}:
        known = ", ".join(kind.rsplit("/", 1)[1] for kind in (*_POSE_TYPES, _TRANSFORM_TYPE, _TF_TYPES[0]))
        raise RecordingError(
            f"{topic!r} of {bag.path} is of the type {found[0]}, which holds no poses; name a topic of {known}."
        )


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """What moves the camera.

    Attributes:
        tree: the frames, moved.
        topic: what moves them.
        notices: one sentence for each thing that was assumed.
        z_is_up: whether the world is one of ROS, with z up.
    """

    tree: TransformTree
    topic: str
    notices: tuple[str, ...] = ()
    z_is_up: bool = True


def find_motion(
    bag: Bag, named: str, camera_frame: str, transforms: TransformTree, tf_topic: str, no_pose_topic: str = ""
) -> CameraMotion:
    """Find what moves the camera: transforms, else odometry or a topic of poses.

    Args:
        bag: the bag.
        named: the topic that someone named; empty: transforms first.
        camera_frame: the depth camera's frame.
        transforms: the tree of the bag's transforms.
        tf_topic: where they come from.
        no_pose_topic: a topic of poses that are not the robot's.

    Raises:
        RecordingError: nothing moves it, or what does is not linked to it.
    """
    if named and Path(named).is_file():
        return CameraMotion(_tree_of_file(Path(named), camera_frame), named, z_is_up=False)
    if named:
        _check_pose_topic(bag, named)
    if (not named or named == tf_topic) and transforms.moves(camera_frame):
        return CameraMotion(transforms, tf_topic)
    candidates = [named] if named and named != tf_topic else []
    if not named:
        candidates = [topic for topic in bag.topics_of(_POSE_TYPES) if topic != no_pose_topic]
    if not candidates:
        raise RecordingError(
            f"{bag.path} has no poses: no /tf that moves {camera_frame!r}, no odometry and no pose topic; "
            f"record one of them, or give a file of poses (pose=FILE).{_unlinked(transforms, camera_frame)}"
        )
    tree, topic = (transforms.mounts() if named else transforms), candidates[0]
    body, assumed = "", ""
    for _, message in bag.messages(topic):
        if not body:
            body, assumed = body_of(message, topic, camera_frame, tree)
        own = getattr(message, "child_frame_id", "") or body
        tree.add(message.header.frame_id or "world", own, pose_of(message), stamp_of(message), static=False)
    if not tree.moves(camera_frame):
        raise RecordingError(
            f"{bag.path} has poses of {body!r} on {topic} but no static transform from there to the camera "
            f"{camera_frame!r}; record /tf_static.{_unlinked(tree, camera_frame, body)}"
        )
    return CameraMotion(tree, topic, (assumed,) if assumed else ())


def _tree_of_file(file: Path, camera_frame: str) -> TransformTree:
    """Return the tree in which a file of poses moves the camera.

    Its columns are stamp tx ty tz qx qy qz qw, as TUM writes them, or what its header says.
    """
    tree = TransformTree()
    for row in read_table(file, (8,), stop_at_first, names=POSE).values:
        length = float(np.linalg.norm(row[4:]))
        usable = np.isfinite(row).all() and abs(length - 1.0) <= MAX_ROTATION_FAULT
        pose = from_quaternion(row[1:4], row[4:]) if usable else np.full((4, 4), np.nan)
        tree.add("world", camera_frame, pose, float(row[0]), static=False)
    if not tree.moves(camera_frame):
        raise RecordingError(f"{file} holds no pose (stamp tx ty tz qx qy qz qw a line).")
    return tree


def body_of(message: Any, topic: str, camera_frame: str, mounts: TransformTree) -> tuple[str, str]:
    """Return whose poses a topic has, and a notice where the messages do not name it.

    A camera that is mounted on a robot is seldom what a robot's pose is of: unless the topic is called after a camera,
    it is the base that the camera hangs on.
    """
    named = getattr(message, "child_frame_id", "")
    above = mounts.ancestors(camera_frame)
    if named or not above or any(word in topic.lower() for word in ("cam", "optical")):
        return named or camera_frame, ""
    body = next((name for name in _BASES if name in above), above[-1])
    return (
        body,
        f"The poses of {topic} do not say of what; they are taken for those of {body!r}, on which the camera is.",
    )


def _unlinked(tree: TransformTree, camera_frame: str, body: str = "") -> str:
    """Return a sentence about where the camera's frames end, or nothing."""
    root = tree.root(camera_frame)
    if root == camera_frame.lstrip("/"):
        return f" No transform names {camera_frame!r}; in a split recording /tf_static is in the first file."
    missing = f"from {body!r} to {root!r}" if body else f"to {root!r}"
    return f" The camera hangs on {root!r}, and a transform {missing} is missing."
