"""``vlmaps.h5df`` and its relatives: the reference's voxels.

Datasets (N occupied cells): ``grid_feat`` (N, 512), LSeg features of any length; ``grid_pos`` (N, 3) cells;
``weight`` (N,); ``grid_rgb`` (N, 3), 0 to 255, absent in early files; ``occupied_ids``, the number of the voxel in each
cell of the grid, -1 for none, of which only the shape is used here; ``mapped_iter_list`` (F,) fused frames; and in some
drafts ``init_height_id``, the layer of the base's height. ``vlmaps_multi_floor.h5df`` and ``vlmaps_cam.h5df`` have
``pcd_min``, ``pcd_max`` (3,) and ``cs`` as well; the first stores cells as (x, z, y), the second as (x, y, z).

The reference's running mean weighs a voxel's first pixel twice over (by its weight squared), so that a voxel that was
hit once has the length of its weight; features are scaled to unit length here, which corrects the latter.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, Float64, Int64

from avlmaps.core.errors import MapError
from avlmaps_models.import_reference.hdf5 import Hdf5, Numbers
from avlmaps_models.import_reference.places import Cubes, cubes_from_corner, cubes_from_first_base

DIM = 512  # LSeg's
MOST_VOXELS = 1 << 25  # the reference's own loader would need 64 GB for their features
MOST_CELLS = 100_000  # along an axis
ROWS_AT_ONCE = 4096  # 8 MB of features


@dataclass(frozen=True, slots=True)
class Corner:
    """The grid that the relatives hold.

    Attributes:
        low: the cloud's lowest corner, metres, in the world of the poses.
        cell_size_m: edge of a cell.
        order: where x, y and z stand in ``grid_pos``.
    """

    low: Float64[np.ndarray, "3"]
    cell_size_m: float
    order: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class VoxelRows:
    """Some of the voxels, as they stand in the file.

    Attributes:
        rows: which.
        feature: of any length.
        weight: of the running mean.
        rgb: 0 to 255; NaN where the file has no colours.
    """

    rows: slice
    feature: Float32[np.ndarray, "n d"]
    weight: Float64[np.ndarray, " n"]
    rgb: Float64[np.ndarray, "n 3"]

    @property
    def usable(self) -> np.ndarray:
        """Which rows hold numbers that a mean can have."""
        coloured = np.isnan(self.rgb).all(axis=1) | ((self.rgb >= 0.0) & (self.rgb <= 255.0)).all(axis=1)
        with np.errstate(invalid="ignore"):
            return np.isfinite(self.feature).all(axis=1) & np.isfinite(self.weight) & (self.weight >= 0.0) & coloured


class ReferenceVoxels:
    """An open ``vlmaps.h5df`` whose shapes have been checked.

    Attributes:
        cell: (N, 3) as in the file.
        grid_shape: cells of the grid along the columns of ``cell``.
        frames: how many frames were fused.
        corner: how the grid lies, for the relatives; None for a grid round the first base pose.
    """

    def __init__(self, file: Hdf5) -> None:
        self.path: Path = file.path
        self._position = file.numbers("grid_pos", (None, 3), kinds="iu")
        count = self._position.shape[0]
        if count == 0:
            raise MapError(f"{file.path} holds no voxels; the map is empty.")
        occupied = file.numbers("occupied_ids", (None, None, None), kinds="iu")
        self.grid_shape = occupied.shape
        room = np.prod(np.array(self.grid_shape, np.float64))
        if count > min(MOST_VOXELS, room) or max(self.grid_shape) > MOST_CELLS:
            raise MapError(
                f"{file.path}: {count} voxels in a grid of {self.grid_shape} cells are more than there is room for, or "
                "than a building has; the file is damaged."
            )
        self._feature = file.numbers("grid_feat", (count, DIM), kinds="f")
        self._weight = file.numbers("weight", (count,))
        self._rgb: Numbers | None = file.numbers("grid_rgb", (count, 3)) if "grid_rgb" in file else None
        self.frames = file.numbers("mapped_iter_list", (None,)).shape[0]
        self.corner = _corner(file, self.grid_shape) if "pcd_min" in file else None
        self.cell: Int64[np.ndarray, "n 3"] = self._position.whole(np.int64)
        self._first_layer = _first_layer(file)
        self._check_cells()

    def __len__(self) -> int:
        return len(self.cell)

    def _check_cells(self) -> None:
        shape = np.array(self.grid_shape)
        # In the relatives a point below the cloud's corner wraps round in numpy, and retains its true, negative cell.
        least = -shape if self.corner else np.zeros(3, np.int64)
        outside = ((self.cell < least) | (self.cell >= shape)).any(axis=1)
        if outside.any():
            row = int(outside.argmax())
            raise MapError(
                f"{self.path} is damaged: voxel {row} of grid_pos is in cell {tuple(self.cell[row].tolist())}, outside "
                f"of the grid of {self.grid_shape}."
            )
        flat = np.ravel_multi_index(tuple((self.cell - least).T), tuple((shape - least).tolist()))
        if np.unique(flat).size < len(self.cell):
            raise MapError(f"{self.path} is damaged: grid_pos names the same cell twice.")

    def cubes(self, first_habitat_from_base: Float[np.ndarray, "4 4"], cell_size_m: float) -> Cubes:
        """Return where the voxels' cells lie in our world; a corner holds its own cell size."""
        if self.corner is not None:
            cells = self.cell[:, list(self.corner.order)]
            return cubes_from_corner(cells, self.corner.cell_size_m, self.corner.low)
        cells = self.cell - np.array([0, 0, self._first_layer])
        return cubes_from_first_base(cells, self.grid_shape[0], cell_size_m, first_habitat_from_base)

    def parts(self) -> list[slice]:
        """Return slices of rows that are to be read one at a time."""
        return [slice(start, min(start + ROWS_AT_ONCE, len(self))) for start in range(0, len(self), ROWS_AT_ONCE)]

    def read(self, parts: Iterator[slice]) -> Iterator[VoxelRows]:
        """Read voxels, slice by slice."""
        for rows in parts:
            blank = np.full((rows.stop - rows.start, 3), np.nan)
            yield VoxelRows(
                rows=rows,
                feature=self._feature.rows(rows, np.float32),
                weight=self._weight.rows(rows, np.float64),
                rgb=blank if self._rgb is None else self._rgb.rows(rows, np.float64),
            )

    @property
    def has_colours(self) -> bool:
        """Whether the file holds colours."""
        return self._rgb is not None

    @cached_property
    def fingerprint(self) -> str:
        """A hash of the file's size, the cells and their weights: another map has another one."""
        digest = hashlib.sha256(f"{self.path.stat().st_size} {self.grid_shape}".encode())
        digest.update(np.ascontiguousarray(self.cell, "<i8").data)
        digest.update(np.ascontiguousarray(self._weight.whole(np.float64), "<f8").data)
        return digest.hexdigest()


