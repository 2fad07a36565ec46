"""The robot that a driving server drives, by its file: a simulated one, or a real one."""

import hashlib
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec

from avlmaps.core.errors import NavigationError
from avlmaps.core.files import user_path
from avlmaps.core.motion import GroundPose
from avlmaps.navigate.costmap import SHAPES, obstacles_for
from avlmaps.navigate.robots import RealRobot, RobotDriver, find_robot, open_robot_scene
from avlmaps.query.avlmap import AVLMap

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles

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
        """Read a robot's file, or raise ``NavigationError`` where its entries do not fit together."""
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


class Machine:
    """One robot, as a driving server drives it, by its file.

    A simulated one stays where it stopped, also when the map is replaced. A real one has a guard: a second process that
    cancels its goals when this one dies. ``identity`` is another word for another robot, or another file of the same.
    """

    def __init__(self, path: Path) -> None:
        self._read = read = RobotFile.read(path)
        self.is_real = read.robot != "simulated"
        self.name = f"{read.robot} robot" if self.is_real else f"simulated robot in {read.scene}"
        self.shape, self.guess, self.map = SHAPES[read.body], read.guess, read.map
        self.pace_s, frames = 0.0 if self.is_real else read.action_s, b""
        self._real: RealRobot | None = None
        if self.is_real:
            file = None if read.ros_frames is None else path.parent / user_path(read.ros_frames)
            self._real = find_robot(read.robot, read.ros, file)
            frames = b"" if file is None else file.read_bytes()
        self.identity = hashlib.sha256(msgspec.json.encode(read) + frames).hexdigest()[:16]
        self._connected: tuple[str, Obstacles, RobotDriver] | None = None

    def prepare(self, avlmap: AVLMap, version: str) -> "Obstacles":
        """Make it ready to drive by a map, and return the map's obstacles for its body.

        Raises:
            NavigationError: it cannot be reached, or cannot stand on the map.
        """
        before = self._connected
        if before is not None and before[0] == version:
            return before[1]
        obstacles, driver = self._driver_on(avlmap)
        self._connected = version, obstacles, driver
        if before is not None:  # until here a stop had one that could be used
            before[2].close()
        return obstacles

    def _driver_on(self, avlmap: AVLMap) -> "tuple[Obstacles, RobotDriver]":
        if self._real is not None:
            obstacles = obstacles_for(avlmap, self.shape)
            return obstacles, self._real(obstacles)
        start = None
        if self._connected is not None:
            start = self.driver.pose
        elif self._read.start is not None:
            x_m, y_m, heading_deg = self._read.start
            start = GroundPose(x_m, y_m, radians(heading_deg))
        driver = open_robot_scene(self._read.scene or "").robot(avlmap, self.shape, start)
        return driver.obstacles, driver

    @property
    def driver(self) -> RobotDriver:
        """What drives it; ``NavigationError`` where it is not connected."""
        if self._connected is None:
            raise NavigationError("The robot is not connected; check that it runs, and plan again.")
        return self._connected[2]

    def stop(self) -> tuple[bool, str]:
        """Stop it, also where others drive it; return whether it stands, and how that is known."""
        if self._connected is None:
            return False, "the robot is not connected; use its own stop"
        if not self.is_real:  # the brake ends the order, and nothing else moves it
            return True, self.driver.halt().note
        arrival = self.driver.stop()
        return arrival.reached, arrival.note or "the robot confirmed and is seen to stand"

    def close(self) -> None:
        """End the connection; a movement that is under way is cancelled first."""
        if self._connected is not None:
            self.driver.close()
