"""A user's session in a real browser, judged by what is on the screen: open, ask, see the goal, click, cut, drive."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from avlmaps.maps.store.edits import read_edits
from avlmaps.query.avlmap import AVLMap
from avlmaps.view.page import write_page
from helpers.viewing import Served, decoded, serving

pytestmark = pytest.mark.browser
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# Software rendering, and no request of its own.
_ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run", "--mute-audio",
]  # fmt: skip


@pytest.fixture(scope="module")
def browser() -> Iterator:
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright, which drives the browser")
    found = os.environ.get("AVLMAPS_BROWSER") or next(filter(None, map(shutil.which, _BROWSERS)), None)
    if found is None:
        pytest.skip("needs Chromium (apt install chromium), or its path in AVLMAPS_BROWSER")
    with sync_api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=found, args=_ARGUMENTS, timeout=120_000)
        yield opened
        opened.close()


def opened(browser, url: str, width: int = 1000, height: int = 640):
    page = browser.new_page(viewport={"width": width, "height": height}, reduced_motion="reduce")
    page.faults = []
    page.on("pageerror", lambda fault: page.faults.append(str(fault)))
    page.set_default_timeout(60_000)
    page.goto(url)
    page.wait_for_selector("html[data-ready]", state="attached")
    return page


def picture(page) -> np.ndarray:
    """Return the map's canvas as it is on the screen, RGB, once all voxels are drawn; nothing lies over it."""
    page.wait_for_selector("#canvas[data-state=whole]")
    over = "#overlay *, #tools, #scale, #legend"
    page.add_style_tag(content=f"{over} {{ opacity: 0 !important; pointer-events: none !important }}")
    return decoded(page.locator("#canvas").screenshot())


def until(page, condition: str, patience_s: float = 60.0) -> None:
    """Wait until an expression of JavaScript is true.

    Playwright's own `wait_for_function` looks again by `eval` within the page, which the page's policy refuses.
    """
    end = time.monotonic() + patience_s
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"{condition} never held"
        page.wait_for_timeout(20)


def asked(page, sentence: str = "the red thing", until: str = "#answer .verdict.found") -> None:
    page.fill("#sentence", sentence)
    page.keyboard.press("Enter")
    page.wait_for_selector(until, state="attached")


def goal_at(page) -> tuple[float, float]:
    """Return the middle of the best goal's number on the screen."""
    box = page.locator(".mark.goal", has_text="1").first.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def coloured(shown: np.ndarray) -> float:
    """Return the share of pixels with a clear colour."""
    return float((np.ptp(shown.astype(int), axis=2) > 60).mean())


@pytest.fixture
def page(browser, served: Served) -> Iterator:
    one = opened(browser, served.url)
    yield one
    assert one.faults == []
    one.close()


def test_a_question_is_typed_and_its_goal_is_seen(page, room: AVLMap) -> None:
    before = picture(page)
    assert (before != before[0, 0]).any(axis=2).mean() > 0.1, "the map is on the screen"
    page.keyboard.press("/")
    page.keyboard.type("the red thing")
    page.keyboard.press("Enter")
    page.wait_for_selector("#answer .verdict.found")
    goal = room.ask("the red thing").goals[0]
    assert f"{goal.position[0]:.2f}, {goal.position[1]:.2f}, {goal.position[2]:.2f}" in page.inner_text("#goals")
    marker = page.locator(".mark.goal", has_text="1").first
    assert marker.evaluate("element => getComputedStyle(element).visibility") == "visible"
    shown = picture(page)  # the camera has come near by then
    x, y = map(int, goal_at(page))  # the canvas begins at the page's corner
    around = shown[max(0, y - 25) : y + 25, max(0, x - 25) : x + 25]
    assert coloured(around) > 0.03, "there is heat round the goal's number"
    assert coloured(shown) < coloured(around), "and what is not it stays gray"


@pytest.mark.nightly
def test_a_click_names_the_voxel_and_two_clicks_measure(page) -> None:
    asked(page)
    picture(page)
    x, y = goal_at(page)
    page.mouse.click(x, y)
    page.wait_for_selector("#voxel table tr")
    told = page.inner_text("#voxel")
    assert "red" in told and "Last seen at" in told and "saw it" in told
    page.focus("#measure")
    page.keyboard.press("Enter")
    page.mouse.click(x - 8, y)
    page.mouse.click(x + 8, y)
    page.wait_for_selector(".mark.tape >> nth=1", state="attached")
    assert " m; level " in page.inner_text("#length")
    page.keyboard.press("Escape")
    assert page.inner_text("#length") == ""


