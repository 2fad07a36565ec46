"""Batches for training: views of rendered and real frames, turned, zoomed, mirrored and degraded as by sensors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import cv2
import numpy as np
import torch
from torch.utils.data import DataLoader, IterableDataset, get_worker_info
from training.pixels.faults import degraded, mistaken
from training.pixels.labels import CATEGORIES, FIRST_COARSE, UNLABELLED

# A frame shows a category with at least this many of its 320x240 pixels.
FEWEST_PIXELS = 120
# Batches after which a process looks for new shards.
LOOK_EVERY = 30
# How evenly categories are drawn: 0 each as often as any other, 1 as often as frames show it.
EVENNESS = 0.45
# Share of frames that are drawn without regard to what they show.
ANY_FRAME = 0.3
_PLAIN = ("wall", "floor", "ceiling")
_STRUCTURE = {FIRST_COARSE + number for number in (0, 1, 21, 37, 38, 39)}  # of the coarse classes


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

    @property
    def is_real(self) -> bool:
        """Return whether the frames are real ones; their cameras have one number more."""
        return self.camera.shape[1] > 8

    def has_depth(self, index: int) -> bool:
        """Return whether a frame has a depth anywhere; a photograph has none."""
        return bool(self.depth[index, ::16, ::16].any())

    def height_is_known(self, index: int) -> bool:
        """Return whether a camera's height is true; for some real frames it is an estimate."""
        return not self.is_real or bool(self.camera[index, 8])


Array = TypeVar("Array", np.ndarray, torch.Tensor)


class Batch(NamedTuple, Generic[Array]):
    """Arrays for the network, or tensors.

    Attributes:
        depth: (n, h, w) metres, 0 for none; ``shape.channels_of`` makes the geometry of it.
        camera: (n, 8) fx, fy, cx, cy, up and the height over the floor, as a map assumes them.
        rgb: (n, h, w, 3) of 8 bit, times the fineness.
        kept: (n,) whether the picture has a colour and it is not withheld.
        label: (n, h/2, w/2) of 8 bit, fine and coarse.
        weight: (n, h/2, w/2) of each pixel in the loss.
        room: (n, rooms) share of the view in each kind.
        floor: (n,) height of the true floor over the one that the geometry was made with; NaN where it is unknown.
    """

    depth: Array
    camera: Array
    rgb: Array
    kept: Array
    label: Array
    weight: Array
    room: Array
    floor: Array


class Shards:
    """Draws frames from the shards in a folder; looks for new ones on request."""

    def __init__(self, folder: Path) -> None:
        """Open the shards that are there."""
        self.folder = folder
        self._open: dict[str, tuple[int, Frames]] = {}
        self._shown: dict[str, tuple[int, dict[int, list[int]]]] = {}
        self._showing: list[tuple[int, list[tuple[Frames, int]]]] = []
        self._upto = np.empty(0)
        self.refresh()

    def refresh(self) -> int:
        """Search for new shards; return how many frames there are."""
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
        share = np.array([len(frames) for frames in showing.values()]) ** EVENNESS
        self._open, self._showing, self._upto = found, list(showing.items()), np.cumsum(share)
        return sum(len(frames.depth) for _, frames in found.values())

    def every(self) -> list[tuple[Frames, int]]:
        """Return every frame."""
        return [(frames, index) for _, frames in self._open.values() for index in range(len(frames.depth))]

    def draw(self, rng: np.random.Generator) -> tuple[Frames, int]:
        """Return a shard and the number of a frame in it."""
        _, frames = list(self._open.values())[int(rng.integers(len(self._open)))]
        return frames, int(rng.integers(len(frames.depth)))

    def draw_category(self, rng: np.random.Generator) -> tuple[Frames, int, int]:
        """Return a frame that shows a category drawn almost evenly, and that category; −1 for any frame.

        Three quarters of what a camera sees is walls and floors; a network that sees the world as it is learns those.
        """
        if not self._showing or rng.random() < ANY_FRAME:
            return *self.draw(rng), -1
        at = np.searchsorted(self._upto, rng.uniform(0.0, self._upto[-1]), side="right")
        category, frames = self._showing[min(int(at), len(self._showing) - 1)]
        return *frames[int(rng.integers(len(frames)))], category


