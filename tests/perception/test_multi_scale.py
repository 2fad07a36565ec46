"""One frame at several scales and in the mirror; and means that stop at edges."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.perception.embedded.scene_network import (
    AUGMENTATIONS,
    NEAR_M,
    PLAIN,
    REACH_CELLS,
    Augmentation,
    load_network,
    see_multi_scale,
    smoothed,
)
from avlmaps.recordings.types import Frame
from avlmaps_sim.render import Renderer
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.views import random_views

pytestmark = pytest.mark.nightly


CAMERA = Pinhole(277.0, 277.0, 160.0, 120.0, 320, 240)
GRID = Pinhole(8.0, 8.0, 6.0, 5.0, 12, 10)


@pytest.fixture(scope="module")
def rendered() -> Frame:
    """A view of a room, in the frame of its camera."""
    scene = open_scene("house:3")
    (pose,) = random_views(scene, np.random.default_rng(4), 1, CAMERA)
    view = Renderer(scene).render(CAMERA, pose)
    return Frame(0, "0", 0.0, view.rgb, view.depth_m, np.eye(4), Rig(CAMERA, CAMERA))


def mirror(frame: Frame) -> Frame:
    return replace(frame, rgb=frame.rgb[:, ::-1].copy(), depth_m=frame.depth_m[:, ::-1].copy())


@pytest.mark.parametrize("scale", [1.0, 1.2])
def test_a_mirrored_view_is_a_plain_one_at_the_mirrored_frame(rendered: Frame, scale: float) -> None:
    network = load_network()
    plain, other = Augmentation(scale), network.see(rendered, Augmentation(scale, mirrored=True))
    one = network.see(mirror(rendered), plain)
    # Depths are taken at the pixel right of a cell's middle, in the mirror left of it: thin edges may differ.
    differs = np.abs(one.category[:, ::-1] - other.category).max(axis=2)
    assert (differs < 0.05).mean() > 0.95
    np.testing.assert_allclose(one.room, other.room, atol=0.05)
    assert np.abs(network.see(rendered, plain).category - other.category).max() > 0.05  # and it is another view


@pytest.mark.nightly
def test_several_scales_give_distributions_on_the_grid_of_one(rendered: Frame) -> None:
    plain, often = EmbeddedPixels().see(rendered), EmbeddedPixels().see_multi_scale(rendered)
    assert often.category.shape == plain.category.shape and often.category.dtype == np.float32
    np.testing.assert_allclose(often.category.sum(axis=-1), 1.0, atol=1e-4)
    assert often.room.sum() == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_array_equal(often.known, plain.known)
    assert (often.category.argmax(axis=2) == plain.category.argmax(axis=2)).mean() > 0.8


def test_the_plain_look_is_the_first_and_none_comes_twice() -> None:
    assert AUGMENTATIONS[0] == PLAIN and len(set(AUGMENTATIONS)) == len(AUGMENTATIONS)


def test_a_frame_of_odd_size_is_seen(rendered: Frame) -> None:
    camera = Pinhole(110.0, 110.0, 63.5, 44.5, 127, 89)
    frame = replace(
        rendered,
        rgb=rendered.rgb[:89, :127].copy(),
        depth_m=rendered.depth_m[:89, :127].copy(),
        rig=Rig(camera, camera),
    )
    assert see_multi_scale(load_network(), frame).category.shape[:2] == load_network().see(frame).known.shape


def shares(seed: int, channels: int = 3) -> np.ndarray:
    values = np.random.default_rng(seed).exponential(size=(GRID.height, GRID.width, channels)).astype(np.float32)
    return values / values.sum(axis=2, keepdims=True)


PLANE = np.full((GRID.height, GRID.width), 0.1, np.float32)
GREY = np.full((GRID.height, GRID.width, 3), 128, np.uint8)


@given(seed=st.integers(0, 1000), depth_seed=st.integers(0, 1000))
def test_distributions_stay_distributions_between_the_least_and_the_most(seed: int, depth_seed: int) -> None:
    rng = np.random.default_rng(depth_seed)
    depth_m = rng.choice([0.0, 0.5, 0.55, 2.0], PLANE.shape).astype(np.float32)
    rgb = rng.integers(0, 255, GREY.shape, np.uint8)
    values = shares(seed)
    out = smoothed(values, depth_m, rgb, GRID)
    np.testing.assert_allclose(out.sum(axis=2), 1.0, atol=1e-4)
    assert out.min() >= values.min() - 1e-5 and out.max() <= values.max() + 1e-5
    np.testing.assert_array_equal(out[depth_m == 0.0], values[depth_m == 0.0])


@given(seed=st.integers(0, 1000))
def test_the_mirror_image_is_smoothed_to_the_mirror_image(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth_m = rng.uniform(0.2, 0.4, PLANE.shape).astype(np.float32)
    rgb = rng.integers(100, 110, GREY.shape, np.uint8)
    here = smoothed(shares(seed), depth_m, rgb, GRID)
    there = smoothed(shares(seed)[:, ::-1], depth_m[:, ::-1], rgb[:, ::-1], GRID)
    np.testing.assert_allclose(here[:, ::-1], there, atol=1e-4)


def test_on_one_near_surface_of_one_colour_each_neighbour_counts_by_its_distance() -> None:
    values = np.zeros((GRID.height, GRID.width, 1), np.float32)
    values[5, 6] = 1.0
    out = smoothed(values, PLANE, GREY, GRID)[..., 0]
    apart_m = PLANE[0, 0] / GRID.fx
    offsets = [(r, c) for r in range(-REACH_CELLS, REACH_CELLS + 1) for c in range(-REACH_CELLS, REACH_CELLS + 1)]
    weight = {o: np.exp(-0.5 * (o[0] ** 2 + o[1] ** 2) * (apart_m / NEAR_M) ** 2) for o in offsets}
    assert out[5, 6] == pytest.approx(1.0 / sum(weight.values()), rel=1e-3)
    inside = out[REACH_CELLS:-REACH_CELLS, REACH_CELLS:-REACH_CELLS]
    assert (inside > 0.0).all() and inside.max() == out[5, 6]


@pytest.mark.parametrize("edge", ["depth", "colour"])
def test_nothing_passes_an_edge(edge: str) -> None:
    values = np.zeros((GRID.height, GRID.width, 1), np.float32)
    values[:, 6:] = 1.0
    depth_m, rgb = PLANE.copy(), GREY.copy()
    if edge == "depth":
        depth_m[:, 6:] = 2.0
    else:
        rgb[:, 6:] = (200, 40, 40)
    np.testing.assert_allclose(smoothed(values, depth_m, rgb, GRID), values, atol=1e-3)
