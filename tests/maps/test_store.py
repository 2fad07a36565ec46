"""The map's folder: what is written comes back, and what is not a whole map is refused in one sentence."""

import errno
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from build_fakes import RIG, SETTINGS, Walk, register_fakes
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.maps.build import build_map
from avlmaps.maps.repair import damaged_files, repair_map
from avlmaps.maps.store import array_files, integrity
from avlmaps.maps.store.array_files import SMALL_BYTES, read_array, sync_files, write_array
from avlmaps.maps.store.array_validation import array_fields, check_order, validate_arrays
from avlmaps.maps.store.checkpoints import DONE, save_checkpoint
from avlmaps.maps.store.lock import EDITING, LOCK, is_locked, lock_folder
from avlmaps.maps.store.reader import has_unfinished_build, open_stored
from avlmaps.maps.types import HeardSounds, Voxels

PROFILE = register_fakes()


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("maps") / "walk.avlmap"
    build_map(Walk(12), path, PROFILE, SETTINGS, progress=False)
    return path


@pytest.fixture
def copied(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "walk.avlmap"))


def refused(path: Path, *, verify: bool = False) -> str:
    with pytest.raises(MapError) as fault:
        open_stored(path, verify=verify)
    return str(fault.value)


def edit(path: Path, change: Callable[[dict], object]) -> None:
    """Change what ``map.json`` says, as a writer would that is wrong: with the right size and no checksum."""
    content = json.loads((path / "map.json").read_text())
    change(content)
    content.pop("checksum")
    content["bytes"] = sum(file["bytes"] for file in content["files"].values())
    (path / "map.json").write_text(json.dumps(content))


def file_of(path: Path, name: str) -> Path:
    return path / json.loads((path / "map.json").read_text())["files"][name]["path"]


ARRAYS = hnp.arrays(
    st.sampled_from([np.float16, np.float32, np.float64, np.int32, np.int64, np.uint8]),
    hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=6),
)


@given(ARRAYS)
def test_arrays_come_back_bit_by_bit(tmp_path_factory: pytest.TempPathFactory, array: np.ndarray) -> None:
    folder = tmp_path_factory.mktemp("shards")
    back = read_array(folder, write_array(folder, "some/thing", array), verify=True)
    assert back.dtype == array.dtype and back.shape == array.shape and back.tobytes() == array.tobytes()


def test_the_name_of_a_file_follows_from_its_content(tmp_path: Path) -> None:
    one, same, other = (write_array(tmp_path, "a", np.array([n])) for n in (1, 1, 2))
    assert one == same and one.path != other.path
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted([one.path, other.path])


def test_strided_and_big_endian_arrays_are_written_in_our_order(tmp_path: Path) -> None:
    array = np.arange(24, dtype=">i4").reshape(4, 6)[::2, ::-3]
    back = read_array(tmp_path, write_array(tmp_path, "a", array))
    assert back.dtype.str == "<i4" and np.array_equal(back, array)


def test_large_arrays_are_memory_mapped_and_small_ones_are_not(tmp_path: Path) -> None:
    large = write_array(tmp_path, "large", np.zeros(SMALL_BYTES, np.uint8))
    small = write_array(tmp_path, "small", np.zeros(10, np.uint8))
    assert isinstance(read_array(tmp_path, large), np.memmap)
    assert not isinstance(read_array(tmp_path, small), np.memmap)


def test_objects_cannot_be_kept(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="holds Python objects"):
        write_array(tmp_path, "a", np.array([{}], object))


