"""The findings of a driver: where its body has been, and obstacles that it ran into and the map does not know.

Both are stored beside the map, never in it.
"""

from math import atan2, cos, sin

import numpy as np

from avlmaps.core.motion import GroundPose
from avlmaps.maps.obstacles import CellState, Obstacles

_LOST_M = 0.002  # a movement must fall short by this to show where it was stopped
_WIDER_RAD = (0.0, 0.5, -0.5, 1.0, -1.0)  # how far beside the likeliest point it looks for one that can be


class ContactMap:
    """Cells that the body found occupied, and cells that it stood on.

    Attributes:
        cells: where it touched something.
    """

    def __init__(self, obstacles: Obstacles, radius_m: float) -> None:
        self._obstacles = obstacles
        self._radius_m = radius_m
        self._known = obstacles.states == CellState.OCCUPIED
        self._been = np.zeros(obstacles.states.shape, bool)
        self.cells = np.zeros(obstacles.states.shape, bool)
        reach = int(radius_m / obstacles.cell_size_m) + 1
        self._disc = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T

    def mark_free(self, pose: GroundPose) -> None:
        """Note that the body stood somewhere: every cell wholly under it is free."""
        cell_m = self._obstacles.cell_size_m
        at = (np.array([pose.x_m, pose.y_m]) - self._obstacles.origin_m) / cell_m
        cells = np.floor(at).astype(np.int64) + self._disc
        under = np.hypot(*(np.abs(cells + 0.5 - at) + 0.5).T) * cell_m <= self._radius_m
        cells = self._on_grid(cells[under])
        self._been[tuple(cells.T)] = True
        self.cells[tuple(cells.T)] = False

    def mark_contact(self, before: GroundPose, planned: GroundPose, now: GroundPose) -> bool:
        """Mark the obstacle that stopped a movement, as far as the poses show it.

        A body that slides loses just the part of its way that leads into the thing, one that stops all of it. Where
        the likeliest point cannot be, since the map has something there or the body has been there, points beside
        it are taken.

        Returns:
            Whether that is something new.
        """
        lost = np.array([planned.x_m - now.x_m, planned.y_m - now.y_m])
        if np.hypot(*lost) < _LOST_M:
            lost = np.array([planned.x_m - before.x_m, planned.y_m - before.y_m])
        towards = atan2(lost[1], lost[0])
        return any(self._mark(now, towards + beside) for beside in _WIDER_RAD)

    def _mark(self, now: GroundPose, towards_rad: float) -> bool:
        cell_m = self._obstacles.cell_size_m
        ahead = np.array([cos(towards_rad), sin(towards_rad)])
        touch = np.array([now.x_m, now.y_m]) + (self._radius_m + 0.3 * cell_m) * ahead
        across = np.array([-ahead[1], ahead[0]])
        points = touch + np.outer(np.array([0.0, -1.0, 1.0, -2.0, 2.0]) * 0.7 * cell_m, across)
        cells = np.floor((points - self._obstacles.origin_m) / cell_m).astype(np.int64)
        cells = self._on_grid(cells)
        i, j = cells.T
        if len(cells) and self._known[tuple(cells[0])]:
            return False  # the map foretold it
        new = ~self._known[i, j] & ~self.cells[i, j] & ~self._been[i, j]
        self.cells[i[new], j[new]] = True
        return bool(new.any())

    def _on_grid(self, cells: np.ndarray) -> np.ndarray:
        return cells[np.all((cells >= 0) & (cells < self.cells.shape), axis=1)]
