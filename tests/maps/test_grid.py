import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.maps.grid import GridSpec, index_ends

SIZES = st.sampled_from([0.01, 0.05, 0.0625, 0.1, 0.3, 1.0])
INDICES = arrays(np.int32, (7, 3), elements=st.integers(-(2**20), 2**20))


@given(size=SIZES, index=INDICES)
def test_the_middle_of_a_voxel_lies_in_it(size, index):
    grid = GridSpec(size)
    np.testing.assert_array_equal(grid.index_of(grid.centre_of(index)), index)


def test_the_voxels_at_the_origin_are_no_wider_than_the_rest():
    grid = GridSpec(0.5)
    places = np.array([[-0.51, -0.5, -0.01], [0.0, 0.49, 0.5]])
    assert grid.index_of(places).tolist() == [[-2, -1, -1], [0, 0, 1]]


@pytest.mark.parametrize("size", [0.0, -0.05, 0.0009, 11.0, np.nan, np.inf])
def test_sizes_that_make_no_sense_are_refused(size):
    with pytest.raises(ValueError, match=r"it must be between 0.001 and 10"):
        GridSpec(size)


@given(st.integers(1, 1200), st.integers(0, 2**32 - 1))
def test_the_ends_of_voxels_are_their_least_and_largest_indices(count: int, seed: int) -> None:
    index = np.random.default_rng(seed).integers(-50, 50, (count, 3)).astype(np.int32)
    low, high = index_ends(index)
    np.testing.assert_array_equal(low, index.min(axis=0))
    np.testing.assert_array_equal(high, index.max(axis=0))
