"""Several recordings become one map: merged in their order, each step once, refused where the place differs."""

import json
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from avlmaps.core.errors import MapError
from avlmaps.days import merge
from avlmaps.days.find import NotTheSamePlaceError
from avlmaps.days.merge import build_together, merged_key
from avlmaps.perception.encoders import encoders_of
from avlmaps.query.avlmap import AVLMap
from helpers.pool_here import Here
from maps.build_fakes import SETTINGS, open_walk, register_fakes

ENCODERS = encoders_of(register_fakes())
WALKS = [partial(open_walk, seed=seed) for seed in range(4)]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a folder where each recording has its map already."""
    folder = tmp_path_factory.mktemp("built")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(merge, "merge_maps", copied)
        build(folder / "all.avlmap")
    return folder / "all-recordings"


@pytest.fixture
def out(built: Path, tmp_path: Path) -> Path:
    shutil.copytree(built, tmp_path / "all-recordings")
    return tmp_path / "all.avlmap"


def copied(stored: AVLMap, other: AVLMap, out: Path, *, overwrite: bool) -> AVLMap:
    """Write what stands for a merged map: the first one, by the key of both."""
    assert overwrite or not out.exists()
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(stored.path, out)
    manifest = json.loads((out / "map.json").read_text())
    manifest["checksum"] = ""
    manifest["build_key"] = merged_key(stored.data.info.build_key, other.data.info.build_key)
    (out / "map.json").write_text(json.dumps(manifest))
    return AVLMap.open(out)


class Merges:
    """Notes which maps are merged, and stops where it is to."""

    def __init__(self, stop_at: int = -1, fault: Exception | None = None) -> None:
        self.made: list[tuple[str, str, str]] = []
        self.stop_at, self.fault = stop_at, fault or KeyboardInterrupt()

    def __call__(self, stored: AVLMap, other: AVLMap, out: Path, *, overwrite: bool) -> AVLMap:
        if len(self.made) == self.stop_at:
            raise self.fault
        self.made.append((stored.path.name, other.path.name, out.name))
        return copied(stored, other, out, overwrite=overwrite)


def build(out: Path, cores: int = 2, **how: Any) -> AVLMap:
    return build_together(WALKS, out, ENCODERS, Here(cores), SETTINGS, **how)


CHAIN = [
    ("0001.avlmap", "0002.avlmap", "first-0002.avlmap"),
    ("first-0002.avlmap", "0003.avlmap", "first-0003.avlmap"),
    ("first-0003.avlmap", "0004.avlmap", "all.avlmap"),
]


def test_recordings_are_merged_in_their_order_and_only_their_maps_stay(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    merges = Merges()
    monkeypatch.setattr(merge, "merge_maps", merges)
    made = build(out)
    assert merges.made == CHAIN and made.path == out
    assert sorted(path.name for path in (out.parent / "all-recordings").iterdir()) == [
        f"{number:04d}.avlmap" for number in range(1, 5)
    ]
    build(out)
    assert merges.made == CHAIN, "a finished map is left as it is"


@pytest.mark.parametrize("at", range(3))
def test_a_run_that_was_stopped_merges_nothing_twice(out: Path, monkeypatch: pytest.MonkeyPatch, at: int) -> None:
    stopped, after = Merges(at), Merges()
    monkeypatch.setattr(merge, "merge_maps", stopped)
    with pytest.raises(KeyboardInterrupt):
        build(out)
    monkeypatch.setattr(merge, "merge_maps", after)
    build(out)
    assert stopped.made + after.made == CHAIN


def test_another_place_is_refused_and_what_was_merged_stays(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused = NotTheSamePlaceError("This is not seen to be the same place: of 12 keyframes 1 were located.")
    monkeypatch.setattr(merge, "merge_maps", Merges(1, refused))
    with pytest.raises(NotTheSamePlaceError, match="of 12 keyframes 1"):
        build(out)
    assert not out.exists() and (out.parent / "all-recordings" / "first-0002.avlmap" / "map.json").is_file()


@pytest.mark.nightly
def test_another_map_is_replaced_only_where_one_says_so(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(merge, "merge_maps", Merges())
    shutil.copytree(out.parent / "all-recordings" / "0003.avlmap", out)
    with pytest.raises(MapError, match="is a finished map already"):
        build(out)
    assert len(build(out, overwrite=True).data.info.build_key) == 64
