"""A map that grows frame by frame is the map that a build makes of the same frames, whatever is queried on the way."""

import gc
import warnings
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Corners, Ears, Pixels, Places, Walk, write_beeps
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError, MapError, RecordingError
from avlmaps.maps.build import build_map
from avlmaps.maps.growing import GrowingMap
from avlmaps.maps.keyframes.describe import KeyframeSettings, keyframes_by_motion, next_keyframe
from avlmaps.maps.store.reader import StoredMap, open_stored
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import Frame


class Words(Pixels):
    """The fake pixels, which know a word."""

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.tile(np.float32([0.5, 0.5, 0.5, 0.5]), (len(words), 1))


class Hears(Ears):
    """The fake ears, which can be asked."""

    def score_words(self, sounds: list[np.ndarray], words: list[str]) -> np.ndarray:
        return np.ones((len(sounds), len(words)), np.float32)

    def score_sounds(self, sounds: list[np.ndarray], asked: np.ndarray) -> np.ndarray:
        return np.ones(len(sounds), np.float32)


class Few(Words):
    """The same, for keyframes alone."""

    keyframes_only = True


def encoders(pixels: object) -> Encoders:
    return Encoders("fake", pixels=pixels, local=Corners(), place=Places())


def grown(walk: Walk, used: Encoders, asked: frozenset[int] = frozenset(), frames: int = 60) -> GrowingMap:
    gravity = replace(SETTINGS.gravity, frames=frames)
    growing = GrowingMap(replace(SETTINGS, gravity=gravity), used, walk.up_in_world)
    for frame in walk.frames():
        growing.add(frame)
        if frame.index in asked:
            growing.stored()
    return growing


def require_same(one: StoredMap, other: StoredMap) -> None:
    np.testing.assert_array_equal(one.voxels.index, other.voxels.index)
    for name in ("feature", "weight", "rgb", "last_seen_s", "hits"):
        np.testing.assert_allclose(getattr(one.voxels, name), getattr(other.voxels, name), rtol=1e-3, atol=2e-3)
    for field in fields(one.keyframes):
        mine, theirs = getattr(one.keyframes, field.name), getattr(other.keyframes, field.name)
        np.testing.assert_allclose(mine, theirs, rtol=1e-3, atol=2e-3, err_msg=field.name)
    np.testing.assert_allclose(one.up_in_world, other.up_in_world)


@pytest.mark.parametrize("pixels", [Words(), Few()], ids=["all", "keyframes"])
@pytest.mark.parametrize("waits", [60, 5])
def test_it_ends_as_a_build_does_whatever_is_queried_on_the_way(tmp_path: Path, pixels: object, waits: int) -> None:
    walk, used = Walk(10), encoders(pixels)
    built = build_map(walk, tmp_path / "built", used, SETTINGS, progress=False)
    require_same(grown(walk, used, frames=waits).stored(final=True), built)
    asked = grown(walk, used, frozenset({1, 6}), frames=waits)
    require_same(asked.stored(final=True), built)
    saved = asked.save(tmp_path / "saved")
    require_same(saved, built)
    require_same(open_stored(tmp_path / "saved"), built)
    assert saved.info.counts == built.info.counts and saved.info.models == built.info.models


def test_sounds_end_as_in_a_build_and_are_there_before(tmp_path: Path) -> None:
    walk = Walk(22, audio=write_beeps(tmp_path / "track.flac"))
    used = Encoders("fake", pixels=Words(), local=Corners(), place=Places(), sounds=Hears())
    built = build_map(walk, tmp_path / "built", used, SETTINGS, progress=False)
    growing, listed = GrowingMap(SETTINGS, used, walk.up_in_world), []
    for frame in walk.frames():
        growing.add(frame)
        growing.add_audio(walk.audio.read(frame.stamp_s, frame.stamp_s + 0.1), frame.stamp_s)
        listed.append(len(growing.stored().sounds) if frame.index % 5 == 1 else 0)
    growing.add_audio(walk.audio.read(2.2, 4.0), 2.2)
    assert listed[5] == 0 and listed[-1] == 1  # it ends after 0.7 s
    saved = growing.save(tmp_path / "saved")
    require_same(saved, built)
    assert len(saved.sounds) == 2
    for field in fields(saved.sounds):
        if field.name != "clips":
            np.testing.assert_allclose(getattr(saved.sounds, field.name), getattr(built.sounds, field.name), atol=1e-6)
    clips = [sorted((path / "sounds").glob("*.flac")) for path in (tmp_path / "saved", tmp_path / "built")]
    assert [file.read_bytes() for file in clips[0]] == [file.read_bytes() for file in clips[1]]


