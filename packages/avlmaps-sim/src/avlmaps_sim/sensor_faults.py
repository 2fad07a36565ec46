"""Faults of an RGB-D camera, laid over whole pictures. All chance comes in as tables of numbers."""

import numpy as np
from jaxtyping import Bool, Float32, Int, UInt8


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
