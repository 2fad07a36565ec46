"""Scenes in which a simulated robot drives: opened by what another package brings (the group ``avlmaps.scenes``)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.extras import SIMULATOR, install_command
from avlmaps.core.motion import GroundPose
from avlmaps.core.registry import brought, entry_points
from avlmaps.maps.obstacles import Obstacles
from avlmaps.navigate.bodies import BASE, BodyShape
from avlmaps.navigate.driver import MapDriver

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

ENTRY_POINT_GROUP = "avlmaps.scenes"


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedRobot:
    """A robot that stands in a scene.

    Attributes:
        driver: drives it by the map.
        start: where it stands at first, level frame.
        obstacles: what the map knows to stand in its way.
    """

    driver: MapDriver
    start: GroundPose
    obstacles: Obstacles

    @property
    def contacts(self) -> Float[np.ndarray, "m 2"]:
        """The places where it touched something that the map does not know, level x and y."""
        return self.obstacles.origin_m + (np.argwhere(self.driver.contacts.cells) + 0.5) * self.obstacles.cell_size_m


class RobotScene(Protocol):
    """A scene that a robot can be put into."""

    def robot(self, avlmap: "AVLMap", shape: BodyShape = BASE, start: GroundPose | None = None) -> SimulatedRobot:
        """Put a robot into the scene.

        Args:
            avlmap: the map of it; by this alone the robot finds its way.
            shape: of the body.
            start: where it stands at first; by default a free place near that where the map's walk began.

        Raises:
            AvlmapsError: the scene and the map do not lie in the same frame, or the robot cannot stand at the start.
        """
        ...


def open_robot_scene(name: str) -> RobotScene:
    """Open a scene by its name, such as ``house:7``.

    Raises:
        AvlmapsError: there is no such scene, or nothing that opens scenes is installed.
    """
    for entry in entry_points(ENTRY_POINT_GROUP):
        return brought(entry, "the simulator", NavigationError)(name)
    get = install_command(distribution=SIMULATOR.name)
    raise NavigationError(f"The scene {name} cannot be opened, since no simulator is installed; get it with: {get}")
