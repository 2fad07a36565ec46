"""A body under watch: what it touched, and whether the map had told before that it would."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import FORWARD_M, Action, GroundPose, Moved
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.navigate.bodies import Body


@dataclass(frozen=True, eq=False)
class Foreknowledge:
    """What a map knows of obstacles before a robot drives.

    Attributes:
        obstacles: the map's own grid.
        radius_m: of the robot.
        room_m: (nx, ny) distance from each cell's middle to the edge of the nearest occupied cell.
    """

    obstacles: Obstacles
    radius_m: float
    room_m: Float[np.ndarray, "nx ny"] = field(init=False)

    def __post_init__(self) -> None:
        from scipy.ndimage import distance_transform_edt

        occupied = self.obstacles.states == CellState.OCCUPIED
        cell_m = self.obstacles.cell_size_m
        room = np.full(occupied.shape, np.inf)
        if occupied.any():
            room = np.asarray(distance_transform_edt(~occupied, sampling=cell_m)) - 0.5 * cell_m
        object.__setattr__(self, "room_m", room)

    def foretells(self, xy: tuple[float, float]) -> bool:
        """Tell whether the map shows an obstacle within the robot's radius of a place (level x and y)."""
        cell = np.floor((np.array(xy) - self.obstacles.origin_m) / self.obstacles.cell_size_m).astype(np.int64)
        if (cell < 0).any() or (cell >= self.room_m.shape).any():
            return False
        return bool(self.room_m[tuple(cell)] < self.radius_m)


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
