"""A running robot of ROS 2 as the source of a live map: a process of our own takes what its sensors publish.

Importing this module imports rclpy; only `source.open_ros2` does, for a map of a robot.
"""

import os
import signal
import threading
from collections import deque
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from time import monotonic
from typing import Any

import msgspec
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from avlmaps.recordings.formats.ros_messages import RosTopics, info_beside, pair_images
from avlmaps.recordings.formats.ros_sound import DIRECTION_TYPES
from avlmaps_ros.messages import interface

# pyright: reportMissingImports=false
_RAW, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
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
_LOOK_EVERY_S = 0.5
_SETTLED_S = 1.0  # from the first topic of pictures until the others are discovered as well
_MOST_BYTES = 500_000_000  # that wait for the map; pictures beyond are left out
_AT_ONCE = 50
_BEST_EFFORT = ("tf", "pose")
"""Small and many: a lost one is interpolated, and must not hold up those after it until it is sent again."""

Arrived = tuple[str, Any, float]  # what it is for, the message, when it came (monotonic)


class _Parcel(msgspec.Struct, array_like=True):
    """One message on its way from the receiving process; or, without a type, a fact of it: chosen, described, fault.

    It came at ``came_s`` (monotonic, which is one clock on one machine).
    """

    kind: str
    type: str
    came_s: float
    content: bytes


