"""A brake between a program and its robot: once it is pulled, no movement of the order begins or continues."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import MapError, NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps.core.printable import printable
from avlmaps.maps.store.edits import EDITS, in_force, read_edits
from avlmaps.maps.store.folder import stamp
from avlmaps.navigate.driver import Arrival, Driver, Holdable, Planning
from avlmaps.navigate.footprint import Outline
from avlmaps.navigate.planner import Offs, Stop
from avlmaps.query.avlmap import AVLMap

_STOPPED = "the order was stopped"
_LOOK_S = 0.5


class Brake:
    """Whether an order by a map is stopped; once it is, it stays so. An area that is forbidden meanwhile stops it.

    The drive knows the map as it was, so that it could lead through that area. ``forbidden`` is why an edit stopped it,
    in part of a sentence; "" where none did.
    """

    def __init__(self, avlmap: AVLMap, pace_s: float = 0.0) -> None:
        """Take the map of the drive; ``pace_s`` is the time that a simulated robot takes before each action."""
        self._pulled, self._pace_s, self.forbidden = threading.Event(), pace_s, ""
        self._folder, self._stamp = avlmap.path, None
        self._known = {edit.id for edit in avlmap.edited.edits}

    @property
    def pulled(self) -> bool:
        """Whether the order is stopped; it looks for edits."""
        now = stamp(self._folder / EDITS)
        if now != self._stamp:
            self._stamp = now
            if areas := self._forbidden():
                self.forbidden = (
                    f"{printable(areas)} was forbidden meanwhile, so that the robot was stopped (plan again)"
                )
                self.pull()
        return self._pulled.is_set()

    def _forbidden(self) -> str:
        try:
            edits = in_force(read_edits(self._folder))
        except MapError:  # a log that cannot be read forbids nothing
            return ""
        return " and ".join(edit.name for edit in edits if edit.does == "forbid" and edit.id not in self._known)

    @property
    def why(self) -> str:
        """Why it is stopped, in part of a sentence; "" where it is not."""
        return (self.forbidden or _STOPPED) if self.pulled else ""

    def pull(self) -> None:
        """Stop the order."""
        self._pulled.set()

    def held(self) -> str:
        """Return ``why`` before an action; a simulated robot takes its time here."""
        self._pulled.wait(self._pace_s)
        return self.why

    def pause(self, seconds: float) -> None:
        """Wait, or raise ``NavigationError`` where the order is stopped."""
        until_s = monotonic() + seconds
        while not self.pulled and (left_s := until_s - monotonic()) > 0.0:
            self._pulled.wait(min(left_s, _LOOK_S))
        if why := self.why:
            raise NavigationError(f"{why[:1].upper()}{why[1:]}.")


@contextmanager
def braked(driver: Driver, brake: Brake) -> Iterator[Driver]:
    """Let a brake stop a driver: between two movements, and within one where the driver can be held."""
    if not isinstance(driver, Holdable):
        yield BrakedDriver(driver, brake)
        return
    before, driver.held = driver.held, brake.held
    try:
        yield BrakedDriver(driver, brake)
    finally:
        driver.held = before


class BrakedDriver:
    """A driver that begins no movement once the brake is pulled."""

    def __init__(self, driver: Driver, brake: Brake) -> None:
        self._driver, self._brake = driver, brake

    @property
    def pose(self) -> GroundPose:
        """Where the robot is."""
        return self._driver.pose

    def stop_beside(self, thing: Outline, place: Float[np.ndarray, "3"], off_m: Offs) -> Stop | None:
        """Return where a driver that plans stops beside a thing; see `Planning`."""
        return self._driver.stop_beside(thing, place, off_m) if isinstance(self._driver, Planning) else None

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Drive to a place; see `Driver`."""
        return self._refused() or self._driver.go_to(place, face=face)

    def turn(self, angle_rad: float) -> Arrival:
        """Turn on the spot."""
        return self._refused() or self._driver.turn(angle_rad)

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead."""
        return self._refused() or self._driver.forward(distance_m)

    def stop(self) -> Arrival:
        """Stand still."""
        return self._refused() or self._driver.stop()

    def _refused(self) -> Arrival | None:
        pose = self._driver.pose
        why = self._brake.why
        return Arrival(False, pose, (), np.array([[pose.x_m, pose.y_m]]), why) if why else None
