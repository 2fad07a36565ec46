"""How a ROS robot is driven: names, patience and tolerances. Its speed is the robot's own affair."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any, Self

from avlmaps.core.errors import NavigationError
from avlmaps_ros.frames import RosRobotFile

# The least and the most that each number may be; beyond lies a slip of the unit (milliseconds, centimetres, degrees).
_RANGES: Mapping[str, tuple[float, float]] = {
    "radius_m": (0.01, 3.0),
    "goal_timeout_s": (0.1, 86_400.0),
    "answer_timeout_s": (0.1, 600.0),
    "cancel_timeout_s": (0.1, 60.0),
    "connect_timeout_s": (0.1, 600.0),
    "pose_timeout_s": (0.1, 600.0),
    "pose_max_age_s": (0.1, 60.0),
    "server_max_age_s": (0.5, 60.0),
    "heartbeat_s": (0.05, 5.0),
    "stall_s": (0.5, 60.0),
    "reached_m": (0.01, 5.0),
    "reached_rad": (0.01, pi),
    "speed_m_s": (0.01, 2.0),
}


@dataclass(frozen=True, slots=True)
class RosSettings:
    """The settings that differ from robot to robot."""

    namespace: str = ""
    """Of the robot's actions (``/robot1`` for ``/robot1/navigate_to_pose``)."""
    tf_namespace: str = ""
    """Of its transforms, where they are not on /tf and /tf_static."""
    map_topic: str = ""
    """A map or a costmap of the robot (``/map``): on it goals are moved to where the body can stand. Empty: our map."""
    radius_m: float = 0.25
    """Of the body, to find where it can stand on our map; the robot plans with its own distances."""
    goal_timeout_s: float = 300.0
    """A goal that is not over by then is cancelled."""
    answer_timeout_s: float = 10.0
    """A goal that has no answer by then has nobody to take it, seconds."""
    cancel_timeout_s: float = 3.0
    """How long to wait until a cancelled goal is over."""
    connect_timeout_s: float = 10.0
    """How long to wait for the connection."""
    pose_timeout_s: float = 10.0
    """How long to wait for the first pose."""
    pose_max_age_s: float = 3.0
    """Transforms that are older give no pose; the robot is not driven without one."""
    server_max_age_s: float = 3.0
    """A goal of which its server has said nothing for this time is lost, and cancelled."""
    heartbeat_s: float = 0.5
    """While a goal is active, a heartbeat is published on ``avlmaps/heartbeat`` once in this time."""
    stall_s: float = 3.0
    """A goal is cancelled when the loop that watches it did not run for this time."""
    reached_m: float = 0.5
    """A robot that says it has arrived must stand this near; Nav2's own tolerance is 0.25 m by default."""
    reached_rad: float = 0.35
    """And look in the goal's direction within this angle, radians."""
    speed_m_s: float = 0.15
    """For Nav2's straight drives, which need a speed; the robot's own limits still hold."""

    def __post_init__(self) -> None:
        namespace, topic = ("namespace", "robot1"), ("topic", "map")
        for name, (word, such) in {"namespace": namespace, "tf_namespace": namespace, "map_topic": topic}.items():
            given = getattr(self, name)
            bare = given.strip("/") if isinstance(given, str) else "?"
            if bare and not all(part.isascii() and part.isidentifier() for part in bare.split("/")):
                raise NavigationError(f"{name} is {given!r}, which is not a ROS {word}; write it as /{such}.")
            object.__setattr__(self, name, f"/{bare}" if bare else "")
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
                raise NavigationError(f"{name} is {value!r}; it is a number from {least:g} to {most:g}.")

    @classmethod
    def read(cls, path: Path | str) -> Self:
        """Read what a robot's file sets, by the names above, under ``settings``.

        Raises:
            NavigationError: the file cannot be read, or sets what there is not.
        """
        given: dict[str, Any] = RosRobotFile.read(path).settings
        unknown = sorted(set(given) - set(cls.__slots__))
        if unknown:
            known = ", ".join(cls.__slots__)
            raise NavigationError(
                f"{path} sets {unknown[0]!r}, which is not a setting of a robot; the settings are {known}."
            )
        try:
            return cls(**given)
        except NavigationError as fault:
            raise NavigationError(f"In the settings of {path}, {fault}") from None
