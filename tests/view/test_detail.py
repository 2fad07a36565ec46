"""Levels of detail: laws of the order in which voxels are drawn."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.view.layout import detail_order


@st.composite
def voxels(draw) -> np.ndarray:
    cells = draw(st.lists(st.tuples(*3 * [st.integers(-40, 40)]), max_size=300, unique=True))
    return np.array(cells, np.int64).reshape(-1, 3)


@given(voxels())
def test_every_voxel_is_drawn_once_and_a_level_shows_every_block_and_little_more(index: np.ndarray) -> None:
    order, levels = detail_order(index)
    assert sorted(order) == list(range(len(index)))
    assert (levels[-1].count, levels[-1].edge) == (len(index), 1)
    for number, level in enumerate(levels[:-1]):
        drawn = np.unique(index[order[: level.count]] // level.edge, axis=0)
        blocks = np.unique(index // level.edge, axis=0)
        np.testing.assert_array_equal(drawn, blocks)
        if number == 0:
            assert level.count == len(blocks)


def test_far_voxels_need_no_table_of_all_blocks() -> None:
    index = np.concatenate([np.argwhere(np.ones((4, 4, 4))), [[10**6, -(10**6), 10**6]]])
    order, levels = detail_order(index)
    assert sorted(order) == list(range(len(index))) and levels[0].count == 2
