"""Whatever a body is told, nothing gets into it; where nothing is near, it goes exactly where it is told."""

from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose
from avlmaps.navigate.driver import Body
from avlmaps_sim.body import Building, MotionNoise, SimulatedBody
from helpers.floors import hall

RADIUS_M, TOLERANCE_M = 0.2, 1e-4
BOXES = [
    (1.5, 1.0, 0.0, 2.0, 1.4, 1.0),  # stands on the floor
    (3.0, 2.0, 0.7, 3.8, 2.6, 0.75),  # a table's top
    (2.5, 3.0, 1.8, 3.5, 3.5, 2.0),  # hangs over the body
    (3.0, 0.5, 0.0, 3.5, 0.9, 0.05),  # low enough to drive over
]
HALL = Building(hall(4.5, 4.0, BOXES))
START = GroundPose(0.5, 0.5)
ACTIONS = st.lists(st.sampled_from([Action.FORWARD] * 4 + [Action.LEFT, Action.RIGHT, Action.STOP]), max_size=120)


def body(pose=START, **options):
    return SimulatedBody(HALL, pose, RADIUS_M, **options)


def test_it_is_a_body():
    assert isinstance(body(), Body)


@given(
    actions=ACTIONS, heading=st.floats(-pi, pi), on_contact=st.sampled_from(["stop", "slide"]), seed=st.integers(0, 9)
)
def test_nothing_gets_into_it_by_actions(actions, heading, on_contact, seed):
    noise = MotionNoise(0.2, 0.2, 0.1) if seed else None
    robot = body(GroundPose(0.5, 0.5, heading), on_contact=on_contact, noise=noise, rng=np.random.default_rng(seed))
    for action in actions:
        before = robot.pose
        moved = robot.act(action)
        assert moved.pose == robot.pose
        assert HALL.clearance_m(robot.pose.x_m, robot.pose.y_m) >= RADIUS_M - TOLERANCE_M
        assert 0.0 < robot.pose.x_m < 4.5
        assert 0.0 < robot.pose.y_m < 4.0
        if seed == 0:
            assert before.distance_m(robot.pose) <= FORWARD_M + 1e-9
            assert moved.contact == (action is Action.FORWARD and before.distance_m(robot.pose) < FORWARD_M - 1e-6)


def test_in_the_open_an_action_is_exact_and_a_whole_turn_comes_back():
    robot = body(GroundPose(0.5, 0.5, 0.3))
    moved = robot.act(Action.FORWARD)
    assert not moved.contact
    assert moved.pose.distance_m(GroundPose(0.5, 0.5, 0.3).ahead(FORWARD_M)) < 1e-12
    assert robot.act(Action.LEFT).pose.heading_rad == pytest.approx(0.3 + TURN_RAD)
    for _ in range(71):
        robot.act(Action.LEFT)
    assert robot.pose.heading_rad == pytest.approx(0.3)
    assert robot.contacts == 0
    assert robot.travelled_m == pytest.approx(FORWARD_M)


@pytest.mark.parametrize("heading", [0.0, pi / 2, pi, -pi / 2])
def test_straight_into_a_wall_it_stops_at_its_radius(heading):
    robot = body(GroundPose(1.0, 2.3, heading))
    while not robot.act(Action.FORWARD).contact:
        pass
    assert HALL.clearance_m(robot.pose.x_m, robot.pose.y_m) == pytest.approx(RADIUS_M, abs=1e-4)
    assert robot.act(Action.FORWARD).contact


def test_along_a_wall_it_slides_or_stops():
    slanted = GroundPose(0.5, 0.25, -pi / 6)
    sliding, stopping = body(slanted, on_contact="slide"), body(slanted, on_contact="stop")
    for _ in range(10):
        sliding.act(Action.FORWARD)
        stopping.act(Action.FORWARD)
    assert sliding.pose.x_m == pytest.approx(0.5 + 1.0 * np.cos(pi / 6), abs=0.03)
    assert sliding.pose.y_m == pytest.approx(RADIUS_M, abs=1e-3)
    assert stopping.pose.x_m < 0.62
    assert sliding.contacts >= 9
    assert stopping.contacts >= 9


