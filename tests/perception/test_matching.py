import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.perception.embedded.keypoints import RATIO, match_mutual


def unit_rows(seed: int, count: int, dim: int = 8) -> np.ndarray:
    rows = np.random.default_rng(seed).normal(size=(count, dim))
    return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


def by_hand(a: np.ndarray, b: np.ndarray, ratio: float) -> set[tuple[int, int]]:
    distance = np.linalg.norm(a[:, None].astype(np.float64) - b[None], axis=2)
    pairs = set()
    for i, row in enumerate(distance):
        j = int(row.argmin())
        second = np.partition(row, 1)[1] if len(row) > 1 else np.inf
        if distance[:, j].argmin() == i and row[j] < ratio * second:
            pairs.add((i, j))
    return pairs


@given(st.integers(0, 10_000), st.integers(1, 40), st.integers(1, 40), st.sampled_from([0.7, RATIO, 0.95]))
def test_it_agrees_with_the_definition(seed: int, n: int, m: int, ratio: float) -> None:
    a, b = unit_rows(seed, n), unit_rows(seed + 1, m)
    found = {(int(i), int(j)) for i, j in match_mutual(a, b, ratio)}
    # float32 may decide a tie otherwise
    assert by_hand(a, b, ratio - 1e-4) <= found <= by_hand(a, b, ratio + 1e-4)


@given(st.integers(0, 10_000), st.integers(2, 60))
def test_a_shuffled_copy_is_matched_point_by_point(seed: int, n: int) -> None:
    a = unit_rows(seed, n, dim=64)
    order = np.random.default_rng(seed).permutation(n)
    pairs = match_mutual(a, a[order])
    assert len(pairs) == n
    np.testing.assert_array_equal(order[pairs[:, 1]], pairs[:, 0])


@given(st.integers(0, 100), st.integers(1, 6), st.integers(1, 6))
def test_each_index_is_used_once_even_where_descriptors_repeat(seed: int, n: int, m: int) -> None:
    few = unit_rows(seed, 3)
    rng = np.random.default_rng(seed)
    pairs = match_mutual(few[rng.integers(0, 3, n)], few[rng.integers(0, 3, m)], ratio=1.5)
    assert len(np.unique(pairs[:, 0])) == len(np.unique(pairs[:, 1])) == len(pairs)


def test_a_point_with_two_look_alikes_is_left_out() -> None:
    a = unit_rows(0, 1)
    b = np.concatenate([a, a, unit_rows(1, 3)])
    assert match_mutual(a, b).shape == (0, 2)


@given(st.integers(0, 10_000), st.integers(1, 20))
def test_look_alikes_that_differ_by_rounding_are_left_out_too(seed: int, n: int) -> None:
    """Which of them is nearer is chance: it depends on the order in which a processor adds."""
    a = unit_rows(seed, n, dim=64)
    again = np.nextafter(a, np.random.default_rng(seed).choice([-2.0, 2.0], a.shape).astype(np.float32))
    assert match_mutual(a, np.concatenate([a, again, unit_rows(seed + 1, 3, dim=64)])).shape == (0, 2)


def test_without_points_there_are_no_pairs() -> None:
    none, some = np.zeros((0, 8), np.float32), unit_rows(0, 3)
    assert match_mutual(none, some).shape == match_mutual(some, none).shape == match_mutual(none, none).shape == (0, 2)


def test_halved_descriptors_of_a_map_are_taken_as_they_are() -> None:
    a = unit_rows(0, 20, dim=64)
    assert len(match_mutual(a, a.astype(np.float16))) == 20
