"""What is drawn of a map: small and full pictures, and voxels as tiles for other viewers.

Tiles are a pyramid of levels of detail, each cut into cubes of 64 voxels a side.

Level 0 has the map's voxels. A voxel of level L covers 2^L voxels a side of level 0; its colour is the mean of theirs.
The tile (L, i, j, k) covers the voxels [64 i, 64 i + 64) and so on of its level: the cube of edge
``64 · 2^L · voxel_size_m`` whose lowest corner is ``(i, j, k)`` times that edge, recording frame.

Bytes of a tile, little-endian:

    offset  type       content
    0       4 bytes    "AVLT"
    4       uint16     version, 1
    6       uint8      level L
    7       uint8      bytes of a voxel: 6, or 7 with heat
    8       float32    edge of a voxel of this level, metres
    12      float32x3  lowest corner of the tile, metres, recording frame
    24      uint32     number of voxels n
    28      n times    x, y, z (uint8, 0 to 63, voxels from the corner), red, green, blue (uint8), heat (uint8) if any
"""

import io
import struct
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, TypedDict

import cv2
import numpy as np
from jaxtyping import Float32, Int, UInt8
from msgspec import Meta

from avlmaps.core.poses import FRAME
from avlmaps.core.printable import plot_text
from avlmaps.query.answer import Answer
from avlmaps.query.plots import draw_map
from avlmaps.query.schema import Frame, Position

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from avlmaps.serve.shelf import ServedMap

SIDE = 64
MAGIC, VERSION = b"AVLT", 1
HEADER = struct.Struct("<4sHBBf3fI")
# The coarsest level has at most this many voxels, or one tile.
_COARSE = 20_000
_MOST_LEVELS = 16
# Three indices in one whole number: 21 bits each.
_BITS = 21


class LevelAnswer(TypedDict):
    """One level of detail."""

    level: int
    voxel_size_m: float
    voxels: int
    tiles: Annotated[list[list[int]], Meta(description="i, j, k and the number of voxels of each tile")]


