"""Where another map lies: votes that agree win, however many others there are; too few are refused with the numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_surfaces import turned

from avlmaps.core.poses import inverse
from avlmaps.days.find import (
    LEAST_SHARE,
    NotTheSamePlaceError,
    Votes,
    consensus,
    mean_transform,
    require_upright,
    spread_out,
    supporters,
)

NAMES = ("a.avlmap", "b.avlmap")
TRUE = turned(1.1, (3.0, -2.0, 0.1))


def cameras(count: int, spacing_m: float = 0.8) -> np.ndarray:
    return np.stack([turned(0.3 * k, (spacing_m * k, 0.1 * k, 1.2)) for k in range(count)])


def votes(right: int, wrong: int, rng: np.random.Generator, spacing_m: float = 0.8) -> Votes:
    camera = cameras(right + wrong, spacing_m)
    made = [TRUE @ turned(rng.normal(0, 0.005), tuple(rng.normal(0, 0.01, 3))) for _ in range(right)]
    made += [turned(rng.uniform(-3, 3), tuple(rng.uniform(-9, 9, 3))) for _ in range(wrong)]
    return Votes(np.stack(made), camera, right + wrong + 5)


@given(st.integers(6, 20), st.integers(0, 8), st.integers(0, 1000))
def test_the_agreeing_votes_win_and_give_the_transform(right: int, wrong: int, seed: int) -> None:
    given_votes = votes(right, wrong, np.random.default_rng(seed))
    agree = supporters(given_votes.map_from_other, given_votes.camera)
    assert agree[:right].sum() >= 0.8 * right and agree[right:].sum() == 0
    if agree.sum() >= LEAST_SHARE * len(given_votes):
        found, checks = consensus(given_votes, NAMES)
        assert np.abs(found - TRUE).max() < 0.15 and checks["agreeing"] == agree.sum()


@pytest.mark.parametrize(("right", "wrong"), [(0, 0), (4, 0), (5, 30), (0, 12)])
def test_too_few_that_agree_are_refused_with_the_numbers(right: int, wrong: int) -> None:
    rng = np.random.default_rng(3)
    none = Votes(np.zeros((0, 4, 4)), np.zeros((0, 4, 4)), 60)
    with pytest.raises(NotTheSamePlaceError, match=r"of \d+ keyframes of b\.avlmap \d+ were located in a\.avlmap"):
        consensus(votes(right, wrong, rng) if right + wrong else none, NAMES)


def test_one_thing_seen_from_one_corner_is_no_proof() -> None:
    """Ten keyframes agree, all within a metre: a sofa that stands in two homes does that."""
    with pytest.raises(NotTheSamePlaceError, match="single thing"):
        consensus(votes(10, 0, np.random.default_rng(1), spacing_m=0.1), NAMES)


def test_the_mean_of_equal_transforms_is_that_transform() -> None:
    found = mean_transform(np.stack([TRUE] * 4), cameras(4))
    assert np.allclose(found, TRUE) and np.allclose(found @ inverse(found), np.eye(4))


def test_a_map_is_not_tipped_over() -> None:
    up = np.array([0.0, 0.0, 1.0])
    require_upright(TRUE, up, up)
    with pytest.raises(NotTheSamePlaceError, match=r"90\.0 degrees"):
        require_upright(TRUE, up, np.array([1.0, 0.0, 0.0]))


@given(st.integers(1, 500), st.integers(1, 80))
def test_the_first_few_are_spread_over_all(count: int, most: int) -> None:
    rows = spread_out(count, most)
    assert len(rows) == len(set(rows.tolist())) == min(count, most)
    assert rows.min() >= 0 and rows.max() < count
    if len(rows) >= 30:
        assert np.ptp(rows[:8]) > 0.5 * count
