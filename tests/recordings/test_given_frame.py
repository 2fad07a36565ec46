"""What a program gives as a frame."""

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.memory import given_frame

CAMERA = Pinhole(30.0, 30.0, 16.0, 12.0, 32, 24)


@pytest.mark.parametrize(("stamp", "unit"), [(1.7e12, "milliseconds"), (1.7e18, "nanoseconds")])
def test_a_date_in_another_unit_is_refused(stamp: float, unit: str) -> None:
    rgb, depth_m = np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), np.float32)
    assert given_frame(0, rgb, depth_m, CAMERA, np.eye(4), 1.7e9).stamp_s == 1.7e9
    with pytest.raises(RecordingError, match=unit):
        given_frame(0, rgb, depth_m, CAMERA, np.eye(4), stamp)


@pytest.mark.parametrize("stamp", [True, np.True_, "1.0", np.array([1.0]), np.ma.masked, np.nan])
def test_a_stamp_that_is_no_number_is_refused(stamp: object) -> None:
    rgb, depth_m = np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), np.float32)
    assert given_frame(0, rgb, depth_m, CAMERA, np.eye(4), np.array(1.5)).stamp_s == 1.5
    with pytest.raises(RecordingError, match="stamp_s of frame 0 must be a finite number of seconds"):
        given_frame(0, rgb, depth_m, CAMERA, np.eye(4), stamp)
