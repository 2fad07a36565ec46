"""The tree of frames of a ROS recording: who is mounted on whom, and where it was when.

What moves the camera of a bag: /tf of any namespace, odometry, or a topic of poses.
"""

from collections import Counter
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import inverse
from avlmaps.core.timeline import Trajectory, in_order
from avlmaps.recordings.formats.bags import Bag
from avlmaps.recordings.formats.ros_messages import pose_of, stamp_of
from avlmaps.recordings.formats.tables import read_poses
from avlmaps.recordings.types import BaseHeight

# A correction such as map -> odom may come seldom: past its ends it is held for this long, as tf holds the last one,
# and a pause of twice as long is bridged.
HOLD_S = 10.0
_SAME = 1e-9


@dataclass
class _Edge:
    parent: str
    static: bool
    stamps_s: list[float] = field(default_factory=list)
    parent_from_child: list[np.ndarray] = field(default_factory=list)
    constant: bool = True  # it never changes, as a mount that is published again and again

    def add(self, stamp_s: float, parent_from_child: np.ndarray) -> None:
        self.stamps_s.append(stamp_s)
        self.parent_from_child.append(parent_from_child)
        self.constant &= bool(np.abs(parent_from_child - self.parent_from_child[0]).max() <= _SAME)

    def forget(self, before_s: float) -> None:
        kept = [at for at, stamp_s in enumerate(self.stamps_s) if stamp_s >= before_s] or [len(self.stamps_s) - 1]
        self.stamps_s = [self.stamps_s[at] for at in kept]
        self.parent_from_child = [self.parent_from_child[at] for at in kept]

    def trajectory(self) -> Trajectory:
        stamps_s, poses = np.array(self.stamps_s), np.stack(self.parent_from_child)
        kept = in_order(stamps_s, "transforms").index
        return Trajectory(stamps_s[kept], poses[kept])


