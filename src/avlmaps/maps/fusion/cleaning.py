"""Which voxels of a map are no surface: those that frames see through, smears of noisy depth, and specks.

All that it decides on are whole numbers that add up over frames, so that the parts of a recording in any order give
the same map.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float64, Int32

from avlmaps.core.camera import Pinhole
from avlmaps.maps.fusion import carving_kernels
from avlmaps.maps.fusion.free_space import FreeViews, count_through
from avlmaps.maps.fusion.measure_kernels import SHARP_UNITS
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.fusion.voxel_kernels import rehash
from avlmaps.maps.fusion.voxel_sums import Evidence
from avlmaps.maps.grid import GridSpec

_Count = Callable[[Int32[np.ndarray, "n 3"]], Int32[np.ndarray, " n"]]

FEWEST_THROUGH = 2  # frames: one may have a wrong pose
THROUGH_SHARE = 0.5  # a voxel goes when more frames see through it than this share of those that hit it
SPECK_VIEWS = 2  # a group of which a voxel is hit by more frames is not a speck
MOST_REACH = 4.0  # voxels: a smear is looked for no farther


def clean(
    evidence: Evidence,
    views: Sequence[FreeViews],
    camera: Pinhole,
    grid: GridSpec,
    sensor: SensorModel,
    count: _Count | None = None,
) -> tuple[Bool[np.ndarray, " n"], dict[str, int]]:
    """Return which voxels are a surface, and how many are not: ``seen_through``, ``smeared``, ``specks``.

    Args:
        evidence: of all voxels.
        views: where the frames saw freely.
        camera: of the frames, for depth.
        grid: the voxels' size.
        sensor: the camera's error.
        count: returns how many frames see through each voxel, where that is known already; the views do not count then.
    """
    count = count or (lambda index: count_through(index, grid, camera, views))
    kept = np.ones(len(evidence), bool)
    removed: dict[str, int] = {}
    for name, rule in (("seen_through", _through), ("smeared", _smeared), ("specks", _specks)):
        there = np.flatnonzero(kept)
        gone = rule(evidence.only(kept), count, sensor)
        kept[there[gone]] = False
        removed[name] = int(gone.sum())
    return kept, removed


def _through(evidence: Evidence, count: _Count, sensor: SensorModel) -> Bool[np.ndarray, " n"]:
    if not sensor.carve:
        return np.zeros(len(evidence), bool)
    return seen_through(count(evidence.index), evidence.views)


def seen_through(through: Int32[np.ndarray, " n"], views: Int32[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Return which voxels are no surface: too many frames see through them, compared with those that hit them."""
    return (through >= FEWEST_THROUGH) & (through > THROUGH_SHARE * views)


def smear_reach(evidence: Evidence, sensor: SensorModel) -> Float64[np.ndarray, " n"]:
    """Return how far the surface that a voxel's hits came from may be, voxels."""
    # sharp / hits is the mean of 1 / (1 + (σ / half a voxel)²)
    exact = np.clip(evidence.sharp / (SHARP_UNITS * evidence.hits), 1.0 / SHARP_UNITS, 1.0)
    return np.minimum(sensor.smear_sigmas * 0.5 * np.sqrt(1.0 / exact - 1.0), MOST_REACH)


def _smeared(evidence: Evidence, count: _Count, sensor: SensorModel) -> Bool[np.ndarray, " n"]:
    smeared = np.zeros(len(evidence), bool)
    if sensor.smear_sigmas > 0.0:
        carving_kernels.mark_smeared(
            evidence.index, evidence.sharp, smear_reach(evidence, sensor), sensor.smear_ratio, _table(evidence), smeared
        )
    return smeared


def _specks(evidence: Evidence, count: _Count, sensor: SensorModel) -> Bool[np.ndarray, " n"]:
    if sensor.speck_voxels == 0 or len(evidence) == 0:
        return np.zeros(len(evidence), bool)
    of = np.empty(len(evidence), np.int64)
    carving_kernels.group(evidence.index, _table(evidence), of)
    size = np.bincount(of, minlength=len(evidence))
    often = np.zeros(len(evidence), np.int32)
    np.maximum.at(often, of, evidence.views)
    return (size[of] <= sensor.speck_voxels) & (often[of] <= SPECK_VIEWS)


def _table(evidence: Evidence) -> Int32[np.ndarray, " slots"]:
    table = np.full(1 << (2 * len(evidence) + 1).bit_length(), -1, np.int32)
    rehash(table, evidence.index, len(evidence))
    return table
