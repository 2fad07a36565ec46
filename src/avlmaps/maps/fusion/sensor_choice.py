"""Which depth camera a recording was made with: measured in its frames where nobody says."""

from collections.abc import Iterable

import numpy as np

from avlmaps.maps.fusion.sensor import MODELS, SensorModel, SensorName
from avlmaps.maps.gravity.stage import spread_frames
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.manifest import SensorInfo
from avlmaps.recordings.types import Frame, Recording

FRAMES = 12  # looked at, spread evenly
_FEWEST = 500  # measured places; with fewer the error is not known
_NEAREST_M = 1.0
_STEPS_WIDE = 80  # second differences are taken over a row divided by this: noise that is alike nearby shows as well
_PERFECT_PER_M = 4e-4  # below this a depth is wrong by less than a millimetre at 1.5 m: rounding


def find_sensor(recording: Recording, settings: BuildSettings) -> SensorInfo:
    """Return the depth camera that the settings name, or the one whose error is nearest to what the frames show.

    The choice is one of a few models and hence the same on every machine, though the measured number may differ in its
    last digits.
    """
    chosen = settings.fusion.sensor
    if isinstance(chosen, SensorModel):
        return SensorInfo(name="custom", known_from="settings", noise_per_m=None, model=chosen)
    if chosen != "auto":
        return SensorInfo(name=chosen, known_from="settings", noise_per_m=None, model=MODELS[chosen])
    noise = measure_noise(spread_frames(recording, FRAMES))
    noise = None if noise is None else float(f"{noise:.2g}")  # as far as it is known, and alike on every machine
    name = nearest_model(noise)
    return SensorInfo(name=name, known_from="frames", noise_per_m=noise, model=MODELS[name])


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
