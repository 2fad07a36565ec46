"""What changed though no list names it: surface that only one of two days has, in groups that are things."""

from collections.abc import Iterator, Sequence

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.poses import plain_point
from avlmaps.days.settings import ChangeSettings
from avlmaps.days.surfaces import Occupied
from avlmaps.maps.store.reader import StoredMap
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.components import linked
from avlmaps.query.contents import STRUCTURE, Thing
from avlmaps.query.naming import VoxelNamer

_MOSTLY = 0.5  # a thing changed where the other days have no surface at this part of its voxels
_LOOKED = 0.25  # rays pass through this part of a group of voxels that is one thing
_BESIDE = 2  # voxels: so near to each other two are of one thing


def changed_things(
    stored: StoredMap,
    loose: Bool[np.ndarray, " n"],
    through: Bool[np.ndarray, " n"],
    owned: Sequence[Int[np.ndarray, " r"]],
    settings: ChangeSettings,
) -> list[Thing]:
    """Return what changed, each as a thing with the likeliest name of its voxels together.

    Voxels that touch are one thing where rays of another day pass through enough of them. Of a group that is too large
    for a thing, or hardly looked at, those alone that rays pass through are. What lies beside a thing that changed
    itself is a part of it.
    """
    index = np.asarray(stored.voxels.index)
    changed = [rows for rows in owned if loose[rows].sum() > _MOSTLY * len(rows)]
    parts_of = Occupied.of(
        np.concatenate([np.zeros((0, 3), np.int32), *(index[rows] for rows in changed)]), stored.grid
    )
    loose = loose.copy()
    for rows in owned:
        loose[rows] = False
    if "pixels" not in stored.info.models or not (loose & through).any():
        return []
    avlmap, namer = AVLMap(stored, edits=()), VoxelNamer(stored)
    voxel_m = stored.grid.voxel_size_m
    named = np.array([name not in (*STRUCTURE, "other") for name in namer.names])

    def size_m(own: Int[np.ndarray, " k"]) -> Float[np.ndarray, "3"]:
        return np.ptp(avlmap.space.level(avlmap.space.centres_of(own)), axis=0) + voxel_m

    def groups(rows: Int[np.ndarray, " r"]) -> Iterator[Int[np.ndarray, " k"]]:
        which = linked(index[rows], _BESIDE)
        enough = np.bincount(which, weights=through[rows]) >= settings.least_voxels
        yield from (rows[which == number] for number in np.flatnonzero(enough))

    found: list[Thing] = []
    for whole in groups(np.flatnonzero(loose)):
        is_thing = size_m(whole).max() <= settings.most_m and through[whole].mean() >= _LOOKED
        for own in [whole] if is_thing else groups(whole[through[whole]]):
            points, size = avlmap.space.centres_of(own), size_m(own)
            if size[2] < settings.lowest_voxels * voxel_m or size.max() > settings.most_m or not named.any():
                continue
            if parts_of.near(points, _BESIDE + 0.5).any():
                continue
            share = np.where(named, namer.confidences(own).mean(axis=0), -1.0)
            best = int(share.argmax())
            r, g, b = (int(value) for value in np.asarray(stored.voxels.rgb)[own].mean(axis=0).round())
            middle = points[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
            likely = round(min(float(share[best]), settings.confident_at - 0.01), 3)
            found.append(
                Thing(namer.names[best], likely, plain_point(middle), plain_point(size), (r, g, b), own, points)
            )
    return found
