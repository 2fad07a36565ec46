"""The true rooms of a scene: its areas, with those joined between which an opening is wider than any door."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from avlmaps.query.components import connected
from avlmaps.query.doorways import WIDEST_M
from avlmaps.query.raster import dilated
from avlmaps_sim.scene import Area

CELL_M = 0.1
_WALL_M = (1.2, 1.9)  # heights over the floor at which an opening has no wall
_BESIDE_CELLS = 1  # a wall's faces lie beside the line between two areas
_SEEN = 0.3  # of a room's floor, in columns that hold voxels
_WALKED_M = (0.8, 2.2)  # height of cameras over the floor that they stood on


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """A storey in cells of 10 cm; cell (i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · CELL_M``.

    Attributes:
        floor_m: its height.
        origin_m: x and y of the corner of cell (0, 0).
        label: number of the true room of each cell; −1 outside.
        kinds: of each room, the names that are right; several of an open plan.
        seen: which rooms the map shows some of.
    """

    floor_m: float
    origin_m: Float[np.ndarray, "2"]
    label: Int[np.ndarray, "nx ny"]
    kinds: tuple[tuple[str, ...], ...]
    seen: Bool[np.ndarray, " r"]

    @property
    def middles(self) -> Float[np.ndarray, "nx ny 2"]:
        """Middles of the cells."""
        return self.origin_m + (np.moveaxis(np.indices(self.label.shape), 0, -1) + 0.5) * CELL_M

    def mask(self, outline: Float[np.ndarray, "k 3"]) -> Bool[np.ndarray, "nx ny"]:
        """Return the cells within an outline; none where it lies on another storey."""
        if len(outline) < 3 or abs(float(outline[0, 2]) - self.floor_m) > 1.0:
            return np.zeros(self.label.shape, bool)
        return Area("", outline[:, :2]).contains(self.middles)


def floors_of(
    areas: Sequence[Area],
    walls: Float[np.ndarray, "w 3"],
    seen: Float[np.ndarray, "n 3"],
    cameras: Float[np.ndarray, "k 3"],
    join: bool,
) -> list[Floor]:
    """Return the storeys on which cameras stood.

    ``join`` makes one room of areas with an opening between them that is wider than any door.
    """
    out: list[Floor] = []
    for floor_m in sorted({round(area.floor_m, 2) for area in areas}):
        height = cameras[:, 2] - floor_m
        if ((height > _WALKED_M[0]) & (height < _WALKED_M[1])).any():
            own = [area for area in areas if abs(area.floor_m - floor_m) < 0.02]
            out.append(_floor(own, floor_m, walls, seen, join))
    return out


def _floor(
    areas: Sequence[Area],
    floor_m: float,
    walls: Float[np.ndarray, "w 3"],
    seen: Float[np.ndarray, "n 3"],
    join: bool,
) -> Floor:
    corners = np.concatenate([area.polygon for area in areas])
    origin = np.floor(corners.min(axis=0) / CELL_M - 10.0) * CELL_M
    shape = tuple((np.ceil((corners.max(axis=0) - origin) / CELL_M).astype(int) + 10).tolist())
    empty = Floor(floor_m, origin, np.full(shape, -1), (), np.zeros(0, bool))
    label = empty.label.copy()
    for number, area in enumerate(areas):
        label[area.contains(empty.middles)] = number
    joined = np.arange(len(areas))
    if join:
        between = (walls[:, 2] - floor_m > _WALL_M[0]) & (walls[:, 2] - floor_m < _WALL_M[1])
        pairs = _wide_openings(label, _cells(walls[between], origin, shape))
        joined = connected(len(areas), pairs[:, 0], pairs[:, 1])
    kinds = tuple(
        tuple(sorted({area.kind for area, own in zip(areas, joined.tolist(), strict=True) if own == number}))
        for number in range(int(joined.max()) + 1)
    )
    low = (seen[:, 2] - floor_m > -0.3) & (seen[:, 2] - floor_m < 2.0)
    shown = _cells(seen[low], origin, shape)
    label = np.asarray(np.where(label >= 0, joined[label], -1))
    some = [float(shown[label == number].mean()) >= _SEEN for number in range(len(kinds))]
    return Floor(floor_m, origin, label, kinds, np.array(some))


def _cells(
    points: Float[np.ndarray, "n 3"], origin: Float[np.ndarray, "2"], shape: tuple[int, ...]
) -> Bool[np.ndarray, "nx ny"]:
    out = np.zeros(shape, bool)
    cell = np.floor((points[:, :2] - origin) / CELL_M).astype(int)
    i, j = cell[((cell >= 0) & (cell < shape)).all(axis=1)].T
    out[i, j] = True
    return out


def _wide_openings(label: Int[np.ndarray, "nx ny"], wall: Bool[np.ndarray, "nx ny"]) -> Int[np.ndarray, "p 2"]:
    """Return the pairs of areas between which more than a door's width of their common side has no wall."""
    near = dilated(wall, 1 + 2 * _BESIDE_CELLS, 1 + 2 * _BESIDE_CELLS)
    open_m: dict[tuple[int, int], float] = {}
    for a, b, closed in (
        (label[1:], label[:-1], near[1:] | near[:-1]),
        (label[:, 1:], label[:, :-1], near[:, 1:] | near[:, :-1]),
    ):
        free = (a != b) & (a >= 0) & (b >= 0) & ~closed
        for one, other in zip(a[free].tolist(), b[free].tolist(), strict=True):
            pair = (min(one, other), max(one, other))
            open_m[pair] = open_m.get(pair, 2 * _BESIDE_CELLS * CELL_M) + CELL_M
    wide = [pair for pair, length in open_m.items() if length > WIDEST_M]
    return np.array(wide, np.int64).reshape(-1, 2)
