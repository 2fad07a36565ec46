"""A room walked in the AVLMaps layout, and the map that the published code makes of it, worked out the long way.

Everything is written from the formulas of that code: a Python loop over points, ``int()`` for cells, its running mean.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import cv2
import h5py
import numpy as np
import soundfile

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.formats.layouts import WORLD_FROM_HABITAT, base_from_camera
from avlmaps.recordings.types import Frame
from helpers.raycast import ROOM, View, render
from helpers.room import Room

CAMERA = Pinhole(24.0, 24.0, 24.0, 16.0, 48, 32)  # 90 degrees, as the data set
CELL_M = 0.1
GRID = 300
ROOM_3D = Room(camera_height_m=1.5)
# The room stands turned and far from the origin of the recording's world.
WORLD_FROM_ROOM = poses.from_quaternion(np.array([-3.1, 4.7, -1.28]), np.array([0.0, 0.0, np.sin(0.27), np.cos(0.27)]))
NAMES = [thing.category for thing in ROOM_3D.things for _ in thing.parts]
WORDS = sorted({*NAMES, "wall"})
CODES = np.linalg.qr(np.random.default_rng(5).normal(size=(512, len(WORDS))))[0].T.astype(np.float32)


@dataclass(frozen=True)
class Seen:
    view: View
    habitat_from_base: np.ndarray

    @property
    def words(self) -> np.ndarray:
        """The number of the word for what each pixel shows."""
        lookup = np.array([WORDS.index(name) for name in NAMES] + [WORDS.index("wall")])
        assert ROOM == -1
        return lookup[self.view.box]


def walk(count: int = 14) -> list[Seen]:
    """Views of an upright robot from all over the room, the first of them at an angle to every wall."""
    inverse_camera = poses.inverse(base_from_camera())
    seen = []
    for number, pose in enumerate(ROOM_3D.walk(pitch_deg=0.0)[:: len(ROOM_3D.walk()) // count][:count]):
        room_from_camera = ROOM_3D.pose(*pose[:2, 3], heading_rad=0.4 + 1.3 * number)
        world_from_camera = WORLD_FROM_ROOM @ room_from_camera
        habitat_from_base = poses.inverse(WORLD_FROM_HABITAT) @ world_from_camera @ inverse_camera
        seen.append(Seen(render(ROOM_3D.scene, CAMERA, room_from_camera), habitat_from_base))
    return seen


def write_scene(folder: Path, seen: list[Seen]) -> Path:
    """Write the recording in the data set's layout."""
    lines = []
    for number, one in enumerate(seen):
        for name in ("rgb", "depth"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        assert cv2.imwrite(str(folder / f"rgb/{number:06d}.png"), one.view.rgb[..., ::-1])
        np.save(folder / f"depth/{number:06d}.npy", one.view.depth_m)
        quaternion = poses.to_quaternion(one.habitat_from_base)
        lines.append(" ".join(repr(float(x)) for x in (*one.habitat_from_base[:3, 3], *quaternion)))
    (folder / "poses.txt").write_text("\n".join(lines) + "\n")
    return folder


def reference_arrays(seen: list[Seen], cell_m: float = CELL_M, grid: int = GRID) -> dict[str, np.ndarray]:
    """Fuse as the published code does, with every pixel and one feature for each kind of thing."""
    axes = np.array([[0, 0, -1, 0], [-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)  # forward, left, up
    base_to_cam = np.array([[1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, -1, 0], [0, 0, 0, 1]], float)
    layers = int(1.5 / cell_m)
    bases = [axes @ one.habitat_from_base @ np.linalg.inv(axes) for one in seen]
    occupied = -np.ones((grid, grid, layers), np.int32)
    feats: list[np.ndarray] = []
    cells: list[list[int]] = []
    weights: list[float] = []
    colours: list[np.ndarray] = []
    for one, base in zip(seen, bases, strict=True):
        chain = np.linalg.inv(bases[0]) @ base @ axes @ base_to_cam
        for v in range(CAMERA.height):
            for u in range(CAMERA.width):
                z = float(one.view.depth_m[v, u])
                if not 0.1 < z < 6.0:
                    continue
                local = z * np.array([(u + 0.5 - CAMERA.cx) / CAMERA.fx, (v + 0.5 - CAMERA.cy) / CAMERA.fy, 1.0])
                x, y, up = (chain @ [*local, 1.0])[:3]
                row, col, h = int(grid / 2 - int(x / cell_m)), int(grid / 2 - int(y / cell_m)), int(up / cell_m)
                if not (0 <= row < grid and 0 <= col < grid and 0 <= h < layers):
                    continue
                alpha = np.exp(-np.sum(local**2) / 1.2)
                feat = CODES[one.words[v, u]] / 0.07
                number = occupied[row, col, h]
                if number == -1:
                    occupied[row, col, h] = len(feats)
                    feats.append(feat * alpha)
                    cells.append([row, col, h])
                    weights.append(alpha)
                    colours.append(one.view.rgb[v, u].astype(float))
                else:
                    total = weights[number] + alpha
                    feats[number] = (feats[number] * weights[number] + feat * alpha) / total
                    colours[number] = np.floor((colours[number] * weights[number] + one.view.rgb[v, u] * alpha) / total)
                    weights[number] = total
    return {
        "mapped_iter_list": np.arange(len(seen), dtype=np.int32),
        "grid_feat": np.array(feats, np.float32),
        "grid_pos": np.array(cells, np.int32),
        "weight": np.array(weights, np.float32),
        "occupied_ids": occupied,
        "grid_rgb": np.array(colours, np.uint8),
    }


def one_voxel(grid: int = 8, layers: int = 4, cell: tuple[int, int, int] = (2, 3, 1)) -> dict[str, np.ndarray]:
    """A map of one voxel, in the types that a doubled storage leaves."""
    return {
        "mapped_iter_list": np.zeros(1, np.int32),
        "grid_feat": np.full((1, 512), 3.0, np.float32),
        "grid_pos": np.array([cell], np.int32),
        "weight": np.ones(1, np.float64),
        "occupied_ids": np.full((grid, grid, layers), -1, np.int32),
        "grid_rgb": np.full((1, 3), 200.0, np.float32),
    }


def area_arrays(seen: list[Seen]) -> dict[str, np.ndarray]:
    """One unit feature for each frame, and its base pose."""
    view = np.random.default_rng(6).normal(size=(len(seen), 768)).astype(np.float32)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    return {"clip_sparse_map": view, "robot_pose_list": np.array([one.habitat_from_base for one in seen])}


def write_h5(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array)
    return path


class KnowsTheRoom:
    """Stands in for LSeg: it knows which thing each pixel of the frames in ``seen`` shows."""

    seen: ClassVar[list[Seen]] = []
    card = ModelCard("demo_e200.ckpt", 512, "MIT", "0123456789abcdef")
    vocabulary = tuple(WORDS)

    def __init__(self, model: str = "demo_e200.ckpt") -> None:
        assert model == self.card.id

    def encode(self, frame: Frame) -> np.ndarray:
        return CODES[self.seen[frame.index].words]

    def encode_words(self, words: list[str]) -> np.ndarray:
        spare = np.full(512, 512**-0.5, np.float32)
        return np.array([CODES[WORDS.index(word)] if word in WORDS else spare for word in words], np.float32)

    def understood(self, word: str) -> str:
        return word


class HearsPitch:
    """A sound model of two features: how low, and how high."""

    card = ModelCard("tests/pitch-1", 2, "MIT", "fedcba9876543210")
    vocabulary = ("low", "high")

    def encode(self, sound: Sound) -> np.ndarray:
        spectrum = np.abs(np.fft.rfft(sound.samples))
        pitch = spectrum.argmax() * sound.rate_hz / len(sound.samples)
        return np.array([[1.0, 0.0] if pitch < 1000.0 else [0.0, 1.0]], np.float32)

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.array([[word == "low", word == "high"] for word in words], np.float32)

    def score_words(self, sounds: list[np.ndarray], words: list[str]) -> np.ndarray:
        return np.array([sound.max(axis=0) for sound in sounds]) @ self.encode_words(words).T


def write_walk(folder: Path, seen: list[Seen], beeps: dict[float, float], track: str, rate_hz: int = 22050) -> Path:
    """Write a walk below audio_video/: 25 frames/s, and a track with a second of tone at each onset."""
    write_scene(folder, seen)
    shutil.rmtree(folder / "depth")
    rng = np.random.default_rng(0)
    samples = 0.0002 * rng.standard_normal(rate_hz * 6)
    t = np.arange(rate_hz) / rate_hz
    for onset_s, pitch_hz in beeps.items():
        start = int(onset_s * rate_hz)
        samples[start : start + rate_hz] += 0.3 * np.sin(2 * np.pi * pitch_hz * t)
    soundfile.write(folder / track, samples, rate_hz)
    return folder
