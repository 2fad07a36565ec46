"""Two networks together: the second counts where they agree, and not where they do not."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.pixels import EmbeddedPixels, EmbeddedViews, features_of, synthetic_pixels
from avlmaps.perception.embedded.scene_network import (
    NO_SAY,
    SAME_SAY,
    SYNTHETIC_WEIGHTS,
    PairedNetworks,
    SceneNetwork,
    Seen,
    load_network,
    load_pair,
    mixed,
    share_of_second,
)
from avlmaps.recordings.types import Frame, Ground

ALL = np.ones((2, 3), bool)
CAMERA = Pinhole(260.0, 260.0, 160.0, 120.0, 320, 240)


def paired(first: np.ndarray, second: np.ndarray, known: np.ndarray = ALL) -> np.ndarray:
    return mixed(first, second, share_of_second(first, second, known))


def distributions() -> st.SearchStrategy[np.ndarray]:
    weight = st.floats(2.0**-10, 1.0, width=32)
    return arrays(np.float32, (2, 3, 4), elements=weight).map(lambda a: a / a.sum(axis=-1, keepdims=True))


@given(first=distributions(), second=distributions())
def test_what_comes_out_is_a_distribution_between_the_two(first: np.ndarray, second: np.ndarray):
    both = paired(first, second)
    np.testing.assert_allclose(both.sum(axis=-1), 1.0, atol=1e-5)
    assert (both >= np.minimum(first, second) - 1e-6).all()
    assert (both <= np.maximum(first, second) + 1e-6).all()


@given(first=distributions(), second=distributions())
def test_the_second_never_has_more_say_than_the_first(first: np.ndarray, second: np.ndarray):
    both = paired(first, second)
    assert (np.abs(both - first) <= np.abs(both - second) + 1e-6).all()


def agreeing(by: float) -> tuple[np.ndarray, np.ndarray]:
    """Return two distributions whose Bhattacharyya coefficient is this in every cell."""
    first = np.tile(np.array([1.0, 0.0], np.float32), (2, 3, 1))
    second = np.tile(np.array([by**2, 1.0 - by**2], np.float32), (2, 3, 1))
    return first, second


def test_the_first_decides_where_they_differ_much():
    first, second = agreeing(NO_SAY - 0.01)
    np.testing.assert_array_equal(paired(first, second), first)


def test_both_count_the_same_where_they_agree():
    first, second = agreeing(SAME_SAY + 0.01)
    np.testing.assert_allclose(paired(first, second), (first + second) / 2, atol=1e-6)


def test_cells_without_depth_do_not_decide_who_is_heard():
    first, second = agreeing(0.99)
    second[0] = (0.0, 1.0)
    known = ALL.copy()
    known[0] = False
    np.testing.assert_allclose(paired(first, second, known), (first + second) / 2, atol=1e-6)


def test_a_frame_without_any_depth_is_the_firsts():
    first, second = agreeing(0.99)
    np.testing.assert_array_equal(paired(first, second, ~ALL), first)


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
        EmbeddedPixels().see(frame).category, paired(alone.category, second, alone.known), atol=1e-6
    )


@pytest.mark.parametrize("alone", [EmbeddedPixels(load_network()), synthetic_pixels()], ids=["first", "second"])
def test_maps_of_one_network_are_not_those_of_the_pair(alone: EmbeddedPixels):
    assert EmbeddedPixels().card.checksum != alone.card.checksum


@pytest.mark.parametrize("multiple", [32, 64], ids=["inputs of the first", "inputs of its own"])
def test_rooms_are_mixed_by_the_same_share(frame: Frame, multiple: int):
    ships = load_network(SYNTHETIC_WEIGHTS)
    other = SceneNetwork(ships._read_weights, msgspec.structs.replace(ships.notes, multiple=multiple))
    first, second = load_network().see(frame), other.see(frame)
    share = share_of_second(first.category, second.category, first.known)
    found = PairedNetworks(load_network(), other).see(frame).room
    np.testing.assert_allclose(found, mixed(first.room, second.room, share), atol=1e-6)


def test_the_view_of_a_frame_whose_pixels_were_seen_needs_no_second_look(
    frame: Frame, monkeypatch: pytest.MonkeyPatch
) -> None:
    pixels, views, looks = EmbeddedPixels(), EmbeddedViews(), list[Frame]()
    see = PairedNetworks.see

    def counted(network: PairedNetworks, one: Frame) -> Seen:
        looks.append(one)
        return see(network, one)

    monkeypatch.setattr(PairedNetworks, "see", counted)
    darker = replace(frame, rgb=frame.rgb // 2)
    pixels.encode(darker)
    (found,) = views.encode([darker])
    assert len(looks) == 1
    np.testing.assert_allclose(found, features_of(see(load_pair(), darker).room, views.codes), atol=1e-6)
    up = Ground(np.array([0.0, 0.0, 1.0]), np.zeros(1), np.array([-1.0]))
    for change in ({"depth_m": frame.depth_m / 2}, {"ground": up}, {"rgb": frame.rgb // 3}):
        views.encode([replace(darker, **change)])
    assert len(looks) == 4, "another depth, ground or picture is another view"


def without_weights(**changes: tuple[str, ...]) -> SceneNetwork:
    """Return a network that knows other names and never looks."""
    return SceneNetwork(lambda: b"", msgspec.structs.replace(load_network().notes, **changes))


def test_a_second_network_that_knows_more_categories_or_other_rooms_is_refused():
    names, rooms = load_network().notes.categories, load_network().notes.rooms
    with pytest.raises(ValueError, match=names[-1]):
        PairedNetworks(without_weights(categories=names[:-1]), load_network())
    with pytest.raises(ValueError, match="kinds of room"):
        PairedNetworks(load_network(), without_weights(rooms=rooms[1:]))
