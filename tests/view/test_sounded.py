"""Where sounds came from, on the page: regions at their source, rays from where the robot heard it, and the clip."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_browser import browser, opened  # noqa: F401 - a fixture

from avlmaps.maps.store.folder import read, write
from avlmaps.maps.types import SourceEvidence
from avlmaps.navigate.footprint import Outline
from avlmaps.query.avlmap import AVLMap
from avlmaps.view.labels import SHARES, drawn_sources
from helpers.viewing import Served, serving


@pytest.fixture(scope="session")
def sounded(room: AVLMap, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small map, with evidence that its sounds came from near one voxel."""
    stored = read(room.path)
    place = np.asarray(room.points, np.float32)[::3]
    away = np.linalg.norm(place[:, :2] - place[len(place) // 2, :2], axis=1)
    heard = np.tile(-((away / 0.4) ** 2), (len(stored.sounds), 1)).astype(np.float16)
    evidence = SourceEvidence(
        place, np.full(len(place), 1.0 / len(place), np.float32), heard, np.zeros_like(heard),
        np.zeros(len(heard), np.uint8), np.array([4], np.int64),
    )  # fmt: skip
    path = tmp_path_factory.mktemp("sounded") / "room.avlmap"
    write(path, replace(stored, sources=evidence))
    return path


def test_the_regions_hold_the_source_and_the_likelier_is_smaller(sounded: Path) -> None:
    avlmap = AVLMap.open(sounded)
    drawn = drawn_sources(avlmap)
    assert len(drawn) == len(avlmap.sources()) > 0
    for one in drawn:
        x, y, _ = avlmap.space.level(np.array(one["position"]))
        assert [region["probability"] for region in one["regions"]] == list(SHARES)
        spans = []
        for region in one["regions"]:
            outlines = [np.array(corners) for corners in region["outlines"]]
            assert any(Outline(corners[:, :2]).distance_m(np.array([x, y])) == 0.0 for corners in outlines)
            spans.append(np.ptp(np.concatenate(outlines)[:, :2], axis=0).max())
        assert spans[0] <= spans[1]


@pytest.fixture
def served_sounds(sounded: Path) -> Iterator[Served]:
    yield from serving(sounded)


@pytest.mark.nightly
@pytest.mark.browser
def test_a_click_on_a_source_shows_rays_and_plays_its_clip(browser, served_sounds: Served) -> None:  # noqa: F811
    page = opened(browser, served_sounds.url)
    lines = "avlmapsView.viewer.fields[0].lines"
    drawn = len(drawn_sources(served_sounds.service.shelf.get("map0").avlmap))
    assert page.locator(".mark.source").count() == drawn
    assert page.evaluate(f"{lines}.get('sources').length") >= 2 * drawn
    assert page.evaluate(f"{lines}.has('rays')") is False
    page.locator(".mark.source").first.dispatch_event("click")
    assert page.evaluate(f"{lines}.get('rays')[0].places.length") >= 6
    assert page.locator(".mark.source.playing").count() == 1
    assert "50 %" in page.inner_text("#legend") and page.locator("#sources audio").count() == drawn
    page.uncheck("#show-sources")
    assert page.locator(".mark.source").count() == 0 and page.inner_text("#legend") == ""
    assert page.evaluate(f"{lines}.has('rays')") is False and page.faults == []
    page.close()
