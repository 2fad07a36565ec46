"""Where the cells of the reference's grids lie in the world of our recordings, and which voxels of ours they fill.

Two kinds of grid are in its files:

* **from the first base** (``vlmaps.h5df``): its frame M has its origin at the robot's first base pose, x forward,
  y left, z up. A point of M lies in row ``int(gs/2 - int(x/s))``, column ``int(gs/2 - int(y/s))``, layer
  ``int(z/s)``; rows run backward and columns right. ``int`` cuts towards zero, so that cell k of an axis holds
  [k·s, (k+1)·s) for k > 0, its mirror image for k < 0, and (-s, s), twice as much, for k = 0. World: ``B_0`` of
  ``layouts.base_poses``.
* **from the lowest corner** (``vlmaps_multi_floor.h5df``, ``vlmaps_cam.h5df``): cell k of an axis is centred at
  ``pcd_min + k·s`` along the axes of the poses' own world (y up), as ``round`` has it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core import poses
from avlmaps.core.errors import MapError
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.formats.layouts import WORLD_FROM_HABITAT, base_poses

FARTHEST_M = 1e6
_CUBES_AT_ONCE = 1 << 16
_NEIGHBOURS = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class Cubes:
    """The occupied cells of a grid, as cubes of one size that do not overlap.

    A cell that is twice as wide as the others is two cubes (four, where it is so along both horizontal axes). Layer 0
    is not halved: it is that of the floor, which lies in its middle.

    Attributes:
        world_from_grid: how the grid lies in our world.
        middle: of each cube, metres, along the grid's axes.
        row: the voxel of the file that it is of, rising.
        size_m: edge of a cube.
    """

    world_from_grid: Float[np.ndarray, "4 4"]
    middle: Float[np.ndarray, "c 3"]
    row: Int[np.ndarray, " c"]
    size_m: float

    def __post_init__(self) -> None:
        far_m = float(np.abs(self.middle).max(initial=0.0) + np.abs(self.world_from_grid[:3, 3]).max())
        if not far_m <= FARTHEST_M:
            raise MapError(
                f"The voxels lie up to {far_m:.3g} m from the origin, farther than any building is wide; the first "
                "pose or the grid's corner is damaged."
            )


def cubes_from_first_base(
    cell: Int[np.ndarray, "n 3"], grid_size: int, cell_size_m: float, first_habitat_from_base: Float[np.ndarray, "4 4"]
) -> Cubes:
    """Return the cells of a grid round the first base pose.

    Args:
        cell: (row, column, layer) of each; layer 0 is at the height of the base.
        grid_size: rows (and columns) of the grid.
        cell_size_m: edge of a cell.
        first_habitat_from_base: first pose in ``poses.txt`` (x right, y up, z backward).
    """
    half = grid_size // 2
    steps = np.stack([half - cell[:, 0], half - cell[:, 1], cell[:, 2]], axis=1).astype(np.float64)
    middle, row = steps + 0.5 * np.sign(steps), np.arange(len(cell))
    for axis in (0, 1):
        wide = middle[:, axis] == 0.0
        other = middle[wide]
        middle[wide, axis], other[:, axis] = 0.5, -0.5
        middle, row = np.concatenate([middle, other]), np.concatenate([row, row[wide]])
    order = np.argsort(row, kind="stable")
    world_from_grid = base_poses(first_habitat_from_base)
    return Cubes(world_from_grid, middle[order] * cell_size_m, row[order], cell_size_m)


def cubes_from_corner(
    cell_xyz: Int[np.ndarray, "n 3"], cell_size_m: float, low_habitat: Float[np.ndarray, "3"]
) -> Cubes:
    """Return the cells of a grid over a cloud of points.

    Args:
        cell_xyz: of each, along the axes of the poses' world (y up).
        cell_size_m: edge of a cell.
        low_habitat: the cloud's lowest corner, in that world.
    """
    middle = low_habitat + cell_xyz * cell_size_m
    return Cubes(WORLD_FROM_HABITAT, middle, np.arange(len(cell_xyz)), cell_size_m)


def voxels_filled(cubes: Cubes, grid: GridSpec) -> tuple[Int[np.ndarray, " p"], Int[np.ndarray, "p 3"]]:
    """Return which voxels of ours the cubes fill: those whose middle lies in one, so that surfaces get no holes.

    A cube that holds no middle of ours goes into the voxel that holds its own, so that none is lost.

    Args:
        cubes: as large as a voxel.
        grid: ours.

    Returns:
        Pairs of a row of the file and a voxel, by rising row; a voxel may come with several rows.
    """
    rows: list[Int[np.ndarray, " p"]] = []
    voxels: list[Int[np.ndarray, "p 3"]] = []
    for start in range(0, len(cubes.row), _CUBES_AT_ONCE):
        part = slice(start, start + _CUBES_AT_ONCE)
        row, voxel = _filled(cubes.middle[part], cubes.row[part], cubes, grid)
        rows.append(row)
        voxels.append(voxel)
    return np.concatenate(rows), np.concatenate(voxels)


def _filled(
    middle: Float[np.ndarray, "c 3"], row: Int[np.ndarray, " c"], cubes: Cubes, grid: GridSpec
) -> tuple[Int[np.ndarray, " p"], Int[np.ndarray, "p 3"]]:
    grid_from_world = poses.inverse(cubes.world_from_grid)
    own = grid.index_of(poses.apply(cubes.world_from_grid, middle))
    rows: list[Int[np.ndarray, " p"]] = []
    voxels: list[Int[np.ndarray, "p 3"]] = []
    starved = np.ones(len(row), bool)
    for step in _NEIGHBOURS:
        voxel = own + step.astype(np.int32)
        off = poses.apply(grid_from_world, grid.centre_of(voxel)) - middle
        inside = ((off >= -0.5 * cubes.size_m) & (off < 0.5 * cubes.size_m)).all(axis=1)
        starved &= ~inside
        rows.append(row[inside])
        voxels.append(voxel[inside])
    all_rows = np.concatenate([*rows, row[starved]])
    order = np.argsort(all_rows, kind="stable")
    return all_rows[order], np.concatenate([*voxels, own[starved]])[order]
