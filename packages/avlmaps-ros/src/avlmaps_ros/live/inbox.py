"""A running robot of ROS 2 as the source of a live map: a process of our own takes what its sensors publish.

Importing this module imports rclpy; only `source.open_ros2` does, for a map of a robot.
"""

import os
import signal
import threading
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from queue import SimpleQueue
from time import monotonic
from typing import Any

from rclpy.executors import ExternalShutdownException, ShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from avlmaps.recordings.formats.ros_messages import RosTopics, info_beside, pair_images
from avlmaps.recordings.formats.ros_sound import DIRECTION_TYPES
from avlmaps_ros.messages import interface
from avlmaps_ros.native import joined

# pyright: reportMissingImports=false
_PICTURES = _RAW, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_INFO, _TF = "sensor_msgs/msg/CameraInfo", "tf2_msgs/msg/TFMessage"
_POSES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/TransformStamped",
)
_SOUNDS = ("audio_common_msgs/msg/AudioStamped", "audio_common_msgs/msg/AudioDataStamped",
           "audio_common_msgs/msg/AudioData")  # fmt: skip
_SOUND_INFO = "audio_common_msgs/msg/AudioInfo"
_DEPTHS = {"rgb": 30, "depth": 30, "rgb_info": 1, "depth_info": 1, "audio_info": 1, "tf": 1000, "tf_static": 1000}
"""Of subscriptions; others hold 100 messages."""
_LOOK_EVERY_S = 0.5
_SETTLED_S = 1.0  # from the first topic of pictures until the others are discovered as well
_MOST_BYTES = 500_000_000  # that wait for the map; pictures beyond are left out
_AT_ONCE = 50
_BEST_EFFORT = ("tf", "pose")
"""Small and many: a lost one is interpolated, and must not hold up those after it until it is sent again."""

Arrived = tuple[str, Any, float]  # what it is for, the message, when it came (monotonic)
# What the receiving process sends: the same with the message's type and bytes, or, without a type, what it knows.
_Parcel = tuple[str, str, float, Any]


class Ros2Inbox:
    """Gives what a process of its own receives: neither Python's lock nor a busy fusion holds up the network there.

    Attributes:
        chosen: topics by what they are for, as soon as they are discovered.
        described: what the network has, in a sentence.
        fault: why nothing comes any more; empty while it does.
    """

    def __init__(self, topics: RosTopics) -> None:
        """Join the network of ``ROS_DOMAIN_ID``; topics without a name are found by their types.

        Raise `BackendError` where a message package is not installed.
        """
        for kind in (*_PICTURES, _INFO, _TF):
            interface(kind)
        self.chosen: dict[str, str] = {}
        self.fault, self.described = "", "ROS 2 has not been joined yet"
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe(duplex=False)
        self._process = context.Process(target=receive, args=(theirs, topics), name="avlmaps-ros2", daemon=True)
        self._process.start()
        theirs.close()

    def __enter__(self) -> "Ros2Inbox":
        return self

    def __exit__(self, *_: object) -> None:
        self._pipe.close()
        self._process.join(5.0)
        self._process.kill()

    def take(self, wait_s: float) -> list[Arrived]:
        """Return what arrived first since the last call, in order; waits this long where there is nothing."""
        found: list[Arrived] = []
        try:
            while len(found) < _AT_ONCE and self._pipe.poll(0.0 if found else wait_s):
                kind, type_, came_s, content = self._pipe.recv()
                if type_:
                    found.append((kind, deserialize_message(content, interface(type_)), came_s))
                elif kind == "chosen":
                    self.chosen.update(content)
                else:
                    setattr(self, kind, content)
        except (EOFError, OSError):
            self.fault = self.fault or "the receiving process ended"
        return found


