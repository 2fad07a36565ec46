"""The map's folder: what is written comes back, and what is not a whole map is refused in one sentence."""

import errno
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import msgspec
import numpy as np
import pytest
from build_fakes import RIG, SETTINGS, Walk, register_fakes, write_beeps
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from safetensors.numpy import load_file

from avlmaps.core.columns import axes_of
from avlmaps.core.errors import MapError
from avlmaps.core.files import sha256_of_file
from avlmaps.core.registry import Kind
from avlmaps.maps.build import build_map
from avlmaps.maps.store import folder, tables
from avlmaps.maps.store.edits import read_edits
from avlmaps.maps.store.folder import damaged_files, has_unfinished_build, read, write
from avlmaps.maps.store.map_data import encoders_of_map, require_model
from avlmaps.maps.store.tables import EDITING, LOCK, is_locked, lock_folder, read_arrays, write_arrays

PROFILE = register_fakes()
OLD = Path(__file__).with_name("data") / "schema1"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("maps") / "walk.avlmap"
    audio = write_beeps(path.parent / "beeps.wav")
    build_map(Walk(12, audio=audio), path, PROFILE, SETTINGS, progress=False)
    return path


@pytest.fixture
def copied(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "walk.avlmap"))


def same(one: object, other: object) -> bool:
    """Return whether two dataclasses of arrays are equal, bit by bit."""
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in axes_of(type(one)))


ARRAYS = hnp.arrays(
    st.sampled_from([np.float16, np.float32, np.float64, np.int32, np.int64, np.uint8, np.uint16, np.bool_]),
    hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=6),
)


@given(st.dictionaries(st.text("abc._", min_size=1, max_size=4), ARRAYS, max_size=4), st.text(max_size=9))
def test_arrays_come_back_bit_by_bit_and_are_what_the_package_reads(
    tmp_path_factory: pytest.TempPathFactory, arrays: dict[str, np.ndarray], note: str
) -> None:
    path = tmp_path_factory.mktemp("tables") / "a.safetensors"
    write_arrays(path, {name: array[::-1] for name, array in arrays.items()}, note)
    back, said = read_arrays(path)
    assert said == note and set(back) == set(arrays)
    theirs = load_file(path)
    for name, array in arrays.items():
        assert back[name].dtype == array.dtype and back[name].shape == array.shape
        assert back[name].tobytes() == array[::-1].tobytes() == theirs[name].tobytes()


def test_large_arrays_are_memory_mapped(tmp_path: Path) -> None:
    write_arrays(tmp_path / "a.safetensors", {"large": np.zeros(1 << 21, np.uint8), "small": np.zeros(9)})
    back, _ = read_arrays(tmp_path / "a.safetensors")
    assert not back["large"].flags.writeable and not back["large"].flags.owndata and back["small"].flags.writeable