@pytest.mark.parametrize("frames", [22, 9])
def test_the_voxels_of_many_parts_are_those_of_a_build_bit_by_bit(tmp_path: Path, frames: int) -> None:
    walk, used = Walk(frames), encoders(Words())
    built = build_map(walk, tmp_path / "built", used, SETTINGS, progress=False)
    asked = grown(walk, used, frozenset(range(2, frames, 3)), frames=3)
    made = asked.stored(final=True).voxels
    for field in fields(made):
        np.testing.assert_array_equal(getattr(made, field.name), getattr(built.voxels, field.name), err_msg=field.name)


@given(
    steps=st.lists(st.tuples(st.floats(0.01, 0.3), st.floats(-0.3, 0.3), st.floats(-0.2, 0.2)), min_size=1, max_size=30)
)
def test_keyframes_that_are_decided_as_frames_come_are_those_of_the_whole_walk(steps: list) -> None:
    chosen = KeyframeSettings(translation_m=0.4, rotation_deg=20.0)
    stamps, place, turn = np.cumsum(np.array(steps), axis=0).T
    poses = np.tile(np.eye(4), (len(steps), 1, 1))
    poses[:, 0, 3] = place
    poses[:, 0, 0] = poses[:, 1, 1] = np.cos(turn)
    poses[:, 1, 0], poses[:, 0, 1] = np.sin(turn), -np.sin(turn)
    decided = [0]
    for count in range(1, len(steps) + 1):
        while (found := next_keyframe(stamps[decided[-1] : count], poses[decided[-1] : count], chosen)) is not None:
            decided.append(decided[-1] + found)
    whole = keyframes_by_motion(stamps, poses, chosen).tolist()
    assert whole[: len(decided)] == decided and len(whole) - len(decided) <= 3


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (
            lambda grid: grid[..., :3],
            r"gave float32 of \(6, 8, 3\) for 000005; features are",
        ),
        (lambda grid: grid[0], "features are float32 of"),
        (lambda grid: np.where(np.arange(4) > 1, np.nan, grid), r"NaN or infinite features for 000005 \(in 48 of 48"),
        (lambda grid: 3.0 * grid, r"of length 3 to 3 for 000005; each has unit length"),
        (lambda grid: "nothing", "features are float32 of"),
        (lambda grid: 1 / 0, "failed on 000005 with ZeroDivisionError"),
    ],
)
def test_an_encoder_that_breaks_its_protocol_in_the_middle_costs_that_frame_alone(broken, said: str) -> None:
    class Breaking(Words):
        def encode(self, frame: Frame) -> np.ndarray:
            grid = super().encode(frame)
            return broken(grid) if frame.index == 5 else grid

    walk = Walk(9)
    growing = GrowingMap(SETTINGS, encoders(Breaking()), walk.up_in_world)
    for frame in walk.frames():
        if frame.index == 5:
            with pytest.raises(BackendError, match=said):
                growing.add(frame)
        else:
            growing.add(frame)
    others = GrowingMap(SETTINGS, encoders(Words()), walk.up_in_world)
    for frame in walk.frames():
        if frame.index != 5:
            others.add(frame)
    require_same(growing.stored(final=True), others.stored(final=True))


def test_frames_come_in_the_order_of_time_from_one_camera() -> None:
    growing = grown(Walk(4), Encoders())
    frame = Walk(4).frame(3)
    with pytest.raises(RecordingError, match=r"at 0.3 s repeats the last frame \(0.3 s\)"):
        growing.add(frame)
    camera = replace(frame.rig.rgb, fx=30.0)
    with pytest.raises(RecordingError, match="has another camera than the frames before"):
        growing.add(replace(frame, stamp_s=5.0, rig=replace(frame.rig, rgb=camera)))
    assert len(growing) == 4 and len(growing.stored().voxels) > 0


def test_a_map_without_frames_and_a_folder_that_is_taken_are_refused(tmp_path: Path) -> None:
    growing = GrowingMap(SETTINGS, Encoders(), None)
    with pytest.raises(MapError, match="has no frame yet"):
        growing.stored()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    for frame in Walk(4).frames():
        growing.add(frame)
    with pytest.raises(MapError, match="is not a map"):
        growing.save(tmp_path / "mine")
    growing.save(tmp_path / "map")
    with pytest.raises(MapError, match="is a finished map already"):
        growing.save(tmp_path / "map")
    assert len(growing.save(tmp_path / "map", overwrite=True).voxels) > 0


def test_only_a_few_frames_are_held_however_many_come() -> None:
    walk = Walk(40)
    growing = grown(walk, Encoders(), frames=4)
    held = growing._walk.held()
    assert len(held) <= 4 and held.stamps_s[0] == 0.0
    assert len(growing._keyframes.undecided) < 8 and not growing._waiting


def test_its_temporary_files_are_closed_when_it_goes(tmp_path: Path) -> None:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ResourceWarning)
        growing = grown(Walk(6), encoders(Words()), frames=3)
        assert len(growing.stored().keyframes)
        del growing
        gc.collect()
    assert [str(one.message) for one in said if one.category is ResourceWarning] == []
