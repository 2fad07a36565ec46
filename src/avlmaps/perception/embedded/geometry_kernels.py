"""The compiled loop behind ``geometry``: one pass over a depth picture."""

import numpy as np
from numba import njit

_LARGEST_STEP = 0.06  # of the depth: a greater step between neighbours is an edge, not a surface


@njit(cache=True, inline="always")
def _neighbour(depth, row, column, dr, dc, far):
    """Return how many pixels away along (dr, dc) the same surface still is: ``far``, 1 or 0."""
    h, w = depth.shape
    z = depth[row, column]
    for reach in (far, 1):
        r, c = row + dr * reach, column + dc * reach
        if 0 <= r < h and 0 <= c < w:
            other = depth[r, c]
            if other > 0.0 and abs(other - z) < _LARGEST_STEP * z:
                return reach
    return 0


@njit(cache=True, nogil=True)
def geometry_into(depth, fx, fy, cx, cy, up, right, forward, camera_height, far, out):
    """Fill ``out`` (8, h, w); see ``geometry.channels`` for what each channel is."""
    h, w = depth.shape
    focal = 0.5 * (fx + fy)
    for row in range(h):
        y = (row + 0.5 - cy) / fy
        for column in range(w):
            x = (column + 0.5 - cx) / fx
            length = np.sqrt(x * x + y * y + 1.0)
            out[7, row, column] = (up[0] * x + up[1] * y + up[2]) / length
            z = depth[row, column]
            if not z > 0.0:
                for channel in range(7):
                    out[channel, row, column] = 0.0
                continue
            out[0, row, column] = np.log(z / focal) + 4.6
            out[1, row, column] = 0.25 * z
            height = camera_height + z * (up[0] * x + up[1] * y + up[2])
            out[2, row, column] = min(max(height, -1.0), 4.0)
            out[6, row, column] = 1.0
            c0 = column - _neighbour(depth, row, column, 0, -1, far)
            c1 = column + _neighbour(depth, row, column, 0, 1, far)
            r0 = row - _neighbour(depth, row, column, -1, 0, far)
            r1 = row + _neighbour(depth, row, column, 1, 0, far)
            if c0 == c1 or r0 == r1:
                out[3, row, column] = out[4, row, column] = out[5, row, column] = 0.0
                continue
            za, zb = depth[row, c0], depth[row, c1]
            ax = (c1 + 0.5 - cx) / fx * zb - (c0 + 0.5 - cx) / fx * za
            ay, az = y * (zb - za), zb - za
            za, zb = depth[r0, column], depth[r1, column]
            bx, bz = x * (zb - za), zb - za
            by = (r1 + 0.5 - cy) / fy * zb - (r0 + 0.5 - cy) / fy * za
            nx, ny, nz = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
            norm = np.sqrt(nx * nx + ny * ny + nz * nz)
            if norm > 0.0:
                facing = -1.0 if nx * x + ny * y + nz > 0.0 else 1.0
                nx, ny, nz = facing * nx / norm, facing * ny / norm, facing * nz / norm
            out[3, row, column] = nx * up[0] + ny * up[1] + nz * up[2]
            out[4, row, column] = nx * right[0] + ny * right[1] + nz * right[2]
            out[5, row, column] = nx * forward[0] + ny * forward[1] + nz * forward[2]
