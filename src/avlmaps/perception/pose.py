"""Where a picture was taken, from image points and the 3D points that they show."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import apply, from_rotation, inverse
from avlmaps.perception.protocols import Pose

_FEWEST_POINTS = 4
_SINGULAR = 1e14
# Where the rotation, the shift and the focal length stand among the unknowns.
_PARTS = (slice(0, 3), slice(3, 6), slice(6, 7))


@dataclass(frozen=True, slots=True)
class PoseSettings:
    """How a pose is estimated: a point agrees when it is seen within this of where it should be (6 px at f = 525)."""

    max_error_rad: float = 0.012


def estimate_pose(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    rng: np.random.Generator,
    settings: PoseSettings = PoseSettings(),
) -> tuple[Pose, Bool[np.ndarray, " n"]] | None:
    """Estimate the camera's pose by P3P in LO-RANSAC (PoseLib) with robust refinement of every inlier.

    Points are pixels and metres. Returns the pose and which points agree with it, or None where fewer than four do; the
    same state of ``rng`` gives the same pose.
    """
    import poselib

    if len(xy) < _FEWEST_POINTS:
        return None
    max_error_px = settings.max_error_rad * 0.5 * (camera.fx + camera.fy)
    ransac = {
        "max_reproj_error": max_error_px,
        "max_error": max_error_px,  # its name from PoseLib 2.1 on
        "max_iterations": 2000,
        "min_iterations": 100,
        "seed": int(rng.integers(2**31)),
    }
    params = [camera.fx, camera.fy, camera.cx, camera.cy]
    given = {"model": "PINHOLE", "width": camera.width, "height": camera.height, "params": params}
    refinement = {"loss_type": "CAUCHY", "loss_scale": 0.25 * max_error_px}
    found, report = poselib.estimate_absolute_pose(
        xy.astype(np.float64), points_world.astype(np.float64), given, ransac, refinement
    )
    inlier = np.array(report["inliers"], bool)
    if inlier.sum() < _FEWEST_POINTS:
        return None
    return Pose(inverse(from_rotation(found.R, found.t)), int(inlier.sum())), inlier


def agreement(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    world_from_camera: Float[np.ndarray, "4 4"],
    max_error_px: float,
) -> float:
    """Return how well points agree with a pose: each adds 1 - (error / limit)² or nothing (MSAC, Torr 2000)."""
    points = apply(inverse(world_from_camera), points_world)
    front = points[:, 2] > 0.0
    error_px = np.linalg.norm(camera.project(points[front]) - xy[front], axis=1)
    return float(np.maximum(0.0, 1.0 - (error_px / max_error_px) ** 2).sum())


def refine_focal(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    world_from_camera: Float[np.ndarray, "4 4"],
    settings: PoseSettings = PoseSettings(),
    rounds: int = 15,
) -> Pinhole:
    """Let the focal length go along with the pose, and return the camera that fits the points best.

    Gauss-Newton with Cauchy weights on the reprojection error, over rotation, translation and the logarithm of one
    factor on both focal lengths. A few points may be wrong. Points that face the camera flatly constrain the focal
    length badly: let it replace a given one only where that gains much ``agreement``.
    """
    camera_from_world = inverse(world_from_camera)
    log_factor = 0.0
    focal = np.array([camera.fx, camera.fy])
    tolerance_px = settings.max_error_rad * float(focal.mean())
    for _ in range(rounds):
        points = apply(camera_from_world, points_world)
        front = points[:, 2] > 0.05
        residual, jacobian = _reprojection(xy[front], points[front], focal * np.exp(log_factor), (camera.cx, camera.cy))
        weight = 1.0 / (1.0 + (residual**2).sum(axis=1) / tolerance_px**2)
        weighted = (jacobian * weight[:, None, None]).reshape(-1, 7).T
        normal = weighted @ jacobian.reshape(-1, 7)
        # Of a wall that is seen straight on, focal length and distance cannot be told apart: the shortest step.
        step = np.linalg.lstsq(normal, -weighted @ residual.reshape(-1), rcond=1e-12)[0]
        camera_from_world = _small_motion(step[:6]) @ camera_from_world
        log_factor = float(np.clip(log_factor + step[6], -0.5, 0.5))
    factor = float(np.exp(log_factor))
    return replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)


def pose_deviation(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    world_from_camera: Float[np.ndarray, "4 4"],
) -> tuple[float, float, float]:
    """Return the standard deviations of a pose whose focal length was estimated with it, from points that agree.

    They are of the focal length, as a part of it; of the place, metres; of the direction, radians; infinite where the
    points do not fix them: the inverse of ``refine_focal``'s normal equations, times the variance of the residuals.
    """
    points = apply(inverse(world_from_camera), points_world)
    front = points[:, 2] > 0.05
    focal = np.array([camera.fx, camera.fy])
    residual, jacobian = _reprojection(xy[front], points[front], focal, (camera.cx, camera.cy))
    normal = np.einsum("nri,nrj->ij", jacobian, jacobian)
    if 2 * len(residual) <= len(normal) or np.linalg.cond(normal) > _SINGULAR:
        return float("inf"), float("inf"), float("inf")
    covariance = np.linalg.inv(normal) * (residual**2).sum() / (2 * len(residual) - len(normal))
    angle, place, of_focal = (float(np.trace(covariance[part, part])) for part in _PARTS)
    return of_focal**0.5, place**0.5, angle**0.5


def _reprojection(
    xy: Float[np.ndarray, "n 2"],
    points_camera: Float[np.ndarray, "n 3"],
    focal: Float[np.ndarray, "2"],
    centre: tuple[float, float],
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 7"]]:
    # Residuals in pixels, and their derivatives by a small rotation, a small shift and the log focal length.
    x, y, z = points_camera.T
    seen = np.stack([x / z, y / z], axis=1) * focal
    by_point = np.zeros((len(xy), 2, 3))
    by_point[:, 0, 0], by_point[:, 1, 1] = focal[0] / z, focal[1] / z
    by_point[:, :, 2] = -seen / z[:, None]
    by_rotation = np.zeros((len(xy), 3, 3))  # the derivative of w x p by w
    by_rotation[:, 0, 1], by_rotation[:, 0, 2] = z, -y
    by_rotation[:, 1, 0], by_rotation[:, 1, 2] = -z, x
    by_rotation[:, 2, 0], by_rotation[:, 2, 1] = y, -x
    jacobian = np.concatenate([by_point @ by_rotation, by_point, seen[:, :, None]], axis=2)
    return seen + centre - xy, jacobian


def _small_motion(step: Float[np.ndarray, "6"]) -> Float[np.ndarray, "4 4"]:
    from scipy.spatial.transform import Rotation

    return from_rotation(Rotation.from_rotvec(step[:3]).as_matrix(), step[3:])
