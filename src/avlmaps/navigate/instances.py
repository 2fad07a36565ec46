"""From what a program names to things on the ground: which instance is meant, where it is, and what it covers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import GoalNotFoundError
from avlmaps.navigate.footprint import Outline
from avlmaps.query.factors import Factor, NearThings
from avlmaps.query.goals import Goal
from avlmaps.query.heatmap import Heatmap

# From this confidence on an instance more likely matches the query than not.
SURE = 0.5
_MOST_GOALS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """Something to go to.

    Attributes:
        name: what it was called; ``""`` for a place that a program gives.
        outline: what it covers of the ground, level frame; a single point where it is not a thing.
        place: where the goal is, level frame, metres.
        sure: in [0, 1]: the map's confidence; 1 for a place that a program gives.
        solid: whether it is a thing with an extent, rather than a place.
    """

    name: str
    outline: Outline
    place: Float[np.ndarray, "3"]
    sure: float = 1.0
    solid: bool = False


def describe_query(heat: Heatmap) -> str:
    """Return the query of a heatmap in words: ``'chair' near 'glass breaking'``."""
    lead = heat.lead
    others = [f"{factor.part.query!r}" for factor in heat.factors if factor is not lead]
    return f"{lead.part.query!r}" + (f" near {' and '.join(others)}" if others else "")


def tells_one(heat: Heatmap) -> bool:
    """Return whether a heatmap says which instance is meant, rather than only its name."""
    return len(heat.factors) > 1 or not isinstance(heat.lead, NearThings)


def things_in(heat: Heatmap, guess: bool = False) -> list[Thing]:
    """Return the distinct things that a heatmap asks for, best first; at least one.

    Args:
        heat: what is sought, and what it is near.
        guess: take the best guess where the map's confidence is below 0.5, however low it is; where
            nothing comes together with what it is near, the thing alone.

    Raises:
        GoalNotFoundError: there is none.
    """
    tries = _guesses(heat) if guess else (heat,) if heat.found else ()
    for tried in tries:
        goals = tried.goals(_MOST_GOALS)
        if goals:
            return [_thing(tried, tried.lead, goal) for goal in goals]
    raise GoalNotFoundError(explain_absence(heat, guess))


def _guesses(heat: Heatmap) -> Iterator[Heatmap]:
    """Yield the possible meanings of a heatmap, the highest confidence first."""
    lead = Heatmap.of(heat.lead)
    yield heat
    yield heat.include_uncertain()
    if len(heat.factors) > 1:
        yield lead
        yield lead.include_uncertain()


def nearest(things: Sequence[Thing], xy: Float[np.ndarray, "2"]) -> Thing:
    """Return the thing nearest to a place, of those with a confidence of 0.5 or more; the best where there is none."""
    sure = [thing for thing in things if thing.sure >= SURE]
    return min(sure, key=lambda thing: thing.outline.distance_m(xy)) if sure else things[0]


def likely(things: Sequence[Thing], one: bool) -> Sequence[Thing]:
    """Return the things that may be meant: the best where one is meant, else those of confidence 0.5 or more."""
    return things[:1] if one else [thing for thing in things if thing.sure >= SURE] or things[:1]


def same_thing(a: Thing, b: Thing) -> bool:
    """Return whether two are one and the same thing."""
    return a.solid and b.solid and np.allclose(a.outline.centre, b.outline.centre, atol=1e-6)


def _thing(heat: Heatmap, lead: Factor, goal: Goal) -> Thing:
    position = np.array(goal.position)
    instance = int(lead.instance[np.argmin(np.linalg.norm(lead.anchors - position, axis=1))])
    place, sure = heat.space.level(position), goal.score
    if not isinstance(lead, NearThings):
        return Thing(describe_query(heat), Outline.at(place[:2]), place, sure)
    own = heat.space.level(lead.anchors[lead.instance == instance])
    outline = Outline.round(own[:, :2], heat.space.grid.voxel_size_m)
    if len(heat.factors) == 1:
        sure = float(lead.confidence[instance])
    return Thing(describe_query(heat), outline, place, sure, solid=True)


def explain_absence(heat: Heatmap, guess: bool = False) -> str:
    """Return one sentence on why there is no goal: which phrase, the map's confidence, and what to do."""
    missing = [factor for factor in heat.factors if not factor.found]
    if not missing:
        return (
            f"{describe_query(heat)} is nowhere in the map: each is there, but they do not come together anywhere; "
            "name it by something that is nearer to it."
        )
    absences = "; ".join(_absence(factor) for factor in missing)
    advice = "say it in other words" if guess else "say it in other words, or let the robot go to the best guess"
    return f"{describe_query(heat)} is not found in the map: {absences}; {advice}."


def _absence(factor: Factor) -> str:
    what = f"{factor.part.modality} {factor.part.query!r}"
    best = float(np.max(factor.confidence, initial=0.0)) if isinstance(factor, NearThings) else 0.0
    note = factor.note or f"its confidence is at best {best:.2f}, below {SURE:.2f}"
    return f"{what}: {note}".rstrip(".")
