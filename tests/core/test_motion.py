"""Laws of movements over a floor."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.motion import FORWARD_M, Action, GroundPose

NUMBER = st.floats(-3.0, 3.0, allow_nan=False)
POSES = st.builds(GroundPose, NUMBER, NUMBER, NUMBER)


@given(POSES)
def test_left_undoes_right_and_stop_does_nothing(pose):
    back = pose.after(Action.LEFT).after(Action.RIGHT)
    assert back.distance_m(pose) < 1e-9 and abs(np.angle(np.exp(1j * (back.heading_rad - pose.heading_rad)))) < 1e-9
    assert pose.after(Action.STOP) == pose
    assert pose.after(Action.FORWARD).distance_m(pose) == pytest.approx(FORWARD_M)
