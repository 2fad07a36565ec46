"""Driving in true geometry by a map: with a true map it arrives and touches nothing; with a wrong one it finds out."""

from dataclasses import replace
from itertools import pairwise
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core import poses
from avlmaps.core.motion import TURN_RAD, Action, GroundPose, wrapped
from avlmaps.maps.obstacles import CellState
from avlmaps.navigate.controller import bearing
from avlmaps.navigate.driver import Driver, DriveSettings, MapDriver
from avlmaps.sim.body import Building, MotionNoise, SimulatedBody
from avlmaps.sim.scenes import open_scene
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
VELOCITY = DriveSettings(mode="velocity")
MODES = pytest.mark.parametrize("drive", [DriveSettings(), VELOCITY], ids=["actions", "velocity"])
PLACES = st.tuples(st.floats(0.05, 5.95), st.floats(0.05, 3.95))


def driver_in(building, drive=None, start=START, obstacles=MAP, **options):
    return MapDriver(obstacles, SimulatedBody(building, start, **options), settings=drive)


def place(x, y):
    return np.array([x, y, 0.3])


def test_it_is_a_driver():
    assert isinstance(driver_in(BUILDING), Driver)


@settings(max_examples=25)
@given(
    goals=st.lists(PLACES, min_size=1, max_size=4), smooth=st.booleans(), on_contact=st.sampled_from(["stop", "slide"])
)
def test_by_a_true_map_it_touches_nothing_and_arrival_means_being_there(goals, smooth, on_contact):
    driver = driver_in(BUILDING, VELOCITY if smooth else None, on_contact=on_contact)
    for goal in goals:
        stop = driver.planner.stop_for(np.array([driver.pose.x_m, driver.pose.y_m]), np.array(goal))
        arrival = driver.go_to(place(*goal))
        assert arrival.contacts == 0
        assert arrival.pose == driver.pose
        assert stop is not None
        away_m = hypot(arrival.pose.x_m - stop.xy[0], arrival.pose.y_m - stop.xy[1])
        assert arrival.reached == stop.seen
        assert away_m <= driver.settings.tolerance_m
        assert bool(arrival.note) == (stop.beside_m > 0.0)
        assert np.all(np.linalg.norm(np.diff(arrival.path, axis=0), axis=1) <= 0.1 + 1e-9)


@pytest.mark.parametrize("drive", [DriveSettings(), VELOCITY], ids=["actions", "velocity"])
def test_it_faces_what_it_is_told_to_once_there(drive):
    driver = driver_in(BUILDING, drive)
    arrival = driver.go_to(place(3.0, 3.2), face=place(3.4, 2.3))
    off = wrapped(bearing(arrival.pose, 3.4, 2.3) - arrival.pose.heading_rad)
    assert arrival.reached
    assert abs(off) <= TURN_RAD / 2 + 0.01


def test_the_actions_are_those_that_were_taken():
    driver = driver_in(BUILDING)
    arrival = driver.go_to(place(3.0, 3.2))
    again = SimulatedBody(BUILDING, START)
    for action in arrival.actions:
        again.act(action)
    assert again.pose == arrival.pose
    assert arrival.actions[-1] is Action.STOP
    assert Action.STOP not in arrival.actions[:-1]
    assert len(arrival.path) == len(arrival.actions) + 1


@MODES
@pytest.mark.parametrize("on_contact", ["stop", "slide"])
def test_a_wall_that_the_map_does_not_know_is_found_and_driven_round(drive, on_contact):
    other = Building(hall(6.0, 4.0, [*BOXES, (2.5, 1.5, 0.0, 2.6, 4.0, 2.0)]))
    driver = driver_in(other, drive, start=GroundPose(0.5, 3.0), on_contact=on_contact)
    arrival = driver.go_to(place(4.0, 3.3))
    assert arrival.reached
    assert arrival.contacts > 0
    assert driver.met.cells.any()
    assert not (MAP.states == CellState.OCCUPIED)[driver.met.cells].any()
    back = driver.go_to(place(0.5, 3.0))
    assert back.reached
    assert back.contacts <= 1


@MODES
def test_what_stands_round_it_on_all_sides_makes_it_give_up(drive):
    ring = [(0.05, 1.0, 0, 1.2, 1.1, 1), (1.1, 0.05, 0, 1.2, 1.1, 1)]
    driver = driver_in(Building(hall(6.0, 4.0, [*BOXES, *ring])), drive)
    arrival = driver.go_to(place(3.0, 3.2))
    assert not arrival.reached
    assert arrival.note
    assert hypot(arrival.pose.x_m, arrival.pose.y_m) < 1.3


def test_a_closed_room_is_not_reached_and_it_says_so():
    closed = seen(hall(6.0, 4.0, [*BOXES, (3.0, 0.0, 0.0, 3.1, 4.0, 2.4)]))
    driver = driver_in(BUILDING, obstacles=closed)
    far = driver.go_to(place(5.5, 3.5))
    assert not far.reached
    assert far.note == "no way leads there that is wide enough for the robot"
    assert far.pose == START
    near = driver.go_to(place(3.5, 3.5))
    assert not near.reached
    assert near.note.startswith("no way leads to where the place can be seen; it stands 0.")


