"""People, clothes, papers, shower curtains: what holds for every family, and that homes hold none of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.furniture import families, make
from avlmaps_sim.furniture.people import fabric, seated, thrown_over
from avlmaps_sim.homes import make_home

# Category: least and greatest largest extent, greatest height (metres), least number of families.
_RANGE = {
    "person": (0.5, 2.2, 2.0, 5),
    "clothing": (0.15, 1.5, 1.4, 6),
    "paper": (0.03, 1.6, 1.5, 6),
    "shower curtain": (1.0, 2.1, 2.1, 3),
}
_ALL = [(category, name) for category in _RANGE for name in families(category)]


@pytest.mark.few(5)
@pytest.mark.parametrize(("category", "name"), _ALL)
def test_a_piece_stands_centred_in_plausible_size_and_few_triangles(category: str, name: str) -> None:
    least, most, tallest, _ = _RANGE[category]
    for seed in range(6):
        piece = make(category, np.random.default_rng(seed), name=name)
        low, high = piece.mesh.low, piece.mesh.high
        assert np.isfinite(piece.mesh.vertex).all() and np.isfinite(piece.mesh.uv).all()
        np.testing.assert_allclose([low[2], *(low + high)[:2]], 0.0, atol=2e-3)
        assert least <= float(piece.mesh.size.max()) <= most
        assert float(piece.mesh.size[2]) <= tallest
        assert 4 <= len(piece.mesh.triangle) <= 3500


@pytest.mark.parametrize("category", _RANGE)
def test_families_differ_and_some_are_held_out(category: str) -> None:
    assert len(families(category)) >= _RANGE[category][3]
    assert 1 <= len(families(category, "held-out")) <= 2
    assert set(families(category, "training")).isdisjoint(families(category, "held-out"))
    assert lexicon().find(category, EntryKind.THING) is not None


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


def test_homes_hold_none_of_them() -> None:
    """The homes of a seed are those of the benchmarks; training worlds add people afterwards."""
    assert not set(_RANGE) & {thing.category for thing in make_home(7).objects}
