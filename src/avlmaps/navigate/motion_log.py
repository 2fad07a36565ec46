"""The movements of a robot while a program ran: where each was to end and where it ended."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import Action
from avlmaps.navigate.driver import Arrival

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class LoggedMove:
    """One movement that a skill made.

    Attributes:
        skill: which skill.
        name: of the thing that it went to; ``""`` for a turn or a place.
        goal: where it was to end, world, metres; None for a turn.
        stop: where it ended, world, on the floor.
        distance_m: from the goal to where it ended, over the ground (the world need not be level); None for a turn.
        heading_rad: where it looks then, level frame, counter-clockwise from +x.
        reached: whether the driver reached its goal.
        actions: the discrete actions taken.
        path: (n, 2) places passed, level x and y.
        note: what the driver had to say.
        contacts: how often the robot touched something.
    """

    skill: str
    name: str
    goal: Triple | None
    stop: Triple
    distance_m: float | None
    heading_rad: float
    reached: bool
    actions: tuple[Action, ...]
    path: Float[np.ndarray, "n 2"]
    note: str = ""
    contacts: int = 0

    def to_json(self) -> dict[str, Any]:
        """Return it as a subgoal or a step's result is printed."""
        answer: dict[str, Any] = {"skill": self.skill, "name": self.name}
        if self.goal is not None:
            answer |= {"goal": _rounded(self.goal)}
        answer |= {"stop": _rounded(self.stop)}
        if self.distance_m is not None:
            answer |= {"distance_m": round(self.distance_m, 4)}
        answer |= {"heading_rad": round(self.heading_rad, 4), "reached": self.reached}
        return (
            answer | ({"contacts": self.contacts} if self.contacts else {}) | ({"note": self.note} if self.note else {})
        )

    def __str__(self) -> str:
        x, y, z = self.stop
        where = f"stands at ({x:.2f}, {y:.2f}, {z:.2f}) m, heading {np.rad2deg(self.heading_rad):.0f}°"
        away = "" if self.distance_m is None else f", {self.distance_m:.2f} m from the goal"
        return where + away + (f" ({self.note.rstrip('.')})" if self.note else "")


def concat_motions(arrivals: Sequence[Arrival]) -> Arrival:
    """Return several movements as one."""
    last = arrivals[-1]
    notes = dict.fromkeys(arrival.note for arrival in arrivals if arrival.note)
    return Arrival(
        all(arrival.reached for arrival in arrivals),
        last.pose,
        tuple(action for arrival in arrivals for action in arrival.actions),
        np.concatenate([arrival.path for arrival in arrivals]),
        "; ".join(notes),
        sum(arrival.contacts for arrival in arrivals),
    )


def _rounded(place: Triple) -> list[float]:
    return [round(value, 4) for value in place]
