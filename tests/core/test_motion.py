"""Laws of movements over a floor."""

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


@given(POSES)
def test_left_undoes_right_and_stop_does_nothing(pose):
    assert near(pose.after(Action.LEFT).after(Action.RIGHT), pose)
    assert pose.after(Action.STOP) == pose
    assert pose.after(Action.FORWARD).distance_m(pose) == pytest.approx(FORWARD_M)