class TilesAnswer(TypedDict):
    """All tiles of a map."""

    version: Annotated[str, Meta(description="changes with the map")]
    frame: Frame
    side: Annotated[int, Meta(description="voxels along a tile's edge")]
    low: Annotated[Position, Meta(description="lowest corner of the map")]
    high: Position
    levels: list[LevelAnswer]


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """Voxels of one level of detail; a coarser voxel has the mean colour of its own."""

    index: Int[np.ndarray, "n 3"]
    rgb: UInt8[np.ndarray, "n 3"]
    of_map: Int[np.ndarray, " m"]  # row of this level for each voxel of the map

    @classmethod
    def of(cls, index: Int[np.ndarray, "m 3"], rgb: UInt8[np.ndarray, "m 3"], number: int) -> "Level":
        """Return a level of a map's voxels, 0 the finest."""
        coarse = np.asarray(index, np.int64) >> number
        low = coarse.min(axis=0, initial=0)
        x, y, z = (coarse - low).T  # a map is less than 2^21 voxels wide
        key = (x << (2 * _BITS)) | (y << _BITS) | z
        _, first, of_map, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
        sums = [np.bincount(of_map, weights=rgb[:, k], minlength=len(first)) for k in range(3)]
        mean = np.stack(sums, axis=-1) / count[:, None]
        return cls(coarse[first], mean.round().astype(np.uint8), of_map)

    @property
    def tiles(self) -> list[list[int]]:
        """i, j, k and the number of voxels of each tile."""
        corners, count = np.unique(self.index // SIDE, axis=0, return_counts=True)
        return np.c_[corners, count].tolist()


class Pyramid:
    """The tiles of one map."""

    def __init__(self, index: Int[np.ndarray, "m 3"], rgb: UInt8[np.ndarray, "m 3"], voxel_size_m: float) -> None:
        self._index, self._voxel_size_m = index, voxel_size_m
        self.levels = [Level.of(index, rgb, 0)]
        while len(self.levels[-1].index) > _COARSE and len(self.levels) < _MOST_LEVELS:
            self.levels.append(Level.of(index, rgb, len(self.levels)))

    def index(self, version: str) -> TilesAnswer:
        """Return the list of tiles."""
        ends = [self._index.min(axis=0), self._index.max(axis=0) + 1] if len(self._index) else [np.zeros(3)] * 2
        low, high = (np.multiply(end, self._voxel_size_m).tolist() for end in ends)
        levels: list[LevelAnswer] = [
            {"level": number, "voxel_size_m": self._voxel_size_m * 2**number, "voxels": len(level.index),
             "tiles": level.tiles}
            for number, level in enumerate(self.levels)
        ]  # fmt: skip
        return {"version": version, "frame": FRAME, "side": SIDE, "low": low, "high": high, "levels": levels}

    def tile(
        self, number: int, corner: tuple[int, int, int], heat: Float32[np.ndarray, " m"] | None = None
    ) -> bytes | None:
        """Return the bytes of the tile of a level (0 is the finest) at i, j, k; None where there is none.

        ``heat`` is of each voxel of the map, in [0, 1]; a coarser voxel has the highest of its own.
        """
        if not 0 <= number < len(self.levels):
            return None
        level = self.levels[number]
        rows = np.flatnonzero((level.index // SIDE == corner).all(axis=1))
        if not len(rows):
            return None
        columns = [(level.index[rows] - SIDE * np.array(corner)).astype(np.uint8), level.rgb[rows]]
        if heat is not None:
            highest = np.zeros(len(level.index), np.float32)
            np.maximum.at(highest, level.of_map, np.asarray(heat, np.float32))
            columns.append((255.0 * np.clip(highest[rows], 0.0, 1.0)).round().astype(np.uint8)[:, None])
        body = np.concatenate(columns, axis=1)
        edge = self._voxel_size_m * 2**number
        origin = [SIDE * edge * one for one in corner]
        return HEADER.pack(MAGIC, VERSION, number, body.shape[1], edge, *origin, len(rows)) + body.tobytes()


SMALL_PIXELS = 480
# Matplotlib's registries are not made for several threads at once.
_drawing = threading.Lock()
_INK = (38, 41, 46)


def full_picture(served: "ServedMap", answer: Answer) -> bytes:
    """Return the PNG that ``avlmaps query --plot`` writes; of an answer from a list the small one, with its places."""
    if answer.heat is None:
        return small_picture(served, answer)
    with _drawing:
        return _png(answer.heat.plot(top=max(len(answer.goals), 1)))


def map_picture(served: "ServedMap") -> bytes:
    """Return the PNG of a map from above, with its path and sounds."""
    with _drawing:
        return _png(draw_map(served.avlmap, title=plot_text(served.name)))


def _png(figure: "Figure") -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", bbox_inches="tight", pad_inches=0.15)
    return stream.getvalue()


def small_picture(
    served: "ServedMap", answer: Answer | None = None, places: "Sequence[Sequence[float]] | None" = None
) -> bytes:
    """Return a small PNG: the map from above, the heat of an answer, its goals (or other places) numbered."""
    view, space = served.top_down, served.avlmap.space
    ground = np.where(view.seen[..., None], 0.72 * view.rgb + 0.28 * 255.0, 246.0)
    if answer is not None and answer.heat is not None:
        heat = view.heat(answer.heat.shown)[..., None]
        levels = np.clip(255.0 * (0.15 + 0.8 * heat[..., 0]), 0, 255).astype(np.uint8)
        colour = cv2.applyColorMap(levels, cv2.COLORMAP_INFERNO)[..., ::-1].astype(np.float64)
        opacity = 0.85 * np.power(heat / max(float(heat.max(initial=0.0)), 1e-9), 0.8)
        ground = ground * (1.0 - opacity) + colour * opacity
    left, _, bottom, _ = view.extent
    rows, columns = view.seen.shape
    scale = SMALL_PIXELS / max(rows, columns, 1)
    size = max(1, round(columns * scale)), max(1, round(rows * scale))
    mode = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_NEAREST
    picture = np.ascontiguousarray(cv2.resize(ground.astype(np.uint8)[::-1], size, interpolation=mode))
    cell_m = (view.extent[1] - left) / max(columns, 1)
    points = places if places is not None else [goal.position for goal in answer.goals] if answer else []
    for number, point in enumerate(points, 1):
        x, y = space.level(np.array(point))[:2]
        at = round((x - left) / cell_m * scale), size[1] - 1 - round((y - bottom) / cell_m * scale)
        _mark(picture, at, str(number))
    done, encoded = cv2.imencode(".png", picture[..., ::-1])
    return encoded.tobytes() if done else b""


def _mark(picture: UInt8[np.ndarray, "h w 3"], at: tuple[int, int], text: str) -> None:
    cv2.circle(picture, at, 9, (255, 255, 255), -1, cv2.LINE_AA)
    cv2.circle(picture, at, 8, _INK, -1, cv2.LINE_AA)
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)
    corner = at[0] - width // 2, at[1] + height // 2
    cv2.putText(picture, text, corner, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 1, cv2.LINE_AA)
