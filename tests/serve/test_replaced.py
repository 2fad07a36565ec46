"""A map that is replaced on disk is picked up whole between two queries; the old one answers until then."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from avlmaps.serve.service import Service
from avlmaps.serve.settings import ServeError
from avlmaps.serve.shelf import ServedMap, Shelf, named_maps


@pytest.fixture(scope="module")
def coarse(walk: Path) -> Path:
    """Another map of the same walk."""
    path = walk.parent / "coarse.avlmap"
    build_map(open_recording(walk), path, "colours", BuildSettings(voxel_size_m=0.3), progress=False)
    return path


@pytest.fixture
def place(room: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(room, tmp_path / "home.avlmap"))


def put(new: Path, place: Path) -> None:
    """Put another map into the place, the manifest last, as a build does."""
    shutil.copytree(new, place, dirs_exist_ok=True, ignore=shutil.ignore_patterns("map.json"))
    shutil.copy(new / "map.json", place / "map.json.new")
    (place / "map.json.new").replace(place / "map.json")


def test_the_new_map_answers_after_it_was_opened(place: Path, coarse: Path) -> None:
    notes: list[str] = []
    shelf = Shelf({"home": place}, note=notes.append)
    old = shelf.get("home")
    shutil.rmtree(place)
    shutil.copytree(coarse, place)
    shelf.refresh(wait_s=30.0)
    new = shelf.get("home")
    assert new is not old and new.version != old.version
    assert len(new.avlmap.space) < len(old.avlmap.space)
    assert old.avlmap.ask("the red thing").goals, "who holds the old map goes on with it"
    assert new.avlmap.ask("the red thing").goals and "was replaced" in notes[0]


@pytest.mark.nightly
def test_an_edit_that_is_made_while_the_new_map_is_opened_counts_at_once(
    place: Path, coarse: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shelf = Shelf({"home": place}, warm=False)
    prepare = ServedMap.prepare

    def edit_meanwhile(self: ServedMap) -> None:
        prepare(self)
        assert not self.avlmap.edited  # read, without what comes now
        AVLMap.open(place).edit.pin("zorb pad", (0.5, 0.5, 0.1))
        assert shelf.get("home").avlmap.edited, "the old map knows it meanwhile"

    monkeypatch.setattr(ServedMap, "prepare", edit_meanwhile)
    put(coarse, place)
    shelf.refresh(wait_s=30.0)
    monkeypatch.undo()
    new = shelf.get("home").avlmap
    assert new.data.info.voxel_size_m == 0.3 and new.ask("the zorb pad").found


def test_a_map_that_cannot_be_opened_leaves_the_old_one(place: Path, serving: Callable[..., TestClient]) -> None:
    service = Service.open({"home": place})
    client = serving(service)
    before = client.get("/maps/home/ask?sentence=the+red+thing").json()["goals"]
    manifest = json.loads((place / "map.json").read_text())
    (place / "map.json").write_text(json.dumps({**manifest, "schema_version": 99}))
    service.shelf.refresh(wait_s=30.0)
    assert client.get("/maps/home/ask?sentence=the+red+thing").json()["goals"] == before
    assert client.get("/maps").json()["maps"][0]["stale"] is True
    (place / "map.json").write_text(json.dumps(manifest))
    service.shelf.refresh(wait_s=30.0)
    assert client.get("/maps").json()["maps"][0]["stale"] is False
    service.close()


def test_a_map_that_vanishes_goes_on_answering(place: Path) -> None:
    shelf = Shelf({"home": place})
    held = shelf.get("home")
    assert not shelf.is_stale("home")
    shutil.rmtree(place)
    shelf.refresh(wait_s=1.0)
    assert shelf.get("home") is held and held.avlmap.ask("the red thing").goals
    assert shelf.is_stale("home")


def test_names_come_from_folders_or_are_given(tmp_path: Path) -> None:
    assert list(named_maps([str(tmp_path / "a.avlmap"), f"b={tmp_path / 'a.avlmap'}"])) == ["a", "b"]
    with pytest.raises(ServeError, match="Two maps are called 'a'"):
        named_maps([str(tmp_path / "a.avlmap"), str(tmp_path / "other" / "a.avlmap")])
    with pytest.raises(ServeError, match="cannot be the name"):
        named_maps([str(tmp_path / "a?b.avlmap")])
    with pytest.raises(ServeError, match="needs a map"):
        named_maps([])
