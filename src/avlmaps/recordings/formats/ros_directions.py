"""Directions of sounds in a bag: a topic of numbers (std_msgs) or stamped poses, as arrays with a chip publish them."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.directions import DirectionTrack
from avlmaps.recordings.formats.ros_clock import PictureClock
from avlmaps.recordings.formats.ros_messages import pose_of, stamp_of

_NUMBERS = tuple(f"std_msgs/msg/{name}" for name in ("Int32", "Int16", "Float32", "Float64"))
_POSES = ("geometry_msgs/msg/PoseStamped",)
TYPES = (*_NUMBERS, *_POSES)
BEYOND_A_TURN_RAD = 2.0 * np.pi + 1e-3


def directions_of(
    topic: str, messages: Callable[[], Iterator[tuple[int, Any]]], clock: PictureClock
) -> tuple[DirectionTrack, tuple[str, ...]]:
    """Return the directions on a topic, and notices.

    Whole numbers are degrees, since whole radians are no angles; so are floats beyond a turn. A pose's yaw is its
    azimuth, or, where it is not turned, the direction to its position.

    Args:
        topic: for sentences.
        messages: gives (received ns, message) of each.
        clock: of the pictures; numbers have no stamp of their own.

    Raises:
        RecordingError: there is no message, or they hold no angles.
    """
    received: list[float] = []
    stamped: list[float] = []
    angle: list[float] = []
    whole = True
    for received_ns, message in messages():
        received.append(received_ns * 1e-9)
        if hasattr(message, "pose"):
            stamped.append(stamp_of(message))
        value, is_whole = angle_of(message)
        angle.append(value)
        whole = whole and is_whole
    if not angle:
        raise RecordingError(f"The topic {topic} has no messages, so that it says no directions; name another.")
    at_s = clock.of_stamps(np.array(stamped)) if stamped else clock.of_received(np.array(received))
    azimuth = np.array(angle)
    order = np.argsort(at_s, kind="stable")
    at_s, azimuth = at_s[order], azimuth[order]
    used = np.isfinite(azimuth) & np.append(np.diff(at_s) > 0.0, True)
    notices: list[str] = []
    if not used.all():
        notices.append(
            f"{int((~used).sum())} of {len(used)} directions of {topic} are no numbers, or came at one moment."
        )
    at_s, azimuth = at_s[used], azimuth[used]
    if whole or np.abs(azimuth).max(initial=0.0) > BEYOND_A_TURN_RAD:
        azimuth = np.deg2rad(azimuth)
        notices.append(f"The directions of {topic} are taken as degrees.")
    return DirectionTrack.of(at_s, np.angle(np.exp(1j * azimuth))), tuple(notices)


def angle_of(message: Any) -> tuple[float, bool]:
    """Return the angle that a message says, a pose in radians, and whether it is a whole number."""
    if hasattr(message, "pose"):
        return _yaw(message), False
    return float(message.data), isinstance(message.data, int | np.integer)


def _yaw(message: Any) -> float:
    pose = pose_of(message)
    yaw = float(np.arctan2(pose[1, 0], pose[0, 0]))
    away = pose[:2, 3]
    return float(np.arctan2(away[1], away[0])) if abs(yaw) < 1e-9 and np.linalg.norm(away) > 1e-6 else yaw
