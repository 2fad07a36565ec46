"""A picture of a map has a bounded number of cells, however far apart its voxels are."""

import numpy as np

from avlmaps.maps.grid import GridSpec
from avlmaps.query.plots import TopDown
from avlmaps.query.voxel_space import Space


def test_a_wide_map_is_drawn_in_larger_cells() -> None:
    index = np.array([[0, 0, 0], [1, 0, 0], [40_000, 30_000, 0]], np.int32)
    space = Space(GridSpec(0.05), index, np.array([0.0, 0.0, 1.0]))
    view = TopDown.of(space)
    assert max(view.seen.shape) < 2600
    left, right, bottom, top = view.extent
    assert left <= 0.0 and right >= 2000.0 and bottom <= 0.0 and top >= 1500.0
    assert view.heat(np.array([0.1, 0.2, 0.9], np.float32)).max() == np.float32(0.9)
    small = TopDown.of(Space(GridSpec(0.05), index[:2], np.array([0.0, 0.0, 1.0])))
    assert small.seen.sum() == 2
