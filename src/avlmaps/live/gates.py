"""Which frames bring something to a map: those of a camera that moved, or with new surface in view."""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.live.settings import LiveSettings
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.recordings.types import Frame

_ROWS, _COLUMNS = 30, 40  # points of a frame that are looked up


class Gates:
    """Says of each frame whether it is fused."""

    def __init__(self, settings: LiveSettings, farthest_m: float) -> None:
        """Begin with everything new.

        Args:
            settings: the limits.
            farthest_m: depths beyond it do not count.
        """
        self._settings, self._farthest_m = settings, farthest_m
        self._last: Float[np.ndarray, "4 4"] | None = None

    def reason_against(self, frame: Frame, sums: Sequence[VoxelAccumulator]) -> str | None:
        """Return why a frame brings nothing, ``still`` or ``known``; None where it is to be fused.

        Args:
            frame: the frame.
            sums: of the map, as parts that add up to it.
        """
        pose = np.asarray(frame.world_from_camera, np.float64)
        if self._last is None or not sums or self._new_share(frame, sums) > self._settings.new_share:
            self._last = pose
            return None
        moved_m = float(np.linalg.norm(pose[:3, 3] - self._last[:3, 3]))
        turned_rad = float(rotation_angle_rad(pose[None], self._last[None])[0])
        still = moved_m < self._settings.still_m and turned_rad < np.radians(self._settings.still_deg)
        return "still" if still else "known"

    def _new_share(self, frame: Frame, sums: Sequence[VoxelAccumulator]) -> float:
        """Return the share of points in voxels that too few frames hit."""
        camera = frame.rig.depth
        row = ((np.arange(_ROWS) + 0.5) * camera.height / _ROWS).astype(np.int64)
        column = ((np.arange(_COLUMNS) + 0.5) * camera.width / _COLUMNS).astype(np.int64)
        z = frame.depth_m[row[:, None], column].astype(np.float64)
        x = (column + 0.5 - camera.cx) / camera.fx * z
        y = (row[:, None] + 0.5 - camera.cy) / camera.fy * z
        points = np.stack([x, y, z], axis=-1)[(z > 0.0) & (z < self._farthest_m)]
        if not len(points):
            return 0.0
        pose = np.asarray(frame.world_from_camera, np.float64)
        world = points @ pose[:3, :3].T + pose[:3, 3]
        index = np.floor(world / sums[0].grid.voxel_size_m).astype(np.int32)
        views = sum((part.views_at(index) for part in sums), np.zeros(len(index), np.int32))
        return float((views < self._settings.known_views).mean())
