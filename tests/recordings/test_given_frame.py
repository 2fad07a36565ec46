"""What a program gives as a frame."""

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.memory import given_frame

CAMERA = Pinhole(30.0, 30.0, 16.0, 12.0, 32, 24)


NO_NUMBERS = (True, np.True_, "1.0", np.array([1.0]), np.ma.masked, np.nan)
NO_NUMBER = "stamp_s of frame 0 must be a finite number of seconds"


@pytest.mark.parametrize(
    ("stamp", "said"), [(1.7e12, "milliseconds"), (1.7e18, "nanoseconds"), *((one, NO_NUMBER) for one in NO_NUMBERS)]
)
def test_a_stamp_in_another_unit_or_that_is_no_number_is_refused(stamp: object, said: str) -> None:
    rgb, depth_m = np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), np.float32)
    for right in (1.7e9, np.array(1.5)):
        assert given_frame(0, rgb, depth_m, CAMERA, np.eye(4), right).stamp_s == right
    with pytest.raises(RecordingError, match=said):
        given_frame(0, rgb, depth_m, CAMERA, np.eye(4), stamp)
