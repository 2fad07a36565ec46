"""Batches for training: random windows of rendered frames, mirrored, stretched, tilted and spoiled a little more."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from training.pixels.labels import CATEGORIES, UNLABELLED

from avlmaps.core.camera import Pinhole
from avlmaps.perception.embedded.geometry import channels

# A window's size. Twice as many pixels each way cost four times as much, and the network is short of training, not of
# detail (README.md): it is better shown four windows than one of twice the detail.
WIDTH, HEIGHT = 80, 64
# It is cut from a rendered picture of 320x240 with so many of its pixels across, or more.
FIELD_PX = 160
# A frame shows a category with at least so many of its 320x240 pixels.
FEWEST_PIXELS = 160
# How evenly categories are drawn: 0 each as often as any other, 1 as often as frames show it.
EVENNESS = 0.45
# Share of windows that are drawn from anywhere.
ANY_FRAME = 0.1
# Share of colour pictures whose channels are shuffled: leaves are mostly green and basins white, but not always.
STRANGE_COLOURS = 0.15


@dataclass(frozen=True)
class Frames:
    """One shard, mapped into memory."""

    depth: np.ndarray
    label: np.ndarray
    rgb: np.ndarray
    rgb_row: np.ndarray
    room: np.ndarray
    camera: np.ndarray

    @classmethod
    def open(cls, folder: Path) -> "Frames":
        """Map a shard's arrays; a shard that is replaced meanwhile stays readable."""
        names = ("depth", "label", "rgb", "rgb_row", "room", "camera")
        return cls(**{name: np.load(folder / f"{name}.npy", mmap_mode="r") for name in names})


@dataclass
class Batch:
    """Arrays for the network.

    Attributes:
        geometry: (n, 8, h, w).
        colour: (n, 3, h, w) in about −1 to 1, all zero where colour is withheld.
        label: (n, h/2, w/2).
        weight: (n, h/2, w/2) of each pixel in the loss.
        room: (n, rooms) share of the view in each kind.
    """

    geometry: np.ndarray
    colour: np.ndarray
    label: np.ndarray
    weight: np.ndarray
    room: np.ndarray


class Shards:
    """Draws frames from the shards in a folder; looks for new ones when told to."""

    def __init__(self, folder: Path) -> None:
        """Open the shards that are there."""
        self.folder = folder
        self._open: dict[str, tuple[int, Frames]] = {}
        self._shown: dict[str, tuple[int, dict[int, list[int]]]] = {}
        self._showing: dict[int, list[tuple[Frames, int]]] = {}
        self.refresh()

    def refresh(self) -> int:
        """Look for shards that are new; return how many frames there are."""
        found: dict[str, tuple[int, Frames]] = {}
        for folder in sorted(self.folder.glob("[0-9]*")):
            try:
                stamp = (folder / "about.json").stat().st_mtime_ns
                old = self._open.get(folder.name)
                found[folder.name] = old if old and old[0] == stamp else (stamp, Frames.open(folder))
            except OSError:  # it is being replaced at this moment
                continue
        for name, (stamp, frames) in found.items():
            if self._shown.get(name, (0, {}))[0] != stamp:
                self._shown[name] = (stamp, _shown(frames))
        showing: dict[int, list[tuple[Frames, int]]] = {}
        for name, (_, frames) in found.items():
            for category, indices in self._shown[name][1].items():
                showing.setdefault(category, []).extend((frames, index) for index in indices)
        self._open, self._showing = found, showing
        return sum(len(frames.depth) for _, frames in found.values())

    def draw(self, rng: np.random.Generator) -> tuple[Frames, int]:
        """Return a shard and the number of a frame in it."""
        _, frames = list(self._open.values())[int(rng.integers(len(self._open)))]
        return frames, int(rng.integers(len(frames.depth)))

    def draw_category(self, rng: np.random.Generator) -> tuple[Frames, int, int]:
        """Return a frame that shows a category drawn almost evenly, and that category; −1 for any frame.

        Three quarters of what a camera sees is walls and floors; a network that sees the world as it is learns those.
        """
        showing = self._showing
        if not showing or rng.random() < ANY_FRAME:
            return *self.draw(rng), -1
        names = list(showing)
        share = np.array([len(showing[name]) for name in names]) ** EVENNESS
        category = names[int(rng.choice(len(names), p=share / share.sum()))]
        return *showing[category][int(rng.integers(len(showing[category])))], category


