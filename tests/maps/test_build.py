"""The build: stretches of frames that add up, frames that cannot be read, and folders that are not to be touched."""

import json
import shutil
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Walk, content_of, register_fakes, write_beeps
from hypothesis import given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent.parent / "recordings"))
from recording_scenes import save_depth, shots, write_folder

from avlmaps.core.columns import axes_of
from avlmaps.core.errors import MapError, RecordingError
from avlmaps.core.machine import run_ahead
from avlmaps.maps.build import build_map, describe
from avlmaps.maps.plan import audio_key
from avlmaps.maps.settings import BuildSettings, FrameSettings
from avlmaps.maps.store.reader import StoredMap, open_stored
from avlmaps.maps.types import Keyframes
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Subset

PROFILE = register_fakes()


def build(walk: Walk, path: Path, settings: BuildSettings = SETTINGS, **options: object) -> StoredMap:
    return build_map(walk, path, PROFILE, settings, progress=False, **options)  # pyright: ignore[reportArgumentType]


def test_a_build_leaves_the_files_of_its_manifest_and_nothing_else(tmp_path: Path) -> None:
    stored = build(Walk(10), tmp_path / "a.avlmap")
    listed = set(stored.info.files)
    assert set(content_of(stored.path)) == listed | {"map.json"}
    assert not (stored.path / "parts").exists()


def test_the_same_build_gives_the_same_files_bit_by_bit(tmp_path: Path) -> None:
    one, other = (build(Walk(10), tmp_path / name) for name in ("a.avlmap", "b.avlmap"))
    assert content_of(one.path) == content_of(other.path)


def test_a_part_boundary_changes_nothing_but_rounding(tmp_path: Path) -> None:
    parted = build(Walk(10), tmp_path / "a").voxels
    whole = build(Walk(10), tmp_path / "b", replace(SETTINGS, frames=FrameSettings(per_part=100))).voxels
    assert np.array_equal(parted.index, whole.index) and np.array_equal(parted.hits, whole.hits)
    np.testing.assert_allclose(parted.weight, whole.weight, rtol=1e-6)
    np.testing.assert_allclose(parted.feature.astype(float), whole.feature.astype(float), atol=2e-3)


def test_a_finished_map_is_not_built_again(tmp_path: Path) -> None:
    first = build(Walk(6), tmp_path / "a")
    second = build(Walk(6), tmp_path / "a")
    assert first.info == second.info


@pytest.mark.parametrize(
    ("walk", "settings", "why"),
    [
        (Walk(6, seed=1), SETTINGS, "of walk (another recording, or it has changed)"),
        (Walk(6), replace(SETTINGS, voxel_size_m=0.1), "of walk with other settings"),
    ],
)
def test_a_finished_map_of_something_else_is_kept(
    tmp_path: Path, walk: Walk, settings: BuildSettings, why: str
) -> None:
    before = build(Walk(6), tmp_path / "a")
    files = content_of(before.path)
    with pytest.raises(MapError) as fault:
        build(walk, before.path, settings)
    assert str(fault.value) == (
        f"{before.path} is a finished map already, {why}; give another path, or replace it with overwrite=True."
    )
    assert content_of(before.path) == files
    after = build(walk, before.path, settings, overwrite=True)
    assert after.info.build_key != before.info.build_key
    assert set(content_of(after.path)) == {name.replace(".2.", ".") for name in after.info.files} | {"map.json"}


def test_a_damaged_map_can_be_overwritten(tmp_path: Path) -> None:
    path = build(Walk(6), tmp_path / "a").path
    (path / "map.json").write_bytes(b"\xff")
    with pytest.raises(MapError, match=r"map\.json is damaged"):
        build(Walk(6), path)
    assert open_stored(build(Walk(6), path, overwrite=True).path).info.counts.frames == 6


def test_an_opened_map_stays_readable_when_it_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.maps.store.tables._SMALL_BYTES", 0)
    before = build(Walk(6), tmp_path / "a")
    assert not before.voxels.feature.flags.owndata
    expected = build(Walk(6), tmp_path / "b").voxels.feature
    build(Walk(6, seed=1), tmp_path / "a", overwrite=True)
    assert np.array_equal(before.voxels.feature, expected)


