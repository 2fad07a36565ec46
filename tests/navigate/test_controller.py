"""Following a way: it ends where it should, never beyond its bounds, and never by a step that is not safe."""

from itertools import pairwise
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.motion import FORWARD_M, TURN_RAD, Action, GroundPose, wrap_angle
from avlmaps.navigate.controller import CLOSE_M, ActionController, RouteProgress, bearing, turns_for

POSES = st.builds(GroundPose, st.floats(-3, 3), st.floats(-3, 3), st.floats(-pi, pi))
WAYS = st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=5)
STEPS = {Action.LEFT: (0.0, TURN_RAD), Action.RIGHT: (0.0, -TURN_RAD), Action.FORWARD: (FORWARD_M, 0.0)}


def anywhere(start, end):
    return True


def acted(pose, action):
    ahead_m, turn_rad = STEPS[action]
    return pose.ahead(ahead_m).turned(turn_rad)


def followed(controller, pose, most=4000):
    poses = [pose]
    for _ in range(most):
        action = controller.action(poses[-1])
        if action in (Action.STOP, None):
            return poses, action
        poses.append(acted(poses[-1], action))
    raise AssertionError("never ends")


def off_way_m(points, poses):
    samples = np.concatenate([np.linspace(a, b, 200) for a, b in pairwise(points)])
    xy = np.array([[pose.x_m, pose.y_m] for pose in poses])
    return np.linalg.norm(xy[:, None] - samples, axis=-1).min(axis=1).max()


@given(pose=POSES, way=WAYS)
def test_actions_end_at_the_end_of_any_way_from_anywhere(pose, way):
    points = np.array([(pose.x_m, pose.y_m), *way])
    poses, last = followed(ActionController(points, anywhere), pose)
    assert last is Action.STOP
    assert hypot(poses[-1].x_m - way[-1][0], poses[-1].y_m - way[-1][1]) <= CLOSE_M < 0.1


@given(pose=POSES, turn=st.floats(-pi, pi))
def test_a_turn_ends_within_half_a_step_of_the_heading(pose, turn):
    end = pose
    for action in turns_for(turn):
        end = acted(end, action)
    assert abs(wrap_angle(end.heading_rad - pose.heading_rad - turn)) <= TURN_RAD / 2 + 1e-9


@given(heading=st.floats(-pi, pi))
def test_actions_keep_to_a_way_with_corners(heading):
    points = np.array([(0, 0), (2, 0), (2, 1.5), (0.5, 1.5), (0.5, 3.0)], float)
    poses, _ = followed(ActionController(points, anywhere), GroundPose(0.0, 0.0, heading))
    assert off_way_m(points, poses) < 0.2
    ahead = sum(a.distance_m(b) for a, b in pairwise(poses))
    assert ahead < 1.05 * 6.5


@given(heading=st.floats(-pi, pi), width=st.floats(0.12, 0.4))
def test_no_step_is_taken_that_is_not_safe(heading, width):
    """A corridor with a corner: inside of it is safe, and the way through its middle is followed to its end."""
    points = np.array([(0, 0), (1.5, 0), (1.5, 1.5)], float)

    def within(x, y):
        return (-0.5 < x < 1.5 + width and abs(y) < width) or (abs(x - 1.5) < width and -width < y < 2.0)

    def safe(start, end):
        part = np.linspace(0, 1, 20)
        return all(within(start.x_m + p * (end.x_m - start.x_m), start.y_m + p * (end.y_m - start.y_m)) for p in part)

    poses, last = followed(ActionController(points, safe), GroundPose(0.0, 0.0, heading))
    assert all(within(pose.x_m, pose.y_m) for pose in poses) and last is Action.STOP


def test_without_a_safe_step_it_says_so():
    assert ActionController(np.array([(0.0, 0.0), (1.0, 0.0)]), lambda a, b: False).action(GroundPose(0, 0)) is None


def test_a_route_never_goes_back():
    route = RouteProgress(np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.1), (0.0, 0.1)]))
    assert route.length_m == pytest.approx(2.1)
    far = [route.advance(GroundPose(x, 0.05)) for x in (0.2, 0.6, 0.9, 0.6, 0.2)]
    assert far == sorted(far) and route.at(99.0) == route.end == (0.0, 0.1)
    assert bearing(GroundPose(0, 0), 0.0, 1.0) == pytest.approx(pi / 2)