def test_a_full_disk_is_one_sentence_and_leaves_the_map(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    before = {file: file.read_bytes() for file in copied.rglob("*") if file.is_file()}
    data = read(copied)
    monkeypatch.setattr(tables, "sync_file", full)
    with pytest.raises(MapError, match=r"Cannot write .* No space left on device; make room or choose another folder"):
        write(copied, data)
    assert {file: file.read_bytes() for file in copied.rglob("*") if file.is_file()} == before


def test_who_may_not_write_is_told_what_helps_a_build_and_what_helps_an_edit(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for name, helps in ((LOCK, "choose another folder"), (EDITING, "edit a copy that lies where you may write")):
        with pytest.raises(MapError, match=f"Not a directory; {helps}"), lock_folder(tmp_path / "file" / "map", name):
            pass


def test_a_map_comes_back_with_all_that_it_is_of(built: Path) -> None:
    stored = read(built)
    assert len(stored.voxels) == stored.info.counts.voxels > 100 and len(stored.sounds) > 0
    assert stored.voxels.feature.shape == (len(stored.voxels), 4)
    assert stored.place_state["centres"].shape == (2, 3)
    assert (stored.rig.rgb, stored.rig.depth) == (RIG.rgb, RIG.depth) and stored.rig.registered
    assert stored.up_in_world.tolist() == [0.0, 0.0, 1.0]
    assert stored.info.profile == PROFILE and stored.grid.voxel_size_m == 0.05
    assert stored.info.models["place"].checksum and stored.info.models["place"].prompts == ("a {}",)
    assert stored.info.settings == SETTINGS.for_profile(0.6)
    for kind in (Kind.PIXELS, Kind.SOUNDS, Kind.LOCAL, Kind.PLACE):
        require_model(stored.info, encoders_of_map(stored.info), kind, built)
    files = {path.relative_to(built).as_posix() for path in built.rglob("*") if path.is_file() and path.name != LOCK}
    assert files == {"map.json", *stored.info.files}
    assert {"voxels.safetensors", "keyframes.safetensors", "sounds.safetensors"} < files
    assert "/nowhere/of/mine" not in (built / "map.json").read_text()


def test_what_is_written_in_the_place_of_a_map_is_that_map(copied: Path) -> None:
    before = read(copied)
    for _ in range(3):
        write(copied, replace(before, findings={"best": np.arange(4)}))
        after = read(copied)
        assert same(after.voxels, before.voxels) and same(after.keyframes, before.keyframes)
        assert same(after.sounds, before.sounds) and after.findings["best"].tolist() == [0, 1, 2, 3]
        assert all(clip.is_file() for clip in after.sounds.clips) and not damaged_files(copied)
        assert len(list(copied.glob("*.safetensors"))) == 3
    assert all(array[0] == before.voxels.index[0, 0] for array in before.voxels.index[:1])  # its old file is still read


def test_a_map_whose_names_lie_in_a_file_of_their_own_is_read(copied: Path) -> None:
    before, path = read(copied), copied / "names.safetensors"
    write_arrays(path, {"best": np.arange(4)})
    manifest = json.loads((copied / "map.json").read_text())
    manifest["files"][path.name] = {"bytes": path.stat().st_size, "sha256": sha256_of_file(path)}
    (copied / "map.json").write_text(json.dumps(manifest))
    assert read(copied).findings["best"].tolist() == [0, 1, 2, 3] and not damaged_files(copied)
    write(copied, replace(before, findings={}))
    assert not path.exists() and not read(copied).findings


def test_a_map_of_schema_1_comes_back_with_its_days_edits_submaps_and_sources(tmp_path: Path) -> None:
    shutil.copytree(OLD, tmp_path / "m")
    for round in ("as it was", "converted"):
        data = read(tmp_path / "m")
        assert data.info.schema_version == (1 if round == "as it was" else 2)
        if round == "as it was":
            listed = json.loads((OLD / "map.json").read_text())["files"]
            arrays = {name: np.load(OLD / file["path"]) for name, file in listed.items() if file["dtype"]}
        wholes = {"voxels": data.voxels, "keyframes": data.keyframes, "sounds": data.sounds}
        wholes |= {"submaps": data.submaps, "sources": data.sources}
        for section, whole in wholes.items():
            for name in axes_of(type(whole)):
                assert np.array_equal(getattr(whole, name), arrays[f"{section}/{name}"], equal_nan=True)
        assert np.array_equal(data.place_state["centres"], arrays["keyframes/state/centres"])
        assert data.life is not None and [stay.name for stay in data.life.stays] == ["chair"]
        assert data.life.voxels(0).tolist() == arrays["life/index"].tolist()
        assert [visit.day for visit in data.info.visits] == ["2026-11-25", "2026-11-26"]
        assert [clip.read_bytes() for clip in data.sounds.clips] == [
            (OLD / file["path"]).read_bytes() for file in listed.values() if not file["dtype"]
        ]
        assert [edit.name for edit in read_edits(tmp_path / "m")] == ["stool"]
        assert not damaged_files(tmp_path / "m")
        write(tmp_path / "m", data)
    assert not {"voxels", "life", "submaps"} & {path.name for path in (tmp_path / "m").iterdir()}


def refusal(path: Path) -> str:
    with pytest.raises(MapError) as fault:
        read(path)
    return str(fault.value)


def edited(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    """Return what changes ``map.json``."""

    def work(path: Path) -> None:
        content = json.loads((path / "map.json").read_text())
        change(content)
        (path / "map.json").write_text(json.dumps(content))

    return work


def with_arrays(section: str, **changed: np.ndarray | None) -> Callable[[Path], None]:
    """Return what puts other arrays into a file, with the size that ``map.json`` says then."""

    def work(path: Path) -> None:
        file = path / f"{section}.safetensors"
        arrays = load_file(file)
        for name, array in changed.items():
            arrays.pop(name)
            arrays |= {} if array is None else {name: array}
        write_arrays(file, arrays)
        edited(lambda content: content["files"][file.name].update(bytes=file.stat().st_size))(path)

    return work


def overwritten(name: str, content: bytes) -> Callable[[Path], object]:
    return lambda path: (path / name).write_bytes(content)


def first_clip(path: Path) -> Path:
    return next((path / "clips").iterdir())


DAMAGED: dict[str, tuple[Callable[[Path], object], str]] = {
    "no JSON": (overwritten("map.json", b"{"), "map.json is damaged"),
    "no UTF-8": (overwritten("map.json", b'{"format": "\xff"}'), "map.json is damaged"),
    "deep JSON": (overwritten("map.json", b"[" * 100_000), "map.json is damaged"),
    "of no map": (overwritten("map.json", b"{}"), "map.json belongs to no map"),
    "of tomorrow": (edited(lambda said: said.update(schema_version=3)), "has schema version 3"),
    "a field is missing": (edited(lambda said: said.pop("rig")), "map.json is damaged: Object missing"),
    "no camera": (edited(lambda said: said["rig"]["depth"].update(fx=-1.0)), "map.json is damaged: a camera needs"),
    "no setting": (edited(lambda said: said["settings"]["frames"].update(step=0)), "damaged: step of FrameSettings"),
    "no voxels": (edited(lambda said: said.update(voxel_size_m=0.0)), "map.json is damaged: voxel_size_m"),
    "other counts": (edited(lambda said: said["counts"].update(voxels=7)), "its counts are not those of the files"),
    "a file of others": (edited(lambda said: said["files"].update({"../x.npy": {"bytes": 1, "sha256": ""}})), "../x"),
    "a section is missing": (edited(lambda said: said["files"].pop("sounds.safetensors")), "no file of sounds"),
    "a file is missing": (lambda path: (path / "voxels.safetensors").unlink(), "voxels.safetensors is missing"),
    "cut short": (lambda path: os.truncate(path / "voxels.safetensors", 99), "has 99 bytes"),
    "a clip is missing": (lambda path: first_clip(path).unlink(), ".flac is missing"),
    "an array is missing": (with_arrays("voxels", hits=None), "voxels.safetensors is damaged: hits is missing"),
    "another type": (with_arrays("voxels", rgb=np.zeros((3, 3))), "rgb is float64 of (3, 3)"),
    "another length": (with_arrays("voxels", rgb=np.zeros((3, 3), np.uint8)), "rgb is uint8 of (3, 3)"),
    "no offsets": (with_arrays("sounds", track_offsets=np.zeros(1, np.int64)), "track_offsets"),
}


@pytest.mark.few(8)
@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_map_is_one_error_with_the_files_name(copied: Path, damage: str) -> None:
    work, said = DAMAGED[damage]
    work(copied)
    assert said in refusal(copied) and str(copied) in refusal(copied)


def test_a_changed_byte_is_found_by_its_hash(copied: Path) -> None:
    assert damaged_files(copied) == []
    for file in (copied / "voxels.safetensors", first_clip(copied)):
        content = bytearray(file.read_bytes())
        content[-1] ^= 1
        file.write_bytes(content)
    assert len(damaged_files(copied)) == 2 and "checksum" in damaged_files(copied)[0]


def test_no_map_is_one_sentence_that_says_what_is_there(tmp_path: Path, copied: Path) -> None:
    (tmp_path / "file.avlmap").write_text("hello")
    (tmp_path / "half" / "parts" / "fusion-1234").mkdir(parents=True)
    (tmp_path / "empty").mkdir()
    for name, said in (
        ("none", "is not there, or is not a map's folder; make one"),
        ("wolk.avlmap", "did you mean"),
        ("file.avlmap", "is not there, or is not a map's folder"),
        ("empty", "is a folder without a map in it"),
        ("half", "is a half-built map"),
    ):
        assert said in refusal(tmp_path / name)
    assert has_unfinished_build(tmp_path / "half")
    with lock_folder(tmp_path / "empty"):
        assert is_locked(tmp_path / "empty") and "is being built at this moment" in refusal(tmp_path / "empty")
        with pytest.raises(MapError, match="by this program at this moment"), lock_folder(tmp_path / "empty"):
            pass
    assert not is_locked(tmp_path / "empty")


def test_a_file_without_rights_is_said_to_be_one(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("safetensors.safe_open", Mock(side_effect=FileNotFoundError))  # whoever runs the test
    with pytest.raises(MapError, match=r"voxels\.safetensors may not be read; give yourself the right to, or restore"):
        read_arrays(copied / "voxels.safetensors")


def test_a_map_replaced_while_it_is_opened_is_opened_anew(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between reading map.json and the files, another build replaces the map, and takes the old names again."""
    other, opened, calls = read(copied), folder._read, list[int]()
    other = replace(other, info=msgspec.structs.replace(other.info, build_key="another"))

    def slow(path: Path, content: bytes) -> object:
        if not calls:
            calls.extend(write(path, other).bytes for _ in range(2))
        return opened(path, content)

    monkeypatch.setattr(folder, "_read", slow)
    assert read(copied).info.build_key == "another"
