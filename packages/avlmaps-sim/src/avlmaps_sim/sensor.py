"""A real RGB-D camera's faults, laid over what the renderer saw; and the drift of poses that odometry makes."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps_sim.render import View
from avlmaps_sim.sensor_settings import (
    CLEAN,
    KINECT,
    PRESETS,
    REALSENSE,
    ColourFaults,
    DepthFaults,
    OdometryFaults,
    SensorError,
    SensorName,
    SensorSettings,
)  # fmt: skip


def lost_depth(
    depth: Float32[np.ndarray, "h w"],
    strength: UInt8[np.ndarray, "h w"],
    chance: Float32[np.ndarray, "h w"],
    shift_px: float,
    edge: tuple[float, float],
    weakest: float,
    near_far_m: tuple[float, float],
) -> Bool[np.ndarray, "h w"]:
    """Return the pixels that a depth sensor cannot measure.

    Args:
        depth: metres; 0 where nothing is.
        strength: share of the light sent out that the surface sends back at 1 m.
        chance: numbers from 0 to 1.
        shift_px: shift of a pixel at 1 m between both views (focal length times baseline); its sign is the side.
        edge: share of the depth by which neighbours at an edge differ (0 spares edges), and the probability that a
            pixel there is lost.
        weakest: least light that is enough.
        near_far_m: nearest and farthest depth.
    """
    low, high = near_far_m
    lost = (depth < low) | (depth > high) | (strength * (0.7 + 0.6 * chance) < 255.0 * weakest * depth * depth)
    if shift_px != 0:  # what is nearer hides the pixels behind it in the other view
        side = slice(None, None, 1 if shift_px > 0 else -1)
        z = depth[:, side].astype(np.float64)
        with np.errstate(divide="ignore"):
            other = np.where(z > 0, np.arange(z.shape[1]) + abs(shift_px) / z, -np.inf)
        before = np.maximum.accumulate(other, axis=1)[:, :-1]
        lost[:, side][:, 1:] |= other[:, 1:] < before - 1.0
    ratio, loss = edge
    if ratio > 0:
        padded = np.pad(depth, ((1, 0), (1, 1)), "edge")
        around = (padded[1:, :-2], padded[1:, 2:], padded[:-1, 1:-1])
        step = np.max([np.abs(one - depth) for one in around], axis=0)
        lost |= (step > ratio * depth) & (chance < loss)
    return lost


def measured_depth(
    true: Float32[np.ndarray, "h w"],
    gauss: Float32[np.ndarray, "4 h w"],
    jitter_px: float,
    shift_px: float,
    noise_px: float,
    step_px: float,
) -> Float32[np.ndarray, "h w"]:
    """Measure depth as a noisy, rounded shift at a place a little beside the pixel.

    Args:
        true: metres, 0 for none.
        gauss: Gaussian numbers: sideways, up and down, fine and coarse noise.
        jitter_px: standard deviation of the place.
        shift_px: shift at 1 m; 0 measures depth as it is.
        noise_px: standard deviation of the shift.
        step_px: the shift is rounded to its multiples; 0 for none.
    """
    height, width = true.shape
    v, u = np.mgrid[:height, :width]
    z = true
    if jitter_px > 0:
        beside = np.rint(v + jitter_px * gauss[1]).astype(int).clip(0, height - 1)
        z = true[beside, np.rint(u + jitter_px * gauss[0]).astype(int).clip(0, width - 1)]
    if shift_px == 0:
        return z.copy()
    # Coarse noise is alike over three rows and three columns, as matching over windows makes it.
    noise = 0.6 * noise_px * gauss[2] + 0.8 * noise_px * gauss[3][v - v % 3, u // 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = abs(shift_px) / z + noise
        if step_px > 0:
            shift = step_px * np.rint(shift / step_px)
        return np.where((z > 0) & (shift > 0), abs(shift_px) / shift, 0.0).astype(np.float32)


def ellipses(
    shape: tuple[int, int], middle: Float32[np.ndarray, "n 2"], radius: Float32[np.ndarray, "n 2"]
) -> Bool[np.ndarray, "h w"]:
    """Return the pixels inside any of some ellipses, given by columns and rows."""
    inside = np.zeros(shape, bool)
    y, x = np.ogrid[: shape[0], : shape[1]]
    for (column, row), (wide, high) in zip(middle, radius, strict=True):
        inside |= ((x - column) / wide) ** 2 + ((y - row) / high) ** 2 < 1.0
    return inside


def exposed(
    rgb: UInt8[np.ndarray, "h w 3"],
    curve: Float32[np.ndarray, "256 3"],
    darker: Float32[np.ndarray, "h w"],
    gauss: tuple[Float32[np.ndarray, "h w 3"], Float32[np.ndarray, "h w"]],
    spread: Float32[np.ndarray, "256"],
) -> UInt8[np.ndarray, "h w 3"]:
    """Shift colours by a curve for each channel, darken corners and add noise.

    Args:
        rgb: the picture.
        curve: the value that each value of each channel becomes.
        darker: factor by pixel.
        gauss: Gaussian numbers of each channel by itself, and of all channels together.
        spread: standard deviation of the noise by the value.
    """
    value = curve[rgb, np.arange(3)] * darker[..., None]
    noise = np.float32(0.6) * gauss[1][..., None] + np.float32(0.8) * gauss[0]
    return (value + spread[value.clip(0, 255).astype(int)] * noise + np.float32(0.5)).clip(0, 255).astype(np.uint8)


def rows_of(table: Float32[np.ndarray, " n"], begin: Int[np.ndarray, " h"], count: int) -> Float32[np.ndarray, "h k"]:
    """Return so many numbers of a table for each row of a picture, from where each row begins in it."""
    return table[begin[:, None] + np.arange(count)]


__all__ = [
    "CLEAN", "KINECT", "PRESETS", "REALSENSE", "ColourFaults", "DepthFaults", "OdometryFaults", "Sensor",
    "SensorError", "SensorName", "SensorSettings", "Shift", "drifted",
]  # fmt: skip

_TABLE = 1 << 18  # numbers drawn once; every row of every picture begins somewhere else in them
_WIDEST = 4096  # columns of the widest picture
_USUAL_WIDTH = 640  # settings in pixels of the shift speak of pictures this wide


@dataclass(frozen=True, slots=True)
class Shift:
    """How one frame's colours are off: exposure in stops, gains of red and blue against green."""

    stops: float = 0.0
    red: float = 1.0
    blue: float = 1.0


