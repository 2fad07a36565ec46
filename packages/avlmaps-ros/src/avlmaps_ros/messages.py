"""The messages to and from rosbridge. Everything that comes from the robot is data: checked here, or left out.

Sources: the rosbridge v2 protocol; the definitions of nav2_msgs, action_msgs, actionlib_msgs, move_base_msgs and
tf2_msgs. rosbridge writes NaN as null, which no number here takes.
"""

from base64 import b64decode
from dataclasses import dataclass
from importlib import import_module
from math import cos, sin
from types import ModuleType
from typing import Annotated, Any, TypeVar

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import BackendError
from avlmaps.core.motion import GroundPose
from avlmaps.core.poses import from_quaternion
from avlmaps.core.printable import UNSAFE, printable
from avlmaps_ros.settings import FAR_M

_T = TypeVar("_T")


def with_rclpy(module: str, asked: str, otherwise: str) -> ModuleType:
    """Return a module that needs rclpy. ``BackendError``: this Python has none, and what can be done ``otherwise``."""
    try:
        return import_module(module)
    except ImportError as fault:
        raise BackendError(
            f"{asked} needs ROS 2's rclpy in this Python ({fault}); source /opt/ros/$ROS_DISTRO/setup.bash and use the "
            f"Python that ROS 2 was built for (Jazzy: 3.12), or {otherwise}."
        ) from None


def interface(kind: str) -> Any:
    """Return the class of ``tf2_msgs/msg/TFMessage`` and the like. ``BackendError``: its package is not installed."""
    package, part, name = kind.split("/")
    try:
        return getattr(import_module(f"{package}.{part}"), name)
    except (ImportError, AttributeError) as fault:
        raise BackendError(
            f"ROS 2 has no {kind} here ({fault}); install its package, `apt install ros-$ROS_DISTRO-"
            f"{package.replace('_', '-')}`, and source ROS 2's setup.bash."
        ) from None


def read(message: Any, kind: type[_T]) -> _T:
    """Read a message of rosbridge, in JSON, or of rclpy. ``ValueError``: it is none of that kind."""
    if isinstance(message, msgspec.Raw):
        return msgspec.json.decode(message, type=kind)
    return msgspec.convert(message, kind, from_attributes=True)


# Nothing that is waited for is larger; a transform tree of a humanoid is about 20 kB.
MOST_BYTES = 1_000_000
_MOST_TRANSFORMS = 2000

_Name = Annotated[str, msgspec.Meta(max_length=256)]


class Incoming(msgspec.Struct):
    """One message of the bridge; which fields it has depends on ``op``."""

    op: _Name
    id: _Name | None = None
    topic: _Name = ""
    msg: msgspec.Raw = msgspec.Raw(b"null")  # a published message; the text of a status message
    values: msgspec.Raw = msgspec.Raw(b"null")  # the result of a goal or a call; a sentence where it failed
    status: int | None = None
    result: bool = True  # whether the bridge could do what was requested
    level: _Name = ""  # of a status message: error, warning, info or none


class _Time(msgspec.Struct):
    """ROS 2 names the parts ``sec`` and ``nanosec``, ROS 1 ``secs`` and ``nsecs``."""

    sec: int = 0
    nanosec: int = 0
    secs: int = 0
    nsecs: int = 0

    @property
    def seconds(self) -> float:
        return self.sec + self.secs + 1e-9 * (self.nanosec + self.nsecs)


class Stamped(msgspec.Struct):
    """A std_msgs/Header."""

    frame_id: _Name
    stamp: _Time = msgspec.field(default_factory=_Time)


class Vector(msgspec.Struct):
    """A geometry_msgs/Vector3 or Point."""

    x: float
    y: float
    z: float


class Quaternion(Vector):
    """A geometry_msgs/Quaternion."""

    w: float


class _Transform(msgspec.Struct):
    translation: Vector
    rotation: Quaternion


class _TransformStamped(msgspec.Struct):
    header: Stamped
    child_frame_id: _Name
    transform: _Transform


class _Transforms(msgspec.Struct):
    transforms: Annotated[list[Any], msgspec.Meta(max_length=_MOST_TRANSFORMS)]


class Clock(msgspec.Struct):
    """A rosgraph_msgs/Clock: the time of a simulation."""

    clock: _Time


class Text(msgspec.Struct):
    """A std_msgs/String."""

    data: Annotated[str, msgspec.Meta(max_length=256)]


