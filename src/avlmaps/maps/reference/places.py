"""Where a cell of the reference's grid lies in the world of our recordings.

Two kinds of grid are in its files:

* **from the first base** (``vlmaps.h5df``): its frame M has its origin at the robot's first base pose, x forward,
  y left, z up. A point of M lies in row ``int(gs/2 - int(x/s))``, column ``int(gs/2 - int(y/s))``, layer
  ``int(z/s)``; rows run backward and columns right. ``int`` cuts towards zero, so that cell k of an axis holds
  [k·s, (k+1)·s) for k > 0, its mirror image for k < 0, and (-s, s), twice as much, for k = 0. World: ``B_0`` of
  ``avlmaps_layout.base_poses``.
* **from the lowest corner** (``vlmaps_multi_floor.h5df``, ``vlmaps_cam.h5df``): cell k of an axis is centred at
  ``pcd_min + k·s`` along the axes of the poses' own world (y up), as ``round`` has it.

The middle of a cell is what is taken for its place; a point fused into it lies at most half a cell away along each
axis of the grid (a whole one in the cells k = 0).
"""

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core import poses
from avlmaps.recordings.avlmaps_layout import WORLD_FROM_HABITAT, base_poses


def places_from_first_base(
    cell: Int[np.ndarray, "n 3"],
    grid_size: int,
    cell_size_m: float,
    first_habitat_from_base: Float[np.ndarray, "4 4"],
) -> Float[np.ndarray, "n 3"]:
    """Return the middles of cells of a grid round the first base pose, metres, our world.

    Args:
        cell: (row, column, layer) of each; layer 0 is at the height of the base.
        grid_size: rows (and columns) of the grid.
        cell_size_m: edge of a cell.
        first_habitat_from_base: first pose in ``poses.txt`` (x right, y up, z backward).
    """
    half = grid_size // 2
    steps = np.stack([half - cell[:, 0], half - cell[:, 1], cell[:, 2]], axis=1).astype(np.float64)
    in_map = (steps + 0.5 * np.sign(steps)) * cell_size_m
    return poses.apply(base_poses(first_habitat_from_base), in_map)


def places_from_corner(
    cell_xyz: Int[np.ndarray, "n 3"], cell_size_m: float, low_habitat: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "n 3"]:
    """Return the middles of cells of a grid over a cloud of points, metres, our world.

    Args:
        cell_xyz: of each, along the axes of the poses' world (y up).
        cell_size_m: edge of a cell.
        low_habitat: the cloud's lowest corner, in that world.
    """
    return poses.apply(WORLD_FROM_HABITAT, low_habitat + cell_xyz * cell_size_m)
