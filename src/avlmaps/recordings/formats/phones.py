"""The axes of phones: ARKit's cameras look along -z with y up (as in OpenGL), its world has y up, against gravity."""

import numpy as np
from jaxtyping import Float

from avlmaps.recordings.camera_axes import opencv_from_axes

UP_IN_WORLD = np.array([0.0, 1.0, 0.0])


def from_opengl(world_from_camera: Float[np.ndarray, "*n 4 4"]) -> Float[np.ndarray, "*n 4 4"]:
    """Return poses of cameras with y down and z forward, given those with y up and z backward."""
    opengl_from_opencv = np.eye(4)
    opengl_from_opencv[:3, :3] = opencv_from_axes("opengl").T
    return world_from_camera @ opengl_from_opencv
