"""What a navigator needs of a robot's body: where it is, and the two ways to move it. All in the level frame, metres."""

from typing import Protocol, runtime_checkable

from avlmaps.core.motion import Action, GroundPose, Moved


@runtime_checkable
class Body(Protocol):
    """A robot on the ground: a simulated one (`avlmaps.sim.body.SimulatedBody`), or one of a user's own.

    A movement returns when it is over. Something in the way is no error: the body stops or slides, and says so.
    """

    @property
    def pose(self) -> GroundPose:
        """Where it is, as its odometry says."""
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
