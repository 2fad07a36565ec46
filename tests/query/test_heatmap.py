import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from avlmaps.core.question import Modality, Part, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.query import factors
from avlmaps.query.factors import NearAnchors, NearThings, anchor_heat, object_heat, stretch_scores
from avlmaps.query.heatmap import Heatmap, product
from avlmaps.query.settings import HeatSettings
from avlmaps.query.voxel_space import Blocks, Space

SIZE_M = 0.05
FALLOFFS = st.sampled_from([0.2, 0.7, 2.0, 9.0])


@st.composite
def voxel_sets(draw: st.DrawFn, least: int = 0) -> np.ndarray:
    """Sparse, clustered, of any sign, with repeats removed and sorted; sometimes none."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count, spread = draw(st.integers(least, 300)), draw(st.sampled_from([3, 12, 60]))
    near = rng.integers(-spread, spread, (count, 3)) + rng.integers(-40, 40, (1, 3))
    return np.unique(near, axis=0).astype(np.int32)


@st.composite
def ups(draw: st.DrawFn) -> np.ndarray:
    vector = np.array(draw(st.tuples(*[st.integers(-9, 9)] * 3)), np.float64)
    return vector / np.linalg.norm(vector) if vector.any() else np.array([0.0, 0.0, 1.0])


@st.composite
def anchor_sets(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.sampled_from([0, 1, 2, 7, 60]))
    scores = np.full(count, draw(st.floats(0, 1))) if draw(st.booleans()) else rng.uniform(0, 1, count)
    return rng.normal(0, draw(st.sampled_from([0.0, 0.3, 3.0])), (count, 3)), scores


def brute_force_object(space: Space, mask: np.ndarray, falloff: float) -> np.ndarray:
    if not mask.any():
        return np.zeros(len(space))
    distance = np.linalg.norm(space.centres[:, None] - space.centres[mask][None], axis=-1).min(axis=1)
    return np.maximum(1.0 - falloff * distance, 0.0)


def brute_force_anchors(
    space: Space, up: np.ndarray, anchors: np.ndarray, scores: np.ndarray, falloff: float
) -> np.ndarray:
    away = space.centres[:, None] - anchors[None]
    flat = away - (away @ up)[..., None] * up
    return np.maximum((scores - falloff * np.linalg.norm(flat, axis=-1)).max(axis=1, initial=0.0), 0.0)


@given(voxel_sets(), st.sampled_from([0, 10**6]))
def test_blocks_are_the_cubes_in_order_and_each_keeps_the_maps(index, far) -> None:
    index = np.append(index, [[far + 100] * 3], axis=0).astype(np.int32)
    blocks, cube = Blocks.of(index), index // 8
    np.testing.assert_array_equal(blocks.order, np.lexsort((cube[:, 2], cube[:, 1], cube[:, 0])))
    for k, (a, b) in enumerate(itertools.pairwise(blocks.starts)):
        here = index[blocks.order[a:b]]
        assert len(np.unique(here // 8, axis=0)) == 1
        np.testing.assert_array_equal(blocks.index[:, a:b].T, here)
        np.testing.assert_array_equal([blocks.low[k], blocks.high[k]], [here.min(axis=0), here.max(axis=0)])


@given(voxel_sets(least=1), st.integers(0, 2**32 - 1), st.floats(0, 1), st.integers(1, 100), st.booleans())
def test_no_block_in_reach_is_skipped(index, seed, share, reach, far) -> None:
    index = np.append(index, [[10**6 if far else 50] * 3], axis=0).astype(np.int32)
    rng, whole = np.random.default_rng(seed), Blocks.of(index)
    things, some = (whole.chosen(rng.uniform(0, 1, len(index)) < share) for _ in range(2))
    near = set(some.near(things, reach).tolist())
    gap = np.maximum(some.low[:, None] - things.high[None], things.low[None] - some.high[:, None]).max(axis=2)
    assert set(np.flatnonzero((gap <= reach).any(axis=1)).tolist()) <= near


@given(voxel_sets(), st.integers(0, 2**32 - 1), st.floats(0, 1), FALLOFFS)
def test_object_heat_is_the_equation_at_every_voxel(index, seed, share, falloff) -> None:
    space = Space(GridSpec(SIZE_M), index, np.array([0.0, 0.0, 1.0]))
    mask = np.random.default_rng(seed).uniform(0, 1, len(index)) < share
    heat, nearest = object_heat(space, mask, falloff)
    np.testing.assert_allclose(heat, brute_force_object(space, mask, falloff), atol=1e-6)
    assert np.all(heat[mask] == 1.0)
    warm = heat > 0.0
    assert np.all(nearest[warm] >= 0)
    apart = np.linalg.norm(space.centres[warm] - space.centres[mask][nearest[warm]], axis=1)
    np.testing.assert_allclose(heat[warm], 1.0 - falloff * apart, atol=1e-6)


@given(voxel_sets(), st.integers(0, 2**32 - 1), anchor_sets(), FALLOFFS, st.floats(0, 1))
def test_heat_among_some_voxels_is_the_heat_of_all_there(index, seed, anchors_and_scores, falloff, share) -> None:
    space = Space(GridSpec(SIZE_M), index, np.array([0.0, 0.0, 1.0]))
    rng = np.random.default_rng(seed)
    mask, among = rng.uniform(0, 1, len(index)) < 0.3, rng.uniform(0, 1, len(index)) < share
    for some, all_ in (
        (object_heat(space, mask, falloff, among), object_heat(space, mask, falloff)),
        (anchor_heat(space, *anchors_and_scores, falloff, among), anchor_heat(space, *anchors_and_scores, falloff)),
    ):
        np.testing.assert_allclose(some[0], np.where(among, all_[0], 0.0), atol=1e-6)
        assert np.array_equal(some[1] >= 0, (all_[1] >= 0) & among)


@given(voxel_sets(), ups(), anchor_sets(), FALLOFFS)
def test_anchor_heat_is_the_equation_at_every_voxel(index, up, anchors_and_scores, falloff) -> None:
    anchors, scores = anchors_and_scores
    space = Space(GridSpec(SIZE_M), index, up)
    heat, winner = anchor_heat(space, anchors, scores, falloff)
    np.testing.assert_allclose(heat, brute_force_anchors(space, up, anchors, scores, falloff), atol=1e-6)
    assert heat.shape == (len(index),)
    assert np.array_equal(winner >= 0, heat > 0.0)
    warm = winner >= 0
    away = space.level(space.centres[warm])[:, :2] - space.level(anchors[winner[warm]])[:, :2]
    own_cone = scores[winner[warm]] - falloff * np.linalg.norm(away, axis=1)
    np.testing.assert_allclose(heat[warm], own_cone, atol=1e-6)


def test_primary_reaches_half_a_metre_and_context_five() -> None:
    line = np.stack([np.arange(120), np.zeros(120), np.zeros(120)], axis=1).astype(np.int32)
    space, settings = Space(GridSpec(SIZE_M), line, np.array([0.0, 0.0, 1.0])), HeatSettings()
    first = np.arange(120) == 0
    primary, _ = object_heat(space, first, settings.falloff_per_m(Role.PRIMARY))
    context, _ = object_heat(space, first, settings.falloff_per_m(Role.CONTEXT))
    assert np.flatnonzero(primary > 1e-6).max() == 9  # 0.45 m; at 0.50 m it is nothing
    assert np.flatnonzero(context > 1e-6).max() == 99
    assert context[20] == pytest.approx(0.8)


def factor(space: Space, anchors: np.ndarray, scores: np.ndarray, role: Role = Role.CONTEXT) -> NearAnchors:
    part = Part(Modality.SOUND, "dog", role)
    return NearAnchors(space, part, 0.2, anchors, scores, np.arange(len(anchors)), True)


@given(voxel_sets(), anchor_sets(), anchor_sets())
def test_a_product_is_element_wise_and_keeps_its_factors(index, first, second) -> None:
    space = Space(GridSpec(SIZE_M), index, np.array([0.0, 0.0, 1.0]))
    a, b = Heatmap.of(factor(space, *first)), Heatmap.of(factor(space, *second))
    np.testing.assert_array_equal((a * b).values, a.values * b.values)
    np.testing.assert_array_equal((a * b).values, (b * a).values)
    assert (a * b).factors == (*a.factors, *b.factors)
    assert product([a, b]).peak <= min(a.peak, b.peak) + 1e-6
    assert np.all((a.values >= 0.0) & (a.values <= 1.0))


@given(anchor_sets(), hnp.arrays(np.float64, (5, 3), elements=st.floats(-3, 3)))
def test_heat_at_a_point_is_the_equation_too(anchors_and_scores, points) -> None:
    anchors, scores = anchors_and_scores
    space = Space(GridSpec(SIZE_M), np.zeros((0, 3), np.int32), np.array([0.0, 0.0, 1.0]))
    flat = np.linalg.norm(points[:, None, :2] - anchors[None, :, :2], axis=-1)
    expected = np.maximum((scores - 0.2 * flat).max(axis=1, initial=0.0), 0.0)
    np.testing.assert_allclose(factor(space, anchors, scores).at(points), expected, atol=1e-9)


def test_an_empty_map_has_no_heat_and_no_goals() -> None:
    space = Space(GridSpec(SIZE_M), np.zeros((0, 3), np.int32), np.array([0.0, 0.0, 1.0]))
    heat = Heatmap.of(factor(space, np.zeros((0, 3)), np.zeros(0)))
    assert (heat.peak, heat.goals(), len(heat)) == (0.0, [], 0)


@given(hnp.arrays(np.float64, st.integers(0, 8), elements=st.floats(-5, 5)))
def test_normalised_scores_lie_in_0_1_and_keep_their_order(scores) -> None:
    stretched = stretch_scores(scores)
    assert stretched.shape == scores.shape
    assert np.isfinite(stretched).all()
    assert np.all((stretched >= 0.0) & (stretched <= 1.0))
    assert np.all(np.diff(stretched[np.argsort(scores, kind="stable")]) >= 0.0)
    assert not len(scores) or stretched[np.argmax(scores)] == 1.0


@given(hnp.arrays(np.float64, st.integers(1, 8), elements=st.floats(-1, 1)), st.floats(-2, 2) | st.floats(-200, 200))
def test_scores_that_differ_by_rounding_alone_are_equal(noise, score) -> None:
    rounding = 2.0 * np.finfo(np.float32).eps * max(1.0, abs(score))
    np.testing.assert_array_equal(stretch_scores(score + rounding * noise), np.ones(len(noise)))
    apart = stretch_scores(np.append(score + rounding * noise, score + 1e-3 * max(1.0, abs(score))))
    assert apart[-1] == 1.0
    assert np.all(apart[:-1] < 1e-3)


def test_scores_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="a score is NaN or infinite"):
        stretch_scores(np.array([0.1, np.nan]))
    space = Space(GridSpec(SIZE_M), np.zeros((0, 3), np.int32), np.array([0.0, 0.0, 1.0]))
    with pytest.raises(ValueError, match="an anchor's score is outside"):
        factor(space, np.zeros((1, 3)), np.array([np.nan]))


def near_anchors(index, up, anchors_and_scores, falloff) -> NearAnchors:
    anchors, scores = anchors_and_scores
    instance = np.arange(len(anchors)) % 3 if len(anchors) > 2 else np.arange(len(anchors))
    part = Part(Modality.SOUND, "dog", Role.PRIMARY)
    space = Space(GridSpec(SIZE_M), index, up)
    return NearAnchors(space, part, falloff, anchors, scores, instance, True, certainty=0.7)


@given(voxel_sets(), ups(), anchor_sets(), FALLOFFS)
def test_no_voxel_is_hotter_than_the_places_of_one_sound(index, up, anchors_and_scores, falloff) -> None:
    factor = near_anchors(index, up, anchors_and_scores, falloff)
    peak = Heatmap.of(factor)._shares.peak
    heat, anchor = factor.heat_and_anchors()
    hot = np.flatnonzero(heat > 0.0)
    assert (heat[hot] <= peak[factor.instance[anchor[hot]]] + 1e-6).all()
    own = np.zeros(len(peak))
    np.maximum.at(own, factor.instance, factor.scores)
    assert (peak >= own - 1e-9).all()


@given(voxel_sets(least=1), ups(), anchor_sets(), FALLOFFS, st.integers(0, 2**32 - 1))
def test_heat_is_shown_alike_for_some_voxels_and_for_all(index, up, anchors_and_scores, falloff, seed) -> None:
    some = np.random.default_rng(seed).integers(0, len(index), 20)
    factor = near_anchors(index, up, anchors_and_scores, falloff)
    part = Part(Modality.OBJECT, "chair", Role.PRIMARY)
    mask = np.random.default_rng(seed).random(len(index)) < 0.1
    thing = NearThings(factor.space, part, falloff, mask, np.zeros(mask.sum(), int), np.full(1, 0.6), True)
    for one in (factor, thing):
        np.testing.assert_allclose(Heatmap.of(one).shown_at(some), Heatmap.of(one).shown[some], atol=1e-6)
    both = Heatmap(factor.space, (thing, factor))
    np.testing.assert_allclose(both.shown_at(some), both.shown[some], atol=1e-6)


@given(anchor_sets(), anchor_sets(), FALLOFFS)
def test_heat_at_many_places_is_that_at_each(anchors_and_scores, places, falloff) -> None:
    factor = near_anchors(np.zeros((1, 3), np.int32), np.array([0.0, 0.0, 1.0]), anchors_and_scores, falloff)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(factors, "_PAIRS", 0)
        many = factor.at(places[0])
    np.testing.assert_allclose(many, factor.at(places[0]), atol=1e-9)
