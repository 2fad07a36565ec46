"""Answers with what is stored beside a large map are those without it, and never come from what is stale."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store import derived
from avlmaps.maps.store.derived import DERIVED
from avlmaps.maps.store.manifest import MapBounds
from avlmaps.maps.store.reader import open_stored
from avlmaps.maps.store.writer import MapContent, write_map
from avlmaps.perception.embedded.codes import features_of
from avlmaps.query import avlmap as avlmap_module
from avlmaps.query import stored_instances
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.room_regions import RoomRegions
from avlmaps.query.rooms import Rooms
from avlmaps.query.voxel_map import VoxelMap
from avlmaps.query.words import EncodedWord
from avlmaps.recordings.open import open_recording
from helpers.walked_room import write_walk

PREPARED = {"names", "rooms", "instances", "kinds"}
ASKED = ("sofa", "the chair near the table in the kitchen", "the biggest room")


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map of a walk, saved from memory."""
    folder = tmp_path_factory.mktemp("base")
    recording = open_recording(write_walk(folder / "rec"))
    grown = VoxelMap(0.1, settings=BuildSettings(voxel_size_m=0.1))
    for frame in list(recording)[::8]:
        grown.add(frame.rgb, frame.depth_m, recording.rig, frame.world_from_camera, frame.stamp_s)
    return grown.save(folder / "base.avlmap").stored.path


@pytest.fixture(autouse=True)
def every_map_is_large() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derived, "LEAST_VOXELS", 1)
        yield


def random_map(base: Path, out: Path, seed: int) -> Path:
    """Write the base with holes, and with things of random names in random boxes."""
    stored, rng = open_stored(base), np.random.default_rng(seed)
    encoder, voxels = stored.encoders.pixels, stored.voxels
    index = np.asarray(voxels.index)
    feature = np.array(voxels.feature)
    for centre in index[rng.integers(0, len(index), 12)]:
        near = np.abs(index - centre).max(axis=1) <= rng.integers(1, 5)
        share = rng.dirichlet(np.full(len(encoder.names), rng.choice([0.01, 0.1])), int(near.sum()))
        feature[near] = features_of(0.5 * share + 0.5 * share[:1], encoder.codes)
    kept = np.flatnonzero(np.abs(index - index[rng.integers(len(index))]).max(axis=1) > 2)
    columns = ("index", "feature", "weight", "rgb", "last_seen_s", "hits")
    changed = replace(voxels, feature=feature)
    fewer = type(voxels)(*(np.asarray(getattr(changed, name))[kept] for name in columns))
    info, structs = stored.info, msgspec.structs
    counts = structs.replace(info.counts, voxels=len(fewer))
    info = structs.replace(
        info, counts=counts, bounding_box_m=MapBounds.of(fewer.index, info.voxel_size_m), build_key=""
    )
    write_map(out, MapContent(fewer, stored.keyframes, stored.place_state, stored.sounds, base / "sounds"), info)
    return out


def told(avlmap: AVLMap, names: tuple[str, ...] = ()) -> list[Any]:
    """Return all that is asked of a map, without the time that it took."""
    contents = avlmap.contents(0.2).to_json("map")
    answers = [avlmap.ask(words).to_dict() for words in (*ASKED, *names)]
    return [contents, *({**answer, "elapsed_ms": 0.0} for answer in answers)]


@pytest.mark.slow
@settings(max_examples=4)
@given(seed=st.integers(0, 2**32 - 1))
def test_answers_are_the_same_with_and_without_what_is_stored(
    base: Path, tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    path = random_map(base, tmp_path_factory.mktemp("map") / "random.avlmap", seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derived, "LEAST_VOXELS", 10**9)
        without = told(AVLMap.open(path))
    assert not (path / DERIVED).exists()
    first = told(AVLMap.open(path))
    assert {file.stem for file in (path / DERIVED).glob("*.json")} == {*PREPARED, "kinds_asked"}
    with pytest.MonkeyPatch.context() as patch:  # nothing is computed again
        patch.setattr(avlmap_module.KnownClosestWords, "of", None)
        patch.setattr(RoomRegions, "of", None)
        patch.setattr(Rooms, "_found", None)
        patch.setattr(AVLMap, "_search", None)
        again = told(AVLMap.open(path))
    assert first == without
    assert again == without


def test_a_map_that_was_built_again_answers_from_itself(base: Path, tmp_path: Path) -> None:
    path = random_map(base, tmp_path / "map.avlmap", 1)
    old = told(AVLMap.open(path))
    kept = {file.name: file.read_bytes() for file in (path / DERIVED).iterdir()}
    random_map(base, path, 2)
    assert not (path / DERIVED).exists()
    (path / DERIVED).mkdir()
    for name, content in kept.items():  # as if somebody had copied them back
        (path / DERIVED / name).write_bytes(content)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derived, "LEAST_VOXELS", 10**9)
        without = told(AVLMap.open(path))
    assert told(AVLMap.open(path)) == without
    assert without != old


