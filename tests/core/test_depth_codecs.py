"""The depth codec RVL against its paper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.core.rvl import decode_rvl
from helpers.format_writers import rvl


@given(arrays(np.uint16, (6, 7), elements=st.integers(0, 65535) | st.just(0)))
def test_rvl_gives_back_every_depth(depth: np.ndarray) -> None:
    content = rvl(depth)
    assert np.array_equal(decode_rvl(content, 7, 6), depth)
    if depth.any():
        with pytest.raises(ValueError, match="too few for 7x6"):
            decode_rvl(content[:-4], 7, 6)
