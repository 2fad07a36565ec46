"""Real robots, driven by what another package brings (the group ``avlmaps.robots``)."""

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import how_to_get
from avlmaps.core.registry import brought, entry_points
from avlmaps.navigate.driver import Driver
from avlmaps.navigate.interrupts import Halt

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles

ENTRY_POINT_GROUP = "avlmaps.robots"


class RealDriver(Driver, Protocol):
    """Drives a robot that moves on when nobody watches it."""

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

    def __call__(self, obstacles: "Obstacles") -> RealDriver:
        """Connect, with a guard that cancels the robot's goals when this process dies.

        Args:
            obstacles: of the map; goals are moved to where the robot can stand.

        Raises:
            NavigationError: it cannot be reached, or does not know where it is.
            BackendError: what the connection needs is not installed.
        """
        ...


def find_robot(kind: str, address: str, file: Path | None) -> RealRobot:
    """Return a robot by the name of what drives it.

    Args:
        kind: ``nav2`` or ``move_base``.
        address: of its bridge, or ``native``.
        file: its frames and settings.

    Raises:
        NavigationError: the file cannot be read.
        BackendError: the package that drives such robots is not installed.
    """
    for entry in entry_points(ENTRY_POINT_GROUP):
        if entry.name == kind:
            return brought(entry, "the robot")(address, file)
    raise BackendError(f"Robots of {kind} need a package of their own; get it with: {how_to_get('robots', kind)}")
