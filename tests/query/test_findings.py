"""What a build finds by the names of its encoders is stored with the map, and answers as if it were found anew."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.maps.store.folder import damaged_files, write
from avlmaps.query.avlmap import AVLMap, with_findings
from avlmaps.query.room_regions import RoomRegions
from avlmaps.query.rooms import Rooms
from avlmaps.query.settings import AreaSettings, QuerySettings
from helpers.office import office_of


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The office without findings, and with them."""
    bare = office_of(tmp_path_factory)
    found = Path(shutil.copytree(bare, tmp_path_factory.mktemp("found") / "office.avlmap"))
    m = AVLMap.open(found)
    write(found, with_findings(m.data, m.encoders))
    return bare, found


def test_a_map_with_findings_answers_as_one_without(paths: tuple[Path, Path]) -> None:
    bare, found = (AVLMap.open(path) for path in paths)
    assert found.data.findings and not bare.data.findings and not damaged_files(paths[1])
    one, other = bare.closest_words(), found.closest_words()
    assert (one.best == other.best).all() and (one.second_word == other.second_word).all()
    assert [(t.name, t.position) for t in bare.things()] == [(t.name, t.position) for t in found.things()]
    assert bare.room_field is not None and found.room_field is not None
    assert np.array_equal(bare.room_field.share, found.room_field.share)
    assert [(room.name, room.position) for room in bare.rooms()] == [
        (room.name, room.position) for room in found.rooms()
    ]
    assert bare.ask("the desk in the office").goals == found.ask("the desk in the office").goals


def test_nothing_is_found_again(paths: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    def again(*_: object) -> None:
        raise AssertionError("found again")

    monkeypatch.setattr("avlmaps.query.words.two_closest", again)
    monkeypatch.setattr(RoomRegions, "of", again)
    monkeypatch.setattr(Rooms, "field", again)
    found = AVLMap.open(paths[1])
    assert found.closest_words() and found.rooms()


def test_what_other_settings_find_is_found_anew(paths: tuple[Path, Path]) -> None:
    others = AreaSettings(rooms=replace(AreaSettings().rooms, thing_weight=0.0))
    bare, found = (AVLMap.open(path, QuerySettings(areas=others)) for path in paths)
    assert bare.room_field is not None and found.room_field is not None
    assert np.array_equal(bare.room_field.share, found.room_field.share)
    usual = AVLMap.open(paths[1]).room_field
    assert usual is not None and not np.array_equal(usual.share, found.room_field.share)


def test_a_map_in_memory_is_asked_with_encoders(paths: tuple[Path, Path]) -> None:
    opened = AVLMap.open(paths[1])
    m = AVLMap(opened.data, opened.encoders, edits=())
    assert m.data is opened.data and m.encoders is opened.encoders
    assert m.ask("the desk in the office").goals == opened.ask("the desk in the office").goals
