"""Driving in true geometry by a map: with a true map it arrives and touches nothing; with a wrong one it finds out."""

from dataclasses import replace
from itertools import pairwise
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core import poses
from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose, Moved, wrap_angle
from avlmaps.maps.obstacles import BodyShape, CellState, Obstacles
from avlmaps.navigate.controller import bearing
from avlmaps.navigate.driver import TOLERANCE_M, Driver, MapDriver
from avlmaps.navigate.instruct import FreeBody
from avlmaps_sim.body import Building, MotionNoise, SimulatedBody
from avlmaps_sim.scenes import open_scene
from helpers.floors import hall, seen

BOXES = [
    (1.5, 1.0, 0.0, 2.0, 1.4, 1.0),  # a chest
    (3.0, 2.0, 0.7, 3.8, 2.6, 0.75),  # a table's top
    (4.5, 0.0, 0.0, 4.6, 2.2, 2.0),  # a wall
]
KNOWN = hall(6.0, 4.0, BOXES)
MAP = seen(KNOWN)
BUILDING = Building(KNOWN)
START = GroundPose(0.5, 0.5)
PLACES = st.tuples(st.floats(0.05, 5.95), st.floats(0.05, 3.95))


def driver_in(building, start=START, obstacles=MAP, **options):
    return MapDriver(obstacles, SimulatedBody(building, start, **options))


def place(x, y):
    return np.array([x, y, 0.3])


def test_it_is_a_driver():
    assert isinstance(driver_in(BUILDING), Driver)


@given(goals=st.lists(PLACES, min_size=1, max_size=4), on_contact=st.sampled_from(["stop", "slide"]))
@pytest.mark.slow
def test_by_a_true_map_it_touches_nothing_and_arrival_means_being_there(goals, on_contact):
    driver = driver_in(BUILDING, on_contact=on_contact)
    for goal in goals:
        stop = driver.planner.stop_for(np.array([driver.pose.x_m, driver.pose.y_m]), np.array(goal))
        arrival = driver.go_to(place(*goal))
        assert arrival.contacts == 0 and arrival.pose == driver.pose
        assert stop is not None
        away_m = hypot(arrival.pose.x_m - stop.xy[0], arrival.pose.y_m - stop.xy[1])
        assert arrival.reached == stop.seen and away_m <= TOLERANCE_M
        assert bool(arrival.note) == (stop.beside_m > 0.0)
        assert np.all(np.linalg.norm(np.diff(arrival.path, axis=0), axis=1) <= 0.1 + 1e-9)


def test_it_faces_what_it_is_told_to_once_there():
    driver = driver_in(BUILDING)
    arrival = driver.go_to(place(3.0, 3.2), face=place(3.4, 2.3))
    off = wrap_angle(bearing(arrival.pose, 3.4, 2.3) - arrival.pose.heading_rad)
    assert arrival.reached and abs(off) <= TURN_RAD / 2 + 0.01


def test_the_actions_are_those_that_were_taken():
    driver = driver_in(BUILDING)
    arrival = driver.go_to(place(3.0, 3.2))
    again = SimulatedBody(BUILDING, START)
    for action in arrival.actions:
        again.act(action)
    assert again.pose == arrival.pose and arrival.actions[-1] is Action.STOP
    assert Action.STOP not in arrival.actions[:-1] and len(arrival.path) == len(arrival.actions) + 1


@pytest.mark.parametrize("on_contact", ["stop", "slide"])
def test_a_wall_that_the_map_does_not_know_is_found_and_driven_round(on_contact):
    other = Building(hall(6.0, 4.0, [*BOXES, (2.5, 1.5, 0.0, 2.6, 4.0, 2.0)]))
    driver = driver_in(other, start=GroundPose(0.5, 3.0), on_contact=on_contact)
    arrival = driver.go_to(place(4.0, 3.3))
    assert arrival.reached and arrival.contacts > 0
    assert driver.contacts.cells.any()
    assert not (MAP.states == CellState.OCCUPIED)[driver.contacts.cells].any()
    back = driver.go_to(place(0.5, 3.0))
    assert back.reached and back.contacts <= 1


