"""A brake between a program and its robot: once it is pulled, no movement of the order begins or continues."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import MapError, NavigationError
from avlmaps.core.motion import Action, GroundPose, Moved
from avlmaps.core.printable import printable
from avlmaps.maps.store.edits import EDITS, in_force, read_edits
from avlmaps.maps.store.folder import stamp
from avlmaps.navigate.bodies import Body
from avlmaps.navigate.driver import Arrival, Driver, Holdable
from avlmaps.query.avlmap import AVLMap

_STOPPED = "the order was stopped"
_LOOK_S = 0.5


class Brake:
    """Whether an order is stopped; pulled once, it stays."""

    def __init__(self) -> None:
        self._pulled, self._why = threading.Event(), ""

    @property
    def pulled(self) -> bool:
        """Whether the order is stopped."""
        return self._pulled.is_set()

    @property
    def why(self) -> str:
        """Why it is, in part of a sentence; "" where it is not."""
        return self._why if self.pulled else ""

    def pull(self, why: str = _STOPPED) -> None:
        """Stop the order, for the first reason that is given."""
        self._why = self._why or why
        self._pulled.set()

    def pause(self, seconds: float) -> None:
        """Wait for some seconds.

        Raises:
            NavigationError: the order was stopped.
        """
        until_s = monotonic() + seconds
        while not self.pulled and (left_s := until_s - monotonic()) > 0.0:
            self._pulled.wait(min(left_s, _LOOK_S))
        if self.pulled:
            raise NavigationError(f"{self.why[:1].upper()}{self.why[1:]}.")


class EditBrake(Brake):
    """The brake of a drive by a map that may be edited meanwhile: an area that is forbidden pulls it.

    The drive knows the map as it was, so that it could lead through that area.
    """

    def __init__(self, avlmap: AVLMap) -> None:
        """Take the map of the drive; one without a folder is not edited."""
        super().__init__()
        self._folder, self._stamp = avlmap.path, None
        self._known = {edit.id for edit in avlmap.edited.edits}

    @property
    def pulled(self) -> bool:
        """Whether the drive is stopped; it looks for edits."""
        now = stamp(self._folder / EDITS)
        if now != self._stamp:
            self._stamp = now
            if names := self._forbidden():
                areas = printable(" and ".join(names))
                self.pull(f"{areas} was forbidden meanwhile, so that the robot was stopped (plan again)")
        return super().pulled

    def _forbidden(self) -> list[str]:
        """Return the areas that were forbidden since the map was opened; a log that cannot be read forbids none."""
        try:
            edits = in_force(read_edits(self._folder))
        except MapError:
            return []
        return [edit.name for edit in edits if edit.does == "forbid" and edit.id not in self._known]


@contextmanager
def braked(driver: Driver, brake: Brake) -> Iterator[Driver]:
    """Let a brake stop a driver: between two movements, and within one where the driver can be held."""
    if not isinstance(driver, Holdable):
        yield BrakedDriver(driver, brake)
        return
    before, driver.held = driver.held, lambda: brake.why
    try:
        yield BrakedDriver(driver, brake)
    finally:
        driver.held = before


class _PulledError(BaseException):
    """The brake was pulled within a movement of a simulated body, which is no fault of the body."""


class BrakedBody:
    """A simulated body that takes its time and stops at the brake."""

    def __init__(self, body: Body, brake: Brake, action_s: float) -> None:
        self._body, self._brake, self._action_s = body, brake, action_s

    @property
    def pose(self) -> GroundPose:
        """Where it is."""
        return self._body.pose

    def act(self, action: Action) -> Moved:
        """Take one of the paper's actions."""
        self._wait(0.0 if action is Action.STOP else self._action_s)
        return self._body.act(action)

    def _wait(self, seconds: float) -> None:
        try:
            self._brake.pause(seconds)
        except NavigationError:
            raise _PulledError from None


class BrakedDriver:
    """A driver that begins no movement once the brake is pulled."""

    def __init__(self, driver: Driver, brake: Brake) -> None:
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
        return Arrival(False, pose, (), np.array([[pose.x_m, pose.y_m]]), self._brake.why)