@pytest.mark.nightly
def test_colours_and_cuts_change_the_picture(page) -> None:
    shots = [picture(page)]
    for name in ("thing", "height"):
        page.select_option("#colour", name)
        shots.append(picture(page))
    assert all((shots[0] != shot).any(axis=2).mean() > 0.03 for shot in shots[1:])
    page.locator("#high").evaluate("e => { e.value = 0.2; e.dispatchEvent(new Event('input')); }")
    cut = picture(page)
    gone = (cut == cut[0, 0]).all(axis=2).mean() - (shots[-1] == cut[0, 0]).all(axis=2).mean()
    assert gone > 0.02, "walls are cut away"


@pytest.mark.nightly
def test_a_photo_is_asked_with_and_a_bad_one_refused(page, room: AVLMap, tmp_path: Path) -> None:
    from avlmaps.view.layout import Layout

    (tmp_path / "there.jpg").write_bytes(Layout(room).thumbnail(3) or b"")
    (tmp_path / "bad.jpg").write_bytes(b"no picture")
    page.set_input_files("#photo", tmp_path / "bad.jpg")
    page.wait_for_selector("#answer .verdict.fault")
    assert "bad.jpg" in page.inner_text("#answer")
    page.set_input_files("#photo", tmp_path / "there.jpg")
    page.wait_for_selector("#answer .verdict:has-text('ready')")
    page.click("#ask button.main")
    page.wait_for_selector("#goals li")
    assert "there.jpg" in page.inner_text("#answer")


@pytest.mark.nightly
def test_a_command_is_planned_and_stepped_through(page) -> None:
    page.locator("#drive-section summary").first.click()
    page.fill("#command", "go to the nearest red thing")
    page.keyboard.press("Enter")
    page.wait_for_selector("#trip .verdict.found")
    assert "move_to" in page.inner_text("#trip pre >> nth=0")
    page.wait_for_selector(".mark.robot", state="attached")
    page.click("#play")
    page.locator("#at").evaluate("e => { e.value = 2; e.dispatchEvent(new Event('input')); }")
    page.click("#step")
    assert page.inner_text("#at-text").startswith("step 3 of ")


