"""View and place encoders as a profile names them: made from the folder of models, and asked as a query asks."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiny.clip import write_clip
from tiny.megaloc import write_megaloc
from tiny.siglip2 import write_siglip2

from avlmaps.core.registry import Kind, find, load
from avlmaps.perception.conformance import example_frame
from avlmaps.perception.encoders import profile
from avlmaps.perception.protocols import LocalFeatures, PlaceEncoder, ViewEncoder
from avlmaps.query.rooms import AREA_NAMES, area_scores, same_place
from avlmaps.query.settings import AreaSettings


@pytest.mark.parametrize(("name", "write"), [("siglip2", write_siglip2), ("clip", write_clip)])
def test_views_by_name_give_the_posterior_of_the_models_softmax(
    models: Path, name: str, write: Callable[[Path], None]
) -> None:
    write(models)
    views = load(Kind.VIEWS, name)
    assert isinstance(views, ViewEncoder)
    assert views.card.id == find(Kind.VIEWS, name).model and views.card.licence == find(Kind.VIEWS, name).licence
    rows = views.encode([example_frame(seed) for seed in range(3)])
    posterior, score = area_scores(rows, views, "kitchen", AreaSettings(same_word_cosine=2.0))
    words = ["kitchen", *(area for area in AREA_NAMES if not same_place(area, "kitchen"))]
    logits = views.logit_scale * rows.astype(np.float64) @ views.encode_words(words).T.astype(np.float64)
    expected = np.exp(logits[:, 0]) / np.exp(logits).sum(axis=1)
    np.testing.assert_allclose(posterior, expected, rtol=1e-6)
    assert np.array_equal(score, posterior)


def test_places_by_name_tell_one_picture_from_another(models: Path) -> None:
    write_megaloc(models)
    name = "megaloc"
    places = load(Kind.PLACE, name)
    assert isinstance(places, PlaceEncoder)
    assert places.card.id == find(Kind.PLACE, name).model and places.card.licence == find(Kind.PLACE, name).licence
    nothing = LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 8), np.float32))
    pictures = [example_frame(seed, width=160, height=120).rgb for seed in range(3)]
    brighter = np.clip(pictures[0].astype(np.int32) + 4, 0, 255).astype(np.uint8)
    rows = np.stack([places.encode(picture, nothing, {}) for picture in [*pictures, brighter]])
    assert int(np.argmax(rows[:3] @ rows[3])) == 0


def test_the_profile_names_them() -> None:
    foundation = profile("foundation")
    assert foundation.name_of(Kind.VIEWS) == "siglip2" and foundation.name_of(Kind.PLACE) == "megaloc"
