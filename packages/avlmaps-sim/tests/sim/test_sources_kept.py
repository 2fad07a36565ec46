"""Maps that were merged, moved to corrected poses or made live know where their sounds came from as well."""

import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import QueryError
from avlmaps.core.poses import apply
from avlmaps.days.merge import joined_sources, merge_maps
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import replay
from avlmaps.live.status import LiveSettings
from avlmaps.maps.corrected import correct_map
from avlmaps.maps.sources.candidates import CandidateGrid, Density
from avlmaps.maps.sources.correlation import SourceSettings
from avlmaps.maps.store.folder import write
from avlmaps.maps.types import SourceEvidence
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from helpers.heard_flat import heard_flat

pytestmark = pytest.mark.nightly  # the recording and the map are made by the first of the modules that need them


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a recording of a flat with an array, and its map with submaps."""
    return heard_flat(tmp_path_factory)


@pytest.fixture
def copy(heard: tuple[Path, Path], tmp_path: Path) -> AVLMap:
    """Return the map in a folder of its own."""
    shutil.copytree(heard[1], tmp_path / "copy.avlmap")
    return AVLMap.open(tmp_path / "copy.avlmap")


def places(sources: SourceEvidence | None) -> np.ndarray:
    """Return the likeliest place on the plan of each sound alone."""
    assert sources is not None
    plan, prior = CandidateGrid.of(sources.place), sources.prior.astype(np.float64)
    settings = SourceSettings.of(int(sources.channels[0]))
    found = [
        Density.of(plan, prior, heard.astype(np.float64) + expected, expected.astype(np.float64), settings).position_m
        for heard, expected in zip(sources.heard, sources.expected, strict=True)
    ]
    return np.array(found).reshape(-1, 2)


def without_sources(stored: AVLMap) -> AVLMap:
    write(stored.path, replace(stored.data, sources=None))
    return AVLMap.open(stored.path)


def test_a_live_map_ends_with_the_sources_of_the_build(heard: tuple[Path, Path], tmp_path: Path) -> None:
    recording, built = open_recording(heard[0]), AVLMap.open(heard[1])
    assert recording.audio is not None
    live = LiveMap(
        tmp_path / "live.avlmap", "synthetic", up_in_world=recording.up_in_world, live=LiveSettings(gates=False),
        microphones=recording.audio.microphones,
    )  # fmt: skip
    replay(recording, live, rate=None)
    meanwhile = sources_of_all_sounds(live)
    saved = sources_of_a_save(live)
    live.close()
    after = AVLMap.open(live.path)
    assert np.array_equal(after.data.sounds.onset_s, built.data.sounds.onset_s)
    assert np.allclose(places(after.data.sources), places(built.data.sources), atol=0.05), "within a voxel"
    # The last sound may end with the track, and is listed only then.
    apart = [np.linalg.norm(places(after.data.sources) - place, axis=1).min() for place in places(meanwhile)]
    assert np.median(apart) < 0.3
    assert len(saved) > 0 and saved.channels[0] == 4


def sources_of_all_sounds(live: LiveMap, seconds: float = 120.0) -> SourceEvidence:
    """Wait until a snapshot has located all of its sounds."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        arrays = live.map.data if live.generation else None
        found = None if arrays is None or arrays.sources_wait else arrays.sources
        if found is not None and found.heard.any(axis=1).all():
            return found
        time.sleep(0.05)
    raise AssertionError("no sound was located")


def sources_of_a_save(live: LiveMap, seconds: float = 120.0) -> SourceEvidence:
    """Wait until the folder, which a kill would leave, has sources."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        if (live.path / "map.json").is_file() and (found := AVLMap.open(live.path).data.sources) is not None:
            return found
        time.sleep(0.05)
    raise AssertionError("no save has sources")


def test_sources_move_with_corrected_poses(heard: tuple[Path, Path], copy: AVLMap) -> None:
    recording, before = open_recording(heard[0]), places(copy.data.sources)
    turn = np.eye(4)
    turn[:2, :2], turn[:2, 3] = [[0.0, -1.0], [1.0, 0.0]], [3.0, 1.0]
    poses = turn @ np.asarray(recording.world_from_camera)
    correct_map(copy.path, recording.stamps_s, poses, recording)
    moved = AVLMap.open(copy.path)
    wanted = apply(turn, np.column_stack([before, np.zeros(len(before))]))[:, :2]
    apart = np.linalg.norm(places(moved.data.sources) - wanted, axis=1)
    assert np.median(apart) < 0.2
    correct_map(copy.path, recording.stamps_s, poses)
    lost = AVLMap.open(copy.path)
    assert lost.data.sources is None, "old evidence does not fit new poses"


@pytest.fixture
def another_day(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take a copy of a map for one of another drive."""
    monkeypatch.setattr("avlmaps.days.find.require_another_drive", lambda *_: None)


@pytest.mark.usefixtures("another_day")
def test_a_merged_map_has_the_sources_of_both_days(heard: tuple[Path, Path], copy: AVLMap, tmp_path: Path) -> None:
    first = AVLMap.open(heard[1])
    merged = merge_maps(first, copy, tmp_path / "both.avlmap", day="2026-11-24", first_day="2026-11-23")
    both, one = merged.data.sources, places(first.data.sources)
    assert both is not None and len(both) == 2 * len(one) == len(merged.data.sounds)
    apart = np.linalg.norm(places(both) - np.concatenate([one, one]), axis=1)
    assert np.median(apart) < 0.2
    rows = [row for thing in merged.contents().things for row in thing.heard]
    assert all(row.get("when", {}).get("day") in ("2026-11-23", "2026-11-24") for row in rows)
    known = merged
    for visit, day in enumerate(("2026-11-23", "2026-11-24"), 1):
        then = known.things(at=day)
        rows = [row for thing in then for row in thing.heard]
        assert rows and all(row.get("when") == {"visit": visit, "day": day} for row in rows)
        onsets = np.asarray(merged.data.sounds.onset_s)
        assert all(np.abs(onsets - row["onset_s"]).min() < 1e-6 for row in rows)
        speaking = next(thing for thing in then if thing.heard)
        (alone, *_) = (one for one in known.things([speaking.name], at=day) if one.position == speaking.position)
        assert alone.heard == speaking.heard  # what is not listed may have made the sound as well


@pytest.mark.usefixtures("another_day")
def test_a_merge_says_why_it_does_not_know(heard: tuple[Path, Path], copy: AVLMap, tmp_path: Path) -> None:
    first = AVLMap.open(heard[1])
    bare = without_sources(copy)
    found, why = joined_sources(first, bare, np.eye(4), first.data.voxels, first.data.keyframes)
    assert found is None and "copy.avlmap" in why and "without the places of its microphones" in why
    own = first.data.sources
    assert own is not None
    stereo = replace(own, channels=np.array([2], np.int64))
    write(copy.path, replace(bare.data, sources=stereo))
    found, why = joined_sources(first, AVLMap.open(copy.path), np.eye(4), first.data.voxels, first.data.keyframes)
    assert found is None and "4 microphones" in why and "2" in why
    merged = merge_maps(first, AVLMap.open(copy.path), tmp_path / "both.avlmap", things_of=lambda _: [])
    assert why in merged.data.info.notices
    with pytest.raises(QueryError, match="merge them again"):
        merged.sources()
