"""The viewer at a size: first picture, heat after a query, frame times, and memory over many queries.

    python benchmarks/view.py home.avlmap --voxels 1000000 --queries 2000

The map is laid out beside itself until it has as many voxels. The browser is Chromium with software rendering.
"""

import argparse
import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import uvicorn
from playwright.sync_api import Page, sync_playwright

from avlmaps.maps.types import Voxels
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service, listening_socket
from avlmaps.serve.settings import Limits, ServeSettings
from avlmaps.view.on_page import TOP

ARGUMENTS = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--mute-audio",
             "--disable-background-networking", "--disable-component-update",
             "--enable-precise-memory-info"]  # fmt: skip


def enlarged(path: Path, count: int) -> AVLMap:
    """Return the map laid side by side along x until it has ``count`` voxels, in memory."""
    stored = AVLMap.open(path).stored
    voxels = stored.voxels
    span = int(np.ptp(np.asarray(voxels.index)[:, 0])) + 10
    copies = -(-count // len(voxels))
    shifted = [np.asarray(voxels.index) + np.array([span * k, 0, 0], np.int32) for k in range(copies)]
    many = Voxels(
        np.concatenate(shifted)[:count].astype(np.int32),
        *(np.concatenate(copies * [np.asarray(getattr(voxels, name))])[:count]
          for name in ("feature", "weight", "rgb", "last_seen_s", "hits")),
    )  # fmt: skip
    return AVLMap(replace(stored, arrays=replace(stored.arrays, voxels=many)))


def resident_mb() -> float:
    """Return the memory of this process."""
    line = next(one for one in Path("/proc/self/status").read_text().splitlines() if one.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def heap_mb(page: Page) -> float:
    """Return the memory of the page's script."""
    page.request_gc()
    return page.evaluate("performance.memory.usedJSHeapSize") / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=Path)
    parser.add_argument("--voxels", type=int, default=1_000_000)
    parser.add_argument("--queries", type=int, default=200)
    chosen = parser.parse_args()
    begin = time.perf_counter()
    settings = ServeSettings(port=0, limits=Limits(answer_s=600.0))
    service = Service.open({"map": chosen.map}, settings, warm=False)
    served = service.shelf.get("map")
    served.avlmap = enlarged(chosen.map, chosen.voxels)  # pyright: ignore[reportAttributeAccessIssue]
    _ = served.page.layout.records
    print(f"laid out {chosen.voxels:,} voxels in {time.perf_counter() - begin:.1f} s")
    opened = listening_socket(settings)
    server = uvicorn.Server(uvicorn.Config(create_app(service, tools=()), log_config=None, ws="none"))
    threading.Thread(target=server.run, kwargs={"sockets": [opened]}, daemon=True).start()
    words = ["the sofa", "the chair near the table", "the bed", "the window in the kitchen", "the sound of a phone"]
    for sentence in words:
        served.page.heat_of(served.avlmap.ask(sentence, TOP))
    took = []
    for k in range(40):
        begin = time.perf_counter()
        served.page.heat_of(served.avlmap.ask(words[k % len(words)], TOP))
        took.append(1e3 * (time.perf_counter() - begin))
    print(f"answer and heat in process: median {np.median(took):.0f} ms, p95 {np.percentile(took, 95):.0f} ms")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(300_000)
        page.goto(f"http://127.0.0.1:{opened.getsockname()[1]}/maps/map/view")
        page.wait_for_selector("html[data-drawn]", state="attached")
        print(f"first picture {page.evaluate('document.documentElement.dataset.drawn')} ms after the page began")
        page.wait_for_selector("#loading", state="hidden")
        print(f"all voxels loaded after {page.evaluate('performance.now()'):.0f} ms")
        page.wait_for_selector("html[data-ready]", state="attached")
        page.wait_for_selector("#canvas[data-state=whole]")
        for k in range(60):
            page.evaluate("k => { avlmapsView.viewer.camera.turn(0.05, 0); avlmapsView.viewer.moved(); }", k)
            page.wait_for_timeout(60)
        frames = page.evaluate("avlmapsView.viewer.renderer.frameMs")
        budget = page.evaluate("avlmapsView.viewer.renderer.budget")
        print(f"frames while orbiting: median {np.median(frames):.0f} ms, p95 {np.percentile(frames, 95):.0f} ms, "
              f"{budget:,} voxels each")  # fmt: skip
        waits = []
        before = middle = resident_mb(), heap_mb(page)
        for k in range(chosen.queries):
            told = page.evaluate(
                """async (sentence) => { const begun = performance.now(); const view = avlmapsView;
                await view.ask(sentence); const sent = performance.now();
                await new Promise((done) => { const look = () => !view.viewer.dirty && !view.viewer.renderer.busy()
                  ? done() : requestAnimationFrame(look); look(); });
                return [sent - begun, performance.now() - begun]; }""",
                words[k % len(words)],
            )
            waits.append(told)
            if k == chosen.queries // 2:
                middle = resident_mb(), heap_mb(page)
        after = resident_mb(), heap_mb(page)
        sent, shown = np.median(np.array(waits), axis=0)
        print(f"{chosen.queries} queries in the page: answered after {sent:.0f} ms, on the screen after {shown:.0f} ms")
        print(f"server MB: {before[0]:.0f}, {middle[0]:.0f}, {after[0]:.0f}; page's heap MB: {before[1]:.0f}, "
              f"{middle[1]:.0f}, {after[1]:.0f} (before, half, after)")  # fmt: skip
        browser.close()
    server.should_exit = True
    service.close()


if __name__ == "__main__":
    main()
