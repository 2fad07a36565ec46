"""From heat to places: distinct things rather than single voxels, ranked, and how likely each is right.

The instances of the lead (the primary factor) divide the heated voxels by where their lead heat comes from. A goal lies
where the product is highest in an instance's share; on a thing it is the middle of what is nearly as hot, so that one
stray voxel does not decide where the robot goes.

The probability that a goal is right, all parts together, is a product of what makes it so, each with its own odds:

    p = s(thing) * s(near) * s(marks) * s(room),   s the logistic function of a weight times a number, and a bias

and at most that of the thing alone, which is as likely as its calibrated model says. The weights (``found.json``) are
fitted by ``training/found`` on homes that no table uses, half of the queries being for what is not there.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar, runtime_checkable

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.poses import plain_point
from avlmaps.core.question import Modality
from avlmaps.query.factors import Factor, NearAnchors, NearThings, lead_of
from avlmaps.query.schema import GoalAnswer, row_of
from avlmaps.query.voxel_space import boxes

if TYPE_CHECKING:
    from avlmaps.maps.sources.candidates import Spread

# Log-odds beyond these are no better known: a confidence of 0.98 and one of 0.998 are alike.
_MOST_LOGIT = 4.0
_LEAST_HEAT, _LEAST_SCORE = 0.02, 0.01


@dataclass(frozen=True, slots=True)
class GoalEvidence:
    """What speaks for a goal."""

    lead: Modality  # what is sought
    context: tuple[Modality, ...]  # what it is near or in; empty for a query of one part
    alone: float  # probability that the thing there is what is sought, by itself
    thing: float  # log-odds of that
    near: float = 0.0  # log of the heat of what it is near, there; 0 beside it
    room: float = 0.0  # log of the probability that it stands in such an area
    marks: float = 0.0  # log-odds of the least certain of the things, sounds and photos that it is near


def evidence_of(
    factors: Sequence[Factor], instance: int, position: Float[np.ndarray, "3"], peak: float, inside: float = 1.0
) -> GoalEvidence:
    """Return the evidence for a goal; ``inside``: how far the thing lies in the regions among the factors."""
    lead = lead_of(factors)
    context = [factor for factor in factors if factor is not lead]
    itself = float(lead.scores[lead.instance == instance].max(initial=0.0)) if isinstance(lead, NearAnchors) else 1.0
    alone = itself * float(lead.confidence[instance])
    rooms = [factor for factor in context if factor.part.modality is Modality.AREA]
    beside = [factor for factor in rooms if not holds(factor, lead)]
    room = inside * float(np.prod([factor.at(position[None])[0] for factor in beside]))
    near = peak / max(itself * room, _LEAST_SCORE) if context else 1.0
    marks = [_mark(factor, position) for factor in context if factor not in rooms]
    near, room = (float(np.log(np.clip(heat, _LEAST_HEAT, 1.0))) for heat in (near, room))
    kinds = tuple(factor.part.modality for factor in context)
    return GoalEvidence(lead.part.modality, kinds, alone, logit(alone), near, room, min(map(logit, marks), default=0.0))


def logit(probability: float) -> float:
    """Return the log-odds of a probability, at most 4 from 0."""
    held = min(max(probability, 1e-6), 1.0 - 1e-6)
    return float(np.clip(np.log(held / (1.0 - held)), -_MOST_LOGIT, _MOST_LOGIT))


def holds(factor: Factor, lead: Factor) -> bool:
    """Return whether a factor says in which region what is sought lies."""
    return factor.regional and factor is not lead


def _mark(factor: Factor, position: Float[np.ndarray, "3"]) -> float:
    if not len(factor.anchors):
        return 0.0
    away = np.linalg.norm(factor.anchors - position, axis=1)
    if isinstance(factor, NearAnchors):
        nearest = int(np.argmax(factor.scores - factor.falloff_per_m * away))
        return float(factor.scores[nearest] * factor.confidence[factor.instance[nearest]])
    return float(factor.confidence[factor.instance[int(np.argmin(away))]])


FACTORS = ("thing", "near", "marks", "room")
"""The factors of the product: each is a number of the evidence, which has a weight and a bias."""
Weights = Mapping[str, float]


def probability_of(evidence: GoalEvidence, given: Weights | None = None) -> float:
    """Return the probability that a goal with this evidence is right, by the weights that ship or those given."""
    all_parts = math.prod(factor_values(evidence, given).values()) if evidence.context else 1.0
    return round(min(all_parts, evidence.alone), 3)  # more digits would be noise


def factor_values(evidence: GoalEvidence, given: Weights | None = None) -> dict[str, float]:
    """Return each factor of the probability of a goal of several parts, by its name."""
    own = given or weights()
    odds = {name: own[f"{name}_bias"] + own[name] * getattr(evidence, name) for name in factors_of(evidence)}
    return {name: 1.0 / (1.0 + math.exp(-value)) for name, value in odds.items()}


def factors_of(evidence: GoalEvidence) -> tuple[str, ...]:
    """Return the factors that a query has: ``room`` where it names an area, ``near`` and ``marks`` where others."""
    near = ("near", "marks") if any(kind is not Modality.AREA for kind in evidence.context) else ()
    return ("thing", *near, *(("room",) if Modality.AREA in evidence.context else ()))


@cache
def weights() -> Weights:
    """The weights that ship."""
    return json.loads(Path(__file__).with_name("found.json").read_text(encoding="utf-8"))["weights"]


MOST_GOALS = 200
"""For a count, a list or a place to be near to, up to this many goals are looked through."""
_ALIKE = 0.05
"""Goals whose probabilities differ by no more fit equally: no calibration tells them apart."""
# Two sounds heard at one place are one place to go to.
SEPARATION_M = 1.0
# Heat that differs by less is a plateau, whose middle is taken.
_SAME = 1e-6
# On a thing, voxels with at least this share of its highest heat are one place. Context falls by 0.2 a metre, so a
# chair is one place, and of a long counter the end near the sound.
_NEARLY = 0.8


@dataclass(frozen=True, slots=True)
class Goal:
    """One distinct place that answers a question."""

    # Metres, world: on the object if the primary part is one, else the sound position or the camera's.
    position: tuple[float, float, float]
    # In [0, 1]: the heat there times the confidence that the primary thing matches the query. Of the heat of a region
    # ("in the kitchen") it is the mean over the thing.
    score: float
    # Extent of the instance along the axes of the level frame (x and y horizontal, z up), metres. For an object its
    # voxels' box; for a sound or an area the box of the places it was heard or seen from.
    size: tuple[float, float, float]
    parts: dict[str, float]  # heat of each modality there; a second part of a modality is called ``object_2`` and so on
    probability: float = 0.0  # that the goal is right, all parts together
    name: str = ""  # what is there, for an answer from the lists of a map; ``""`` for others
    # How well the place is known, where that is less well than usual: the source of a sound.
    spread: "Spread | None" = None

    def to_json(self) -> "GoalAnswer":
        """Return the goal as the command line prints it."""
        around = {} if self.spread is None else {
            "within_50_m": round(self.spread.within_50_m, 2), "within_90_m": round(self.spread.within_90_m, 2)
        }  # fmt: skip
        return row_of(self, GoalAnswer, parts=dict(self.parts), **around)


@runtime_checkable
class HasProbability(Protocol):
    """A thing that may be meant."""

    @property
    def probability(self) -> float:
        """In [0, 1]."""
        ...


_Likely = TypeVar("_Likely", bound=HasProbability)


def alike(goals: Sequence[Goal], found_at: float, *, is_half: bool) -> list[Goal]:
    """Return the goals that are found and fit as well as the likeliest; all where half of the name is understood."""
    found = [goal for goal in goals if goal.probability >= found_at and goal.probability > 0.0]
    return found if is_half else as_likely(found)


def as_likely(things: Sequence[_Likely]) -> list[_Likely]:
    """Return those of some things that fit as well as the likeliest, in their order."""
    most = max((thing.probability for thing in things), default=0.0)
    return [thing for thing in things if thing.probability >= most - _ALIKE - 1e-9]


@dataclass(frozen=True, slots=True)
class Shares:
    """Heated voxels and anchors, each with the instance whose share it lies in."""

    lead: Factor  # whose instances share
    rows: Int[np.ndarray, " v"]  # the map's rows of those that are voxels; they come first
    heat: Float[np.ndarray, " m"]  # the product there
    instance: Int[np.ndarray, " m"]  # whose share
    peak: Float[np.ndarray, " i"]  # highest heat in each share, times ``inside``
    inside: Float[np.ndarray, " i"]  # how far each instance lies in the regions among the factors

    def places(self, which: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 3"]:
        """Return where some of them are, metres, world."""
        voxels = which < len(self.rows)
        places = np.empty((len(which), 3))
        places[voxels] = self.lead.space.centres_of(self.rows[which[voxels]])
        places[~voxels] = self.lead.anchors[which[~voxels] - len(self.rows)]
        return places


def share_voxels(factors: Sequence[Factor], of_things: Callable[[], Float32[np.ndarray, " n"]]) -> Shares:
    """Divide the heated voxels among the lead's instances; ``of_things``, the product without regions, is slow."""
    lead, count = lead_of(factors), len(lead_of(factors).confidence)
    regions = [factor for factor in factors if holds(factor, lead)]
    others = [factor for factor in factors if factor is not lead and factor not in regions]
    if isinstance(lead, NearThings) and not others:
        rows = np.flatnonzero(lead.mask)
        instance, heat = lead.instance, np.ones(len(rows))  # an object's own voxels are as hot as can be
    elif isinstance(lead, NearAnchors) and not lead.regional and not others:
        # The heat of cones is highest at their anchors, which are places as well: no voxel is hotter, or more central.
        rows, instance, heat = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
    else:
        rows = np.flatnonzero(of_things() > 0.0) if len(lead.anchors) else np.zeros(0, np.int64)
        instance = lead.instance[lead.anchor_of(rows)] if len(rows) else np.zeros(0, np.int64)
        heat = of_things()[rows].astype(np.float64)
    if isinstance(lead, NearAnchors):
        at_anchors = np.prod([lead.scores, *(factor.at(lead.anchors) for factor in others)], axis=0)
        heat, instance = np.append(heat, at_anchors), np.append(instance, lead.instance)
    inside = np.prod([np.ones(count), *(region.held(lead) for region in regions)], axis=0)
    highest = np.zeros(count)
    np.maximum.at(highest, instance, heat)
    return Shares(lead, rows, heat, instance, highest * inside, inside)


