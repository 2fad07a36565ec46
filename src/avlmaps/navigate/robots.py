"""Robots that other packages bring: simulated ones in a scene (``avlmaps.scenes``), real ones (``avlmaps.robots``)."""

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.extras import SIMULATOR, how_to_get, install_command
from avlmaps.core.motion import GroundPose
from avlmaps.core.registry import brought, entry_points
from avlmaps.maps.obstacles import BodyShape
from avlmaps.navigate.costmap import BASE
from avlmaps.navigate.driver import Driver, Holdable, MapDriver
from avlmaps.navigate.interrupts import Halt

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.query.avlmap import AVLMap

SCENES_GROUP, ROBOTS_GROUP = "avlmaps.scenes", "avlmaps.robots"


class RobotDriver(Driver, Holdable, Protocol):
    """Drives a robot that may move on when nobody watches it, and whose movement under way can be ended."""

    def fault(self) -> str:
        """Return why the robot cannot be driven now, in part of a sentence; "" where it can."""
        ...

    def halt(self) -> Halt:
        """Return whether the robot stands after its last movement, which was called off if it was interrupted."""
        ...

    @property
    def owes(self) -> bool:
        """Whether a goal was sent whose end the robot has not confirmed, so that it may still be driving."""
        ...

    def close(self) -> None:
        """End the connection; a goal that is not over is called off first."""
        ...


class RealRobot(Protocol):
    """A robot whose address and file are read, and to which nothing is connected yet.

    An entry point is called with an address and a file, or None, and returns one.
    """

    def __call__(self, obstacles: "Obstacles") -> RobotDriver:
        """Connect, with a guard that cancels the robot's goals when this process dies.

        Goals are moved to where the robot can stand among the map's obstacles. It raises ``NavigationError`` where the
        robot cannot be reached, or does not know where it is, ``BackendError`` where a package is missing.
        """
        ...


def find_robot(kind: str, address: str, file: Path | None) -> RealRobot:
    """Return a robot by what drives it (``nav2`` or ``move_base``), the address of its bridge, or ``native``, its file.

    Raises:
        NavigationError: the file cannot be read.
        BackendError: the package that drives such robots is not installed.
    """
    for entry in entry_points(ROBOTS_GROUP).select(name=kind):
        return brought(entry, "the robot")(address, file)
    raise BackendError(f"Robots of {kind} need a package of their own; get it with: {how_to_get('robots', kind)}")


class RobotScene(Protocol):
    """A scene that a robot can be put into."""

    def robot(self, avlmap: "AVLMap", shape: BodyShape = BASE, start: GroundPose | None = None) -> MapDriver:
        """Put a robot into the scene, and return what drives it by the map alone.

        By default it starts at a free place near that where the map's walk began.

        Raises:
            AvlmapsError: the scene and the map do not lie in the same frame, or the robot cannot stand at the start.
        """
        ...


def open_robot_scene(name: str) -> RobotScene:
    """Open a scene by its name, such as ``house:7``; ``AvlmapsError`` where there is none, or no simulator."""
    for entry in entry_points(SCENES_GROUP):
        return brought(entry, "the simulator", NavigationError)(name)
    get = install_command(distribution=SIMULATOR.name)
    raise NavigationError(f"The scene {name} cannot be opened, since no simulator is installed; get it with: {get}")
