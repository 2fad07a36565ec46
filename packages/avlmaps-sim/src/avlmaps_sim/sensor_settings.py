"""The faults of a simulated RGB-D camera; apart from the kernels, so that help texts need no compiler."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from avlmaps.core.errors import AvlmapsError


class SensorError(AvlmapsError):
    """The settings give a simulated sensor faults that none can have."""


@dataclass(frozen=True, slots=True)
class DepthFaults:
    """How measured depth differs from true depth.

    Depth is measured as the shift between two views, so noise, steps and shadows follow from the baseline between
    them: an error of one pixel in the shift is z² / (focal length · baseline) in depth.
    """

    baseline_m: float = 0.0
    """Distance between projector and camera (or between both cameras); 0 measures depth without any of what follows
    from it. Behind near things a stripe that only one of them sees stays empty: right of them if it is positive."""
    noise_px: float = 0.0  # standard deviation of the measured shift, pixels of a picture 640 wide
    step_px: float = 0.0  # the shift is rounded to multiples of this, pixels of a picture 640 wide; 0 rounds nothing
    jitter_px: float = 0.0
    """Standard deviation of where in the picture a depth was really measured, pixels: it frays edges."""
    edge_ratio: float = 0.0
    """Pixels whose neighbour is nearer or farther by more than this share of their depth may stay empty; 0: none."""
    edge_loss: float = 0.5  # probability that such a pixel stays empty
    weakest: float = 0.0
    """A pixel stays empty where less than this comes back, of what a matt white wall at 1 m sends back. What comes
    back falls with distance, slant, darkness, gloss and clearness."""
    min_m: float = 0.0  # nothing nearer is measured
    max_m: float = np.inf  # nothing farther is measured
    blobs: float = 0.0  # mean number of patches in a picture that stay empty for no reason that one sees
    blob_px: float = 4.0  # mean radius of such a patch, pixels

    def __post_init__(self) -> None:
        if not 0.0 <= self.min_m < self.max_m:
            raise SensorError(f"Depths from {self.min_m} to {self.max_m} m are no range; let min_m be below max_m.")
        if min(self.noise_px, self.step_px, self.jitter_px, self.edge_ratio, self.weakest, self.blobs) < 0.0:
            raise SensorError("A sensor's depth cannot have less than no noise, steps, jitter or holes.")
        if not 0.0 <= self.edge_loss <= 1.0:
            raise SensorError(f"edge_loss {self.edge_loss} is not a probability; take a number from 0 to 1.")


@dataclass(frozen=True, slots=True)
class ColourFaults:
    """How the colour picture differs from what is there."""

    exposure_stops: float = 0.0  # standard deviation of the exposure, in stops (one stop doubles the light)
    white_balance: float = 0.0  # standard deviation of the gain of red and of blue against green
    drift_frames: float = 0.0
    """Frames after which exposure and white balance have changed by about as much as they ever do, in a sequence
    of `shifts`; 0 draws them again for each frame."""
    noise: float = 0.0  # standard deviation of the noise in mid grey, 8-bit values; it grows with the root of the light
    blur_px: float = 0.0  # mean length of motion blur, pixels; its direction is any
    defocus_px: float = 0.0  # standard deviation of the lens's blur, pixels
    vignetting: float = 0.0  # share of the light that is missing in the corners
    jpeg_quality: int = 100
    """Quality of the JPEG that the picture went through, 1 to 100; at 100 it did not go through one."""

    def __post_init__(self) -> None:
        if min(self.exposure_stops, self.white_balance, self.noise, self.blur_px, self.defocus_px) < 0.0:
            raise SensorError("A sensor's colours cannot have less than no shift, noise or blur.")
        if not 0.0 <= self.vignetting < 1.0 or not 1 <= self.jpeg_quality <= 100:
            raise SensorError(
                f"vignetting {self.vignetting} must be from 0 to 1, jpeg_quality {self.jpeg_quality} from 1 to 100."
            )


@dataclass(frozen=True, slots=True)
class OdometryFaults:
    """How a pose that is summed from wheels or from picture to picture strays; all in the plane of the floor."""

    along: float = 0.01
    """Standard deviation of the error of a distance, metres after one metre; it grows with the distance's root."""
    heading_per_m: float = 0.01
    """Standard deviation of the error of the heading, radians after one metre, growing likewise."""
    heading_per_rad: float = 0.01
    """Standard deviation of the error of the heading, radians after one radian turned, growing likewise."""
    scale: float = 0.005  # standard deviation of an error of scale that is constant during a drive


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """The faults of a simulated RGB-D camera."""

    depth: DepthFaults = DepthFaults()
    colour: ColourFaults = ColourFaults()


SensorName = Literal["clean", "kinect", "realsense"]

CLEAN = SensorSettings()

KINECT = SensorSettings(
    DepthFaults(baseline_m=0.075, noise_px=0.06, step_px=0.125, jitter_px=0.6, edge_ratio=0.06, weakest=0.004,
                min_m=0.45, max_m=8.0, blobs=2.0, blob_px=4.0),
    ColourFaults(exposure_stops=0.35, white_balance=0.05, drift_frames=40.0, noise=3.0, blur_px=1.2, defocus_px=0.5,
                 vignetting=0.15, jpeg_quality=100),
)  # fmt: skip

REALSENSE = SensorSettings(
    DepthFaults(baseline_m=-0.05, noise_px=0.1, step_px=0.03, jitter_px=0.9, edge_ratio=0.08, weakest=0.002,
                min_m=0.28, max_m=10.0, blobs=5.0, blob_px=5.0),
    ColourFaults(exposure_stops=0.4, white_balance=0.06, drift_frames=30.0, noise=2.0, blur_px=0.8, defocus_px=0.4,
                 vignetting=0.1, jpeg_quality=100),
)  # fmt: skip

PRESETS: dict[SensorName, SensorSettings] = {"clean": CLEAN, "kinect": KINECT, "realsense": REALSENSE}
