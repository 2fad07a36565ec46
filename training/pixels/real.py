"""Real labelled frames as shards: ``python -m training.pixels.real --nyuv2 DIR``.

The frames are those of NYU Depth V2's training split, or of any camera, in the layout of
``avlmaps_sim.bench.frames``. Their labels are coarse: NYU's class c stands in a shard as ``FIRST_COARSE + c``
and teaches the sum of its kinds' probabilities. Neighbouring numbers are often one room, so whole blocks of them are
held out for development.
"""

import io
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import time

import cv2
import numpy as np
import tyro
from training.pixels.labels import CATEGORIES, FIRST_COARSE, ROOMS, UNLABELLED

from avlmaps.core.camera import Pinhole
from avlmaps_sim.bench.frames import CLASSES, LabelledFolder, LabelledFrame

WIDTH, HEIGHT = 320, 240
# The frames in their order are cut into blocks of about this size, at gaps in their numbers; each sixth is held out.
BLOCK = 22
EACH = 6
FIRST_HELD_OUT = 2


@dataclass(frozen=True)
class Options:
    """Where real frames come from and go to."""

    nyuv2: Path
    """Folder of labelled frames (``avlmaps_sim.bench.frames``), or a file that ``--pack`` wrote."""
    out: Path = Path("build/pixels/real")
    """Folder of the shards: ``training`` and ``development`` in it."""
    pack: Path | None = None
    """Write the frames, half their size and compressed, into this one file (about 30 MB) instead."""
    whole: bool = False
    """Let the frames of the development split teach as well, once a recipe was measured without them."""


def blocks(names: tuple[str, ...]) -> list[list[int]]:
    """Return rows of an index in blocks: cut where numbers have a gap, as soon as a block has enough.

    Names that are no numbers show no gaps: there every block has the same size.
    """
    cut: list[list[int]] = [[]]
    numbers = [int(name) for name in names] if all(name.isdecimal() for name in names) else None
    for row in range(len(names)):
        gap = row > 0 and (numbers is None or numbers[row] - numbers[row - 1] > 1)
        if gap and len(cut[-1]) >= BLOCK:
            cut.append([])
        cut[-1].append(row)
    return cut


def held_out_rows(names: tuple[str, ...]) -> list[int]:
    """Return the rows of the development split."""
    return [row for block in blocks(names)[FIRST_HELD_OUT::EACH] for row in block]


@dataclass
class Real:
    """A frame at the size of shards: what they need of it."""

    depth_mm: np.ndarray
    label: np.ndarray
    rgb: np.ndarray
    camera: np.ndarray


def read_folder(folder: LabelledFolder) -> Iterator[Real]:
    """Read every frame; the camera's last number says whether the labels gave its height."""
    for number in range(len(folder)):
        yield fitted(folder.read(number), folder.camera)


