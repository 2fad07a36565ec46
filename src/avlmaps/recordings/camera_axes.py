"""Where the axes of a camera point: OpenCV's x right, y down, z forward, and the conventions of others.

A convention is a name or three letters for its x, y and z axis: R or L (right, left), U or D (up, down), F or B
(forward, back), as seen by the camera. OpenCV is RDF, OpenGL and ARKit RUB, the bodies of ROS FLU. A picture that was
turned by 90 degrees is a camera that was: DLF or URF.
"""

from functools import cache

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import RecordingError

OPENCV = "opencv"
NAMED = {OPENCV: "RDF", "opengl": "RUB", "ros": "FLU"}
_DIRECTIONS = {
    "R": (1.0, 0.0, 0.0),
    "L": (-1.0, 0.0, 0.0),
    "D": (0.0, 1.0, 0.0),
    "U": (0.0, -1.0, 0.0),
    "F": (0.0, 0.0, 1.0),
    "B": (0.0, 0.0, -1.0),
}


def opencv_from_axes(name: str) -> Float[np.ndarray, "3 3"]:
    """Return the rotation that takes a vector in these axes to OpenCV's.

    Args:
        name: ``opencv``, ``opengl``, ``ros``, or three letters such as ``RUB``.

    Raises:
        RecordingError: it is no name and no three axes, or the axes are left-handed.
    """
    letters = NAMED.get(name.lower(), name.upper())
    if len(letters) != 3 or not set(letters) <= set(_DIRECTIONS):
        raise RecordingError(
            f"There are no camera axes called {name!r}; give {', '.join(NAMED)}, or where x, y and z point by three "
            "letters of R L U D F B (RDF is opencv)."
        )
    rotation = np.array([_DIRECTIONS[letter] for letter in letters]).T
    if not np.isclose(np.linalg.det(rotation), 1.0):
        raise RecordingError(f"The camera axes {name!r} are no right-handed axes; RDF, RUB and FLU are.")
    return rotation


@cache
def all_axes() -> tuple[str, ...]:
    """Return every right-handed convention by its letters, the named ones first."""
    every = [a + b + c for a in _DIRECTIONS for b in _DIRECTIONS for c in _DIRECTIONS]
    right = [letters for letters in every if _determinant(letters) > 0.5]
    return tuple(sorted(right, key=lambda letters: letters not in NAMED.values()))


def _determinant(letters: str) -> float:
    return float(np.linalg.det(np.array([_DIRECTIONS[letter] for letter in letters])))


UP_IN_WORLD = np.array([0.0, 1.0, 0.0])  # of phones: ARKit's world has y up, against gravity


def from_opengl(world_from_camera: Float[np.ndarray, "*n 4 4"]) -> Float[np.ndarray, "*n 4 4"]:
    """Return poses of cameras with y down and z forward, given those with y up and z backward."""
    opengl_from_opencv = np.eye(4)
    opengl_from_opencv[:3, :3] = opencv_from_axes("opengl").T
    return world_from_camera @ opengl_from_opencv
