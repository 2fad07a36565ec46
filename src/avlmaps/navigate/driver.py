"""Driving to a place: what every driver offers, and the one that plans on a map and follows its way itself."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from math import pi
from time import sleep
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose, Moved, wrap_angle
from avlmaps.core.printable import printable
from avlmaps.maps.obstacles import BodyShape, Obstacles
from avlmaps.navigate.controller import ActionController, StallDetector, bearing, turns_for
from avlmaps.navigate.costmap import BASE, ContactMap, costmap_of
from avlmaps.navigate.footprint import Outline
from avlmaps.navigate.interrupts import Halt
from avlmaps.navigate.planner import ESCAPE_M, Offs, Planner, Stop, rooms

_SAMPLE_M = 0.02  # places along a straight move that are looked at
_STILL_RAD = 0.01  # smaller turns may not show
_STILL_M = 0.005  # a step that brings the body no farther was stopped
_OPEN_M = 0.5  # beside a place in which it could stand, but to which no path leads, it stops no farther off
_TURNED_RAD = 0.5 * TURN_RAD + 0.01  # a turn that is off by no more is done
_EXTRA_TURNS = 36  # actions that a turn may take beyond its angle
_MOST_M, _MOST_RAD = 1e6, 1e3
_IN_VAIN = 12  # turns that change no heading: a body that does not say how it turns is not driven
_LOOK_S, _CREEP_M = 0.1, 0.01  # a body that moves by more within that time of its stop does not stand
_BEYOND_M = 0.3  # a body that moves by more than this beyond its command does not follow it, or its pose jumped
_OFF_M, _OFF_SHARE = 0.25, 0.2  # a straight drive that ends farther off, in metres and of its length, is not done
TOLERANCE_M = 0.15
"""A robot has arrived when it stands no farther from where it is to stop."""
_MOST_PLANS, _MOST_MOVEMENTS = 40, 5_000  # after which it gives up a place; each contact takes a plan
T = TypeVar("T", GroundPose, Moved)


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
        """Go 0.1 m forward, turn by 5 degrees to the left or to the right, or stop (which only stands still)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """The result of one movement. That a place was not reached is an ordinary result, and the note says why."""

    reached: bool  # within the driver's tolerance
    pose: GroundPose  # where it stands now, level frame
    actions: tuple[Action, ...]  # discrete ones, in order; empty where a robot is driven in another way
    path: Float[np.ndarray, "n 2"]  # level x and y of the places passed, metres; the first is where it began
    note: str = ""  # one sentence: why it was not reached, or that it stands beside it
    contacts: int = 0  # how often it touched something


@runtime_checkable
class Driver(Protocol):
    """Drives one robot. None of its methods raises for what can happen while driving; `Arrival` reports it."""

    @property
    def pose(self) -> GroundPose:
        """Where the robot is, level frame of the map."""
        ...

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Drive to a place in the world, or as near to it as the robot can stand and see it, and stand there.

        Its height does not matter. ``face`` is a place in the world to look at once there.
        """
        ...

    def turn(self, angle_rad: float) -> Arrival:
        """Turn on the spot: to the left (counter-clockwise from above), to the right by a negative angle."""
        ...

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead until an obstacle; for a negative distance it turns round first."""
        ...

    def stop(self) -> Arrival:
        """Stand still, also where another client drives the robot: a person's stop, and no part of other movements."""
        ...


@runtime_checkable
class Holdable(Protocol):
    """A driver whose movement under way can be ended."""

    held: Callable[[], str]
    """Returns why the movement must end, in part of a sentence; "" where it need not. Called all along."""


@runtime_checkable
class Planning(Protocol):
    """A driver that knows from a map where it can stop beside a thing."""

    def stop_beside(self, thing: Outline, place: Float[np.ndarray, "3"], off_m: Offs) -> Stop | None:
        """Return where it stops beside a thing with a place in the world, if it may go there; `Planner.stop_beside`."""
        ...


@dataclass(slots=True)
class _Trip:
    path: list[tuple[float, float]]
    actions: list[Action] = field(default_factory=list)
    contacts: int = 0
    movements: int = 0
    turns_in_vain: int = 0  # one after the other
    fault: str = ""  # a fault of the body, so that there is no use in continuing


