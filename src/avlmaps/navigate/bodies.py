"""A robot's body as a navigator sees it: where it is and how it moves, how large it is, what is in its way."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from avlmaps.core.motion import Action, GroundPose, Moved
from avlmaps.maps.obstacles import BodyShape

__all__ = ["BASE", "DRONE", "SHAPES", "WALKER", "Body", "BodyShape"]


@runtime_checkable
class Body(Protocol):
    """A robot on the ground: a simulated one (of ``avlmaps-sim``), or one of a user's own.

    A movement returns when it is over. An obstacle is not an error: the body stops or slides, and reports a contact.
    """

    @property
    def pose(self) -> GroundPose:
        """Where it is, as its odometry says, level frame."""
        ...

    def act(self, action: Action) -> Moved:
        """Take one of the paper's actions.

        Args:
            action: 0.1 m forward, 5 degrees to the left or to the right, or stop (which only stands still).
        """
        ...


BASE = BodyShape()
"""A wheeled base of the size of those in homes, with a camera on a mast."""
DRONE = BodyShape(radius_m=0.25, height_m=1.6, flies_m=1.0, ignores=("table",))
"""A small drone at the height of a person's chest: it flies over tables, and what is called a table stops it not."""
WALKER = BodyShape(radius_m=0.25, height_m=1.8, step_m=0.2, climbs=True)
"""A person or a legged robot: it takes stairs."""
SHAPES: Mapping[str, BodyShape] = MappingProxyType({"base": BASE, "drone": DRONE})
"""The shapes by name."""