class _GoalId(msgspec.Struct):
    id: _Name


class _Uuid(msgspec.Struct):
    uuid: Any  # sixteen numbers, or base 64

    @property
    def hex(self) -> str:
        try:
            raw = b64decode(self.uuid, validate=True) if isinstance(self.uuid, str) else bytes(list(self.uuid))
        except (TypeError, ValueError):
            raise ValueError("no UUID") from None
        return raw.hex()


class _GoalInfo(msgspec.Struct):
    goal_id: _Uuid


class GoalState(msgspec.Struct):
    """How a goal stands: actionlib_msgs/GoalStatus of ROS 1 has ``goal_id``, action_msgs/GoalStatus ``goal_info``."""

    status: int
    goal_id: _GoalId | None = None
    goal_info: _GoalInfo | None = None
    text: str = ""

    @property
    def name(self) -> str:
        """The server's name for the goal; of ROS 2 in hexadecimal digits. ``ValueError``: it has none."""
        if self.goal_id is not None:
            return self.goal_id.id
        if self.goal_info is None:
            raise ValueError("a goal without a name")
        return self.goal_info.goal_id.hex


class GoalStates(msgspec.Struct):
    """The goals of an action server: move_base lists them five times a second, ROS 2 at each change."""

    status_list: list[GoalState]


class GoalUpdate(msgspec.Struct):
    """A result or a feedback of move_base."""

    status: GoalState


class CancelAnswer(msgspec.Struct):
    """The answer of action_msgs/CancelGoal."""

    return_code: int = 0


class ActionEnd(msgspec.Struct):
    """The result of a goal of Nav2; old bridges nest it in ``result`` and put the status here."""

    status: int | None = None
    error_code: int = 0
    error_msg: str = ""
    result: msgspec.Raw = msgspec.Raw(b"null")


@dataclass(frozen=True, slots=True, eq=False)
class Transform:
    """One transform of /tf or /tf_static, in metres; its stamp by the robot's clock is 0 where there is none."""

    parent: str
    child: str
    parent_from_child: Float[np.ndarray, "4 4"]
    stamp_s: float = 0.0


def transforms_in(message: Any) -> tuple[list[Transform], int]:
    """Return the transforms of a message of /tf or /tf_static, and how many were refused: NaN, no rotation."""
    found, refused = [], 0
    for one in read(message, _Transforms).transforms:
        try:
            found.append(_transform_of(read(one, _TransformStamped)))
        except ValueError:
            refused += 1
    return found, refused


def _transform_of(stamped: _TransformStamped) -> Transform:
    place, turn = stamped.transform.translation, stamped.transform.rotation
    xyz = np.array([place.x, place.y, place.z], np.float64)
    xyzw = np.array([turn.x, turn.y, turn.z, turn.w], np.float64)
    if not np.abs(xyz).max() < FAR_M or not abs(float(np.linalg.norm(xyzw)) - 1.0) < 0.05:
        raise ValueError("no rigid transform")
    parent, child = stamped.header.frame_id.lstrip("/"), stamped.child_frame_id.lstrip("/")
    return Transform(parent, child, from_quaternion(xyz, xyzw), stamped.header.stamp.seconds)


def stamped_pose(pose: GroundPose, frame: str, ros: int) -> dict[str, Any]:
    """Return a geometry_msgs/PoseStamped; its stamp of zero means the latest."""
    stamp = {"secs": 0, "nsecs": 0} if ros == 1 else {"sec": 0, "nanosec": 0}
    half = 0.5 * pose.heading_rad
    return {
        "header": {"stamp": stamp, "frame_id": frame},
        "pose": {
            "position": {"x": pose.x_m, "y": pose.y_m, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": sin(half), "w": cos(half)},
        },
    }


def duration(seconds: float) -> dict[str, int]:
    """Return a builtin_interfaces/Duration."""
    whole = int(seconds)
    return {"sec": whole, "nanosec": int((seconds - whole) * 1e9)}


def text_in(raw: msgspec.Raw) -> str:
    """Return the text of a value, fit to be shown in one sentence; empty where it is none."""
    try:
        return sanitize_line(msgspec.json.decode(raw, type=str))
    except ValueError:
        return ""


def sanitize_line(text: str, most: int = 200) -> str:
    """Return a text from outside on one line, nothing in it but what is seen, and not too long."""
    return printable(" ".join(UNSAFE.sub(" ", text).split()), most)
