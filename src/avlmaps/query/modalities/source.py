"""Where a sound came from, as heat."""

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.question import Part
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearAnchors
from avlmaps.query.modalities.sound import SoundSettings
from avlmaps.query.sound_sources import SourceMap
from avlmaps.query.voxel_space import Space


def source_factor(
    space: Space,
    sources: SourceMap,
    scores: Float[np.ndarray, " sounds"],
    part: Part,
    settings: SoundSettings,
    heat: HeatSettings,
) -> NearAnchors:
    """Return the heat of where a sound came from: its anchors are the cells of the regions of its sources.

    A cell has the source's score times how likely it is against the likeliest cell. Sounds that are one yes together;
    those of a lower score stay by themselves.

    Args:
        space: the map's voxels.
        sources: the evidence.
        scores: for each detected sound, in [0, 1]: the probability that it matches the query.
        part: the part of the query.
        settings: the prior.
        heat: the falloff.
    """
    order = np.argsort(-scores, kind="stable")
    kind, with_prior = "" if part.is_file else part.query, settings.prior == "lexicon"
    found = sources.sources([i for i in order.tolist() if scores[i] >= FOUND_AT], kind, with_prior)
    found += [sources.joined([i], kind, with_prior) for i in order.tolist() if 0.05 <= scores[i] < FOUND_AT]
    places, values, which = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, np.int64)]
    for number, one in enumerate(found):
        cells, share = sources.anchors(one)
        places.append(cells)
        values.append(share * max(float(np.clip(scores[i], 0.0, 1.0)) for i in one.events))
        which.append(np.full(len(cells), number))
    best = float(np.max(scores, initial=0.0))
    note = ""
    if best < FOUND_AT:
        note = f"none of the {len(scores)} detected sounds is like {part.query!r}; the best score is {best:.2f}"
    return NearAnchors(
        space, part, heat.falloff_per_m(part.role), np.concatenate(places), np.concatenate(values),
        np.concatenate(which), best >= FOUND_AT, part.query, note,
    )  # fmt: skip
