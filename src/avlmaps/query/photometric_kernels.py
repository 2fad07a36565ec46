"""The compiled inner loops of finding a picture by its colours: drawing voxels, and how alike two pictures are.

A picture is compared in three channels: brightness, red against green, and both against blue, the latter two weighted.
Colours of a panorama are uint8 with a fourth channel that says whether the map shows anything there. The measure is
the correlation over all channels together, each about its own mean.
"""

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64, UInt8
from numba import njit

from avlmaps.core.kernel_types import Real, Whole

UNSEEN = np.float32(1e9)
_LEAST_M = 0.15  # a voxel nearer to the eye is not drawn: the eye stands in it


@njit(cache=True, nogil=True, fastmath=True)
def draw_panoramas(
    points: Float32[np.ndarray, "n 3"],
    rgb: UInt8[np.ndarray, "n 3"],
    side_m: Real,
    eyes: Float32[np.ndarray, "e 3"],
    far_m: Real,
    lowest_rad: Real,
    bin_rad: Real,
    out: UInt8[np.ndarray, "e rows columns 4"],
    depth: Float32[np.ndarray, "rows columns"],
):
    """Draw voxels as seen from each eye: azimuth from +x to the left along a row, elevation up along the rows.

    Args:
        points: (n, 3) float32 middles of the voxels, level frame.
        rgb: (n, 3) uint8.
        side_m: their side.
        eyes: (e, 3) float32 where to look from.
        far_m: what is farther is left out.
        lowest_rad: elevation of the first row's lower edge.
        bin_rad: height and width of a bin.
        out: (e, rows, columns, 4) uint8, zeros; the columns go once round.
        depth: (rows, columns) float32, to work in.
    """
    rows, columns = out.shape[1], out.shape[2]
    for e in range(len(eyes)):
        depth[:] = UNSEEN
        for i in range(len(points)):
            x, y, z = points[i, 0] - eyes[e, 0], points[i, 1] - eyes[e, 1], points[i, 2] - eyes[e, 2]
            level2 = x * x + y * y
            away2 = level2 + z * z
            if away2 > far_m * far_m or away2 < _LEAST_M * _LEAST_M:
                continue
            away, level = np.sqrt(away2), np.sqrt(level2)
            row = (np.arctan2(z, level) - lowest_rad) / bin_rad
            column = np.arctan2(y, x) / bin_rad
            half = 0.5 * side_m / away / bin_rad
            wide = half / max(level / away, 0.1)
            top, bottom = _cells(row, half)
            left, right = _cells(column, wide)
            for v in range(max(top, 0), min(bottom, rows)):
                for u in range(left, right):
                    k = u % columns
                    if away < depth[v, k]:
                        depth[v, k] = away
                        out[e, v, k, 0], out[e, v, k, 1], out[e, v, k, 2] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
                        out[e, v, k, 3] = 1


@njit(cache=True, nogil=True, fastmath=True)
def _cells(middle: Real, half: Real):
    """Return the cells whose middles a footprint covers, at least the one that it lies in."""
    first, past = int(np.floor(middle - half + 0.5)), int(np.floor(middle + half + 0.5))
    if past <= first:
        first = int(np.floor(middle))
        past = first + 1
    return first, past


@njit(cache=True, nogil=True, fastmath=True)
def compare_panoramas(
    panoramas: UInt8[np.ndarray, "e rows columns 4"],
    picture: Float32[np.ndarray, "n 3"],
    row: Int32[np.ndarray, "pitches n"],
    column: Int32[np.ndarray, "pitches n"],
    turn: Whole,
    least: Real,
    colour_weight: Real,
    score: Float32[np.ndarray, "e pitches headings"],
):
    """Compare a picture with every panorama, under every pitch and at every heading.

    Args:
        panoramas: (e, rows, columns, 4) uint8.
        picture: (n, 3) float32, the picture's pixels as three channels.
        row: (pitches, n) int32, where a pixel falls in a panorama.
        column: (pitches, n) int32, the same at heading 0, in [0, columns).
        turn: columns from one heading to the next.
        least: this part of the pixels must be seen by the map.
        colour_weight: of the second and third channel.
        score: (e, pitches, headings) float32; -1 stays where too little is seen.
    """
    rows, columns = panoramas.shape[1], panoramas.shape[2]
    pitches, n = row.shape
    # One panorama as channels, laid out twice in a row, so that no column has to be wrapped round.
    laid = np.zeros((rows, 2 * columns, 4), np.float32)
    for e in range(len(panoramas)):
        for v in range(rows):
            for k in range(2 * columns):
                r = np.float32(panoramas[e, v, k % columns, 0])
                g = np.float32(panoramas[e, v, k % columns, 1])
                b = np.float32(panoramas[e, v, k % columns, 2])
                laid[v, k, 0], laid[v, k, 1] = (r + g + b) / 3, colour_weight * (r - g)
                laid[v, k, 2] = colour_weight * ((r + g) / 2 - b)
                laid[v, k, 3] = panoramas[e, v, k % columns, 3]
        for p in range(pitches):
            for h in range(score.shape[2]):
                seen = np.float32(0.0)
                a0 = a1 = a2 = b0 = b1 = b2 = ab = aa = bb = np.float32(0.0)
                for i in range(n):
                    v = row[p, i]
                    if v < 0 or v >= rows:
                        continue
                    k = column[p, i] + h * turn
                    if laid[v, k, 3] == 0:
                        continue
                    seen += np.float32(1.0)
                    x0, x1, x2 = picture[i, 0], picture[i, 1], picture[i, 2]
                    y0, y1, y2 = laid[v, k, 0], laid[v, k, 1], laid[v, k, 2]
                    a0 += x0
                    a1 += x1
                    a2 += x2
                    b0 += y0
                    b1 += y1
                    b2 += y2
                    ab += x0 * y0 + x1 * y1 + x2 * y2
                    aa += x0 * x0 + x1 * x1 + x2 * x2
                    bb += y0 * y0 + y1 * y1 + y2 * y2
                if seen > 0 and seen >= least * n:
                    both = ab - (a0 * b0 + a1 * b1 + a2 * b2) / seen
                    one, other = aa - (a0 * a0 + a1 * a1 + a2 * a2) / seen, bb - (b0 * b0 + b1 * b1 + b2 * b2) / seen
                    score[e, p, h] = _alike(both, one, other, seen)


