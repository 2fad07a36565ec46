"""Directions of sounds out of the messages of a device."""

from collections.abc import Callable
from math import radians
from typing import Any

from avlmaps.core.motion import wrap_angle
from avlmaps.live.growing_folder import Once
from avlmaps.recordings.formats.ros_messages import stamp_of
from avlmaps.recordings.formats.ros_sound import BEYOND_A_TURN_RAD, angle_of

HELD = 100
"""Floats that wait until one is no angle in radians; if all are, they are taken as radians."""


class RosDirections:
    """Reads the azimuths on one topic, in radians, as a bag's are read, and says when each was.

    Whole numbers are degrees. Floats are radians unless one is beyond a turn, so that the first ones are held back.

    Attributes:
        unread: messages that came before the first picture, whose clock is that of the map.
    """

    def __init__(self, topic: str, tell: Callable[[str], None]) -> None:
        """Begin without directions.

        Args:
            topic: name, for sentences.
            tell: called with a sentence where angles are taken as degrees.
        """
        self.unread = 0
        self._topic, self._once = topic, Once(tell)
        self._held: list[tuple[float, float]] | None = []
        self._in_degrees = False

    def take(self, message: Any, ahead_s: float | None, now_s: float) -> list[tuple[float, float]]:
        """Return the directions that are known now: when, and the azimuth in radians.

        Args:
            message: of std_msgs numbers, or a PoseStamped.
            ahead_s: by how much the pictures' stamps are ahead of this machine's clock; None before the first.
            now_s: by this machine's clock.
        """
        angle, is_whole = angle_of(message)
        if hasattr(message, "pose"):
            return [(stamp_of(message), angle)]
        if ahead_s is None:
            self.unread += 1
            return []
        if (is_whole or abs(angle) > BEYOND_A_TURN_RAD) and not self._in_degrees:
            self._in_degrees = True
            late = "" if self._held is not None else " from now on; those before were taken as radians"
            self._once(f"The directions of {self._topic} are taken as degrees{late}.")
        one = now_s + ahead_s, angle
        if self._held is None:
            return [self._in_radians(one)]
        self._held.append(one)
        return self.rest() if self._in_degrees or len(self._held) >= HELD else []

    def rest(self) -> list[tuple[float, float]]:
        """Return those that are held back; from now on none is."""
        held, self._held = self._held or [], None
        return [self._in_radians(one) for one in held]

    def _in_radians(self, one: tuple[float, float]) -> tuple[float, float]:
        stamp_s, angle = one
        return stamp_s, wrap_angle(radians(angle) if self._in_degrees else angle)