def test_a_full_disk_is_one_sentence_and_leaves_no_rubbish(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    written = write_array(tmp_path / "written", "a", np.zeros(3))
    monkeypatch.setattr(os, "fsync", full)
    monkeypatch.setattr(array_files, "_hashed", lambda *_: full(0))
    for folder, write in (
        (tmp_path, lambda: write_array(tmp_path, "a", np.zeros(3))),
        (tmp_path / "written", lambda: sync_files(tmp_path / "written", [written])),
    ):
        with pytest.raises(MapError) as fault:
            write()
        assert str(fault.value) == (
            f"Cannot write {folder}: No space left on device; make room or choose another folder. What was "
            "finished there stays, and a second try continues from it."
        )
    assert list(tmp_path.iterdir()) == [tmp_path / "written"]


def test_who_may_not_write_is_told_what_helps_a_build_and_what_helps_an_edit(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for name, helps in ((LOCK, "choose another folder"), (EDITING, "edit a copy that lies where you may write")):
        with pytest.raises(MapError, match=f"Not a directory; {helps}"), lock_folder(tmp_path / "file" / "map", name):
            pass


class Facts(msgspec.Struct):
    """The facts of a stage that has none."""


def test_what_is_put_on_the_disk_is_every_file_before_its_manifest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor).st_ino))
    save_checkpoint(tmp_path, "key", Facts(), {"a": np.zeros(3), "b/c": np.ones(2)})
    done = synced.index((tmp_path / DONE).stat().st_ino)
    files = [path for path in tmp_path.rglob("*") if path.name != DONE]
    assert len(files) == 3 and {path.stat().st_ino for path in (tmp_path, *files)} <= set(synced[:done])
    synced.clear()
    write_array(tmp_path, "a", np.zeros(3))
    assert synced == [next(tmp_path.glob("a-*")).stat().st_ino], "what takes a file's place is on the disk before"


def test_a_map_comes_back_with_all_that_it_is_of(built: Path) -> None:
    stored = open_stored(built, verify=True)
    assert len(stored.voxels) == stored.info.counts.voxels > 100
    assert stored.voxels.feature.shape == (len(stored.voxels), 4)
    assert stored.place_state["centres"].shape == (2, 3)
    assert (stored.rig.rgb, stored.rig.depth) == (RIG.rgb, RIG.depth) and stored.rig.registered
    assert stored.up_in_world.tolist() == [0.0, 0.0, 1.0]
    assert stored.encoders.name == PROFILE and stored.grid.voxel_size_m == 0.05
    assert stored.info.models["place"].checksum and stored.info.models["place"].prompts == ("a {}",)
    assert stored.info.settings == SETTINGS.for_profile(0.6)
    for kind in (Kind.PIXELS, Kind.SOUNDS, Kind.LOCAL, Kind.PLACE):
        stored.require_model(kind)


def test_a_map_says_nothing_of_where_its_recording_lay(built: Path) -> None:
    assert "/nowhere/of/mine" not in (built / "map.json").read_text()


def test_nothing_there(tmp_path: Path) -> None:
    path = tmp_path / "none.avlmap"
    assert refused(path) == f"{path} is not there, or is not a map's folder; make one with `avlmaps build`."


def test_a_file_in_place_of_a_folder(tmp_path: Path) -> None:
    path = tmp_path / "file.avlmap"
    path.write_text("hello")
    assert refused(path) == f"{path} is not there, or is not a map's folder; make one with `avlmaps build`."


def test_a_folder_without_a_map(tmp_path: Path) -> None:
    assert (
        refused(tmp_path) == f"{tmp_path} is a folder without a map in it (no map.json); make one with `avlmaps build`."
    )


def test_a_half_built_map(tmp_path: Path) -> None:
    (tmp_path / "parts" / "fusion-1234").mkdir(parents=True)
    assert has_unfinished_build(tmp_path)
    assert refused(tmp_path) == (
        f"{tmp_path} is a half-built map (its build was stopped); run the same `avlmaps build` again with --resume, "
        "and it resumes from there."
    )


def test_a_map_that_is_being_built(tmp_path: Path) -> None:
    with lock_folder(tmp_path):
        assert is_locked(tmp_path)
        assert refused(tmp_path) == f"{tmp_path} is being built at this moment; wait until the build has finished."
    assert not is_locked(tmp_path)


def test_two_builds_into_one_folder_are_refused(tmp_path: Path) -> None:
    for holder, said in (
        (os.getpid(), "this program at this moment; end that first"),
        (1, "another process (1) at this moment; wait for it"),
    ):
        with lock_folder(tmp_path), pytest.raises(MapError) as fault:
            (tmp_path / LOCK).write_text(f"{holder}\n")
            build_map(Walk(4), tmp_path, PROFILE, SETTINGS, progress=False)
        assert str(fault.value) == f"{tmp_path} is being built by {said}, or build into another folder."


