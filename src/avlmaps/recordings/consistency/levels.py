"""Whether floors stay level while the camera turns: they do not where the camera sits otherwise in its mount than said.

Seen by a camera that is said to look level and looks down, the floor rises ahead of it, whichever way it looks. In the
world such a floor is a cone, though neighbouring frames agree; one small rotation of the camera makes it level in all.
A slope or a wrong up direction lies one way in the world and turns in the camera's axes.
"""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.camera import Pinhole
from avlmaps.recordings.consistency.sample import Sample

# Normals are measured over this many pixels to each side, on surface that bends by less than this share of its depth.
_SIDE, _BENT, _ALL = 3, 0.06, 0.99
_FARTHEST_M = 5.0
# Level surface: normals within this angle of up, then of their own mean; at least 60 of a frame, in 8 frames.
_LEVEL_RAD, _ALIKE_RAD, _FEWEST_NORMALS, _FEWEST_FRAMES = np.radians(25.0), np.radians(12.0), 60, 8
_ROUNDS = 4
# Turns that change how floors lie by less, as a share of those that change it most, are not separated from a slope.
_WEAKEST = 0.1
# Least tilt, and least angle by which floors are off, that is a doubt; the share of it that the tilt leaves at most.
# In right recordings (9 of rendered homes, 12 of a Kinect, 38 drawn walks) floors are off by up to 1.8 degrees. Where a
# mount is off by 4 degrees, on a walk that turns right round, they are off by 4.6, and by 0.2 without it.
_LEAST_TILT_DEG, _LEAST_OFF_DEG, _MOST_LEFT = 4.0, 2.5, 0.5
_SHOWN_DEG = 6.0


