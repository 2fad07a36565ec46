"""A pose graph: poses along a drive that fit both its odometry and what was seen again.

It minimises Σ ρ(|Σᵢⱼ⁻½ log(Zᵢⱼ⁻¹ Tᵢ⁻¹ Tⱼ)|²) over the poses T, where Zᵢⱼ is a measured motion from pose i to pose j.
Odometry counts in full; ρ is Cauchy's function for what was seen again, so that a wrong one hardly counts (Gauss and
Newton's steps; sparse, by SciPy).
"""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.columns import take
from avlmaps.core.poses import inverse

_STEPS = 60
_STILL = 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Measured motions.

    Attributes:
        first: pose i of each.
        second: pose j of each.
        measured: (e, 4, 4) pose j in the frame of pose i, metres.
        sigma_m: standard deviation of its translation.
        sigma_rad: of its rotation.
        is_closure: whether it may be wrong altogether.
    """

    first: Int[np.ndarray, " e"]
    second: Int[np.ndarray, " e"]
    measured: Float[np.ndarray, "e 4 4"]
    sigma_m: Float[np.ndarray, " e"]
    sigma_rad: Float[np.ndarray, " e"]
    is_closure: Bool[np.ndarray, " e"]

    def __len__(self) -> int:
        return len(self.first)

    def only(self, kept: Bool[np.ndarray, " e"]) -> "Edges":
        """Return some of them."""
        return take(self, kept)

    def errors(self, poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "e 6"]:
        """Return how far each is from what the poses say: translation (3, metres), rotation (3, radians)."""
        found = inverse(poses[self.first]) @ poses[self.second]
        off = inverse(self.measured) @ found
        return np.concatenate([off[:, :3, 3], rotation_vectors(off)], axis=1)


def optimise(poses: Float[np.ndarray, "n 4 4"], edges: Edges) -> Float[np.ndarray, "n 4 4"]:
    """Return the poses that fit the edges best; the first stays where it is."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spsolve

    count, found = len(poses), poses.copy()
    scale = 1.0 / np.repeat(np.stack([edges.sigma_m, edges.sigma_rad], axis=1), 3, axis=1)
    row = np.arange(6 * len(edges)).reshape(-1, 6)
    columns = [6 * ends[:, None] + np.arange(6) for ends in (edges.first, edges.second)]
    free = np.arange(6 * count - 6)
    damping = csc_matrix((np.full(len(free), 1e-9), (free, free)), shape=(len(free), len(free)))
    for _ in range(_STEPS):
        error = edges.errors(found) * scale
        weight = np.where(edges.is_closure, 1.0 / (1.0 + (error**2).sum(axis=1) / 6.0), 1.0)
        root = np.sqrt(weight)[:, None]
        of_first, of_second = _slopes(found, edges)
        values = [slope * (scale * root)[:, :, None] for slope in (of_first, of_second)]
        slope = csc_matrix(
            (
                np.concatenate([one.ravel() for one in values]),
                (
                    np.concatenate([np.repeat(row, 6, axis=1).ravel()] * 2),
                    np.concatenate([np.tile(column, (1, 6)).ravel() for column in columns]),
                ),
            ),
            shape=(6 * len(edges), 6 * count),
        )[:, 6:]
        step = -spsolve(slope.T @ slope + damping, slope.T @ (error * root).ravel()).reshape(-1, 6)
        found[1:] = found[1:] @ motions(step)
        if np.abs(step).max(initial=0.0) < _STILL:
            break
    return found


def _slopes(poses: Float[np.ndarray, "n 4 4"], edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """Return how errors change with small motions of both poses, in their own frames: (e, 6, 6) each.

    Of the rotation's logarithm the slope is taken at 0, which is exact where the edges fit.
    """
    off = inverse(edges.measured) @ inverse(poses[edges.first]) @ poses[edges.second]
    between = inverse(poses[edges.second]) @ poses[edges.first]  # of a motion of i, seen from j
    second = np.zeros((len(edges), 6, 6))
    second[:, :3, :3], second[:, 3:, 3:] = off[:, :3, :3], np.eye(3)
    carried = np.zeros((len(edges), 6, 6))
    turn = between[:, :3, :3]
    carried[:, :3, :3], carried[:, 3:, 3:] = turn, turn
    carried[:, :3, 3:] = crosses(between[:, :3, 3]) @ turn
    return -second @ carried, second


def crosses(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Return the matrices of the cross product with each vector."""
    out = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    return out - np.swapaxes(out, 1, 2)


def rotation_vectors(transforms: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 3"]:
    """Return the rotations as axis times angle, radians."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(transforms[:, :3, :3]).as_rotvec()


def motions(steps: Float[np.ndarray, "n 6"]) -> Float[np.ndarray, "n 4 4"]:
    """Return small motions: a translation, metres, and a rotation as axis times angle."""
    from scipy.spatial.transform import Rotation

    out = np.tile(np.eye(4), (len(steps), 1, 1))
    out[:, :3, :3] = Rotation.from_rotvec(steps[:, 3:]).as_matrix()
    out[:, :3, 3] = steps[:, :3]
    return out
