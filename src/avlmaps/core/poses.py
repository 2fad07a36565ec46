"""Rigid transforms as 4x4 float64 matrices, named ``to_from`` (``world_from_camera`` maps camera to world).

Quaternions are x y z w. Batches are leading axes.
"""

from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import RecordingError

# A rotation read from a file may be this far from orthonormal (largest entry of RᵀR − I) and still be
# taken for a rotation written with too few digits; real data (7-Scenes) is off by 2e-4.
MAX_ROTATION_FAULT = 0.05
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)


class FrameName(StrEnum):
    """The frame of the positions of an answer or a file."""

    RECORDING = "recording"
    LEVEL = "level"


FRAME = "recording"
"""The frame of every position that is printed, written or drawn: the world of the recording's poses."""


def orthonormalize(
    world_from_camera: Float[np.ndarray, "*shape"], name: str, max_fault: float = MAX_ROTATION_FAULT
) -> Float[np.ndarray, "4 4"]:
    """Return one pose as ``orthonormalize_all`` does; one of another shape than 4x4 is refused as well."""
    if world_from_camera.shape != (4, 4):
        raise RecordingError(f"The pose of {name} has shape {world_from_camera.shape}; it must be 4x4.")
    return orthonormalize_all(world_from_camera[None], [name], max_fault)[0]


def orthonormalize_all(
    world_from_camera: Float[np.ndarray, "n 4 4"], names: Sequence[str], max_fault: float = MAX_ROTATION_FAULT
) -> Float[np.ndarray, "n 4 4"]:
    """Return poses with their rotations replaced by the nearest ones (in the Frobenius norm).

    Raises:
        RecordingError: the first, by its name (``frame 000012``), that is not finite, is not a rigid transform,
            mirrors, or has an entry of RᵀR − I over ``max_fault``, beyond which it is no rounding.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        rotation = world_from_camera[:, :3, :3]
        fault = np.abs(np.swapaxes(rotation, 1, 2) @ rotation - np.eye(3)).max(axis=(1, 2), initial=0.0)
        wild = ~(fault <= max_fault) | ~np.isfinite(world_from_camera).all(axis=(1, 2))
        wild |= np.abs(world_from_camera[:, 3] - _LAST_ROW).max(axis=1, initial=0.0) > 1e-6
        wild |= np.linalg.det(np.where(wild[:, None, None], np.eye(3), rotation)) < 0.0
    if wild.any():
        index = int(np.argmax(wild))
        raise RecordingError(f"The pose of {names[index]} {_why_no_pose(world_from_camera[index], max_fault)}")
    u, _, vt = np.linalg.svd(rotation)
    pose = world_from_camera.copy()
    pose[:, :3, :3] = u @ vt
    pose[:, 3] = _LAST_ROW
    return pose


def _why_no_pose(pose: Float[np.ndarray, "4 4"], max_fault: float) -> str:
    if not np.isfinite(pose).all():
        return "holds NaN or infinity; remove that frame or fix its pose."
    rotation = pose[:3, :3]
    fault = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if not np.allclose(pose[3], _LAST_ROW, atol=1e-6):
        row = " ".join(f"{value:.4g}" for value in pose[3])
        turned = fault <= max_fault and bool(np.allclose(pose[:, 3], _LAST_ROW, atol=1e-6))
        why = "; it looks written column by column: transpose it" if turned else ""
        return f"is not a rigid transform: its last row is {row}, where 0 0 0 1 belongs{why}."
    return (
        f"is not a rigid transform (its rotation is off orthonormal by {fault:.3g}, determinant "
        f"{np.linalg.det(rotation):.3g}; at most {max_fault} passes for rounding); fix it or leave the frame out."
    )


def inverse(b_from_a: Float[np.ndarray, "*batch 4 4"]) -> Float[np.ndarray, "*batch 4 4"]:
    """Return ``a_from_b`` of a rigid ``b_from_a``, exactly (no general inverse)."""
    transposed = np.swapaxes(b_from_a[..., :3, :3], -1, -2)
    return from_rotation(transposed, -np.einsum("...ij,...j->...i", transposed, b_from_a[..., :3, 3]))


def apply(b_from_a: Float[np.ndarray, "4 4"], points_a: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Map points from frame a to frame b."""
    return points_a @ b_from_a[:3, :3].T + b_from_a[:3, 3]


def from_rotation(
    rotation: Float[np.ndarray, "*n 3 3"], translation: Float[np.ndarray, "*n 3"] | None = None
) -> Float[np.ndarray, "*n 4 4"]:
    """Build poses from rotations and translations, metres; none about the origin."""
    pose = np.zeros((*rotation.shape[:-2], 4, 4))
    pose[..., :3, :3], pose[..., 3, 3] = rotation, 1.0
    if translation is not None:
        pose[..., :3, 3] = translation
    return pose


def from_quaternion(
    translation: Float[np.ndarray, "*n 3"], quaternion_xyzw: Float[np.ndarray, "*n 4"]
) -> Float[np.ndarray, "*n 4 4"]:
    """Build poses from translations (metres) and quaternions x y z w of any positive norm (0: ``ValueError``)."""
    # Not SciPy's, which refuses NaN and, in 1.14, that there is none.
    norm = np.linalg.norm(quaternion_xyzw, axis=-1, keepdims=True)
    if np.any(norm == 0.0):
        raise ValueError("a quaternion has norm 0")
    x, y, z, w = np.moveaxis(quaternion_xyzw / norm, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return from_rotation(np.stack([np.stack(row, axis=-1) for row in rows], axis=-2), translation)


def to_quaternion(b_from_a: Float[np.ndarray, "*n 4 4"]) -> Float[np.ndarray, "*n 4"]:
    """Return unit quaternions x y z w with w >= 0."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_matrix(b_from_a[..., :3, :3].reshape(-1, 3, 3)).as_quat(canonical=True)
    return flat.reshape(*b_from_a.shape[:-2], 4)


def rotation_to_level(up_in_world: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return the smallest rotation that takes the up direction to +z; the identity where up is +z already.

    The level frame shares the world's origin. Horizontal distances and top-down pictures live there.
    """
    up = up_in_world / np.linalg.norm(up_in_world)
    cosine = float(up[2])
    if cosine > 1.0 - 1e-12:
        return np.eye(3)
    if cosine < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    axis = np.cross(up, (0.0, 0.0, 1.0))
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + cosine)


def rotation_angle_rad(a: Float[np.ndarray, "*n 4 4"], b: Float[np.ndarray, "*n 4 4"]) -> Float[np.ndarray, "*n"]:
    """Return the angle between the rotations of two poses, in [0, π]."""
    trace = np.einsum("...ij,...ij->...", a[..., :3, :3], b[..., :3, :3])
    return np.asarray(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


def mean_rotation(b_from_a: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation that lies between those of some poses: the nearest to their sum (in the Frobenius norm)."""
    left, _, right = np.linalg.svd(b_from_a[:, :3, :3].sum(axis=0))
    return left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def plain_point(vector: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
    """Return a position or a size, metres, as plain numbers to a tenth of a millimetre: no 0.17500000000000002."""
    x, y, z = (round(float(value), 4) for value in vector)
    return x, y, z
