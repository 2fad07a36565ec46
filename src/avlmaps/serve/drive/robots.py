"""The robot that a driving server drives, by its file: a simulated one, or a real one."""

import hashlib
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

import msgspec

from avlmaps.core.errors import NavigationError
from avlmaps.core.files import user_path
from avlmaps.core.motion import GroundPose
from avlmaps.navigate.bodies import SHAPES, BodyShape
from avlmaps.navigate.brake import Brake, BrakedBody, BrakedDriver
from avlmaps.navigate.costmap import obstacles_for
from avlmaps.navigate.driver import Driver, MapDriver
from avlmaps.navigate.scenes import open_robot_scene
from avlmaps.query.avlmap import AVLMap

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.navigate.real_robots import RealDriver

_MOST_BYTES = 10_000


class RobotFile(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The content of ROBOT.json."""

    robot: Literal["simulated", "nav2", "move_base"]
    map: str | None = None
    """Name of the map that it drives by; not needed where the server has one map."""
    body: Literal["base", "drone"] = "base"
    guess: bool = False
    """Drive to the best guess where the map has no confident answer."""
    scene: str | None = None
    """Of a simulated robot: house:SEED, office:SEED or a file."""
    start: tuple[float, float, float] | None = None
    """Of a simulated robot: x, y in metres and the heading in degrees."""
    action_s: float = 0.2
    """Of a simulated robot: time of one action (0.1 m or 5 degrees), seconds."""
    ros: str = "ws://localhost:9090"
    """Of a real robot: address of rosbridge, or ``native`` for Nav2 by rclpy."""
    ros_frames: str | None = None
    """Of a real robot: file of its frames and settings (docs/robots.md), relative to this file."""

    @classmethod
    def read(cls, path: Path) -> "RobotFile":
        """Read a robot's file.

        Raises:
            NavigationError: it cannot be read, or its entries do not fit together.
        """
        try:
            with path.open("rb") as stream:
                read = msgspec.json.decode(stream.read(_MOST_BYTES), type=cls)
        except (OSError, ValueError, RecursionError) as fault:
            raise NavigationError(
                f"The robot's file {path} cannot be read ({fault}); write it as docs/guides/serve.md shows."
            ) from None
        if read.robot == "simulated" and read.scene is None:
            raise NavigationError(f"{path} names no scene for the simulated robot; add one, such as house:7.")
        if read.robot != "simulated" and (read.scene is not None or read.start is not None):
            raise NavigationError(f"In {path}, scene and start belong to a simulated robot; {read.robot} is real.")
        if not 0.0 <= read.action_s <= 10.0:
            raise NavigationError(f"In {path}, action_s is {read.action_s:g}; it is a number from 0 to 10.")
        return read


class Machine(Protocol):
    """One robot, as a driving server drives it."""

    name: str
    """As people know it."""
    identity: str
    """Another word for another robot, or another file of the same."""
    is_real: bool
    shape: BodyShape
    guess: bool

    def prepare(self, avlmap: AVLMap, version: str) -> "Obstacles":
        """Make it ready to drive by a map, and return the map's obstacles for its body.

        Raises:
            NavigationError: it cannot be reached, or cannot stand on the map.
        """
        ...

    def pose(self) -> GroundPose:
        """Where it is, level frame; `prepare` comes first."""
        ...

    def fault(self) -> str:
        """Return why it cannot be driven now, in part of a sentence; "" where it can."""
        ...

    def driver(self, brake: Brake) -> Driver:
        """Return what drives it for one order."""
        ...

    def stop(self) -> tuple[bool, str]:
        """Stop it, also where others drive it; return whether it stands, and how that is known."""
        ...

    def close(self) -> None:
        """End the connection; a movement that is under way is cancelled first."""
        ...


def open_machine(path: Path) -> "SimulatedMachine | RosMachine":
    """Return the robot of a file; nothing is connected yet.

    Raises:
        NavigationError: the file cannot be read.
    """
    read = RobotFile.read(path)
    if read.robot == "simulated":
        return SimulatedMachine(read)
    return RosMachine(read, path.parent)


def _identity(read: RobotFile, more: bytes = b"") -> str:
    return hashlib.sha256(msgspec.json.encode(read) + more).hexdigest()[:16]


class SimulatedMachine:
    """A robot in a scene, for trying. It stays where it stopped, also when the map is replaced."""

    is_real = False

    def __init__(self, read: RobotFile) -> None:
        self.name, self.identity = f"simulated robot in {read.scene}", _identity(read)
        self.shape, self.guess, self.map = SHAPES[read.body], read.guess, read.map
        self._read, self._version = read, ""
        self._driver: MapDriver | None = None
        self._body: Any = None

    def prepare(self, avlmap: AVLMap, version: str) -> "Obstacles":
        """Put the robot into the scene; see `Machine`."""
        if self._driver is None or version != self._version:
            start = self._read.start
            pose = None if start is None else GroundPose(start[0], start[1], radians(start[2]))
            pose = pose if self._body is None else self._body.pose
            robot = open_robot_scene(self._read.scene or "").robot(avlmap, self.shape, pose)
            self._driver, self._body, self._version = robot.driver, robot.driver.body, version
        return self._driver.obstacles

    def pose(self) -> GroundPose:
        """Where it is."""
        return self._body.pose

    def fault(self) -> str:
        """Return "": a simulated robot can always be driven."""
        return ""

    def driver(self, brake: Brake) -> Driver:
        """Return what drives it for one order."""
        assert self._driver is not None
        self._driver.body = BrakedBody(self._body, brake, self._read.action_s)
        return BrakedDriver(self._driver, brake)

    def stop(self) -> tuple[bool, str]:
        """Return that it stands: it moves only while an order's program runs, and the brake ends that."""
        return True, "the simulated robot moves only while an order runs"

    def close(self) -> None:
        """Do nothing."""


class RosMachine:
    """A real robot, with a guard: a second process that cancels its goals when this one dies."""

    is_real = True

    def __init__(self, read: RobotFile, folder: Path) -> None:
        """Take the file.

        Raises:
            NavigationError: the file of its frames cannot be read.
        """
        from avlmaps.navigate.real_robots import find_robot

        file = None if read.ros_frames is None else folder / user_path(read.ros_frames)
        self._robot = find_robot(read.robot, read.ros, file)
        content = b"" if file is None else file.read_bytes()
        self.name, self.identity = f"{read.robot} robot", _identity(read, content)
        self.guess, self.map = read.guess, read.map
        self.shape = SHAPES[read.body]
        self._version = ""
        self._driver: RealDriver | None = None
        self._obstacles: Obstacles | None = None

    def prepare(self, avlmap: AVLMap, version: str) -> "Obstacles":
        """Connect; see `Machine`."""
        if self._obstacles is None or self._driver is None or version != self._version:
            obstacles, before = obstacles_for(avlmap, self.shape), self._driver
            self._driver = self._robot(obstacles)
            if before is not None:  # until here a stop had one that could be used
                before.close()
            self._obstacles, self._version = obstacles, version
        return self._obstacles

    def pose(self) -> GroundPose:
        """Where it is."""
        return self._opened.pose

    @property
    def _opened(self) -> "RealDriver":
        if self._driver is None:
            raise NavigationError("The robot is not connected; check that it runs, and plan again.")
        return self._driver

    def fault(self) -> str:
        """Return why it cannot be driven now."""
        return self._opened.fault()

    def driver(self, brake: Brake) -> Driver:
        """Return what drives it for one order."""
        return BrakedDriver(self._opened, brake)

    def stop(self) -> tuple[bool, str]:
        """Cancel everything that the robot is at; return whether it is seen to stand."""
        if self._driver is None:
            return False, "the robot is not connected; use its own stop"
        arrival = self._driver.stop()
        return arrival.reached, arrival.note or "the robot confirmed and is seen to stand"

    def close(self) -> None:
        """End the connection."""
        if self._driver is not None:
            self._driver.close()
