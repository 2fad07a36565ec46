"""A body under watch: what it touched, and whether the map had foretold it."""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.motion import FORWARD_M, Action, GroundPose, Moved
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.navigate.bodies import Body

_EXACT_M = 1e-6


@dataclass(frozen=True, eq=False)
class Foreknowledge:
    """The obstacles that a map knows before a robot drives.

    Attributes:
        obstacles: the map's own grid.
        radius_m: of the robot.
    """

    obstacles: Obstacles
    radius_m: float

    def room_m(self, xy: tuple[float, float]) -> float:
        """Return the distance from a place (level x and y) to the nearest occupied cell, inf beyond the radius."""
        cell_m, origin = self.obstacles.cell_size_m, self.obstacles.origin_m
        at = np.asarray(xy, np.float64) - origin
        low = np.maximum(np.floor((at - self.radius_m) / cell_m).astype(np.int64), 0)
        high = np.maximum(np.floor((at + self.radius_m) / cell_m).astype(np.int64) + 1, 0)
        near = self.obstacles.states[low[0] : high[0], low[1] : high[1]] == CellState.OCCUPIED
        corner = (np.argwhere(near) + low) * cell_m
        if not len(corner):
            return np.inf
        apart = np.maximum(np.maximum(corner - at, at - corner - cell_m), 0.0)
        return float(np.linalg.norm(apart, axis=1).min())

    def foretells(self, xy: tuple[float, float]) -> bool:
        """Return whether the map shows an obstacle within the robot's radius of a place (level x and y)."""
        return self.room_m(xy) < self.radius_m - _EXACT_M


class WatchedBody:
    """Passes every movement on to a body and counts what it touched.

    Args:
        body: the body.
        known: what the map knew.
    """

    def __init__(self, body: Body, known: Foreknowledge) -> None:
        self._body, self._known = body, known
        self.contacts = 0
        self.foretold = 0

    @property
    def pose(self) -> GroundPose:
        """Where the body is."""
        return self._body.pose

    def act(self, action: Action) -> Moved:
        """Take an action."""
        aimed = self.pose.ahead(FORWARD_M) if action is Action.FORWARD else self.pose
        return self._counted(aimed, self._body.act(action))

    def drive(self, speed_m_s: float, turn_rad_s: float, duration_s: float) -> Moved:
        """Move at a velocity for a while."""
        aimed = self.pose.ahead(speed_m_s * duration_s)
        return self._counted(aimed, self._body.drive(speed_m_s, turn_rad_s, duration_s))

    def _counted(self, aimed: GroundPose, moved: Moved) -> Moved:
        if moved.contact:
            self.contacts += 1
            self.foretold += self._known.foretells((aimed.x_m, aimed.y_m))
        return moved
