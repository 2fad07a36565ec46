"""A room with painted walls that is rendered by formula: pictures with exact depth and poses, quick and seeded."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.poses import inverse
from avlmaps.recordings.types import Frame, Recording

SIZE_M = np.array([4.0, 3.0, 2.5])
BOX_LOW, BOX_HIGH = np.array([1.6, 1.2, 0.0]), np.array([2.2, 1.7, 0.8])
CAMERA = Pinhole(260.0, 260.0, 160.0, 120.0, 320, 240)
_TEXEL_M = 0.008


def painting(rng: np.random.Generator, rows: int = 512, columns: int = 512, shapes: int = 700) -> np.ndarray:
    """Return a picture of random ellipses and rectangles of all sizes."""
    picture = np.full((rows, columns, 3), 128, np.uint8)
    for _ in range(shapes):
        colour = tuple(int(value) for value in rng.integers(0, 256, 3))
        centre = rng.uniform(0, (columns, rows)).astype(int)
        half = np.maximum(2, rng.exponential(columns / 40, 2)).astype(int)
        if rng.random() < 0.5:
            cv2.ellipse(picture, centre.tolist(), half.tolist(), rng.uniform(0, 180), 0, 360, colour, -1, cv2.LINE_AA)
        else:
            cv2.rectangle(picture, (centre - half).tolist(), (centre + half).tolist(), colour, -1)
    return picture


def looking(eye: tuple[float, float, float], at: tuple[float, float, float]) -> np.ndarray:
    """Return world_from_camera of a level camera."""
    forward = np.subtract(at, eye) / np.linalg.norm(np.subtract(at, eye))
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = eye
    return pose


@dataclass(frozen=True)
class Room:
    """Six painted walls and a painted box."""

    seed: int = 0

    @property
    def walls(self) -> list[np.ndarray]:
        return _walls(self.seed)

    def render(self, world_from_camera: np.ndarray, camera: Pinhole = CAMERA) -> tuple[np.ndarray, np.ndarray]:
        """Return the colours and the exact z-depths at pixel centres; paint is as soft as a pixel at 2 m is wide."""
        eye = world_from_camera[:3, 3]
        rays = camera.rays() @ world_from_camera[:3, :3].T
        rays = np.where(np.abs(rays) < 1e-12, 1e-12, rays)
        out = np.maximum((0.0 - eye) / rays, (SIZE_M - eye) / rays)  # where each pair of walls is met
        depth, axis = out.min(axis=-1), out.argmin(axis=-1)
        near, far = np.sort(np.stack([(BOX_LOW - eye) / rays, (BOX_HIGH - eye) / rays]), axis=0)
        enter = near.max(axis=-1)
        on_box = (enter > 0) & (enter < far.min(axis=-1))
        depth, axis = np.where(on_box, enter, depth), np.where(on_box, near.argmax(axis=-1), axis)
        hit = eye + rays * depth[..., None]
        picture = np.zeros((*depth.shape, 3), np.uint8)
        for number, wall in enumerate(self.walls):
            high = hit[..., number // 2] > 0.5 * (SIZE_M[number // 2])
            mine = (axis == number // 2) & (high == bool(number % 2))
            across = [a for a in range(3) if a != number // 2]
            # The box wears the walls' paint, shifted, so that it looks like nothing else in the room.
            shift = np.where(on_box[mine], 2.9, 0.0)[:, None]
            texel = ((hit[mine][:, across] + shift) / _TEXEL_M).astype(np.float32) % 511
            picture[mine] = between_texels(wall, texel)
        return picture, depth.astype(np.float32)


@cache
def _walls(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [cv2.GaussianBlur(painting(rng), (0, 0), 0.8) for _ in range(6)]


def between_texels(picture: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Return bilinear samples at (n, 2) places within a picture."""
    column, row = np.floor(xy).astype(int).T
    right, down = (xy - np.floor(xy)).T[..., None]
    above = picture[row, column] * (1 - right) + picture[row, column + 1] * right
    below = picture[row + 1, column] * (1 - right) + picture[row + 1, column + 1] * right
    return (above * (1 - down) + below * down).round().astype(np.uint8)


class RoomWalk(Recording):
    """Around the room, looking across it; registered depth unless another rig is given."""

    def __init__(self, frames: int = 24, *, seed: int = 0, rig: Rig | None = None, turn: float = 1.0) -> None:
        self.path, self.format = Path("room"), "fake"
        self.rig = rig or Rig(CAMERA, CAMERA)
        self.room = Room(seed)
        self.stamps_s = np.arange(frames) * 0.2
        angle = np.linspace(0.0, 2.0 * np.pi * turn, frames, endpoint=False)
        self.world_from_camera = np.stack([_round_the_room(a) for a in angle])
        self.up_in_world = np.array([0.0, 0.0, 1.0])
        self.audio, self.notices = None, ()

    fingerprint = "room"

    def frame(self, index: int) -> Frame:
        world_from_depth = self.world_from_camera[index]
        rgb, depth_m = self.room.render(world_from_depth @ inverse(self.rig.rgb_from_depth), self.rig.rgb)
        if depth_m.shape != (self.rig.depth.height, self.rig.depth.width) or not self.rig.registered:
            depth_m = self.room.render(world_from_depth, self.rig.depth)[1]
        return Frame(index, f"{index:06d}", float(self.stamps_s[index]), rgb, depth_m, world_from_depth, self.rig)


def _round_the_room(angle: float) -> np.ndarray:
    eye = (2.0 + 1.3 * np.cos(angle), 1.5 + 0.9 * np.sin(angle), 1.4 + 0.1 * np.sin(3 * angle))
    return looking(eye, (2.0 - 2.0 * np.cos(angle + 0.4), 1.5 - 1.5 * np.sin(angle + 0.4), 1.0))


def distance_to_surface_m(points: np.ndarray) -> np.ndarray:
    """Return how far points are from the nearest wall or face of the box."""
    walls = np.abs(np.stack([points, points - SIZE_M])).min(axis=(0, 2))
    outside = np.maximum(np.maximum(BOX_LOW - points, points - BOX_HIGH), 0.0)
    inside = np.minimum(points - BOX_LOW, BOX_HIGH - points).min(axis=1)
    box = np.where(inside > 0.0, inside, np.linalg.norm(outside, axis=1))
    return np.minimum(walls, box)
