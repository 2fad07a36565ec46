"""People, clothes, papers, shower curtains: the lexicon names them, and homes hold none of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.furniture.people import fabric, seated, thrown_over
from avlmaps_sim.homes import make_home

CATEGORIES = ("person", "clothing", "paper", "shower curtain")


@given(st.integers(0, 2**31), st.floats(0.3, 0.7))
def test_who_sits_touches_the_seat_and_not_the_ground_below_the_floor(seed: int, seat_m: float) -> None:
    mesh = seated(np.random.default_rng(seed), seat_m)
    assert float(mesh.low[2]) > -0.2  # feet reach the floor or hang over it, but for the longest legs on low seats
    under = mesh.vertex[(np.abs(mesh.vertex[:, 0]) < 0.05) & (np.abs(mesh.vertex[:, 1]) < 0.15)]
    assert float(under[:, 2].min()) == pytest.approx(seat_m, abs=0.08)


@given(st.integers(0, 2**31), st.floats(0.3, 0.7), st.floats(0.01, 0.2))
def test_what_is_thrown_over_an_edge_hangs_down_on_both_sides_and_clear_of_it(
    seed: int, wide: float, thick: float
) -> None:
    rng = np.random.default_rng(seed)
    mesh = thrown_over(rng, wide, 0.4, 0.3, thick, fabric(rng))
    assert 0.0 < float(mesh.high[2]) < 0.05
    assert float(mesh.low[2]) < -0.2
    low = mesh.vertex[mesh.vertex[:, 2] < -0.03]
    assert (np.abs(low[:, 0]) >= thick / 2).all()
    assert low[:, 0].min() < 0.0 < low[:, 0].max()


def test_the_lexicon_names_them_and_homes_hold_none_of_them() -> None:
    """The homes of a seed are those of the benchmarks; training worlds add people afterwards."""
    assert all(lexicon().find(category, EntryKind.THING) is not None for category in CATEGORIES)
    assert not set(CATEGORIES) & {thing.category for thing in make_home(7).objects}
