"""Which frames bring something to a map, and which of those bring something to its features.

A frame is fused where the camera moved or new surface is in view. The encoder is what costs most of a frame, and the
frames of a slow robot show the same again and again, so that only some are encoded: a voxel's feature is a mean whose
weights fall with distance, and a frame is worth encoding where its look at enough places weighs something beside the
looks that were encoded before. The others add their surface and colours alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float, Int64
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.live.settings import LiveSettings
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.sensor import FusionSettings
from avlmaps.recordings.types import Frame

_ROWS, _COLUMNS = 30, 40  # points of a frame that are looked up
LATER_SHARE = 0.02  # of the points of a frame that must be worth it, when there is time
_PLACE_M = 0.2  # the points of a frame are this far apart at 5 m
_AXIS = 1 << 20  # places along each axis


@dataclass(frozen=True, slots=True)
class Looked:
    """Some points that a frame sees.

    Attributes:
        world: where they are, metres.
        distance_m: how far from the camera.
    """

    world: Float[np.ndarray, "n 3"]
    distance_m: Float[np.ndarray, " n"]

    @classmethod
    def of(cls, frame: Frame, farthest_m: float) -> "Looked":
        """Return points of a frame that are spread evenly over its picture, up to a depth."""
        camera = frame.rig.depth
        row = ((np.arange(_ROWS) + 0.5) * camera.height / _ROWS).astype(np.int64)
        column = ((np.arange(_COLUMNS) + 0.5) * camera.width / _COLUMNS).astype(np.int64)
        z = frame.depth_m[row[:, None], column].astype(np.float64)
        x = (column + 0.5 - camera.cx) / camera.fx * z
        y = (row[:, None] + 0.5 - camera.cy) / camera.fy * z
        points = np.stack([x, y, z], axis=-1)[(z > 0.0) & (z < farthest_m)]
        pose = np.asarray(frame.world_from_camera, np.float64)
        return cls(points @ pose[:3, :3].T + pose[:3, 3], np.linalg.norm(points, axis=1))


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
        if not sums or self._last is None or self._new_share(frame, sums) > self._settings.new_share:
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

    def _new_share(self, frame: Frame, sums: Sequence[VoxelAccumulator]) -> float:
        """Return the share of points in voxels that too few frames hit."""
        world = Looked.of(frame, self._farthest_m).world
        if not len(world):
            return 0.0
        index = np.floor(world / sums[0].grid.voxel_size_m).astype(np.int32)
        views = sum((part.views_at(index) for part in sums), np.zeros(len(index), np.int32))
        return float((views < self._settings.known_views).mean())


class EncodingGate:
    """Says of each frame that is fused whether it is encoded; its memory is that of the surface."""

    def __init__(self, settings: LiveSettings, fusion: FusionSettings) -> None:
        """Begin with nothing encoded.

        Args:
            settings: the limits.
            fusion: how the weight of a look falls with its distance.
        """
        self._settings, self._fusion = settings, fusion
        self._weight: dict[int, float] = {}  # of the looks at a place that were encoded

    def opens(self, frame: Frame, waiting: int = 0) -> bool:
        """Return whether a frame is to be encoded; it then counts as encoded.

        Args:
            frame: the frame.
            waiting: frames behind it; the more, the more must be new in it. All of it new always opens.
        """
        share = min(self._settings.encoded_share * (1 + waiting), 0.5)
        return self._is_encoded(frame, self._settings.looks, share)

    def opens_again(self, frame: Frame) -> bool:
        """Return the same of a frame of before, now that there is time."""
        return self._is_encoded(frame, self._settings.later_looks, LATER_SHARE)

    def worth_later(self, frame: Frame) -> float:
        """Return the share of a frame's points that are worth a look when there is time."""
        return self._looked(frame, self._settings.later_looks)[0]

    def _is_encoded(self, frame: Frame, looks: int, share: float) -> bool:
        worth, weights = self._looked(frame, looks)
        if worth > share:
            self._weight.update(weights)
        return worth > share

    def _looked(self, frame: Frame, looks: int) -> tuple[float, dict[int, float]]:
        """Return the share of points worth a look beside others, and what places weigh with this one."""
        looked = Looked.of(frame, self._fusion.max_depth_m)
        if not len(looked.world):
            return 0.0, {}
        weight = np.maximum(np.exp(looked.distance_m**2 * (-0.5 / self._fusion.variance_m2)), 1e-30)
        places, at = np.unique(_keys(looked.world), return_inverse=True)
        best = np.zeros(len(places))
        np.maximum.at(best, at, weight)
        known = np.array([self._weight.get(place, 0.0) for place in places.tolist()])
        worth = float((best * looks > known)[at].mean())
        return worth, dict(zip(places.tolist(), (known + best).tolist(), strict=True))


def _keys(world: Float[np.ndarray, "n 3"]) -> Int64[np.ndarray, " n"]:
    """Return a number for the place of each point."""
    x, y, z = np.floor(world / _PLACE_M).astype(np.int64).T % _AXIS
    return (x * _AXIS + y) * _AXIS + z
