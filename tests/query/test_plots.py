from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from query_fakes import UP, asked, box, fake_map, furnished_map, keyframes_at, sounds_of, voxels_of

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.query.factors import NearThings
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities import image_factor
from avlmaps.query.plots import HEAT_LABEL, TopDown, aside, draw_map, save
from avlmaps.query.settings import HeatSettings
from avlmaps.query.voxel_space import Space

CHAIR = Part(Modality.OBJECT, "chair")
WALK = np.stack([np.linspace(1, 5, 20), 1 + np.sin(np.linspace(0, 3, 20)), np.full(20, 1.4)], axis=1)


def colours_in(path: Path) -> int:
    return len(np.unique(cv2.imread(str(path)).reshape(-1, 3), axis=0))


@pytest.mark.slow
def test_a_product_has_a_panel_for_each_part_and_one_for_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.query.plots._DPI", 50)  # a seventh of the pixels
    m = furnished_map(sounds=sounds_of([WALK[3:8]], [0.9]), keyframes=keyframes_at(WALK))
    heat = m.object("chair", primary=True) * m.sound("dog")
    one, three = m.object("chair", primary=True).plot(), heat.plot()
    assert isinstance(three, Figure) and len(three.axes) >= 3 and three.get_figwidth() > 1.5 * one.get_figwidth()
    assert colours_in(heat.plot(tmp_path / "deep" / "three.png")) > 50


@pytest.mark.nightly
def test_a_map_is_drawn_with_its_sounds(tmp_path: Path) -> None:
    stored = furnished_map(sounds=sounds_of([WALK[3:8]], [0.9]), keyframes=keyframes_at(WALK))
    assert colours_in(save(draw_map(stored), tmp_path / "map.png")) > 20


@pytest.mark.nightly
def test_an_empty_map_can_be_drawn(tmp_path: Path) -> None:
    stored = fake_map(voxels_of(np.zeros((0, 3)), np.zeros((0, 4))), encoders=furnished_map().encoders)
    assert save(draw_map(stored), tmp_path / "map.png").is_file()
    assert asked(stored).sound("dog").plot(tmp_path / "dog.png").is_file()


def test_a_picture_of_an_unknown_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(QueryError, match=r"^A picture cannot be written as 'x\.doc'; give it the suffix \.png, "):
        save(draw_map(furnished_map()), tmp_path / "x.doc")


def test_the_colour_from_above_is_that_of_the_highest_voxels_under_the_ceiling() -> None:
    low, top, ceiling = box((0, 0, 0), (4, 4, 1)), box((0, 0, 10), (2, 2, 13)), box((0, 0, 60), (4, 4, 61))
    voxels = voxels_of(np.concatenate([low, top, ceiling]), np.zeros((16 + 12 + 16, 1)))
    rgb = np.zeros((len(voxels), 3), np.uint8)
    for colour, height in ((10, 0), (200, 10), (200, 11), (200, 12), (255, 60)):
        rgb[voxels.index[:, 2] == height] = colour
    stored = fake_map(type(voxels)(voxels.index, voxels.feature, voxels.weight, rgb, voxels.last_seen_s, voxels.hits))
    stored.data.keyframes = keyframes_at(np.array([[0.1, 0.1, 1.4]]))
    view = TopDown.of(Space(GridSpec(0.05), voxels.index, UP, stored.data))
    seen = view.rgb[view.seen].reshape(4, 4, 3)[..., 0]
    np.testing.assert_array_equal(seen, [[200, 200, 10, 10], [200, 200, 10, 10], [10] * 4, [10] * 4])
    values = np.zeros(len(voxels), np.float32)
    values[0] = 0.7
    assert view.heat(values).max() == np.float32(0.7)
    assert view.extent == pytest.approx((-0.3, 0.5, -0.3, 0.5))


def brightest(figure: Figure) -> float:
    """How bright the brightest heat is that a figure shows, whatever its opacity."""
    layers = [image for ax in figure.axes for image in ax.images if np.asarray(image.get_array()).shape[-1] == 4]
    return max(float(np.asarray(layer.get_array())[..., :3].sum(axis=-1).max()) for layer in layers) / 3.0