def weigh_goals(
    factors: Sequence[Factor], shares: Shares, top: int, likely: float = 1.0
) -> list[tuple[Goal, GoalEvidence]]:
    """Return up to ``top`` goals with their evidence, best first; what lies within a better one is a part of it.

    None is likelier than ``likely``, nor than the one before it, less the share by which it fits worse.
    """
    lead, is_named = lead_of(factors), all(factor.is_named for factor in factors)
    score = np.round(shares.peak * lead.confidence, 3)  # more digits would be noise; of equals the larger leads
    extent = np.bincount(lead.instance, minlength=len(score))
    ground: list[Float[np.ndarray, 2]] = []
    extents = _Extents(lead) if isinstance(lead, NearThings) else None
    goals: list[tuple[Goal, GoalEvidence]] = []
    before = float(score.max(initial=0.0))
    for instance in map(int, np.lexsort((-extent, -score))):
        if len(goals) >= top or score[instance] <= 0.0:
            break
        position = _position(factors, lead, shares, instance)
        xy = lead.space.level(position)[:2]
        if lead.flat and any(np.hypot(*(xy - other)) < SEPARATION_M for other in ground):
            continue
        if extents is not None and not extents.takes(instance, lead.space.level(position)):
            continue
        ground.append(xy)
        evidence = evidence_of(factors, instance, position, float(shares.peak[instance]), shares.inside[instance])
        fits = float(score[instance])
        likely, before = min(probability_of(evidence) if is_named else 0.0, likely * fits / before), fits
        goals.append((_goal(factors, lead, instance, position, fits, round(likely, 3)), evidence))
    return goals