@njit(cache=True, nogil=True, fastmath=True)
def _alike(both: Real, one: Real, other: Real, n: Real | int):
    """Return a correlation in [-1, 1] from sums about the means; 0 where one picture is of one colour, rounded."""
    return both / np.sqrt(one * other) if min(one, other) > n else 0.0


@njit(cache=True, nogil=True, fastmath=True)
def compare_view(
    points: Float32[np.ndarray, "n 3"],
    channels: Float32[np.ndarray, "n 3"],
    side_m: Real,
    camera: Float64[np.ndarray, "4"],
    world_from_camera: Float64[np.ndarray, "4 4"],
    picture: Float32[np.ndarray, "h w 3"],
    least: Real,
    depth: Float32[np.ndarray, "h w"],
    drawn: Int64[np.ndarray, "h w"],
):
    """Draw voxels as a camera sees them, and return how alike a picture is; -1 where the map shows too little.

    Args:
        points: (n, 3) float32 middles of the voxels.
        channels: (n, 3) float32, their colours as three channels.
        side_m: their side.
        camera: (4,) float64 fx, fy, cx, cy.
        world_from_camera: (4, 4) float64.
        picture: (h, w, 3) float32 as three channels.
        least: this part of the pixels must be seen by the map.
        depth: (h, w) float32, to work in.
        drawn: (h, w) int64, to work in.
    """
    _draw_view(points, side_m, camera, world_from_camera, depth, drawn)
    height, width = depth.shape
    seen = 0
    a, b = np.zeros(3), np.zeros(3)
    both = one = other = 0.0
    for k in range(height):
        for j in range(width):
            if depth[k, j] < UNSEEN:
                seen += 1
                for c in range(3):
                    x, y = picture[k, j, c], channels[drawn[k, j], c]
                    a[c] += x
                    b[c] += y
                    both += x * y
                    one += x * x
                    other += y * y
    if not seen or seen < least * width * height:
        return -1.0
    for c in range(3):
        both -= a[c] * b[c] / seen
        one -= a[c] * a[c] / seen
        other -= b[c] * b[c] / seen
    return _alike(both, one, other, seen)


@njit(cache=True, nogil=True, fastmath=True)
def _draw_view(
    points: Float32[np.ndarray, "n 3"],
    side_m: Real,
    camera: Float64[np.ndarray, "4"],
    pose: Float64[np.ndarray, "4 4"],
    depth: Float32[np.ndarray, "h w"],
    drawn: Int64[np.ndarray, "h w"],
):
    """Write how far away each pixel's nearest voxel is, and which one it is."""
    height, width = depth.shape
    depth[:] = UNSEEN
    for i in range(len(points)):
        dx, dy, dz = points[i, 0] - pose[0, 3], points[i, 1] - pose[1, 3], points[i, 2] - pose[2, 3]
        z = pose[0, 2] * dx + pose[1, 2] * dy + pose[2, 2] * dz
        if z < _LEAST_M:
            continue
        u = camera[0] * (pose[0, 0] * dx + pose[1, 0] * dy + pose[2, 0] * dz) / z + camera[2]
        v = camera[1] * (pose[0, 1] * dx + pose[1, 1] * dy + pose[2, 1] * dz) / z + camera[3]
        left, right = _cells(u, 0.5 * side_m * camera[0] / z)
        top, bottom = _cells(v, 0.5 * side_m * camera[1] / z)
        for k in range(max(top, 0), min(bottom, height)):
            for j in range(max(left, 0), min(right, width)):
                if z < depth[k, j]:
                    depth[k, j], drawn[k, j] = z, i
