"""The pictures of the guide, made by a session that is clicked through: look, ask, go there, from above, two maps.

By itself it runs on the small room and writes nothing that stays. ``make pictures`` gives it the map of `avlmaps demo`
(AVLMAPS_VIEW_MAP) and the folder of the guide's pictures (AVLMAPS_VIEW_PICTURES).
"""

import os
from itertools import pairwise
from pathlib import Path

import pytest
from test_browser import browser, opened  # noqa: F401 - a fixture

from avlmaps.query.avlmap import AVLMap
from helpers.viewing import decoded, serving

pytestmark = [pytest.mark.browser, pytest.mark.nightly]
PICTURES = ("view-map", "view-query", "view-above", "view-things")


def shoot(page, path: Path) -> None:
    page.wait_for_selector("#canvas[data-state=whole]")
    page.screenshot(path=path)


def ask(page, question: str) -> None:
    page.fill("#sentence", question)
    page.keyboard.press("Enter")
    page.wait_for_selector("#answer .verdict.found")


def colours_of(page) -> list[str]:
    return page.locator("#legend li:not(.source) i").evaluate_all(
        "all => all.map((e) => getComputedStyle(e).backgroundColor)"
    )


def test_the_guide_is_clicked_through(browser, room: AVLMap, tmp_path: Path) -> None:  # noqa: F811
    given = os.environ.get("AVLMAPS_VIEW_MAP")
    folder = Path(os.environ.get("AVLMAPS_VIEW_PICTURES") or tmp_path)
    avlmap = AVLMap.open(given) if given else room
    things = avlmap.things()
    wanted = next((one.name for one in things if one.name in ("sofa", "bed")), things[0].name)
    for server in serving(avlmap.path):
        page = opened(browser, server.url, 1280, 800)
        shoot(page, folder / "view-map.png")
        ask(page, f"the {wanted}")
        assert page.locator("#goals li").count() >= 1
        shoot(page, folder / "view-query.png")
        page.click("#clear")
        page.click("#above")
        shoot(page, folder / "view-above.png")
        page.select_option("#colour", "thing")
        page.click("#whole")
        assert len(colours_of(page)) == len({thing.name for thing in things})
        shoot(page, folder / "view-things.png")
        if page.locator(".mark.source").count():
            page.select_option("#colour", "picture")
            page.click("#above")
            page.locator(".mark.source").first.dispatch_event("click")
            shoot(page, folder / "view-sources.png")
        page.locator("details:has(#things) summary").click()
        page.locator("#things button").first.click()
        assert page.evaluate("avlmapsView.viewer.camera.distance") <= 3.0 and page.faults == []
        page.close()
        phone = opened(browser, server.url, 390, 780)
        ask(phone, f"the {wanted}")
        phone.evaluate("scrollTo(0, 0)")
        shoot(phone, folder / "view-phone.png")
        assert phone.faults == []
        phone.close()
    shots = [decoded(folder / f"{name}.png") for name in PICTURES]
    assert all(shot.shape == (800, 1280, 3) for shot in shots)
    for one, other in pairwise(shots):
        assert (one != other).any(axis=2).mean() > 0.02, "each picture shows something else"