def test_it_gets_away_from_what_it_touched():
    robot = body(GroundPose(1.0, 0.25, -pi / 2), on_contact="stop")
    assert robot.act(Action.FORWARD).contact
    for heading in (0.0, pi / 2):
        turned = SimulatedBody(HALL, GroundPose(robot.pose.x_m, robot.pose.y_m, heading), RADIUS_M, on_contact="stop")
        assert not turned.act(Action.FORWARD).contact


def test_a_flat_thing_and_a_high_one_are_not_in_the_way_and_a_table_is():
    over = body(GroundPose(2.6, 0.7))
    assert not any(over.act(Action.FORWARD).contact for _ in range(10))
    under = body(GroundPose(3.0, 3.7, -pi / 2))
    assert not any(under.act(Action.FORWARD).contact for _ in range(6))
    into = body(GroundPose(2.5, 2.3))
    assert any(into.act(Action.FORWARD).contact for _ in range(10))


def test_a_body_that_flies_passes_over_a_table():
    drone = SimulatedBody(hall(4.5, 4.0, BOXES), GroundPose(2.5, 2.3), RADIUS_M, 1.5, flies_m=1.1)
    assert not any(drone.act(Action.FORWARD).contact for _ in range(15))


def test_it_does_not_drive_off_the_floor():
    from avlmaps_sim import shapes
    from avlmaps_sim.scene import SceneBuilder
    from helpers.floors import GREY

    build = SceneBuilder("edge")
    build.add("floor", shapes.box((0, 0, -0.1), (3, 3, 0), GREY))
    build.add("wall", shapes.box((5, 0, 0), (5.1, 3, 2.5), GREY))
    robot = SimulatedBody(build.build(), GroundPose(2.0, 1.5))
    contacts = [robot.act(Action.FORWARD).contact for _ in range(20)]
    assert contacts[-1]
    assert 2.8 < robot.pose.x_m < 3.2


def test_a_start_within_something_is_told():
    with pytest.raises(NavigationError) as error:
        body(GroundPose(0.1, 1.0))
    assert str(error.value) == (
        "The robot cannot stand at (0.10, 1.00) m in hall: the nearest thing is 0.10 m away, and its radius is "
        "0.20 m; give another start."
    )
    with pytest.raises(NavigationError, match="there is no floor"):
        body(GroundPose(9.0, 1.0))


def test_noise_needs_a_generator_and_repeats_with_it():
    with pytest.raises(ValueError, match="generator"):
        body(noise=MotionNoise(0.1))
    ends = []
    for _ in range(2):
        robot = body(noise=MotionNoise(0.1, 0.1, 0.1), rng=np.random.default_rng(3))
        for action in (Action.FORWARD, Action.LEFT, Action.FORWARD):
            robot.act(action)
        ends.append(robot.pose)
    assert ends[0] == ends[1]
    assert ends[0].distance_m(START) > 0.01


@given(seed=st.integers(0, 1000))
def test_what_it_is_near_to_is_what_the_scene_has_there(seed):
    """The cut's distances, against distances to points spread over the triangles."""
    rng = np.random.default_rng(seed)
    scene = HALL.scene
    corners = scene.mesh.corners().astype(float)
    weight = rng.dirichlet(np.ones(3), size=(len(corners), 4000))
    points = np.einsum("tnk,tkd->tnd", weight, corners).reshape(-1, 3)
    points = points[(points[:, 2] > 0.1) & (points[:, 2] < 1.5)]
    x, y = rng.uniform(0.3, 4.0, 2)
    nearest = float(np.hypot(*(points[:, :2] - (x, y)).T).min())
    clear_m = HALL.clearance_m(x, y)
    assert clear_m <= nearest + 1e-6
    inside = any(b[0] < x < b[3] and b[1] < y < b[4] for b in BOXES[:2])
    assert inside or clear_m == pytest.approx(nearest, abs=0.06)


@pytest.mark.nightly
def test_thousands_of_actions_stay_in_the_home():
    robot = body(GroundPose(2.2, 2.2))
    rng = np.random.default_rng(0)
    actions = [Action.FORWARD, Action.FORWARD, Action.LEFT, Action.RIGHT]
    drawn = [actions[k] for k in rng.integers(0, 4, 4000)]
    for action in drawn:
        robot.act(action)
    assert hypot(robot.pose.x_m, robot.pose.y_m) < 7.0
