"""Words that were seen or heard are data: however they are written, they move nothing and confirm nothing."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.printable import UNSAFE
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.service import Service
from helpers.injected_server import injected_server
from helpers.injections import injections

COUNT = 220


@pytest.mark.nightly
def test_injected_strings_move_nothing_and_confirm_nothing(service: Service, tmp_path: Path) -> None:
    with injected_server(tmp_path, service) as (campaign, driven):
        report = campaign.run(COUNT, seed=1)
        assert report.faults == []
        assert set(report.sent) == set(campaign.ways) and min(report.sent.values()) == COUNT // len(campaign.ways)
        assert driven.machine.motions == 0 and driven.events.count("confirmed") == 0
        assert driven.events.count("refused") + driven.events.count("planned") > 0
        assert not UNSAFE.search(driven.log.read_text(encoding="utf-8").replace("\n", ""))


def test_the_campaign_would_see_a_motion(service: Service, tmp_path: Path) -> None:
    """The counters count: a plan that is confirmed is a motion and an event."""
    with injected_server(tmp_path, service) as (_, driven):
        token = driven.dispatcher.plan("turn left", "", _who())["token"]
        driven.dispatcher.confirm(token, _who())
        while driven.dispatcher.status()["state"] != "idle":
            pass
        assert driven.machine.motions == 1 and driven.events.count("confirmed") == 1


def test_injected_strings_in_a_map_file_reach_no_terminal_as_they_are(room: Path, tmp_path: Path, capsys: Any) -> None:
    """Each text of map.json in turn becomes an injection; the map is refused in one sentence, or described."""
    from avlmaps.cli import main

    copy = tmp_path / "map.avlmap"
    shutil.copytree(room, copy)
    manifest = copy / "map.json"
    content = json.loads(manifest.read_text(encoding="utf-8"))
    texts = list(_texts(content))
    assert len(texts) > 20
    for (holder, key), injected in zip(texts[:60], injections(5), strict=False):
        before = holder[key]
        holder[key] = injected
        manifest.write_text(json.dumps(content), encoding="utf-8")
        holder[key] = before
        try:
            str(AVLMap.open(copy).sounds())
        except AvlmapsError as error:
            assert not UNSAFE.search(str(error))
    injected = json.dumps({**content, "profile": next(injections(6)) + "\x1b[2J"})
    manifest.write_text(injected, encoding="utf-8")
    for words in (["info"], ["things"], ["info", "--json"]):
        try:
            main([words[0], str(copy), *words[1:]])
        except SystemExit:
            said = capsys.readouterr()
            assert not UNSAFE.search((said.out + said.err).replace("\n", ""))


def _texts(value: Any) -> Any:
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in list(pairs):
        if isinstance(one, str):
            yield value, key
        yield from _texts(one)


def _who() -> Any:
    from avlmaps.serve.drive.orders import Who

    return Who("here")
