"""A map that was edited, or put together from two, is refused when it is opened, with the contradiction in words."""

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from build_fakes import SETTINGS, Walk, register_fakes, write_beeps
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import MapError
from avlmaps.maps.build import build_map
from avlmaps.maps.store.manifest import MapInfo
from avlmaps.maps.store.manifest_file import checksum_of, manifest_fault, sources_fault
from avlmaps.maps.store.reader import open_stored
from avlmaps.maps.types import SourceEvidence

PROFILE = register_fakes()


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    audio = write_beeps(folder / "beeps.wav")
    build_map(Walk(42, audio=audio), folder / "walk.avlmap", PROFILE, SETTINGS, progress=False)
    return folder / "walk.avlmap"


@pytest.fixture
def copied(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "walk.avlmap"))


def said_in(path: Path) -> dict[str, Any]:
    return json.loads((path / "map.json").read_text())


def put(path: Path, said: dict[str, Any]) -> None:
    (path / "map.json").write_text(json.dumps(said))


def unsigned(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Write ``map.json`` as a program would that is wrong: of an older release, without a checksum."""
    said = said_in(path)
    change(said)
    said["checksum"] = ""
    said["bytes"] = sum(file["bytes"] for file in said["files"].values())
    put(path, said)


def with_array(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Path], None]:
    """Replace an array by another of the right type, size and checksum."""

    def replace(path: Path) -> None:
        def note(said: dict[str, Any]) -> None:
            file = said["files"][name]
            array = np.ascontiguousarray(change(np.load(path / file["path"])))
            np.save(path / file["path"], array)
            content = (path / file["path"]).read_bytes()
            file.update(bytes=len(content), sha256=hashlib.sha256(content).hexdigest(), shape=list(array.shape))

        unsigned(path, note)

    return replace


def at(*keys: Any, to: Any) -> Callable[[Path], None]:
    """Set one value of ``map.json``; a function is given the value that is there."""

    def change(said: dict[str, Any]) -> None:
        for key in keys[:-1]:
            said = said[key]
        said[keys[-1]] = to(said[keys[-1]]) if callable(to) else to

    return lambda path: unsigned(path, change)


WRONG: dict[str, tuple[Callable[[Path], None], str]] = {
    "voxel size": (at("voxel_size_m", to=0.1), "voxel_size_m is 0.1 and its settings say 0.05"),
    "both voxel sizes": (
        lambda path: (at("voxel_size_m", to=0.1)(path), at("settings", "voxel_size_m", to=0.1)(path)),
        "but its voxels of 0.1 m from",
    ),
    "up of length 5": (at("up", "direction", to=[0.0, 0.0, 5.0]), "the up direction has length 5"),
    "up of length 0": (at("up", "direction", to=[0.0, 0.0, 0.0]), "the up direction has length 0"),
    "support": (at("up", "support", to=7.0), "the support of the up direction is 7"),
    "seed": (at("seed", to=3), "seed is 3"),
    "counts": (at("counts", "frames", to=-1), "there cannot be frames -1"),
    "duration": (at("recording", "duration_s", to=-5.0), "duration_s is -5"),
    "box": (at("bounding_box_m", "low", to=[-500.0, -500.0, -500.0]), "its bounding box goes from (-500.00"),
    "box inside out": (at("bounding_box_m", "low", to=[500.0, 500.0, 500.0]), "the bounding box goes from"),
    "mirrored rig": (at("rig", "rgb_from_depth", 0, to=[-1.0, 0.0, 0.0, 0.0]), "rgb_from_depth is no rotation"),
    "stretched rig": (at("rig", "rgb_from_depth", 0, to=[2.0, 0.0, 0.0, 0.0]), "rgb_from_depth is no rotation"),
    "model dim": (at("models", "pixels", "dim", to=64), "have 4 numbers, those of fake/pixels have 64"),
    "one file twice": (
        lambda path: unsigned(path, lambda s: s["files"].__setitem__("voxels/w", s["files"]["voxels/weight"])),
        "are one file",
    ),
    "moved voxels": (with_array("voxels/index", lambda a: a + np.int32(40)), "its bounding box goes from"),
    "voxels of another order": (with_array("voxels/index", lambda a: a[::-1]), "not sorted by index"),
    "features of no length": (with_array("voxels/feature", lambda a: a * np.float16(2)), "neither unit length"),
    "descriptors": (with_array("keyframes/descriptors", lambda a: a * np.float16(0.5)), "neither unit length"),
    "sound features": (with_array("sounds/feature", lambda a: a * 3), "neither unit length"),
    "weights": (with_array("voxels/weight", lambda a: -a), "negative weight"),
    "hits": (with_array("voxels/hits", lambda a: a * 0), "hit by no pixel"),
    "seen later": (
        with_array("voxels/last_seen_s", lambda a: np.where(np.arange(len(a)) == 0, 1e6, a)),
        "voxels were seen over 1e+06 s",
    ),
    "poses that stretch": (with_array("keyframes/world_from_camera", lambda a: a * 3), "pose is no rigid transform"),
    "poses that mirror": (
        with_array("keyframes/world_from_camera", lambda a: a * np.array([-1.0, 1, 1, 1])),
        "pose is no rotation",
    ),
    "keyframes backwards": (with_array("keyframes/stamp_s", lambda a: a[::-1]), "not in the order of time"),
    "onset after offset": (with_array("sounds/onset_s", lambda a: a + 1000), "before it begins at"),
    "a camera far outside": (
        with_array("keyframes/world_from_camera", lambda a: a + 2000.0 * (np.arange(16) == 3).reshape(4, 4)),
        "a keyframe lies 1,9",
    ),
    "views far outside": (
        with_array("keyframes/centre", lambda a: a + np.float32(1e4)),
        "what a keyframe saw lies",
    ),
    "sounds far outside": (
        with_array("sounds/track", lambda a: a - np.float32(1e4)),
        "where a sound was heard lies",
    ),
    "keypoints at no place": (
        with_array("keyframes/points_world", lambda a: np.full_like(a, np.inf)),
        "a place in it is no place",
    ),
    "sounds backwards": (with_array("sounds/onset_s", lambda a: a[::-1]), "not in the order of their onset"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_contradiction_is_refused_in_words(copied: Path, name: str) -> None:
    change, words = WRONG[name]
    change(copied)
    with pytest.raises(MapError) as fault:
        open_stored(copied)
    assert words in str(fault.value) and str(copied) in str(fault.value)


def test_evidence_of_sources_that_cannot_be_is_refused_in_words(built: Path) -> None:
    info = open_stored(built).info
    sounds = info.counts.sounds
    some = SourceEvidence(
        place=np.zeros((2, 3), np.float32), prior=np.full(2, 0.5, np.float32),
        heard=np.zeros((sounds, 2), np.float16), expected=np.zeros((sounds, 2), np.float16),
        moving=np.zeros(sounds, np.uint8), channels=np.array([2]),
    )  # fmt: skip
    assert sources_fault(info, some) == ""
    assert "add up to 3" in sources_fault(info, replace(some, prior=np.full(2, 1.5, np.float32)))
    assert "likelihood" in sources_fault(info, replace(some, heard=some.heard + np.float16(1)))
    assert "outside of its voxels" in sources_fault(info, replace(some, place=some.place + np.float32(1e5)))
    assert "evidence of 0 sounds" in sources_fault(info, replace(some, heard=some.heard[:0]))


def test_a_map_of_an_older_release_has_no_checksum_and_opens(copied: Path) -> None:
    unsigned(copied, lambda said: said.pop("checksum"))
    assert open_stored(copied, verify=True).info.checksum == ""


def leaves(said: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the keys that lead to each number and word of a JSON value."""
    items = said.items() if isinstance(said, dict) else enumerate(said) if isinstance(said, list) else None
    if items is None:
        return [path]
    return [leaf for key, value in items for leaf in leaves(value, (*path, key))]


@given(st.data())
def test_any_value_of_map_json_that_is_changed_is_noticed(built: Path, data: st.DataObject) -> None:
    said = said_in(built)
    keys = data.draw(st.sampled_from([leaf for leaf in leaves(said) if leaf[0] not in ("timings", "checksum")]))
    there = said
    for key in keys[:-1]:
        there = there[key]
    old = there[keys[-1]]
    there[keys[-1]] = (not old) if isinstance(old, bool) else old + 1 if isinstance(old, int | float) else f"{old}x"
    assert checksum_of(json.dumps(said).encode()) != said["checksum"]


def test_an_edited_word_is_noticed_when_the_map_is_opened(copied: Path) -> None:
    put(copied, {**said_in(copied), "notices": ["all is well"]})
    with pytest.raises(MapError, match=r"map.json is damaged: it was changed after it was written"):
        open_stored(copied)


def test_an_unknown_key_is_noticed(copied: Path) -> None:
    put(copied, {**said_in(copied), "zzz": 1})
    with pytest.raises(MapError, match="it was changed after it was written"):
        open_stored(copied)


def test_layout_and_order_are_no_change_and_nor_is_when_it_was_built(copied: Path) -> None:
    said = dict(reversed(said_in(copied).items()))
    said["timings"]["finished"] = "2001-01-01T00:00:00+00:00"
    (copied / "map.json").write_text(json.dumps(said, indent=7))
    open_stored(copied, verify=True)


def test_what_was_built_contradicts_nothing(built: Path) -> None:
    info = msgspec.json.decode((built / "map.json").read_bytes(), type=MapInfo)
    assert manifest_fault(info) == "" and len(info.checksum) == 64
