"""Pieces of one thing are one goal: a chair's legs and its back, however little was seen between."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.query.objects import joined_pieces

LINK_M, JOIN_M = 0.1, 0.3


def pieces(*boxes: tuple[tuple[float, float, float], tuple[float, float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return each box's two corners as its voxels."""
    points = np.array([corner for box in boxes for corner in box], np.float64).reshape(-1, 3)
    return points, np.repeat(np.arange(len(boxes)), 2)


def brute_force(points: np.ndarray, instance: np.ndarray) -> np.ndarray:
    low = np.array([points[instance == i].min(axis=0) for i in range(instance.max() + 1)])
    high = np.array([points[instance == i].max(axis=0) for i in range(instance.max() + 1)])
    low[:, :2] -= LINK_M / 2
    high[:, :2] += LINK_M / 2
    label = np.arange(len(low))
    for i in range(len(low)):
        for j in range(len(low)):
            shared = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
            over = max(shared[0], 0) * max(shared[1], 0)
            least = min(np.prod((high - low)[i, :2]), np.prod((high - low)[j, :2]))
            if over > 0.5 * least and shared[2] >= -JOIN_M:
                label[label == label[j]] = label[i]
    return label


def test_legs_under_a_seat_are_its_pieces() -> None:
    legs, seat = ((0.0, 0.0, 0.0), (0.4, 0.4, 0.2)), ((0.0, 0.0, 0.45), (0.4, 0.4, 0.9))
    assert len(set(joined_pieces(*pieces(legs, seat), LINK_M, JOIN_M))) == 1


def test_two_things_side_by_side_stay_two() -> None:
    left, right = ((0.0, 0.0, 0.0), (0.4, 0.4, 0.5)), ((0.6, 0.0, 0.0), (1.0, 0.4, 0.5))
    assert len(set(joined_pieces(*pieces(left, right), LINK_M, JOIN_M))) == 2


def test_a_cabinet_hung_high_over_another_stays_another() -> None:
    low, high = ((0.0, 0.0, 0.0), (1.0, 0.4, 0.9)), ((0.0, 0.0, 1.4), (1.0, 0.4, 2.0))
    assert len(set(joined_pieces(*pieces(low, high), LINK_M, JOIN_M))) == 2


def test_nothing_has_no_pieces() -> None:
    assert joined_pieces(np.zeros((0, 3)), np.zeros(0, np.int64), LINK_M, JOIN_M).shape == (0,)


corner = st.tuples(*[st.floats(0, 3)] * 3)


@given(st.lists(st.tuples(corner, corner), min_size=1, max_size=12))
def test_the_sweep_agrees_with_comparing_all_with_all(boxes: list) -> None:
    points, instance = pieces(*boxes)
    swept, brute = joined_pieces(points, instance, LINK_M, JOIN_M), brute_force(points, instance)
    assert ((swept[:, None] == swept) == (brute[:, None] == brute)).all()