def test_a_closed_room_is_not_reached_and_it_says_so():
    closed = seen(hall(6.0, 4.0, [*BOXES, (3.0, 0.0, 0.0, 3.1, 4.0, 2.4)]))
    driver = driver_in(BUILDING, obstacles=closed)
    far = driver.go_to(place(5.5, 3.5))
    assert not far.reached and far.note == "no path leads there that is wide enough for the robot"
    assert far.pose == START
    near = driver.go_to(place(3.5, 3.5))
    assert not near.reached
    assert near.note.startswith("no path leads to where the place can be seen; it stands 0.")


def test_a_place_off_the_map_is_not_reached():
    arrival = driver_in(BUILDING).go_to(place(60.0, 1.0))
    assert not arrival.reached and arrival.note == "the place (60.00, 1.00) m is off the map"
    assert arrival.actions == ()


def test_beside_a_thing_it_says_how_far():
    arrival = driver_in(BUILDING).go_to(place(1.75, 1.2))
    assert arrival.reached
    assert arrival.note.startswith("the robot cannot stand in the place itself; it stands 0.")


def test_a_body_that_the_map_says_is_stuck_says_so():
    walled = replace(MAP, states=np.full_like(MAP.states, CellState.OCCUPIED))
    arrival = driver_in(BUILDING, obstacles=walled).go_to(place(3.0, 3.0))
    assert not arrival.reached
    assert arrival.note == "nothing round the robot is known to be free, so that it cannot set out"


@given(angle=st.floats(-pi, pi))
def test_a_turn_is_to_the_left_and_as_far_as_told(angle):
    driver = driver_in(BUILDING, start=GroundPose(0.8, 0.6, 1.0))
    arrival = driver.turn(angle)
    assert arrival.reached
    assert abs(wrap_angle(arrival.pose.heading_rad - 1.0 - angle)) <= TURN_RAD / 2 + 0.01
    assert len(arrival.actions) == abs(round(angle / TURN_RAD))


def test_forward_goes_as_far_as_told_or_as_nothing_is_in_the_way():
    driver = driver_in(BUILDING)
    ahead = driver.forward(1.0)
    assert ahead.reached and ahead.pose.x_m == pytest.approx(1.5, abs=0.06)
    blocked = driver_in(BUILDING, start=GroundPose(0.5, 1.2)).forward(2.0)
    assert not blocked.reached and blocked.contacts == 0
    assert blocked.note.startswith("an obstacle is ahead after 0.")
    back = driver_in(BUILDING, start=GroundPose(1.0, 0.5)).forward(-0.5)
    assert back.pose.x_m == pytest.approx(0.5, abs=0.06)


def test_it_corrects_for_a_body_that_moves_inexactly():
    for seed in range(3):
        noise = MotionNoise(0.1, 0.1, 0.05)
        driver = driver_in(BUILDING, noise=noise, rng=np.random.default_rng(seed))
        for goal in ((5.5, 3.5), (0.5, 3.5), (5.3, 0.5)):
            assert driver.go_to(place(*goal)).reached


def test_a_tilted_world_is_driven_in_its_level_frame():
    turned = poses.from_quaternion(np.zeros(3), np.array([0.2, -0.3, 0.1, 0.9]))
    level_from_world = turned[:3, :3].T
    driver = driver_in(BUILDING, obstacles=replace(MAP, level_from_world=level_from_world))
    arrival = driver.go_to(level_from_world.T @ np.array([3.0, 3.2, 0.7]), face=level_from_world.T @ place(0.0, 3.2))
    assert arrival.reached and hypot(arrival.pose.x_m - 3.0, arrival.pose.y_m - 3.2) < 0.15
    assert abs(wrap_angle(arrival.pose.heading_rad - pi)) < 0.1


