"""The voxel grid: the only place where metres become voxels."""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float, Int

_ROWS = 256


@dataclass(frozen=True, slots=True)
class GridSpec:
    """An unbounded grid of cubes; voxel i covers [i·s, (i+1)·s) along each axis of the world, i of any sign."""

    voxel_size_m: float = 0.05

    def __post_init__(self) -> None:
        if not (np.isfinite(self.voxel_size_m) and 0.001 <= self.voxel_size_m <= 10.0):
            raise ValueError(f"voxel_size_m is {self.voxel_size_m}; it must be between 0.001 and 10")

    def index_of(self, points_world: Float[np.ndarray, "*n 3"]) -> Int[np.ndarray, "*n 3"]:
        """Return the voxel of each point (floor, so that the origin is no wider than the rest)."""
        return np.floor(points_world / self.voxel_size_m).astype(np.int32)

    def centre_of(self, index: Int[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Return the middle of each voxel, metres."""
        return (index + 0.5) * self.voxel_size_m


def index_ends(index: Int[np.ndarray, "n 3"]) -> tuple[Int[np.ndarray, "3"], Int[np.ndarray, "3"]]:
    """Return the lowest and the highest index along each axis of voxels, of which there is at least one."""
    voxels = np.asarray(index)
    several = len(voxels) // _ROWS
    parts = [voxels[several * _ROWS :]]
    if several:  # many voxels side by side are compared at once, ten times as fast
        wide = voxels[: several * _ROWS].reshape(several, -1)
        parts += [wide.min(axis=0).reshape(-1, 3), wide.max(axis=0).reshape(-1, 3)]
    ends = np.concatenate(parts).astype(np.int64)
    return ends.min(axis=0), ends.max(axis=0)