class _Extents:
    # The boxes of a lead's instances, level frame, and the goals that lie in them.

    def __init__(self, lead: NearThings) -> None:
        self.low, self.high = boxes(lead.space.level(lead.anchors), lead.instance, len(lead.confidence))
        self.goals: dict[int, Float[np.ndarray, 3]] = {}

    def holds(self, instance: int, place: Float[np.ndarray, "3"]) -> bool:
        return bool((self.low[instance] <= place).all() and (place <= self.high[instance]).all())

    def takes(self, instance: int, place: Float[np.ndarray, "3"]) -> bool:
        # Whether the goal of an instance is that of another thing than those before; it is remembered.
        if any(self.holds(other, place) or self.holds(instance, at) for other, at in self.goals.items()):
            return False
        self.goals[instance] = place
        return True


def _position(factors: Sequence[Factor], lead: Factor, shares: Shares, instance: int) -> Float[np.ndarray, "3"]:
    if isinstance(lead, NearThings):
        return _place_on_thing(lead, shares, instance)
    own = np.flatnonzero(shares.instance == instance)
    rows = own[shares.heat[own] >= shares.heat[own].max() - _SAME]
    at_anchors = rows[rows >= len(shares.rows)]
    plateau = shares.places(at_anchors if len(at_anchors) else rows)
    middle = plateau[np.argmin(np.linalg.norm(plateau - plateau.mean(axis=0), axis=1))]
    if len(at_anchors) or not all(factor.flat for factor in factors):
        return middle
    # A column: every height is as hot, so the place is put where the anchor was.
    anchors = lead.space.level(lead.anchors[lead.instance == instance])
    place = lead.space.level(middle)
    place[2] = anchors[np.argmin(np.linalg.norm(anchors[:, :2] - place[:2], axis=1)), 2]
    return lead.space.world(place)