@pytest.mark.parametrize(("version", "how"), [(2, "upgrade avlmaps"), (0, "build the map again in its place")])
def test_another_schema_version(copied: Path, version: int, how: str) -> None:
    edit(copied, lambda content: content.update(schema_version=version, voxel_size_m="one day this may be a word"))
    said = f"{copied}/map.json has schema version {version}, this avlmaps reads version 1; {how}."
    assert refused(copied) == said


def test_a_map_of_an_unknown_profile_opens_for_all_that_needs_no_model(copied: Path) -> None:
    edit(copied, lambda content: content.update(profile="hearsay"))
    stored = open_stored(copied)
    assert stored.encoders.name == "hearsay" and len(stored.voxels)


def test_a_map_of_an_unknown_backend_says_so_when_it_is_needed(copied: Path) -> None:
    edit(copied, lambda content: content["models"]["pixels"].update(backend="hearsay"))
    stored = open_stored(copied)
    assert len(stored.voxels) > 0
    with pytest.raises(BackendError, match="no pixels backend called 'hearsay'"):
        stored.require_model(Kind.PIXELS)


def test_another_model(copied: Path) -> None:
    edit(copied, lambda content: content["models"]["sounds"].update(checksum="0123456789", id="fake/ears-0"))
    stored = open_stored(copied)
    with pytest.raises(MapError) as fault:
        stored.require_model(Kind.SOUNDS)
    assert str(fault.value).startswith(
        f"{copied} was built with fake/ears-0 (checksum 01234567), this avlmaps has fake/ears"
    )
    assert "build it again from its recording. Its points" in str(fault.value)  # it is of this version
    told = copied / "map.json"
    told.write_text(told.read_text().replace(f'"{__version__}"', '"0.0.1"', 1))
    with pytest.raises(MapError, match=r"build it again, or use avlmaps 0\.0\.1\. Its points"):
        open_stored(copied).require_model(Kind.SOUNDS)
    with pytest.raises(MapError, match="was built without a model for views"):
        stored.require_model(Kind.VIEWS)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is damaged: it is not JSON in UTF-8"),
        (b"{", "is damaged: it is not JSON in UTF-8"),
        (b'{"format": "\xff\xfe"}', "is damaged: it is not JSON in UTF-8"),
        (b"[1, 2]", "is damaged: it is not JSON in UTF-8"),
        (b"{}", "belongs to no map of avlmaps"),
        (b'{"format": "avlmap", "schema_version": 1}', "is damaged: Object missing required field `avlmaps_version`"),
    ],
)
def test_a_map_json_that_is_none(copied: Path, content: bytes, said: str) -> None:
    (copied / "map.json").write_bytes(content)
    assert refused(copied).startswith(f"{copied}/map.json {said}")


MEND = "repair it with `avlmaps info MAP --repair --recording REC`, or restore it from a copy."


def test_a_missing_file(copied: Path) -> None:
    file = file_of(copied, "voxels/rgb")
    file.unlink()
    assert refused(copied) == f"{file} is missing from the map; {MEND}"


def test_a_truncated_file(copied: Path) -> None:
    file = file_of(copied, "voxels/feature")
    size = file.stat().st_size
    os.truncate(file, size - 7)
    assert refused(copied) == f"{file} is damaged: it has {size - 7} bytes, {size} were written; {MEND}"


def test_a_flipped_bit_in_a_small_file_is_always_seen(copied: Path) -> None:
    file = file_of(copied, "keyframes/place")
    flip(file)
    assert refused(copied) == f"{file} is damaged: its checksum is not the one that was written; {MEND}"


def test_a_flipped_bit_in_a_large_file_is_seen_where_it_is_read(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0)
    file = file_of(copied, "voxels/feature")
    flip(file)
    said = f"{file} is damaged: its checksum is not the one that was written; {MEND}"
    with pytest.raises(MapError) as fault:
        open_stored(copied).voxels  # noqa: B018 - reading is what waits for the check
    assert str(fault.value) == said
    assert refused(copied, verify=True) == f"{file} is damaged: its checksum is not the one that was written; {MEND}"


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)


def replace(path: Path, name: str, array: np.ndarray, *, as_told: bool = False) -> None:
    """Put another array in a map, with a manifest that agrees (or tells the old type and shape)."""
    written = write_array(path, name, array)

    def change(content: dict) -> None:
        entry = content["files"][name]
        entry.update(path=written.path, bytes=written.bytes, sha256=written.sha256)
        if not as_told:
            entry.update(dtype=written.dtype, shape=written.shape)

    edit(path, change)


