"""A pose graph: right edges give the right poses, a rigid motion moves the answer, a wrong closure hardly counts."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.poses import inverse
from avlmaps.days.loops import Edges, motions, optimise

COUNT = 24


def ring(rng: np.random.Generator) -> np.ndarray:
    """Return poses on a circle of 3 m, each a little tipped."""
    angle = np.linspace(0.0, 2.0 * np.pi, COUNT, endpoint=False)
    steps = np.zeros((COUNT, 6))
    steps[:, 3:] = rng.normal(scale=0.1, size=(COUNT, 3))
    steps[:, 5] += angle
    out = motions(steps)
    out[:, :3, 3] = 3.0 * np.stack([np.cos(angle), np.sin(angle), 0.1 * angle], axis=1)
    return out


def edges(true: np.ndarray, pairs: list[tuple[int, int]], closures: int) -> Edges:
    first, second = np.array(pairs).T
    count = len(pairs)
    return Edges(
        first, second, inverse(true[first]) @ true[second], np.full(count, 0.02), np.full(count, 0.02),
        np.arange(count) >= count - closures,
    )  # fmt: skip


def strayed(true: np.ndarray, rng: np.random.Generator, scale: float = 0.02) -> np.ndarray:
    out = [true[0]]
    for row in range(1, len(true)):
        step = inverse(true[row - 1]) @ true[row]
        out.append(out[-1] @ step @ motions(rng.normal(scale=scale, size=(1, 6)))[0])
    return np.stack(out)


CHAIN = [(row, row + 1) for row in range(COUNT - 1)]


@given(st.integers(0, 10_000))
def test_right_edges_give_the_right_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = ring(rng)
    found = optimise(strayed(true, rng), edges(true, [*CHAIN, (0, COUNT - 1)], 1))
    np.testing.assert_allclose(found, true, atol=1e-5)


def test_where_all_fits_nothing_moves() -> None:
    true = ring(np.random.default_rng(0))
    np.testing.assert_allclose(optimise(true, edges(true, [*CHAIN, (0, COUNT - 1)], 1)), true, atol=1e-9)


def test_a_rigid_motion_of_all_moves_the_answer_with_it() -> None:
    rng = np.random.default_rng(1)
    true = ring(rng)
    start = strayed(true, rng)
    measured = edges(strayed(true, rng), [*CHAIN, (0, COUNT - 1), (3, 20)], 2)
    whole = motions(rng.normal(size=(1, 6)))[0]
    np.testing.assert_allclose(optimise(whole @ start, measured), whole @ optimise(start, measured), atol=1e-6)


def test_a_closure_brings_the_ends_together_and_bends_the_drive_evenly() -> None:
    rng = np.random.default_rng(2)
    true = ring(rng)
    start = strayed(true, rng, 0.03)
    chain = edges(start, CHAIN, 0)
    closure = edges(true, [(0, COUNT - 1)], 1)
    both = Edges(
        *(np.concatenate([getattr(of, name) for of in (chain, closure)]) for name in Edges.__dataclass_fields__)
    )
    found = optimise(start, both)
    before, after = (np.linalg.norm(of[:, :3, 3] - true[:, :3, 3], axis=1) for of in (start, found))
    assert np.linalg.norm(closure.errors(found)[0, :3]) < 0.2 * np.linalg.norm(closure.errors(start)[0, :3])
    assert after[-1] < 0.3 * before[-1]


def test_one_wrong_closure_among_right_ones_hardly_counts() -> None:
    rng = np.random.default_rng(3)
    true = ring(rng)
    start = strayed(true, rng, 0.01)
    right = edges(true, [*CHAIN, (0, 23), (1, 22), (2, 21), (4, 18)], 4)
    wrong = right.measured.copy()
    wrong[-1, :3, 3] += 2.0
    found = optimise(start, Edges(right.first, right.second, wrong, right.sigma_m, right.sigma_rad, right.is_closure))
    np.testing.assert_allclose(found[:, :3, 3], true[:, :3, 3], atol=0.05)
