"""Compiled loops over the voxels of a storey; each voxel is touched once. The tests have a twin of each in NumPy."""

import math

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64
from numba import njit

from avlmaps.core.machine import Real, Whole

# Cells are computed from products of floats: a place on the side of two cells belongs to the higher one.
SIDE = 1e-6


@njit(cache=True, nogil=True)
def turned_ends(level: Float64[np.ndarray, "n 3"], cos: Real, sin: Real):
    """Return the least and the largest of x·cos + y·sin and y·cos − x·sin, as (low, low, high, high)."""
    low_x, low_y, high_x, high_y = np.inf, np.inf, -np.inf, -np.inf
    for i in range(len(level)):
        x = level[i, 0] * cos + level[i, 1] * sin
        y = level[i, 1] * cos - level[i, 0] * sin
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
    return low_x, low_y, high_x, high_y


@njit(cache=True, nogil=True)
def mark_columns(
    level: Float64[np.ndarray, "n 3"],
    low_m: Real,
    high_m: Real,
    cell_m: Real,
    low: Int64[np.ndarray, "2"],
    out: Bool[np.ndarray, "nx ny"],
):
    """Mark the columns of cells that hold a point between two heights; ``low`` is the index of column (0, 0)."""
    for i in range(len(level)):
        if low_m <= level[i, 2] < high_m:
            x = math.floor(level[i, 0] / cell_m + SIDE) - low[0]
            y = math.floor(level[i, 1] / cell_m + SIDE) - low[1]
            out[x, y] = True


@njit(cache=True, nogil=True)
def fill_cells(
    level: Float64[np.ndarray, "n 3"],
    cos: Real,
    sin: Real,
    floor_m: Real,
    wall_m: Float64[np.ndarray, "2"],
    least_m: Real,
    voxel_m: Real,
    cell_m: Real,
    low: Int64[np.ndarray, "2"],
    held: Bool[np.ndarray, "nx ny layers"],
    below: Bool[np.ndarray, "nx ny"],
):
    """Mark which layers of voxels between two heights over the floor are held in each cell, and what lies lower.

    Args:
        level: points of a storey, level frame, metres.
        cos: of the angle by which the cells are turned,
        sin: and the sine.
        floor_m: height of the floor.
        wall_m: the two heights over it.
        least_m: ``below`` are the cells with points less than this over the floor.
        voxel_m: thickness of a layer.
        cell_m: side of a cell.
        low: index of cell (0, 0).
        held: written.
        below: written.
    """
    most = held.shape[2] - 1
    for i in range(len(level)):
        height = level[i, 2] - floor_m
        tall = wall_m[0] <= height < wall_m[1]
        if not tall and height >= least_m:
            continue
        x = math.floor((level[i, 0] * cos + level[i, 1] * sin) / cell_m + SIDE) - low[0]
        y = math.floor((level[i, 1] * cos - level[i, 0] * sin) / cell_m + SIDE) - low[1]
        if tall:
            held[x, y, min(int((height - wall_m[0]) / voxel_m), most)] = True
        if height < least_m:
            below[x, y] = True


@njit(cache=True, nogil=True)
def held_share(held: Bool[np.ndarray, "nx ny layers"], first: Whole, last: Whole, out: Float64[np.ndarray, "nx ny"]):
    """Write which share of its layers each cell of some rows of the grid holds."""
    for x in range(first, last):
        for y in range(held.shape[1]):
            count = 0
            for layer in range(held.shape[2]):
                count += held[x, y, layer]
            out[x, y] = count / held.shape[2]


@njit(cache=True, nogil=True)
def flood(label: Int32[np.ndarray, "r c"], missing: Bool[np.ndarray, "r c"]):
    """Grow labels over missing cells, one ring of cells after the other; of the labels beside a cell the highest wins.

    Args:
        label: 0 for none; written.
        missing: unlabelled cells that take one; those that got none stay marked.
    """
    rows, columns = label.shape
    ring = np.empty((label.size, 2), np.int32)  # cells that may have labels beside them
    count = 0
    for i in range(rows):
        for j in range(columns):
            if missing[i, j] and _highest_beside(label, i, j) > 0:
                ring[count, 0], ring[count, 1] = i, j
                missing[i, j] = False
                count += 1
    first = 0
    while first < count:
        last = count
        taken = np.empty(last - first, np.int32)
        for k in range(first, last):
            taken[k - first] = _highest_beside(label, ring[k, 0], ring[k, 1])
        for k in range(first, last):
            label[ring[k, 0], ring[k, 1]] = taken[k - first]
        for k in range(first, last):
            for di, dj in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                i, j = ring[k, 0] + di, ring[k, 1] + dj
                if 0 <= i < rows and 0 <= j < columns and missing[i, j]:
                    ring[count, 0], ring[count, 1] = i, j
                    missing[i, j] = False
                    count += 1
        first = last


@njit(cache=True, nogil=True)
def _highest_beside(label: Int32[np.ndarray, "r c"], i: Whole, j: Whole):
    highest = 0
    if i > 0:
        highest = max(highest, label[i - 1, j])
    if j > 0:
        highest = max(highest, label[i, j - 1])
    if i + 1 < label.shape[0]:
        highest = max(highest, label[i + 1, j])
    if j + 1 < label.shape[1]:
        highest = max(highest, label[i, j + 1])
    return highest
