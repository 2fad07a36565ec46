"""Two rooms side by side, 6 by 3 metres together, with or without a wall and a doorway between them."""

import numpy as np

from avlmaps.maps.grid import GridSpec
from avlmaps.maps.storeys import Storey, Storeys
from avlmaps.query.voxel_space import Space

UP = np.array([0.0, 0.0, 1.0])
SIZE = (120, 60, 48)  # voxels of 5 cm


def two_rooms_index(door_m: float = 0.0, wall: bool = True) -> np.ndarray:
    """Return the voxels of a floor, four outer walls, and a wall at x = 3 m with a doorway in its middle."""
    full = np.zeros(SIZE, bool)
    full[:, :, 0] = True
    full[[0, -1]] = full[:, [0, -1]] = True
    if wall:
        full[58:62] = True
        half = round(door_m / 0.05 / 2)
        full[58:62, 30 - half : 30 + half, 1:42] = False
    return np.argwhere(full)


def two_rooms(door_m: float = 0.0, wall: bool = True) -> Space:
    """Return the space of ``two_rooms_index``."""
    return Space(GridSpec(0.05), two_rooms_index(door_m, wall), UP)


def storeys_at(*floors_m: float) -> Storeys:
    """Return storeys with floors at these heights, rising."""
    ends = [-np.inf, *(floor - 0.3 for floor in floors_m[1:]), np.inf]
    return Storeys(tuple(Storey(k, floor, ends[k], ends[k + 1]) for k, floor in enumerate(floors_m)))