@pytest.mark.parametrize(
    "make", [lambda path: path.write_text("mine"), lambda path: path.mkdir() or (path / "mine").mkdir()]
)
def test_what_is_no_map_is_not_touched(tmp_path: Path, make) -> None:
    path = tmp_path / "thesis"
    make(path)
    with pytest.raises(MapError) as fault:
        build(Walk(4), path, overwrite=True)
    told = f"{path} is there already and is not a map; give another path, nothing in it was touched."
    assert str(fault.value) == told
    assert not (path / ".lock").exists()


def test_an_empty_folder_will_do(tmp_path: Path) -> None:
    assert build(Walk(4), tmp_path).info.counts.frames == 4


def test_a_recording_without_frames_makes_no_folder(tmp_path: Path) -> None:
    with pytest.raises(MapError) as fault:
        build(Walk(0), tmp_path / "a")
    assert str(fault.value) == "/nowhere/of/mine/walk has no frames with a pose; there is nothing to build a map from."
    assert not (tmp_path / "a").exists()


def test_a_walk_without_depth_says_what_to_check(tmp_path: Path) -> None:
    far = replace(SETTINGS, fusion=replace(SETTINGS.fusion, max_depth_m=0.5))
    with pytest.raises(MapError) as fault:
        build(Walk(4), tmp_path / "a", far)
    assert str(fault.value) == (
        "No pixel of walk has a depth between 0.1 and 0.5 m, so that the map would be empty; check "
        "the recording's depth scale."
    )


def test_frames_that_cannot_be_read_are_left_out_and_told(tmp_path: Path) -> None:
    stored = build(Walk(20, bad=(3, 17)), tmp_path / "a")
    assert stored.info.counts.frames == 18
    assert [(bad.index, bad.why) for bad in stored.info.bad_frames] == [
        (3, "walk/000003.png is truncated; leave that frame out."),
        (17, "walk/000017.png is truncated; leave that frame out."),
    ]
    assert "2 of 20 frames were left out (bad_frames in map.json says why)." in stored.info.notices
    good = [i for i in range(20) if i not in (3, 17)]
    alone = build(Subset(Walk(20), good), tmp_path / "b")  # pyright: ignore[reportArgumentType]
    assert np.array_equal(stored.voxels.hits, alone.voxels.hits)
    assert np.array_equal(stored.keyframes.stamp_s, alone.keyframes.stamp_s)


def test_too_many_bad_frames_stop_the_build_and_the_count_survives_a_resume(tmp_path: Path) -> None:
    said = (
        "5 of 20 frames cannot be read, more than the 4 that may be left out; fix the recording or allow more "
        "(FrameSettings.max_bad_share). The last: walk/000014.png is truncated; leave that frame out."
    )
    for _ in range(2):
        with pytest.raises(RecordingError) as fault:
            build(Walk(20, bad=(1, 2, 3, 9, 14, 15)), tmp_path / "a")
        assert str(fault.value) == said
    lenient = replace(SETTINGS, frames=replace(SETTINGS.frames, max_bad_share=0.5))
    assert build(Walk(20, bad=(1, 2, 3, 9, 14, 15)), tmp_path / "a", lenient).info.counts.frames == 14


def test_the_first_bad_frame_stops_a_strict_build_with_its_own_sentence(tmp_path: Path) -> None:
    strict = replace(SETTINGS, frames=replace(SETTINGS.frames, on_bad="stop"))
    with pytest.raises(RecordingError) as fault:
        build(Walk(20, bad=(7,)), tmp_path / "a", strict)
    assert str(fault.value) == "walk/000007.png is truncated; leave that frame out."


def test_a_stopped_build_reads_no_finished_frame_again(tmp_path: Path) -> None:
    walk, read = Walk(20), []

    def frame_until_the_last_14(index: int):  # the checks read them before
        read.append(index)
        if index == 14 and read[-5:] == [10, 11, 12, 13, 14] and read.count(14) > 4:
            raise KeyboardInterrupt
        return Walk.frame(walk, index)

    walk.frame = frame_until_the_last_14
    with pytest.raises(KeyboardInterrupt):
        build(walk, tmp_path / "a")
    walk.frame = lambda index: read.append(index) or Walk.frame(walk, index)
    read.clear()
    build(walk, tmp_path / "a")
    assert read[-8:] == [12, 13, 14, 15, 16, 17, 18, 19]