def test_a_body_that_never_moves_is_given_up():
    class Stuck(SimulatedBody):
        def _moved(self, ahead_m, turn_rad):
            return super()._moved(0.0, turn_rad)

    arrival = MapDriver(MAP, Stuck(BUILDING, START)).go_to(place(3.0, 3.2))
    assert not arrival.reached and arrival.contacts == 0
    assert len(arrival.actions) < 5_100


@pytest.mark.nightly
def test_in_a_home_it_gets_everywhere_and_touches_nothing():
    scene = open_scene("house:7")
    building, obstacles = Building(scene), seen(scene)
    rng = np.random.default_rng(0)
    body = SimulatedBody(building, GroundPose(*_somewhere(obstacles, building, rng)))
    driver = MapDriver(obstacles, body)
    part = driver.planner._part
    here = part[tuple(driver.planner.costmap.cell_of(np.array([driver.pose.x_m, driver.pose.y_m])))]
    reachable = driver.planner.costmap.middle_of(np.argwhere(part == here))
    assert len(reachable) * obstacles.cell_size_m**2 > 15.0
    driven_m, planned_m = 0.0, 0.0
    for goal in reachable[rng.integers(0, len(reachable), 12)]:
        planned_m += driver.planner.way(np.array([driver.pose.x_m, driver.pose.y_m]), goal).length_m
        arrival = driver.go_to(np.array([*goal, 0.0]))
        assert arrival.reached and not arrival.note
        driven_m += sum(float(np.hypot(*(b - a))) for a, b in pairwise(arrival.path))
    assert body.contacts == 0 and driven_m < 1.05 * planned_m


def _somewhere(obstacles, building, rng):
    from avlmaps.navigate.costmap import costmap_of
    from avlmaps.navigate.planner import Planner

    planner = Planner(costmap_of(obstacles, 0.2))
    part = planner._part
    largest = np.argmax(np.bincount(part[part > 0]))
    cells = planner.costmap.middle_of(np.argwhere(part == largest))
    return cells[rng.integers(len(cells))]


def of_plan(states, cell_m=0.05):
    return Obstacles(np.eye(3), np.zeros(2), cell_m, 0.0, np.asarray(states, np.uint8))


class Free:
    """A body in the open that may be wrong in many ways."""

    def __init__(self, pose, ahead=1.0, turns=1.0, contact=False, noise_rad=0.0):
        self.pose, self.ahead, self.turns, self.contact = pose, ahead, turns, contact
        self.noise_rad, self.rng = noise_rad, np.random.default_rng(0)

    def act(self, action):
        sign = {Action.LEFT: 1, Action.RIGHT: -1}.get(action, 0)
        return self._moved(FORWARD_M * (action is Action.FORWARD), sign * TURN_RAD)

    def _moved(self, ahead_m, turn_rad):
        turn_rad = self.turns * turn_rad + (self.noise_rad * self.rng.normal() if turn_rad else 0.0)
        self.pose = self.pose.turned(turn_rad).ahead(self.ahead * ahead_m)
        return Moved(self.pose, self.contact)


FLOOR = of_plan(np.full((200, 100), CellState.FREE))


@pytest.mark.parametrize("told_m, heading_rad, gone_m", [(4.0, 0.0, 2.0), (20.0, pi, 1.0), (1e5, pi / 2, 4.0)])
def test_forward_stops_where_the_known_floor_ends(told_m, heading_rad, gone_m):
    states = np.full((120, 100), CellState.UNKNOWN)
    states[:60] = CellState.FREE
    states[30:34, 18:22] = CellState.UNKNOWN  # a small hole is not an end
    body = Free(GroundPose(1.0, 1.0, heading_rad))
    arrival = MapDriver(of_plan(states), body).forward(told_m)
    assert not arrival.reached and arrival.note.startswith("the floor ahead is not known after ")
    gone = hypot(arrival.pose.x_m - 1.0, arrival.pose.y_m - 1.0)
    assert gone_m - 0.15 <= gone <= gone_m + 0.01


