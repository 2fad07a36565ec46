"""The compiled loops that count which frames see through which voxels, cube by cube of the map.

A frame sees a small part of a map. Voxels are grouped into cubes, and a cube whose sphere lies outside of the picture,
or farther than anything that the frame sees in its direction, is passed over whole: none of its voxels could count.
"""

import numpy as np
from jaxtyping import Float64, Int32, UInt16
from numba import njit

from avlmaps.core.kernel_types import Real, Whole
from avlmaps.maps.fusion.submap_kernels import group_pairs
from avlmaps.maps.fusion.voxel_kernels import OPTIONS, find_or_insert

CUBE_SHIFT = 3  # the edge of a cube is 2 to the power of this, voxels
COARSE = 4  # blocks of pixels along the edge of those of which the farthest is looked up
_NEAREST_M = 0.05  # a sphere that comes nearer than this may be anywhere in the picture

# (order (n,), its index (n, 3), where each cube begins (c + 1,), its middle (c, 3) and radius (c,), voxels)
Chunks = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def chunks_of(index: Int32[np.ndarray, "n 3"]) -> Chunks:
    """Group voxels into cubes, for ``count_frames``."""
    of = np.empty(len(index), np.int32)
    slots = np.full(1 << (2 * len(index) + 1).bit_length(), -1, np.int32)
    count = _cubes(index, slots, np.empty((len(index), 3), np.int32), of)
    start, order = np.zeros(count + 1, np.int64), np.empty(len(index), np.int32)
    no_weight = np.zeros(len(index), np.float32)
    group_pairs(of, np.arange(len(index), dtype=np.int32), no_weight, start, order, no_weight)
    grouped = index[order]
    middle, radius = np.empty((count, 3)), np.empty(count)
    _spheres(grouped, start, middle, radius)
    return order, grouped, start, middle, radius


@njit(**OPTIONS)
def _cubes(
    index: Int32[np.ndarray, "n 3"],
    slots: Int32[np.ndarray, " slots"],
    cubes: Int32[np.ndarray, "n 3"],
    of: Int32[np.ndarray, " n"],
):
    """Number the cubes, write which each voxel is in, and return how many there are."""
    count = 0
    for n in range(index.shape[0]):
        i, j, k = index[n, 0] >> CUBE_SHIFT, index[n, 1] >> CUBE_SHIFT, index[n, 2] >> CUBE_SHIFT
        row = int(find_or_insert(i, j, k, slots, cubes, count))
        count += row == count
        of[n] = row
    return count


@njit(**OPTIONS)
def _spheres(
    index: Int32[np.ndarray, "n 3"],
    start: np.ndarray,
    middle: Float64[np.ndarray, "c 3"],
    radius: Float64[np.ndarray, " c"],
):
    """Write a sphere that holds the middles of each cube's voxels."""
    for cube in range(middle.shape[0]):
        square = 0.0
        for axis in range(3):
            low = high = index[start[cube], axis]
            for n in range(start[cube] + 1, start[cube + 1]):
                low, high = min(low, index[n, axis]), max(high, index[n, axis])
            middle[cube, axis] = 0.5 * (np.float64(low) + np.float64(high)) + 0.5
            half = 0.5 * (np.float64(high) - np.float64(low))
            square += half * half
        radius[cube] = np.sqrt(square) + 1e-3  # beyond any rounding


