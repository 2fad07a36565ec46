"""The page in Firefox, at the width of a desk and of a phone: opened, asked, and the goal is on the screen."""

import os
import shutil
from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from avlmaps.query.avlmap import AVLMap
from helpers.firefox import Firefox
from helpers.viewing import Served

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    program = os.environ.get("AVLMAPS_FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None or shutil.which("Xvfb") is None:
        pytest.skip("needs Firefox and a screen in memory: apt install firefox-esr xvfb libgl1-mesa-dri")
    browser = Firefox(program, tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.mark.parametrize(("width", "height"), [(1000, 720), (500, 900)])
@pytest.mark.nightly
def test_a_question_is_answered_in_firefox(
    firefox: Firefox, served: Served, room: AVLMap, width: int, height: int
) -> None:
    firefox.open(served.url, width, height)
    firefox.wait_for("#canvas[data-state=whole]")
    firefox.write("#sentence", "the red thing\ue007")  # the last key is Enter
    firefox.wait_for("#answer .verdict.found")
    goal = room.ask("the red thing").goals[0]
    assert f"{goal.position[0]:.2f}" in firefox.evaluate("return document.querySelector('#goals').innerText")
    firefox.wait_for("#canvas[data-state=whole]")
    shown = cv2.imdecode(np.frombuffer(firefox.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    box = firefox.evaluate(
        "const b = document.querySelector('#canvas').getBoundingClientRect(); return [b.top, b.bottom, b.left, b.right]"
    )
    top, bottom, left, right = (int(edge) for edge in box)
    canvas = shown[max(top, 0) : bottom, max(left, 0) : right]
    assert (np.ptp(canvas.astype(int), axis=2) > 60).mean() > 0.005, "there is heat on the canvas"
    assert firefox.evaluate("return document.documentElement.scrollWidth <= window.innerWidth")
