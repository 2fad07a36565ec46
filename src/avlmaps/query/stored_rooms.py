"""The rooms of a large map and their kinds, stored beside it (``maps.store.derived``)."""

import hashlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.maps.store.derived import Derivation
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.room_regions import NONE, RoomRegions
from avlmaps.query.rooms import RoomField
from avlmaps.query.stored_place import place_of
from avlmaps.query.storey_grid import StoreyGrid

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap
    from avlmaps.query.modalities.area import AreaSettings

_MODULES = tuple(
    f"avlmaps.query.{name}"
    for name in ("stored_rooms", "room_regions", "storey_grid", "storey_kernels", "doorways", "raster", "floor_plan")
)


def room_regions_of(stored: "StoredMap", plan: FloorPlan, width_rad: float) -> RoomRegions:
    """Return the rooms of a map: those that are stored, or found now and stored where its folder can be written."""
    poses = np.asarray(stored.keyframes.world_from_camera)
    place = _place(stored, plan, width_rad)
    arrays = None if place is None else place.read()
    known = None if arrays is None else _from_arrays(plan, arrays)
    if known is not None:
        return known
    regions = RoomRegions.of(plan, poses, width_rad)
    if place is not None:
        place.write(_to_arrays(regions))
    return regions


def room_field_of(
    stored: "StoredMap",
    called: str,
    plan: FloorPlan,
    kinds: tuple[str, ...],
    share: Float[np.ndarray, "k n"],
    settings: "AreaSettings",
    find: Callable[[], RoomField],
) -> RoomField:
    """Return how likely each cell is each kind of room: as it is stored, or found now and stored."""
    views = hashlib.sha256(np.ascontiguousarray(share, np.float64).tobytes()).hexdigest()
    place = place_of(stored, called, [settings], [kinds, views, plan.origin_m.tolist(), plan.wall.shape])
    arrays = None if place is None else place.read()
    if arrays is not None and set(arrays) == {"share", "views"}:
        shapes = arrays["share"].shape, arrays["views"].shape
        types = {array.dtype for array in arrays.values()}
        if shapes == ((len(plan), len(kinds)), (len(plan),)) and types == {np.dtype(np.float32)}:
            return RoomField(plan, kinds, arrays["share"], arrays["views"])
    field = find()
    if place is not None:
        place.write({"share": field.share, "views": np.ascontiguousarray(field.views)})
    return field


def _place(stored: "StoredMap", plan: FloorPlan, width_rad: float) -> Derivation | None:
    space = plan.space
    heights = np.array([[storey.floor_m, storey.low_m] for storey in plan.storeys.all])
    numbers = np.concatenate([heights.reshape(-1), plan.origin_m, space.level_from_world.reshape(-1)])
    given = [hashlib.sha256(numbers.tobytes()).hexdigest(), list(plan.wall.shape), width_rad, space.grid.voxel_size_m]
    files = ["voxels/index", "keyframes/world_from_camera"]
    return Derivation.of(stored.path, stored.info, "rooms", files, _MODULES, given)


def _to_arrays(regions: RoomRegions) -> dict[str, np.ndarray]:
    arrays: dict[str, np.ndarray] = {"count": np.array([regions.count]), "beside": regions.beside}
    for number, (grid, label) in enumerate(zip(regions.grids, regions.labels, strict=True)):
        arrays[f"frame_{number}"] = np.array([grid.heading_rad, *grid.origin_m, grid.cell_m])
        arrays[f"cells_{number}"] = np.stack([grid.wall, grid.free, grid.stood])
        arrays[f"label_{number}"] = label
    return arrays


def _from_arrays(plan: FloorPlan, arrays: Mapping[str, np.ndarray]) -> RoomRegions | None:
    """Return stored rooms; None where the arrays are not those of this many storeys, or name rooms that are none."""
    storeys = range(len(plan.storeys))
    if set(arrays) != {"count", "beside", *(f"{name}_{k}" for k in storeys for name in ("frame", "cells", "label"))}:
        return None
    count, beside = int(arrays["count"].sum()), arrays["beside"]
    if beside.ndim != 2 or beside.shape[1:] != (2,) or not 0 <= beside.min(initial=0) <= beside.max(initial=0) <= count:
        return None
    grids: list[StoreyGrid] = []
    labels: list[Int[np.ndarray, "nx ny"]] = []
    for number in storeys:
        frame: Float[np.ndarray, 4] = arrays[f"frame_{number}"]
        cells, label = arrays[f"cells_{number}"], arrays[f"label_{number}"]
        if frame.shape != (4,) or cells.shape != (3, *label.shape) or not label.size:
            return None
        if not NONE <= int(label.min()) <= int(label.max()) < count:
            return None
        grids.append(StoreyGrid(float(frame[0]), frame[1:3], float(frame[3]), *cells))
        labels.append(label)
    return RoomRegions(plan, tuple(grids), tuple(labels), count, beside)
