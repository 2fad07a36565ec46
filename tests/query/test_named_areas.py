"""Areas asked of an encoder that tells named kinds of room apart."""

from dataclasses import dataclass, field

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import keyframes_at

from avlmaps.core.question import Modality, Part, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.perception.embedded.pixels import features_of, orthonormal_codes
from avlmaps.perception.protocols import ModelCard, NamedViewEncoder
from avlmaps.query.modalities.area import area_factor, area_scores, pool_posteriors
from avlmaps.query.settings import AreaSettings, HeatSettings
from avlmaps.query.voxel_space import Space

ROOMS = ("kitchen", "bedroom", "office", "open-plan office")
MEANT = {"kitchen": (1, 0, 0, 0), "workplace": (0, 0, 1, 1)}


@dataclass
class Rooms:
    names: tuple[str, ...] = ROOMS
    codes: np.ndarray = field(
        default_factory=lambda: orthonormal_codes(np.random.default_rng(0).standard_normal((4, 8)))
    )
    card: ModelCard = field(default_factory=lambda: ModelCard("test/rooms", 8, "MIT", "0" * 64))

    def name_weights(self, word: str) -> np.ndarray:
        return np.array(MEANT.get(word, (0, 0, 0, 0)), np.float32)

    def encode(self, frames):
        raise NotImplementedError

    def encode_words(self, words):
        raise NotImplementedError


ENCODER = Rooms()
PLACES = np.array([[0.0, 0, 1.3], [3, 0, 1.3], [6, 0, 1.3]])
P = np.array([(0.7, 0.1, 0.1, 0.1), (0.1, 0.1, 0.4, 0.4), (0.2, 0.8, 0, 0)])


def ask(word: str):
    frames = keyframes_at(PLACES, features_of(P, ENCODER.codes))
    space = Space(GridSpec(0.05), np.argwhere(np.ones((4, 4, 4))), np.array([0.0, 0.0, 1.0]))
    part = Part(Modality.AREA, word, Role.CONTEXT)
    return area_factor(space, frames, ENCODER, part, AreaSettings(), HeatSettings())


def test_the_fake_keeps_to_the_protocol() -> None:
    assert isinstance(ENCODER, NamedViewEncoder)


def test_a_view_scores_as_likely_as_the_encoder_says() -> None:
    np.testing.assert_allclose(ask("kitchen").scores, [0.7, 0.1, 0.2], atol=1e-3)
    assert ask("kitchen").found


def test_a_wider_word_adds_up_what_it_takes_in() -> None:
    np.testing.assert_allclose(ask("workplace").scores, [0.2, 0.8, 0.0], atol=1e-3)


def test_a_room_that_it_does_not_know_is_not_found_and_says_what_is_known() -> None:
    factor = ask("volcano")
    assert not factor.found
    assert factor.note.startswith("'volcano' is not a known room")
    assert "it knows: kitchen, bedroom" in factor.note


def views(seed: int, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.dirichlet(np.ones(4), count), rng.uniform(0.0, 3.0, (count, 3))


@given(seed=st.integers(0, 10_000))
def test_pooling_keeps_distributions_and_knows_no_order(seed: int) -> None:
    share, places = views(seed)
    together = pool_posteriors(share, places, 0.8)
    np.testing.assert_allclose(together.sum(axis=1), 1.0)
    assert together.min() >= 0.0
    order = np.random.default_rng(seed + 1).permutation(len(share))
    np.testing.assert_allclose(pool_posteriors(share[order], places[order], 0.8), together[order], atol=1e-12)


@given(seed=st.integers(0, 10_000))
def test_a_view_that_nothing_else_looked_near_stays_as_it_is(seed: int) -> None:
    share, places = views(seed)
    places[0] += 100.0
    np.testing.assert_allclose(pool_posteriors(share, places, 0.8)[0], share[0])


def test_one_odd_view_is_outvoted_and_views_that_agree_are_surer_than_each() -> None:
    odd, usual = [0.9, 0.1], [0.2, 0.8]
    together = pool_posteriors(np.array([odd, usual, usual, usual]), np.zeros((4, 3)), 0.8)
    mean = np.array([0.375, 0.625]) ** 2
    np.testing.assert_allclose(together, np.tile(mean / mean.sum(), (4, 1)))
    assert pool_posteriors(np.array([usual, usual]), np.zeros((2, 3)), 0.8)[0, 1] > 0.8


def test_the_storey_above_has_no_say() -> None:
    share, places = np.array([[1.0, 0.0], [0.0, 1.0]]), np.array([[0.0, 0, 1], [0, 0, 4]])
    np.testing.assert_allclose(pool_posteriors(share, places, 0.8), share)


def test_the_papers_way_lets_every_view_speak_for_itself() -> None:
    view, places = features_of(P, ENCODER.codes), np.zeros((3, 3))
    for settings in (AreaSettings(pool_m=0.0), AreaSettings(score="min-max")):
        alone = area_scores(view, ENCODER, "kitchen", settings)
        np.testing.assert_array_equal(area_scores(view, ENCODER, "kitchen", settings, places), alone)
    assert not np.allclose(area_scores(view, ENCODER, "kitchen", AreaSettings(), places)[1], P[:, 0], atol=0.05)


def test_a_map_without_keyframes_has_no_area() -> None:
    nothing = area_scores(np.zeros((0, ENCODER.codes.shape[1]), np.float32), ENCODER, "kitchen", AreaSettings())
    assert [len(one) for one in nothing] == [0, 0]