@njit(**OPTIONS)
def count_frames(
    chunks: Chunks,
    voxel_size: Real,
    clear: UInt16[np.ndarray, "k rows columns"],
    size: Whole,
    camera: tuple[float, float, float, float, float, float],
    pose: Float64[np.ndarray, "k 4 4"],
    through: Int32[np.ndarray, " n"],
):
    """Add to each voxel how many views see through it: all rays that may meet it are free for an edge behind it.

    Args:
        chunks: of `chunks_of`.
        voxel_size: metres.
        clear: (k, rows, columns) uint16, millimetres, as `carving_kernels.clear_blocks` wrote them.
        size: edge of a block, pixels.
        camera: (fx, fy, cx, cy, width, height).
        pose: (k, 4, 4) world_from_camera.
        through: (n,) int32 in the order of the chunks, added to.
    """
    coarse = np.empty(((clear.shape[1] + COARSE - 1) // COARSE, (clear.shape[2] + COARSE - 1) // COARSE), np.uint16)
    column, row = _blocks(np.int64(camera[4]), size), _blocks(np.int64(camera[5]), size)
    for frame in range(clear.shape[0]):
        _farthest(clear[frame], coarse)
        _count_frame(
            chunks, voxel_size, clear[frame], (coarse, size * COARSE, column, row), camera, pose[frame], through
        )


@njit(**OPTIONS)
def _blocks(length: Whole, size: Whole):
    """Return which block each pixel of an axis is in: a division costs more than what is done with it."""
    of = np.empty(length, np.int64)
    for pixel in range(length):
        of[pixel] = pixel // size
    return of


@njit(**OPTIONS)
def _count_frame(
    chunks: Chunks,
    voxel_size: Real,
    clear: UInt16[np.ndarray, "rows columns"],
    blocks: tuple[np.ndarray, int, np.ndarray, np.ndarray],
    camera: tuple[float, float, float, float, float, float],
    pose: Float64[np.ndarray, "4 4"],
    through: Int32[np.ndarray, " n"],
):
    """Add what one frame sees through. The test of a voxel stands in the loop: a call would cost as much again."""
    _, index, start, middle, radius = chunks
    coarse, size, column, row = blocks
    fx, fy, cx, cy, width, height = camera
    ball = 0.5 * np.sqrt(3.0) * voxel_size  # the sphere round a voxel
    behind = ball + voxel_size
    x0, y0, z0, x1, y1, z1 = pose[0, 0], pose[1, 0], pose[2, 0], pose[0, 1], pose[1, 1], pose[2, 1]
    x2, y2, z2, tx, ty, tz = pose[0, 2], pose[1, 2], pose[2, 2], pose[0, 3], pose[1, 3], pose[2, 3]
    sides = _sides(fx, cx, width), _sides(fy, cy, height)
    for cube in range(middle.shape[0]):
        x = middle[cube, 0] * voxel_size - tx
        y = middle[cube, 1] * voxel_size - ty
        z = middle[cube, 2] * voxel_size - tz
        across, down, ahead = x0 * x + y0 * y + z0 * z, x1 * x + y1 * y + z1 * z, x2 * x + y2 * y + z2 * z
        reach = radius[cube] * voxel_size
        if _is_outside((across, down, ahead), reach, sides):
            continue
        most = _farthest_beside((across, down, ahead), reach, behind, coarse, size, camera)
        farthest = most * 1e-3 - behind + 1e-9  # the whole millimetres below decide
        for n in range(start[cube], start[cube + 1] if most >= 0 else start[cube]):
            x = (index[n, 0] + 0.5) * voxel_size - tx
            y = (index[n, 1] + 0.5) * voxel_size - ty
            z = (index[n, 2] + 0.5) * voxel_size - tz
            depth = x2 * x + y2 * y + z2 * z
            if depth <= 2.0 * ball or depth > farthest:
                continue
            a, b = (x0 * x + y0 * y + z0 * z) / depth, (x1 * x + y1 * y + z1 * z) / depth
            u, v = fx * a + cx, fy * b + cy
            if u < 0.0 or v < 0.0 or u >= width or v >= height:
                continue
            far = np.int64((depth + behind) * 1000.0) + 1
            if clear[row[np.int64(v)], column[np.int64(u)]] < far:
                continue
            # a rectangle that holds the picture of the sphere round the voxel
            wide = fx * ball * (1.0 + abs(a)) / (depth - ball)
            high = fy * ball * (1.0 + abs(b)) / (depth - ball)
            if u - wide < 0.0 or v - high < 0.0 or u + wide >= width or v + high >= height:
                continue
            rows = row[np.int64(v - high)], row[np.int64(v + high)] + 1
            through[n] += _is_free(clear, rows, (column[np.int64(u - wide)], column[np.int64(u + wide)] + 1), far)


@njit(**OPTIONS)
def _is_free(clear: UInt16[np.ndarray, "rows columns"], rows: tuple[int, int], columns: tuple[int, int], far: Whole):
    """Return whether every block of a rectangle is free up to a depth."""
    for i in range(rows[0], rows[1]):
        for j in range(columns[0], columns[1]):
            if clear[i, j] < far:
                return False
    return True


@njit(**OPTIONS)
def _farthest(clear: UInt16[np.ndarray, "rows columns"], coarse: UInt16[np.ndarray, "few some"]):
    """Write the farthest of each square of blocks."""
    coarse[:] = 0
    for i in range(clear.shape[0]):
        for j in range(clear.shape[1]):
            coarse[i // COARSE, j // COARSE] = max(coarse[i // COARSE, j // COARSE], clear[i, j])


@njit(**OPTIONS)
def _sides(focal: Real, centre: Real, length: Real):
    """Return the planes through the camera and two opposite edges of its picture: factors of across and of ahead."""
    first, last = np.sqrt(focal * focal + centre * centre), np.sqrt(focal * focal + (length - centre) ** 2)
    return (focal / first, centre / first), (-focal / last, (length - centre) / last)


@njit(**OPTIONS)
def _is_outside(
    at: tuple[float, float, float],
    radius: Real,
    sides: tuple[tuple[tuple[float, float], tuple[float, float]], tuple[tuple[float, float], tuple[float, float]]],
):
    """Return whether a sphere lies behind the camera or beyond an edge of its picture."""
    across, down, ahead = at
    (left, right), (top, bottom) = sides
    return (
        ahead < -radius
        or left[0] * across + left[1] * ahead < -radius
        or right[0] * across + right[1] * ahead < -radius
        or top[0] * down + top[1] * ahead < -radius
        or bottom[0] * down + bottom[1] * ahead < -radius
    )


@njit(**OPTIONS)
def _farthest_beside(
    at: tuple[float, float, float],
    radius: Real,
    behind: Real,
    coarse: UInt16[np.ndarray, "few some"],
    size: Whole,
    camera: tuple[float, float, float, float, float, float],
):
    """Return how far a frame sees, at most, where it sees a sphere, mm; -1 where no voxel in it is seen through."""
    fx, fy, cx, cy, width, height = camera
    right, down, ahead = at
    near, far = ahead - radius, ahead + radius
    if near < _NEAREST_M:
        return 65535
    first_u, last_u = _span(right, radius, near, far, fx, cx, width)
    first_v, last_v = _span(down, radius, near, far, fy, cy, height)
    most = 0
    for i in range(np.int64(first_v) // size, np.int64(last_v) // size + 1):
        for j in range(np.int64(first_u) // size, np.int64(last_u) // size + 1):
            most = max(most, np.int64(coarse[i, j]))
    return most if most >= np.int64((near + behind) * 1000.0) else -1


@njit(**OPTIONS)
def _span(across: Real, radius: Real, near: Real, far: Real, focal: Real, centre: Real, length: Real):
    """Return between which pixels a sphere is seen, within a picture."""
    low, high = across - radius, across + radius
    first = focal * low / (near if low < 0.0 else far) + centre
    last = focal * high / (near if high > 0.0 else far) + centre
    return min(max(first, 0.0), length - 1.0), min(max(last, 0.0), length - 1.0)