class MapDriver:
    """Plans on a map, follows the path with its eyes on the body's pose, and plans again after a contact.

    Contacts are stored for later drives, beside the map. No movement is made of which the map foretells a contact.
    Radius and height of ``shape`` must be those that the obstacles were found for.
    """

    def __init__(self, obstacles: Obstacles, body: Body, shape: BodyShape = BASE) -> None:
        self.obstacles, self.body, self.shape = obstacles, body, shape
        self.contacts = ContactMap(obstacles, shape.radius_m)
        self._last = self._of_body("say where it is", lambda: _posed(body.pose))
        self.contacts.mark_free(self._last)
        self.held: Callable[[], str] = lambda: ""
        self._planner: Planner | None = None  # of the obstacles known by now; None where one came since

    @property
    def pose(self) -> GroundPose:
        """Where the body is; ``NavigationError`` where it fails to say so."""
        self._last = self._of_body("say where it is", lambda: _posed(self.body.pose))
        return self._last

    @property
    def planner(self) -> Planner:
        """Finds paths round all obstacles that are known by now."""
        if self._planner is None:
            self._planner = Planner(costmap_of(self.obstacles, self.shape.radius_m, self.contacts.cells))
        return self._planner

    @property
    def touched(self) -> Float[np.ndarray, "m 2"]:
        """The places where the body touched what the map does not know, level x and y."""
        return self.obstacles.origin_m + (np.argwhere(self.contacts.cells) + 0.5) * self.obstacles.cell_size_m

    # See `robots.RobotDriver`: a body that moves only while a command runs.

    owes = False

    def fault(self) -> str:
        """Return "": it can always be driven."""
        return ""

    def halt(self) -> Halt:
        """Return that it stands."""
        return Halt(True, "the simulated robot moves only while the command runs")

    def close(self) -> None:
        """Do nothing."""

    def stop_beside(self, thing: Outline, place: Float[np.ndarray, "3"], off_m: Offs) -> Stop | None:
        """Return where it stops beside a thing; None on another storey, or where a person forbade it."""
        elsewhere = self.obstacles.elsewhere(place)
        return None if elsewhere else self.planner.stop_beside(self._xy, thing, self._level(place), off_m)

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Drive to a place; its height says only which storey it is on."""
        return self._moved_by(lambda trip: self._gone_to(place, face, trip))

    def _gone_to(self, place: Float[np.ndarray, "3"], face: Float[np.ndarray, "3"] | None, trip: _Trip) -> Arrival:
        goal = self._level(place)
        if elsewhere := self.obstacles.elsewhere(place):
            return self._arrival(trip, False, elsewhere)
        stop, note = None, f"it gave up after {_MOST_PLANS} plans"
        for _ in range(_MOST_PLANS):
            stop = self.planner.stop_for(self._xy, goal)
            way = None if stop is None else self.planner.way(self._xy, stop.xy)
            if way is None:
                return self._arrival(trip, False, self._no_way(goal))
            if self._follow(way.points, trip):
                note = ""
                break
            if trip.fault or trip.movements >= _MOST_MOVEMENTS:
                note = trip.fault or f"it gave up after {trip.movements} movements"
                break
        if face is not None and np.isfinite(x_y := self._level(face)).all():
            self._turned(wrap_angle(bearing(self.pose, *map(float, x_y)) - self.pose.heading_rad), trip)
        return self._at_stop(trip, stop, goal, note)

    def turn(self, angle_rad: float) -> Arrival:
        """Turn on the spot, to the left by a positive angle; by actions as nearly as 5 degrees allow."""
        return self._moved_by(lambda trip: self._turned_by(angle_rad, trip))

    def _turned_by(self, angle_rad: float, trip: _Trip) -> Arrival:
        if not abs(angle_rad) <= _MOST_RAD:
            return self._arrival(trip, False, f"{angle_rad} rad is not an angle to turn by")
        left_rad = self._turned(angle_rad, trip)
        if trip.fault or abs(left_rad) > _TURNED_RAD:
            return self._arrival(trip, False, trip.fault or f"the turn ended {np.rad2deg(abs(left_rad)):.0f}° off")
        small = not trip.actions and abs(angle_rad) > 0.01
        return self._arrival(trip, True, "it turns in steps of 5°, and stays where less is asked" if small else "")

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead until an obstacle; for a negative distance it turns round first."""
        return self._moved_by(lambda trip: self._gone_ahead(distance_m, trip))

    def _gone_ahead(self, distance_m: float, trip: _Trip) -> Arrival:
        if not abs(distance_m) <= _MOST_M:
            return self._arrival(trip, False, f"{distance_m} m is not a distance to drive")
        if distance_m < 0.0 and abs(self._turned(pi, trip)) > _TURNED_RAD:
            return self._arrival(trip, False, trip.fault or "it could not turn round")
        start, distance_m = self.pose, abs(distance_m)
        arrived = self._stepped(round(distance_m / FORWARD_M), trip)
        gone_m = start.distance_m(self.pose)
        if not arrived:
            known = self._known_m(1.5 * FORWARD_M) >= 1.5 * FORWARD_M
            why = trip.fault or ("an obstacle is ahead" if known else "the floor ahead is not known")
            return self._arrival(trip, False, f"{why} after {gone_m:.2f} m")
        off_m = start.ahead(distance_m).distance_m(self.pose)
        if off_m > max(_OFF_M, _OFF_SHARE * distance_m):
            return self._arrival(
                trip, False, f"the body stands {off_m:.2f} m from where {distance_m:.2f} m ahead is (check its pose)"
            )
        small = not trip.actions and distance_m > 0.01
        return self._arrival(trip, True, "it drives in steps of 0.1 m, and stays where less is asked" if small else "")

    def stop(self) -> Arrival:
        """Stand still; whether the body does is looked at for a tenth of a second."""

        def stopped(trip: _Trip) -> Arrival:
            self._take(Action.STOP, trip)
            before = self.pose
            sleep(_LOOK_S)
            if (moved_m := before.distance_m(self.pose)) > _CREEP_M:
                trip.fault = f"the body moved by {moved_m:.2f} m after its stop; it may still move: use its own stop"
            return self._arrival(trip, not trip.fault, trip.fault)

        return self._moved_by(stopped)

    def _moved_by(self, movement: Callable[[_Trip], Arrival]) -> Arrival:
        """A body that fails is stopped, and is where it was seen last; Ctrl-C stops it as well."""
        trip = _Trip([(self._last.x_m, self._last.y_m)])
        whole = False
        try:
            trip.path[0] = self.pose.x_m, self.pose.y_m
            arrival = movement(trip)
            whole = not trip.fault
            return arrival
        except NavigationError as fault:
            why = str(fault).rstrip(".")
            return Arrival(False, self._last, tuple(trip.actions), np.array(trip.path), why, trip.contacts)
        finally:
            if not whole:
                with suppress(Exception):
                    self.body.act(Action.STOP)

    def _of_body(self, do: str, call: Callable[[], T]) -> T:
        try:
            return call()
        except Exception as fault:
            why = f"{type(fault).__name__}: {printable(fault, 200)}"
            raise NavigationError(f"The body failed to {do} ({why}); it may still move: use its own stop.") from fault

    @property
    def _xy(self) -> Float[np.ndarray, "2"]:
        return np.array([self.pose.x_m, self.pose.y_m])

    def _level(self, place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
        with np.errstate(invalid="ignore"):  # NaN lies off the map
            return np.asarray(place, np.float64) @ self.obstacles.level_from_world[:2].T

    def _arrival(self, trip: _Trip, reached: bool, note: str = "") -> Arrival:
        return Arrival(reached, self.pose, tuple(trip.actions), np.array(trip.path), note, trip.contacts)

    def _at_stop(self, trip: _Trip, stop: Stop | None, goal: Float[np.ndarray, "2"], note: str) -> Arrival:
        self._take(Action.STOP, trip)
        if stop is None:
            return self._arrival(trip, False, note)
        off_m, away_m = (float(np.hypot(*(self._xy - xy))) for xy in (stop.xy, goal))
        stands = f"it stands {away_m:.2f} m"
        if off_m > TOLERANCE_M or trip.fault:
            why = trip.fault or note or "it got no nearer"
            return self._arrival(trip, False, f"{why}, {away_m:.2f} m from the place")
        if not stop.seen:
            note = f"no path leads to where the place can be seen; {stands} away from it"
            return self._arrival(trip, False, note)
        if not stop.beside_m:
            return self._arrival(trip, True)
        if not stop.open:
            return self._arrival(trip, True, f"the robot cannot stand in the place itself; {stands} beside it")
        return self._arrival(trip, away_m <= _OPEN_M, f"no path leads to the place itself; {stands} beside it")

    def _no_way(self, goal: Float[np.ndarray, "2"]) -> str:
        if not self.planner.costmap.holds(goal):
            return f"the place ({goal[0]:.2f}, {goal[1]:.2f}) m is off the map"
        if self.planner.entry(self._xy) is None:
            here = np.append(self._xy, self.obstacles.floor_m) @ self.obstacles.level_from_world
            if forbidden := self.obstacles.forbids(here):
                return f"the robot stands where it may not be, and does not find out: {forbidden}"
            return "nothing round the robot is known to be free, so that it cannot set out"
        return "no path leads there that is wide enough for the robot"

    def _safe(self, start: GroundPose, end: GroundPose) -> bool:
        """Return whether a straight move touches nothing that is known; out of a tight place it may, if that helps."""
        costmap = self.planner.costmap
        count = int(start.distance_m(end) / _SAMPLE_M) + 2
        part = np.linspace(0.0, 1.0, count)[:, None]
        xy = (1 - part) * [start.x_m, start.y_m] + part * [end.x_m, end.y_m]
        cell_m = costmap.cell_size_m
        room_m = cell_m * rooms(costmap.in_cells(xy), costmap.occupied, costmap.radius_m / cell_m + 1.0)
        if room_m.min() >= costmap.radius_m - 1e-6:
            return True
        return bool(room_m[0] < costmap.radius_m and room_m.min() >= room_m[0] - 1e-6 and room_m[-1] > room_m[0])

    def _follow(self, points: Float[np.ndarray, "n 2"], trip: _Trip) -> bool:
        """Follow a path until its end; return False where an obstacle stopped it, which it then knows of."""
        controller = ActionController(points, self._safe)
        watch = StallDetector(controller.route)
        while trip.movements < _MOST_MOVEMENTS:
            trip.fault = watch.fault(self.pose)
            if trip.fault:
                return False
            action = controller.action(self.pose)
            if action is Action.STOP:
                return True
            if action is None:
                return controller.route.to_end_m(self.pose) <= TOLERANCE_M
            if not self._take(action, trip):
                return False
        return False

    def _stepped(self, steps: int, trip: _Trip) -> bool:
        for step in range(steps):
            if self._known_m((steps - step) * FORWARD_M) < FORWARD_M:
                return False
            if not self._safe(self.pose, self.pose.ahead(FORWARD_M)) or not self._take(Action.FORWARD, trip):
                return False
        return True

    def _known_m(self, distance_m: float) -> float:
        return self.planner.costmap.known_ahead_m(self._xy, self.pose.heading_rad, distance_m, ESCAPE_M)

    def _turned(self, angle_rad: float, trip: _Trip) -> float:
        start, left_rad, heading_rad = self.pose, angle_rad, self.pose.heading_rad
        planned = turns_for(angle_rad)
        for _ in range(len(planned) + _EXTRA_TURNS):
            if (gone_m := start.distance_m(self.pose)) > _BEYOND_M:
                trip.fault = f"the body moved by {gone_m:.2f} m where it was to turn on the spot (check its pose)"
            if trip.fault:
                break
            # Those that were planned first, so that an exact body takes no other; then what is still off.
            if not planned and abs(left_rad) > _TURNED_RAD:
                planned = turns_for(left_rad)[:1]
            if not planned:
                break
            self._take(planned.pop(), trip)
            left_rad -= wrap_angle(self.pose.heading_rad - heading_rad)
            heading_rad = self.pose.heading_rad
        return left_rad

    def _take(self, action: Action, trip: _Trip) -> bool:
        """Return False where something stopped the action."""
        if action is not Action.STOP and (why := self.held()):
            trip.fault = why
            return False
        before = self.pose
        moved = self._of_body("move", lambda: _moved(self.body.act(action)))
        trip.actions.append(action)
        return self._noted(trip, before, before.after(action), moved)

    def _noted(self, trip: _Trip, before: GroundPose, planned: GroundPose, moved: Moved) -> bool:
        trip.movements += 1
        trip.path.append((moved.pose.x_m, moved.pose.y_m))
        planned_m, moved_m = before.distance_m(planned), before.distance_m(moved.pose)
        if moved_m > planned_m + _BEYOND_M:
            trip.fault = f"the body moved by {moved_m:.2f} m where it was to move by {planned_m:.2f} m (check its pose)"
            return False
        turned = abs(wrap_angle(planned.heading_rad - before.heading_rad)) > _STILL_RAD
        if turned and not moved.contact and abs(wrap_angle(moved.pose.heading_rad - before.heading_rad)) < 1e-3:
            trip.turns_in_vain += 1
            if trip.turns_in_vain >= _IN_VAIN:
                trip.fault = "the body does not turn when commanded (check its pose)"
                return False
        elif turned:
            trip.turns_in_vain = 0
        stopped = moved.contact or (planned_m > 2 * _STILL_M and moved_m < _STILL_M)
        if planned_m:
            self.contacts.mark_free(moved.pose)
        if not stopped:
            return True
        trip.contacts += moved.contact
        # A turn has no direction in which it was stopped.
        if planned_m and self.contacts.mark_contact(before, planned, moved.pose):
            self._planner = None
        return False


def _posed(pose: GroundPose) -> GroundPose:
    if not isinstance(pose, GroundPose):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise TypeError(f"{type(pose).__name__} is no GroundPose")
    return pose


def _moved(moved: Moved) -> Moved:
    _posed(moved.pose)
    return moved
