"""Fusion of pixel features, colour and geometry into voxels.

The feature of a voxel is the weighted mean of the features of all pixels that fell into it, with the paper's weight
exp(−d² / (2·0.6)), d the distance in metres from the camera to the point (Huang et al., Audio Visual Language Maps
for Robot Navigation, section III-A). It is a true mean, so that the order of frames does not matter and maps of
parts of a recording add up to the map of the whole.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float16, Float32, Float64, Int32

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import BackendError, MapError, RecordingError
from avlmaps.maps.fusion import add_kernels as sums
from avlmaps.maps.fusion import measure_kernels as kernels
from avlmaps.maps.fusion.carving_kernels import drop_flying
from avlmaps.maps.fusion.moved_submaps import MovedSubmaps
from avlmaps.maps.fusion.sensor import NONE, FusionSettings, SensorModel
from avlmaps.maps.fusion.submap_kernels import SPREAD_COLUMNS, add_spread, finish_spread
from avlmaps.maps.fusion.voxel_kernels import look_up_views
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable, VoxelViews, with_rows
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import Submaps, Voxels
from avlmaps.recordings.types import Frame

FARTHEST_VOXEL = (1 << 31) - 2 * kernels.REACH_VOXELS  # indices are int32

__all__ = ["FusionSettings", "VoxelAccumulator", "VoxelSums"]


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


class VoxelAccumulator:
    """Adds up frames, or the sums of parts, into sparse voxels without bounds.

    Weights are float64 and never fall below 1e-30 (which exp(−d² / 1.2) reaches at 9.1 m), so that what was only
    ever seen from afar has a feature in float32; it counts for nothing beside a nearer look. Memory is that of
    the voxels, 4·dim + 70 bytes each, however many frames there are. Kernels release the interpreter's lock:
    two accumulators on two threads map two parts at once.
    """

    def __init__(
        self,
        grid: GridSpec,
        dim: int,
        settings: FusionSettings | None = None,
        sensor: SensorModel = NONE,
        *,
        with_spread: bool = False,
    ) -> None:
        """Begin an empty map.

        Args:
            grid: the voxels' size.
            dim: length of a feature; 0 where no pixel features will come.
            settings: depth limits and the weight's width.
            sensor: error of the depths; by default every depth within the limits is used as it is.
            with_spread: note how the points lie within their voxels, for ``spread``.
        """
        if dim < 0:
            raise ValueError(f"dim is {dim}; a feature cannot have fewer than 0 numbers")
        self.grid = grid
        self.dim = dim
        self.settings = settings or FusionSettings()
        self.sensor = sensor
        self._table = VoxelTable(dim)
        self._lookup: tuple[Rig, int, int, PixelLookup] | None = None
        self._scratch = kernels.make_scratch(1, 1)
        self._spread = np.zeros((0, SPREAD_COLUMNS)) if with_spread else None
        self._frames = 0

    def __len__(self) -> int:
        """Return how many voxels there are."""
        return self._table.count

    def add(self, frame: Frame, features: Float[np.ndarray, "hf wf d"] | None = None) -> int:
        """Add a frame: every pixel with a depth within the limits counts, once.

        The colour and the feature of a point are those of the colour pixel that it projects to. A point outside of
        the colour picture adds to the geometry only (an occupied voxel, hits, last seen), and so does a feature
        that is all zero, but for the colour.

        Args:
            frame: colour, depth and pose.
            features: (hf, wf, dim), covering the colour picture evenly, at any resolution; None adds colour and
                geometry only.

        Returns:
            How many pixels were added.

        Raises:
            ValueError: the features have another shape.
            RecordingError: the pose is not finite or too far away for the grid.
            BackendError: features are NaN or infinite. The finite ones have been added by then.
        """
        cells, (feature_rows, feature_columns) = self._cells(features)
        lookup = self._lookup_for(frame.rig, feature_rows, feature_columns)
        pose = self._pose_of(frame)
        depth, limits = self._depth_of(frame), self._limits()
        traced = kernels.trace(
            depth,
            (lookup.x, lookup.y),
            pose,
            limits,
            np.require(frame.rgb, np.uint8, ["C", "W"]).reshape(-1, 3),
            lookup.tables,
            lookup.projection,
            self._scratch,
        )
        points, voxels, pairs = (int(count) for count in traced)
        table = self._table
        table.reserve(voxels)
        stamp_s = float(frame.stamp_s)
        known = sums.commit(voxels, self._scratch, pose[2], stamp_s, table.slots, table.geometry, table.count)
        table.count = int(known)
        if self._spread is not None:
            self._spread = with_rows(self._spread, len(table.weight))
            rays = lookup.x, lookup.y
            add_spread(depth, rays, pose, limits[:3], float(self._frames), table.slots, table.index, self._spread)
        self._frames += 1
        faults = sums.flush(voxels, pairs, self._scratch, cells, table.feature_sum, table.weight) if pairs else 0
        if faults:
            raise BackendError(
                f"The pixel encoder gave NaN or infinite features for frame {frame.name} (in {faults} voxels); "
                "leave the frame out or choose another profile."
            )
        return points

    def merge(self, part: VoxelSums) -> None:
        """Add the sums of another part of the same recording, in any order; a memory-mapped part is streamed.

        Raises:
            MapError: its features have another length.
        """
        self._table.add(part)

    def spread(self) -> Float32[np.ndarray, "n 10"]:
        """Return how the points lie within each voxel, sorted by index; see ``Submaps.spread``."""
        if self._spread is None:
            raise ValueError("this map was begun without with_spread")
        rows = self._table.sort_rows()
        found = np.empty((len(rows), SPREAD_COLUMNS), np.float32)
        finish_spread(self._spread[rows], self._table.hits[rows], found)
        return found

    @classmethod
    def of_submaps(cls, submaps: Submaps, pose: Float64[np.ndarray, "f 4 4"], grid: GridSpec) -> "VoxelAccumulator":
        """Return the map of submaps whose frames have these poses.

        Raises:
            MapError: the poses lie too far from the world's origin for voxels.
        """
        total = cls(grid, submaps.feature.shape[1])
        total._table = MovedSubmaps(submaps, pose, grid).table()
        return total

    def views_at(self, index: Int32[np.ndarray, "n 3"]) -> Int32[np.ndarray, " n"]:
        """Return how many frames have a pixel in each of some voxels."""
        found, table = np.zeros(len(index), np.int32), self._table
        look_up_views(np.ascontiguousarray(index), table.slots, table.index, table.views, found)
        return found

    def copy(self) -> "VoxelAccumulator":
        """Return an accumulator of the same sums, which grows by itself."""
        other = VoxelAccumulator(self.grid, self.dim, self.settings, self.sensor)
        other._table = self._table.copy()
        return other

    def sums(self, feature_out: Float32[np.ndarray, "n d"] | None = None) -> VoxelSums:
        """Return a copy of the sums, sorted by index.

        Args:
            feature_out: where to write the sums of features, such as a memory-mapped file; by default a new array.
        """
        return self._table.sums(feature_out)

    def evidence(self) -> VoxelViews:
        """Return the evidence of each voxel's surface, sorted by index, for `free_space.clean`."""
        return self._table.evidence()

    def voxels(
        self, feature_out: Float16[np.ndarray, "k d"] | None = None, kept: Bool[np.ndarray, " n"] | None = None
    ) -> Voxels:
        """Return the means, sorted by index: features of unit length, colours.

        Args:
            kept: which voxels of `evidence` to return; all by default.
            feature_out: where to write the features, such as a memory-mapped file; by default a new array.
        """
        return self._table.voxels(feature_out, kept)

    def _limits(self) -> kernels.Limits:
        """Return the limits for `fusion_kernels.trace`."""
        settings, sensor, half = self.settings, self.sensor, 0.5 * self.grid.voxel_size_m
        farthest = min(settings.max_depth_m, sensor.farthest_m(self.grid.voxel_size_m))
        noise = sensor.noise_m / half, sensor.noise_per_m / half
        return (self.grid.voxel_size_m, settings.min_depth_m, farthest, 0.5 / settings.variance_m2, *noise)

    def _depth_of(self, frame: Frame) -> Float32[np.ndarray, "h w"]:
        """Return the depths of a frame without flying pixels."""
        depth = np.require(frame.depth_m, np.float32, ["C", "W"])
        sensor, camera = self.sensor, frame.rig.depth
        if sensor.edge_sigmas is None:
            return depth
        kept = np.empty_like(depth)
        slope = np.tan(np.deg2rad(sensor.steepest_deg))
        steps = slope / camera.fx, slope / camera.fy
        drop_flying(depth, steps, sensor.noise, sensor.edge_sigmas, kept)
        return kept

    def _cells(self, features: np.ndarray | None) -> tuple[Float32[np.ndarray, "cells d"], tuple[int, int]]:
        """Return the features as rows of cells, and how many rows and columns of cells there are."""
        if features is not None and (features.ndim != 3 or features.shape[2] != self.dim or 0 in features.shape[:2]):
            raise ValueError(f"features have shape {features.shape}; this map takes (rows, columns, {self.dim})")
        if features is None or self.dim == 0:
            return np.zeros((0, self.dim), np.float32), (0, 0)
        cells = np.ascontiguousarray(features, np.float32).reshape(-1, self.dim)
        return cells, (features.shape[0], features.shape[1])

    def _lookup_for(self, rig: Rig, feature_rows: int, feature_columns: int) -> PixelLookup:
        """Return the lookup of this rig and feature map, reused from the frame before where they are the same."""
        if self._lookup is not None:
            known_rig, known_rows, known_columns, lookup = self._lookup
            if known_rig is rig and (known_rows, known_columns) == (feature_rows, feature_columns):
                return lookup
        lookup = look_up(rig, feature_rows, feature_columns)
        reach = lookup.longest_ray * self.settings.max_depth_m / self.grid.voxel_size_m
        if reach >= kernels.REACH_VOXELS - 1:
            raise MapError(
                f"A depth of {self.settings.max_depth_m} m spans {reach:.0f} voxels of {self.grid.voxel_size_m} m, and "
                f"a frame takes fewer than {kernels.REACH_VOXELS - 1}; choose larger voxels or a smaller depth."
            )
        self._scratch = kernels.make_scratch(rig.depth.height, rig.depth.width)
        self._lookup = rig, feature_rows, feature_columns, lookup
        return lookup

    def _pose_of(self, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the rotation, the translation and the camera's voxel."""
        pose = np.asarray(frame.world_from_camera, np.float64)
        if not np.isfinite(pose).all():
            raise RecordingError(f"The pose of frame {frame.name} holds NaN or infinity; leave that frame out.")
        origin = np.floor(pose[:3, 3] / self.grid.voxel_size_m)
        if np.abs(origin).max() > FARTHEST_VOXEL:
            raise RecordingError(
                f"Frame {frame.name} lies {np.abs(pose[:3, 3]).max():.3g} m from the world's origin, more than "
                f"{FARTHEST_VOXEL} voxels; move the world's origin nearer to the recording."
            )
        return np.ascontiguousarray(pose[:3, :3]), pose[:3, 3].copy(), origin.astype(np.int64)