class TransformTree:
    """Frames by name, from /tf and /tf_static, or from odometry.

    Of a frame with several parents the one that moves it most often counts (of base_link and a visual odometry, this).
    """

    def __init__(self) -> None:
        self._edges: dict[str, dict[str, _Edge]] = {}
        self._broken: Counter[tuple[str, str]] = Counter()

    def add(
        self, parent: str, child: str, parent_from_child: Float[np.ndarray, "4 4"], stamp_s: float, static: bool
    ) -> None:
        """Add one transform; an invalid one (NaN, no rotation, a frame in itself) is left out and reported."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if not np.isfinite(parent_from_child).all() or not child or parent == child:
            self._broken[parent, child] += 1
            return
        edge = self._edges.setdefault(child, {}).setdefault(parent, _Edge(parent, static))
        if static:
            edge.static, edge.constant, edge.stamps_s, edge.parent_from_child = True, True, [0.0], [parent_from_child]
        elif not edge.static:
            edge.add(stamp_s, parent_from_child)

    def mounts(self) -> "TransformTree":
        """Return the tree of what never moves, declared so or not."""
        tree = TransformTree()
        for child, parents in self._edges.items():
            for edge in parents.values():
                if edge.constant:
                    tree.add(edge.parent, child, edge.parent_from_child[0], 0.0, static=True)
        return tree

    def forget(self, before_s: float) -> None:
        """Leave out moving transforms from before a stamp, but for the last of each: a robot drives for days."""
        for parents in self._edges.values():
            for edge in parents.values():
                if not edge.static:
                    edge.forget(before_s)

    def newest_s(self, frame: str) -> float | None:
        """Return up to when what moves a frame most often is known, None where nothing moves it."""
        carrier = self._carrier(frame)
        return max(self._edge(carrier).stamps_s) if carrier else None

    @property
    def notices(self) -> tuple[str, ...]:
        broken = (
            f"{count} transform(s) from {child!r} to {parent!r} are none (NaN, or no rotation) and left out."
            for (parent, child), count in sorted(self._broken.items())
        )
        several = (
            f"The frame {child!r} is in {' and in '.join(map(repr, parents))}; {self._edge(child).parent!r} is used."
            for child, parents in sorted(self._edges.items())
            if len(parents) > 1
        )
        return (*broken, *several)

    def cycle(self, frame: str) -> str:
        chain = self._chain(frame)
        if not chain or self._edge(chain[-1]).parent not in chain:
            return ""
        again = self._edge(chain[-1]).parent
        return " -> ".join([*chain[chain.index(again) :], again])

    def span_s(self, frame: str) -> tuple[float, float] | None:
        """Return from when to when all that moves a frame is known, None where nothing moves it."""
        moving = [self._edge(name).stamps_s for name in self._chain(frame) if not self._edge(name).static]
        return (max(map(min, moving)), min(map(max, moving))) if moving else None

    def moves(self, frame: str) -> bool:
        return self._carrier(frame) != ""

    def root(self, frame: str) -> str:
        chain = self._chain(frame)
        return self._edge(chain[-1]).parent if chain else frame.lstrip("/")

    def ancestors(self, frame: str) -> list[str]:
        return [self._edge(name).parent for name in self._chain(frame)]

    def fixed(self, a: str, b: str) -> Float[np.ndarray, "4 4"] | None:
        """Return ``a_from_b`` where only transforms that never change lie between the two frames, else None."""
        a, b = a.lstrip("/"), b.lstrip("/")
        if a == b:
            return np.eye(4)
        up_a, up_b = self._static_ancestors(a), self._static_ancestors(b)
        shared = [name for name in up_a if name in up_b]
        return inverse(up_a[shared[0]]) @ up_b[shared[0]] if shared else None

    def root_from(
        self, frame: str, stamps_s: Float[np.ndarray, " k"], world: str = ""
    ) -> tuple[Float[np.ndarray, "k 4 4"], Bool[np.ndarray, " k"]]:
        """Return the pose of a frame in its tree's root, or in a frame above it, at each stamp, and where it is known.

        What moves the frame most often has to be known there; others, which correct it, may come seldom (``HOLD_S``).
        """
        pose, known = np.broadcast_to(np.eye(4), (len(stamps_s), 4, 4)).copy(), np.ones(len(stamps_s), bool)
        carrier = self._carrier(frame)
        for name in takewhile(lambda name: name != world, self._chain(frame)):
            edge = self._edge(name)
            if edge.static or (name != carrier and edge.constant):
                pose = edge.parent_from_child[0] @ pose
                continue
            trajectory = edge.trajectory()
            leave = () if name == carrier else (HOLD_S, 2.0 * HOLD_S)
            covered = trajectory.covers(stamps_s, *leave)
            known &= covered
            pose[covered] = trajectory.at(stamps_s[covered], *leave[:1]) @ pose[covered]
        return pose, known

    def _edge(self, child: str) -> _Edge:
        return max(self._edges[child].values(), key=lambda edge: (not edge.static, len(edge.stamps_s)))

    def _carrier(self, frame: str) -> str:
        moving = [name for name in self._chain(frame) if not self._edge(name).static]
        changing = [name for name in moving if not self._edge(name).constant]
        return max(changing or moving, key=lambda name: len(self._edge(name).stamps_s), default="")

    def _chain(self, frame: str) -> list[str]:
        chain: list[str] = []
        name = frame.lstrip("/")
        while name in self._edges and name not in chain:
            chain.append(name)
            name = self._edge(name).parent
        return chain

    def _static_ancestors(self, frame: str) -> dict[str, np.ndarray]:
        reached = {frame: np.eye(4)}
        name = frame
        while name in self._edges:
            edge = next((e for e in self._edges[name].values() if e.constant), None)
            if edge is None or edge.parent in reached:
                break
            reached[edge.parent] = edge.parent_from_child[0] @ reached[name]
            name = edge.parent
        return reached


_POSE_TYPES = ("nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseWithCovarianceStamped", "geometry_msgs/msg/PoseStamped")
_TRANSFORM_TYPE = "geometry_msgs/msg/TransformStamped"
# What a robot calls its base (REP 105, REP 120).
_BASES = ("base_footprint", "base_link")
_TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
_STATIC = "tf_static"


def read_tf(bag: Bag, image_topic: str, named: str = "") -> tuple[TransformTree, str]:
    """Return the tree of a bag's transforms, and the topic that moves it (``/tf``), if any.

    Of several robots' topics those count whose namespace the image topic is in; all, if none is.
    """
    topics = bag.topics_of(_TF_TYPES)
    beside = [topic for topic in topics if image_topic.startswith(_namespace(topic))]
    moving = [topic for topic in beside or topics if topic.rsplit("/", 1)[-1] != _STATIC]
    static = [topic for topic in beside or topics if topic not in moving]
    if named:
        moving, static = [named], [t for t in topics if t.endswith(_STATIC) and named.startswith(_namespace(t))]
    tree = TransformTree()
    for topic in (*static, *moving):
        for transform in (one for _, message in bag.messages(topic) for one in message.transforms):
            frame, child = transform.header.frame_id, transform.child_frame_id
            tree.add(frame, child, pose_of(transform), stamp_of(transform), static=topic in static)
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


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """What moves the camera: frames and topic, what was assumed, and whether the world is one of ROS, with z up."""

    tree: TransformTree
    topic: str
    notices: tuple[str, ...] = ()
    z_is_up: bool = True


def find_motion(
    bag: Bag, named: str, camera_frame: str, transforms: TransformTree, tf_topic: str, no_pose_topic: str = ""
) -> CameraMotion:
    """Find what moves the camera: transforms, else odometry or a topic of poses."""
    if named and Path(named).is_file():
        return CameraMotion(_tree_of_file(Path(named), camera_frame), named, z_is_up=False)
    if named:
        found = sorted({connection.msgtype for connection in bag.connections(named)})
        if not set(found) & {*_POSE_TYPES, *_TF_TYPES, _TRANSFORM_TYPE}:
            known = ", ".join(kind.rsplit("/", 1)[1] for kind in (*_POSE_TYPES, _TRANSFORM_TYPE, _TF_TYPES[0]))
            what = f"is of the type {found[0]}, which holds no poses" if found else "is not there"
            raise RecordingError(f"The topic {named!r} of {bag.path} {what}; name one of {known} (pose=TOPIC).")
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
    tree = TransformTree()
    table = read_poses(file)
    for stamp_s, pose in zip(table.stamps_s.tolist(), table.pose, strict=True):
        tree.add("world", camera_frame, pose, stamp_s, static=False)
    return tree


def body_of(message: Any, topic: str, camera_frame: str, mounts: TransformTree) -> tuple[str, str]:
    """Return whose poses a topic has, and a notice where the messages do not name it.

    Unless the topic is called after a camera, it is the base that the camera hangs on.
    """
    named = getattr(message, "child_frame_id", "")
    above = mounts.ancestors(camera_frame)
    if named or not above or any(word in topic.lower() for word in ("cam", "optical")):
        return named or camera_frame, ""
    body = next((name for name in _BASES if name in above), above[-1])
    return body, f"The poses of {topic} do not say of what; they are taken for those of {body!r}, below the camera."


def _unlinked(tree: TransformTree, camera_frame: str, body: str = "") -> str:
    root = tree.root(camera_frame)
    if root == camera_frame.lstrip("/"):
        return f" No transform names {camera_frame!r}; in a split recording /tf_static is in the first file."
    missing = f"from {body!r} to {root!r}" if body else f"to {root!r}"
    return f" The camera hangs on {root!r}, and a transform {missing} is missing."
