"""Where a sound came from, as heat."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.question import Part, Role
from avlmaps.maps.sources.density import RIGHT_M, Spread
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearAnchors
from avlmaps.query.modalities.sound import SoundSettings
from avlmaps.query.sound_sources import SourceMap
from avlmaps.query.voxel_space import Space

_LEAST = 0.05  # sounds of a lower score are left out


@dataclass(frozen=True, eq=False, kw_only=True)
class SourceAnchors(NearAnchors):
    """Heat of where sounds came from: the anchors of a source are the cells of its region.

    What is sought is right where the sound is one and its source lies so near; as context the sound alone counts.

    Attributes:
        spreads: for each source, how well its place is known.
        part: says that the place is the source's.
        waits: whether such a sound was heard whose place is not found yet, in a map that grows.
    """

    spreads: tuple[Spread, ...]
    waits: bool = False
    found: bool = field(init=False)
    note: str = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        best = float((self.scores * self.confidence[self.instance]).max(initial=0.0))
        object.__setattr__(self, "found", best >= FOUND_AT)
        object.__setattr__(self, "note", "" if self.found else self._absence())

    @cached_property
    def confidence(self) -> Float[np.ndarray, " i"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Probability that the source of each lies where its heat is highest, within ``RIGHT_M``; 1 of context."""
        if self.part.role is Role.CONTEXT:
            return np.ones(len(self.spreads))
        return np.array([spread.right for spread in self.spreads])

    def spread_of(self, instance: int) -> Spread:
        """Return how well the place of a source is known."""
        return self.spreads[instance]

    def _absence(self) -> str:
        best = float(self.scores.max(initial=0.0))
        if best < FOUND_AT and self.waits:
            return "it was heard, but where it came from is not known (a map that grows finds it in a moment)"
        if best < FOUND_AT:
            return f"no detected sound is like {self.part.query!r}; the best score is {best:.2f}"
        spread = self.spreads[int(self.instance[np.argmax(self.scores * self.confidence[self.instance])])]
        return (
            f"it was heard, but its source is only known to lie {spread.around('the best guess')}; a goal is right "
            f"within {RIGHT_M:g} m"
        )


def source_factor(
    space: Space,
    sources: SourceMap,
    scores: Float[np.ndarray, " sounds"],
    part: Part,
    settings: SoundSettings,
    heat: HeatSettings,
) -> SourceAnchors:
    """Return the heat of where a sound came from.

    A cell has the source's score times how likely it is against the likeliest cell. Sounds that are one yes together;
    those of a lower score stay by themselves.

    ``scores`` are, for each detected sound, the probability that it matches the query.
    """
    order = np.argsort(-scores, kind="stable")
    kind, with_prior = "" if part.is_file else part.query, settings.prior == "lexicon"
    found = sources.sources([i for i in order.tolist() if scores[i] >= FOUND_AT], kind, with_prior)
    unsure = [i for i in order.tolist() if _LEAST <= scores[i] < FOUND_AT and sources.is_located(i)]
    found += [sources.joined([i], kind, with_prior) for i in unsure]
    places, values, which = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, np.int64)]
    for number, one in enumerate(found):
        cells, share = sources.anchors(one)
        places.append(cells)
        values.append(share * max(float(np.clip(scores[i], 0.0, 1.0)) for i in one.events))
        which.append(np.full(len(cells), number))
    return SourceAnchors(
        space=space, part=replace(part, at="source"), falloff_per_m=heat.falloff_per_m(part.role),
        anchors=np.concatenate(places), scores=np.concatenate(values), instance=np.concatenate(which),
        understood=part.query, spreads=tuple(one.density.spread for one in found),
        waits=any(scores[i] >= FOUND_AT and not sources.is_located(i) for i in order.tolist()),
    )  # fmt: skip
