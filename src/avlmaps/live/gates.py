"""Which frames bring something to a map: where the camera moved, or new surface is in view."""

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.live.settings import LiveSettings
from avlmaps.maps.mapper import Mapper
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

    def reason_against(self, frame: Frame, mapper: Mapper) -> str | None:
        """Return why a frame brings nothing, ``still`` or ``known``; None where it is to be fused."""
        if not len(mapper) or self._last is None or self._new_share(frame, mapper) > self._settings.new_share:
            self._last = np.asarray(frame.world_from_camera, np.float64)
            return None
        return "still" if self.is_still(frame) else "known"

    def is_still(self, frame: Frame) -> bool:
        """Return whether the camera did not move since the last frame that was to be fused."""
        if self._last is None:
            return False
        pose = np.asarray(frame.world_from_camera, np.float64)
        moved_m = float(np.linalg.norm(pose[:3, 3] - self._last[:3, 3]))
        turned_rad = float(rotation_angle_rad(pose[None], self._last[None])[0])
        return moved_m < self._settings.still_m and turned_rad < np.radians(self._settings.still_deg)

    def _new_share(self, frame: Frame, mapper: Mapper) -> float:
        world = _points(frame, self._farthest_m)
        if not len(world):
            return 0.0
        views = mapper.views_at(np.floor(world / mapper.settings.voxel_size_m).astype(np.int32))
        return float((views < self._settings.known_views).mean())


def _points(frame: Frame, farthest_m: float) -> Float[np.ndarray, "n 3"]:
    camera = frame.rig.depth
    row = ((np.arange(_ROWS) + 0.5) * camera.height / _ROWS).astype(np.int64)
    column = ((np.arange(_COLUMNS) + 0.5) * camera.width / _COLUMNS).astype(np.int64)
    z = frame.depth_m[row[:, None], column].astype(np.float64)
    x = (column + 0.5 - camera.cx) / camera.fx * z
    y = (row[:, None] + 0.5 - camera.cy) / camera.fy * z
    points = np.stack([x, y, z], axis=-1)[(z > 0.0) & (z < farthest_m)]
    pose = np.asarray(frame.world_from_camera, np.float64)
    return points @ pose[:3, :3].T + pose[:3, 3]
