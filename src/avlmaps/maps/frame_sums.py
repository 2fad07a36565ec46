"""Frames of a map that were added up since its last snapshot."""

from dataclasses import dataclass, field

import numpy as np

from avlmaps.core.arrays import Int32
from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViewCollector
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.fusion.voxel_sums import features_alone
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.settings import BuildSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import Frame


@dataclass(slots=True)
class Part:
    """Some frames, all of one submap."""

    sums: VoxelAccumulator
    views: FreeViewCollector
    submap: int
    stamps_s: list[float] = field(default_factory=list[float])
    poses: list[np.ndarray] = field(default_factory=list[np.ndarray])


class FrameSums:
    """Takes frames, and gives them away as parts.

    Attributes:
        dim: length of a feature, 0 where there are none; None until that is known.
    """

    def __init__(self, settings: BuildSettings, encoders: Encoders) -> None:
        self.dim: int | None = None
        self._settings, self._encoders = settings, encoders
        self._parts: list[Part] = []
        self._submap = -1, 0  # its number, and how many of its frames came

    def __len__(self) -> int:
        """Return how many frames there are."""
        return sum(len(part.stamps_s) for part in self._parts)

    def add(self, frame: Frame, features: np.ndarray | None, sensor: SensorModel) -> None:
        """Add a frame; see ``VoxelAccumulator.add``."""
        if features is not None and self._known_dim() == 0:
            raise BackendError(f"{frame.name} has features, and the frames before had none; give them with all frames.")
        self.dim = features.shape[2] if features is not None else self._known_dim()
        part = self._part_for(frame, sensor)
        part.sums.add(frame, features)
        part.views.add(frame)
        part.stamps_s.append(frame.stamp_s)
        part.poses.append(np.array(frame.world_from_camera, np.float64))
        self._submap = part.submap, part.sums.frames

    def add_features(self, frame: Frame, features: np.ndarray, sensor: SensorModel) -> None:
        """Add the features of a frame that was added without."""
        looked = self.empty(sensor)
        looked.add(frame, features)
        self._part_for(frame, sensor).sums.merge(features_alone(looked.sums()))

    def take(self) -> list[Part]:
        """Return the parts, and begin others."""
        parts, self._parts = self._parts, []
        return parts

    def end_submap(self) -> None:
        """Let the next frame begin a submap."""
        self._submap = -1, 0

    def empty(self, sensor: SensorModel) -> VoxelAccumulator:
        """Return sums of no frame."""
        settings, with_spread = self._settings, self._settings.frames.per_submap > 0
        grid = GridSpec(settings.voxel_size_m)
        return VoxelAccumulator(grid, self._known_dim() or 0, settings.fusion, sensor, with_spread=with_spread)

    def views_at(self, index: Int32[np.ndarray, "n 3"]) -> Int32[np.ndarray, " n"]:
        """Return how many frames have a pixel in each of some voxels."""
        return sum((part.sums.views_at(index) for part in self._parts), np.zeros(len(index), np.int32))

    def _known_dim(self) -> int | None:
        if self.dim is None and Kind.PIXELS in self._encoders:
            self.dim = self._encoders.card(Kind.PIXELS).dim
        return self.dim

    def _part_for(self, frame: Frame, sensor: SensorModel) -> Part:
        per_submap = self._settings.frames.per_submap
        number = frame.index // per_submap if per_submap else 0
        if not self._parts or self._parts[-1].submap != number:
            sums = self.empty(sensor)
            sums.frames = self._submap[1] if self._submap[0] == number else 0
            self._parts.append(Part(sums, FreeViewCollector(frame.rig.depth, sensor), number))
        return self._parts[-1]