def test_from_unknown_ground_forward_leads_a_short_way_out_and_no_farther():
    states = np.full((200, 40), CellState.FREE)
    states[:80] = CellState.UNKNOWN
    out = MapDriver(of_plan(states), Free(GroundPose(3.5, 1.0))).forward(1.5)
    assert out.reached and out.pose.x_m == pytest.approx(5.0, abs=0.1)
    lost = MapDriver(of_plan(states), Free(GroundPose(1.0, 1.0))).forward(1.5)
    assert not lost.reached and lost.pose == GroundPose(1.0, 1.0)


@pytest.mark.parametrize("wrong", [{"turns": 0.0}, {"turns": -1.0}, {"turns": 0.1}, {"turns": 0.0, "contact": True}])
def test_a_turn_that_does_not_come_about_is_not_reached(wrong):
    body = Free(GroundPose(2.0, 2.0), **wrong)
    arrival = MapDriver(FLOOR, body).turn(1.0)
    assert not arrival.reached
    assert arrival.note.startswith(("the turn ended ", "the body does not turn when commanded"))
    assert len(arrival.actions) <= 60 and bool(arrival.contacts) == body.contact


def test_a_contact_in_a_turn_tells_of_nothing_ahead():
    driver = MapDriver(FLOOR, Free(GroundPose(2.0, 2.0), contact=True))
    assert driver.turn(1.0).contacts == 11 and not driver.contacts.cells.any()


@pytest.mark.parametrize("wrong", [{"ahead": -1.0}, {"turns": -1.0}])
def test_a_body_that_moves_otherwise_than_told_is_stopped_soon(wrong):
    driver = MapDriver(FLOOR, Free(GroundPose(5.0, 2.5, 1.0), **wrong))
    arrival = driver.go_to(place(9.0, 2.5))
    assert not arrival.reached
    assert "the body does not move as commanded; check the frame of its pose" in arrival.note
    assert hypot(arrival.pose.x_m - 5.0, arrival.pose.y_m - 2.5) < 2.5


def test_what_is_too_small_for_an_action_is_told():
    driver = driver_in(BUILDING)
    for arrival in (driver.forward(0.04), driver.turn(np.radians(2.0))):
        assert arrival.actions == () and "and stays where less is asked" in arrival.note
    assert not driver.turn(0.001).note


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e300])
def test_numbers_that_are_none_are_answered(number):
    driver = driver_in(BUILDING)
    assert not driver.turn(number).reached and not driver.forward(number).reached
    assert not driver.go_to(place(number, 1.0)).reached and driver.pose == START
    assert driver.go_to(place(1.0, 0.5), face=place(number, 0.0)).pose.x_m == pytest.approx(1.0, abs=0.15)


def test_before_a_wall_that_nobody_knew_it_is_not_where_it_was_told():
    other = Building(hall(6.0, 4.0, [(3.5, 0.0, 0.0, 3.6, 4.0, 2.0)]))
    driver = driver_in(other, start=GroundPose(1.0, 1.0), obstacles=seen(hall(6.0, 4.0)))
    arrival = driver.go_to(place(4.6, 1.0))
    assert arrival.contacts > 0 and arrival.pose.x_m < 3.5
    assert not arrival.reached and arrival.note


def test_just_beside_a_place_with_no_way_in_it_says_why():
    states = np.full((100, 60), CellState.FREE)
    states[60:70, 25:35] = CellState.OCCUPIED
    states[61:69, 26:34] = CellState.FREE  # too narrow a pit for the body
    driver = MapDriver(of_plan(states), Free(GroundPose(1.0, 1.5)), BodyShape(radius_m=0.1))
    arrival = driver.go_to(place(3.25, 1.5))
    assert "no path leads" in arrival.note