@lru_cache(maxsize=1)
def _numbers() -> tuple[Float32[np.ndarray, " n"], Float32[np.ndarray, " n"]]:
    rng = np.random.default_rng(20_231_006)
    gauss = rng.standard_normal(_TABLE, np.float32)
    uniform = rng.random(_TABLE, np.float32)
    return np.resize(gauss, _TABLE + 3 * _WIDEST), np.resize(uniform, _TABLE + _WIDEST)


@lru_cache(maxsize=4)
def _darker(width: int, height: int, missing: float) -> Float32[np.ndarray, "h w"]:
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = (np.arange(height) + 0.5) / height * 2 - 1
    return (1 - missing * (x[None, :] ** 2 + y[:, None] ** 2) / 2).astype(np.float32)


class Sensor:
    """An RGB-D camera with faults."""

    def __init__(self, settings: SensorSettings = CLEAN) -> None:
        """Store the camera's faults."""
        self.settings = settings

    def shifts(self, n: int, rng: np.random.Generator) -> list[Shift]:
        """Return how the colours of n frames in a row are off; they wander as slowly as the settings say."""
        faults = self.settings.colour
        keep = np.exp(-1.0 / faults.drift_frames) if faults.drift_frames > 0 else 0.0
        draws = rng.standard_normal((n, 3))
        wander = np.zeros((n, 3))
        for k in range(n):
            wander[k] = draws[k] if k == 0 else keep * wander[k - 1] + np.sqrt(1 - keep * keep) * draws[k]
        gains = np.exp(faults.white_balance * wander[:, 1:])
        return [
            Shift(float(faults.exposure_stops * stops), float(red), float(blue))
            for stops, (red, blue) in zip(wander[:, 0], gains, strict=True)
        ]

    def spoil(
        self, view: View, camera: Pinhole, rng: np.random.Generator, shift: Shift | None = None
    ) -> tuple[UInt8[np.ndarray, "h w 3"], Float32[np.ndarray, "h w"]]:
        """Return colour and depth as this camera would have measured them.

        ``shift`` is how this frame's colours are off, one of `shifts`; drawn where none is given.

        Returns:
            sRGB, and z-depth in metres, 0 where nothing was measured.
        """
        rows = rng.integers(0, _TABLE, (camera.height, 7))
        return (
            self._colour(view.rgb, rng, rows[:, 5:], shift or self.shifts(1, rng)[0]),
            self._depth(view, camera, rng, rows[:, :5]),
        )

    def _depth(
        self, view: View, camera: Pinhole, rng: np.random.Generator, rows: Int[np.ndarray, "h 5"]
    ) -> Float32[np.ndarray, "h w"]:
        faults = self.settings.depth
        gauss, uniform = _numbers()
        scale = camera.width / _USUAL_WIDTH
        shift_px = camera.fx * faults.baseline_m
        chance = np.stack([rows_of(gauss, rows[:, number], camera.width) for number in range(4)])
        depth = measured_depth(
            view.depth_m, chance, faults.jitter_px * scale, shift_px, faults.noise_px * scale, faults.step_px * scale
        )
        edge, span_m = (faults.edge_ratio, faults.edge_loss), (faults.min_m, faults.max_m)
        kept = rows_of(uniform, rows[:, 4], camera.width)
        depth[lost_depth(depth, view.strength, kept, shift_px, edge, faults.weakest, span_m)] = 0.0
        count = int(rng.poisson(faults.blobs))
        if count:
            middle = rng.random((count, 2)) * (camera.width, camera.height)
            radius = faults.blob_px * scale * rng.gamma(3.0, 1 / 3, (count, 2)) + 0.5
            depth[ellipses(depth.shape, middle, radius)] = 0.0
        return depth

    def _colour(
        self, rgb: UInt8[np.ndarray, "h w 3"], rng: np.random.Generator, rows: Int[np.ndarray, "h 2"], shift: Shift
    ) -> UInt8[np.ndarray, "h w 3"]:
        faults = self.settings.colour
        height, width = rgb.shape[:2]
        scale = width / _USUAL_WIDTH
        picture = _blurred(rgb, faults.blur_px * scale, faults.defocus_px * scale, rng)
        if shift != Shift() or faults.noise > 0 or faults.vignetting > 0:
            value = np.arange(256, dtype=np.float64)
            gain = 2.0**shift.stops * np.array([shift.red, 1.0, shift.blue])
            # values are about the root of the light; a shoulder stops what was not white from becoming so at once
            curve = value[:, None] * np.sqrt(gain)
            curve = np.where(curve > 200, 200 + 55 * np.tanh((curve - 200) / 70), curve)
            spread = faults.noise * (0.4 + 0.6 * np.sqrt(value / 128))
            own = rows_of(_numbers()[0], rows[:, 0], 3 * width).reshape(height, width, 3)
            common = rows_of(_numbers()[0], rows[:, 1], width)
            darker = _darker(width, height, faults.vignetting)
            picture = exposed(picture, curve.astype(np.float32), darker, (own, common), spread.astype(np.float32))
        if faults.jpeg_quality < 100:
            _, code = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, faults.jpeg_quality])
            picture = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
        return picture


