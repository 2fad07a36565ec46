"""The submaps of a map that is made: some frames at a time, added up by themselves."""

from dataclasses import dataclass, field, replace

import numpy as np

from avlmaps.core.arrays import Float, UInt16
from avlmaps.core.columns import concat
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.submaps import submap_of
from avlmaps.maps.fusion.voxel_sums import VoxelSums
from avlmaps.maps.types import Submaps

_NONE = np.zeros((0, 1, 1), np.uint16)


@dataclass(slots=True)
class _Open:
    number: int
    sums: VoxelAccumulator
    stamps_s: list[float] = field(default_factory=list[float])
    poses: list[np.ndarray] = field(default_factory=list[np.ndarray])

    def submap(self) -> Submaps:
        return submap_of(self.sums.sums(), np.array(self.stamps_s), np.stack(self.poses), _NONE)


class SubmapBook:
    """Takes sums in the order of their frames."""

    def __init__(self) -> None:
        self._whole: list[Submaps] = []
        self._open: _Open | None = None

    def add(
        self, number: int, sums: VoxelSums, stamps_s: list[float], poses: list[np.ndarray], empty: VoxelAccumulator
    ) -> None:
        """Add frames to the submap of a number, which begins in ``empty`` if it is another one than before."""
        if self._open is None or self._open.number != number:
            self.close()
            self._open = _Open(number, empty)
        self._open.sums.merge(sums)
        self._open.stamps_s += stamps_s
        self._open.poses += poses

    def add_whole(self, submap: Submaps) -> None:
        """Add a submap that was made elsewhere."""
        self._whole.append(submap)

    def close(self) -> None:
        """Let the next frames begin another submap."""
        if self._open is not None:
            self._whole.append(self._open.submap())
            self._open = None

    def submaps(self) -> Submaps | None:
        """Return all, with the one that is not whole; None where there is none."""
        every = self._whole + ([] if self._open is None else [self._open.submap()])
        return concat(every) if every else None


def placed(
    submaps: Submaps, pose: Float[np.ndarray, "f 4 4"], clear_mm: UInt16[np.ndarray, "f_or_0 rows columns"]
) -> Submaps:
    """Return submaps whose frames have these poses now."""
    return replace(submaps, pose=pose, clear_mm=clear_mm)
