"""A robot's body as a navigator sees it: where it is and how it moves, how large it is, what is in its way."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import Action, GroundPose, Moved


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

    def drive(self, speed_m_s: float, turn_rad_s: float, duration_s: float) -> Moved:
        """Move at a velocity for a while.

        Args:
            speed_m_s: ahead; negative drives back.
            turn_rad_s: to the left; negative turns to the right.
            duration_s: for how long.
        """
        ...


@dataclass(frozen=True, slots=True)
class BodyShape:
    """How large a robot is, and what counts as an obstacle to it (the embodiments of VLMaps)."""

    radius_m: float = 0.2
    """Radius of the circle round its middle that it needs free."""
    height_m: float = 1.5
    """Height of its top over the floor."""
    step_m: float = 0.1
    """It drives over lower obstacles."""
    flies_m: float | None = None
    """Height of its lowest part over the floor, for a body that flies: lower things are not in its way."""
    ignores: tuple[str, ...] = ()
    """Words for what is not an obstacle to it: what the map holds for such a thing is passed over or through."""
    only: tuple[str, ...] | None = None
    """Where given, nothing but these words counts as an obstacle, as VLMaps lists them; unnamed things are passed."""
    climbs: bool = False
    """Whether it takes the stairs that a map holds to another storey."""

    def __post_init__(self) -> None:
        if not (0.0 < self.radius_m < 10.0 and 0.0 < self.step_m < self.height_m):
            raise NavigationError(
                f"A body of radius {self.radius_m} m that steps over {self.step_m} m and is {self.height_m} m high is "
                "none; give a radius between 0 and 10 m, and a step between 0 and the height."
            )
        if self.flies_m is not None and not 0.0 <= self.flies_m < self.height_m:
            raise NavigationError(
                f"A body cannot fly {self.flies_m} m over the floor and reach up to {self.height_m} m; height_m is the "
                "height of its top over the floor."
            )


BASE = BodyShape()
"""A wheeled base of the size of those in homes, with a camera on a mast."""
DRONE = BodyShape(radius_m=0.25, height_m=1.6, flies_m=1.0, ignores=("table",))
"""A small drone at the height of a person's chest: it flies over tables, and what is called a table stops it not."""
WALKER = BodyShape(radius_m=0.25, height_m=1.8, step_m=0.2, climbs=True)
"""A person or a legged robot: it takes stairs."""
SHAPES: Mapping[str, BodyShape] = MappingProxyType({"base": BASE, "drone": DRONE})
"""The shapes by name."""
