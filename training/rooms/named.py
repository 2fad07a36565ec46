"""What an encoder names in rendered rooms: which name the voxels of each true thing get, counted in maps of homes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from training.rooms.furnished import Surfaces

from avlmaps.query.words import VoxelNamer
from avlmaps_sim.bench.harness.workplace import Workplace, scene_jobs
from avlmaps_sim.bench.indexing.runs import IndexingSettings
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.scenes import open_scene

FRAMES = 240
# From this surface in all maps the names of a thing's voxels are known; below, the thing is partly taken for itself.
_KNOWN_M2 = 2.0
_CHUNK = 20_000


def naming_counts(homes: Sequence[str], work: Path) -> tuple[tuple[str, ...], Float[np.ndarray, "t t"]]:
    """Return the encoder's names, and the surface of each true thing (row) that it gives each name, m².

    Args:
        homes: names of scenes, which are recorded and mapped with the embedded profile.
        work: folder of recordings and maps; what is there is not made again.
    """
    settings = IndexingSettings(scenes=tuple(homes), frames=FRAMES, jobs=1)
    names: tuple[str, ...] = ()
    counts = np.zeros((0, 0))
    for job in scene_jobs(settings, settings.recorded, settings.scenes, work):
        place = Workplace(job, open_scene)
        namer = VoxelNamer(place.avlmap)
        if not names:
            names, counts = namer.names, np.zeros((len(namer.names), len(namer.names)))
        row_of = {name: number for number, name in enumerate(names)}
        true = np.array([row_of.get(thing.category, -1) for thing in place.truth.objects] + [-1])[place.label]
        face_m2 = place.avlmap.space.grid.voxel_size_m**2
        for start in range(0, len(true), _CHUNK):
            rows = np.arange(start, min(start + _CHUNK, len(true)))
            known = true[rows] >= 0
            np.add.at(counts, true[rows][known], namer.confidences(rows[known]).astype(np.float64) * face_m2)
    return names, counts


def named_surfaces(surfaces: Surfaces, names: Sequence[str], counts: Float[np.ndarray, "t t"]) -> Surfaces:
    """Return the mean surface, m², that an encoder names so, by name and by kind of room.

    Structure is left out on both sides: every room has walls.

    Args:
        surfaces: what stands there.
        names: of the encoder.
        counts: of ``naming_counts``.
    """
    seen = counts.sum(axis=1, keepdims=True)
    trust = np.minimum(seen / _KNOWN_M2, 1.0)
    share = trust * counts / np.maximum(seen, 1e-9) + (1.0 - trust) * np.eye(len(names))
    kinds = sorted({kind for by_kind in surfaces.values() for kind in by_kind})
    true = np.array([[surfaces.get(name, {}).get(kind, 0.0) for kind in kinds] for name in names])
    named = share.T @ true
    return {
        name: {kind: float(named[row, column]) for column, kind in enumerate(kinds)}
        for row, name in enumerate(names)
        if name not in (*STRUCTURE, "other") and named[row].any()
    }
