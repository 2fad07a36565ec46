"""A running robot of ROS 2 as the source of a live map: a node of our own takes what its sensors publish.

Importing this module imports rclpy; only `ros_source.open_ros2` does, for a map of a robot.
"""

import os
import threading
from collections import deque
from functools import partial
from time import monotonic
from typing import Any

from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from avlmaps.recordings.formats.ros_messages import RosTopics, info_beside, pair_images
from avlmaps.recordings.formats.ros_sound import DIRECTION_TYPES
from avlmaps_ros.interfaces import interface

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
_MOST = {"rgb": 8, "depth": 8}  # pictures are large: the oldest is dropped for the newest
_MOST_OTHERS = 2000

Arrived = tuple[str, Any, float]  # what it is for, the message, when it came (monotonic)


class Ros2Inbox:
    """A node that stores what arrives until it is taken, in a thread of its own.

    It subscribes as sensors publish: best effort, which receives from reliable publishers as well, and a lost picture
    does not hold up those after it. What is latched is received as latched.

    Attributes:
        chosen: topics by what they are for, as soon as they are discovered.
        lost: pictures that were dropped for newer ones before they were taken.
        fault: why nothing comes any more; empty while it does.
    """

    def __init__(self, topics: RosTopics) -> None:
        """Join the network of ``ROS_DOMAIN_ID``.

        Args:
            topics: by name; the others are found by their types.

        Raises:
            BackendError: a message package is not installed.
        """
        self.chosen: dict[str, str] = {}
        self.lost, self.fault = 0, ""
        self._topics, self._since_s = topics, None
        self._known: dict[str, str] = {}
        self._held: dict[str, deque[Arrived]] = {}
        self._door, self._closed = threading.Condition(), False
        self._context = Context()
        self._context.init(args=[])
        self._node = Node(
            f"avlmaps_live_{os.getpid()}", context=self._context, use_global_arguments=False,
            start_parameter_services=False, enable_rosout=False,
        )  # fmt: skip
        self._subscribe("tf", f"{_namespace(topics.pose, 'tf')}/tf", _TF, depth=100)
        self._subscribe("tf_static", f"{_namespace(topics.pose, 'tf')}/tf_static", _TF, depth=100, latched=True)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._work, name="avlmaps-ros2-live", daemon=True)
        self._thread.start()

    def __enter__(self) -> "Ros2Inbox":
        return self

    def __exit__(self, *_: object) -> None:
        self._closed = True
        self._thread.join(5.0)
        self._executor.shutdown(timeout_sec=2.0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def take(self, wait_s: float) -> list[Arrived]:
        """Return what arrived since the last call, in the order of time; waits this long where there is nothing."""
        with self._door:
            if not any(self._held.values()):
                self._door.wait(wait_s)
            every = sorted((one for held in self._held.values() for one in held), key=lambda one: one[2])
            for held in self._held.values():
                held.clear()
        return every

    def described(self) -> str:
        """Return what is there, as part of a sentence."""
        pictures = [topic for topic, kind in sorted(self._known.items()) if kind in (_RAW, _COMPRESSED)]
        others = [topic for topic in sorted(self._known) if topic not in pictures]
        domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        if not self._known:
            return f"ROS 2's domain {domain} has no topic at all: nobody publishes there, or it cannot be reached"
        return (
            f"ROS 2's domain {domain} has the pictures {', '.join(pictures[:12]) or '(none)'} and "
            f"{len(others)} other topics"
        )

    def _work(self) -> None:
        looked_s = float("-inf")
        try:
            while not self._closed:
                if monotonic() - looked_s > _LOOK_EVERY_S:
                    self._look()
                    looked_s = monotonic()
                self._executor.spin_once(timeout_sec=0.05)
        except (ExternalShutdownException, ShutdownException):
            self.fault = "rclpy was shut down"
        except Exception as fault:  # noqa: BLE001 - nobody listens any more, for any reason
            self.fault = str(fault)

    def _look(self) -> None:
        """Subscribe to what is wanted and has been discovered."""
        every = self._node.get_topic_names_and_types()
        # A topic to which others listen alone does not say yet whether what it will give is latched.
        self._known = {name: kinds[0] for name, kinds in every if kinds and self._node.count_publishers(name)}
        if "rgb" not in self.chosen:
            self._choose_pictures()
        if "rgb" not in self.chosen:
            return
        for kind in ("rgb", "depth"):
            info = info_beside(self.chosen[kind], [name for name, type_ in self._known.items() if type_ == _INFO])
            if f"{kind}_info" not in self.chosen and info:
                self._subscribe(f"{kind}_info", info, _INFO, depth=1)
        if "pose" not in self.chosen and (pose := self._pose_topic()):
            self._subscribe("pose", pose, self._known[pose], depth=100)
        if "audio" not in self.chosen and self._topics.audio != "none":
            self._choose_sound()
        said = self._topics.directions
        if said and "directions" not in self.chosen and self._known.get(said) in DIRECTION_TYPES:
            self._subscribe("directions", said, self._known[said], depth=100)
        if "audio" in self.chosen and "audio_info" not in self.chosen:  # it may be discovered long after the sound
            self._choose_sound_info()

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
        self._subscribe("rgb", rgb, self._known[rgb], depth=5)
        self._subscribe("depth", depth, self._known[depth], depth=5)

    def _pose_topic(self) -> str:
        """Return the topic of poses: the named one, or odometry where nobody publishes transforms."""
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
        """Take the AudioInfo of the sound's own namespace rather than another."""
        found = sorted(name for name, kind in self._known.items() if kind == _SOUND_INFO)
        if found and self._known.get(self.chosen["audio"]) != _SOUNDS[0]:  # AudioStamped says by itself
            info = max(found, key=lambda name: len(os.path.commonpath([name, self.chosen["audio"]])))
            self._subscribe("audio_info", info, _SOUND_INFO, depth=1)

    def _subscribe(self, kind: str, topic: str, type_: str, depth: int, latched: bool | None = None) -> None:
        if latched is None:
            offered = [one.qos_profile.durability for one in self._node.get_publishers_info_by_topic(topic)]
            latched = bool(offered) and all(one == DurabilityPolicy.TRANSIENT_LOCAL for one in offered)
        qos = QoSProfile(
            depth=depth,
            reliability=ReliabilityPolicy.RELIABLE if latched else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        self._held[kind] = deque(maxlen=_MOST.get(kind, _MOST_OTHERS))
        self._node.create_subscription(interface(type_), topic, partial(self._arrive, kind), qos)
        self.chosen[kind] = topic

    def _arrive(self, kind: str, message: Any) -> None:
        with self._door:
            held = self._held[kind]
            if kind in _MOST and len(held) == held.maxlen:
                self.lost += 1
            held.append((kind, message, monotonic()))
            self._door.notify_all()


def _namespace(pose: str, name: str) -> str:
    """Return the namespace of a named topic of transforms (``/robot1/tf``), or nothing."""
    return pose.rsplit("/", 1)[0] if pose.rsplit("/", 1)[-1] == name else ""
