import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check
from avlmaps.perception.embedded.keypoints import MAX_KEYPOINTS, MAX_SIDE_PX, XFeat, _cubic

XFEAT = XFeat()


def picture(height: int, width: int, seed: int = 0) -> np.ndarray:
    """Return blocks of many sizes: corners everywhere."""
    rng = np.random.default_rng(seed)
    levels = [np.kron(rng.uniform(0, 255, (height // n + 1, width // n + 1)), np.ones((n, n))) for n in (32, 12, 5)]
    mixed = sum(level[:height, :width] for level in levels) / len(levels)
    return np.repeat(mixed[..., None], 3, axis=2).astype(np.uint8)


@pytest.mark.parametrize("kind", [Kind.LOCAL, Kind.PLACE, Kind.MATCHER])
def test_it_conforms(kind: Kind) -> None:
    check(kind, load(kind, "xfeat"))


@given(st.floats(0.0, 1.0))
def test_weights_of_neighbours_add_up_to_one(off: float) -> None:
    assert _cubic(off - np.arange(-1.0, 3.0)).sum() == pytest.approx(1.0)


def test_a_picture_is_matched_with_itself_moved_and_darkened() -> None:
    whole = picture(352, 480)
    bright, dark = whole[:320, :448], (whole[16:336, 24:472] * 0.2).astype(np.uint8)
    a, b = XFEAT.encode(np.ascontiguousarray(bright)), XFEAT.encode(np.ascontiguousarray(dark))
    pairs = load(Kind.MATCHER, "xfeat").match(a, b)
    moved = a.xy[pairs[:, 0]] - b.xy[pairs[:, 1]]
    right = np.abs(moved - (24, 16)).max(axis=1) < 3
    assert right.sum() > 50 and right.mean() > 0.8


def test_a_large_picture_is_looked_at_small_and_told_in_its_own_pixels() -> None:
    found = XFEAT.encode(picture(900, 2 * MAX_SIDE_PX))
    assert 100 < len(found.xy) <= MAX_KEYPOINTS
    assert found.xy[:, 0].max() > 1.5 * MAX_SIDE_PX and (found.xy < (2 * MAX_SIDE_PX, 900)).all()


@pytest.mark.parametrize("size", [(1, 1), (31, 640), (40, 33)])
def test_tiny_pictures_do_no_harm(size: tuple[int, int]) -> None:
    assert XFEAT.encode(picture(*size)).descriptors.shape[1] == 64
