"""A recording in memory, about to be written: the right ones come from here, and mistakes change them."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.poses import from_quaternion, to_quaternion
from avlmaps.recordings.conformance import see
from avlmaps.recordings.types import Recording

Picture = Any  # uint8 h w 3, or uint16 h w
_WIDTH = 160


@dataclass(frozen=True, slots=True)
class Draft:
    """A recording in memory.

    Depth is 16 bit, ``units_per_m``; written quaternions are off x y z w by ``quaternion_roll`` places, and ``keys`` go
    into its description.
    """

    name: str
    rig: Rig
    rgb: tuple[Picture, ...]
    depth: tuple[Picture, ...]
    poses: Float[np.ndarray, "n 4 4"]
    stamps_s: Float[np.ndarray, " n"]
    pose_stamps_s: Float[np.ndarray, " n"]
    units_per_m: float = 1000.0
    quaternion_roll: int = 0
    keys: dict[str, Any] = field(default_factory=dict[str, Any])

    def __len__(self) -> int:
        return len(self.rgb)

    @staticmethod
    def of(recording: Recording, name: str, index: Sequence[int]) -> "Draft":
        """Take frames of a recording; of large pictures a part of the pixels."""
        frames = [recording.frame(i) for i in index]
        step = max(1, recording.rig.depth.width // _WIDTH)
        stamps_s = np.array([frame.stamp_s for frame in frames]) - frames[0].stamp_s
        return Draft(
            name=name,
            rig=_thinned(recording.rig, step),
            rgb=tuple(_thinned_colour(frame.rgb, step) for frame in frames),
            depth=tuple(_millimetres(frame.depth_m[::step, ::step]) for frame in frames),
            poses=np.stack([frame.world_from_camera for frame in frames]),
            stamps_s=stamps_s,
            pose_stamps_s=stamps_s,
        )

    def write(self, path: Path) -> Path:
        """Write it in our own format."""
        for folder, pictures in (("rgb", self.rgb), ("depth", self.depth)):
            (path / folder).mkdir(parents=True)
            for number, picture in enumerate(pictures):
                write_picture(path / folder / f"{number:06d}.png", picture)
        names = [f"{number:06d},{float(stamp)!r}" for number, stamp in enumerate(self.stamps_s)]
        write_lines(path / "frames.csv", ["name,stamp_s", *names])
        quaternion = np.roll(to_quaternion(self.poses), self.quaternion_roll, axis=1)
        rows = np.column_stack([self.pose_stamps_s, self.poses[:, :3, 3], quaternion])
        lines = [",".join(repr(float(value)) for value in row) for row in rows]
        write_lines(path / "poses.csv", ["stamp_s,tx,ty,tz,qx,qy,qz,qw", *lines])
        cameras = {name: camera_numbers(camera) for name, camera in (("rgb", self.rig.rgb), ("depth", self.rig.depth))}
        between = {"rgb_from_depth": self.rig.rgb_from_depth.tolist()}
        described = {
            "schema_version": 1,
            "intrinsics": {**cameras, **between},
            "depth_units_per_m": self.units_per_m,
            **self.keys,
        }
        write_lines(path / "recording.json", [json.dumps(described)])
        return path


def _thinned(rig: Rig, step: int) -> Rig:
    d, rgb = rig.depth, rig.rgb
    size = (-(-d.width // step), -(-d.height // step))
    depth = Pinhole(d.fx / step, d.fy / step, (d.cx - 0.5) / step + 0.5, (d.cy - 0.5) / step + 0.5, *size)
    return Rig(rgb.resized(rgb.width // step, rgb.height // step), depth, rig.rgb_from_depth) if step > 1 else rig


def _thinned_colour(rgb: Picture, step: int) -> Picture:
    import cv2

    size = (rgb.shape[1] // step, rgb.shape[0] // step)
    return cv2.resize(rgb, size, interpolation=cv2.INTER_AREA) if step > 1 else rgb


def camera_numbers(camera: Pinhole) -> dict[str, float]:
    """Return the numbers of a camera by their names."""
    return {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}


def write_picture(path: Path, picture: Picture) -> None:
    """Write a colour or a depth picture as PNG."""
    import cv2

    path.parent.mkdir(parents=True, exist_ok=True)
    shown = picture[..., ::-1] if picture.ndim == 3 else picture
    content = cv2.imencode(".png", np.ascontiguousarray(shown), [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    path.write_bytes(content.tobytes())


def write_lines(path: Path, lines: Sequence[str]) -> None:
    """Write a file of text."""
    write_bytes_atomically(path, ("\n".join(lines) + "\n").encode())


def _millimetres(depth_m: Float[np.ndarray, "h w"]) -> Picture:
    return np.clip(np.rint(depth_m * 1000.0), 0, 65_535).astype(np.uint16)


@dataclass(frozen=True, slots=True)
class RoomWalk:
    """A walk through the ray-cast room."""

    name: str  # of it
    seed: int = 0  # of the path and the noise
    frames: int = 40  # how many
    rate_hz: float = 5.0  # frames a second
    turn_rad_s: float = 0.7  # how fast the camera turns
    round_rad_s: float = 0.25  # how fast it goes round the middle of the room; 0: it stands
    even: bool = False  # whether it turns evenly, and looks as far down all the time
    people: int = 0  # how many people walk about
    moved_chair: bool = False  # whether a chair stands elsewhere in the second half
    noise: float = 0.0  # of depth, in shares of the square of the distance in metres: a Kinect has 0.0019 or so
    holes: float = 0.0  # share of pixels without a depth
    drift: float = 0.0  # noise of each step of the poses, metres and tenths of a radian
    flicker: float = 0.0  # by how much the exposure changes

    def draft(self, camera: Pinhole | None = None) -> Draft:
        """Walk, look, and return what was recorded."""
        camera = camera or Pinhole(115.0, 115.0, 80.0, 60.0, 160, 120)
        rng = np.random.default_rng([self.seed, 33])
        stamps_s = np.arange(self.frames) / self.rate_hz
        truth = self._path(stamps_s, rng)
        rgb: list[Picture] = []
        depth: list[Picture] = []
        for at_s, pose in zip(stamps_s, truth, strict=True):
            colour, depth_m = see(camera, pose, self._boxes(float(at_s), float(stamps_s[-1]), pose))
            depth_m = depth_m + rng.normal(0.0, 1.0, depth_m.shape) * self.noise * depth_m**2
            depth_m[rng.random(depth_m.shape) < self.holes] = 0.0
            rgb.append(np.clip(colour * (1.0 + rng.uniform(-1.0, 1.0) * self.flicker), 0, 255).astype(np.uint8))
            depth.append(_millimetres(depth_m))
        poses = self._strayed(truth, rng)
        return Draft(self.name, Rig(camera, camera), tuple(rgb), tuple(depth), poses, stamps_s, stamps_s)

    def _path(self, stamps_s: Float[np.ndarray, " n"], rng: np.random.Generator) -> Float[np.ndarray, "n 4 4"]:
        start, nod, sway = rng.uniform(0.0, 2.0 * np.pi, 3)
        round_rad = start + self.round_rad_s * stamps_s
        swing = (not self.even) * 0.35 * np.sin(rng.uniform(0.7, 1.6) * stamps_s + sway)
        heading = rng.uniform(0.0, 2.0 * np.pi) + self.turn_rad_s * stamps_s + swing
        down = 0.25 + (not self.even) * 0.12 * np.sin(0.9 * stamps_s + nod)
        forward = np.stack([np.cos(heading) * np.cos(down), np.sin(heading) * np.cos(down), -np.sin(down)], axis=1)
        right = np.stack([np.sin(heading), -np.cos(heading), np.zeros_like(heading)], axis=1)
        poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
        poses[:, :3, :3] = np.stack([right, np.cross(forward, right), forward], axis=2)
        middle = np.stack(
            [3.0 + 0.8 * np.cos(round_rad), 2.0 + 0.6 * np.sin(round_rad), np.full(len(stamps_s), 1.3)], 1
        )
        poses[:, :3, 3] = middle
        return poses

    def _boxes(self, at_s: float, end_s: float, pose: Float[np.ndarray, "4 4"]) -> list[np.ndarray]:
        boxes: list[np.ndarray] = []
        for number in range(self.people):  # at walking pace, along the walls
            along = (0.9 * at_s + 2.1 * number + self.seed) % 8.0
            x, y = (0.9 + along, 0.6) if along < 4.0 else (8.9 - along, 3.2)
            person = np.array([[x - 0.22, y - 0.15, 0.0], [x + 0.22, y + 0.15, 1.7]])
            if np.linalg.norm(pose[:2, 3] - (x, y)) > 0.6:
                boxes.append(person)
        if self.moved_chair:
            x = 5.4 if at_s < 0.5 * end_s else 4.7
            boxes.append(np.array([[x - 0.25, 3.1, 0.0], [x + 0.25, 3.6, 0.9]]))
        return boxes

    def _strayed(self, truth: Float[np.ndarray, "n 4 4"], rng: np.random.Generator) -> Float[np.ndarray, "n 4 4"]:
        if not self.drift:
            return truth
        steps = np.linalg.inv(truth[:-1]) @ truth[1:]
        poses = [truth[0]]
        for step in steps:
            turn = rng.normal(0.0, 0.1 * self.drift, 3)
            off = from_quaternion(rng.normal(0.0, self.drift, (1, 3)), np.array([[*(0.5 * turn), 1.0]]))[0]
            poses.append(poses[-1] @ step @ off)
        return np.stack(poses)
