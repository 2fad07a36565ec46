"""A map laid out for a page: its voxels as bytes in the order of drawing, by levels of detail, and what places them.

The page draws in the level frame (metres, z up). A voxel is three whole numbers from the map's lowest corner, which
`level_from_cells` turns into that frame; positions in answers stay in the recording frame, as everywhere.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Float32, Int

from avlmaps.core.errors import MapError
from avlmaps.core.poses import FRAME, from_rotation
from avlmaps.maps.grid import index_ends
from avlmaps.query.plots import camera_path, ceiling_m

if TYPE_CHECKING:
    from avlmaps.maps.storeys import Storeys
    from avlmaps.query.avlmap import AVLMap


RECORD = np.dtype([("cell", "<u2", (3,)), ("seen", "<u2"), ("rgb", "u1", (3,)), ("spare", "u1")])
"""One voxel as the page reads it: where, when it was last seen (65535 is the end of the recording), its colour."""
_MOST_CELLS = 65535
_NEAR_SHARE = 0.25  # of the map's extent: voxels up to this far out of the bulk of it count as the whole map
_CEILING_M, _BELOW_M = 0.3, 0.1  # a storey is shown from below its floor to this far under its upper end
_MEASURED = 300_000  # voxels from which the first view of a page is computed: an even picture of the map


class Layout:
    """One map for a page.

    Attributes:
        order: (m,) the map's row of each voxel that is drawn, in the order of drawing.
        levels: of detail.
        low: (3,) index of the map's lowest corner.
    """

    def __init__(self, avlmap: "AVLMap", most: int | None = None) -> None:
        """Lay out a map by up to ``most`` voxels, or raise ``MapError`` where it is too wide to be drawn."""
        self.avlmap = avlmap
        index = np.asarray(avlmap.space.index)
        self.order, self.levels = detail_order(index, most)
        self.low, self._high = index_ends(index) if len(index) else (np.zeros(3, np.int64),) * 2
        if int((self._high - self.low).max()) > _MOST_CELLS:
            span_m = float((self._high - self.low).max() * avlmap.space.grid.voxel_size_m)
            raise MapError(
                f"{avlmap.path} is {span_m:.0f} m wide, more than {_MOST_CELLS} voxels; build it with larger "
                "voxels to view it."
            )

    def __len__(self) -> int:
        return len(self.order)

    @property
    def level_from_cells(self) -> Float[np.ndarray, "4 4"]:
        """From cells (the corner of the lowest voxel is 0) to the level frame, metres."""
        space, voxel_m = self.avlmap.space, self.avlmap.space.grid.voxel_size_m
        return from_rotation(space.level_from_world * voxel_m, space.level_from_world @ (self.low * voxel_m))

    @cached_property
    def records(self) -> bytes:
        """The voxels that are drawn as `RECORD`, in the order of drawing."""
        voxels, records = self.avlmap.data.voxels, np.zeros(len(self), RECORD)
        records["cell"] = np.asarray(self.avlmap.space.index)[self.order] - self.low
        records["rgb"] = np.asarray(voxels.rgb)[self.order]
        share = np.asarray(voxels.last_seen_s, np.float64)[self.order] / self.duration_s
        records["seen"] = np.clip(np.round(share * 65535), 0, 65535)
        return records.tobytes()

    @property
    def duration_s(self) -> float:
        """The last moment of the map, seconds from the start of the recording; never 0."""
        data = self.avlmap.data
        stamps = data.keyframes.stamp_s, data.sounds.offset_s, data.voxels.last_seen_s
        return max(1e-3, *(float(np.asarray(each).max(initial=0.0)) for each in stamps))

    def describe(self) -> dict[str, Any]:
        """Return all that the page needs before it draws the first voxel."""
        avlmap, space = self.avlmap, self.avlmap.space
        # Of a very large map an even picture of it is measured.
        level = space.level(space.centres_of(self.order[:_MEASURED])) if len(space) else np.zeros((1, 3))
        low, high = np.percentile(level, [0.1, 99.9], axis=0)
        # What lies far from all else, seen through a window, does not make the rest small.
        reach = _NEAR_SHARE * (high - low) + space.grid.voxel_size_m
        least, most = np.maximum(level.min(axis=0), low - reach), np.minimum(level.max(axis=0), high + reach)
        cameras = camera_path(space)
        camera = avlmap.data.rig.rgb
        storeys = {} if avlmap.storeys is None else {"storeys": _storeys(avlmap.storeys, low[2], high[2])}
        return {
            "name": avlmap.path.name,
            "summary": repr(avlmap).partition(": ")[2].removesuffix(")"),
            "voxels": len(self),
            "voxels_of_map": len(space),
            "voxel_size_m": space.grid.voxel_size_m,
            "record_bytes": RECORD.itemsize,
            "levels": [[level.count, level.edge] for level in self.levels],
            "level_from_cells": self.level_from_cells.ravel().tolist(),
            "level_from_recording": space.level_from_recording.ravel().tolist(),
            "low": low.tolist(),
            "high": high.tolist(),
            "least": (least - 0.5 * space.grid.voxel_size_m).tolist(),
            "most": (most + 0.5 * space.grid.voxel_size_m).tolist(),
            "floor_m": _floor_m(level, cameras),
            "ceiling_m": ceiling_m(space, level),
            "duration_s": self.duration_s,
            "frame": FRAME,
            "profile": avlmap.data.info.profile,
            "field_of_view": [camera.width / camera.fx, camera.height / camera.fy],
            "keyframes": self._keyframes(),
            **storeys,
        }

    def _keyframes(self) -> list[dict[str, Any]]:
        keyframes, turn = self.avlmap.data.keyframes, self.avlmap.space.level_from_world
        poses = np.asarray(keyframes.world_from_camera, np.float64)
        return [
            {
                "stamp_s": round(float(stamp), 3),
                "position": np.round(turn @ pose[:3, 3], 4).tolist(),
                "right": np.round(turn @ pose[:3, 0], 4).tolist(),
                "down": np.round(turn @ pose[:3, 1], 4).tolist(),
                "ahead": np.round(turn @ pose[:3, 2], 4).tolist(),
            }
            for stamp, pose in zip(np.asarray(keyframes.stamp_s), poses, strict=True)
        ]

    def thumbnail(self, number: int) -> bytes | None:
        """Return the JPEG of a keyframe, None where there is none."""
        keyframes = self.avlmap.data.keyframes
        return (keyframes.jpeg(number).tobytes() or None) if 0 <= number < len(keyframes) else None


def _storeys(storeys: "Storeys", low_m: float, high_m: float) -> list[dict[str, Any]]:
    told: list[dict[str, Any]] = []
    for storey in storeys.all:
        top_m, bottom_m = min(storey.high_m, high_m) - _CEILING_M, max(storey.low_m, low_m - _BELOW_M)
        told.append({"name": storey.name, "floor_m": storey.floor_m, "low_m": bottom_m, "cut": [bottom_m, top_m]})
    return told


def _floor_m(level: Float[np.ndarray, "n 3"], cameras: Float[np.ndarray, "k 3"]) -> float:
    heights = level[:, 2]
    below = heights[heights < np.median(cameras[:, 2])] if len(cameras) else heights
    if not len(below):
        return float(heights.min())
    counts, edges = np.histogram(below, bins=max(1, int(np.ceil(np.ptp(below) / 0.05))))
    return float(edges[int(np.argmax(counts))])


def as_bytes(heat: Float32[np.ndarray, " m"]) -> bytes:
    """Return heat in [0, 1] as whole bytes; any heat at all is at least 1."""
    return np.ceil(np.clip(heat, 0.0, 1.0) * 255).astype(np.uint8).tobytes()


# Edges of the blocks, in voxels and powers of two, of which one voxel each is drawn first.
_SHIFTS = (4, 3, 2, 1)
_SEED = 11
# Blocks in the box round a map, for each of its voxels, up to which a table of them is made.
_MOST_BLOCKS = 4


@dataclass(frozen=True, slots=True)
class Level:
    """One level of detail."""

    count: int  # voxels that are drawn at this level: the first ones of the order
    edge: int  # of the blocks that they stand for, in voxels


def detail_order(
    index: Int[np.ndarray, "n 3"], most: int | None = None
) -> tuple[Int[np.ndarray, " m"], tuple[Level, ...]]:
    """Return the order in which voxels are drawn, and how many of them make up each level.

    A level holds one voxel of every block that holds any, and the last level holds all voxels. Within a level the
    order is drawn at random (always the same), so that any part of a level is spread over the whole map. Where there
    are more than ``most`` voxels, the last level is one of blocks of which some are left out, and its ``count`` is what
    all of them would be.
    """
    n = len(index)
    rng = np.random.default_rng(_SEED)
    chosen = np.zeros(n, bool)
    drawn = 0
    parts: list[np.ndarray] = []
    levels: list[Level] = []
    for shift in _SHIFTS:
        fresh = _one_of_each(index, shift, chosen)
        if n and len(fresh) + drawn < n:
            chosen[fresh] = True
            drawn += len(fresh)
            parts.append(rng.permutation(fresh))
            levels.append(Level(drawn, 1 << shift))
            if most is not None and drawn >= most:
                return np.concatenate(parts)[:most], tuple(levels)
    parts.append(rng.permutation(np.flatnonzero(~chosen)))
    levels.append(Level(n, 1))
    return np.concatenate(parts)[:most], tuple(levels)


def _one_of_each(index: Int[np.ndarray, "n 3"], shift: int, chosen: np.ndarray) -> Int[np.ndarray, " m"]:
    if not len(index):
        return np.zeros(0, np.int64)
    low, high = (end >> shift for end in index_ends(index))
    span = high - low + 1
    key = np.zeros(len(index), np.int64)
    for axis in range(3):
        key *= span[axis]
        key += (index[:, axis] >> shift) - low[axis]
    if int(span[0]) * int(span[1]) * int(span[2]) > _MOST_BLOCKS * len(index):
        _, key = np.unique(key, return_inverse=True)  # a table of all blocks would be larger than the map
    first = np.full(int(key.max()) + 1, -1, np.int64)
    first[key[::-1]] = np.arange(len(index) - 1, -1, -1)  # the last one written stays
    first[key[chosen]] = -1
    return first[first >= 0]
