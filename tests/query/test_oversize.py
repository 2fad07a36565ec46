"""Instances longer than any thing of their name are cut where they fit least, and others stay as they are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.query import objects as oversize

VOXEL_M = 0.05


def cut(index: np.ndarray, score: np.ndarray, longest: float, instance: np.ndarray | None = None) -> np.ndarray:
    instance = np.zeros(len(index), np.int64) if instance is None else instance
    found, piece_of = oversize.cut_at_weak(index, index * VOXEL_M, score.astype(np.float32), instance, longest, 1)
    assert len(piece_of) == found.max(initial=-1) + 1
    assert (piece_of[found[found >= 0]] == instance[found >= 0]).all(), "each piece knows what it is of"
    return found


def row_of(*stretches: tuple[int, float], width: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Voxels along x, four wide: so many of each score, one stretch after the other."""
    along = np.concatenate([np.full(count, score) for count, score in stretches])
    index = np.stack(np.meshgrid(np.arange(len(along)), np.arange(width), [0], indexing="ij"), -1).reshape(-1, 3)
    return index, np.repeat(along, width)


def test_two_chairs_that_weak_voxels_link_are_two() -> None:
    index, score = row_of((10, 0.8), (4, 0.3), (10, 0.7))
    found = cut(index, score, longest=0.6)
    x = index[:, 0]
    assert set(found[x < 10]) != set(found[x >= 14])
    assert len(set(found[x < 10])) == len(set(found[x >= 14])) == 1
    assert found.max() == 1


def test_what_spilled_over_is_left_out() -> None:
    index, score = row_of((20, 0.8), (40, 0.3))
    found = cut(index, score, longest=1.1)
    x = index[:, 0]
    assert (found[x < 20] == 0).all()
    assert (found[x >= 23] == -1).all()


def test_what_is_long_and_alike_stays_whole() -> None:
    index, score = row_of((60, 0.6))
    assert (cut(index, score, longest=0.6) == 0).all()


def test_others_keep_to_themselves() -> None:
    index, score = row_of((10, 0.8), (4, 0.3), (10, 0.7), (10, 0.9))
    instance = np.where(index[:, 0] >= 24, 1, 0)
    found = cut(index, score, 0.6, instance)
    assert len(set(found[instance == 1])) == 1
    assert not set(found[instance == 1]) & set(found[instance == 0])
    assert set(found) == {0, 1, 2}


@given(seed=st.integers(0, 1000), count=st.integers(1, 300), longest=st.floats(0.1, 2.0))
def test_numbers_have_no_gaps_and_only_what_is_too_long_changes(seed: int, count: int, longest: float) -> None:
    rng = np.random.default_rng(seed)
    index = np.unique(rng.integers(0, 25, (count, 3)), axis=0)
    instance = np.unique(rng.integers(0, 4, len(index)), return_inverse=True)[1]
    found = cut(index, rng.random(len(index)), longest, instance)
    assert set(found[found >= 0]) == set(range(found.max(initial=-1) + 1))
    lengths = oversize.box_lengths_m(index * VOXEL_M, instance, int(instance.max()) + 1)
    for number, length in enumerate(lengths):
        pieces = set(found[instance == number])
        if length <= longest:
            assert len(pieces) == 1 and -1 not in pieces
        assert not (pieces - {-1}) & set(found[instance != number]), "no piece is of two instances"


def test_lengths_are_the_longer_sides_as_seen_from_above() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 3.0, 9.0], [5.0, 5.0, 0.0]])
    assert oversize.box_lengths_m(points, np.array([0, 0, 1]), 3).tolist() == [3.0, 0.0, 0.0]


@given(confidence=st.floats(0.01, 0.99), length=st.floats(0.0, 20.0), longest=st.floats(0.2, 5.0))
def test_too_long_is_less_likely_and_no_more_than_that(confidence: float, length: float, longest: float) -> None:
    (after,) = oversize.less_likely(np.array([confidence], np.float32), np.array([length]), longest)
    if length <= longest:
        assert after == pytest.approx(confidence, rel=1e-5)
    else:
        assert 0.0 <= after <= confidence * (1 + 1e-6)


def test_a_chair_of_four_metres_is_hardly_one() -> None:
    longest = 1.5 * oversize.longest_m(["chair"])
    before = np.array([0.66, 0.66], np.float32)
    fits, spilled = oversize.less_likely(before, np.array([0.9, 4.6]), longest)
    assert fits == pytest.approx(0.66)
    assert spilled < 0.3


def test_the_longest_is_the_diagonal_of_the_largest_of_all_names() -> None:
    assert oversize.longest_m(["chair"]) == pytest.approx(np.hypot(0.65, 0.65))
    assert oversize.longest_m(["chair", "dining table"]) == pytest.approx(np.hypot(3.2, 1.4))
    assert oversize.longest_m(["chair", "no thing of the lexicon"]) == np.inf
    assert oversize.longest_m([]) == np.inf
