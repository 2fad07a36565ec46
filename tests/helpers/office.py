"""An office of 110 things on two floors as a stored map: boxes of known names in rooms of known kinds."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.map_data import MapData, encoders_of_map
from avlmaps.maps.types import Keyframes, Voxels
from avlmaps.perception.embedded.pixels import features_of
from avlmaps.recordings.open import open_recording
from helpers.made_once import made_once
from helpers.walked_room import shared_walk

VOXEL_M = 0.1
ROOM_M, HEIGHT_M = 4.0, 3.2
# Kind of room, floor, column, and what stands in it.
ROOMS: tuple[tuple[str, int, int, dict[str, int]], ...] = (
    ("office", 0, 0, {"desk": 4, "office chair": 6, "monitor": 4, "bookshelf": 2}),
    ("office", 0, 1, {"desk": 4, "office chair": 6, "monitor": 4}),
    ("kitchen", 0, 2, {"refrigerator": 1, "stove": 1, "sink": 1, "dining table": 2, "chair": 8}),
    ("bathroom", 0, 3, {"toilet": 2, "sink": 3}),
    ("office", 1, 0, {"desk": 4, "office chair": 6, "monitor": 4, "plant": 6}),
    ("meeting room", 1, 1, {"chair": 10, "tv": 1, "whiteboard": 3, "lamp": 4}),
    ("living room", 1, 2, {"sofa": 4, "tv": 2, "plant": 6, "lamp": 6, "armchair": 6}),
)
SIZES = {"desk": (6, 5, 7), "sofa": (8, 6, 7)}


def names() -> list[str]:
    """Return the name of each thing."""
    return [name for *_, things in ROOMS for name, count in things.items() for _ in range(count)]


def office_of(factory: pytest.TempPathFactory) -> Path:
    """Return the map of the office, in a folder of the caller's own."""
    return made_once(factory, "office", lambda folder: _write_office(folder, shared_walk(factory))) / "office.avlmap"


def _write_office(folder: Path, walk: Path) -> None:
    """Build the map of a small room, and put the office's voxels and views in the place of its own."""
    path = folder / "office.avlmap"
    # Every frame, so that each room has the views without which it is none.
    stored = build_map(open_recording(walk), path, "embedded", BuildSettings(VOXEL_M), progress=False)
    encoders = encoders_of_map(stored.info)
    pixels: Any = encoders.pixels
    index, which = _voxels()
    kinds = sorted({*names(), "floor", "wall"})
    likely = np.full((len(kinds), len(pixels.names)), 0.02 / len(pixels.names), np.float32)
    for row, kind in zip(likely, kinds, strict=True):
        row[pixels.names.index(kind)] += 0.98
    feature = features_of(likely / likely.sum(axis=1, keepdims=True), pixels.codes)
    order = np.lexsort((index[:, 2], index[:, 1], index[:, 0]))
    index, which = index[order], which[order]
    n = len(index)
    voxels = Voxels(
        index.astype(np.int32), feature[[kinds.index(name) for name in which]].astype(np.float16),
        np.ones(n, np.float32), np.full((n, 3), 128, np.uint8), np.full(n, 3.0), np.full(n, 9),
    )  # fmt: skip
    info = msgspec.structs.replace(
        stored.info,
        counts=msgspec.structs.replace(stored.info.counts, voxels=n, keyframes=len(stored.keyframes)),
        bounding_box_m=msgspec.structs.replace(
            stored.info.bounding_box_m,
            low=tuple(float(value) for value in index.min(axis=0) * VOXEL_M),
            high=tuple(float(value) for value in (index.max(axis=0) + 1) * VOXEL_M),
        ),
        ground=None,
        build_key="0" * 64,
    )
    keyframes = _keyframes(stored.keyframes, encoders.views)
    write(path, MapData(info, voxels, keyframes, stored.sounds, stored.place_state))
    read(path)


def _voxels() -> tuple[np.ndarray, np.ndarray]:
    """Return the voxels and the name of each: floors, walls between the rooms, and things on a grid in each room."""
    boxes: list[tuple[str, np.ndarray, np.ndarray]] = []
    side, high = round(ROOM_M / VOXEL_M), round(HEIGHT_M / VOXEL_M)
    for _, floor, column, things in ROOMS:
        low = np.array([column * side, 0, floor * high])
        boxes.append(("floor", low, low + np.array([side, side, 1])))
        boxes.append(("wall", low + np.array([side - 1, 0, 1]), low + np.array([side, side, 24])))
        names_here = [name for name, count in things.items() for _ in range(count)]
        columns = int(np.ceil(np.sqrt(len(names_here))))
        step = (side - 3) // columns
        for number, name in enumerate(names_here):
            i, j = divmod(number, columns)
            at = low + np.array([1 + i * step, 1 + j * step, 1])
            size = np.minimum(SIZES.get(name, (4, 4, 9)), [step - 2, step - 2, 12])
            boxes.append((name, at, at + size))
    index = [np.stack(np.meshgrid(*map(np.arange, a, b), indexing="ij"), -1).reshape(-1, 3) for _, a, b in boxes]
    which = np.concatenate([np.full(len(part), name) for part, (name, _, _) in zip(index, boxes, strict=True)])
    return np.concatenate(index), which


def _keyframes(own: Keyframes, views: Any) -> Keyframes:
    """Return the room's keyframes, each put into a room of the office, which it sees."""
    middles = [
        (kind, np.array([(column + 0.5) * ROOM_M, 0.5 * ROOM_M, floor * HEIGHT_M])) for kind, floor, column, _ in ROOMS
    ]
    poses, centre, view = own.world_from_camera.copy(), np.array(own.centre), np.array(own.view)
    for k in range(len(own)):
        kind, middle = middles[k % len(middles)]
        shift = 0.3 * np.array([np.cos(k), np.sin(k), 0.0])
        poses[k, :3, 3] = middle + shift + [0.0, 0.0, 1.3]
        centre[k] = middle + shift + [0.0, 0.0, 0.6]
        view[k] = views.codes[views.names.index(kind)]
    return replace(own, world_from_camera=poses, centre=centre, view=view)
