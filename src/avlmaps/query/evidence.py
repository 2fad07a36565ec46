"""The evidence that a goal is right: of the thing itself, of what it is near, and of the room.

All are numbers from the map; ``probability.py`` turns them into the probability that the goal is right.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.question import Modality
from avlmaps.query.factors import Factor, NearAnchors, NearThings, lead_of

# Log-odds beyond these are no better known: a confidence of 0.98 and one of 0.998 are alike.
_MOST_LOGIT = 4.0
_LEAST_HEAT, _LEAST_SCORE = 0.02, 0.01


@dataclass(frozen=True, slots=True)
class GoalEvidence:
    """What speaks for a goal.

    Attributes:
        lead: what is sought.
        context: what it is near or in; empty for a query of one part.
        alone: probability that the thing there is what is sought, by itself.
        thing: log-odds of that.
        near: log of the heat of what it is near, there; 0 beside it.
        room: log of the probability that it stands in such an area.
        marks: log-odds of the least certain of the things, sounds and photos that it is near.
    """

    lead: Modality
    context: tuple[Modality, ...]
    alone: float
    thing: float
    near: float = 0.0
    room: float = 0.0
    marks: float = 0.0


def evidence_of(
    factors: Sequence[Factor], instance: int, position: Float[np.ndarray, "3"], peak: float
) -> GoalEvidence:
    """Return the evidence for a goal."""
    lead = lead_of(factors)
    context = [factor for factor in factors if factor is not lead]
    itself = float(lead.scores[lead.instance == instance].max(initial=0.0)) if isinstance(lead, NearAnchors) else 1.0
    alone = itself * float(lead.confidence[instance])
    rooms = [factor for factor in context if factor.part.modality is Modality.AREA]
    room = float(np.prod([_mean_heat(factor, lead, instance, position) for factor in rooms]))
    near = peak / max(itself * room, _LEAST_SCORE) if context else 1.0
    marks = [_mark(factor, position) for factor in context if factor not in rooms]
    return GoalEvidence(
        lead.part.modality,
        tuple(factor.part.modality for factor in context),
        alone,
        logit(alone),
        float(np.log(np.clip(near, _LEAST_HEAT, 1.0))),
        float(np.log(np.clip(room, _LEAST_HEAT, 1.0))),
        min(map(logit, marks), default=0.0),
    )


def logit(probability: float) -> float:
    """Return the log-odds of a probability, at most 4 from 0."""
    held = min(max(probability, 1e-6), 1.0 - 1e-6)
    return float(np.clip(np.log(held / (1.0 - held)), -_MOST_LOGIT, _MOST_LOGIT))


def _mean_heat(region: Factor, lead: Factor, instance: int, position: Float[np.ndarray, "3"]) -> float:
    if not isinstance(lead, NearThings) or not region.regional:
        return float(region.at(position[None])[0])
    return float(region.among(lead.mask)[lead.mask][lead.instance == instance].mean(dtype=np.float64))


def _mark(factor: Factor, position: Float[np.ndarray, "3"]) -> float:
    if not len(factor.anchors):
        return 0.0
    away = np.linalg.norm(factor.anchors - position, axis=1)
    if isinstance(factor, NearAnchors):
        nearest = int(np.argmax(factor.scores - factor.falloff_per_m * away))
        return float(factor.scores[nearest] * factor.confidence[factor.instance[nearest]])
    return float(factor.confidence[factor.instance[int(np.argmin(away))]])
