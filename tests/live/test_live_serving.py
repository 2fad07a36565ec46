"""A live map is served while it grows: a query sees a snapshot, and the next one the newer one."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest
from live_frames import ENCODERS, UP, add, frame, recorded, wait_for, within
from starlette.testclient import TestClient

from avlmaps.cli.live import live_source, serve_while
from avlmaps.live.live_map import LiveMap
from avlmaps.live.status import LiveSettings
from avlmaps.maps.store.folder import read
from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service

CHOSEN = LiveSettings(first_frames=2, snapshot_s=0.0, new_share=0.0)


def test_the_server_takes_each_snapshot_and_the_end(tmp_path: Path) -> None:
    notes: list[str] = []
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=CHOSEN) as live:
        for number in range(4):
            add(live, frame(number))
        wait_for(lambda: live.generation >= 1)
        service = Service.open({"live": live_source(live)}, note=notes.append)

        def voxels() -> int:
            (one,) = client.get("/maps").json()["maps"]
            return one["voxels"]

        with TestClient(create_app(service, agents=False), base_url="http://127.0.0.1:8750") as client:
            first = voxels()
            assert client.get("/maps/live/view").status_code == 200
            for number in range(4, 30):
                add(live, frame(number))
            wait_for(lambda: voxels() > first)
            live.close()
            wait_for(lambda: voxels() == len(live.map.points))
        service.close()
    assert notes == []


def test_a_drive_that_fails_says_so_and_raises_where_it_is_waited_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=CHOSEN)
    for number in range(4):
        add(live, frame(number))
    wait_for(lambda: live.generation >= 1)

    def fails(over: object) -> None:
        raise ZeroDivisionError("nothing is left")

    monkeypatch.setattr("avlmaps.cli.view.run_page", lambda service, *_: service.close())
    with pytest.raises(ZeroDivisionError):
        within(60.0, lambda: serve_while(live, fails, 0, browse=False))
    assert "no frame comes any more; stop with Ctrl-C. nothing is left" in capsys.readouterr().err
    add(live, frame(4))
    live.close()


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="a signal of POSIX ends it")
def test_the_command_serves_until_it_is_stopped(tmp_path: Path) -> None:
    recorded(tmp_path / "rec", 20)
    words = ["live", tmp_path / "rec", "--out", tmp_path / "map", "--profile", "colours", "--serve", "--port", "0"]
    process = subprocess.Popen(
        [sys.executable, "-m", "avlmaps", *map(str, words)], stderr=subprocess.PIPE, text=True, env=dict(os.environ)
    )
    assert process.stderr is not None
    said, url, over = "", None, False
    while not (url and over):
        said += (line := process.stderr.readline())
        assert line, said
        url, over = url or re.search(r"http://\S+/view", said), over or "The drive is over" in said
    with urlopen(url[0]) as page:
        assert page.status == 200
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    process.stderr.close()
    assert len(read(tmp_path / "map").voxels) > 0
