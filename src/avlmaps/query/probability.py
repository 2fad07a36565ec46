"""How likely a goal is right, all parts of the query together: a product of what makes it so, each with its own odds.

    p = s(thing) * s(near) * s(marks) * s(room),   s the logistic function of a weight times a number, and a bias

so that a goal is likely only where the thing, how near it is, what it is near and the room all are: beside a photo
whose place is certain, a thing 4 m away is no nearer. It is at most the probability of the thing alone. The weights
(``found.json``) are fitted by ``training/found`` on homes that no table uses, half of the queries being for what is not
there. A thing, a sound, an area or a photo alone is as likely as the models that made it out say: those are calibrated
by themselves.
"""

import json
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from avlmaps.core.question import Modality
from avlmaps.query.evidence import GoalEvidence

NUMBERS = ("thing", "near", "room", "marks")
"""The numbers of the evidence that have a weight."""
FACTORS = {"thing": ("thing",), "near": ("near",), "marks": ("marks",), "room": ("room",)}
"""The factors of the product, and the numbers that each weighs; the weights have a bias for each as well."""
Weights = Mapping[str, float]


def probability_of(evidence: GoalEvidence, given: Weights | None = None) -> float:
    """Return the probability that a goal with this evidence is right, by the weights that ship or those given."""
    all_parts = math.prod(factor_values(evidence, given).values()) if evidence.context else 1.0
    return round(min(all_parts, evidence.alone), 3)  # more digits would be noise


def factor_values(evidence: GoalEvidence, given: Weights | None = None) -> dict[str, float]:
    """Return each factor of the probability of a goal of several parts, by its name."""
    own = given or weights()
    odds = {
        factor: own[f"{factor}_bias"] + sum(own[name] * getattr(evidence, name) for name in FACTORS[factor])
        for factor in factors_of(evidence)
    }
    return {factor: 1.0 / (1.0 + math.exp(-value)) for factor, value in odds.items()}


def factors_of(evidence: GoalEvidence) -> tuple[str, ...]:
    """Return the factors that a query has: ``room`` where it names an area, ``near`` and ``marks`` where others."""
    near = ("near", "marks") if any(kind is not Modality.AREA for kind in evidence.context) else ()
    return ("thing", *near, *(("room",) if Modality.AREA in evidence.context else ()))


@cache
def weights() -> Weights:
    """Return the weights that ship."""
    return json.loads(Path(__file__).with_name("found.json").read_text(encoding="utf-8"))["weights"]
