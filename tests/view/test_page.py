"""The page as one file: it holds all it needs, asks nobody, and no text of a map can break out of it."""

import base64
import gzip
import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import QueryError
from avlmaps.query.avlmap import AVLMap
from avlmaps.view.labels import MapOnPage
from avlmaps.view.layout import Layout, as_bytes
from avlmaps.view.page import _page, default_questions, live_page, write_page


@pytest.fixture(scope="module")
def page(room: AVLMap, tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("page") / "room.html"
    told = write_page(out, [room], ["the red thing", "how many red things are there"])
    assert told["bytes"] == out.stat().st_size and [one["found"] for one in told["questions"]] == [True, True]
    return out.read_text(encoding="utf-8")


def told_by(page: str) -> dict:
    return json.loads(re.findall(r'<script type="application/json" id="told">(.*?)</script>', page, re.DOTALL)[0])


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(gzip.decompress(base64.b64decode(text)), np.uint8)


def test_nothing_is_loaded_from_elsewhere(page: str) -> None:
    document = re.sub(r'<script type="application/json".*?</script>', "", page, flags=re.DOTALL)
    assert not re.findall(r"(?:src|href)=[\"'](?!data:|#)", document)
    assert "://" not in document, "no address at all"
    assert "connect-src &#x27;none&#x27;" in page and b"connect-src &#x27;self&#x27;" in live_page()


def test_the_policy_allows_the_pages_own_script_alone(page: str) -> None:
    script = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    assert len(script) == 1
    digest = base64.b64encode(hashlib.sha256(script[0].encode()).digest()).decode()
    assert f"script-src &#x27;sha256-{digest}&#x27;" in page


def test_the_file_holds_the_map_and_the_heat_of_each_question(page: str, room: AVLMap) -> None:
    told, layout = told_by(page), Layout(room)
    np.testing.assert_array_equal(unpacked(told["records"][0]), np.frombuffer(layout.records, np.uint8))
    assert len(unpacked(told["labels"][0])) == 4 * len(layout)
    first = told["questions"][0]
    assert first["question"] == "the red thing"
    heat = room.ask("the red thing").heat
    assert heat is not None
    np.testing.assert_array_equal(unpacked(first["heat"]), np.frombuffer(as_bytes(heat.shown[layout.order]), np.uint8))
    assert base64.b64decode(told["clips"][0][0])[:4] == b"fLaC"
    assert len(told["pictures"][0]) == len(room.data.keyframes)


def test_a_text_cannot_end_the_script_or_stand_for_another_part(room: AVLMap, tmp_path: Path) -> None:
    write_page(tmp_path / "{{script}}<script>.html", [room], ["the red thing"])
    for text in ("</script><script>alert(1)</script>", "{{style}}", "<!--"):
        made = _page(text, {"questions": [text]})
        assert told_by(made) == {"questions": [text]}
        assert made.count("<script") == 2 and "<title>" in made


def test_of_a_large_map_a_file_shows_a_part_and_asks_what_fits(
    room: AVLMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avlmaps.view.page.MOST_VOXELS", len(room.space) - 1)
    told = write_page(tmp_path / "page.html", [room])
    assert told["voxels"] == [len(room.space) - 1]
    assert len(told["questions"]) == len(default_questions(MapOnPage(room).labels)) > 1


def test_a_file_that_cannot_be_written_is_one_sentence(room: AVLMap, tmp_path: Path) -> None:
    with pytest.raises(QueryError, match="cannot be written"):
        write_page(tmp_path / "missing" / "page.html", [room], ["the red thing"])
    with pytest.raises(QueryError):
        write_page(tmp_path / "page.html", [room], ["near near"])
    assert not list(tmp_path.iterdir())
