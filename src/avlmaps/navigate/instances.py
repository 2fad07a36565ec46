"""From what a program names to things on the ground: which instance is meant, where it is, and what it covers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import GoalNotFoundError
from avlmaps.core.wording import option, place_text
from avlmaps.navigate.footprint import Outline
from avlmaps.query.factors import Factor, NearThings
from avlmaps.query.goals import Goal
from avlmaps.query.heatmap import Heatmap

if TYPE_CHECKING:
    from avlmaps.maps.sources.candidates import Spread

_MOST_GOALS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Destination:
    """Something to go to.

    Attributes:
        name: what it was called; ``""`` for a place that a program gives.
        outline: what it covers of the ground, level frame; a single point where it is not a thing.
        place: where the goal is, level frame, metres.
        probability: that it is what was meant; 1 for a place that a program gives.
        solid: whether it is a thing with an extent, rather than a place.
        found: whether that is likely enough, by the map's settings.
        spread: how well the place is known, where it is the source of a sound.
    """

    name: str
    outline: Outline
    place: Float[np.ndarray, "3"]
    probability: float = 1.0
    solid: bool = False
    found: bool = True
    spread: "Spread | None" = None


def describe_query(heat: Heatmap) -> str:
    """Return the query of a heatmap in words: ``'chair' near 'glass breaking'``."""
    lead = heat.lead
    others = [_name(factor) for factor in heat.factors if factor is not lead]
    return _name(lead) + (f" near {' and '.join(others)}" if others else "")


def _name(factor: Factor) -> str:
    return f"{'the source of ' if factor.part.at == 'source' else ''}{factor.part.query!r}"


def tells_one(heat: Heatmap) -> bool:
    """Return whether a heatmap says which instance is meant, rather than only its name."""
    return len(heat.factors) > 1 or not isinstance(heat.lead, NearThings)


def things_in(heat: Heatmap, guess: bool = False) -> list[Destination]:
    """Return the distinct things that a heatmap asks for, best first; at least one, and all of them found.

    Args:
        heat: what is sought, and what it is near.
        guess: take the best guess where nothing is found, however unlikely it is; where nothing comes together with
            what it is near, the thing alone.

    Raises:
        GoalNotFoundError: there is none.
    """
    if heat.found:
        found = [goal for goal in heat.goals(_MOST_GOALS) if goal.probability >= heat.found_at]
        return [_thing(heat, heat.lead, goal) for goal in found]
    for tried in _guesses(heat) if guess else ():
        goals = tried.goals(_MOST_GOALS)
        if goals:
            return [_thing(tried, tried.lead, goal) for goal in goals]
    raise GoalNotFoundError(explain_absence(heat, guess))


def _guesses(heat: Heatmap) -> Iterator[Heatmap]:
    """Yield the possible meanings of a heatmap, the highest confidence first."""
    lead = Heatmap.of(heat.lead, heat.found_at).only(heat.where)
    yield heat
    yield heat.include_uncertain()
    if len(heat.factors) > 1:
        yield lead
        yield lead.include_uncertain()


def nearest(things: Sequence[Destination], xy: Float[np.ndarray, "2"]) -> Destination:
    """Return the thing nearest to a place, of those that are found; the best where none is.

    One that is less than half as likely as the best is no choice: it counts as found only where the limit is low.
    """
    found = [thing for thing in things if thing.found and 2.0 * thing.probability >= things[0].probability]
    return min(found, key=lambda thing: thing.outline.distance_m(xy)) if found else things[0]


def likely(things: Sequence[Destination], one: bool) -> Sequence[Destination]:
    """Return the things that may be meant: the best where one is meant, else those that are found."""
    return things[:1] if one else [thing for thing in things if thing.found] or things[:1]


def same_thing(a: Destination, b: Destination) -> bool:
    """Return whether two are one and the same thing."""
    return a.solid and b.solid and np.allclose(a.outline.centre, b.outline.centre, atol=1e-6)


def _thing(heat: Heatmap, lead: Factor, goal: Goal) -> Destination:
    position = np.array(goal.position)
    instance = int(lead.instance[np.argmin(np.linalg.norm(lead.anchors - position, axis=1))])
    place, found = heat.space.level(position), goal.probability >= heat.found_at
    if not isinstance(lead, NearThings):
        name, outline = describe_query(heat), Outline.at(place[:2])
        return Destination(name, outline, place, goal.probability, found=found, spread=goal.spread)
    own = heat.space.level(lead.anchors[lead.instance == instance])
    outline = Outline.round(own[:, :2], heat.space.grid.voxel_size_m)
    return Destination(describe_query(heat), outline, place, goal.probability, solid=True, found=found)


def explain_absence(heat: Heatmap, guess: bool = False) -> str:
    """Return one sentence on why there is no goal: which phrase failed, what the best guess is, and what to do."""
    what, missing = describe_query(heat), [factor for factor in heat.factors if not factor.found]
    if missing:
        why = f"is not found in the map: {'; '.join(_absence(factor) for factor in missing)}"
    elif len(heat.factors) == 1:
        why = f"is not found in the map with a probability of {heat.found_at:g}"
    else:
        why = "is not found in the map: each is there, but they do not come together anywhere"
    best = next(iter(heat.goals(1)), None)
    if best is None:
        return f"{what} {why}; say it in other words."
    advice = "say it in other words"
    if not guess:
        advice += f", or let the robot go to the best guess ({option('guess')})"
    place = place_text(best.position)
    return f"{what} {why}. The best guess is at {place} with probability {best.probability:.2f}; {advice}."


def _absence(factor: Factor) -> str:
    note = factor.note or f"its confidence is at best {float(np.max(factor.confidence, initial=0.0)):.2f}"
    return f"{factor.part.modality} {factor.part.query!r}: {note}".rstrip(".")
