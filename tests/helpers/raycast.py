"""Rendering a room of axis-aligned boxes by casting one ray a pixel: colour, depth and which box was hit.

Surfaces carry a solid texture (value noise in world coordinates), so that keypoints have something to hold on to.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int16, UInt8
from numba import njit

from avlmaps.core.camera import Pinhole

ROOM = -1  # the box index of walls, floor and ceiling


@dataclass(frozen=True, slots=True)
class Scene:
    """Boxes in a room, world frame, metres; the room is the inside of a box itself.

    Attributes:
        room: (2, 3) lowest and highest corner of the room.
        boxes: (n, 2, 3) lowest and highest corner of each box.
        colours: (n, 3) linear colour of each box, in [0, 1].
        roughness: (n,) contrast of the texture, in [0, 1].
        room_colours: (3, 3) colours of floor, walls and ceiling.
    """

    room: Float64[np.ndarray, "2 3"]
    boxes: Float64[np.ndarray, "n 2 3"]
    colours: Float64[np.ndarray, "n 3"]
    roughness: Float64[np.ndarray, " n"]
    room_colours: Float64[np.ndarray, "3 3"]

    def __post_init__(self) -> None:
        if not (len(self.boxes) == len(self.colours) == len(self.roughness)):
            raise ValueError(f"{len(self.boxes)} boxes, {len(self.colours)} colours, {len(self.roughness)} roughnesses")
        if not (self.boxes[:, 0] < self.boxes[:, 1]).all():
            raise ValueError("a box's lowest corner must lie below its highest")


@dataclass(frozen=True, slots=True)
class View:
    """What the camera sees.

    Attributes:
        rgb: colour picture.
        depth_m: z-depth; every ray ends somewhere, so there is no 0.
        box: index of the box that each pixel shows, ``ROOM`` for the room itself.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    box: Int16[np.ndarray, "h w"]


def render(scene: Scene, camera: Pinhole, world_from_camera: Float64[np.ndarray, "4 4"]) -> View:
    """Render the scene from a pose inside the room.

    Raises:
        ValueError: the camera stands outside of the room.
    """
    eye = world_from_camera[:3, 3]
    if not ((eye > scene.room[0]).all() and (eye < scene.room[1]).all()):
        raise ValueError(f"the camera at {eye.round(3).tolist()} is outside of the room {scene.room.tolist()}")
    rgb = np.empty((camera.height, camera.width, 3), np.uint8)
    depth_m = np.empty((camera.height, camera.width), np.float32)
    box = np.empty((camera.height, camera.width), np.int16)
    intrinsics = (camera.fx, camera.fy, camera.cx, camera.cy)
    _cast(
        scene.room, scene.boxes, scene.colours, scene.roughness, scene.room_colours,
        intrinsics, np.ascontiguousarray(world_from_camera), rgb, depth_m, box,
    )  # fmt: skip
    return View(rgb, depth_m, box)


@njit(cache=True)
def _hash(x, y, z, salt):  # pragma: no cover - compiled
    h = np.uint32(x * 374761393) ^ np.uint32(y * 668265263) ^ np.uint32(z * 2147483647) ^ np.uint32(salt * 144269)
    h = np.uint32((h ^ (h >> np.uint32(13))) * np.uint32(1274126177))
    return np.float64(np.uint32(h ^ (h >> np.uint32(16))) & np.uint32(0xFFFF)) / 65535.0


@njit(cache=True)
def _noise(x, y, z, salt):  # pragma: no cover - compiled
    ix, iy, iz = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
    fx, fy, fz = x - ix, y - iy, z - iz
    total = 0.0
    for dx in range(2):
        for dy in range(2):
            for dz in range(2):
                weight = (fx if dx else 1 - fx) * (fy if dy else 1 - fy) * (fz if dz else 1 - fz)
                total += weight * _hash(ix + dx, iy + dy, iz + dz, salt)
    return total


@njit(cache=True)
def _texture(x, y, z, salt, depth, focal):  # pragma: no cover - compiled
    """Three octaves around 1; an octave finer than two pixels is left out, as a real lens would blur it."""
    total, norm = 0.0, 0.0
    frequency, amplitude = 5.0, 1.0
    for octave in range(3):
        if frequency * 2.0 * depth < focal:
            total += amplitude * (_noise(x * frequency, y * frequency, z * frequency, salt + octave) - 0.5)
        norm += amplitude
        frequency *= 2.7
        amplitude *= 0.8
    return 1.0 + 2.0 * total / norm


@njit(cache=True)
def _enter(box, eye, ray, limit):  # pragma: no cover - compiled
    """Return how far along the ray it enters the box, and through the face of which axis; axis -1 for a miss."""
    near, far, side = 0.0, limit, -1
    for a in range(3):
        if ray[a] == 0.0:
            if eye[a] < box[0, a] or eye[a] > box[1, a]:
                return 0.0, -1
            continue
        t0, t1 = (box[0, a] - eye[a]) / ray[a], (box[1, a] - eye[a]) / ray[a]
        if t0 > t1:
            t0, t1 = t1, t0
        if t0 > near:
            near, side = t0, a
        far = min(far, t1)
    return (near, side) if near < far else (0.0, -1)


@njit(cache=True)
def _nearest(room, boxes, eye, ray):  # pragma: no cover - compiled
    """Return distance along the ray, the box, and the axis of the face that is hit."""
    best, index, axis = 1e30, -1, 0
    for a in range(3):
        if ray[a] != 0.0:
            wall = room[1, a] if ray[a] > 0 else room[0, a]
            t = (wall - eye[a]) / ray[a]
            if t < best:
                best, axis = t, a
    for b in range(boxes.shape[0]):
        near, side = _enter(boxes[b], eye, ray, best)
        if side >= 0:
            best, index, axis = near, b, side
    return best, index, axis


@njit(cache=True)
def _cast(room, boxes, colours, roughness, room_colours, intrinsics, pose, rgb, depth_m, box):  # pragma: no cover
    fx, fy, cx, cy = intrinsics
    eye = pose[:3, 3].copy()
    ray = np.empty(3)
    for v in range(rgb.shape[0]):
        for u in range(rgb.shape[1]):
            dx, dy = (u + 0.5 - cx) / fx, (v + 0.5 - cy) / fy
            for a in range(3):
                ray[a] = pose[a, 0] * dx + pose[a, 1] * dy + pose[a, 2]
            t, index, axis = _nearest(room, boxes, eye, ray)
            x, y, z = eye[0] + t * ray[0], eye[1] + t * ray[1], eye[2] + t * ray[2]
            surface = (0 if ray[2] < 0 else 2) if axis == 2 else 1
            contrast = 0.5 if index < 0 else roughness[index]
            light = (1.0, 0.86, 1.0)[surface] if axis != 0 else 0.74
            shade = light * (1.0 + contrast * (_texture(x, y, z, 17 * (index + 2), t, fx) - 1.0))
            for c in range(3):
                value = room_colours[surface, c] if index < 0 else colours[index, c]
                rgb[v, u, c] = np.uint8(min(255.0, max(0.0, 255.0 * value * shade)))
            depth_m[v, u] = t
            box[v, u] = index
