import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.perception.embedded.keypoints import MAX_KEYPOINTS, MAX_SIDE_PX, RootSift, root_normalised
from avlmaps.perception.protocols import LocalEncoder
from helpers.picture_room import painting


@pytest.fixture(scope="module")
def sift() -> RootSift:
    return RootSift()


def dot(x: float, y: float, sigma: float = 5.0, width: int = 120, height: int = 90) -> np.ndarray:
    """Return a round spot whose middle has the image coordinates (x, y), pixel centres being at +0.5."""
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    gray = 30 + 200 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * sigma**2))
    return np.repeat(gray.round().astype(np.uint8)[..., None], 3, axis=2)


@pytest.mark.parametrize("value", [0, 128, 255])
def test_a_blank_picture_has_no_keypoints_and_arrays_of_the_right_shape(sift: RootSift, value: int) -> None:
    found = sift.encode(np.full((48, 64, 3), value, np.uint8))
    assert (found.xy.shape, found.descriptors.shape) == ((0, 2), (0, 128))
    assert {found.xy.dtype, found.descriptors.dtype} == {np.dtype(np.float32)}


@pytest.mark.parametrize("shape", [(1, 1), (2, 300), (7, 5)])
def test_tiny_pictures_do_no_harm(sift: RootSift, shape: tuple[int, int]) -> None:
    assert len(sift.encode(np.zeros((*shape, 3), np.uint8)).xy) == 0


@pytest.mark.parametrize(("x", "y"), [(60.5, 45.5), (60.0, 45.0), (41.3, 52.8)])
def test_the_middle_of_a_spot_is_told_with_pixel_centres_at_a_half(sift: RootSift, x: float, y: float) -> None:
    found = sift.encode(dot(x, y))
    assert np.linalg.norm(found.xy - (x, y), axis=1).min() < 0.1


def test_a_large_picture_is_looked_at_small_and_told_in_its_own_pixels(sift: RootSift) -> None:
    factor = 20
    large = cv2.resize(dot(60.0, 45.0), None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    assert large.shape[1] > MAX_SIDE_PX
    found = sift.encode(large)
    nearest = np.linalg.norm(found.xy - (60.0 * factor, 45.0 * factor), axis=1).argmin()
    assert np.linalg.norm(found.xy[nearest] - (60.0 * factor, 45.0 * factor)) < 3.0


def test_a_rich_picture_gives_the_capped_count_of_unit_descriptors(sift: RootSift) -> None:
    found = sift.encode(painting(np.random.default_rng(0), shapes=3000))
    assert len(found.xy) == MAX_KEYPOINTS
    np.testing.assert_allclose(np.linalg.norm(found.descriptors, axis=1), 1.0, atol=1e-5)


def test_threads_change_nothing(sift: RootSift) -> None:
    picture = painting(np.random.default_rng(1))
    threads = cv2.getNumThreads()
    try:
        cv2.setNumThreads(1)
        one = sift.encode(picture)
        cv2.setNumThreads(4)
        four = sift.encode(picture)
    finally:
        cv2.setNumThreads(threads)
    for name in ("xy", "descriptors"):
        np.testing.assert_array_equal(getattr(one, name), getattr(four, name))


@given(arrays(np.float32, (3, 128), elements=st.integers(0, 255)))
def test_the_dot_product_is_the_hellinger_kernel_of_the_histograms(histograms: np.ndarray) -> None:
    histograms = histograms + (histograms.sum(axis=1, keepdims=True) == 0)
    share = histograms / histograms.sum(axis=1, keepdims=True)
    kernel = np.sqrt(share[:, None] * share[None]).sum(axis=2)
    rows = root_normalised(histograms)
    np.testing.assert_allclose(rows @ rows.T, kernel, atol=1e-5)


def test_it_is_a_local_encoder_with_a_stable_card(sift: RootSift) -> None:
    assert isinstance(sift, LocalEncoder)
    assert sift.card == RootSift().card
    assert (sift.card.dim, len(sift.card.checksum)) == (128, 64)