def test_what_was_not_found_is_drawn_as_dark_as_it_is_unsure() -> None:
    m = furnished_map()
    sure, unsure = m.object("chair", primary=True), m.object("chair", primary=True)
    assert sure.found
    factor = unsure.factors[0]
    assert isinstance(factor, NearThings)
    factor = replace(factor, confidence=0.2 * factor.confidence, found=False)
    unsure = Heatmap.of(factor)
    assert unsure.peak == pytest.approx(1.0), "the heat itself is the paper's"
    assert unsure.shown.max() == pytest.approx(0.2 * sure.shown.max())
    assert unsure.shown.max() == pytest.approx(unsure.goals(1)[0].score, abs=1e-3), "a picture and a score agree"
    assert brightest(unsure.plot()) < 0.5 * brightest(sure.plot())
    texts = [text.get_text() for text in unsure.plot().findobj(Text)]
    assert HEAT_LABEL in texts and "confidence" in HEAT_LABEL
    assert any("not found, at most 0." in text for text in texts)


def test_each_thing_is_drawn_by_its_own_confidence_and_a_product_by_that_of_what_is_sought() -> None:
    m = furnished_map(sounds=sounds_of([WALK[3:8]], [0.9]), keyframes=keyframes_at(WALK))
    factor = m.object("chair", primary=True).factors[0]
    assert isinstance(factor, NearThings)
    along_x = m.data.voxels.index[factor.mask][:, 0]
    split = (along_x > np.median(along_x)).astype(int)
    factor = replace(factor, instance=split, confidence=np.array([1.0, 0.25]), with_uncertain=None)
    shown = factor.shown[factor.mask]
    np.testing.assert_allclose(shown, np.where(split == 1, 0.25, 1.0), atol=1e-6)
    both = Heatmap.of(factor) * m.sound("dog")
    rows = np.flatnonzero(factor.mask)
    np.testing.assert_allclose(both.shown[rows], both.values[rows] * shown, atol=1e-6)
    assert (both.shown <= both.values).all()


def test_a_photo_that_is_only_guessed_is_no_certainty() -> None:
    part = Part(Modality.IMAGE, "photo.jpg", Role.PRIMARY, is_file=True)
    space = furnished_map().object("chair").space
    located = SimpleNamespace(world_from_camera=None, guess=np.eye(4), inliers=9, score=0.3, notes=(), elsewhere=None)
    factor = image_factor(space, located, part, HeatSettings())  # pyright: ignore[reportArgumentType]
    assert not factor.found
    assert Heatmap.of(factor).goals(1)[0].score == pytest.approx(0.3, abs=1e-3)
    assert factor.shown.max() <= 0.3
    located.world_from_camera = np.eye(4)
    assert Heatmap.of(image_factor(space, located, part, HeatSettings())).goals(1)[0].score == 1.0  # pyright: ignore


def test_names_of_things_are_drawn_over_the_map(tmp_path: Path) -> None:

    opened = furnished_map()
    plain = cv2.imread(str(save(draw_map(opened), tmp_path / "plain.png")))
    named = cv2.imread(str(save(draw_map(opened, opened.things(least_confidence=0.0)), tmp_path / "named.png")))
    assert 100 < (plain != named).any(axis=2).sum() < 0.05 * plain.shape[0] * plain.shape[1]


def test_goals_that_crowd_have_their_numbers_apart() -> None:
    crowd = [np.array(place) for place in ((0.0, 0.0, 0.7), (0.04, -0.31, 0.4), (-0.26, 0.14, 0.3))]
    far = np.array([6.0, 2.0, 0.5])
    # A point is 1/72 inch, and a metre of a map that fills a panel of 3.5 inches some 20 points.
    written = [place[:2] * 20.0 + aside(place, [*crowd, far]) for place in crowd]
    apart = [np.linalg.norm(a - b) for i, a in enumerate(written) for b in written[:i]]
    assert min(apart) > 12.0, "a bubble is 12 points wide"
    assert aside(far, [*crowd, far]) == (9.0, 9.0)