@pytest.mark.nightly
def test_controls_have_names_and_the_page_fits_a_phone(browser, served: Served) -> None:
    page = opened(browser, served.url, 390, 780)
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, canvas")].filter((e) => e.offsetParent &&
        !e.closest("#overlay") && !e.ariaLabel && !e.labels?.length && !e.textContent.trim()).map((e) => e.outerHTML)"""
    )
    assert unnamed == [] and page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.locator("#canvas").bounding_box()["height"] > 300
    assert page.faults == []
    page.close()


@pytest.mark.nightly
def test_a_thing_is_renamed_where_it_is_clicked(browser, room: AVLMap, tmp_path: Path) -> None:
    place = Path(shutil.copytree(room.path, tmp_path / "home.avlmap"))
    with contextmanager(serving)(place) as own:
        page = opened(browser, own.url)
        page.wait_for_selector("#things li", state="attached")  # the server knows the things by now
        asked(page, until=".mark.goal")
        picture(page)
        page.mouse.click(*goal_at(page))
        page.fill("#rename input", "zorb")
        page.click("#rename button")
        page.wait_for_selector("#renamed")
        assert "is called zorb from now on (named by a person on " in page.inner_text("#renamed")
        asked(page, "the zorb")
        assert page.faults == []
        page.close()
    assert [edit.name for edit in read_edits(place)] == ["zorb"]


@pytest.mark.nightly
def test_the_file_opens_without_a_server(browser, room: AVLMap, tmp_path: Path) -> None:
    write_page(tmp_path / "room.html", [room], ["the red thing", "the blue thing"])
    page = opened(browser, (tmp_path / "room.html").as_uri())
    requested: list[str] = []
    page.on("request", lambda request: requested.append(request.url))
    page.click("#questions button:has-text('the red thing')")
    page.wait_for_selector("#answer .verdict.found")
    assert coloured(picture(page)) > 0.001
    assert page.locator("#sounds audio").count() == 1
    page.mouse.click(*goal_at(page))
    page.wait_for_selector("#voxel table tr")
    assert "red" in page.inner_text("#voxel")
    assert not [url for url in requested if not url.startswith(("data:", "blob:"))] and page.faults == []
    page.close()


def camera(page) -> dict:
    """Return the view, and whether two points over one another are one point of the picture."""
    return page.evaluate(
        """() => { const { camera } = avlmapsView.viewer, { clipFromLevel } = camera.seen(1.5);
        const seen = (p) => [0, 1].map((row) => [0, 1, 2].reduce((sum, k) => sum + clipFromLevel[4 * k + row] * p[k],
            clipFromLevel[12 + row]) / [0, 1, 2].reduce((sum, k) => sum + clipFromLevel[4 * k + 3] * p[k],
            clipFromLevel[15]));
        const [x, y, z] = camera.target;
        return { numbers: camera.saved(), low: seen([x + 1, y + 1, z]), high: seen([x + 1, y + 1, z + 1]) }; }"""
    )


def edges(shown: np.ndarray) -> np.ndarray:
    """Return the outermost pixels of a picture."""
    return np.concatenate([shown[0], shown[-1], shown[:, 0], shown[:, -1]])


@pytest.mark.parametrize(("width", "height"), [(1300, 420), (390, 780)])
@pytest.mark.nightly
def test_the_whole_map_is_in_the_picture_from_its_side_and_as_a_plan(
    browser, served: Served, width: int, height: int
) -> None:
    page = opened(browser, served.url, width, height)
    for button in ("#whole", "#above"):
        page.focus("#canvas")
        for key in ("ArrowLeft", "ArrowLeft", "ArrowLeft", "+", "+", "w"):
            page.keyboard.press(key)
        page.locator("#canvas").blur()  # its ring would be in the picture
        page.locator(button).evaluate("button => button.click()")  # picture() hides it
        shown = picture(page)
        ground = shown[2, 2]
        assert (edges(shown) == ground).all(), "nothing is cut off"
        rows, columns = np.nonzero((shown != ground).any(axis=2))
        filled = max(np.ptp(rows) / shown.shape[0], np.ptp(columns) / shown.shape[1])
        assert 0.6 < filled < 0.95, "and it is as large as fits"
    seen = camera(page)
    assert seen["low"] == pytest.approx(seen["high"], abs=1e-6), "a plan has no perspective"
    assert seen["numbers"][:2] == pytest.approx([-np.pi / 2, np.pi / 2], abs=1e-3), "x to the right, y up"
    assert page.faults == []
    page.close()


@pytest.mark.nightly
def test_a_reload_brings_back_the_view_and_the_question(page) -> None:
    asked(page)
    page.click("#above")
    page.select_option("#colour", "thing")
    page.locator("#high").evaluate("e => { e.value = 1.0; e.dispatchEvent(new Event('input')); }")
    before = camera(page)["numbers"]
    until(page, "location.hash.includes('colour=thing') && location.hash.includes('cut=')")
    page.reload()
    page.wait_for_selector("#answer .verdict.found")
    assert page.input_value("#sentence") == "the red thing"
    assert camera(page)["numbers"] == pytest.approx(before, abs=2e-3)
    assert page.input_value("#colour") == "thing"
    assert float(page.input_value("#high")) == pytest.approx(1.0, abs=0.03)


@pytest.mark.nightly
def test_a_picture_is_saved(page, tmp_path: Path) -> None:
    asked(page)
    page.wait_for_selector("#canvas[data-state=whole]")
    with page.expect_download() as download:
        page.click("#save")
    download.value.save_as(tmp_path / "map.png")
    assert download.value.suggested_filename == "room.png"
    saved = decoded(tmp_path / "map.png")
    box = page.locator("#canvas").bounding_box()
    larger = saved.shape[1] / box["width"]
    assert max(saved.shape[:2]) >= 3840 and saved.shape[0] > larger * box["height"]
    x, y = (round(larger * value) for value in goal_at(page))
    assert saved[y - 12 : y + 12, x - 12 : x + 12].min() < 60, "the goal's number is in the picture"
    page.wait_for_selector("#canvas[data-state=whole]")
    assert page.evaluate("document.getElementById('canvas').width") == round(box["width"]), "the page is as it was"


@pytest.mark.nightly
def test_the_page_shows_what_was_edited_elsewhere_without_a_reload(browser, room: AVLMap, tmp_path: Path) -> None:
    place = Path(shutil.copytree(room.path, tmp_path / "home.avlmap"))
    with contextmanager(serving)(place) as own:
        page = opened(browser, own.url)
        thing, *_ = room.things()
        AVLMap.open(place).edit.rename(thing.name, "zorb", at=",".join(map(str, thing.position)))
        until(page, "document.documentElement.dataset.renewed !== undefined")
        assert "zorb" in page.locator("#things").text_content()
        assert page.faults == []
        page.close()


@pytest.mark.nightly
def test_two_maps_are_seen_side_by_side_and_one_over_the_other(browser, room: AVLMap) -> None:
    for server in serving(room.path, room.path):
        page = opened(browser, server.url)
        shown = picture(page)
        half = shown.shape[1] // 2
        first, second = (shown[:, part] for part in (slice(0, half), slice(half, 2 * half)))
        assert (first != second).any(axis=2).mean() < 0.02, "the same map under the same view"
        page.select_option("#arrangement", "divided")
        assert (picture(page) != shown).any(axis=2).mean() > 0.1
        asked(page, until="#goals ol >> nth=1")
        assert page.locator("#goals h3").all_inner_texts() == ["Goals in room.avlmap"] * 2
        assert "two places" in page.inner_text("#goals .warning")
        assert page.faults == []
        page.close()