class Odd(FreeBody):
    """A body that does or says something else than it should, from its fourth movement on."""

    def __init__(self, odd: str) -> None:
        super().__init__(START)
        self.odd, self.count, self.stops = odd, 0, 0

    def act(self, action):
        self.stops += action is Action.STOP
        return self._done(super().act(action))

    def _done(self, moved):
        self.count += 1
        if self.count < 4:
            return moved
        x, y, heading = moved.pose.x_m, moved.pose.y_m, moved.pose.heading_rad
        match self.odd:
            case "nan":
                return Moved(GroundPose(float("nan"), y, heading))
            case "nothing" | "bare":
                return moved.pose if self.odd == "bare" else Moved(None)  # pyright: ignore[reportArgumentType]
            case "gone":
                raise OSError("connection reset")
            case "jumps":
                self.pose = GroundPose(x + 2.5, y + 2.0, heading)
            case "creeps":
                self.pose = GroundPose(x, y + 0.12, heading)
            case "is there":
                self.pose = GroundPose(3.0, 3.2, heading)
            case "looks ahead":
                self.pose = GroundPose(x, y, 0.0)
            case "ends the program":
                raise KeyboardInterrupt
        return Moved(self.pose)


@pytest.mark.parametrize(
    ("odd", "says"),
    [
        ("nan", "failed to move (ValueError"),
        ("nothing", "failed to move (TypeError"),
        ("bare", "failed to move (AttributeError"),
        ("gone", "failed to move (OSError: connection reset)"),
        ("jumps", "the body moved by 3.2"),
    ],
)
def test_a_body_that_fails_or_does_something_else_is_stopped(odd, says):
    for move in (lambda d: d.go_to(place(3.0, 3.2)), lambda d: d.forward(0.9), lambda d: d.turn(pi / 2)):
        body = Odd(odd)
        arrival = move(MapDriver(MAP, body))
        assert not arrival.reached and says in arrival.note
        assert np.isfinite(arrival.path).all() and body.count <= 6
        assert odd == "jumps" or body.stops


def test_a_body_whose_pose_is_no_pose_is_refused():
    body = FreeBody(START)
    body.pose = Moved(START)
    with pytest.raises(NavigationError, match=r"say where it is .*Moved is no GroundPose"):
        MapDriver(MAP, body)


def test_a_body_that_says_it_is_at_the_goal_at_once_is_not_there():
    body = Odd("is there")
    arrival = MapDriver(MAP, body).go_to(place(3.0, 3.2))
    assert not arrival.reached and "the body moved by" in arrival.note and body.stops


def test_a_program_that_is_ended_while_the_body_moves_stops_it():
    for move in (lambda d: d.go_to(place(3.0, 3.2)), lambda d: d.forward(0.9), lambda d: d.turn(pi / 2)):
        body = Odd("ends the program")
        with pytest.raises(KeyboardInterrupt):
            move(MapDriver(MAP, body))
        assert body.stops == 1


def test_a_stop_that_does_nothing_is_told():
    class Rolling(FreeBody):
        rolls = True

        @property
        def pose(self):
            if self.rolls:
                self._pose = self._pose.ahead(0.02)
            return self._pose

        @pose.setter
        def pose(self, pose):
            self._pose = pose

    body = Rolling(START)
    arrival = MapDriver(MAP, body).stop()
    assert not arrival.reached and "use its own stop" in arrival.note
    body.rolls = False
    assert MapDriver(MAP, body).stop().reached


def test_what_ends_elsewhere_than_it_should_is_not_reached():
    assert "turn on the spot" in MapDriver(MAP, Odd("creeps")).turn(pi / 2).note
    assert "from where 0.60 m ahead is" in MapDriver(MAP, Odd("creeps")).forward(0.6).note


def test_a_driver_that_is_held_moves_no_further():
    for move in (lambda d: d.go_to(place(3.0, 3.2)), lambda d: d.forward(-0.9), lambda d: d.turn(pi / 2)):
        body = Odd("")
        driver = MapDriver(MAP, body)
        driver.held = lambda body=body: "the floor is wet" if body.count >= 4 else ""
        arrival = move(driver)
        assert not arrival.reached and "the floor is wet" in arrival.note
        assert body.count - body.stops == 4 and len(arrival.path) >= 5