def _first_layer(file: Hdf5) -> int:
    """Return the layer of the base's height; another one than 0 where a draft let the grid grow downwards."""
    return int(file.numbers("init_height_id", (), "iu").whole(np.int64)) if "init_height_id" in file else 0


def _corner(file: Hdf5, grid_shape: tuple[int, ...]) -> Corner:
    low, high = (file.numbers(name, (3,)).whole(np.float64) for name in ("pcd_min", "pcd_max"))
    cell_size_m = float(file.numbers("cs", ()).whole(np.float64))
    if not (np.isfinite([low, high]).all() and np.isfinite(cell_size_m) and 0.001 <= cell_size_m <= 10.0):
        raise MapError(f"{file.path} is damaged: pcd_min, pcd_max or cs is not a place or size (cs is {cell_size_m}).")
    cells = np.ceil((high - low) / cell_size_m + 1.0)
    fits = {order: np.array_equal(cells[list(order)], grid_shape) for order in ((0, 1, 2), (0, 2, 1))}
    # Where a building is as long as it is high, the name of the file decides.
    preferred = (0, 2, 1) if "multi_floor" in file.path.name else (0, 1, 2)
    order = next((one for one in (preferred, (0, 1, 2), (0, 2, 1)) if fits[one]), None)
    if order is None:
        raise MapError(
            f"{file.path} is damaged: its grid has {grid_shape} cells, but from pcd_min to pcd_max there are "
            f"{tuple(cells.astype(int).tolist())}."
        )
    return Corner(low, cell_size_m, order)
