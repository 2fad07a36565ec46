"""Where a picture was taken, from image points and the 3D points that they show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.camera import Pinhole
from avlmaps.perception.protocols import Pose

_FEWEST_POINTS = 4


@dataclass(frozen=True, slots=True)
class PoseSettings:
    """How a pose is estimated."""

    max_error_rad: float = 0.012
    """A point agrees with a pose when it is seen within this angle of where it should be (6 px at f = 525)."""

    max_iterations: int = 2000
    """RANSAC gives up after so many samples."""

    depth_noise_per_m: float = 0.002
    """Standard deviation of a map point along its ray grows as this times the squared distance in metres."""


def estimate_pose(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    rng: np.random.Generator,
    settings: PoseSettings = PoseSettings(),
) -> tuple[Pose, Bool[np.ndarray, " n"]] | None:
    """Estimate the camera's pose by P3P in LO-RANSAC (PoseLib) with robust refinement of every inlier.

    Args:
        xy: image coordinates, pixels.
        points_world: what they show, metres.
        camera: the camera that took the picture.
        rng: seeds the sampling; the same generator state gives the same pose.
        settings: tolerance and effort.

    Returns:
        The pose and which points agree with it, or None where fewer than four do.
    """
    import poselib

    if len(xy) < _FEWEST_POINTS:
        return None
    max_error_px = settings.max_error_rad * 0.5 * (camera.fx + camera.fy)
    ransac = {
        "max_reproj_error": max_error_px,
        "max_error": max_error_px,  # its name from PoseLib 2.1 on
        "max_iterations": settings.max_iterations,
        "min_iterations": 100,
        "seed": int(rng.integers(2**31)),
    }
    refinement = {"loss_type": "CAUCHY", "loss_scale": 0.25 * max_error_px}
    found, report = poselib.estimate_absolute_pose(
        xy.astype(np.float64), points_world.astype(np.float64), _as_poselib(camera), ransac, refinement
    )
    inlier = np.array(report["inliers"], bool)
    if inlier.sum() < _FEWEST_POINTS:
        return None
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3], camera_from_world[:3, 3] = found.R, found.t
    return Pose(np.linalg.inv(camera_from_world), int(inlier.sum())), inlier


def _as_poselib(camera: Pinhole) -> dict[str, object]:
    return {
        "model": "PINHOLE",
        "width": camera.width,
        "height": camera.height,
        "params": [camera.fx, camera.fy, camera.cx, camera.cy],
    }