def test_names_of_another_vocabulary_are_not_taken(base: Path, tmp_path: Path) -> None:
    path = random_map(base, tmp_path / "map.avlmap", 3)
    told(AVLMap.open(path))
    avlmap = AVLMap.open(path)
    known = avlmap._known_words
    assert known is not None and known.is_whole
    other = replace(known, words=(*known.words[::-1],))
    from avlmaps.query.stored_names import read_closest

    assert read_closest(avlmap.stored, known) is not None
    assert read_closest(avlmap.stored, other) is None
    assert len(EncodedWord.of(avlmap.stored.encoders.pixels, "sofa").rows)


def test_numbers_of_words_that_are_none_are_not_taken(base: Path, tmp_path: Path) -> None:
    from avlmaps.query import stored_names

    path = random_map(base, tmp_path / "map.avlmap", 4)
    avlmap = AVLMap.open(path)
    rivals = avlmap.closest_words()
    closest = [rivals.best, rivals.best_word.copy(), rivals.second, rivals.second_word]
    assert stored_names.read_closest(avlmap.stored, rivals) is not None
    closest[1][0] = len(rivals.words)
    stored_names.write_closest(avlmap.stored, rivals, tuple(closest))
    assert stored_names.read_closest(avlmap.stored, rivals) is None


def test_a_saved_map_is_prepared(base: Path) -> None:
    """As ``base`` was with the limit that maps have; here every map is large."""
    assert not (base / DERIVED).exists()
    AVLMap.open(base).prepare()
    assert {file.stem for file in (base / DERIVED).glob("*.json")} == PREPARED
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(avlmap_module.KnownClosestWords, "of", None)
        patch.setattr(RoomRegions, "of", None)
        AVLMap.open(base).prepare()


def test_a_map_in_memory_has_nothing_stored(base: Path) -> None:
    stored = open_stored(base)
    in_memory = replace(stored, info=msgspec.structs.replace(stored.info, files={}), path=Path("nowhere"))
    assert told(AVLMap(in_memory)) == told(AVLMap.open(base))
    assert not Path("nowhere").exists()


def test_instances_that_are_none_are_not_taken(base: Path, tmp_path: Path) -> None:
    avlmap = AVLMap.open(random_map(base, tmp_path / "map.avlmap", 5)).prepare()
    known, count = avlmap._searched(), len(avlmap.space)
    searches = list(known)
    arrays = stored_instances._to_arrays(list(known.values()))
    assert stored_instances._from_arrays(arrays, len(searches), count) is not None
    assert len(arrays["rows"])
    for name, at, wrong in (("rows", 0, count), ("rows", 0, -1), ("instance", 0, 10**6), ("confidence", 0, 1.5)):
        other = {**arrays, name: arrays[name].copy()}
        other[name][at] = wrong
        assert stored_instances._from_arrays(other, len(searches), count) is None
    assert stored_instances._from_arrays(arrays, len(searches) + 1, count) is None


def test_a_search_of_stored_instances_ends_where_its_watch_says_so(base: Path, tmp_path: Path) -> None:
    path = random_map(base, tmp_path / "map.avlmap", 6)

    def watch(stage: str, done: int, total: int) -> None:
        assert (stage, total > 50) == ("things", True)
        if done == 3:
            raise TimeoutError

    with pytest.raises(TimeoutError):
        AVLMap.open(path).things(watch=watch)
    assert AVLMap.open(path).things(structure=True)
