"""How wrong a depth camera is, measured or chosen, and which of its depths are fused; no kernels: help needs none.

The error of a camera that measures depth as a shift between two views (structured light, stereo) grows with the square
of the depth: σ(z) = noise_m + noise_per_m · z².

* kinect: σ = 0.0012 + 0.0019 (z − 0.4)² m, measured by Nguyen, Izadi and Lovell, Modeling Kinect Sensor Noise for
  Improved 3D Reconstruction and Tracking (3DIMPVT 2012); rounded up here to 0.0019 z². Khoshelham and Elberink (Sensors
  2012) measured 0.0014 z².
* realsense: σ = s z² / (f b), with a subpixel error s = 0.08 px, the focal length f = 424 px of a D435 at 848 columns
  and its baseline b = 0.05 m: 0.0038 z² (the formula and s are from Intel's tuning guide of the D400 family).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.numbers import hold_numbers
from avlmaps.recordings.types import Frame

SensorName = Literal["auto", "kinect", "realsense", "perfect", "none"]


@dataclass(frozen=True, slots=True)
class SensorModel:
    """The error of a depth camera, and what follows from it. The defaults are those of a camera without error."""

    noise_m: float = 0.0
    """σ of a depth of 0 m, metres."""
    noise_per_m: float = 0.0
    """How σ grows with the square of the depth: σ(z) = noise_m + noise_per_m · z²."""
    worst_voxels: float | None = None
    """Leave out a depth whose σ is greater than this many voxel edges; None leaves out none."""
    edge_sigmas: float | None = None
    """Leave out a pixel between a nearer and a farther surface, each more than this many σ away: a flying pixel. None
    leaves out none."""
    steepest_deg: float = 90.0
    """Leave out a pixel on a surface that the camera sees at a more grazing angle than this (0: face on)."""
    clear_sigmas: float = 3.0
    """A ray is free up to this many σ before its depth."""
    carve: bool = True
    """Remove voxels that frames see through."""
    smear_sigmas: float = 0.0
    """Remove a voxel when another, up to this many of its own σ away, is much better seen; 0 removes none."""
    smear_ratio: float = 4.0
    """Much better: this many times the sum of how exact the hits are."""
    speck_voxels: int = 0
    """Remove groups of up to this many voxels that stand alone and that no more than 2 frames hit."""

    def __post_init__(self) -> None:
        hold_numbers(
            self, MapError, positive="worst_voxels edge_sigmas steepest_deg smear_ratio",
            least_0="noise_m noise_per_m clear_sigmas smear_sigmas speck_voxels",
        )  # fmt: skip
        if self.steepest_deg > 90.0:
            raise MapError(f"steepest_deg is {self.steepest_deg}; choose an angle up to 90 degrees.")

    def sigma_m(self, depth_m: Any) -> Any:
        """Return the standard deviation of a depth or of many, metres."""
        return self.noise_m + self.noise_per_m * depth_m * depth_m

    def farthest_m(self, voxel_size_m: float) -> float:
        """Return the depth beyond which the error is more than a voxel can bear; infinity where it never is."""
        if self.worst_voxels is None:
            return np.inf
        spare = self.worst_voxels * voxel_size_m - self.noise_m
        if self.noise_per_m == 0.0:
            return np.inf if spare >= 0.0 else 0.0
        return float(np.sqrt(max(spare, 0.0) / self.noise_per_m))


PERFECT = SensorModel()
KINECT = SensorModel(
    0.0012, 0.0019, worst_voxels=1.25, edge_sigmas=4.0, steepest_deg=85.0, smear_sigmas=2.0, speck_voxels=4
)
REALSENSE = replace(KINECT, noise_m=0.001, noise_per_m=0.0038, worst_voxels=1.5, smear_ratio=6.0)
NONE = SensorModel(carve=False)

MODELS: dict[SensorName, SensorModel] = {"kinect": KINECT, "realsense": REALSENSE, "perfect": PERFECT, "none": NONE}


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
        hold_numbers(self, MapError, positive="min_depth_m max_depth_m weight_variance_m2")
        if self.min_depth_m >= self.max_depth_m:
            raise MapError(f"Depths from {self.min_depth_m} to {self.max_depth_m} m are no range; let it end farther.")

    @property
    def variance_m2(self) -> float:
        """The weight's variance; the paper's where none was chosen."""
        return PAPERS_VARIANCE_M2 if self.weight_variance_m2 is None else self.weight_variance_m2


FRAMES = 12  # looked at, spread evenly
_FEWEST = 500  # measured places; with fewer the error is not known
_NEAREST_M = 1.0
_STEPS_WIDE = 80  # second differences are taken over a row divided by this: noise that is alike nearby shows as well
_PERFECT_PER_M = 4e-4  # below this a depth is wrong by less than a millimetre at 1.5 m: rounding


def nearest_model(noise_per_m: float | None) -> SensorName:
    """Return the model whose error is nearest to a measured one; perfect where it could not be measured."""
    if noise_per_m is None or noise_per_m < _PERFECT_PER_M:
        return "perfect"
    near = {name: abs(np.log(MODELS[name].noise_per_m / noise_per_m)) for name in ("kinect", "realsense")}
    return "kinect" if near["kinect"] <= near["realsense"] else "realsense"


def measure_noise(frames: Iterable[Frame]) -> float | None:
    """Return how the error of depth grows with its square, 1/m; None where too little depth is in view.

    On a plane 1/z changes evenly along a row. So a second difference of 1/z is noise, √6 times that of 1/z, and the
    noise of 1/z is σ(z) / z². The median of many sees past edges and curved things.
    """
    found = [_second_differences(frame) for frame in frames]
    every = np.concatenate(found) if found else np.zeros(0)
    if len(every) < _FEWEST:
        return None
    return float(np.median(np.abs(every)) / 0.6745 / np.sqrt(6.0))


def _second_differences(frame: Frame) -> np.ndarray:
    step = max(1, round(frame.rig.depth.width / _STEPS_WIDE))
    depth = frame.depth_m.astype(np.float64)
    inverse = np.divide(1.0, depth, out=np.full(depth.shape, np.nan), where=np.isfinite(depth) & (depth > _NEAREST_M))
    second = inverse[:, : -2 * step] - 2.0 * inverse[:, step:-step] + inverse[:, 2 * step :]
    return second[np.isfinite(second)]