def _blurred(
    rgb: UInt8[np.ndarray, "h w 3"], motion_px: float, defocus_px: float, rng: np.random.Generator
) -> UInt8[np.ndarray, "h w 3"]:
    length, angle = motion_px * rng.exponential(), rng.uniform(0, np.pi)
    if length < 0.3 and defocus_px < 0.2:
        return rgb
    reach = int(np.ceil(length / 2 + 2 * defocus_px))
    grid = np.arange(-reach, reach + 1)
    along = np.linspace(-length / 2, length / 2, 9)
    sigma = max(defocus_px, 0.3)
    x, y = (np.exp(-((grid[:, None] - along * turn) ** 2) / (2 * sigma**2)) for turn in (np.cos(angle), np.sin(angle)))
    kernel = np.einsum("yk,xk->yx", y, x)
    return cv2.filter2D(rgb, -1, (kernel / kernel.sum()).astype(np.float32), borderType=cv2.BORDER_REPLICATE)


def drifted(
    world_from_camera: Float[np.ndarray, "n 4 4"], rng: np.random.Generator, faults: OdometryFaults | None = None
) -> Float[np.ndarray, "n 4 4"]:
    """Return poses as odometry would have summed them: the first is true, each step after it a little wrong."""
    faults = faults or OdometryFaults()
    poses = np.asarray(world_from_camera, np.float64)
    if len(poses) < 2:
        return poses.copy()
    step = np.diff(poses[:, :3, 3], axis=0)
    way = np.linalg.norm(step[:, :2], axis=1)
    forward = np.arctan2(poses[:, 1, 2], poses[:, 0, 2])
    turned = np.abs((np.diff(forward) + np.pi) % (2 * np.pi) - np.pi)
    spread = np.sqrt(faults.heading_per_m**2 * way + faults.heading_per_rad**2 * turned)
    error = np.concatenate([[0.0], np.cumsum(spread * rng.standard_normal(len(step)))])
    c, s = np.cos(error[:-1]), np.sin(error[:-1])
    measured = step * (1.0, 1.0, 1.0)
    measured[:, :2] *= 1 + faults.scale * rng.standard_normal()
    measured[:, :2] += (faults.along * np.sqrt(way))[:, None] * rng.standard_normal((len(step), 2))
    x, y = c * measured[:, 0] - s * measured[:, 1], s * measured[:, 0] + c * measured[:, 1]
    out = poses.copy()
    out[1:, :3, 3] = poses[0, :3, 3] + np.cumsum(np.column_stack([x, y, measured[:, 2]]), axis=0)
    turn = np.tile(np.eye(3), (len(poses), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(error)
    turn[:, 1, 0], turn[:, 0, 1] = np.sin(error), -np.sin(error)
    out[:, :3, :3] = turn @ poses[:, :3, :3]
    return out
