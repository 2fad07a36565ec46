"""Two networks together: the second counts where they agree, and not where they do not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.paired_networks import NO_SAY, SAME_SAY, PairedNetworks, load_pair, mixed
from avlmaps.perception.embedded.pixels import EmbeddedPixels, synthetic_pixels
from avlmaps.perception.embedded.scene_network import SYNTHETIC_WEIGHTS, load_network
from avlmaps.recordings.types import Frame

ALL = np.ones((2, 3), bool)
CAMERA = Pinhole(260.0, 260.0, 160.0, 120.0, 320, 240)


def distributions() -> st.SearchStrategy[np.ndarray]:
    weight = st.floats(2.0**-10, 1.0, width=32)
    return arrays(np.float32, (2, 3, 4), elements=weight).map(lambda a: a / a.sum(axis=-1, keepdims=True))


@given(first=distributions(), second=distributions())
def test_what_comes_out_is_a_distribution_between_the_two(first: np.ndarray, second: np.ndarray):
    both = mixed(first, second, ALL)
    np.testing.assert_allclose(both.sum(axis=-1), 1.0, atol=1e-5)
    assert (both >= np.minimum(first, second) - 1e-6).all()
    assert (both <= np.maximum(first, second) + 1e-6).all()


@given(first=distributions(), second=distributions())
def test_the_second_never_has_more_say_than_the_first(first: np.ndarray, second: np.ndarray):
    both = mixed(first, second, ALL)
    assert (np.abs(both - first) <= np.abs(both - second) + 1e-6).all()


@given(one=distributions())
def test_two_of_one_mind_are_that_mind(one: np.ndarray):
    np.testing.assert_allclose(mixed(one, one, ALL), one, atol=1e-6)


def agreeing(by: float) -> tuple[np.ndarray, np.ndarray]:
    """Return two distributions whose Bhattacharyya coefficient is this in every cell."""
    first = np.tile(np.array([1.0, 0.0], np.float32), (2, 3, 1))
    second = np.tile(np.array([by**2, 1.0 - by**2], np.float32), (2, 3, 1))
    return first, second


def test_the_first_decides_where_they_differ_much():
    first, second = agreeing(NO_SAY - 0.01)
    np.testing.assert_array_equal(mixed(first, second, ALL), first)


def test_both_count_the_same_where_they_agree():
    first, second = agreeing(SAME_SAY + 0.01)
    np.testing.assert_allclose(mixed(first, second, ALL), (first + second) / 2, atol=1e-6)


def test_cells_without_depth_do_not_decide_who_is_heard():
    first, second = agreeing(0.99)
    second[0] = (0.0, 1.0)
    known = ALL.copy()
    known[0] = False
    np.testing.assert_allclose(mixed(first, second, known), (first + second) / 2, atol=1e-6)


def test_a_frame_without_any_depth_is_the_firsts():
    first, second = agreeing(0.99)
    np.testing.assert_array_equal(mixed(first, second, ~ALL), first)


@pytest.fixture(scope="module")
def frame() -> Frame:
    depth_m = np.full((240, 320), 2.0, np.float32)
    rgb = np.random.default_rng(0).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    return Frame(0, "0", 0.0, rgb, depth_m, np.eye(4), Rig(CAMERA, CAMERA))


def test_the_pixel_encoder_that_ships_looks_with_both(frame: Frame):
    alone = load_network().see(frame)
    other = EmbeddedPixels(load_network(SYNTHETIC_WEIGHTS)).see(frame)
    column = [load_network().notes.categories.index(name) for name in synthetic_pixels().names]
    second = np.zeros_like(alone.category)
    second[..., column] = other.category
    np.testing.assert_allclose(
        EmbeddedPixels().see(frame).category, mixed(alone.category, second, alone.known), atol=1e-6
    )


@pytest.mark.parametrize("alone", [EmbeddedPixels(load_network()), synthetic_pixels()], ids=["first", "second"])
def test_maps_of_one_network_are_not_those_of_the_pair(alone: EmbeddedPixels):
    assert EmbeddedPixels().card.checksum != alone.card.checksum


def test_the_rooms_are_the_firsts(frame: Frame):
    np.testing.assert_array_equal(load_pair().see(frame).room, load_network().see(frame).room)


def test_a_second_network_that_knows_more_kinds_is_refused():
    with pytest.raises(ValueError, match="clothing"):
        PairedNetworks(load_network(SYNTHETIC_WEIGHTS), load_network())
