"""Make a map of many voxels from a small one, through the store's writer: its home again and again, side by side.

    python benchmarks/tiled.py home.avlmap /tmp/big.avlmap --voxels 5000000

The map's up must be the z axis. Copies stand on a square grid. Every other one is turned by half a circle, and each
lacks some boxes of voxels, so that no two are the same; keyframes go with their copies, sounds stay in the first.
"""

import argparse
from dataclasses import fields, replace
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.manifest import MapBounds
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.types import Keyframes, Voxels

GAP = 4  # empty voxels between two copies
HOLES = 12  # boxes of voxels that a copy lacks
HOLE = 8  # voxels a side of the largest
EVERY = 4  # keyframes that are copied, every fourth


def tiled(source: MapData, count: int, seed: int = 0) -> tuple[Voxels, Keyframes]:
    """Return the voxels and keyframes of a building of ``count`` voxels."""
    rng = np.random.default_rng(seed)
    index = np.asarray(source.voxels.index, np.int64)
    low, size = index.min(axis=0), np.ptp(index, axis=0) + 1
    copies = -(-count // (len(index) - HOLES * HOLE**2))
    side = int(np.ceil(np.sqrt(copies)))
    places: list[np.ndarray] = []
    rows: list[np.ndarray] = []
    frames: list[Keyframes] = []
    for number in range(copies):
        offset = np.array([number % side, number // side, 0]) * (size + GAP)
        turned = number % 2 == 1
        local = index - low
        if turned:
            local[:, :2] = size[:2] - 1 - local[:, :2]
        whole = np.ones(len(index), bool)
        for centre in local[rng.integers(0, len(index), HOLES if number else 0)]:
            whole &= np.abs(local - centre).max(axis=1) > rng.integers(1, HOLE // 2 + 1)
        kept = np.flatnonzero(whole)
        places.append((local[kept] + low + offset).astype(np.int32))
        rows.append(kept)
        world = np.eye(4)
        if turned:
            world[:2, :2] = -np.eye(2)
            world[:2, 3] = (2 * low + size)[:2] * source.grid.voxel_size_m
        world[:3, 3] += offset * source.grid.voxel_size_m
        frames.append(_moved(source.keyframes, world, number))
    place, row = np.concatenate(places), np.concatenate(rows)
    order = np.lexsort(place.T[::-1])[:count]
    place, row = place[order], row[order]
    voxels = source.voxels
    taken = (np.asarray(getattr(voxels, name))[row] for name in ("feature", "weight", "rgb", "last_seen_s", "hits"))
    return Voxels(place, *taken), _joined(frames)


def _moved(keyframes: Keyframes, world: np.ndarray, number: int) -> Keyframes:
    """Return some keyframes in another copy of the home, later by a walk."""
    which = np.arange(0, len(keyframes), EVERY)
    points = _rows(keyframes.offsets, which)
    pictures = _rows(keyframes.thumbnail_offsets, which)

    def turn(at: np.ndarray) -> np.ndarray:
        return (at @ world[:3, :3].T + world[:3, 3]).astype(np.float32)

    stamp = np.asarray(keyframes.stamp_s)
    return replace(
        keyframes,
        stamp_s=stamp[which] + number * 1e-6,  # the recording's length stays what it is
        world_from_camera=world @ np.asarray(keyframes.world_from_camera)[which],
        centre=turn(np.asarray(keyframes.centre)[which]),
        view=np.asarray(keyframes.view)[which],
        place=np.asarray(keyframes.place)[which],
        offsets=np.diff(keyframes.offsets)[which],
        xy=np.asarray(keyframes.xy)[points],
        descriptors=np.asarray(keyframes.descriptors)[points],
        points_world=turn(np.asarray(keyframes.points_world)[points]),
        thumbnail_offsets=np.diff(keyframes.thumbnail_offsets)[which],
        thumbnails=np.asarray(keyframes.thumbnails)[pictures],
        score=np.asarray(keyframes.score)[points] if len(keyframes.score) else keyframes.score,
        clear_mm=np.asarray(keyframes.clear_mm)[which] if len(keyframes.clear_mm) else keyframes.clear_mm,
    )


def _rows(offsets: np.ndarray, which: np.ndarray) -> np.ndarray:
    return np.concatenate([np.arange(int(offsets[k]), int(offsets[k + 1])) for k in which])


def _joined(frames: list[Keyframes]) -> Keyframes:
    """Return all keyframes in the order of time; ``offsets`` of each hold the lengths of its ragged rows."""
    names = [field.name for field in fields(Keyframes)]
    columns = {name: np.concatenate([getattr(one, name) for one in frames]) for name in names}
    order = np.argsort(columns["stamp_s"], kind="stable")
    for lengths, ragged in (("offsets", ("xy", "descriptors", "points_world", "score")),
                            ("thumbnail_offsets", ("thumbnails",))):  # fmt: skip
        rows = _rows(np.append(0, np.cumsum(columns[lengths])), order)
        for name in ragged:
            columns[name] = columns[name][rows] if len(columns[name]) else columns[name]
        columns[lengths] = np.append(0, np.cumsum(columns[lengths][order]))
    for name in ("stamp_s", "world_from_camera", "centre", "view", "place"):
        columns[name] = columns[name][order]
    columns["clear_mm"] = columns["clear_mm"][order] if len(columns["clear_mm"]) else columns["clear_mm"]
    return Keyframes(**columns)


def write_tiled(source: Path, out: Path, count: int, seed: int = 0) -> None:
    """Write the map."""
    stored = read(source)
    voxels, keyframes = tiled(stored, count, seed)
    info, structs = stored.info, msgspec.structs
    counts = structs.replace(info.counts, voxels=len(voxels), keyframes=len(keyframes))
    box = MapBounds.of(voxels.index, info.voxel_size_m)
    info = structs.replace(info, counts=counts, bounding_box_m=box, build_key="")
    write(out, MapData(info, voxels, keyframes, stored.sounds, stored.place_state))


def main() -> None:
    """Write the map of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--voxels", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    write_tiled(chosen.map, chosen.out, chosen.voxels, chosen.seed)


if __name__ == "__main__":
    main()
