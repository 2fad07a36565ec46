"""The map that a Mapper makes frame by frame is the map that a build makes of the same frames, asked or not."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Corners, Hears, Places, Walk, Words, write_beeps

from avlmaps.core.errors import BackendError, MapError, RecordingError
from avlmaps.maps.build import build_map
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.map_data import MapData
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import Frame


class Few(Words):
    """The fake pixels for keyframes alone."""

    keyframes_only = True


def encoders(pixels: object) -> Encoders:
    return Encoders("fake", pixels=pixels, local=Corners(), place=Places())


def mapped(walk: Walk, used: Encoders, asked: frozenset[int] = frozenset(), first_frames: int = 60) -> Mapper:
    mapper = Mapper(SETTINGS, used, walk.up_in_world, first_frames=first_frames)
    for frame in walk.frames():
        mapper.add(frame)
        if frame.index in asked:
            mapper.snapshot()
    return mapper


def require_same(one: MapData, other: MapData) -> None:
    np.testing.assert_array_equal(one.voxels.index, other.voxels.index)
    for name in ("feature", "weight", "rgb", "last_seen_s", "hits"):
        np.testing.assert_allclose(getattr(one.voxels, name), getattr(other.voxels, name), rtol=1e-3, atol=2e-3)
    for field in fields(one.keyframes):
        mine, theirs = getattr(one.keyframes, field.name), getattr(other.keyframes, field.name)
        np.testing.assert_allclose(mine, theirs, rtol=1e-3, atol=2e-3, err_msg=field.name)
    np.testing.assert_allclose(one.up_in_world, other.up_in_world)


@pytest.mark.parametrize("pixels", [Words(), Few()], ids=["all", "keyframes"])
@pytest.mark.parametrize("first_frames", [60, 5])
def test_it_ends_as_a_build_does_whatever_is_asked_on_the_way(
    tmp_path: Path, pixels: object, first_frames: int
) -> None:
    walk, used = Walk(10), encoders(pixels)
    built = build_map(walk, tmp_path / "built", used, SETTINGS, progress=False)
    require_same(mapped(walk, used, first_frames=first_frames).finish(), built)
    made = mapped(walk, used, frozenset({1, 6}), first_frames).finish()
    require_same(made, built)
    write(tmp_path / "saved", made)
    saved = read(tmp_path / "saved")
    require_same(saved, built)
    assert saved.info.counts == built.info.counts and saved.info.models == built.info.models


def test_sounds_end_as_in_a_build_and_are_there_before(tmp_path: Path) -> None:
    walk = Walk(22, audio=write_beeps(tmp_path / "track.flac"))
    used = Encoders("fake", pixels=Words(), local=Corners(), place=Places(), sounds=Hears())
    built = build_map(walk, tmp_path / "built", used, SETTINGS, progress=False)
    mapper, listed = Mapper(SETTINGS, used, walk.up_in_world), []
    assert walk.audio is not None
    for frame in walk.frames():
        mapper.add(frame)
        mapper.add_sound(walk.audio.read(frame.stamp_s, frame.stamp_s + 0.1), frame.stamp_s)
        listed.append(len(mapper.snapshot().sounds) if frame.index % 5 == 1 else 0)
    mapper.add_sound(walk.audio.read(2.2, 4.0), 2.2)
    assert listed[5] == 0 and listed[-1] == 1  # it ends after 0.7 s
    made = mapper.finish()
    require_same(made, built)
    assert len(made.sounds) == 2
    for field in fields(made.sounds):
        if field.name != "clips":
            np.testing.assert_allclose(getattr(made.sounds, field.name), getattr(built.sounds, field.name), atol=1e-6)
    assert [clip.read_bytes() for clip in made.sounds.clips] == [clip.read_bytes() for clip in built.sounds.clips]


def test_a_snapshot_after_nothing_has_the_arrays_of_the_last() -> None:
    mapper = mapped(Walk(6), encoders(Words()))
    one, other = mapper.snapshot(), mapper.snapshot()
    assert one.voxels is other.voxels
    mapper.add(Walk(7).frame(6))
    assert mapper.snapshot(absorb=False).voxels is one.voxels
    assert mapper.snapshot().voxels is not one.voxels


@pytest.mark.parametrize(
    "broken",
    [
        lambda grid: grid[..., :3],
        lambda grid: np.where(np.arange(4) > 1, np.nan, grid),
        lambda grid: 3.0 * grid,
        lambda grid: "nothing",
        lambda grid: 1 / 0,
    ],
)
def test_an_encoder_that_breaks_its_protocol_in_the_middle_costs_that_frame_alone(broken) -> None:
    class Breaking(Words):
        def encode(self, frame: Frame) -> np.ndarray:
            grid = super().encode(frame)
            return broken(grid) if frame.index == 5 else grid

    walk = Walk(9)
    mapper, others = (
        Mapper(SETTINGS, encoders(one), walk.up_in_world, first_frames=1) for one in (Breaking(), Words())
    )
    for frame in walk.frames():
        if frame.index == 5:
            with pytest.raises(BackendError, match="000005"):
                mapper.add(frame)
        else:
            mapper.add(frame)
            others.add(frame)
    require_same(mapper.finish(), others.finish())


def test_frames_come_in_the_order_of_time_from_one_camera() -> None:
    mapper, frame = mapped(Walk(4), Encoders()), Walk(4).frame(3)
    with pytest.raises(RecordingError, match=r"at 0.3 s repeats the last frame \(0.3 s\)"):
        mapper.add(frame)
    camera = replace(frame.rig.rgb, fx=30.0)
    with pytest.raises(RecordingError, match="has another camera than the frames before"):
        mapper.add(replace(frame, stamp_s=5.0, rig=replace(frame.rig, rgb=camera)))
    assert len(mapper) == 4 and len(mapper.snapshot().voxels) > 0


def test_a_map_without_frames_is_refused() -> None:
    for make in (Mapper.snapshot, Mapper.finish):
        with pytest.raises(MapError, match="has no frame yet"):
            make(Mapper(SETTINGS, Encoders()))


def test_only_a_few_frames_are_held_however_many_come() -> None:
    mapper = Mapper(replace(SETTINGS, gravity=replace(SETTINGS.gravity, frames=4)), Encoders(), Walk(1).up_in_world)
    for frame in Walk(40).frames():
        mapper.add(frame)
    assert len(mapper._held) <= 4 and not mapper._first and not mapper._undescribed
