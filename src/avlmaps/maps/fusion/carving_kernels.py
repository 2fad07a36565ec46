"""The compiled loops behind what is no surface: flying pixels of a depth picture, voxels seen through, smears."""

import numpy as np
from jaxtyping import Bool, Float32, Int32, Int64, Shaped, UInt16
from numba import njit

from avlmaps.core.kernel_types import Real, Whole
from avlmaps.maps.fusion.voxel_kernels import OPTIONS, find_row

CLEAR_UNITS_PER_M = 1000.0
_FARTHEST_UNITS = 65535.0


@njit(**OPTIONS)
def _between(z: Real, a: Real, b: Real, c: Real, d: Real, once: Real, twice: Real):
    """Return whether z lies between a nearer and a farther depth on either side (a, b: 1 and 2 pixels off; c, d)."""
    near_1 = (a > 0.0) & (a < z - once) | (b > 0.0) & (b < z - twice)
    far_1 = (a > z + once) | (b > z + twice)
    near_2 = (c > 0.0) & (c < z - once) | (d > 0.0) & (d < z - twice)
    far_2 = (c > z + once) | (d > z + twice)
    return (near_1 & far_2) | (near_2 & far_1)


@njit(**OPTIONS)
def drop_flying(
    depth: Float32[np.ndarray, "h w"],
    steps: tuple[float, float],
    noise: tuple[float, float],
    edge_sigmas: Real,
    out: Float32[np.ndarray, "h w"],
):
    """Copy a depth picture without the pixels that lie between a nearer and a farther surface; those become 0.

    Args:
        depth: (h, w) float32, metres.
        steps: by how much the depth changes from one column, and from one row, to the next on the most grazing surface
            at 1 m, metres.
        noise: (σ at 0 m, its growth with z²).
        edge_sigmas: a neighbour is on another surface when it is this many σ off.
        out: (h, w) filled in.

    Returns:
        Count of depths that were left out.
    """
    height, width = depth.shape
    dropped = 0
    for v in range(height):
        up_1, up_2 = max(v - 1, 0), max(v - 2, 0)
        down_1, down_2 = min(v + 1, height - 1), min(v + 2, height - 1)
        for u in range(width):
            z = depth[v, u]
            out[v, u] = z
            if not z > 0.0:
                continue
            sigma = edge_sigmas * (noise[0] + noise[1] * z * z)
            wide, high = sigma + steps[0] * z, sigma + steps[1] * z
            left_1, left_2 = max(u - 1, 0), max(u - 2, 0)
            right_1, right_2 = min(u + 1, width - 1), min(u + 2, width - 1)
            flies = _between(
                z, depth[v, left_1], depth[v, left_2], depth[v, right_1], depth[v, right_2],
                wide, 2 * wide - sigma,
            ) or _between(
                z, depth[up_1, u], depth[up_2, u], depth[down_1, u], depth[down_2, u],
                high, 2 * high - sigma,
            )  # fmt: skip
            if flies:
                out[v, u] = 0.0
                dropped += 1
    return dropped


@njit(**OPTIONS)
def clear_blocks(
    depth: Float32[np.ndarray, "h w"],
    size: Whole,
    noise: tuple[float, float],
    clear_sigmas: Real,
    out: UInt16[np.ndarray, "rows columns"],
):
    """Write how far every ray of each block of pixels is free: 0 where a pixel of it has no depth.

    Args:
        depth: (h, w) float32, metres.
        size: edge of a block, pixels.
        noise: (σ at 0 m, its growth with z²).
        clear_sigmas: how many σ before its depth a ray is free.
        out: (ceil(h / size), ceil(w / size)) uint16, thousandths of a metre, rounded down.
    """
    height, width = depth.shape
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            least = _FARTHEST_UNITS
            for v in range(i * size, min((i + 1) * size, height)):
                for u in range(j * size, min((j + 1) * size, width)):
                    z = np.float64(depth[v, u])
                    free = (z - clear_sigmas * (noise[0] + noise[1] * z * z)) * CLEAR_UNITS_PER_M if z > 0.0 else 0.0
                    least = min(least, free)
            out[i, j] = np.uint16(max(least, 0.0))


@njit(**OPTIONS)
def mark_smeared(
    index: Int32[np.ndarray, "n 3"],
    sharp: Int64[np.ndarray, " n"],
    reach: Shaped[np.ndarray, " n"],
    ratio: Real,
    table: Int32[np.ndarray, " slots"],
    smeared: Bool[np.ndarray, " n"],
):
    """Mark each voxel that has a much better seen one within its reach.

    Args:
        index: (n, 3) int32.
        sharp: (n,) int64.
        reach: (n,) how far to look, voxels.
        ratio: how many times better.
        table: hash table of the rows.
        smeared: (n,) bool, filled in.
    """
    for n in range(index.shape[0]):
        limit = reach[n] * reach[n]
        most = np.int64(reach[n])
        enough = ratio * sharp[n]
        found = False
        for i in range(-most, most + 1):
            for j in range(-most, most + 1):
                for k in range(-most, most + 1):
                    if found or i * i + j * j + k * k > limit:
                        continue
                    row = find_row(index[n, 0] + i, index[n, 1] + j, index[n, 2] + k, table, index)
                    found = row >= 0 and row != n and sharp[row] >= enough
        smeared[n] = found


@njit(**OPTIONS)
def group(index: Int32[np.ndarray, "n 3"], table: Int32[np.ndarray, " slots"], parent: Int64[np.ndarray, " n"]):
    """Give voxels that touch, at a corner at least, the same group: the lowest row among them.

    Args:
        index: (n, 3) int32.
        table: hash table of the rows.
        parent: (n,) int64, filled in with each voxel's group.
    """
    for n in range(index.shape[0]):
        parent[n] = n
    for n in range(index.shape[0]):
        for step in range(14, 27):  # half of the neighbours; the other half meets this voxel as theirs
            i, j, k = step // 9 - 1, step // 3 % 3 - 1, step % 3 - 1
            row = find_row(index[n, 0] + i, index[n, 1] + j, index[n, 2] + k, table, index)
            if row >= 0:
                a, b = _root(parent, n), _root(parent, int(row))
                parent[max(a, b)] = min(a, b)
    for n in range(index.shape[0]):
        parent[n] = _root(parent, n)


@njit(**OPTIONS)
def _root(parent: Int64[np.ndarray, " n"], n: Whole):
    while parent[n] != n:
        parent[n] = parent[parent[n]]
        n = parent[n]
    return n
