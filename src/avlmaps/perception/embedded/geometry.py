"""The shape in a depth picture, in the frame of gravity: the channels that the embedded encoders look at.

Shape carries from rendered rooms to real ones where colour does not, and it does so best where "up" is up and
heights are heights, however the camera was held.
"""

import math

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.camera import Pinhole

CHANNELS = 8
# Normals are taken over this many pixels to each side; over one where an edge is nearer.
_REACH_PX = 3
_LARGEST_STEP = 0.06  # of the depth: a greater step between neighbours is an edge, not a surface


def channels(
    depth_m: Float32[np.ndarray, "h w"], camera: Pinhole, up_in_camera: Float[np.ndarray, "3"], camera_height_m: float
) -> Float32[np.ndarray, "8 h w"]:
    """Return the geometry of a depth picture, zero (but for the last channel) where there is no depth.

    The channels: logarithm of a pixel's size on the surface in centimetres; a quarter of the depth; height over the
    floor in metres, within −1 and 4; the surface normal along up, to the camera's right and along its heading
    (both level); 1 where there is a depth; the rise of the pixel's ray, −1 straight down to 1 straight up.

    Args:
        depth_m: z-depth, 0 where there is none.
        camera: of that picture.
        up_in_camera: unit vector.
        camera_height_m: of the camera over the floor.
    """
    rows, columns = np.ogrid[: depth_m.shape[0], : depth_m.shape[1]]
    x, y = ((columns + 0.5 - camera.cx) / camera.fx).astype("f4"), ((rows + 0.5 - camera.cy) / camera.fy).astype("f4")
    up = np.asarray(up_in_camera, np.float32)
    known = depth_m > 0.0
    z = np.where(known, depth_m, np.float32(0.0))
    rise = up[0] * x + up[1] * y + up[2]
    out = np.zeros((CHANNELS, *depth_m.shape), np.float32)
    np.log(z * np.float32(math.exp(4.6) / (0.5 * (camera.fx + camera.fy))), out=out[0], where=known)
    np.multiply(z, np.float32(0.25), out=out[1])
    np.clip(z * rise + np.float32(camera_height_m), -1.0, 4.0, out=out[2], where=known)
    normal = _normals(z, x, y, camera)
    for channel, along in zip((3, 4, 5), (up, *level_axes(up)), strict=True):
        out[channel] = sum(part * np.float32(share) for part, share in zip(normal, along, strict=True))
    out[6] = known
    out[7] = rise / np.sqrt(x * x + y * y + 1.0)
    return out


def _normals(
    z: Float32[np.ndarray, "h w"], x: Float32[np.ndarray, "1 w"], y: Float32[np.ndarray, "h 1"], camera: Pinhole
) -> tuple[Float32[np.ndarray, "h w"], ...]:
    """Return the normal of the surface at each pixel, towards the camera; zero where its neighbours are of others."""
    (left, far_left), (right, far_right) = (_neighbour(z, 1, sign) for sign in (-1, 1))
    (above, far_above), (below, far_below) = (_neighbour(z, 0, sign) for sign in (-1, 1))
    across, down = right - left, below - above
    ax = x * across + (far_right * right + far_left * left) / np.float32(camera.fx)
    by = y * down + (far_below * below + far_above * above) / np.float32(camera.fy)
    ay, bx = y * across, x * down
    nx, ny, nz = by * across - down * ay, down * ax - bx * across, bx * ay - by * ax
    squared = nx * nx + ny * ny + nz * nz
    seen = (z > 0.0) & (far_left + far_right > 0) & (far_above + far_below > 0) & (squared > 0.0)
    scale = np.zeros_like(z)
    np.divide(np.where(nx * x + ny * y + nz > 0.0, -1.0, 1.0), np.sqrt(squared), out=scale, where=seen)
    return nx * scale, ny * scale, nz * scale


def _neighbour(
    z: Float32[np.ndarray, "h w"], axis: int, sign: int
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Return the depth of each pixel's farthest neighbour on one side that is of its surface, and how far that is."""
    depth, reach = z.copy(), np.zeros_like(z)
    largest = np.float32(_LARGEST_STEP) * z
    for pixels in (1, _REACH_PX):  # the farther one counts
        beside = [slice(None)] * 2, [slice(None)] * 2
        beside[0][axis], beside[1][axis] = slice(pixels, None), slice(None, -pixels)
        here, there = (tuple(one) for one in (beside if sign < 0 else beside[::-1]))
        other = z[there]
        same = (other > 0.0) & (np.abs(other - z[here]) < largest[here])
        np.copyto(depth[here], other, where=same)
        np.copyto(reach[here], np.float32(pixels), where=same)
    return depth, reach


def level_axes(up_in_camera: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the level directions to the right of the camera and ahead of it, in its own frame.

    Looking straight up or down it has no heading; then the picture's own upper edge is taken for it.
    """
    ahead = np.array([0.0, 0.0, 1.0]) if abs(up_in_camera[2]) < 0.99 else np.array([0.0, -1.0, 0.0])
    forward = ahead - up_in_camera * (up_in_camera @ ahead)
    forward /= np.linalg.norm(forward)
    return np.cross(forward, up_in_camera), forward
