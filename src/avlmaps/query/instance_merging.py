"""Which connected voxels are too unsure to be a thing, and which are pieces of one."""

from dataclasses import replace

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.query.factors import NearThings
from avlmaps.query.loops import connected, distinct

_SPECK_M2 = 0.0199  # a guess shows at least as much surface as a mug


def without_specks(
    mask: Bool[np.ndarray, " n"], instance: Int[np.ndarray, " a"], confidence: Float32[np.ndarray, " i"], least: float
) -> tuple[Bool[np.ndarray, " n"], Int[np.ndarray, " b"], Float32[np.ndarray, " j"]]:
    """Return the voxels, instances and confidences of the instances that are confident enough to count."""
    kept = confidence >= least
    stays = kept[instance]
    thinned = np.zeros(len(mask), bool)
    thinned[np.flatnonzero(mask)[stays]] = True
    return thinned, (np.cumsum(kept) - 1)[instance[stays]], confidence[kept]


def merge_instances(
    points_level: Float[np.ndarray, "a 3"], instance: Int[np.ndarray, " a"], cell_m: float, join_m: float
) -> Int[np.ndarray, " i"]:
    """Return for each instance the number of the thing that it is a piece of.

    A thing of thin parts comes in pieces: the camera saw a chair's legs and its back and little between. Two
    pieces are one thing where at least half of the smaller one's columns (of ``cell_m``, top-down) hold the
    other too, with nothing else between them and at most ``join_m`` in height.
    """
    count = int(instance.max(initial=-1)) + 1
    column = np.floor(points_level[:, :2] / cell_m).astype(np.int64)
    column -= column.min(axis=0, initial=0)
    cell = column[:, 0] * (column[:, 1].max(initial=0) + 1) + column[:, 1]
    cells = int(cell.max(initial=0)) + 1
    columns = np.bincount(distinct(instance * cells + cell) // cells, minlength=count)
    order = np.lexsort((points_level[:, 2], cell))
    below, above = order[:-1], order[1:]
    near = (cell[below] == cell[above]) & (points_level[above, 2] - points_level[below, 2] <= join_m)
    meeting = near & (instance[below] != instance[above])
    a, b = np.sort(np.stack([instance[below], instance[above]])[:, meeting], axis=0)
    pairs, pair = np.unique(a * count + b, return_inverse=True)
    times = np.bincount(distinct(pair * cells + cell[below][meeting]) // cells, minlength=len(pairs))  # in columns
    a, b = np.divmod(pairs, max(count, 1))
    same = 2 * times >= np.minimum(columns[a], columns[b])
    return connected(count, a[same], b[same])


def likeliest(things: NearThings) -> NearThings:
    """Return the best guesses among uncertain instances: no specks, and at least half of the highest confidence."""
    surface_m2 = np.bincount(things.instance, minlength=len(things.confidence)) * things.space.grid.voxel_size_m**2
    solid = np.where(surface_m2 >= _SPECK_M2, things.confidence, 0.0).astype(np.float32)
    least = max(float(np.max(solid, initial=0.0)) / 2, float(np.finfo(np.float32).tiny))
    mask, instance, confidence = without_specks(things.mask, things.instance, solid, least)
    return replace(things, mask=mask, instance=instance, confidence=confidence, with_uncertain=lambda: things)
