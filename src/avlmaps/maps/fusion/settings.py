"""The settings of fusion; apart from the kernels, so that the command line's help need not load a compiler."""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.maps.fusion.sensor import SensorModel, SensorName

PAPERS_VARIANCE_M2 = 0.6


@dataclass(frozen=True, slots=True)
class FusionSettings:
    """How pixels become voxels."""

    min_depth_m: float = 0.1
    """Leave out pixels that are nearer."""
    max_depth_m: float = 10.0
    """Leave out pixels that are farther."""
    weight_variance_m2: float | None = None
    """The 0.6 of the weight exp(−d² / (2·0.6)), d the distance from the camera in metres. None takes what the profile's
    pixel encoder is best at: the paper's 0.6 for most."""
    sensor: SensorName | SensorModel = "auto"
    """The depth camera, whose error decides which depths are used and how much they count. `auto` measures the error in
    the frames and takes the nearest of kinect, realsense and perfect; `none` uses every depth as it is, like the
    paper."""

    def __post_init__(self) -> None:
        if not 0.0 < self.min_depth_m < self.max_depth_m < np.inf:
            raise MapError(
                f"Depths from {self.min_depth_m} to {self.max_depth_m} m are no range; "
                "let it begin above 0 and end at a finite, greater depth."
            )
        if not 0.0 < self.variance_m2 < np.inf:
            raise MapError(f"The weight's variance is {self.weight_variance_m2}; it must be positive and finite.")

    @property
    def variance_m2(self) -> float:
        """The weight's variance; the paper's where none was chosen."""
        return PAPERS_VARIANCE_M2 if self.weight_variance_m2 is None else self.weight_variance_m2
