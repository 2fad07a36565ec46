"""What the end of a build finds in a map by its encoders' names, stored with the map: closest names, things, rooms.

``MapData.findings`` holds it. Each finding has a key of what it was found with; a map with other encoders or settings
than those is looked through again.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from avlmaps.core.arrays import Int
from avlmaps.core.version import __version__
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.instances import Instances, Segmentation
from avlmaps.query.room_regions import RoomRegions
from avlmaps.query.rooms import RoomField
from avlmaps.query.scores import Closest
from avlmaps.query.storey_grid import StoreyGrid

if TYPE_CHECKING:
    from avlmaps.query.modalities.area import AreaSettings

Findings = Mapping[str, np.ndarray]
Search = tuple[str, bool]
"""A name, and whether it stands for itself alone, without narrower ones."""
_OF_INSTANCES = {
    "rows": np.int32, "instance": np.int32, "margin": np.float32, "score": np.float32, "confidence": np.float32,
}  # fmt: skip
_CLOSEST = ("best", "best_word", "second", "second_word")


def key_of(*ingredients: Any) -> np.ndarray:
    """Return a hash as bytes; another release of avlmaps finds its own."""
    said = msgspec.json.encode((__version__, ingredients), order="deterministic")
    return np.frombuffer(hashlib.sha256(said).digest(), np.uint8)


def _plan_key(plan: FloorPlan) -> np.ndarray:
    return key_of(plan.wall.shape, plan.origin_m.tolist())


def _known(findings: Findings, name: str, key: np.ndarray) -> bool:
    return name in findings and np.array_equal(findings[name], key)


def names_to_arrays(closest: Closest, key: np.ndarray) -> dict[str, np.ndarray]:
    """Return the two words closest to each voxel as arrays."""
    return {"names.key": key, **{f"names.{name}": array for name, array in zip(_CLOSEST, closest, strict=True)}}


def names_from(findings: Findings, key: np.ndarray) -> Closest | None:
    """Return the two words closest to each voxel; None where other words were compared."""
    if not _known(findings, "names.key", key):
        return None
    best, best_word, second, second_word = (findings[f"names.{name}"] for name in _CLOSEST)
    return best, best_word, second, second_word


def searches_to_arrays(searches: Mapping[Search, Segmentation], key: np.ndarray) -> dict[str, np.ndarray]:
    """Return the instances of names as arrays, those of one name after those of another."""
    names = np.frombuffer(msgspec.json.encode(list(searches)), np.uint8)
    found = [(len(one.instances.rows), len(one.instances), one.won, one.best) for one in searches.values()]
    arrays = {"things.key": key, "things.names": names, "things.counts": np.array(found, np.float64).reshape(-1, 4)}
    for name, kind in _OF_INSTANCES.items():
        parts = [np.asarray(getattr(one.instances, name), kind) for one in searches.values()]
        arrays[f"things.{name}"] = np.concatenate([np.zeros(0, kind), *parts])
    return arrays


def searches_from(findings: Findings, key: np.ndarray) -> dict[Search, Segmentation]:
    """Return the instances of names; none where they were found otherwise."""
    if not _known(findings, "things.key", key):
        return {}
    names = msgspec.json.decode(findings["things.names"].tobytes(), type=list[Search])
    counts, columns = findings["things.counts"], [findings[f"things.{name}"] for name in _OF_INSTANCES]
    ends = np.cumsum(counts[:, :2].astype(np.int64), axis=0)
    begins = ends - counts[:, :2].astype(np.int64)
    found = dict[Search, Segmentation]()
    for name, (row, first), (stop, last), (_, _, won, best) in zip(names, begins, ends, counts.tolist(), strict=True):
        rows, instance, margin, score = (column[row:stop] for column in columns[:-1])
        instances = Instances(rows, instance, margin, score, columns[-1][first:last])
        found[name] = Segmentation(instances, int(won), best)
    return found


def regions_to_arrays(regions: RoomRegions) -> dict[str, np.ndarray]:
    """Return the rooms of all storeys as arrays."""
    arrays = {
        "rooms.key": _plan_key(regions.plan),
        "rooms.count": np.array([regions.count]),
        "rooms.beside": regions.beside,
    }
    for number, (grid, label) in enumerate(zip(regions.grids, regions.labels, strict=True)):
        arrays[f"rooms.{number}.frame"] = np.array([grid.heading_rad, *grid.origin_m, grid.cell_m])
        arrays[f"rooms.{number}.cells"] = np.stack([grid.wall, grid.free, grid.stood])
        arrays[f"rooms.{number}.label"] = label
    return arrays


def regions_from(findings: Findings, plan: FloorPlan) -> RoomRegions | None:
    """Return the rooms of all storeys; None where they were found otherwise."""
    if not _known(findings, "rooms.key", _plan_key(plan)):
        return None
    grids: list[StoreyGrid] = []
    labels: list[Int[np.ndarray, "nx ny"]] = []
    for number in range(len(plan.storeys)):
        frame, cells, label = (findings[f"rooms.{number}.{name}"] for name in ("frame", "cells", "label"))
        grids.append(StoreyGrid(float(frame[0]), frame[1:3], float(frame[3]), *cells))
        labels.append(label)
    return RoomRegions(plan, tuple(grids), tuple(labels), int(findings["rooms.count"][0]), findings["rooms.beside"])


def field_to_arrays(field: RoomField, settings: "AreaSettings") -> dict[str, np.ndarray]:
    """Return the kinds of rooms as arrays."""
    key = key_of(_plan_key(field.plan).tolist(), field.kinds, asdict(settings))
    return {"kinds.key": key, "kinds.share": field.share, "kinds.views": np.ascontiguousarray(field.views)}


def field_from(
    findings: Findings, plan: FloorPlan, kinds: tuple[str, ...], settings: "AreaSettings"
) -> RoomField | None:
    """Return how likely each cell is each kind of room; None where that was found otherwise."""
    if not _known(findings, "kinds.key", key_of(_plan_key(plan).tolist(), kinds, asdict(settings))):
        return None
    return RoomField(plan, kinds, findings["kinds.share"], findings["kinds.views"])
