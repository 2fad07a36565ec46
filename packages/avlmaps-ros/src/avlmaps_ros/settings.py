"""How a ROS robot is driven: names, patience and tolerances. Its speed is the robot's own affair."""

from dataclasses import dataclass, field
from math import atan2, cos, degrees, isfinite, pi, radians, sin
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.files import user_path, write_bytes_atomically
from avlmaps.core.motion import GroundPose, wrap_angle

RosKind = Literal["nav2", "move_base"]
NATIVE = "native"  # in place of an address: this machine is in the robot's ROS 2 network itself
_MOST_BYTES = 10_000
FAR_M = 1e6  # what is farther is not on Earth


@dataclass(frozen=True, slots=True)
class GroundTransform:
    """A rigid movement over the ground, named ``b_from_a``: it maps places of frame a to frame b.

    a's origin lies at x, y in b, and a's x axis is turned from b's by the yaw, counter-clockwise, in (−π, π].
    """

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.yaw_rad) and abs(self.x_m) < FAR_M and abs(self.y_m) < FAR_M):
            raise ValueError(f"({self.x_m}, {self.y_m}) m, {self.yaw_rad} rad is not a transform between two floors")
        object.__setattr__(self, "yaw_rad", wrap_angle(self.yaw_rad))

    def inverse(self) -> "GroundTransform":
        """Return ``a_from_b``."""
        c, s = cos(self.yaw_rad), sin(self.yaw_rad)
        return GroundTransform(-c * self.x_m - s * self.y_m, s * self.x_m - c * self.y_m, -self.yaw_rad)

    def pose(self, pose: GroundPose) -> GroundPose:
        x_m, y_m = self.points(np.array([pose.x_m, pose.y_m])).tolist()
        return GroundPose(x_m, y_m, pose.heading_rad + self.yaw_rad)

    def points(self, xy: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        c, s = cos(self.yaw_rad), sin(self.yaw_rad)
        return np.asarray(xy, np.float64) @ np.array([[c, s], [-s, c]]) + (self.x_m, self.y_m)

    @classmethod
    def fit(cls, in_a: Float[np.ndarray, "n 2"], in_b: Float[np.ndarray, "n 2"]) -> tuple["GroundTransform", float]:
        """Return the ``b_from_a`` that brings places known in both frames together best, by least squares.

        Return also how far off a place is left, metres (root mean square). Raise `NavigationError` where there are
        fewer than two places, or they define no direction.
        """
        a, b = np.asarray(in_a, np.float64), np.asarray(in_b, np.float64)
        if a.shape != b.shape or a.ndim != 2 or a.shape[1:] != (2,):
            raise ValueError(f"places of shape {a.shape} and {b.shape}; both must be (n, 2)")
        if len(a) < 2 or not (np.isfinite(a).all() and np.isfinite(b).all()) or np.ptp(a, axis=0).max() < 0.1:
            raise NavigationError(
                f"{len(a)} places do not define how two frames lie to each other; give two or more, metres apart."
            )
        from_a, from_b = a - a.mean(axis=0), b - b.mean(axis=0)
        sine = float((from_a[:, 0] * from_b[:, 1] - from_a[:, 1] * from_b[:, 0]).sum())
        cosine = float((from_a * from_b).sum())
        turned = cls(0.0, 0.0, atan2(sine, cosine))
        x_m, y_m = b.mean(axis=0) - turned.points(a.mean(axis=0))
        fit = cls(float(x_m), float(y_m), turned.yaw_rad)
        return fit, float(np.sqrt(((fit.points(a) - b) ** 2).sum(axis=1).mean()))


@dataclass(frozen=True, slots=True)
class Frames:
    """The robot's frames, and how they lie to the map."""

    map_frame: str = "map"  # the fixed frame in which the robot localises itself and takes goals
    base_frame: str = "base_link"  # the frame of its body; its x axis is ahead
    # How our map's level frame lies in the robot's fixed frame; the identity where the recording was made in it.
    map_from_avlmap: GroundTransform = field(default_factory=GroundTransform)

    def __post_init__(self) -> None:
        for name in ("map_frame", "base_frame"):
            bare = getattr(self, name).strip().lstrip("/")
            if not bare or len(bare) > 255:
                raise NavigationError(f"{getattr(self, name)!r} is not a frame; {name} is often {name[:4]!r}.")
            object.__setattr__(self, name, bare)
        if self.map_frame == self.base_frame:
            raise NavigationError(f"The robot's fixed frame and that of its body are both {self.map_frame!r}.")

    def to_robot(self, pose: GroundPose) -> GroundPose:
        """Take a pose from the level frame to the robot's fixed frame."""
        return self.map_from_avlmap.pose(pose)

    def to_level(self, pose: GroundPose) -> GroundPose:
        """Take a pose from the robot's fixed frame to the level frame."""
        return self.map_from_avlmap.inverse().pose(pose)

    @classmethod
    def read(cls, path: Path | str) -> "Frames":
        """Read the frames from a robot's file, as ``RosSettings.read`` does."""
        file = _RobotFile.read(path)
        return cls(file.map_frame, file.base_frame, file.map_from_avlmap.ground())

    def write(self, path: Path | str) -> None:
        """Write them to a JSON file that ``read`` takes."""
        shift = self.map_from_avlmap
        file = _RobotFile(self.map_frame, self.base_frame, _Shift(shift.x_m, shift.y_m, degrees(shift.yaw_rad)))
        write_bytes_atomically(user_path(path), msgspec.json.format(msgspec.json.encode(file), indent=2) + b"\n")


class RosSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The settings that differ from robot to robot; ``msgspec.structs.replace`` changes some.

    With each number goes the least and the most that it may be; beyond lies a slip of the unit (milliseconds, degrees).
    """

    namespace: str = ""  # of the robot's actions (``/robot1`` for ``/robot1/navigate_to_pose``)
    tf_namespace: str = ""  # of its transforms, where they are not on /tf and /tf_static
    map_topic: str = ""
    """A map or a costmap of the robot (``/map``): on it goals are moved to where the body can stand. Empty: our map."""
    radius_m: Annotated[float, 0.01, 3.0] = 0.25  # of the body, to find where it can stand on our map
    goal_timeout_s: Annotated[float, 0.1, 86_400.0] = 300.0  # a goal that is not over by then is cancelled
    answer_timeout_s: Annotated[float, 0.1, 600.0] = 10.0  # a goal that has no answer by then has nobody to take it
    cancel_timeout_s: Annotated[float, 0.1, 60.0] = 3.0  # how long to wait until a cancelled goal is over
    connect_timeout_s: Annotated[float, 0.1, 600.0] = 10.0  # how long to wait for the connection
    pose_timeout_s: Annotated[float, 0.1, 600.0] = 10.0  # how long to wait for the first pose
    pose_max_age_s: Annotated[float, 0.1, 60.0] = 3.0  # older transforms give no pose, without which it is not driven
    server_max_age_s: Annotated[float, 0.5, 60.0] = 3.0
    """A goal of which its server has said nothing for this time is lost, and cancelled."""
    heartbeat_s: Annotated[float, 0.05, 5.0] = 0.5
    """While a goal is active, a heartbeat is published on ``avlmaps/heartbeat`` once in this time."""
    stall_s: Annotated[float, 0.5, 60.0] = 3.0  # a goal is cancelled when the loop that watches it stood for so long
    reached_m: Annotated[float, 0.01, 5.0] = 0.5
    """A robot that says it has arrived must stand this near; Nav2's own tolerance is 0.25 m by default."""
    reached_rad: Annotated[float, 0.01, pi] = 0.35  # and look in the goal's direction within this angle
    speed_m_s: Annotated[float, 0.01, 2.0] = 0.15  # of Nav2's straight drives; the robot's own limits still hold

    def __post_init__(self) -> None:
        for name, such in (("namespace", "robot1"), ("tf_namespace", "robot1"), ("map_topic", "map")):
            given = getattr(self, name)
            bare = given.strip("/") if isinstance(given, str) else "?"
            if bare and not all(part.isascii() and part.isidentifier() for part in bare.split("/")):
                word = name.rpartition("_")[2]
                raise NavigationError(f"{name} is {given!r}, which is not a ROS {word}; write it as /{such}.")
            msgspec.structs.force_setattr(self, name, f"/{bare}" if bare else "")
        for number in (one for one in msgspec.structs.fields(self) if one.type is not str):
            value, (least, most) = getattr(self, number.name), number.type.__metadata__
            if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
                raise NavigationError(f"{number.name} is {value!r}; it is a number from {least:g} to {most:g}.")

    def named(self, name: str) -> str:
        return f"{self.namespace}/{name}"

    @classmethod
    def read(cls, path: Path | str) -> "RosSettings":
        """Read the ``settings`` of a robot's file. ``NavigationError``: they cannot be read, or are not right."""
        return _RobotFile.read(path).settings


class _Shift(msgspec.Struct, forbid_unknown_fields=True):
    x_m: float = 0.0
    y_m: float = 0.0
    yaw_deg: float = 0.0

    def __post_init__(self) -> None:
        self.ground()  # refused while the file is read

    def ground(self) -> GroundTransform:
        return GroundTransform(self.x_m, self.y_m, radians(self.yaw_deg))


class _RobotFile(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    map_frame: str = "map"
    base_frame: str = "base_link"
    map_from_avlmap: _Shift = msgspec.field(default_factory=_Shift)
    settings: RosSettings = RosSettings()

    @classmethod
    def read(cls, path: Path | str) -> "_RobotFile":
        try:
            with user_path(path).open("rb") as stream:
                content = stream.read(_MOST_BYTES)
            return msgspec.json.decode(content, type=cls)
        except NavigationError as fault:
            raise NavigationError(f"In the settings of {path}, {fault}") from None
        except (OSError, ValueError, RecursionError) as fault:
            is_setting = str(fault).endswith("`$.settings`")
            known = f"; the settings are {', '.join(RosSettings.__struct_fields__)}" if is_setting else ""
            raise NavigationError(
                f"The robot's file {path} cannot be read ({fault}{known}); write it as docs/robots.md shows."
            ) from None
