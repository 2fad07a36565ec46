"""A small scene that the tests of the readers write in each format: five pictures of 64x48, of which all is known."""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig

CAMERA = Pinhole(fx=60.0, fy=61.0, cx=32.0, cy=24.0, width=64, height=48)


@dataclass(frozen=True)
class Shot:
    rgb: np.ndarray
    depth_mm: np.ndarray
    world_from_camera: np.ndarray


def shot(index: int, camera: Pinhole = CAMERA, depth_camera: Pinhole | None = None) -> Shot:
    """Colour that tells its place and number, a slanted floor of depth with a hole, a pose on a winding path."""
    depth_camera = depth_camera or camera
    v, u = np.mgrid[: camera.height, : camera.width]
    rgb = np.stack([u * 3 % 256, v * 5 % 256, np.full_like(u, 40 * index % 256)], axis=-1).astype(np.uint8)
    rows = np.arange(depth_camera.height)[:, None] * np.ones((1, depth_camera.width))
    depth_mm = (1000 + 10 * rows + 7 * index).astype(np.uint16)
    depth_mm[:4, :4] = 0
    angle = 0.2 * index
    quaternion = np.array([0.1 * np.sin(angle), np.sin(angle / 2), 0.05, np.cos(angle / 2)])
    pose = poses.from_quaternion(
        np.array([0.1 * index, 0.5, 1.0 + 0.02 * index]), quaternion / np.linalg.norm(quaternion)
    )
    return Shot(rgb, depth_mm, pose)


def shots(count: int = 5, **cameras: Pinhole) -> list[Shot]:
    return [shot(index, **cameras) for index in range(count)]


def metres(depth_mm: np.ndarray) -> np.ndarray:
    return depth_mm.astype(np.float32) / np.float32(1000.0)


def save_rgb(path: Path, rgb: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    options = [cv2.IMWRITE_JPEG_QUALITY, 98] if path.suffix == ".jpg" else []
    assert cv2.imwrite(str(path), rgb[..., ::-1], options)


def save_depth(path: Path, raw: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), raw.astype(np.uint16))


def pose_line(world_from_camera: np.ndarray) -> str:
    quaternion = poses.to_quaternion(world_from_camera[None])[0]
    return " ".join(repr(float(x)) for x in (*world_from_camera[:3, 3], *quaternion))


def write_folder(path: Path, count: int = 5, rate_hz: float = 10.0) -> Path:
    """Our own format as a stranger would write it by hand: recording.json, rgb/, depth/, poses.csv and no more."""
    c = CAMERA
    path.mkdir(parents=True)
    intrinsics = {"rgb": {"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, "width": c.width, "height": c.height}}
    described = {"schema_version": 1, "intrinsics": intrinsics, "up_in_world": [0, 0, 1]}
    (path / "recording.json").write_text(json.dumps(described))
    lines = ["stamp_s,tx,ty,tz,qx,qy,qz,qw"]
    for index, taken in enumerate(shots(count)):
        save_rgb(path / "rgb" / f"{index:06d}.png", taken.rgb)
        save_depth(path / "depth" / f"{index:06d}.png", taken.depth_mm)
        lines.append(f"{index / rate_hz!r}," + pose_line(taken.world_from_camera).replace(" ", ","))
    (path / "poses.csv").write_text("\n".join(lines) + "\n")
    return path


def write_seven_scenes(path: Path, numbers: tuple[int, ...] = (0, 2, 4, 6, 8)) -> Path:
    path.mkdir(parents=True)
    c = CAMERA
    np.savetxt(path / "camera-intrinsics.txt", [[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]])
    for index, number in enumerate(numbers):
        taken = shot(index)
        save_rgb(path / f"frame-{number:06d}.color.png", taken.rgb)
        save_depth(path / f"frame-{number:06d}.depth.png", taken.depth_mm)
        np.savetxt(path / f"frame-{number:06d}.pose.txt", taken.world_from_camera)
    return path


def rig() -> Rig:
    return Rig(CAMERA, CAMERA)