def test_a_file_that_is_not_what_the_manifest_tells(copied: Path) -> None:
    replace(copied, "keyframes/stamp_s", np.zeros(5, np.float32), as_told=True)
    file, count = file_of(copied, "keyframes/stamp_s"), open_count(copied)
    assert refused(copied) == f"{file} is damaged: it holds float32 of (5,), the map says float64 of ({count},); {MEND}"


def open_count(path: Path) -> int:
    return json.loads((path / "map.json").read_text())["counts"]["keyframes"]


def test_an_array_of_another_type_than_maps_have(copied: Path) -> None:
    replace(copied, "voxels/rgb", np.zeros((3, 3), np.float32))
    assert refused(copied) == (
        f"{copied}/voxels, rgb is float32 of (3, 3); a map has uint8 of (n, 3) there; build the map again in its place."
    )


def test_arrays_of_different_lengths(copied: Path) -> None:
    replace(copied, "voxels/rgb", np.zeros((3, 3), np.uint8))
    assert refused(copied).startswith(f"{copied}/voxels, rgb has shape (3, 3); n is ")


def test_a_pickle_is_never_opened(copied: Path) -> None:
    file = file_of(copied, "keyframes/stamp_s")
    np.save(file, np.array([print], object), allow_pickle=True)

    def change(content: dict) -> None:
        import hashlib

        entry = content["files"]["keyframes/stamp_s"]
        entry.update(bytes=file.stat().st_size, sha256=hashlib.sha256(file.read_bytes()).hexdigest())

    edit(copied, change)
    assert f"{file} is damaged: it is not an array that numpy can read" in refused(copied)


@pytest.mark.parametrize("name", ["../secret.npy", "/etc/passwd", "voxels/../../x.npy", "C:/x.npy", "..\\x.npy", ""])
def test_a_name_that_leads_out_of_the_folder(copied: Path, name: str) -> None:
    edit(copied, lambda content: content["files"]["voxels/rgb"].update(path=name))
    assert refused(copied) == f"{copied} names a file outside itself ({name}); do not use a map from that source."


def test_offsets_that_do_not_divide_their_rows(copied: Path) -> None:
    offsets = np.load(file_of(copied, "keyframes/offsets"))
    offsets[1] = offsets[-1] + 1
    replace(copied, "keyframes/offsets", offsets)
    assert f"{copied}/keyframes, offsets do not divide" in refused(copied)


def test_counts_that_are_not_those_of_the_arrays(copied: Path) -> None:
    edit(copied, lambda content: content["counts"].update(keyframes=10_000))
    assert refused(copied).startswith(f"{copied}/map.json is damaged: its counts are not those of the arrays")


def test_a_missing_array(copied: Path) -> None:
    edit(copied, lambda content: content["files"].pop("voxels/hits"))
    assert refused(copied) == f"{copied}/voxels is damaged: it has no hits; build the map again in its place."


def test_a_camera_that_is_none(copied: Path) -> None:
    edit(copied, lambda content: content["rig"]["depth"].update(fx=-1.0))
    assert refused(copied).startswith(f"{copied}/map.json is damaged: a camera needs finite numbers and positive focal")


def test_settings_that_cannot_be(copied: Path) -> None:
    edit(copied, lambda content: content["settings"]["frames"].update(step=0))
    assert (
        refused(copied) == f"{copied}/map.json is damaged: frames.step is 0; choose 1 or more; restore it from a copy."
    )


@given(hnp.arrays(np.int32, st.tuples(st.integers(0, 8), st.just(3)), elements=st.integers(-2, 2)))
def test_the_order_of_voxels_is_told_exactly(index: np.ndarray) -> None:
    rows = [tuple(row) for row in index.tolist()]
    n = len(rows)
    voxels = Voxels(index, *(np.zeros(0),) * 5)  # pyright: ignore[reportArgumentType]
    if rows == sorted(set(rows)):
        check_order(voxels, "here")
    else:
        with pytest.raises(MapError, match="not sorted"):
            check_order(voxels, "here")
    assert n == len(index)


