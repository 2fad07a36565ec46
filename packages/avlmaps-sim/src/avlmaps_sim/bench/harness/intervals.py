"""The 95 % intervals that stand beside every figure."""

import math

import numpy as np
from jaxtyping import Float

_Z = 1.959964  # of the normal distribution, two-sided 95 %


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share after Wilson (1927), within [0, 1]; all of it where nothing was counted."""
    if count == 0:
        return 0.0, 1.0
    share, square = hits / count, _Z * _Z
    middle = (share + square / (2 * count)) / (1 + square / count)
    half = _Z / (1 + square / count) * math.sqrt(share * (1 - share) / count + square / (4 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def of_mean(shares: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """Return the 95 % interval of the mean of shares, by the normal; all of [0, 1] for fewer than two.

    For what is alike within a group, such as the pixels of a frame or the voxels of a thing: each group counts once.
    """
    if len(shares) < 2:
        return 0.0, 1.0
    half = 1.96 * float(shares.std(ddof=1)) / math.sqrt(len(shares))
    return max(0.0, float(shares.mean()) - half), min(1.0, float(shares.mean()) + half)


def median_interval(values: Float[np.ndarray, " n"]) -> tuple[float, float, float]:
    """Return the median and its 95 % interval, by the ranks between which it lies."""
    ordered = np.sort(values)
    half = 0.98 * np.sqrt(len(ordered))
    low = int(max(0, np.floor(len(ordered) / 2 - half)))
    high = int(min(len(ordered) - 1, np.ceil(len(ordered) / 2 + half)))
    return float(np.median(ordered)), float(ordered[low]), float(ordered[high])


def in_percent(interval: tuple[float, float]) -> str:
    """Return an interval of a share as tables show it: "48.7 to 67.0"."""
    low, high = interval
    return f"{100 * low:.1f} to {100 * high:.1f}"


def poisson(count: int) -> tuple[float, float]:
    """Return the exact 95 % interval of the mean of a Poisson count."""
    from scipy.special import gammaincinv

    low = float(gammaincinv(count, 0.025)) if count else 0.0
    return low, float(gammaincinv(count + 1, 0.975))