class Ros2Inbox:
    """Gives what a process of its own receives: neither Python's lock nor a busy fusion holds up the network there.

    Attributes:
        chosen: topics by what they are for, as soon as they are discovered.
        fault: why nothing comes any more; empty while it does.
    """

    def __init__(self, topics: RosTopics) -> None:
        """Join the network of ``ROS_DOMAIN_ID``; topics without a name are found by their types.

        Raise `BackendError` where a message package is not installed.
        """
        for kind in (_RAW, _COMPRESSED, _INFO, _TF):
            interface(kind)
        self.chosen: dict[str, str] = {}
        self.fault, self._described = "", "ROS 2 has not been joined yet"
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
                parcel = msgspec.msgpack.decode(self._pipe.recv_bytes(), type=_Parcel)
                if parcel.type:
                    message = deserialize_message(parcel.content, interface(parcel.type))
                    found.append((parcel.kind, message, parcel.came_s))
                else:
                    self._learn(parcel)
        except (EOFError, OSError):
            self.fault = self.fault or "the receiving process ended"
        return found

    def _learn(self, parcel: _Parcel) -> None:
        match parcel.kind:
            case "chosen":
                self.chosen = msgspec.msgpack.decode(parcel.content, type=dict[str, str])
            case "described":
                self._described = parcel.content.decode()
            case _:
                self.fault = parcel.content.decode()

    def described(self) -> str:
        return self._described


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
        self._known: dict[str, str] = {}
        self._subscriptions: dict[str, Any] = {}
        self._door, self._closed = threading.Condition(), False
        self._waiting: deque[_Parcel] = deque()
        self._bytes = 0
        self._context = Context()
        self._context.init(args=[])
        self._node = Node(
            f"avlmaps_live_{os.getpid()}", context=self._context, use_global_arguments=False,
            start_parameter_services=False, enable_rosout=False,
        )  # fmt: skip
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def hand_on(self) -> None:
        while not self._closed:
            with self._door:
                self._door.wait_for(lambda: bool(self._waiting))
                parcel = self._waiting.popleft()
                self._bytes -= len(parcel.content)
            try:
                self._pipe.send_bytes(msgspec.msgpack.encode(parcel))
            except OSError:
                self._closed = True

    def work(self) -> None:
        looked_s = float("-inf")
        try:
            while not self._closed:
                if monotonic() - looked_s > _LOOK_EVERY_S:
                    self._look()
                    self._say("described", self._described().encode())
                    looked_s = monotonic()
                self._executor.spin_once(timeout_sec=0.05)
        except (ExternalShutdownException, ShutdownException):
            self._say("fault", b"rclpy was shut down")
        except Exception as fault:  # noqa: BLE001 - nobody listens any more, for any reason
            self._say("fault", str(fault).encode())

    def _say(self, kind: str, content: bytes) -> None:
        self._put(_Parcel(kind, "", monotonic(), content))

    def _put(self, parcel: _Parcel) -> None:
        with self._door:
            if parcel.kind in ("rgb", "depth") and self._bytes > _MOST_BYTES:
                return  # its stamp will be missing
            self._waiting.append(parcel)
            self._bytes += len(parcel.content)
            self._door.notify_all()

    def _described(self) -> str:
        pictures = [topic for topic, kind in sorted(self._known.items()) if kind in (_RAW, _COMPRESSED)]
        others = [topic for topic in sorted(self._known) if topic not in pictures]
        domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        if not self._known:
            return f"ROS 2's domain {domain} has no topic at all: nobody publishes there, or it cannot be reached"
        return (
            f"ROS 2's domain {domain} has the pictures {', '.join(pictures[:12]) or '(none)'} and "
            f"{len(others)} other topics"
        )

    def _look(self) -> None:
        every = self._node.get_topic_names_and_types()
        # A topic to which others listen alone does not say yet whether what it will give is latched.
        self._known = {name: kinds[0] for name, kinds in every if kinds and self._node.count_publishers(name)}
        self._choose_transforms()
        if "rgb" not in self._chosen:
            self._choose_pictures()
        if "rgb" not in self._chosen:
            return
        for kind in ("rgb", "depth"):
            info = info_beside(self._chosen[kind], [name for name, type_ in self._known.items() if type_ == _INFO])
            if f"{kind}_info" not in self._chosen and info:
                self._subscribe(f"{kind}_info", info, _INFO, depth=1)
        if "pose" not in self._chosen and (pose := self._pose_topic()):
            self._subscribe("pose", pose, self._known[pose], depth=100)
        if "audio" not in self._chosen and self._topics.audio != "none":
            self._choose_sound()
        said = self._topics.directions
        if said and "directions" not in self._chosen and self._known.get(said) in DIRECTION_TYPES:
            self._subscribe("directions", said, self._known[said], depth=100)
        if "audio" in self._chosen and "audio_info" not in self._chosen:  # it may be discovered long after the sound
            self._choose_sound_info()

    def _choose_transforms(self) -> None:
        prefix = _namespace(self._topics.pose, "tf")
        for kind, latched in (("tf", None), ("tf_static", True)):
            if kind not in self._chosen and self._known.get(f"{prefix}/{kind}") == _TF:
                self._subscribe(kind, f"{prefix}/{kind}", _TF, depth=1000, latched=latched)

    def _choose_pictures(self) -> None:
        raw_first = sorted(self._known, key=lambda name: (self._known[name] == _COMPRESSED, name))
        images = [name for name in raw_first if self._known[name] in (_RAW, _COMPRESSED)]
        depths = [self._topics.depth] if self._topics.depth else [name for name in images if "depth" in name.lower()]
        colours = [self._topics.rgb] if self._topics.rgb else [n for n in images if "depth" not in n.lower()]
        if not all(name in images for name in (self._topics.rgb, self._topics.depth) if name):
            return
        rgb, depth = pair_images(colours, depths)
        if not (rgb and depth):
            return
        self._since_s = monotonic() if self._since_s is None else self._since_s
        if monotonic() - self._since_s < _SETTLED_S and not (self._topics.rgb and self._topics.depth):
            return  # others of them may show a moment later
        self._subscribe("rgb", rgb, self._known[rgb], depth=30)
        self._subscribe("depth", depth, self._known[depth], depth=30)

    def _pose_topic(self) -> str:
        named = self._topics.pose
        if named:
            return named if self._known.get(named) in _POSES else ""
        if self._node.count_publishers("/tf"):
            return ""
        return next((name for name, kind in sorted(self._known.items()) if kind == _POSES[0]), "")

    def _choose_sound(self) -> None:
        found = [name for name, kind in sorted(self._known.items()) if kind in _SOUNDS]
        wanted = self._topics.audio or next(iter(found), "")
        if wanted in found:
            self._subscribe("audio", wanted, self._known[wanted], depth=200)

    def _choose_sound_info(self) -> None:
        found = sorted(name for name, kind in self._known.items() if kind == _SOUND_INFO)
        if found and self._known.get(self._chosen["audio"]) != _SOUNDS[0]:  # AudioStamped says by itself
            info = max(found, key=lambda name: len(os.path.commonpath([name, self._chosen["audio"]])))
            self._subscribe("audio_info", info, _SOUND_INFO, depth=1)

    def _subscribe(self, kind: str, topic: str, type_: str, depth: int, latched: bool | None = None) -> None:
        offered = [one.qos_profile for one in self._node.get_publishers_info_by_topic(topic)]
        if latched is None:
            latched = bool(offered) and all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered)
        offers = all(one.reliability == ReliabilityPolicy.RELIABLE for one in offered)
        reliable = latched or (offers and kind not in _BEST_EFFORT)
        qos = QoSProfile(
            depth=depth,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        self._subscriptions[kind] = self._node.create_subscription(
            interface(type_), topic, partial(self._arrive, kind, type_), qos, raw=True
        )
        self._chosen[kind] = topic
        self._say("chosen", msgspec.msgpack.encode(self._chosen))

    def _arrive(self, kind: str, type_: str, content: bytes) -> None:
        """Take a message and those behind it: poses come more often than pictures, and must not wait for these."""
        self._put(_Parcel(kind, type_, monotonic(), content))
        subscription = self._subscriptions[kind]
        with subscription.handle:
            while (more := subscription.handle.take_message(subscription.msg_type, True)) is not None:
                self._put(_Parcel(kind, type_, monotonic(), more[0]))


def _namespace(pose: str, name: str) -> str:
    return pose.rsplit("/", 1)[0] if pose.rsplit("/", 1)[-1] == name else ""