def receive(pipe: Connection, topics: RosTopics) -> None:
    """Receive until the other end of a pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the map's to take
    receiver = _Receiver(pipe, topics)
    threading.Thread(target=receiver.hand_on, name="avlmaps-hand-on", daemon=True).start()
    receiver.work()


class _Receiver:
    """A node that takes messages as they are and hands them on, in the order in which they came.

    It subscribes as publishers offer: to pictures and sounds reliably where they do, so that no part of one is lost for
    good, and latched where they latch.
    """

    def __init__(self, pipe: Connection, topics: RosTopics) -> None:
        self._pipe, self._topics, self._since_s = pipe, topics, None
        self._chosen: dict[str, str] = {}
        self._known: dict[str, str] = {}  # topics that somebody publishes, and their types
        self._subscriptions: dict[str, Any] = {}
        self._waiting: SimpleQueue[_Parcel] = SimpleQueue()
        self._closed, self._bytes_in, self._bytes_out = False, 0, 0  # the last is written where the queue is emptied
        self._context, self._node, self._executor = joined("avlmaps_live")

    def hand_on(self) -> None:
        while not self._closed:
            parcel = self._waiting.get()
            self._bytes_out += len(parcel[3])
            try:
                self._pipe.send(parcel)
            except OSError:
                self._closed = True

    def work(self) -> None:
        looked_s = float("-inf")
        try:
            while not self._closed:
                if monotonic() - looked_s > _LOOK_EVERY_S:
                    self._look()
                    self._put("described", "", self._described())
                    looked_s = monotonic()
                self._executor.spin_once(timeout_sec=0.05)
        except (ExternalShutdownException, ShutdownException):
            self._put("fault", "", "rclpy was shut down")
        except Exception as fault:  # noqa: BLE001 - nobody listens any more, for any reason
            self._put("fault", "", str(fault))

    def _put(self, kind: str, type_: str, content: Any) -> None:
        if kind in ("rgb", "depth") and self._bytes_in - self._bytes_out > _MOST_BYTES:
            return  # its stamp will be missing
        self._bytes_in += len(content)
        self._waiting.put((kind, type_, monotonic(), content))

    def _described(self) -> str:
        pictures, domain = self._of(*_PICTURES), os.environ.get("ROS_DOMAIN_ID") or "0"
        if not self._known:
            return f"ROS 2's domain {domain} has no topic at all: nobody publishes there, or it cannot be reached"
        return (
            f"ROS 2's domain {domain} has the pictures {', '.join(pictures[:12]) or '(none)'} and "
            f"{len(self._known) - len(pictures)} other topics"
        )

    def _look(self) -> None:
        every, named = self._node.get_topic_names_and_types(), self._topics
        # A topic to which others listen alone does not say yet whether what it will give is latched.
        self._known = {name: kinds[0] for name, kinds in every if kinds and self._node.count_publishers(name)}
        prefix = named.pose.removesuffix("/tf") if named.pose.endswith("/tf") else ""
        for kind in ("tf", "tf_static"):
            self._choose(kind, f"{prefix}/{kind}", _TF)
        if "rgb" not in self._chosen:
            self._choose_pictures()
        if "rgb" not in self._chosen:
            return
        for kind in ("rgb", "depth"):
            self._choose(f"{kind}_info", info_beside(self._chosen[kind], self._of(_INFO)), _INFO)
        odometry = "" if self._node.count_publishers("/tf") else next(iter(self._of(_POSES[0])), "")
        self._choose("pose", named.pose or odometry, *_POSES)
        self._choose("audio", named.audio or next(iter(self._of(*_SOUNDS)), ""), *_SOUNDS)
        self._choose("directions", named.directions, *DIRECTION_TYPES)
        sound, infos = self._chosen.get("audio", ""), self._of(_SOUND_INFO)
        if sound and infos and self._known.get(sound) != _SOUNDS[0]:  # AudioStamped says by itself
            self._choose("audio_info", max(infos, key=lambda name: len(os.path.commonpath([name, sound]))), _SOUND_INFO)

    def _of(self, *types: str) -> list[str]:
        return sorted(name for name, type_ in self._known.items() if type_ in types)

    def _choose_pictures(self) -> None:
        images, named = [*self._of(_RAW), *self._of(_COMPRESSED)], self._topics
        depths = [named.depth] if named.depth else [name for name in images if "depth" in name.lower()]
        colours = [named.rgb] if named.rgb else [name for name in images if "depth" not in name.lower()]
        rgb, depth = pair_images(colours, depths)
        if not {rgb, depth} <= set(images):
            return
        self._since_s = monotonic() if self._since_s is None else self._since_s
        if monotonic() - self._since_s < _SETTLED_S and not (named.rgb and named.depth):
            return  # others of them may show a moment later
        self._choose("rgb", rgb, *_PICTURES)
        self._choose("depth", depth, *_PICTURES)

    def _choose(self, kind: str, topic: str, *types: str) -> None:
        """Subscribe to a topic of one of some types, unless another was chosen for that before."""
        if kind in self._chosen or (type_ := self._known.get(topic, "")) not in types:
            return
        offered = [one.qos_profile for one in self._node.get_publishers_info_by_topic(topic)]
        latches = bool(offered) and all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered)
        latched = latches or kind == "tf_static"
        offers = all(one.reliability == ReliabilityPolicy.RELIABLE for one in offered)
        reliable = latched or (offers and kind not in _BEST_EFFORT)
        qos = QoSProfile(
            depth=_DEPTHS.get(kind, 100),
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        arrive = partial(self._arrive, kind, type_)
        self._subscriptions[kind] = self._node.create_subscription(interface(type_), topic, arrive, qos, raw=True)
        self._chosen[kind] = topic
        self._put("chosen", "", {kind: topic})

    def _arrive(self, kind: str, type_: str, content: bytes) -> None:
        """Take a message and those behind it: poses come more often than pictures, and must not wait for these."""
        self._put(kind, type_, content)
        subscription = self._subscriptions[kind]
        with subscription.handle:
            while (more := subscription.handle.take_message(subscription.msg_type, True)) is not None:
                self._put(kind, type_, more[0])
