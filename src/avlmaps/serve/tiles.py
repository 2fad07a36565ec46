"""Voxels as tiles for other viewers: a pyramid of levels of detail, each cut into cubes of 64 voxels a side.

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

import struct
import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, TypedDict

import numpy as np
from jaxtyping import Float32, Int, UInt8
from msgspec import Meta

from avlmaps.core.poses import FRAME
from avlmaps.query.schema import Frame, Position

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

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
class _Level:
    """Voxels of a level, those of a tile one after the other.

    Attributes:
        index: (n, 3) in this level.
        rgb: mean colours.
        starts: (t + 1,) first row of each tile.
        corners: (t, 3) tiles.
        of_map: row of this level for each voxel of the map.
    """

    index: Int[np.ndarray, "n 3"]
    rgb: UInt8[np.ndarray, "n 3"]
    starts: Int[np.ndarray, " t1"]
    corners: Int[np.ndarray, "t 3"]
    of_map: Int[np.ndarray, " m"]
    rows: dict[tuple[int, int, int], int] = field(repr=False)


class Pyramid:
    """The tiles of one map; levels are made when they are wanted."""

    def __init__(self, index: Int[np.ndarray, "m 3"], rgb: UInt8[np.ndarray, "m 3"], voxel_size_m: float) -> None:
        self._index, self._rgb, self._voxel_size_m = np.asarray(index, np.int64), np.asarray(rgb), voxel_size_m
        self._levels: list[_Level] = []
        self._lock = threading.Lock()

    @classmethod
    def of(cls, avlmap: "AVLMap") -> "Pyramid":
        """Return the pyramid of a map."""
        return cls(avlmap.space.index, avlmap.colors, avlmap.space.grid.voxel_size_m)

    @property
    def levels(self) -> list[_Level]:
        """All levels, finest first."""
        with self._lock:
            while not self._levels or (
                len(self._levels[-1].index) > _COARSE
                and len(self._levels[-1].corners) > 1
                and len(self._levels) < _MOST_LEVELS
            ):
                self._levels.append(self._made(len(self._levels)))
            return self._levels

    def _made(self, level: int) -> _Level:
        coarse = self._index >> level
        tile = coarse // SIDE
        keys, tile_keys = _key(coarse), _key(tile)
        order = np.lexsort((keys, tile_keys))
        new = np.r_[True, keys[order][1:] != keys[order][:-1]] if len(order) else np.zeros(0, bool)
        group = np.cumsum(new) - 1
        of_map = np.empty(len(order), np.int64)
        of_map[order] = group
        first = order[new]
        count = np.bincount(of_map, minlength=len(first))
        rgb = np.stack(
            [
                np.bincount(of_map, weights=self._rgb[:, k], minlength=len(first)) / np.maximum(count, 1)
                for k in range(3)
            ],
            axis=-1,
        )
        in_tiles = tile_keys[first]
        begins = np.flatnonzero(np.r_[True, in_tiles[1:] != in_tiles[:-1]]) if len(first) else np.zeros(0, np.int64)
        corners = tile[first][begins]
        rows = {(int(i), int(j), int(k)): n for n, (i, j, k) in enumerate(corners)}
        starts = np.append(begins, len(first))
        return _Level(coarse[first], rgb.round().astype(np.uint8), starts, corners, of_map, rows)

    def index(self, version: str) -> TilesAnswer:
        """Return the list of tiles."""
        levels = self.levels
        low = self._index.min(axis=0) if len(self._index) else np.zeros(3, np.int64)
        high = self._index.max(axis=0) + 1 if len(self._index) else np.zeros(3, np.int64)
        return {
            "version": version,
            "frame": FRAME,
            "side": SIDE,
            "low": [float(value) for value in low * self._voxel_size_m],
            "high": [float(value) for value in high * self._voxel_size_m],
            "levels": [
                {
                    "level": number,
                    "voxel_size_m": self._voxel_size_m * 2**number,
                    "voxels": len(level.index),
                    "tiles": np.c_[level.corners, np.diff(level.starts)].tolist(),
                }
                for number, level in enumerate(levels)
            ],
        }

    def tile(
        self, level: int, corner: tuple[int, int, int], heat: Float32[np.ndarray, " m"] | None = None
    ) -> bytes | None:
        """Return the bytes of a tile; None where there is none.

        Args:
            level: 0 is the finest.
            corner: i, j, k.
            heat: of each voxel of the map, in [0, 1]; a coarser voxel has the highest of its own.
        """
        levels = self.levels
        if not 0 <= level < len(levels) or corner not in levels[level].rows:
            return None
        chosen = levels[level]
        number = chosen.rows[corner]
        a, b = int(chosen.starts[number]), int(chosen.starts[number + 1])
        columns = [(chosen.index[a:b] - SIDE * np.array(corner)).astype(np.uint8), chosen.rgb[a:b]]
        if heat is not None:
            highest = np.zeros(len(chosen.index), np.float32)
            np.maximum.at(highest, chosen.of_map, np.asarray(heat, np.float32))
            columns.append((255.0 * np.clip(highest[a:b], 0.0, 1.0)).round().astype(np.uint8)[:, None])
        body = np.concatenate(columns, axis=1)
        edge = self._voxel_size_m * 2**level
        origin = [SIDE * edge * one for one in corner]
        return HEADER.pack(MAGIC, VERSION, level, body.shape[1], edge, *origin, b - a) + body.tobytes()


def _key(index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
    """Return one number for each index of a map; a map is less than 2^21 voxels wide."""
    shifted = index - (index.min(axis=0) if len(index) else 0)
    return (shifted[:, 0] << (2 * _BITS)) | (shifted[:, 1] << _BITS) | shifted[:, 2]
