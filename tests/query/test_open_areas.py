"""Areas by a view encoder of an open vocabulary: its cosines differ by hundredths; its own scale makes them count."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import asked, furnished_map, keyframes_at

from avlmaps.perception.protocols import ModelCard
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.rooms import AREA_NAMES, area_scores, same_place
from avlmaps.query.settings import AreaSettings, QuerySettings

_DIM = 64


class OpenViews:
    """Any phrase has a feature; a view of a room lies a little nearer to the room's name than to all others.

    As with CLIP, text lies in a narrow cone and pictures in another: right pairs have a cosine of about 0.25, wrong
    ones about 0.20.
    """

    card = ModelCard("fake/open-views", _DIM, "MIT", "0")

    def __init__(self, rooms: Sequence[str] = ()) -> None:
        self.rooms = tuple(rooms)

    def encode(self, frames: Sequence[Any]) -> np.ndarray:
        return np.zeros((len(frames), _DIM), np.float32)

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        rows = np.array([self._own(word) for word in words], np.float64).reshape(-1, _DIM)
        rows[:, 0] += 2.0
        return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)

    def view(self, room: str, more: float = 0.05) -> np.ndarray:
        """A unit vector whose cosine with the room's word is ``more`` above that with a word like no other."""
        word = self.encode_words([room])[0].astype(np.float64)
        row = np.zeros(_DIM)
        row[0] = 0.2
        row += more * self._own(room) / np.linalg.norm(self._own(room)) / (word @ self._own(room))
        row[1] = np.sqrt(max(1.0 - row[2:] @ row[2:] - row[0] ** 2, 0.0))
        return (row / np.linalg.norm(row)).astype(np.float32)

    @staticmethod
    def _own(word: str) -> np.ndarray:
        own = np.random.default_rng([ord(letter) for letter in word]).standard_normal(_DIM)
        own[:2] = 0.0
        return own / np.linalg.norm(own)


class ScaledViews(OpenViews):
    """The same, and it knows its scale, as CLIP and SigLIP do."""

    logit_scale = 100.0


def _map(views: OpenViews, rooms: Sequence[str], more: float = 0.05) -> AVLMap:
    places = np.array([[2.0 * i, 1.0, 1.4] for i in range(len(rooms))])
    rows = np.array([views.view(room, more) for room in rooms], np.float32).reshape(-1, _DIM)
    return furnished_map(keyframes=keyframes_at(places, rows), views=views)


def test_a_room_that_was_seen_is_found_and_one_that_was_not_is_not() -> None:
    m = _map(ScaledViews(), ["kitchen", "living room", "office"])
    for room in ("kitchen", "living room", "office"):
        assert m.area(room).found, room
    for room in ("garage", "library", "swimming pool", "cathedral"):
        assert not m.area(room).found, room
    heat = m.area("living room", primary=True)
    anchors, scores = heat.factors[0].anchors, heat.factors[0].scores
    assert np.argmax(scores) == 1
    assert heat.goals()[0].position[:2] == pytest.approx(tuple(anchors[1][:2]))


def test_phrases_in_a_narrow_cone_still_compete() -> None:
    """All phrases of some models have cosines above 0.95 with one another."""

    class Narrow(ScaledViews):
        logit_scale = 4000.0

        def encode_words(self, words: Sequence[str]) -> np.ndarray:
            rows = np.array([self._own(word) for word in words], np.float64).reshape(-1, _DIM)
            rows[:, 0] += 20.0
            return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)

    views = Narrow()
    words = views.encode_words(AREA_NAMES)
    assert (words @ words.T).min() > 0.95
    rows = views.encode_words(["kitchen", "bedroom"])
    assert area_scores(rows, views, "kitchen", AreaSettings())[0] == pytest.approx([1.0, 0.0], abs=0.1)
    assert (area_scores(rows, views, "garage", AreaSettings())[0] < 0.5).all()


@pytest.mark.parametrize(
    ("area", "asked", "same"),
    [
        ("kitchen", "the Kitchen", True), ("kitchen", "large old kitchen", True), ("corridor", "hallway", True),
        ("corridor", "entrance hall", False), ("lounge", "living room", True), ("dining room", "living room", False),
        ("office", "post office building", False), ("gym", "room", False),
    ],
)  # fmt: skip
def test_which_words_mean_the_same_place(area: str, asked: str, same: bool) -> None:
    assert same_place(area, asked) == same


def test_without_the_scale_nothing_would_be_found() -> None:
    """What the scale is for: at the temperature that suits other encoders, all names look alike."""
    assert not _map(OpenViews(), ["kitchen", "living room"]).area("kitchen").found
    fixed = AreaSettings(temperature=0.01)
    m = asked(_map(OpenViews(), ["kitchen", "living room"]), settings=QuerySettings(areas=fixed))
    assert m.area("kitchen").found


@pytest.mark.parametrize("score", ["posterior", "min-max"])
def test_one_view_and_equal_views_have_scores_in_range(score: Any) -> None:
    views, way = ScaledViews(), AreaSettings(score=score)
    for rooms in (["kitchen"], ["kitchen"] * 3, []):
        rows = np.array([views.view(room) for room in rooms], np.float32).reshape(-1, _DIM)
        posterior, scores = area_scores(rows, views, "kitchen", way)
        assert len(posterior) == len(scores) == len(rooms)
        assert (scores >= 0.0).all() and (scores <= 1.0).all()
        if score == "min-max":
            np.testing.assert_array_equal(scores, np.ones(len(rooms)))
        np.testing.assert_allclose(scores, scores[:1].repeat(len(rooms)), atol=1e-6)
        assert (posterior >= 0.5).all()
        absent = area_scores(rows, views, "garage", way)[0]
        assert (absent < 0.5).all(), "stretched or not, an absent room is told by its posterior"


@pytest.mark.parametrize(
    ("asked", "named"), [("hallway", "corridor"), ("Sitting room", "living room"), ("lab", "laboratory")]
)
def test_another_word_for_the_same_place_does_not_compete_with_it(asked: str, named: str) -> None:
    views = ScaledViews()
    both = views.view(asked, 0.1).astype(np.float64) + views.view(named, 0.1)
    row = (both / np.linalg.norm(both)).astype(np.float32)[None]
    posterior = area_scores(row, views, asked, AreaSettings())[0]
    assert posterior[0] > 0.5, "a view that is as much the one word as the other is the place that both mean"
    assert area_scores(row, views, "garage", AreaSettings())[0][0] < 0.1


@given(st.lists(st.sampled_from(AREA_NAMES), max_size=5), st.sampled_from(AREA_NAMES), st.floats(0.0, 0.2))
def test_the_posterior_is_the_models_softmax(rooms: list[str], asked: str, more: float) -> None:
    views = ScaledViews()
    rows = np.array([views.view(room, more) for room in rooms], np.float32).reshape(-1, _DIM)
    found = area_scores(rows, views, asked, AreaSettings(same_word_cosine=2.0))[0]
    words = [asked, *(name for name in AREA_NAMES if not same_place(name, asked))]
    logits = 100.0 * rows.astype(np.float64) @ views.encode_words(words).T.astype(np.float64)
    for row, value in zip(logits, found, strict=True):
        assert value == pytest.approx(1.0 / np.exp(row - row[0]).sum(), rel=1e-6)
