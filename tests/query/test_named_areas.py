"""Areas asked of an encoder that tells named kinds of room apart."""

from dataclasses import dataclass, field

import numpy as np
from query_fakes import keyframes_at

from avlmaps.core.question import Modality, Part, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.perception.embedded.pixels import features_of, orthonormal_codes
from avlmaps.perception.protocols import ModelCard, NamedViewEncoder
from avlmaps.query.rooms import area_factor, area_scores
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


def test_a_map_without_keyframes_has_no_area() -> None:
    nothing = area_scores(np.zeros((0, ENCODER.codes.shape[1]), np.float32), ENCODER, "kitchen", AreaSettings())
    assert [len(one) for one in nothing] == [0, 0]
