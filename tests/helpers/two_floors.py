"""Voxels of a home of two floors with stairs between them, drawn without a recording: floors, walls, steps, cameras."""

from dataclasses import dataclass
from functools import cache

import numpy as np

VOXEL_M = 0.05
UPPER_M = 2.8
SIZE_M = (7.0, 5.0)
WELL = ((2.0, 3.8), (6.0, 5.0))  # the hole in the upper floor, low and high x and y
STEPS, TREAD_M = 16, 0.25
FOOT_X, TOP_X = 2.0, 2.0 + STEPS * TREAD_M
EYE_M = 1.3


@dataclass(frozen=True)
class TwoFloors:
    """Middles of voxels and of cameras, metres, level frame."""

    points: np.ndarray
    cameras: np.ndarray


def box(low, high):
    """Return the middles of the voxels that a box meets."""
    axes = [np.arange(np.floor(a / VOXEL_M + 1e-6), max(np.ceil(b / VOXEL_M - 1e-6), np.floor(a / VOXEL_M + 1e-6) + 1))
            for a, b in zip(low, high, strict=True)]  # fmt: skip
    return (np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3) + 0.5) * VOXEL_M


@cache
def two_floors(stairs: bool = True, upper_m: float = UPPER_M, climbed: bool = True) -> TwoFloors:
    """Draw the home.

    Args:
        stairs: whether the well holds steps.
        upper_m: height of the upper floor; the steps lead there.
        climbed: whether a camera was carried upstairs.
    """
    (x0, y0), (x1, y1) = (0.0, 0.0), SIZE_M
    parts = [box((x0, y0, 0.01), (x1, y1, 0.02))]
    upper = box((x0, y0, upper_m + 0.01), (x1, y1, upper_m + 0.02))
    under = box((x0, y0, upper_m - 0.25), (x1, y1, upper_m - 0.24))
    for level in (upper, under):
        inside = np.all((level[:, :2] >= WELL[0]) & (level[:, :2] < WELL[1]), axis=1)
        parts.append(level[~inside])
    top = upper_m + 2.5
    parts += [box((x0, y0, top), (x1, y1, top + 0.01))]
    for low, high in (((x0 - 0.1, y0), (x0, y1)), ((x1, y0), (x1 + 0.1, y1)), ((x0, y0 - 0.1), (x1, y0)),
                      ((x0, y1), (x1, y1 + 0.1))):  # fmt: skip
        parts.append(box((*low, 0.0), (*high, top)))
    parts.append(box((4.0, 0.0, 0.0), (4.05, 1.5, 2.5)))  # a wall between two rooms downstairs
    parts.append(box((0.5, 0.5, 0.4), (2.0, 2.5, 0.5)))  # a bed downstairs
    parts.append(box((0.5, 0.5, upper_m + 0.4), (2.0, 2.0, upper_m + 0.5)))  # and one upstairs
    rise = upper_m / STEPS
    for step in range(STEPS if stairs else 0):
        x, z = FOOT_X + step * TREAD_M, (step + 1) * rise
        parts.append(box((x, WELL[0][1], z - rise), (x + 0.01, WELL[1][1], z)))
        parts.append(box((x, WELL[0][1], z - 0.02), (x + TREAD_M, WELL[1][1], z - 0.01)))
    walk = [(x, y, EYE_M) for x in np.arange(0.5, 3.6, 0.3) for y in (2.9, 3.3)]
    if climbed:
        walk += [(x, 4.4, EYE_M + upper_m * (x - FOOT_X) / (TOP_X - FOOT_X)) for x in np.arange(2.0, 6.0, 0.4)]
        walk += [(x, y, upper_m + EYE_M) for x in np.arange(3.0, 6.7, 0.3) for y in (2.9, 3.3)]
    index = np.floor(np.concatenate(parts) / VOXEL_M).astype(np.int64)
    keys = np.unique(((index[:, 0] + 500) * 1000 + index[:, 1] + 500) * 1000 + index[:, 2] + 500)
    index = np.stack([keys // 1_000_000, keys // 1000 % 1000, keys % 1000], axis=1) - 500
    return TwoFloors((index + 0.5) * VOXEL_M, np.array(walk))
