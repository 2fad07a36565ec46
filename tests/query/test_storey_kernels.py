"""The compiled loops of storeys give what plain NumPy gives."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.query.storey_grid import contacts, flooded
from avlmaps.query.storey_kernels import SIDE, fill_cells, held_share, mark_columns, turned_ends

SEEDS = st.integers(0, 2**32 - 1)


def flooded_by_rings(label: np.ndarray, over: np.ndarray) -> np.ndarray:
    out = label.copy()
    while True:
        beside = np.pad(out, 1)
        highest = np.max([beside[:-2, 1:-1], beside[2:, 1:-1], beside[1:-1, :-2], beside[1:-1, 2:]], axis=0)
        ring = over & (out == 0) & (highest > 0)
        if not ring.any():
            return out
        out[ring] = highest[ring]


@given(st.integers(1, 9), st.integers(1, 9), SEEDS)
def test_labels_grow_ring_by_ring_and_the_higher_wins(rows: int, columns: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    label = rng.integers(0, 4, (rows, columns)) * (rng.random((rows, columns)) < 0.2)
    over = rng.random((rows, columns)) < 0.8
    np.testing.assert_array_equal(flooded(label, over), flooded_by_rings(label, over))


@given(st.integers(1, 9), st.integers(1, 9), SEEDS)
def test_contacts_are_counted_side_by_side(rows: int, columns: int, seed: int) -> None:
    label = np.random.default_rng(seed).integers(0, 4, (rows, columns))
    expected: dict[tuple[int, int], int] = {}
    for (i, j), own in np.ndenumerate(label):
        for other in (*label[i + 1 : i + 2, j], *label[i, j + 1 : j + 2]):
            if own != other and own > 0 and other > 0:
                pair = (int(min(own, other)), int(max(own, other)))
                expected[pair] = expected.get(pair, 0) + 1
    assert contacts(label) == expected


@given(st.integers(1, 60), st.floats(0.0, 1.5), SEEDS)
def test_cells_hold_what_lies_in_them(count: int, angle: float, seed: int) -> None:
    level = np.random.default_rng(seed).uniform((-3.0, -2.0, -0.5), (3.0, 2.0, 2.5), (count, 3))
    cos, sin, cell_m, voxel_m = float(np.cos(angle)), float(np.sin(angle)), 0.25, 0.1
    turned = level[:, :2] @ np.array([[cos, -sin], [sin, cos]])
    ends = np.array(turned_ends(level, cos, sin))
    np.testing.assert_allclose(ends, [*turned.min(axis=0), *turned.max(axis=0)], atol=1e-12)
    low, high = np.floor(ends.reshape(2, 2) / cell_m + SIDE).astype(np.int64)
    held, below = np.zeros((*(high - low + 1), 10), bool), np.zeros(high - low + 1, bool)
    fill_cells(level, cos, sin, 0.1, np.array([1.0, 2.0]), 1.0, voxel_m, cell_m, low, held, below)
    x, y = (np.floor(turned / cell_m + SIDE).astype(np.int64) - low).T
    height = level[:, 2] - 0.1
    tall = (height >= 1.0) & (height < 2.0)
    expected, lower, columns = np.zeros_like(held), np.zeros_like(below), np.zeros_like(below)
    expected[x[tall], y[tall], np.minimum(((height[tall] - 1.0) / voxel_m).astype(int), 9)] = True
    lower[x[height < 1.0], y[height < 1.0]] = True
    np.testing.assert_array_equal(held, expected)
    np.testing.assert_array_equal(below, lower)
    share = np.empty(below.shape)
    held_share(held, 0, len(held), share)
    np.testing.assert_allclose(share, held.mean(axis=2))
    if angle == 0.0:
        mark_columns(level, 1.1, 2.1, cell_m, low, columns)
        np.testing.assert_array_equal(columns, held.any(axis=2))
