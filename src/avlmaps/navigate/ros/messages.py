"""The messages to and from rosbridge. Everything that comes from the robot is data: checked here, or left out.

Sources: the rosbridge v2 protocol; the definitions of nav2_msgs, action_msgs, actionlib_msgs, move_base_msgs and
tf2_msgs. rosbridge writes NaN as null, which no number here takes.
"""

from math import cos, sin
from typing import Annotated, Any

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose
from avlmaps.core.poses import from_quaternion
from avlmaps.core.printable import UNSAFE, printable

# Nothing that is waited for is larger; a transform tree of a humanoid is about 20 kB.
MOST_BYTES = 1_000_000
_FAR_M = 1e6
_MOST_TRANSFORMS = 2000

_Name = Annotated[str, msgspec.Meta(max_length=256)]


class Incoming(msgspec.Struct):
    """One message of the bridge; which fields it has depends on ``op``.

    Attributes:
        op: what it is.
        id: of the goal or call that it answers.
        topic: of a published message.
        msg: a published message, not yet read; the text of a status message.
        values: the result of a goal or a call, not yet read; a sentence where it failed.
        status: the end of a goal, by number; absent from old bridges, which put it into ``values``.
        result: whether the bridge could do what was requested.
        level: of a status message: error, warning, info or none.
    """

    op: _Name
    id: _Name | None = None
    topic: _Name = ""
    msg: msgspec.Raw = msgspec.Raw(b"null")
    values: msgspec.Raw = msgspec.Raw(b"null")
    status: int | None = None
    result: bool = True
    level: _Name = ""


class _Stamped(msgspec.Struct):
    frame_id: _Name


class _Vector(msgspec.Struct):
    x: float
    y: float
    z: float


class _Quaternion(msgspec.Struct):
    x: float
    y: float
    z: float
    w: float


class _Transform(msgspec.Struct):
    translation: _Vector
    rotation: _Quaternion


class _TransformStamped(msgspec.Struct):
    header: _Stamped
    child_frame_id: _Name
    transform: _Transform


class _Transforms(msgspec.Struct):
    transforms: Annotated[list[msgspec.Raw], msgspec.Meta(max_length=_MOST_TRANSFORMS)]


class _GoalId(msgspec.Struct):
    id: _Name


class GoalState(msgspec.Struct):
    """How a goal of move_base stands (actionlib_msgs/GoalStatus)."""

    goal_id: _GoalId
    status: int
    text: str = ""


class GoalStates(msgspec.Struct):
    """The states that move_base reports five times a second."""

    status_list: list[GoalState]


class GoalUpdate(msgspec.Struct):
    """A result or a feedback of move_base."""

    status: GoalState


class ActionEnd(msgspec.Struct):
    """The result of a goal of Nav2; old bridges nest it in ``result`` and put the status here."""

    status: int | None = None
    error_code: int = 0
    error_msg: str = ""
    result: msgspec.Raw = msgspec.Raw(b"null")


def transforms_in(message: msgspec.Raw) -> tuple[list[tuple[str, str, Float[np.ndarray, "4 4"]]], int]:
    """Read a message of /tf or /tf_static.

    Returns:
        Parent, child and ``parent_from_child`` of each transform, and how many were refused: NaN, no rotation.

    Raises:
        msgspec.MsgspecError: it is no such message.
    """
    raws = msgspec.json.decode(message, type=_Transforms).transforms
    read, refused = [], 0
    for raw in raws:
        try:
            stamped = msgspec.json.decode(raw, type=_TransformStamped)
            parent, child = stamped.header.frame_id.lstrip("/"), stamped.child_frame_id.lstrip("/")
            read.append((parent, child, _rigid(stamped.transform)))
        except ValueError:
            refused += 1
    return read, refused


def _rigid(transform: _Transform) -> Float[np.ndarray, "4 4"]:
    shift, turn = transform.translation, transform.rotation
    place = np.array([shift.x, shift.y, shift.z])
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w])
    if not np.abs(place).max() < _FAR_M or not abs(float(np.linalg.norm(quaternion)) - 1.0) < 0.05:
        raise ValueError("no rigid transform")
    return from_quaternion(place, quaternion)


def stamped_pose(pose: GroundPose, frame: str, ros: int) -> dict[str, Any]:
    """Return a geometry_msgs/PoseStamped; its stamp of zero means the latest.

    Args:
        pose: in that frame.
        frame: the robot's fixed frame.
        ros: 1 or 2; they name the parts of a stamp differently.
    """
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


def text_in(raw: msgspec.Raw, most: int = 200) -> str:
    """Return the text of a value, fit to be shown in one sentence; empty where it is none."""
    try:
        text = msgspec.json.decode(raw, type=str)
    except ValueError:
        return ""
    return sanitize_line(text, most)


def sanitize_line(text: str, most: int = 200) -> str:
    """Return a text from outside on one line, nothing in it but what is seen, and not too long."""
    return printable(" ".join(UNSAFE.sub(" ", text).split()), most)
