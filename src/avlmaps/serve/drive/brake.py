"""A brake between a program and its robot: once it is pulled, no movement of the order begins or continues."""

import threading
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import Action, GroundPose, Moved
from avlmaps.navigate.bodies import Body
from avlmaps.navigate.driver import Arrival, Driver

STOPPED = "the order was stopped"


class Brake:
    """Whether an order is stopped; pulled once, it stays."""

    def __init__(self) -> None:
        self._pulled = threading.Event()

    @property
    def pulled(self) -> bool:
        """Whether the order is stopped."""
        return self._pulled.is_set()

    def pull(self) -> None:
        """Stop the order."""
        self._pulled.set()

    def pause(self, seconds: float) -> None:
        """Wait for some seconds.

        Raises:
            NavigationError: the order was stopped.
        """
        if self._pulled.wait(seconds):
            raise NavigationError(f"{STOPPED.capitalize()}.")


class _PulledError(Exception):
    """The brake was pulled within a movement of a simulated body."""


class BrakedBody:
    """A simulated body that takes its time and stops at the brake."""

    def __init__(self, body: Body, brake: Brake, action_s: float) -> None:
        """Take a body.

        Args:
            body: moves.
            brake: of the order.
            action_s: time of one action.
        """
        self._body, self._brake, self._action_s = body, brake, action_s

    @property
    def pose(self) -> GroundPose:
        """Where it is."""
        return self._body.pose

    def act(self, action: Action) -> Moved:
        """Take one of the paper's actions."""
        self._wait(0.0 if action is Action.STOP else self._action_s)
        return self._body.act(action)

    def drive(self, speed_m_s: float, turn_rad_s: float, duration_s: float) -> Moved:
        """Move at a velocity for a while."""
        self._wait(min(duration_s, self._action_s))
        return self._body.drive(speed_m_s, turn_rad_s, duration_s)

    def _wait(self, seconds: float) -> None:
        try:
            self._brake.pause(seconds)
        except NavigationError:
            raise _PulledError from None


class BrakedDriver:
    """A driver that begins no movement once the brake is pulled."""

    def __init__(self, driver: Driver, brake: Brake) -> None:
        """Take a driver and the brake of an order."""
        self._driver, self._brake = driver, brake

    @property
    def pose(self) -> GroundPose:
        """Where the robot is."""
        return self._driver.pose

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Drive to a place; see `Driver`."""
        return self._braked(lambda: self._driver.go_to(place, face=face))

    def turn(self, angle_rad: float) -> Arrival:
        """Turn on the spot."""
        return self._braked(lambda: self._driver.turn(angle_rad))

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead."""
        return self._braked(lambda: self._driver.forward(distance_m))

    def stop(self) -> Arrival:
        """Stand still."""
        return self._braked(self._driver.stop)

    def _braked(self, movement: Callable[[], Arrival]) -> Arrival:
        if not self._brake.pulled:
            try:
                return movement()
            except _PulledError:
                pass
        pose = self._driver.pose
        return Arrival(False, pose, (), np.array([[pose.x_m, pose.y_m]]), STOPPED)
