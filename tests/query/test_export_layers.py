"""What a map shows in other programs: every layer in one frame, and OpenLex3D's files as its description says."""

import errno
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import asked, furnished_map

from avlmaps.core.errors import BackendError, QueryError
from avlmaps.core.poses import FrameName, from_quaternion
from avlmaps.query import export
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.export import FILES, pcd_bytes, write_openlex3d
from avlmaps.query.export_viewers import ExportedSound, layers_of, write_foxglove, write_rerun

UPS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda up: np.linalg.norm(up) > 0.1)


def tilted(up: tuple[float, ...]) -> AVLMap:
    stored = furnished_map()
    stored.data.up_in_world = np.asarray(up, np.float64) / np.linalg.norm(up)
    return asked(stored)


@given(UPS)
def test_each_layer_turns_by_the_same_rotation(up: tuple[float, ...]) -> None:
    opened = tilted(up)
    level, own = (layers_of(opened, frame, least_confidence=0.0) for frame in (FrameName.LEVEL, FrameName.RECORDING))
    turn = opened.space.level
    np.testing.assert_allclose(level.points, turn(own.points.astype(np.float64)), atol=1e-4)
    assert len(level.things) == len(own.things) == len(opened.things(least_confidence=0.0)) > 0
    for ours, other in zip(level.things, own.things, strict=True):
        np.testing.assert_allclose(ours.centre, turn(np.array(other.centre)), atol=1e-6)
        np.testing.assert_allclose(np.abs(ours.quaternion), (0.0, 0.0, 0.0, 1.0), atol=1e-6)
    for ours, other in zip(level.sounds, own.sounds, strict=True):
        np.testing.assert_allclose(ours.position, turn(np.array(other.position)), atol=1e-6)
    np.testing.assert_allclose(
        level.frame_from_camera[:, :3, 3], turn(own.frame_from_camera[:, :3, 3]).reshape(-1, 3), atol=1e-6
    )


@given(UPS, st.sampled_from(FrameName))
def test_a_box_holds_its_thing_and_no_more(up: tuple[float, ...], frame: FrameName) -> None:
    opened = tilted(up)
    for box, thing in zip(
        layers_of(opened, frame, least_confidence=0.0).things, opened.things(least_confidence=0.0), strict=True
    ):
        points = opened.space.level(thing.points) if frame is FrameName.LEVEL else np.asarray(thing.points)
        axes = from_quaternion(np.array(box.centre), np.array(box.quaternion))
        own = (points - axes[:3, 3]) @ axes[:3, :3]  # in the box's axes
        extent = np.ptp(own, axis=0) + opened.space.grid.voxel_size_m
        np.testing.assert_allclose(extent, box.size, atol=1e-4)
        np.testing.assert_allclose(own.min(axis=0) + own.max(axis=0), 0.0, atol=1e-4)


def test_heat_is_that_of_the_question() -> None:
    opened = furnished_map()
    layers = layers_of(opened, heat="the chair")
    expected = opened.ask("the chair").heat
    assert layers.heat is not None and expected is not None
    assert layers.heat[0] == "the chair"
    np.testing.assert_allclose(layers.heat[1], expected.values)


def test_openlex3d_gets_a_point_and_a_feature_for_each_voxel_that_has_one(tmp_path: Path) -> None:
    opened = furnished_map()
    assert [path.name for path in write_openlex3d(tmp_path / "out", opened)] == list(FILES)
    features, index = (np.load(tmp_path / "out" / name) for name in FILES[:2])
    points, colors = read_pcd((tmp_path / "out" / FILES[2]).read_bytes())
    seen = np.asarray(opened.data.voxels.weight) > 0
    np.testing.assert_allclose(points, opened.points[seen], atol=1e-5)
    np.testing.assert_array_equal(colors, opened.colors[seen])
    np.testing.assert_allclose(features[index], opened.data.voxels.feature[seen], atol=1e-3)


def test_a_pcd_is_read_by_open3d(tmp_path: Path) -> None:
    open3d = pytest.importorskip("open3d")
    points, colors = np.arange(12, dtype=np.float32).reshape(4, 3), np.arange(12, dtype=np.uint8).reshape(4, 3)
    (tmp_path / "a.pcd").write_bytes(pcd_bytes(points, colors))
    read = open3d.io.read_point_cloud(str(tmp_path / "a.pcd"))
    np.testing.assert_allclose(np.asarray(read.points), points)
    np.testing.assert_allclose(np.asarray(read.colors) * 255, colors, atol=0.5)


def read_pcd(content: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Read a binary PCD by its header alone."""
    head, _, body = content.partition(b"DATA binary\n")
    said = dict(line.split(" ", 1) for line in head.decode().splitlines() if not line.startswith("#"))
    assert (said["FIELDS"], said["SIZE"], said["TYPE"]) == ("x y z rgb", "4 4 4 4", "F F F F")
    rows = np.frombuffer(body, "<f4").reshape(int(said["POINTS"]), 4)
    packed = np.ascontiguousarray(rows[:, 3]).view("<u4")
    return rows[:, :3], np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=1)


@pytest.mark.parametrize(
    ("write", "module", "extra"), [(write_rerun, "rerun", "rerun"), (write_foxglove, "foxglove", "foxglove")]
)
def test_a_missing_package_is_named_with_what_installs_it(
    write: object, module: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert callable(write)
    with pytest.raises(BackendError, match=rf"\[{extra}\]"):
        write(tmp_path / "a.out", layers_of(furnished_map()))
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(QueryError, match="cannot be written"):
        write_openlex3d(tmp_path / "file" / "out", furnished_map())


def test_a_sound_has_its_name_apart_from_how_sure_it_is() -> None:
    named = ExportedSound("dog bark", 0.754, (0.0, 0.0, 0.0), 1.0, 2.0)
    nameless = ExportedSound("sound", None, (0.0, 0.0, 0.0), 1.0, 2.0)
    assert (named.name, named.label, nameless.label) == ("dog bark", "dog bark 0.75", "sound")


def test_what_cannot_be_written_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(export, "write_bytes_atomically", full)
    (tmp_path / "there").mkdir()
    for folder in (tmp_path / "new", tmp_path / "there"):
        with pytest.raises(QueryError, match="No space left"):
            write_openlex3d(folder, furnished_map())
    with pytest.raises(QueryError, match="No such file"):  # a longer path is likely misspelt
        write_openlex3d(tmp_path / "new" / "out", furnished_map())
    assert [path.name for path in tmp_path.iterdir()] == ["there"]