def _place_on_thing(lead: NearThings, shares: Shares, instance: int) -> Float[np.ndarray, "3"]:
    share = np.flatnonzero(shares.instance == instance)
    on_it = share[lead.mask[shares.rows[share]]]
    if not len(on_it):  # the context reaches beside the thing, and ends before it
        hottest = shares.rows[share[[np.argmax(shares.heat[share])]]]
        return lead.anchors[lead.anchor_of(hottest)[0]]
    heat = shares.heat[on_it]
    hot = shares.places(on_it[heat >= _NEARLY * heat.max()])
    return hot[np.argmin(np.linalg.norm(hot - hot.mean(axis=0), axis=1))]


def _goal(
    factors: Sequence[Factor], lead: Factor, instance: int, position: Float[np.ndarray, "3"], score: float,
    probability: float,
) -> Goal:  # fmt: skip
    extent = np.ptp(lead.space.level(lead.anchors[lead.instance == instance]), axis=0)
    size = extent if lead.flat else extent + lead.space.grid.voxel_size_m
    parts: dict[str, float] = {}
    for factor in factors:
        name = str(factor.part.modality)
        again = sum(key.split("_")[0] == name for key in parts)
        parts[f"{name}_{again + 1}" if again else name] = float(factor.at(position[None])[0])
    spread = lead.spread_of(instance)
    return Goal(plain_point(position), min(max(score, 0.0), 1.0), plain_point(size), parts, probability, spread=spread)
