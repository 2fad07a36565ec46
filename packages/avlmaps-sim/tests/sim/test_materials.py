"""Materials: textures are seamless, drawn from the generator alone, and keep the colour that is asked for."""

import numpy as np
import pytest

from avlmaps.core.errors import AvlmapsError
from avlmaps_sim import materials
from avlmaps_sim.materials import KINDS, PICTURES, material

SEEDS = range(4)
TILING = [kind for kind in KINDS if kind not in PICTURES]
A_FEW_KINDS = ["wood", "plaster", "tile", "screen", "painting"]


def edge_ratio(image: np.ndarray, axis: int) -> float:
    """How large the step over the picture's edge is beside the 90th percentile of the steps within it."""
    value = image.astype(np.float64).mean(axis=2)
    step = np.abs(np.diff(np.concatenate([value, value.take([0], axis)], axis), axis=axis)).mean(axis=1 - axis)
    return float(step[-1] / (np.quantile(step[:-1], 0.9) + 1.0))


@pytest.mark.few(8)
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_a_picture_of_bounded_size_and_colours_in_range(kind: str) -> None:
    for seed in SEEDS:
        drawn = material(kind, np.random.default_rng(seed))
        assert drawn.texture is not None
        assert drawn.texture.dtype == np.uint8
        assert drawn.texture.flags.c_contiguous
        assert 64 <= max(drawn.texture.shape[:2]) <= 256
        assert drawn.texture.shape[2] == 3
        assert all(0.0 <= channel <= 1.0 for channel in drawn.colour)
        assert 0.0 <= drawn.gloss <= 1.0
        assert 0.0 <= drawn.emission <= 1.0


@pytest.mark.few(6)
@pytest.mark.parametrize("kind", TILING)
def test_a_texture_that_repeats_has_no_seam(kind: str) -> None:
    ratios = [
        edge_ratio(texture, axis)
        for seed in SEEDS
        for axis in (0, 1)
        if (texture := material(kind, np.random.default_rng(seed)).texture) is not None
    ]
    # A joint between tiles or a stripe may lie on the edge; a seam would be there every time.
    assert np.median(ratios) < 1.6


def test_the_seam_measure_sees_a_seam() -> None:
    ramp = np.broadcast_to(np.arange(128, dtype=np.uint8)[None, :, None], (128, 128, 3))
    assert edge_ratio(ramp, 1) > 50


@pytest.mark.parametrize("kind", PICTURES)
def test_a_picture_fills_its_sheet_once(kind: str) -> None:
    assert material(kind, np.random.default_rng(0)).texture_size_m == (1.0, 1.0)


@pytest.mark.parametrize("kind", A_FEW_KINDS)
def test_a_material_depends_on_the_generator_alone(kind: str) -> None:
    first = material(kind, np.random.default_rng(5))
    materials._texture.cache_clear()
    material(kind, np.random.default_rng(6))
    again = material(kind, np.random.default_rng(5))
    assert (first.colour, first.texture_size_m, first.gloss) == (again.colour, again.texture_size_m, again.gloss)
    assert first.texture is not None
    assert again.texture is not None
    assert np.array_equal(first.texture, again.texture)


@pytest.mark.few(8)
@pytest.mark.parametrize("kind", TILING)
@pytest.mark.parametrize("colour", [(0.5, 0.3, 0.2), (0.06, 0.06, 0.07)])
def test_a_colour_that_is_given_is_kept_on_average(kind: str, colour: tuple[float, float, float]) -> None:
    for seed in SEEDS:
        drawn = material(kind, np.random.default_rng(seed), colour)
        assert drawn.texture is not None
        seen = drawn.texture.reshape(-1, 3).mean(axis=0) / 255.0 * drawn.colour
        assert seen == pytest.approx(np.array(colour), abs=0.06)


def test_white_stays_white() -> None:
    for seed in SEEDS:
        drawn = material("white", np.random.default_rng(seed), (0.95, 0.95, 0.95))
        assert drawn.texture is not None
        assert (drawn.texture.mean() / 255.0 * np.array(drawn.colour)).min() > 0.85


@pytest.mark.parametrize("kind", ["wood", "fabric", "painting", "rug", "outdoors"])
def test_homes_differ_in_what_a_kind_looks_like(kind: str) -> None:
    drawn = [material(kind, np.random.default_rng(seed)).texture for seed in range(12)]
    assert len({texture.tobytes() for texture in drawn if texture is not None}) >= 8


def test_two_draws_of_one_texture_share_its_memory() -> None:
    one, two = (material("glass", np.random.default_rng(3), (g, g, g)) for g in (0.2, 0.7))
    assert one.texture is two.texture


def test_the_whole_pool_fits_in_150_megabytes() -> None:
    largest = 0
    for kind in KINDS:
        texture = material(kind, np.random.default_rng(0)).texture
        assert texture is not None
        sorts = (materials._KIND[kind].grey is not None) + (materials._KIND[kind].pictured is not None)
        largest += materials._KIND[kind].pool * sorts * texture.nbytes
    assert largest < 150e6


def test_an_unknown_kind_is_named_in_the_error() -> None:
    with pytest.raises(AvlmapsError, match="velvet"):
        material("velvet", np.random.default_rng(0))