def fitted(one: LabelledFrame, camera: Pinhole, fine: np.ndarray | None = None) -> Real:
    """Return a frame as large as fits into a shard's, with nothing to its right and below where it is of another shape.

    Depth and labels are sampled, since a mean over an edge would be a place where nothing is. ``fine`` labels, where
    there are any, stand for the frame's own.
    """
    scale = min(WIDTH / camera.width, HEIGHT / camera.height)
    w, h = max(1, round(camera.width * scale)), max(1, round(camera.height * scale))
    row, column = (np.arange(h) * camera.height // h)[:, None], np.arange(w) * camera.width // w
    label = np.where(one.label == 0, UNLABELLED, FIRST_COARSE + one.label.astype(int) - 1).astype(np.uint8)
    if fine is not None:
        label = np.where(fine == UNLABELLED, label, fine)
    ground = one.frame.ground
    assert ground is not None
    small = camera.resized(w, h)
    numbers = [small.fx, small.fy, small.cx, small.cy, *ground.up_in_world, -ground.floor_m[0]]
    rest = ((0, HEIGHT - h), (0, WIDTH - w))
    return Real(
        np.pad(np.rint(one.frame.depth_m[row, column] * 1000).astype(np.uint16), rest),
        np.pad(label[row, column], rest, constant_values=UNLABELLED),
        np.pad(cv2.resize(one.frame.rgb, (w, h), interpolation=cv2.INTER_AREA), (*rest, (0, 0))),
        np.array([*numbers, float(one.floor_is_labelled)]),
    )


def write_pack(frames: list[Real], names: tuple[str, ...], path: Path) -> None:
    """Write frames compressed: colour as JPEG, depth (mm, 16 bit) and labels as PNG."""

    def coded(pictures: list[np.ndarray], end: str, *flags: int) -> dict[str, np.ndarray]:
        codes = [cv2.imencode(end, picture, list(flags))[1].reshape(-1) for picture in pictures]
        return {"bytes": np.concatenate(codes), "size": np.array([len(code) for code in codes])}

    jpeg = (cv2.IMWRITE_JPEG_QUALITY, 85, cv2.IMWRITE_JPEG_OPTIMIZE, 1)
    # Steps of 8 mm are finer than the sensor's beyond a metre and a half, and halve the file.
    depth = [np.rint(one.depth_mm / 8.0).astype(np.uint16) for one in frames]
    parts = {
        "depth": coded(depth, ".png", cv2.IMWRITE_PNG_COMPRESSION, 9),
        "label": coded([one.label for one in frames], ".png", cv2.IMWRITE_PNG_COMPRESSION, 9),
        "rgb": coded([one.rgb[..., ::-1] for one in frames], ".jpg", *jpeg),
    }
    arrays = {f"{name}_{key}": value for name, part in parts.items() for key, value in part.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, allow_pickle=False, names=np.array(names), camera=np.stack([one.camera for one in frames]), **arrays)


def read_pack(path: Path) -> tuple[list[Real], tuple[str, ...]]:
    """Read what ``write_pack`` wrote."""
    with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:

        def decoded(name: str) -> list[np.ndarray]:
            ends = np.cumsum(arrays[f"{name}_size"])
            codes = np.split(arrays[f"{name}_bytes"], ends[:-1])
            return [np.asarray(cv2.imdecode(code, cv2.IMREAD_UNCHANGED)) for code in codes]

        rows = zip(decoded("depth"), decoded("label"), decoded("rgb"), arrays["camera"], strict=True)
        frames = [Real(d * np.uint16(8), lb, np.ascontiguousarray(c[..., ::-1]), camera) for d, lb, c, camera in rows]
        return frames, tuple(str(name) for name in arrays["names"])


def write_shards(frames: list[Real], names: tuple[str, ...], out: Path, whole: bool = False) -> None:
    """Write the two splits as shards; ``whole``: all frames as the first, and no second."""
    held_out = set() if whole else set(held_out_rows(names))
    for split, rows in (
        ("training", [row for row in range(len(names)) if row not in held_out]),
        ("development", sorted(held_out)),
    ):
        if not rows:
            continue
        folder = out / split / "0000000-0000"
        folder.mkdir(parents=True, exist_ok=True)
        chosen = [frames[row] for row in rows]
        np.save(folder / "depth.npy", np.stack([one.depth_mm for one in chosen]))
        np.save(folder / "label.npy", np.stack([one.label for one in chosen]))
        np.save(folder / "rgb.npy", np.stack([one.rgb for one in chosen]))
        np.save(folder / "rgb_row.npy", np.arange(len(chosen), dtype=np.int32))
        np.save(folder / "room.npy", np.zeros((len(chosen), len(ROOMS)), np.float32))
        np.save(folder / "camera.npy", np.stack([one.camera for one in chosen]))
        about = {"categories": CATEGORIES, "coarse": CLASSES, "rows": rows, "made": time()}
        (folder / "about.json").write_text(json.dumps(about))
        print(f"{split}: {len(chosen)} frames", file=sys.stderr)


def main(options: Options) -> None:
    """Write the shards, or the pack."""
    if options.nyuv2.is_file():
        frames, names = read_pack(options.nyuv2)
    else:
        folder = LabelledFolder(options.nyuv2)
        frames, names = list(read_folder(folder)), folder.names
    if options.pack is not None:
        write_pack(frames, names, options.pack)
    else:
        write_shards(frames, names, options.out, options.whole)


if __name__ == "__main__":
    main(tyro.cli(Options))