def stop_after_four_parts(path: Path) -> None:
    """Leave a half-built map of 20 frames."""
    with pytest.raises(RecordingError):
        build(Walk(20, bad=(18,)), path, replace(SETTINGS, frames=replace(SETTINGS.frames, on_bad="stop")))


def test_without_resume_all_is_done_anew(tmp_path: Path) -> None:
    path = tmp_path / "a"
    stop_after_four_parts(path)
    assert len(list((path / "parts").glob("frames-*/*/done.safetensors"))) == 4
    walk, read = Walk(20), []
    walk.frame = lambda index: read.append(index) or Walk.frame(walk, index)
    build(walk, path, resume=False)
    assert any(read[i : i + 20] == list(range(20)) for i in range(len(read)))


def test_a_damaged_part_is_made_again(tmp_path: Path) -> None:
    path = tmp_path / "a"
    stop_after_four_parts(path)
    victim = sorted((path / "parts").rglob("done.safetensors"))[0]
    victim.write_bytes(victim.read_bytes()[:-1])
    build(Walk(20), path)
    build(Walk(20), tmp_path / "b")
    assert content_of(path) == content_of(tmp_path / "b")


def test_parts_of_other_settings_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "a"
    stop_after_four_parts(path)
    coarse = replace(SETTINGS, voxel_size_m=0.2)
    assert content_of(build(Walk(20), path, coarse).path) == content_of(build(Walk(20), tmp_path / "b", coarse).path)


def test_the_frame_step_is_kept(tmp_path: Path) -> None:
    settings = replace(SETTINGS, frames=replace(SETTINGS.frames, step=3))
    stored = build(Walk(20), tmp_path / "a", settings)
    assert stored.info.counts.frames == 7
    assert np.array_equal(np.unique(stored.voxels.last_seen_s), np.arange(0, 20, 3) * 0.1)


def test_what_is_told_of_a_map_is_plain_json(tmp_path: Path) -> None:
    stored = build(Walk(10), tmp_path / "a.avlmap")
    told = json.loads(json.dumps(describe(stored), allow_nan=False))
    assert told["frames"] == 10 and told["keyframes"] == len(stored.keyframes) and told["sounds"] == []
    assert told["voxels"] == len(stored.voxels) and told["profile"] == "fake"
    assert told["bytes"] == sum((stored.path / name).stat().st_size for name in stored.info.files)
    low, high = told["bounding_box_m"]
    centres = stored.grid.centre_of(stored.voxels.index)
    np.testing.assert_allclose(centres.min(axis=0) - 0.025, low, atol=1e-6)
    np.testing.assert_allclose(centres.max(axis=0) + 0.025, high, atol=1e-6)


def test_sounds_are_kept_with_their_clips(tmp_path: Path) -> None:
    walk = Walk(22, audio=write_beeps(tmp_path / "beeps.flac"))
    stored = build(walk, tmp_path / "a.avlmap")
    assert len(stored.sounds) == 2
    np.testing.assert_allclose(stored.sounds.feature, [[0.6, 0.8]] * 2, atol=0.1)
    np.testing.assert_allclose(stored.sounds.onset_s, [0.3, 2.0], atol=0.1)
    for number in range(2):
        assert AudioTrack.open(stored.clip_path(number)).duration_s == pytest.approx(0.4, abs=0.1)
    first, second = describe(stored)["sounds"]
    assert first["position"] == pytest.approx([0.5, 0.0, 0.0], abs=0.1)
    assert second["position"] == pytest.approx([2.1, 0.0, 0.0], abs=0.1)
    assert not any("no sounds" in notice for notice in stored.info.notices)


def test_another_sound_track_is_another_map(tmp_path: Path) -> None:
    path = build(Walk(6, audio=write_beeps(tmp_path / "beeps.flac")), tmp_path / "a.avlmap").path
    with pytest.raises(MapError, match="of walk with another sound track"):
        build(Walk(6, audio=write_beeps(tmp_path / "others.flac", (1.0,))), path)