def test_a_map_replaced_while_it_is_opened_is_opened_anew(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between reading map.json and the files, another build's commit removes the old files."""
    from avlmaps.maps.store import reader as stored

    opened, calls = stored._opened, []

    def slow(path: Path, info: object, verify: bool) -> object:
        if not calls:
            calls.append(build_map(Walk(12, seed=5), path, PROFILE, SETTINGS, progress=False, overwrite=True))
        return opened(path, info, verify)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(stored, "_opened", slow)
    monkeypatch.setattr("avlmaps.maps.build.open_stored", lambda path: None)
    assert open_stored(copied).info.recording.fingerprint == Walk(12, seed=5).fingerprint


def test_sounds_without_any_are_whole() -> None:
    empty = {
        "onset_s": np.zeros(0),
        "offset_s": np.zeros(0),
        "track_offsets": np.zeros(1, np.int64),
        "track": np.zeros((0, 3), np.float32),
        "feature_offsets": np.zeros(1, np.int64),
        "feature": np.zeros((0, 7), np.float32),
        "clips": (),
    }
    assert len(validate_arrays(HeardSounds, empty, "here")) == 0
    assert array_fields(HeardSounds) == [name for name in empty if name != "clips"]


def test_an_array_that_may_not_be_read_is_not_called_damaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = write_array(tmp_path, "a", np.zeros(SMALL_BYTES, np.uint8))

    def refuse(*arguments: object, **named: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("avlmaps.core.npy.open_regular", refuse)
    with pytest.raises(MapError, match=r"cannot be read \(Permission denied\); check its permissions\.$"):
        read_array(tmp_path, info)


def test_an_array_of_another_type_than_the_map_says_is_damaged(tmp_path: Path) -> None:
    info = msgspec.structs.replace(write_array(tmp_path, "a", np.zeros(3, np.float32)), dtype="nonsense")
    with pytest.raises(MapError, match=r"is damaged: it holds float32 of \(3,\), the map says nonsense of \(3,\);"):
        read_array(tmp_path, info)


def test_a_map_written_before_there_were_scores_opens_without_them(copied: Path) -> None:
    edit(copied, lambda content: content["files"].pop("keyframes/score"))
    stored = open_stored(copied, verify=True)
    assert stored.keyframes.score.shape == (0,) and stored.keyframes.score.dtype == np.float16
    assert len(stored.keyframes.xy) > 0


def test_scores_of_all_keypoints_come_back(copied: Path) -> None:
    count = len(open_stored(copied).keyframes.xy)
    score = np.linspace(0.0, 1.0, count).astype(np.float16)
    replace(copied, "keyframes/score", score)
    np.testing.assert_array_equal(open_stored(copied).keyframes.score, score)


def test_scores_of_some_keypoints_only_are_a_damage(copied: Path) -> None:
    count = len(open_stored(copied).keyframes.xy)
    replace(copied, "keyframes/score", np.ones(count - 1, np.float16))
    assert refused(copied) == (
        f"{copied}/keyframes, score has {count - 1} rows; xy has {count}; build the map again in its place."
    )


def test_an_opened_map_is_checked_once_and_again_when_a_file_was_written(
    copied: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0)
    read: list[Path] = []
    real = integrity.open_regular
    monkeypatch.setattr(integrity, "open_regular", lambda path, limit: (read.append(path), real(path, limit))[1])
    assert open_stored(copied).integrity.faults == () and len(read) > 10  # a copy is read once
    read.clear()
    assert open_stored(copied).integrity.faults == () and not read
    file = file_of(copied, "voxels/weight")
    before = file.stat()
    flip(file)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert [file.name in fault for fault in open_stored(copied).integrity.faults] == [True]


def test_a_map_that_was_just_built_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0)
    monkeypatch.setattr(integrity, "open_regular", None)
    assert build_map(Walk(8), tmp_path / "map", PROFILE, SETTINGS, progress=False).integrity.faults == ()


def test_every_flipped_bit_in_a_large_file_is_seen(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0)
    rng = np.random.default_rng(0)
    for entry in json.loads((copied / "map.json").read_text())["files"].values():
        file = copied / entry["path"]
        whole = file.read_bytes()
        if len(whole) <= 128:  # a header alone: an empty array has no bit to flip
            continue
        broken = bytearray(whole)
        broken[rng.integers(128, len(whole))] ^= 1 << int(rng.integers(8))
        file.write_bytes(broken)
        with pytest.raises(MapError, match=r"is damaged: its checksum is not the one that was written|do not divide"):
            open_stored(copied).voxels  # noqa: B018
        file.write_bytes(whole)
    assert len(open_stored(copied).voxels) > 0


def test_a_file_that_is_cut_off_under_an_open_map_is_a_sentence_and_no_bus_error(
    copied: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0)
    stored = open_stored(copied)
    assert len(stored.voxels)
    file = file_of(copied, "voxels/feature")
    os.truncate(file, 4096)
    with pytest.raises(MapError, match=r"was written while the map was open \(it had \d+ bytes, now 4096\)"):
        stored.voxels  # noqa: B018


def test_an_open_map_stays_readable_when_another_takes_its_place(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0)
    stored = open_stored(copied)
    count = len(stored.voxels)
    build_map(Walk(6, seed=3), copied, PROFILE, SETTINGS, progress=False, overwrite=True)
    assert len(stored.voxels) == count and np.isfinite(np.asarray(stored.voxels.weight)).all()


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize(
    "name", ["voxels/feature", "voxels/weight", "keyframes/world_from_camera", "keyframes/place", "sounds/track"]
)
def test_a_nan_with_the_right_checksum_is_refused(
    copied: Path, name: str, large: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    array = np.load(file_of(copied, name))
    if not array.size:
        array = np.zeros((1, *array.shape[1:]), array.dtype)
    array.reshape(-1)[-1] = np.nan
    replace(copied, name, array)
    monkeypatch.setattr("avlmaps.maps.store.array_files.SMALL_BYTES", 0 if large else SMALL_BYTES)
    with pytest.raises(MapError, match=r"holds numbers that are NaN or infinite|divide|sounds"):
        open_stored(copied).voxels  # noqa: B018


def test_voxels_beyond_any_building_are_refused(copied: Path) -> None:
    index = np.load(file_of(copied, "voxels/index"))
    index[-1, 0] = 2_000_000
    replace(copied, "voxels/index", index)
    assert "voxels extend over 100,0" in refused(copied)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("name", ["voxels/rgb", "keyframes/thumbnails"])
def test_a_pipe_in_place_of_a_file_is_refused(copied: Path, name: str) -> None:
    file = file_of(copied, name)
    file.unlink()
    os.mkfifo(file)
    assert refused(copied) == f"{file} cannot be read (it is a pipe, not a regular file); {MEND}"


def test_json_nested_a_thousand_deep_is_a_sentence(copied: Path) -> None:
    (copied / "map.json").write_bytes(b'{"a":' * 5000 + b"1" + b"}" * 5000)
    assert "nested too deeply" in refused(copied)


def test_a_sparse_map_json_of_20_gb_is_refused_by_its_size(copied: Path) -> None:
    os.truncate(copied / "map.json", 20_000_000_000)
    assert "it has 20,000,000,000 bytes, more than the 256,000,000 of the largest such file" in refused(copied)


def test_a_repair_gives_back_what_was_built(copied: Path) -> None:
    before = {file: file.read_bytes() for file in copied.rglob("*-*.*") if file.is_file()}
    flip(file_of(copied, "voxels/feature"))
    file_of(copied, "keyframes/xy").unlink()
    assert set(damaged_files(copied)) == {"voxels/feature", "keyframes/xy"}
    with pytest.raises(MapError, match=r"2 of \d+ files of .* are damaged \(keyframes/xy, voxels/feature\); give"):
        repair_map(copied, None)
    with pytest.raises(MapError, match="was built from another recording"):
        repair_map(copied, Walk(12, seed=9))
    done = repair_map(copied, Walk(12))
    assert set(done.files) == {"voxels/feature", "keyframes/xy"}
    assert not damaged_files(copied) and not (copied / ".repair").exists()
    if not done.rebuilt:
        assert all(file.read_bytes() == content for file, content in before.items())
    assert repair_map(copied, None).files == ()


def test_a_link_that_leads_nowhere_is_called_one(tmp_path: Path) -> None:
    (tmp_path / "map").symlink_to("nowhere")
    with pytest.raises(MapError, match=r"map: it is a symbolic link that leads nowhere; choose another folder"):
        lock_folder(tmp_path / "map").__enter__()