@dataclass(frozen=True, slots=True)
class Tilt:
    """How a camera sits in its mount, by the floors that it sees.

    Attributes:
        off_deg: how far floors are off level, the middle of the frames, with the best up direction.
        left_deg: the same if the camera is turned as follows.
        down_deg: how much farther down the camera looks than its poses say; negative: farther up.
        right_deg: by how much its right side hangs lower than its poses say; negative: higher.
    """

    off_deg: float
    left_deg: float
    down_deg: float
    right_deg: float

    @property
    def is_sure(self) -> bool:
        """Whether it explains how floors lie, and nothing else does."""
        tilted = np.hypot(self.down_deg, self.right_deg) >= _LEAST_TILT_DEG
        return bool(tilted and self.off_deg >= _LEAST_OFF_DEG and self.left_deg <= _MOST_LEFT * self.off_deg)


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Level surface in the frames of a sample.

    Attributes:
        world_from_camera: (f, 3, 3) rotations of the frames in which there is enough.
        up: (f, 3) its normal there, in the camera's axes.
    """

    world_from_camera: Float[np.ndarray, "f 3 3"]
    up: Float[np.ndarray, "f 3"]

    @property
    def tilt(self) -> Tilt | None:
        """How the camera sits otherwise in its mount than its poses say; None where floors show nothing of it."""
        if len(self.up) < _FEWEST_FRAMES:
            return None
        tilt = np.zeros(3, np.float64)
        for _ in range(_ROUNDS):
            tilt = tilt + self._further(_turned(self.up, tilt))
        down, right = np.degrees(-tilt[0]), np.degrees(tilt[2])
        found = Tilt(self._off_deg(np.zeros(3)), self._off_deg(tilt), float(down), float(right))
        return found if found.is_sure else None

    @property
    def would_show(self) -> bool:
        """Whether a camera that is tilted by 6 degrees to any side would be noticed."""
        return all(
            Levels(self.world_from_camera @ _rotation(axis, side * _SHOWN_DEG), self.up).tilt is not None
            for axis in (0, 2)
            for side in (-1.0, 1.0)
        )

    def _further(self, seen: Float[np.ndarray, "f 3"]) -> Float[np.ndarray, "3"]:
        """Return the small rotation of the camera, and so of what it saw, that brings floors nearest to one up."""
        world = np.einsum("fij,fj->fi", self.world_from_camera, seen)
        across = -np.einsum("fij,fjk->fik", self.world_from_camera, _cross_matrices(seen))
        others = np.broadcast_to(-np.eye(3), across.shape)  # the up direction changes as well
        unknown: Float[np.ndarray, "m 6"] = np.concatenate([across, others], axis=2).reshape(-1, 6)
        off: Float[np.ndarray, " m"] = (_unit(world.mean(axis=0)) - world).reshape(-1)
        found, *_ = np.linalg.lstsq(unknown, off, rcond=_WEAKEST)
        return found[:3]

    def _off_deg(self, tilt: Float[np.ndarray, "3"]) -> float:
        world = np.einsum("fij,fj->fi", self.world_from_camera, _turned(self.up, tilt))
        return float(np.degrees(np.median(np.arccos(np.clip(world @ _unit(world.mean(axis=0)), -1.0, 1.0)))))


def find_levels(sample: Sample) -> Levels:
    """Find level surface in each frame."""
    rotation = sample.world_from_camera[:, :3, :3]
    normals = [_normals(depth_m, sample.rig.depth) for depth_m in sample.depth_m]
    up = _unit(-rotation[:, :, 1].mean(axis=0))
    rows: list[int] = []
    found: list[np.ndarray] = []
    for _ in range(2):  # the second time from the up direction that the first one found
        levels = [_level(some, turn.T @ up) for some, turn in zip(normals, rotation, strict=True)]
        rows = [row for row, level in enumerate(levels) if level is not None]
        found = [level for level in levels if level is not None]
        if found:
            up = _unit(np.einsum("fij,fj->fi", rotation[rows], np.stack(found)).mean(axis=0))
    return Levels(rotation[rows], np.array(found).reshape(-1, 3))


def _normals(depth_m: Float32[np.ndarray, "h w"], camera: Pinhole) -> Float[np.ndarray, "n 3"]:
    """Return unit normals of smooth surface in the camera's axes, which point away from the camera.

    The inverse of a plane's depth is linear in pixels, and so even the noise of a depth camera tilts none to one side.
    """
    import cv2

    height, width = depth_m.shape
    if min(height, width) <= 2 * _SIDE:
        return np.zeros((0, 3))
    known = (depth_m > 0.0).astype(np.float32)
    inverse = np.divide(1.0, depth_m, out=np.zeros_like(depth_m), where=depth_m > 0.0)
    whole = cv2.blur(known, (3, 3)) > _ALL
    inverse = np.where(whole, cv2.blur(inverse, (3, 3)), np.nan).astype(np.float64)
    s = _SIDE
    middle, left, right = inverse[s:-s, s:-s], inverse[s:-s, : -2 * s], inverse[s:-s, 2 * s :]
    above, below = inverse[: -2 * s, s:-s], inverse[2 * s :, s:-s]
    x, y = np.moveaxis(camera.rays()[s:-s, s:-s, :2], 2, 0)
    along_x, along_y = (right - left) * camera.fx / (2.0 * s), (below - above) * camera.fy / (2.0 * s)
    bent = np.maximum(np.abs(left + right - 2.0 * middle), np.abs(above + below - 2.0 * middle))
    smooth = (middle * _FARTHEST_M > 1.0) & (bent < _BENT * middle)
    normal = np.stack([along_x, along_y, middle - along_x * x - along_y * y], axis=-1)[smooth]
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)


def _level(normals: Float[np.ndarray, "n 3"], up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"] | None:
    """Return the mean direction of level surface, up or down, in the camera's axes; None where there is too little."""
    upwards = normals * np.sign(normals @ up)[:, None]
    mean, least = up, np.cos(_LEVEL_RAD)
    for _ in range(_ROUNDS):
        near = upwards[upwards @ mean > least]
        if len(near) < _FEWEST_NORMALS:
            return None
        mean, least = _unit(near.mean(axis=0)), np.cos(_ALIKE_RAD)
    return mean


def _turned(vectors: Float[np.ndarray, "n 3"], by_rad: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3"]:
    """Return unit vectors turned by a small rotation vector."""
    turned = vectors + np.cross(by_rad, vectors)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def _rotation(axis: int, degrees: float) -> Float[np.ndarray, "3 3"]:
    """Return a rotation about one axis of the camera."""
    import cv2

    return np.asarray(cv2.Rodrigues(np.radians(degrees) * np.eye(3)[axis])[0], np.float64)


def _unit(vector: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def _cross_matrices(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Return the matrices that take another vector to the cross product of each of these with it."""
    return -np.cross(vectors[:, None, :], np.eye(3)[None])