def test_keyframes_come_out_the_same_in_lots_of_any_size(tmp_path: Path) -> None:
    few, many = (
        build(Walk(16), tmp_path / str(size), replace(SETTINGS, frames=FrameSettings(per_part=size)))
        for size in (4, 400)
    )
    assert len(few.keyframes) > 4
    for name in axes_of(Keyframes):
        np.testing.assert_allclose(getattr(few.keyframes, name), getattr(many.keyframes, name), atol=1e-6)


@given(st.integers(1, 30), st.integers(1, 5))
def test_running_ahead_keeps_the_order(count: int, depth: int) -> None:
    assert list(run_ahead(range(count), depth)) == list(range(count))


def test_a_fault_of_the_producer_comes_out_in_its_place() -> None:
    def items() -> Iterator[int]:
        yield 1
        raise RecordingError("the second is broken")

    ahead = run_ahead(items())
    assert next(ahead) == 1
    with pytest.raises(RecordingError, match="the second is broken"):
        next(ahead)


def test_the_producer_stops_soon_after_the_consumer() -> None:
    made = []

    def items() -> Iterator[int]:
        for number in range(1000):
            made.append(number)
            yield number

    ahead = run_ahead(items(), depth=2)
    next(ahead)
    time.sleep(0.02)
    ahead.close()
    assert len(made) <= 5


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "a.avlmap"
    with pytest.raises(MapError) as fault:
        build(Walk(4), path)
    assert str(fault.value).startswith(f"Cannot write {path}: Not a directory; choose another folder")


def test_a_subset_is_a_recording() -> None:
    walk = Walk(10)
    half = Subset(walk, range(0, 10, 2))
    assert len(half) == 5 and half.frame(2).stamp_s == walk.stamps_s[4] and half.frame(2).index == 2
    assert half.name(2) == "000004" and half.fingerprint != Subset(walk, [0, 1]).fingerprint
    with pytest.raises(ValueError, match="rise strictly"):
        Subset(walk, [3, 3])


def test_maps_can_be_moved_and_copied(tmp_path: Path) -> None:
    path = build(Walk(6), tmp_path / "a").path
    moved = Path(shutil.move(path, tmp_path / "elsewhere"))
    assert open_stored(moved).info.counts.frames == 6


class Written(Walk):
    """A walk whose files are written while it is read."""

    writes = 0

    def frame(self, index: int) -> Frame:
        self.writes += index == 3
        return super().frame(index)

    def change_stamp(self) -> str:
        return str(self.writes)


def test_a_recording_that_is_written_while_it_is_mapped_makes_no_map(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="were written while it was mapped, so that the map would be of two recordings"):
        build_map(Written(8), tmp_path / "map", PROFILE, SETTINGS, progress=False)
    assert not (tmp_path / "map/map.json").exists() and not list((tmp_path / "map").glob("parts/*"))


@pytest.mark.slow
def test_changed_content_of_the_same_size_is_another_recording_to_a_build(tmp_path: Path) -> None:
    walk = write_folder(tmp_path / "walk")
    allow = ["geometry"]  # its floor is no plane of one world
    first = build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False, allow=allow)
    build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False)  # finished already
    file = walk / "depth/000002.png"
    size = file.stat().st_size
    save_depth(file, np.where(shots()[2].depth_mm > 0, shots()[2].depth_mm // 2, 0))
    with file.open("ab") as stream:
        stream.write(bytes(max(0, size - file.stat().st_size)))
    with pytest.raises(MapError, match=r"is a finished map already, of walk \(another recording, or it has changed\)"):
        build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False)
    again = build_map(
        open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False, overwrite=True, allow=["geometry"]
    )
    assert not np.array_equal(first.info.counts.voxels, again.info.counts.voxels)


def test_another_sound_file_of_the_same_size_is_another_build(tmp_path: Path) -> None:
    one, two = (write_beeps(tmp_path / name, onsets) for name, onsets in (("a.flac", (0.3,)), ("b.flac", (0.3,))))
    content = bytearray(two.read_bytes())
    content[-2000] ^= 1
    (tmp_path / "other").mkdir()
    changed = tmp_path / "other" / "a.flac"
    changed.write_bytes(content)
    keys = [audio_key(Walk(4, audio=file)) for file in (one, changed)]
    assert keys[0] != keys[1] and keys[0] == audio_key(Walk(4, audio=one))
