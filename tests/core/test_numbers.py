"""Numbers that programs give: scalars of any library are numbers, and nothing else is."""

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AvlmapsError, MapError
from avlmaps.core.numbers import as_number, as_whole
from avlmaps.live.status import LiveSettings
from avlmaps.maps.fusion.sensor import FusionSettings
from avlmaps.maps.settings import BuildSettings, FrameSettings, HearingSettings, SegmentationSettings
from avlmaps.query.settings import QuerySettings
from avlmaps.recordings.audio import require_rate
from avlmaps.recordings.channels import ChannelSound


class Tensor:
    """A tensor without axes, as of torch."""

    ndim, shape = 0, ()

    def __repr__(self) -> str:
        return "Tensor"  # the name of a test: every worker must find the same one

    def __init__(self, value: float) -> None:
        self._value = value

    def item(self) -> float:
        """Return what it holds."""
        return self._value


TWOS = [2, 2.0, np.float32(2), np.int64(2), np.array(2.0), np.array(2), Tensor(2.0), Fraction(2)]
NONES = [
    True,
    np.True_,
    np.array(True),
    "2",
    b"2",
    None,
    2j,
    [2.0],
    np.array([2.0]),
    np.ma.masked,
    np.datetime64(2, "s"),
]


@pytest.mark.parametrize("given", TWOS, ids=repr)
def test_every_scalar_is_a_number_of_python(given: Any):
    assert (as_number(given), as_whole(given)) == (2.0, 2)
    assert (type(as_number(given)), type(as_whole(given))) == (float, int)


@pytest.mark.parametrize("given", NONES, ids=repr)
def test_nothing_else_is_a_number(given: Any):
    assert as_number(given) is None
    assert as_whole(given) is None


def test_what_is_no_whole_number_is_none_as_well():
    assert [as_whole(given) for given in (0.5, np.nan, np.inf, 10**400)] == [None, None, None, None]
    assert as_whole(2**60 + 1) == 2**60 + 1


@pytest.mark.parametrize("given", TWOS, ids=repr)
def test_a_camera_holds_numbers_of_python(given: Any):
    camera = Pinhole(given, given, given, given, given, given)
    assert camera == Pinhole(2.0, 2.0, 2.0, 2.0, 2, 2)
    assert [type(value) for value in (camera.fx, camera.cy, camera.width)] == [float, float, int]


@pytest.mark.parametrize("given", [*NONES, np.nan, np.inf, -2.0], ids=repr)
@pytest.mark.parametrize("place", [0, 5])
def test_a_camera_refuses_what_is_no_number(given: Any, place: int):
    numbers = [2.0, 2.0, 1.0, 1.0, 2, 2]
    with pytest.raises(ValueError, match="a camera needs"):
        Pinhole(*numbers[:place], given, *numbers[place + 1 :])


@pytest.mark.parametrize("given", TWOS, ids=repr)
def test_settings_and_sounds_hold_numbers_of_python(given: Any):
    assert BuildSettings(voxel_size_m=given, frames=FrameSettings(step=given)) == BuildSettings(2.0, FrameSettings(2))
    assert type(BuildSettings(voxel_size_m=given).voxel_size_m) is float
    assert type(LiveSettings(snapshot_s=given, known_views=given).known_views) is int
    assert type(require_rate(given)) is int


@dataclass(frozen=True)
class _Settings:
    """Not those of a map."""


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda given: BuildSettings(voxel_size_m=given), "voxel_size_m of BuildSettings must be a number"),
        (lambda given: BuildSettings(frames=given), "frames of BuildSettings must be of FrameSettings"),
        (lambda given: FrameSettings(per_part=given), "per_part of FrameSettings must be a whole number"),
        (lambda given: FusionSettings(max_depth_m=given), "max_depth_m of FusionSettings"),
        (lambda given: HearingSettings(quiet_s=given), "quiet_s of HearingSettings"),
        (lambda given: SegmentationSettings(onset_db=given), "onset_db of SegmentationSettings"),
        (lambda given: LiveSettings(save_s=given), "save_s of LiveSettings"),
        (lambda given: LiveSettings(gates=given), "gates of LiveSettings must be True or False"),
        (lambda given: QuerySettings(found_at=given), "found_at of QuerySettings"),
    ],
)
def test_settings_refuse_what_is_no_number(make: Any, named: str):
    for given in ("0.05", [1.0], _Settings()):
        with pytest.raises(AvlmapsError, match=named):
            make(given)


def test_a_truth_of_numpy_is_one_of_python():
    for given in (np.True_, np.False_):
        assert LiveSettings(gates=given).gates is bool(given)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("given", [True, "16000", 0, 0.5, None])
def test_a_rate_is_a_positive_whole_number(given: Any):
    with pytest.raises(ValueError, match=re.escape(f"rate_hz is {given!r}")):
        require_rate(given)
    with pytest.raises(ValueError, match="rate_hz is 0"):
        ChannelSound(np.zeros((1, 2), np.float32), 0)


def test_true_is_no_size_of_a_voxel():
    with pytest.raises(MapError, match="voxel_size_m of BuildSettings must be a number, not True"):
        BuildSettings(voxel_size_m=True)
