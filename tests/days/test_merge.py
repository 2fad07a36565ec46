"""What is no other day: the same drive again, a day in the future, drives against their order."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from avlmaps.core.errors import MapError
from avlmaps.core.wording import Spelling, options_as
from avlmaps.days import find, merge
from avlmaps.days.find import require_another_drive, visits_of
from avlmaps.maps.build import build_map
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.manifest import Visit
from avlmaps.perception.encoders import encoders_of
from avlmaps.query.avlmap import AVLMap
from maps.build_fakes import SETTINGS, open_walk, register_fakes


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> list[AVLMap]:
    folder, encoders = tmp_path_factory.mktemp("drives"), encoders_of(register_fakes())
    paths = [folder / f"{seed}.avlmap" for seed in range(2)]
    return [AVLMap(build_map(open_walk(seed=k), path, encoders, SETTINGS), path=path) for k, path in enumerate(paths)]


def of_another_file(stored: AVLMap) -> AVLMap:
    """Return a map whose recording has another fingerprint, as where it was driven live or read in another way."""
    recording = msgspec.structs.replace(stored.data.info.recording, fingerprint="0" * 64)
    data = replace(stored.data, info=msgspec.structs.replace(stored.data.info, recording=recording))
    return AVLMap(data, stored.encoders, path=stored.path)


@pytest.mark.parametrize("again", [lambda stored: stored, of_another_file], ids=["itself", "read in another way"])
def test_one_drive_counts_once(drives: list[AVLMap], tmp_path: Path, again: Callable[[AVLMap], AVLMap]) -> None:
    with pytest.raises(MapError, match="the same drive as visit 1"):
        merge.merge_maps(drives[0], again(drives[0]), tmp_path / "twice.avlmap")
    assert not (tmp_path / "twice.avlmap").exists()


def test_another_drive_is_another_one(drives: list[AVLMap]) -> None:
    require_another_drive(drives[0], drives[1], visits_of(drives[0]))


def test_no_day_is_in_the_future(drives: list[AVLMap], tmp_path: Path) -> None:
    with pytest.raises(MapError, match="in the future"):
        merge.merge_maps(drives[0], drives[1], tmp_path / "no.avlmap", first_day="2999-01-01")


@pytest.mark.parametrize(("begins_s", "day"), [(0.0, ""), (1.7e9, "2023-11-14"), (4.2e9, ""), (1.7e12, "")])
def test_a_day_is_that_of_the_clock_where_the_clock_can_be_right(
    drives: list[AVLMap], begins_s: float, day: str
) -> None:
    recording = msgspec.structs.replace(drives[0].data.info.recording, begins_s=begins_s)
    data = replace(drives[0].data, info=msgspec.structs.replace(drives[0].data.info, recording=recording))
    (visit,) = visits_of(AVLMap(data, drives[0].encoders, path=drives[0].path))
    assert visit.day == day


def test_clocks_give_the_order(drives: list[AVLMap], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def at_clocks(stored: AVLMap) -> tuple[Visit, ...]:
        (own,) = visits_of(stored)
        begins_s = 1.7e9 + (7200.0 if stored is drives[0] else 0.0)
        recording = msgspec.structs.replace(own.recording, begins_s=begins_s)
        return (msgspec.structs.replace(own, day="2023-11-14", recording=recording),)

    monkeypatch.setattr(find, "visits_of", at_clocks)
    monkeypatch.setattr(find, "find_other", lambda *_: pytest.fail("the order is checked before the search"))
    with pytest.raises(MapError, match=r"before the map's last drive, by their clocks .*day=DAY"):
        merge.merge_maps(drives[0], drives[1], tmp_path / "no.avlmap")


def test_a_map_that_stands_in_the_way_is_said_as_the_reader_spells(drives: list[AVLMap]) -> None:
    with options_as(Spelling.FLAG), pytest.raises(MapError, match="--overwrite"):
        merge.merge_maps(drives[0], drives[1], drives[0].path)
    assert read(drives[0].path).info.visits == ()
