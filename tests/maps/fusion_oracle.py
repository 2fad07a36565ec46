"""Frames made of random numbers, and what fusion must make of them, computed the long way in float64."""

from dataclasses import dataclass

import numpy as np

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.maps.fusion.sensor import NONE, FusionSettings, SensorModel
from avlmaps.maps.fusion.voxel_sums import VoxelSums
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.types import Frame

DEPTH = Pinhole(30.0, 31.0, 15.7, 12.2, 32, 24)
RIGS = {
    "registered": Rig(DEPTH, DEPTH),
    "registered, colour twice as large": Rig(DEPTH.resized(64, 48), DEPTH),
    "another focal length": Rig(Pinhole(36.0, 35.0, 20.3, 14.9, 40, 30), DEPTH),
    "colour camera beside": Rig(
        Pinhole(36.0, 35.0, 20.3, 14.9, 40, 30),
        DEPTH,
        poses.from_quaternion(np.array([0.05, -0.01, 0.02]), np.array([0.02, -0.03, 0.01, 1.0])),
    ),
}


def random_pose(rng: np.random.Generator) -> np.ndarray:
    return poses.from_quaternion(rng.uniform(-3.0, 3.0, 3), rng.normal(size=4))


def random_frame(rng: np.random.Generator, rig: Rig = RIGS["registered"], index: int = 0) -> Frame:
    """Return a frame whose depth is smooth in part, random in part, absent in part."""
    height, width = rig.depth.height, rig.depth.width
    depth = np.full((height, width), rng.uniform(0.5, 3.0)) + rng.normal(scale=0.02, size=(height, width))
    rough = rng.random((height, width)) < 0.2
    depth[rough] = rng.uniform(0.01, 12.0, rough.sum())
    depth[rng.random((height, width)) < 0.1] = 0.0
    rgb = rng.integers(0, 256, (rig.rgb.height, rig.rgb.width, 3), dtype=np.uint8)
    stamp_s = float(rng.uniform(0.0, 100.0))
    return Frame(index, f"{index:06d}", stamp_s, rgb, depth.astype(np.float32), random_pose(rng), rig)


def random_features(rng: np.random.Generator, rows: int, columns: int, dim: int) -> np.ndarray:
    """Return unit features; about a tenth say nothing."""
    features = rng.normal(size=(rows, columns, dim))
    features /= np.linalg.norm(features, axis=-1, keepdims=True)
    features[rng.random((rows, columns)) < 0.1] = 0.0
    return features.astype(np.float32)


@dataclass
class Pixels:
    """All pixels of all frames with a depth, one row each."""

    voxel: np.ndarray
    weight: np.ndarray
    stamp_s: np.ndarray
    colour: np.ndarray  # NaN outside of the colour picture
    feature: np.ndarray  # zero where there is none
    sharp: np.ndarray


def pixels_of(
    frame: Frame, features: np.ndarray, grid: GridSpec, settings: FusionSettings, sensor: SensorModel = NONE
) -> Pixels:
    rig, depth = frame.rig, frame.depth_m.astype(np.float64)
    valid = np.isfinite(depth) & (depth >= settings.min_depth_m) & (depth <= settings.max_depth_m)
    valid &= depth <= sensor.farthest_m(grid.voxel_size_m)
    exact = 1.0 / (1.0 + (sensor.sigma_m(depth[valid]) / (0.5 * grid.voxel_size_m)) ** 2)
    points = rig.depth.backproject(np.where(valid, depth, 1.0))
    seen = points[valid]
    place = rig.rgb.project(poses.apply(rig.rgb_from_depth, seen))
    if rig.registered:
        v, u = np.nonzero(valid)
        place = (np.stack([u, v], -1) + 0.5) * (rig.rgb.width / rig.depth.width, rig.rgb.height / rig.depth.height)
    size = np.array([rig.rgb.width, rig.rgb.height])
    inside = np.all((place >= 0) & (place < size), axis=1)
    column, row = np.where(inside[:, None], place, 0).astype(int).T
    cells = np.array([features.shape[1], features.shape[0]])
    cell_column, cell_row = np.where(inside[:, None], place * cells / size, 0).astype(int).T
    return Pixels(
        grid.index_of(poses.apply(frame.world_from_camera, seen)),
        np.maximum(np.exp(-np.sum(seen**2, axis=1) / (2 * settings.variance_m2)), 1e-30) * exact,
        np.full(len(seen), frame.stamp_s),
        np.where(inside[:, None], frame.rgb[row, column], np.nan),
        np.where(inside[:, None], features[cell_row, cell_column], 0.0),
        np.floor(256 * exact + 0.5),
    )


def fused(pixels: list[Pixels]) -> VoxelSums:
    """Add the pixels up in float64; the sums of features are rounded to float32 at the end."""
    voxel, which = np.unique(np.concatenate([p.voxel for p in pixels]), axis=0, return_inverse=True)
    which = which.ravel()
    weight, stamp_s, colour, feature, sharp = (
        np.concatenate([getattr(p, name) for p in pixels])
        for name in ("weight", "stamp_s", "colour", "feature", "sharp")
    )
    frame = np.repeat(np.arange(len(pixels)), [len(p.voxel) for p in pixels])
    views = np.bincount(np.unique(np.stack([which, frame], 1), axis=0)[:, 0], minlength=len(voxel))
    says, coloured = np.any(feature != 0.0, axis=1), np.isfinite(colour[:, 0])

    def total(values: np.ndarray) -> np.ndarray:
        out = np.zeros((len(voxel), *values.shape[1:]))
        np.add.at(out, which, values)
        return out

    last_seen_s = np.full(len(voxel), -np.inf)
    np.maximum.at(last_seen_s, which, stamp_s)
    return VoxelSums(
        index=voxel.astype(np.int32),
        feature_sum=total(weight[:, None] * feature).astype(np.float32),
        weight=total(np.where(says, weight, 0.0)),
        rgb_sum=total(np.where(coloured[:, None], weight[:, None] * colour, 0.0)),
        rgb_weight=total(np.where(coloured, weight, 0.0)),
        hits=total(np.ones(len(which))).astype(np.int64),
        views=views.astype(np.int32),
        sharp=total(sharp).astype(np.int64),
        last_seen_s=last_seen_s,
    )


def assert_same_sums(found: VoxelSums, expected: VoxelSums) -> None:
    """Weights agree to 1e-12, sums of features to 1e-5 of the largest number of the voxel's feature."""
    np.testing.assert_array_equal(found.index, expected.index)
    np.testing.assert_array_equal(found.hits, expected.hits)
    np.testing.assert_array_equal(found.views, expected.views)
    np.testing.assert_array_equal(found.sharp, expected.sharp)
    np.testing.assert_array_equal(found.last_seen_s, expected.last_seen_s)
    for name in ("weight", "rgb_weight", "rgb_sum"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12, atol=0.0)
    scale = np.maximum(expected.weight, 1e-37)[:, None]
    np.testing.assert_allclose(found.feature_sum / scale, expected.feature_sum / scale, rtol=0.0, atol=1e-5)
