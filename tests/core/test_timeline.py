"""One time line for streams of different rates: pairing, interpolation, gaps and clocks that jump."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.core import poses
from avlmaps.core.timeline import Trajectory, associate, gap_notices, in_order


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    count = draw(st.integers(2, 8))
    steps = draw(arrays(float, count, elements=st.floats(0.01, 0.2)))
    quaternions = draw(arrays(float, (count, 4), elements=st.floats(-1, 1)))
    quaternions[np.linalg.norm(quaternions, axis=1) < 0.1] = (0.0, 0.0, 0.0, 1.0)
    places = draw(arrays(float, (count, 3), elements=st.floats(-50, 50)))
    return Trajectory(np.cumsum(steps), poses.from_quaternion(places, quaternions))


@given(trajectories())
def test_a_trajectory_passes_exactly_through_its_poses(trajectory: Trajectory):
    assert np.array_equal(trajectory.at(trajectory.stamps_s), trajectory.world_from_body)
    assert trajectory.covers(trajectory.stamps_s).all()


@given(trajectories(), st.floats(0.0, 1.0))
def test_between_two_poses_rotation_and_position_go_evenly_and_rigidly(trajectory: Trajectory, share: float):
    a, b = trajectory.world_from_body[0], trajectory.world_from_body[1]
    t0, t1 = trajectory.stamps_s[:2]
    middle = trajectory.at(np.array([t0 + share * (t1 - t0)]))[0]
    assert np.allclose(middle[:3, :3] @ middle[:3, :3].T, np.eye(3), atol=1e-9)
    assert np.allclose(middle[:3, 3], (1 - share) * a[:3, 3] + share * b[:3, 3], atol=1e-6)
    whole = float(poses.rotation_angle_rad(a, b))
    if whole < 3.1:  # half a turn has two shortest arcs
        assert float(poses.rotation_angle_rad(a, middle)) == pytest.approx(share * whole, abs=2e-5)


def test_slerp_of_a_quarter_turn_is_an_eighth_in_the_middle():
    half = np.sqrt(0.5)
    trajectory = Trajectory(
        np.array([0.0, 1.0]),
        poses.from_quaternion(np.zeros((2, 3)), np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -half, -half]])),
    )
    middle = trajectory.at(np.array([0.5]))[0]
    assert np.allclose(middle[:2, :2], [[half, -half], [half, half]])


def test_past_its_ends_a_trajectory_is_held_a_little_and_then_refused():
    trajectory = Trajectory(np.array([1.0, 1.1]), np.stack([np.eye(4), np.eye(4)]))
    assert np.array_equal(trajectory.at(np.array([0.97, 1.13])), np.stack([np.eye(4), np.eye(4)]))
    with pytest.raises(ValueError, match=r"0\.2 s outside the trajectory; at most 0.04 s passes"):
        trajectory.at(np.array([1.3]))
    assert trajectory.covers(np.array([0.9, 1.05, 1.3])).tolist() == [False, True, False]


def test_a_long_gap_between_poses_is_not_bridged_but_its_ends_are_known():
    stamps = np.array([0.0, 0.1, 0.2, 5.2, 5.3])
    trajectory = Trajectory(stamps, np.tile(np.eye(4), (5, 1, 1)))
    asked = np.array([0.05, 0.2, 2.0, 5.2, 5.25])
    assert trajectory.covers(asked).tolist() == [True, True, False, True, True]


def test_a_trajectory_of_one_pose_knows_that_pose_only():
    one = Trajectory(np.array([2.0]), np.eye(4)[None])
    assert one.covers(np.array([1.0, 2.0])).tolist() == [False, True]
    assert np.array_equal(one.at(np.array([2.01])), np.eye(4)[None])


@pytest.mark.parametrize("stamps", [[], [1.0, 1.0], [2.0, 1.0]])
def test_a_trajectory_needs_stamps_that_rise(stamps: list[float]):
    with pytest.raises(ValueError, match="stamps"):
        Trajectory(np.array(stamps), np.tile(np.eye(4), (len(stamps), 1, 1)))


rising = st.lists(st.floats(0, 20), max_size=30).map(lambda stamps: np.unique(np.array(stamps, float)))


@given(rising, rising, st.floats(0.0, 1.0))
def test_pairs_are_close_and_in_order_and_use_no_sample_twice(a: np.ndarray, b: np.ndarray, tolerance_s: float):
    of_a, of_b = associate(a, b, tolerance_s)
    assert np.all(np.diff(of_a) > 0) and np.all(np.diff(of_b) > 0)
    assert np.all(np.abs(a[of_a] - b[of_b]) <= tolerance_s)
    for i, j in zip(of_a, of_b, strict=True):
        assert np.abs(a[i] - b).min() == np.abs(a[i] - b[j])
        assert np.abs(a - b[j]).min() == np.abs(a[i] - b[j])


@given(rising)
def test_a_stream_pairs_wholly_with_itself(a: np.ndarray):
    of_a, of_b = associate(a, a, 0.0)
    assert np.array_equal(of_a, np.arange(len(a))) and np.array_equal(of_a, of_b)


@given(st.lists(st.one_of(st.floats(-1e9, 1e9), st.just(float("nan"))), max_size=40))
def test_whatever_the_clock_did_the_stamps_rise_strictly_afterwards(stamps: list[float]):
    order = in_order(np.array(stamps, float), "frames")
    assert np.all(np.diff(np.array(stamps, float)[order.index]) > 0.0)
    assert len(order.index) == len(stamps) or order.notices


@pytest.mark.parametrize(
    ("stamps", "index", "notices"),
    [
        ([0.0, 0.1, 0.2], [0, 1, 2], ()),
        ([0.0, 0.2, 0.1, 0.3], [0, 2, 1, 3], ("The stamps of the poses run backwards 1 time(s); they were sorted.",)),
        ([0.0, 0.1, 0.1, 0.2], [0, 1, 3], ("1 poses repeat the stamp of the one before and are left out.",)),
        ([100.0, 100.1, 5.0, 5.1, 5.2, 5.3], [2, 3, 4, 5], (
            "The clock of the poses jumps back 1 time(s), by up to 95.1 s; the longest stretch, 4 of 6, is used.",
        )),
    ],
)  # fmt: skip
def test_a_clock_is_sorted_cut_or_left_alone(stamps: list[float], index: list[int], notices: tuple[str, ...]):
    order = in_order(np.array(stamps), "poses")
    assert (order.index.tolist(), order.notices) == (index, notices)


def test_gaps_are_told_with_their_place_and_length():
    stamps = np.concatenate([np.arange(0, 2, 0.1), np.arange(6, 8, 0.1)])
    assert gap_notices(stamps, "frames") == ("There are no frames for 4.1 s after 1.90 s.",)
    two_days = np.concatenate([np.arange(0, 2, 0.1), np.arange(0, 2, 0.1) + 172_800.0])
    told = gap_notices(two_days, "frames")
    assert told[0] == "There are no frames for 172798 s after 1.90 s." and "several drives" in told[1]
    assert gap_notices(np.arange(0, 100, 1.5), "frames") == ()
    assert gap_notices(np.array([0.0, 50.0]), "frames") == ()
