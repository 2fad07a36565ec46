"""The error of a depth camera, measured in some frames, and the known camera that is nearest to it."""

from collections.abc import Iterable

import numpy as np

from avlmaps.maps.fusion.sensor import MODELS, SensorName
from avlmaps.recordings.types import Frame

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
