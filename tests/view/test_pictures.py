"""The pictures of the guide, made by a session that is clicked through: look, ask, go there, from above, two maps.

By itself it runs on the small room and writes nothing that stays. ``make pictures`` gives it the map of `avlmaps demo`
(AVLMAPS_VIEW_MAP) and the folder of the guide's pictures (AVLMAPS_VIEW_PICTURES).
"""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from test_browser import browser, opened  # noqa: F401 - a fixture

from avlmaps.query.avlmap import AVLMap
from avlmaps.view.session import ViewSession
from helpers.viewing import serving

pytestmark = pytest.mark.browser
PICTURES = ("view-map", "view-query", "view-above", "view-things")


def colours_of(page) -> list[str]:
    return page.locator("#legend li i").evaluate_all("all => all.map((e) => getComputedStyle(e).backgroundColor)")


def test_the_guide_is_clicked_through(browser, room: AVLMap, tmp_path: Path) -> None:  # noqa: F811
    given = os.environ.get("AVLMAPS_VIEW_MAP")
    folder = Path(os.environ.get("AVLMAPS_VIEW_PICTURES") or tmp_path)
    avlmap = AVLMap.open(given) if given else room
    things = avlmap.things()
    for server in serving(ViewSession([avlmap])):
        page = opened(browser, server.url, 1280, 800)

        def shoot(name: str) -> None:
            page.wait_for_selector("#canvas[data-state=whole]")
            page.screenshot(path=folder / f"{name}.png")  # noqa: B023 - used at once

        shoot("view-map")
        wanted = next((one.name for one in things if one.name in ("sofa", "bed")), things[0].name)
        page.fill("#sentence", f"the {wanted}")
        page.keyboard.press("Enter")
        page.wait_for_selector("#answer .verdict.found")
        assert page.locator("#goals li").count() >= 1
        shoot("view-query")
        page.click("#clear")
        page.click("#above")
        shoot("view-above")
        page.select_option("#colour", "thing")
        page.click("#whole")
        assert len(colours_of(page)) == len({thing.name for thing in things})
        shoot("view-things")
        page.locator("details:has(#things) summary").click()
        page.locator("#things button").first.click()
        assert page.evaluate("avlmapsView.viewer.camera.distance") <= 3.0
        assert page.faults == []
        page.close()
        phone = opened(browser, server.url, 390, 780)
        phone.fill("#sentence", f"the {wanted}")
        phone.keyboard.press("Enter")
        phone.wait_for_selector("#answer .verdict.found")
        phone.wait_for_selector("#canvas[data-state=whole]")
        phone.evaluate("scrollTo(0, 0)")
        phone.screenshot(path=folder / "view-phone.png")
        assert phone.faults == []
        phone.close()
    shots = [cv2.imread(str(folder / f"{name}.png")) for name in PICTURES]
    assert all(shot.shape == (800, 1280, 3) for shot in shots)
    for one, other in zip(shots, shots[1:], strict=False):
        assert (np.asarray(one) != other).any(axis=2).mean() > 0.02, "each picture shows something else"