def _shown(frames: Frames) -> dict[int, list[int]]:
    """Return for each category but walls, floors and ceilings the frames of a shard that show enough of it."""
    showing: dict[int, list[int]] = {}
    for index, label in enumerate(frames.label):
        count = np.bincount(label[::2, ::2].reshape(-1), minlength=256)[:UNLABELLED]
        for category in np.flatnonzero(count >= FEWEST_PIXELS // 4):
            plain = category < len(CATEGORIES) and CATEGORIES[category] in _PLAIN
            if not plain and category not in _STRUCTURE:
                showing.setdefault(int(category), []).append(index)
    return showing


@dataclass(frozen=True)
class View:
    """How large the pictures of a batch are, and how they are drawn.

    Attributes:
        width: columns.
        height: rows.
        colour_kept: share of pictures with colour that keep it.
        fineness: how many times as wide and high the colour is as the geometry.
    """

    width: int = 160
    height: int = 120
    colour_kept: float = 0.85
    fineness: int = 1


def draw_batch(sources: Sequence[tuple[Shards, int]], view: View, rng: np.random.Generator) -> Batch[np.ndarray]:
    """Draw a batch with the given number of frames of each source."""
    items = [_sample(*shards.draw_category(rng), view, rng) for shards, size in sources for _ in range(size)]
    return Batch(*map(np.stack, zip(*items, strict=True)))


class _Drawn(IterableDataset):
    """Batches for ever; each process that draws opens the shards itself, and now and then looks for new ones."""

    def __init__(self, sources: list[tuple[Path, int]], view: View, seed: int) -> None:
        self._sources, self._view, self._seed = sources, view, seed

    def __iter__(self) -> Iterator[Batch[np.ndarray]]:
        worker = get_worker_info()
        assert worker is not None
        cv2.setNumThreads(1)
        rng = np.random.default_rng([self._seed, worker.id])
        sources = [(Shards(folder), size) for folder, size in self._sources]
        drawn = 0
        while True:
            yield draw_batch(sources, self._view, rng)
            drawn += 1
            if drawn % LOOK_EVERY == 0:
                for shards, _ in sources:
                    shards.refresh()


def batches(
    sources: list[tuple[Shards, int]], view: View, seed: int, readers: int, device: torch.device
) -> Iterator[Batch[torch.Tensor]]:
    """Return batches that processes draw, in memory that they share.

    Args:
        sources: shards, and how many frames of each are in a batch.
        view: how they are drawn.
        seed: of the drawing.
        readers: number of processes.
        device: what the batches are for.
    """
    drawn = _Drawn([(shards.folder, size) for shards, size in sources if size], view, seed)
    return iter(
        DataLoader(
            drawn, batch_size=None, num_workers=readers, prefetch_factor=3, pin_memory=device.type == "cuda",
            multiprocessing_context="spawn",
        )
    )  # fmt: skip


def _placement(frames: Frames, index: int, category: int, view: View, rng: np.random.Generator) -> tuple:
    """Return a zoom, a turn and where the middle of the new picture lies in the frame."""
    h, w = frames.depth.shape[1:]
    # At a zoom of 1 a picture of 160 columns shows all 320 of the frame.
    zoom = float(np.exp(rng.uniform(np.log(0.9), np.log(1.7)))) if rng.random() < 0.75 else 1.0
    turn = float(rng.normal(0.0, np.deg2rad(4.0))) if rng.random() < 0.5 else 0.0
    wide, tall = 2.0 * view.width / zoom, 2.0 * view.height / zoom
    x, y = (rng.uniform(min(size, all_) / 2, all_ - min(size, all_) / 2) for size, all_ in ((wide, w), (tall, h)))
    if category >= 0 and (wide < w or tall < h):  # some of it inside
        rows, columns = np.nonzero(frames.label[index][::4, ::4] == category)
        if len(rows):
            at = int(rng.integers(len(rows)))
            x = np.clip(4 * columns[at] + wide * rng.uniform(-0.3, 0.3), min(wide, w) / 2, w - min(wide, w) / 2)
            y = np.clip(4 * rows[at] + tall * rng.uniform(-0.3, 0.3), min(tall, h) / 2, h - min(tall, h) / 2)
    return zoom / 2.0, turn, float(x), float(y)


def _sample(frames: Frames, index: int, category: int, view: View, rng: np.random.Generator) -> tuple[Any, ...]:
    scale, turn, x, y = _placement(frames, index, category, view, rng)
    fx, fy, cx, cy, *up, height = frames.camera[index][:8]
    mirrored = rng.random() < 0.5
    cos, sin = np.cos(turn), np.sin(turn)
    linear = np.array([[cos, -sin], [sin, cos]]) * scale
    up = np.array([cos * up[0] - sin * up[1], sin * up[0] + cos * up[1], up[2]])
    if mirrored:
        linear[0], up = -linear[0], up * (-1, 1, 1)
    move = np.array([view.width, view.height]) / 2 - linear @ (x, y)
    cx, cy = linear @ (cx, cy) + move
    # cv2 counts from the middle of the first pixel.
    matrix = np.column_stack([linear, move + linear @ (0.5, 0.5) - 0.5])
    size = (view.width, view.height)

    def warped(picture: np.ndarray, how: int, outside: int) -> np.ndarray:
        return cv2.warpAffine(np.ascontiguousarray(picture), matrix, size, flags=how, borderValue=(outside,) * 3)

    depth = warped(frames.depth[index], cv2.INTER_NEAREST, 0).astype(np.float32) / 1000.0
    label = warped(frames.label[index], cv2.INTER_NEAREST, UNLABELLED)
    rgb, kept = _drawn_colour(frames, int(frames.rgb_row[index]), matrix, view, rng)
    known = frames.height_is_known(index)
    depth = degraded(depth, real=label.max() >= FIRST_COARSE and frames.is_real, rng=rng)
    stretch = np.exp(rng.normal(0.0, 0.07))  # things come larger and smaller than the recipes make them
    depth, height = depth * np.float32(stretch), height * stretch
    believed_up, off = mistaken(up, known, rng)
    camera = np.array([fx * scale, fy * scale, cx, cy, *believed_up, height + off], np.float32)
    i, j = rng.integers(2, size=2)  # a cell of the output stands for four pixels
    label, z = np.array(label[i::2, j::2]), depth[i::2, j::2]
    if frames.has_depth(index):  # a photograph teaches colour alone
        label[z == 0.0] = UNLABELLED
    weight = np.minimum(1.0, 3.0 / np.maximum(z, 0.5)).astype(np.float32)
    floor = np.float32(off if known else np.nan)
    return depth, camera, rgb, np.float32(kept), label, weight, np.array(frames.room[index]), floor


def _drawn_colour(
    frames: Frames, rgb_row: int, matrix: np.ndarray, view: View, rng: np.random.Generator
) -> tuple[np.ndarray, bool]:
    """Return the picture of a view, (h, w, 3) times its fineness, and whether it has one that is not withheld.

    Args:
        frames: a shard.
        rgb_row: which of its pictures; −1 for none.
        matrix: (2, 3) from the picture to the view, as cv2 counts.
        view: how the picture is drawn.
        rng: of the withholding.
    """
    n = view.fineness
    size = (n * view.width, n * view.height)
    if rgb_row < 0 or rng.random() >= view.colour_kept:
        return np.zeros((*size[::-1], 3), np.uint8), False
    rgb = frames.rgb[rgb_row]
    if n == 1:  # two pixels of the picture become one
        rgb = cv2.blur(rgb, (2, 2))
    finer = n * matrix + np.array([[0.0, 0.0, (n - 1) / 2]])  # cv2 counts from the middle of the first pixel
    rgb = cv2.warpAffine(np.ascontiguousarray(rgb), finer, size, flags=cv2.INTER_LINEAR, borderValue=(127, 127, 127))
    return rgb, True
