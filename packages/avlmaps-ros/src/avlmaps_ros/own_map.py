"""The robot's own map or costmap: planning on it, "reachable" means what the robot's planner means."""

from dataclasses import dataclass, replace
from math import atan2
from typing import Annotated, Any

import msgspec
import numpy as np
from jaxtyping import Int8

from avlmaps.core.errors import NavigationError
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps_ros.messages import Quaternion, Stamped, Vector, read, sanitize_line
from avlmaps_ros.settings import Frames, GroundTransform

MOST_BYTES = 64_000_000  # of a grid as a message of rosbridge, which writes it in digits
_MOST_CELLS = 16_000_000
_MAP_AT, _COSTMAP_AT = 65, 99  # map_server's threshold; the middle of a body touches something


@dataclass(frozen=True, slots=True, eq=False)
class OwnGrid:
    """A nav_msgs/OccupancyGrid."""

    values: Int8[np.ndarray, "h w"]  # (height, width) along the grid's y and x: 0 free to 100 occupied, -1 unknown
    cell_m: float
    frame_from_grid: GroundTransform
    frame: str
    is_costmap: bool = False  # whether obstacles are already as much larger as the body is


class _Pose(msgspec.Struct):
    position: Vector
    orientation: Quaternion


class _Info(msgspec.Struct):
    resolution: float
    width: int
    height: int
    origin: _Pose


class _Grid(msgspec.Struct):
    header: Stamped
    info: _Info
    data: list[Annotated[int, msgspec.Meta(ge=-128, le=127)]]


def grid_of(message: Any) -> OwnGrid:
    """Check a grid that came from outside, as `messages.read` does. ``ValueError``: it is none."""
    if isinstance(message, msgspec.Raw):
        message = read(message, _Grid)
    info, place, turn = message.info, message.info.origin.position, message.info.origin.orientation
    values, shape, cell_m = np.array(message.data, np.int8), (info.height, info.width), float(info.resolution)
    if not (min(shape) > 0 and len(values) == shape[0] * shape[1] <= _MOST_CELLS and 0.001 <= cell_m <= 10.0):
        raise ValueError(f"a grid of {info.width} x {info.height} cells of {cell_m} m with {len(values)} values")
    corner = GroundTransform(place.x, place.y, 2.0 * atan2(turn.z, turn.w))
    return OwnGrid(values.reshape(shape), cell_m, corner, message.header.frame_id.lstrip("/"))


def on_own_map(ours: Obstacles, grid: OwnGrid, frames: Frames) -> Obstacles:
    """Return the floor as the robot's own grid has it, in our level frame.

    What blocks the view is as our map knows it, and where our map knows nothing, as the grid does. Raise
    `NavigationError` where the grid is in another frame than the robot's goals.
    """
    if grid.frame != frames.map_frame:
        raise NavigationError(
            f"The robot's grid is in the frame {sanitize_line(grid.frame, 40)!r} and its goals are in "
            f"{frames.map_frame!r}; name a map of that frame as map_topic."
        )
    rows, columns = grid.values.shape
    corners = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]]) * grid.cell_m
    level = frames.map_from_avlmap.inverse().points(grid.frame_from_grid.points(corners))
    low = level.min(axis=0)
    nx, ny = (int(count) for count in np.ceil((level.max(axis=0) - low) / grid.cell_m - 1e-6))
    middles = low + (np.stack(np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"), -1) + 0.5) * grid.cell_m
    at = _COSTMAP_AT if grid.is_costmap else _MAP_AT
    occupied, free = np.zeros((nx, ny), bool), np.zeros((nx, ny), bool)
    for shift in (np.array([dx, dy]) * 0.25 * grid.cell_m for dx in (-1, 1) for dy in (-1, 1)):
        values = _values_at(grid, frames.map_from_avlmap.points(middles + shift))
        occupied |= values >= at
        free |= (values >= 0) & (values < at)
    states = np.where(occupied, CellState.OCCUPIED, np.where(free, CellState.FREE, CellState.UNKNOWN)).astype(np.uint8)
    tall = None
    if ours.tall is not None:
        cells = np.floor((middles - ours.origin_m) / ours.cell_size_m).astype(np.int64)
        inside = np.all((cells >= 0) & (cells < ours.states.shape), axis=-1)
        cells = np.where(inside[..., None], cells, 0)
        known = inside & (ours.states[cells[..., 0], cells[..., 1]] != CellState.UNKNOWN)
        tall = np.where(known, ours.tall[cells[..., 0], cells[..., 1]], occupied)
    theirs = replace(ours, origin_m=low, cell_size_m=grid.cell_m, states=states, tall=tall)
    return theirs.without(ours.forbidden)


def _values_at(grid: OwnGrid, xy: np.ndarray) -> np.ndarray:
    cell = np.floor(grid.frame_from_grid.inverse().points(xy) / grid.cell_m + 1e-9).astype(np.int64)
    rows, columns = grid.values.shape
    inside = (cell[..., 0] >= 0) & (cell[..., 0] < columns) & (cell[..., 1] >= 0) & (cell[..., 1] < rows)
    values = np.full(inside.shape, -1, np.int16)
    values[inside] = grid.values[cell[..., 1][inside], cell[..., 0][inside]]
    return values
