"""Compiled faults of an RGB-D camera. One thread; all chance comes in as tables of Gaussian numbers."""

import numpy as np
from numba import njit

_ZERO = np.float32(0.0)


@njit(cache=True)
def lose_depth(
    depth, strength, uniform, at, shift_px, edge_ratio, edge_loss, weakest, low, high
):  # pragma: no cover - compiled
    """Empty the pixels that a depth sensor cannot measure.

    Args:
        depth: (h, w) metres, changed; 0 where nothing is.
        strength: (h, w) uint8, share of the light sent out that the surface sends back at 1 m.
        uniform: numbers from 0 to 1.
        at: (h,) where each row's begin in ``uniform``.
        shift_px: shift of a pixel at 1 m between both views (focal length times baseline); its sign is the side.
        edge_ratio: share of the depth by which neighbours at an edge differ; 0 spares edges.
        edge_loss: probability that a pixel there is lost.
        weakest: least light that is enough.
        low: nearest depth.
        high: farthest depth.
    """
    height, width = depth.shape
    row = np.empty(width, np.float32)
    above = np.zeros(width, np.float32)
    for y in range(height):
        row[:] = depth[y]
        seen_to = -1e9  # how far in the other view the pixels until now reach: nearer ones are hidden there
        for k in range(width):
            x = k if shift_px >= 0 else width - 1 - k
            z = row[x]
            if z <= 0:
                continue
            if shift_px != 0:
                other = k + abs(shift_px) / z
                hidden = other < seen_to - 1.0
                seen_to = max(seen_to, other)
                if hidden:
                    depth[y, x] = _ZERO
                    continue
            chance = uniform[at[y] + x]
            if z < low or z > high or strength[y, x] * (0.7 + 0.6 * chance) < 255.0 * weakest * z * z:
                depth[y, x] = _ZERO
        if edge_ratio > 0:
            for x in range(width):
                z = row[x]
                left, up = row[max(x - 1, 0)], (above[x] if y else z)
                right = row[min(x + 1, width - 1)]
                step = max(abs(left - z), abs(up - z), abs(right - z))
                if step > edge_ratio * z and uniform[at[y] + x] < edge_loss:
                    depth[y, x] = _ZERO
        above[:] = row


@njit(cache=True)
def measure_depth(true, gauss, at, jitter, shift_px, noise, step, out):  # pragma: no cover - compiled
    """Measure depth as a noisy, rounded shift at a place a little beside the pixel.

    Args:
        true: (h, w) metres, 0 for none.
        gauss: Gaussian numbers.
        at: (h, 4) where each row's begin in ``gauss``: sideways, up and down, fine and coarse noise.
        jitter: standard deviation of the place, pixels.
        shift_px: shift at 1 m; 0 measures depth as it is.
        noise: standard deviation of the shift, pixels.
        step: the shift is rounded to its multiples; 0 for none.
        out: (h, w) filled in.
    """
    height, width = true.shape
    fine, coarse, shift = np.float32(0.6 * noise), np.float32(0.8 * noise), np.float32(abs(shift_px))
    step, jitter = np.float32(step), np.float32(jitter)
    per_step = np.float32(1.0) / step if step > 0 else _ZERO
    for y in range(height):
        for x in range(width):
            v, u = y, x
            if jitter > 0:
                u = min(max(int(np.rint(x + jitter * gauss[at[y, 0] + x])), 0), width - 1)
                v = min(max(int(np.rint(y + jitter * gauss[at[y, 1] + x])), 0), height - 1)
            z = true[v, u]
            if z <= 0 or shift == 0:
                out[y, x] = z
                continue
            # coarse noise is alike over three rows and three columns, as matching over windows makes it
            near = shift / z + fine * gauss[at[y, 2] + x] + coarse * gauss[at[y - y % 3, 3] + x // 3]
            if step > 0:
                near = step * np.rint(near * per_step)
            out[y, x] = shift / near if near > 0 else _ZERO


@njit(cache=True)
def punch(depth, middle, radius):  # pragma: no cover - compiled
    """Empty ellipses: ``middle`` (n, 2) columns and rows, ``radius`` (n, 2)."""
    height, width = depth.shape
    for k in range(len(middle)):
        for y in range(max(0, int(middle[k, 1] - radius[k, 1])), min(height, int(middle[k, 1] + radius[k, 1]) + 1)):
            for x in range(max(0, int(middle[k, 0] - radius[k, 0])), min(width, int(middle[k, 0] + radius[k, 0]) + 1)):
                a, b = (x - middle[k, 0]) / radius[k, 0], (y - middle[k, 1]) / radius[k, 1]
                if a * a + b * b < 1.0:
                    depth[y, x] = _ZERO


@njit(cache=True)
def expose(rgb, curve, darker, gauss, at, spread, out):  # pragma: no cover - compiled
    """Shift colours by a curve for each channel, darken corners and add noise.

    Args:
        rgb: (h, w, 3).
        curve: (256, 3) float32.
        darker: (h, w) factor.
        gauss: Gaussian numbers.
        at: (h, 2) where each row's begin in ``gauss``.
        spread: (256,) standard deviation of the noise by the value.
        out: (h, w, 3) filled in.
    """
    height, width, _ = rgb.shape
    for y in range(height):
        p, q = at[y, 0], at[y, 1]
        for x in range(width):
            common = np.float32(0.6) * gauss[q + x]
            for c in range(3):
                value = curve[rgb[y, x, c], c] * darker[y, x]
                level = min(max(int(value), 0), 255)
                value += spread[level] * (common + np.float32(0.8) * gauss[p + 3 * x + c]) + np.float32(0.5)
                out[y, x, c] = np.uint8(min(max(value, _ZERO), np.float32(255.0)))
