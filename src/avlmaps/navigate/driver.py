"""Driving to a place: what every driver offers, and what came of it."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import Action, GroundPose


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """What came of one movement. That a place was not reached is an ordinary result, and the note says why.

    Attributes:
        reached: whether the robot stands where it was told to, within the driver's tolerance.
        pose: where it stands now, level frame.
        actions: the discrete actions that were taken, in order; empty where a robot is driven in another way.
        path: (n, 2) the places that it passed, level x and y, metres; the first is where it began.
        note: one sentence where there is something to say: why it was not reached, or that it stands beside it.
        contacts: how often it touched something.
    """

    reached: bool
    pose: GroundPose
    actions: tuple[Action, ...]
    path: Float[np.ndarray, "n 2"]
    note: str = ""
    contacts: int = 0


@runtime_checkable
class Driver(Protocol):
    """Drives one robot. None of its methods raises for what can happen on the way; `Arrival` tells of it."""

    @property
    def pose(self) -> GroundPose:
        """Where the robot is, level frame of the map."""
        ...

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Drive to a place, or as near to it as the robot can stand and see it.

        Args:
            place: in the world, metres; its height does not matter.
            face: a place in the world to look at once there.
        """
        ...

    def turn(self, angle_rad: float) -> Arrival:
        """Turn on the spot.

        Args:
            angle_rad: to the left (counter-clockwise, seen from above); negative turns to the right.
        """
        ...

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead, as far as nothing is in the way; for a negative distance it turns round first."""
        ...

    def stop(self) -> Arrival:
        """Stand still."""
        ...
