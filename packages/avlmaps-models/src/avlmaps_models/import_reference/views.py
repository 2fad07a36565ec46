"""The part of the map that a keyframe saw, computed from the map's voxels where there are no depth pictures."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole

_CELL_M = 0.15  # voxels are thinned to cells of this size: a view needs no more
_COLUMNS = 24  # of bins of the picture, each as wide as a cell is at about 2.5 m
_NEAREST_M = 0.3
_FARTHEST_M = 6.0  # as far as the reference fuses


def thinned(places: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "m 3"]:
    """Return the middles of the coarse cells that hold a place."""
    return (np.unique(np.floor(places / _CELL_M), axis=0) + 0.5) * _CELL_M


def middles_of_view(
    places: Float[np.ndarray, "m 3"], world_from_camera: Iterable[Float[np.ndarray, "4 4"]], camera: Pinhole
) -> Float32[np.ndarray, "k 3"]:
    """Return for each camera the median of the places that it sees, as a build does from its depth; see ``thinned``.

    Args:
        places: occupied, metres, world.
        world_from_camera: poses.
        camera: whose picture is divided into bins, in each of which only the nearest place is seen.

    Returns:
        One place for each camera; its own where it sees none.
    """
    middles = [_middle(places, pose, camera) for pose in world_from_camera]
    return np.array(middles, np.float32).reshape(-1, 3)


def _middle(
    places: Float[np.ndarray, "m 3"], world_from_camera: Float[np.ndarray, "4 4"], camera: Pinhole
) -> Float[np.ndarray, "3"]:
    points = poses.apply(poses.inverse(world_from_camera), places)
    ahead = np.flatnonzero((points[:, 2] > _NEAREST_M) & (points[:, 2] < _FARTHEST_M))
    size_px = camera.width / _COLUMNS
    column, row = np.floor(camera.project(points[ahead]) / size_px).astype(np.int64).T
    rows = max(1, round(camera.height / size_px))
    inside = (column >= 0) & (column < _COLUMNS) & (row >= 0) & (row < rows)
    ahead, bin_ = ahead[inside], (row * _COLUMNS + column)[inside]
    if not len(ahead):
        return world_from_camera[:3, 3]
    by_depth = np.argsort(points[ahead, 2], kind="stable")
    _, first = np.unique(bin_[by_depth], return_index=True)
    return np.median(places[ahead[by_depth[first]]], axis=0)
