"""What mirrors reflect: which flat mirrors a view shows, and the camera as they turn it round."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int32

_FEWEST_PIXELS = 24  # mirrors that show fewer pixels are not worth another view
_MOST = 4  # planes of one view: a wardrobe's doors lie in one
_ROUGH = 1e-3  # metres: what lies no farther in front of a mirror than this lies in its glass


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A plane: the points x with normal · x = offset; the normal points to the camera's side.

    Attributes:
        normal: unit vector, world.
        offset_m: metres.
    """

    normal: Float[np.ndarray, "3"]
    offset_m: float


def planes_shown(
    shown: Int32[np.ndarray, " n"],
    mirror: Bool[np.ndarray, " t"],
    corner: Float32[np.ndarray, "t 9"],
    normal: Float32[np.ndarray, "t 3"],
    origin: Float[np.ndarray, "3"],
) -> list[tuple[Int[np.ndarray, " m"], Plane]]:
    """Return the planes of the mirrors that a view shows, the largest first, and each one's pixels.

    ``shown`` is the triangle of each pixel, -1 for none.
    """
    pixels = np.flatnonzero((shown >= 0) & mirror[shown])
    if not len(pixels):
        return []
    triangle = shown[pixels]
    across = normal[triangle].astype(np.float64)
    offset = np.einsum("ni,ni->n", across, corner[triangle, :3].astype(np.float64))
    side = np.where(across @ origin - offset >= 0, 1.0, -1.0)
    across, offset = across * side[:, None], offset * side
    key = np.column_stack([np.rint(across * 200), np.rint(offset * 100)]).astype(np.int64)
    _, first, which, count = np.unique(key, axis=0, return_index=True, return_inverse=True, return_counts=True)
    which = which.reshape(-1)
    return [
        (pixels[which == number], Plane(across[first[number]], float(offset[first[number]])))
        for number in np.argsort(-count, kind="stable")[:_MOST]
        if count[number] >= _FEWEST_PIXELS
    ]


def reflected(
    plane: Plane, rotation: Float[np.ndarray, "3 3"], shift: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """Return ``camera from world`` for a world that is reflected in a plane; the rotation then has determinant -1."""
    turned = np.eye(3) - 2.0 * np.outer(plane.normal, plane.normal)
    return rotation @ turned, shift + rotation @ (2.0 * plane.offset_m * plane.normal)


def in_front_of(
    plane: Plane, corner: Float32[np.ndarray, "t 9"]
) -> tuple[Float32[np.ndarray, "t 9"], Float32[np.ndarray, "t 9"]]:
    """Return what of each triangle lies in front of a plane, as two triangles; either may have shrunk to a point.

    What lies behind a mirror, or in its glass, is not reflected. A triangle that has two corners in front leaves
    a quadrangle, hence the second.
    """
    at = corner.reshape(-1, 3, 3).astype(np.float64)
    height = at @ plane.normal - plane.offset_m
    ahead = height > _ROUGH
    count = ahead.sum(axis=1)
    first, second = corner.copy(), np.zeros_like(corner)
    first[count == 0] = 0.0
    one, two = np.flatnonzero(count == 1), np.flatnonzero(count == 2)
    (a, b, c), (ha, hb, hc) = _from_corner(ahead[one].argmax(axis=1), at[one], height[one])
    first[one] = np.concatenate([a, _cut(a, b, ha, hb), _cut(a, c, ha, hc)], axis=1)
    (c, a, b), (hc, ha, hb) = _from_corner(ahead[two].argmin(axis=1), at[two], height[two])
    right, left = _cut(b, c, hb, hc), _cut(a, c, ha, hc)
    first[two] = np.concatenate([a, b, right], axis=1)
    second[two] = np.concatenate([a, right, left], axis=1)
    return first, second


def _from_corner(
    start: Int[np.ndarray, " n"], at: Float[np.ndarray, "n 3 3"], height: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "3 n 3"], Float[np.ndarray, "3 n 1"]]:
    rows, turn = np.arange(len(start)), [(start + k) % 3 for k in range(3)]
    return np.stack([at[rows, k] for k in turn]), np.stack([height[rows, k] for k in turn])[..., None]


def _cut(
    ahead: Float[np.ndarray, "n 3"], behind: Float[np.ndarray, "n 3"], above: np.ndarray, below: np.ndarray
) -> Float[np.ndarray, "n 3"]:
    return ahead + (behind - ahead) * (above / (above - below))
