"""Which colour pixel, and which cell of the feature map, belongs to a pixel of the depth picture."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from avlmaps.core.camera import Pinhole, Rig


@dataclass(frozen=True, slots=True)
class PixelLookup:
    """Tables of a rig and a feature map's size that fusion needs, computed once for all frames.

    Where the two cameras share their centre and axes, the colour pixel depends on the depth pixel's column and row
    alone, and tables hold it; else each point is projected.

    Attributes:
        x: camera-frame direction of each column at z = 1.
        y: camera-frame direction of each row at z = 1.
        tables: colour column of each depth column, first colour pixel of each depth row, and the same for the cells
            of the feature map; -1 where that is outside.
        projection: whether to project instead, rgb_from_depth, colour camera's fx fy cx cy, its rows and columns,
            rows and columns of the feature map.
    """

    x: Float64[np.ndarray, " wd"]
    y: Float64[np.ndarray, " hd"]
    tables: tuple[
        Int32[np.ndarray, " wd"], Int32[np.ndarray, " hd"], Int32[np.ndarray, " wd"], Int32[np.ndarray, " hd"]
    ]
    projection: tuple[
        bool, Float64[np.ndarray, "4 4"], tuple[float, float, float, float], tuple[int, int], tuple[int, int]
    ]

    @property
    def longest_ray(self) -> float:
        """Distance from the camera, per metre of depth, of the farthest pixel; at least 1."""
        return float(np.sqrt(np.square(self.x).max() + np.square(self.y).max() + 1.0))


def look_up(rig: Rig, feature_rows: int, feature_columns: int) -> PixelLookup:
    """Prepare the lookup for a rig and a feature map that covers the colour picture evenly (0 x 0 for none)."""
    depth, rgb = rig.depth, rig.rgb
    x = (np.arange(depth.width) + 0.5 - depth.cx) / depth.fx
    y = (np.arange(depth.height) + 0.5 - depth.cy) / depth.fy
    column, row = _colour_place(rig, depth, rgb, x, y)
    tables = (
        _cells(column, rgb.width, rgb.width),
        _starts(_cells(row, rgb.height, rgb.height), rgb.width),
        _cells(column, rgb.width, feature_columns),
        _starts(_cells(row, rgb.height, feature_rows), feature_columns),
    )
    same_axes = np.array_equal(rig.rgb_from_depth, np.eye(4))
    intrinsics = (float(rgb.fx), float(rgb.fy), float(rgb.cx), float(rgb.cy))
    projection = (
        not same_axes,
        np.array(rig.rgb_from_depth, np.float64, order="C"),
        intrinsics,
        (rgb.height, rgb.width),
        (feature_rows, feature_columns),
    )
    return PixelLookup(x, y, tables, projection)


def _colour_place(
    rig: Rig, depth: Pinhole, rgb: Pinhole, x: Float64[np.ndarray, " wd"], y: Float64[np.ndarray, " hd"]
) -> tuple[Float64[np.ndarray, " wd"], Float64[np.ndarray, " hd"]]:
    """Return the colour picture's coordinates of each depth column and row, for cameras with the same axes."""
    if rig.registered:  # exact, where a division and a multiplication by fx would leave rounding
        columns, rows = np.arange(depth.width) + 0.5, np.arange(depth.height) + 0.5
        return columns * (rgb.width / depth.width), rows * (rgb.height / depth.height)
    return rgb.fx * x + rgb.cx, rgb.fy * y + rgb.cy


def _cells(place: Float64[np.ndarray, " n"], size: int, cells: int) -> Int32[np.ndarray, " n"]:
    """Return which of ``cells`` equal parts of [0, size) each place lies in, -1 outside (or for no cells)."""
    inside = (place >= 0.0) & (place < size) & (cells > 0)
    return np.where(inside, np.floor(np.where(inside, place, 0.0) * (cells / size)), -1.0).astype(np.int32)


def _starts(row: Int32[np.ndarray, " n"], columns: int) -> Int32[np.ndarray, " n"]:
    """Return the linear index at which each row begins; -1 stays."""
    return np.where(row >= 0, row * np.int32(columns), -1).astype(np.int32)
