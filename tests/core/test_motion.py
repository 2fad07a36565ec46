"""Laws of movements over a floor."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.motion import FORWARD_M, Action, GroundPose

NUMBER = st.floats(-3.0, 3.0, allow_nan=False)
POSES = st.builds(GroundPose, NUMBER, NUMBER, NUMBER)


def near(one: GroundPose, other: GroundPose) -> bool:
    """Return whether two poses agree to a billionth."""
    turn = np.angle(np.exp(1j * (one.heading_rad - other.heading_rad)))
    return one.distance_m(other) < 1e-9 and abs(turn) < 1e-9


@given(POSES, NUMBER, NUMBER, st.floats(0.0, 5.0), st.floats(0.0, 1.0))
def test_an_arc_driven_in_two_parts_ends_as_driven_at_once(pose, speed_m_s, turn_rad_s, duration_s, share):
    first = pose.driven(speed_m_s, turn_rad_s, share * duration_s)
    assert near(
        first.driven(speed_m_s, turn_rad_s, (1.0 - share) * duration_s), pose.driven(speed_m_s, turn_rad_s, duration_s)
    )


@given(POSES, NUMBER, st.floats(0.0, 5.0))
def test_without_a_turn_it_is_a_straight_line(pose, speed_m_s, duration_s):
    assert near(pose.driven(speed_m_s, 0.0, duration_s), pose.ahead(speed_m_s * duration_s))


def test_a_half_circle_ends_one_diameter_to_the_left():
    radius_m = 1.5
    ended = GroundPose(0.0, 0.0).driven(radius_m, 1.0, pi)
    assert (ended.x_m, ended.y_m) == pytest.approx((0.0, 2.0 * radius_m))
    assert abs(ended.heading_rad) == pytest.approx(pi)


@given(POSES)
def test_left_undoes_right_and_stop_does_nothing(pose):
    assert near(pose.after(Action.LEFT).after(Action.RIGHT), pose)
    assert pose.after(Action.STOP) == pose
    assert pose.after(Action.FORWARD).distance_m(pose) == pytest.approx(FORWARD_M)
