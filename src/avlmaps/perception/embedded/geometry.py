"""The shape in a depth picture, in the frame of gravity: the channels that the embedded encoders look at.

Shape carries from rendered rooms to real ones where colour does not, and it does so best where "up" is up and
heights are heights, however the camera was held.
"""

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.camera import Pinhole

CHANNELS = 8
# Normals are taken over this many pixels to each side; over one where an edge is nearer.
_REACH_PX = 3


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
    from avlmaps.perception.embedded.geometry_kernels import geometry_into

    up = np.asarray(up_in_camera, np.float64)
    right, forward = level_axes(up)
    out = np.empty((CHANNELS, *depth_m.shape), np.float32)
    geometry_into(
        np.ascontiguousarray(depth_m, np.float32),
        camera.fx, camera.fy, camera.cx, camera.cy, up, right, forward, float(camera_height_m), _REACH_PX, out,
    )  # fmt: skip
    return out


def level_axes(up_in_camera: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the level directions to the right of the camera and ahead of it, in its own frame.

    Looking straight up or down it has no heading; then the picture's own upper edge is taken for it.
    """
    ahead = np.array([0.0, 0.0, 1.0]) if abs(up_in_camera[2]) < 0.99 else np.array([0.0, -1.0, 0.0])
    forward = ahead - up_in_camera * (up_in_camera @ ahead)
    forward /= np.linalg.norm(forward)
    return np.cross(forward, up_in_camera), forward
