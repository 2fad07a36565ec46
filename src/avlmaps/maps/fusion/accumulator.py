"""Fusion of pixel features, colour and geometry into voxels.

The feature of a voxel is the weighted mean of the features of all pixels that fell into it, with the paper's weight
exp(−d² / (2·0.6)), d the distance in metres from the camera to the point (Huang et al., Audio Visual Language Maps
for Robot Navigation, section III-A). It is a true mean, so that the order of frames does not matter and maps of
parts of a recording add up to the map of the whole.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Float64, Int32

from avlmaps.core.camera import Rig
from avlmaps.core.errors import BackendError, MapError, RecordingError
from avlmaps.maps.fusion import kernels
from avlmaps.maps.fusion.sensor import NONE, FusionSettings, SensorModel
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.types import Frame

FARTHEST_VOXEL = (1 << 31) - 2 * kernels.REACH_VOXELS  # indices are int32

_FIRST_SLOTS = 1 << 14  # of the hash table of a frame's voxels

__all__ = ["FusionSettings", "VoxelAccumulator", "VoxelSums"]


@dataclass(frozen=True, slots=True)
class PixelLookup:
    """Tables of a rig and a feature map's size that fusion needs, computed once for all frames.

    Where the two cameras share their centre and axes, the colour pixel depends on the depth pixel's column and row
    alone, and tables hold it; else each point is projected.
    """

    x: Float64[np.ndarray, " wd"]  # camera-frame direction of each column at z = 1
    y: Float64[np.ndarray, " hd"]  # and of each row
    # colour column of each depth column, first colour pixel of each depth row, and likewise for the cells of the
    # feature map; -1 where that is outside
    tables: tuple[Int32[np.ndarray, " n"], ...]
    # whether to project instead, rgb_from_depth, colour camera's fx fy cx cy, its rows and columns, rows and columns of
    # the feature map
    projection: kernels.Projection


def look_up(rig: Rig, feature_rows: int, feature_columns: int) -> PixelLookup:
    """Prepare the lookup for a rig and a feature map that covers the colour picture evenly (0 x 0 for none)."""
    depth, rgb = rig.depth, rig.rgb
    x = (np.arange(depth.width) + 0.5 - depth.cx) / depth.fx
    y = (np.arange(depth.height) + 0.5 - depth.cy) / depth.fy
    column, row = rgb.fx * x + rgb.cx, rgb.fy * y + rgb.cy
    if rig.registered:  # exact, where a division and a multiplication by fx leave rounding
        column = (np.arange(depth.width) + 0.5) * (rgb.width / depth.width)
        row = (np.arange(depth.height) + 0.5) * (rgb.height / depth.height)
    tables = (
        _cells(column, rgb.width, rgb.width, 1),
        _cells(row, rgb.height, rgb.height, rgb.width),
        _cells(column, rgb.width, feature_columns, 1),
        _cells(row, rgb.height, feature_rows, feature_columns),
    )
    projection = (
        not np.array_equal(rig.rgb_from_depth, np.eye(4)),
        np.array(rig.rgb_from_depth, np.float64, order="C"),
        (float(rgb.fx), float(rgb.fy), float(rgb.cx), float(rgb.cy)),
        (rgb.height, rgb.width),
        (feature_rows, feature_columns),
    )
    return PixelLookup(x, y, tables, projection)


def _cells(place: Float64[np.ndarray, " n"], size: int, cells: int, apart: int) -> Int32[np.ndarray, " n"]:
    inside = (place >= 0.0) & (place < size) & (cells > 0)
    cell = np.floor(np.where(inside, place, 0.0) * (cells / size)) * apart
    return np.where(inside, cell, -1.0).astype(np.int32)


class _Scratch:
    """Working memory of the compiled loops, for pictures of one size: no frame has more voxels or pairs than pixels."""

    def __init__(self, height: int, width: int, *, with_spread: bool) -> None:
        pixels, spreads = height * width, kernels.SPREAD_COLUMNS - 1 if with_spread else 0
        self.row: kernels.Row = tuple(np.empty(width, kind) for kind in ("i8", "f8", "i8", "i4", "i4"))
        self.voxels: kernels.FrameVoxels = (
            np.empty(_FIRST_SLOTS, np.int64), np.empty(_FIRST_SLOTS, np.int32), np.empty(pixels, np.int64),
            np.empty((pixels, kernels.SUM_COLUMNS)), np.empty((pixels, spreads)),
        )  # fmt: skip
        sizes = (pixels,) * 4 + (kernels.RECENT_PAIRS,) * 2
        self.pairs: kernels.Pairs = tuple(map(np.empty, sizes, ("i4", "f8", "i4", "i4", "i4", "i8")))

    def enlarge(self) -> None:
        slots = 2 * len(self.voxels[0])
        self.voxels = np.empty(slots, np.int64), np.empty(slots, np.int32), *self.voxels[2:]


class VoxelAccumulator(VoxelTable):
    """Adds up frames, or the sums of parts, into sparse voxels without bounds.

    Weights are float64 and never fall below 1e-30 (which exp(−d² / 1.2) reaches at 9.1 m), so that what was only ever
    seen from afar has a feature in float32; it counts for nothing beside a nearer look. Memory is that of the voxels,
    4·dim + 70 bytes each, however many frames there are. Kernels release the interpreter's lock: two accumulators on
    two threads map two parts at once.
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
        """Begin an empty map: ``dim`` is the length of a feature, 0 where no pixel features will come.

        By default every depth within the limits is used as it is. ``with_spread`` notes how points lie within their
        voxels.
        """
        if dim < 0:
            raise ValueError(f"dim is {dim}; a feature cannot have fewer than 0 numbers")
        super().__init__(dim, with_spread=with_spread)
        self.grid = grid
        self.settings = settings or FusionSettings()
        self.sensor = sensor
        self.frames = 0
        self._with_spread = with_spread
        self._lookup: tuple[Rig, int, int, PixelLookup] | None = None
        self._scratch = _Scratch(1, 1, with_spread=with_spread)

    def add(self, frame: Frame, features: Float[np.ndarray, "hf wf d"] | None = None) -> int:
        """Add a frame: every pixel with a depth within the limits counts, once. Return how many those are.

        The colour and the feature of a point are those of the colour pixel that it projects to. A point outside of the
        colour picture adds to the geometry only (an occupied voxel, hits, last seen), and so does a feature that is all
        zero, but for the colour. Features cover the colour picture evenly, at any resolution; None adds colour and
        geometry only.
        """
        cells, (feature_rows, feature_columns) = self._cells(features)
        lookup = self._lookup_for(frame.rig, feature_rows, feature_columns)
        pose = self._pose_of(frame)
        depth, limits = self._depth_of(frame), self._limits()
        rays, colours = (lookup.x, lookup.y), np.require(frame.rgb, np.uint8, ["C", "W"]).reshape(-1, 3)
        while True:
            held = self._scratch
            traced = kernels.trace(
                depth, rays, pose, limits, colours, lookup.tables, lookup.projection, held.row, held.voxels, held.pairs
            )
            points, voxels, pairs = (int(count) for count in traced)
            if pairs >= 0:
                break
            held.enlarge()
        rows = np.empty(voxels, np.int32)
        self.reserve(voxels)
        of_frame = voxels, self.frames, float(frame.stamp_s)
        self.count = int(kernels.commit(of_frame, pose[2], held.voxels, self.arrays, self.count, rows))
        self.frames += 1
        faults = kernels.add_features(rows, held.pairs, cells, self.feature_sum, self.weight) if pairs else 0
        if faults:
            raise BackendError(
                f"The pixel encoder gave NaN or infinite features for frame {frame.name} (in {faults} voxels); "
                "leave the frame out or choose another profile."
            )
        return points

    def _limits(self) -> kernels.Limits:
        settings, sensor, half = self.settings, self.sensor, 0.5 * self.grid.voxel_size_m
        farthest = min(settings.max_depth_m, sensor.farthest_m(self.grid.voxel_size_m))
        noise = sensor.noise_m / half, sensor.noise_per_m / half
        return (self.grid.voxel_size_m, settings.min_depth_m, farthest, 0.5 / settings.variance_m2, *noise)

    def _depth_of(self, frame: Frame) -> Float32[np.ndarray, "h w"]:
        depth = np.require(frame.depth_m, np.float32, ["C", "W"])
        sensor, camera = self.sensor, frame.rig.depth
        if sensor.edge_sigmas is None:
            return depth
        kept = np.empty_like(depth)
        slope = np.tan(np.deg2rad(sensor.steepest_deg))
        steps = slope / camera.fx, slope / camera.fy
        kernels.drop_flying(depth, steps, (sensor.noise_m, sensor.noise_per_m), sensor.edge_sigmas, kept)
        return kept

    def _cells(self, features: np.ndarray | None) -> tuple[Float32[np.ndarray, "cells d"], tuple[int, int]]:
        if features is not None and (features.ndim != 3 or features.shape[2] != self.dim or 0 in features.shape[:2]):
            raise ValueError(f"features have shape {features.shape}; this map takes (rows, columns, {self.dim})")
        if features is None or self.dim == 0:
            return np.zeros((0, self.dim), np.float32), (0, 0)
        cells = np.ascontiguousarray(features, np.float32).reshape(-1, self.dim)
        return cells, (features.shape[0], features.shape[1])

    def _lookup_for(self, rig: Rig, feature_rows: int, feature_columns: int) -> PixelLookup:
        if self._lookup is not None:
            known_rig, known_rows, known_columns, lookup = self._lookup
            if known_rig is rig and (known_rows, known_columns) == (feature_rows, feature_columns):
                return lookup
        lookup = look_up(rig, feature_rows, feature_columns)
        longest_ray = np.sqrt(np.square(lookup.x).max() + np.square(lookup.y).max() + 1.0)  # per metre of depth
        reach = longest_ray * self.settings.max_depth_m / self.grid.voxel_size_m
        if reach >= kernels.REACH_VOXELS - 1:
            raise MapError(
                f"A depth of {self.settings.max_depth_m} m spans {reach:.0f} voxels of {self.grid.voxel_size_m} m, and "
                f"a frame takes fewer than {kernels.REACH_VOXELS - 1}; choose larger voxels or a smaller depth."
            )
        self._scratch = _Scratch(rig.depth.height, rig.depth.width, with_spread=self._with_spread)
        self._lookup = rig, feature_rows, feature_columns, lookup
        return lookup

    def _pose_of(self, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
