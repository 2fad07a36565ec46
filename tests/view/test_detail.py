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
def test_every_voxel_is_drawn_once_and_the_last_level_draws_all(index: np.ndarray) -> None:
    order, levels = detail_order(index)
    assert sorted(order) == list(range(len(index)))
    assert (levels[-1].count, levels[-1].edge) == (len(index), 1)


@given(voxels())
def test_levels_grow_and_their_blocks_shrink(index: np.ndarray) -> None:
    _, levels = detail_order(index)
    assert [level.count for level in levels] == sorted(level.count for level in levels)
    edges = [level.edge for level in levels]
    assert edges == sorted(edges, reverse=True)


@given(voxels())
def test_a_level_shows_every_block_and_little_more(index: np.ndarray) -> None:
    order, levels = detail_order(index)
    for number, level in enumerate(levels[:-1]):
        drawn = np.unique(index[order[: level.count]] // level.edge, axis=0)
        blocks = np.unique(index // level.edge, axis=0)
        np.testing.assert_array_equal(drawn, blocks)
        if number == 0:
            assert level.count == len(blocks)


def test_any_part_of_a_level_is_spread_over_the_map() -> None:
    index = np.argwhere(np.ones((64, 64, 1), bool))
    order, levels = detail_order(index)
    for count in (levels[-2].count // 2, len(index) // 2):
        quarter = np.bincount((index[order[:count], :2] // 32) @ [2, 1], minlength=4)
        assert quarter.min() > 0.1 * count


@given(voxels(), st.integers(0, 60))
def test_a_smaller_number_of_voxels_is_the_beginning_of_all(index: np.ndarray, most: int) -> None:
    order, levels = detail_order(index)
    some, fewer = detail_order(index, most)
    np.testing.assert_array_equal(some, order[:most])
    assert fewer == levels[: len(fewer)]
    assert fewer[-1].count >= len(some)


def test_far_voxels_need_no_table_of_all_blocks() -> None:
    index = np.concatenate([np.argwhere(np.ones((4, 4, 4))), [[10**6, -(10**6), 10**6]]])
    order, levels = detail_order(index)
    assert sorted(order) == list(range(len(index)))
    assert levels[0].count == 2