def _shown(frames: Frames) -> dict[int, list[int]]:
    """Return for each category but walls, floors and ceilings the frames of a shard that show enough of it."""
    showing: dict[int, list[int]] = {}
    for index, label in enumerate(frames.label):
        count = np.bincount(label[::2, ::2].reshape(-1), minlength=256)
        for category in np.flatnonzero(count[: len(CATEGORIES)] >= FEWEST_PIXELS // 4):
            if CATEGORIES[category] not in ("wall", "floor", "ceiling"):
                showing.setdefault(int(category), []).append(index)
    return showing


def draw_batch(shards: Shards, size: int, rng: np.random.Generator, colour_kept: float) -> Batch:
    """Draw a batch; ``colour_kept`` is the share of pictures with colour that keep it."""
    items = [_sample(*shards.draw_category(rng), rng, colour_kept) for _ in range(size)]
    return Batch(*(np.stack([item[i] for item in items]) for i in range(5)))


def _sample(
    frames: Frames, index: int, category: int, rng: np.random.Generator, colour_kept: float
) -> tuple[np.ndarray, ...]:
    h, w = frames.depth.shape[1:]
    wide = rng.uniform(FIELD_PX, w * 0.9999) if rng.random() < 0.8 else FIELD_PX * rng.uniform(0.75, 1.0)
    wide = min(wide, h * WIDTH / HEIGHT)
    tall = wide * HEIGHT / WIDTH
    left, top = rng.uniform(0, w - wide), rng.uniform(0, h - tall)
    if category >= 0:  # a window with some of it inside
        rows, columns = np.nonzero(frames.label[index][::4, ::4] == category)
        if len(rows):
            at = int(rng.integers(len(rows)))
            left = np.clip(4 * columns[at] - wide * rng.uniform(0.2, 0.8), 0, w - wide)
            top = np.clip(4 * rows[at] - tall * rng.uniform(0.2, 0.8), 0, h - tall)
    column = np.clip((left + (np.arange(WIDTH) + 0.5) * wide / WIDTH).astype(int), 0, w - 1)
    row = np.clip((top + (np.arange(HEIGHT) + 0.5) * tall / HEIGHT).astype(int), 0, h - 1)
    depth = frames.depth[index][row[:, None], column].astype(np.float32) / 1000.0
    label = np.array(frames.label[index][row[:, None], column])
    fx, fy, cx, cy, *up, height = frames.camera[index]
    scale = WIDTH / wide
    fx, fy, cx, cy = fx * scale, fy * scale, (cx - left) * scale, (cy - top) * scale
    up = np.array(up)
    colour = np.zeros((3, HEIGHT, WIDTH), np.float32)
    rgb_row = int(frames.rgb_row[index])
    if rgb_row >= 0 and rng.random() < colour_kept:
        colour = _other_light(frames.rgb[rgb_row][row[:, None], column], rng)
    if rng.random() < 0.5:
        depth, label, colour = depth[:, ::-1], label[:, ::-1], colour[:, :, ::-1]
        up, cx = up * (-1, 1, 1), WIDTH - cx
    # Things come larger and smaller than the recipes make them; odometry and gravity are never quite right.
    stretch = np.exp(rng.normal(0.0, 0.07))
    up = up + rng.normal(0.0, 0.012, 3)
    off = rng.normal(0.0, 0.03) if rng.random() < 0.95 else rng.normal(0.0, 0.25)
    depth = np.ascontiguousarray(depth * stretch)
    if rng.random() < 0.3:
        depth = _with_holes(depth, rng)
    camera = Pinhole(fx, fy, cx, cy, WIDTH, HEIGHT)
    geometry = channels(depth, camera, up / np.linalg.norm(up), height * stretch + off)
    i, j = rng.integers(2, size=2)  # a cell of the output stands for four pixels
    label, z = np.array(label[i::2, j::2]), depth[i::2, j::2]
    label[z == 0.0] = UNLABELLED
    weight = np.minimum(1.0, 3.0 / np.maximum(z, 0.5)).astype(np.float32)
    return geometry, np.ascontiguousarray(colour), label.astype(np.int64), weight, np.array(frames.room[index])


def _with_holes(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    depth = depth.copy()
    if rng.random() < 0.5:  # a sensor that sees less far
        depth[depth > rng.uniform(2.5, 6.0)] = 0.0
    for _ in range(rng.integers(1, 5)):
        h, w = rng.integers(WIDTH // 40, WIDTH // 4, 2)
        r, c = rng.integers(0, HEIGHT - 2), rng.integers(0, WIDTH - 2)
        depth[r : r + h, c : c + w] = 0.0
    return depth


def _other_light(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the picture as another camera under another light might show it, (3, h, w)."""
    x = rgb.astype(np.float32) / 255.0
    if rng.random() < STRANGE_COLOURS:
        x = x[..., rng.permutation(3)]
    grey = x.mean(axis=2, keepdims=True)
    x = grey + (x - grey) * rng.uniform(0.0, 1.4)
    x = np.clip(x, 0.0, None) ** np.exp(rng.normal(0, 0.25)) * rng.uniform(0.6, 1.4) * np.exp(rng.normal(0, 0.08, 3))
    x = x + rng.normal(0, rng.uniform(0.0, 0.06), x.shape)
    return np.clip(x, 0.0, 1.2).astype(np.float32).transpose(2, 0, 1) * 2.0 - 1.0