def test_a_place_off_the_map_is_not_reached():
    arrival = driver_in(BUILDING).go_to(place(60.0, 1.0))
    assert not arrival.reached
    assert arrival.note == "the place (60.00, 1.00) m is off the map"
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


@given(angle=st.floats(-pi, pi), smooth=st.booleans())
def test_a_turn_is_to_the_left_and_as_far_as_told(angle, smooth):
    driver = driver_in(BUILDING, VELOCITY if smooth else None, start=GroundPose(0.8, 0.6, 1.0))
    arrival = driver.turn(angle)
    assert arrival.reached
    assert abs(wrapped(arrival.pose.heading_rad - 1.0 - angle)) <= TURN_RAD / 2 + 0.01
    assert len(arrival.actions) == (0 if smooth else abs(round(angle / TURN_RAD)))


@MODES
def test_forward_goes_as_far_as_told_or_as_nothing_is_in_the_way(drive):
    driver = driver_in(BUILDING, drive)
    ahead = driver.forward(1.0)
    assert ahead.reached
    assert ahead.pose.x_m == pytest.approx(1.5, abs=0.06)
    blocked = driver_in(BUILDING, drive, start=GroundPose(0.5, 1.2)).forward(2.0)
    assert not blocked.reached
    assert blocked.contacts == 0
    assert blocked.note.startswith("something is in the way after 0.")
    back = driver_in(BUILDING, drive, start=GroundPose(1.0, 0.5)).forward(-0.5)
    assert back.pose.x_m == pytest.approx(0.5, abs=0.06)


def test_stop_stands_still():
    arrival = driver_in(BUILDING).stop()
    assert arrival.reached
    assert arrival.actions == (Action.STOP,)
    assert arrival.pose == START


@MODES
def test_it_corrects_for_a_body_that_moves_inexactly(drive):
    for seed in range(3):
        noise = MotionNoise(0.1, 0.1, 0.05)
        driver = driver_in(BUILDING, drive, noise=noise, rng=np.random.default_rng(seed))
        for goal in ((5.5, 3.5), (0.5, 3.5), (5.3, 0.5)):
            assert driver.go_to(place(*goal)).reached


def test_a_tilted_world_is_driven_in_its_level_frame():
    turned = poses.from_quaternion(np.zeros(3), np.array([0.2, -0.3, 0.1, 0.9]))
    level_from_world = turned[:3, :3].T
    driver = driver_in(BUILDING, obstacles=replace(MAP, level_from_world=level_from_world))
    arrival = driver.go_to(level_from_world.T @ np.array([3.0, 3.2, 0.7]), face=level_from_world.T @ place(0.0, 3.2))
    assert arrival.reached
    assert hypot(arrival.pose.x_m - 3.0, arrival.pose.y_m - 3.2) < 0.15
    assert abs(wrapped(arrival.pose.heading_rad - pi)) < 0.1


def test_a_body_that_never_moves_is_given_up():
    class Stuck(SimulatedBody):
        def _moved(self, ahead_m, turn_rad):
            return super()._moved(0.0, turn_rad)

    arrival = MapDriver(MAP, Stuck(BUILDING, START)).go_to(place(3.0, 3.2))
    assert not arrival.reached
    assert arrival.contacts == 0
    assert len(arrival.actions) < 5_100


@MODES
def test_in_a_home_it_gets_everywhere_and_touches_nothing(drive):
    scene = open_scene("house:7")
    building, obstacles = Building(scene), seen(scene)
    rng = np.random.default_rng(0)
    body = SimulatedBody(building, GroundPose(*_somewhere(obstacles, building, rng)))
    driver = MapDriver(obstacles, body, settings=drive)
    part = driver.planner._part
    here = part[tuple(driver.planner.costmap.cell_of(np.array([driver.pose.x_m, driver.pose.y_m])))]
    reachable = driver.planner.costmap.middle_of(np.argwhere(part == here))
    assert len(reachable) * obstacles.cell_size_m**2 > 15.0
    driven_m, planned_m = 0.0, 0.0
    for goal in reachable[rng.integers(0, len(reachable), 12)]:
        planned_m += driver.planner.way(np.array([driver.pose.x_m, driver.pose.y_m]), goal).length_m
        arrival = driver.go_to(np.array([*goal, 0.0]))
        assert arrival.reached
        assert not arrival.note
        driven_m += sum(float(np.hypot(*(b - a))) for a, b in pairwise(arrival.path))
    assert body.contacts == 0
    assert driven_m < 1.05 * planned_m


def _somewhere(obstacles, building, rng):
    from avlmaps.navigate.costmap import costmap_of
    from avlmaps.navigate.planner import Planner

    planner = Planner(costmap_of(obstacles, 0.2))
    part = planner._part
    largest = np.argmax(np.bincount(part[part > 0]))
    cells = planner.costmap.middle_of(np.argwhere(part == largest))
    return cells[rng.integers(len(cells))]
