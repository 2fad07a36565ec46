"""What of importing the published code's maps needs no h5py: where cells lie, which files there are, what is told."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.extras import install_command
from avlmaps.maps.grid import GridSpec
from avlmaps.recordings.formats.layouts import WORLD_FROM_HABITAT, base_from_camera, reference_map_from_world
from avlmaps_models.import_reference.convert import ImportSettings, import_reference_map
from avlmaps_models.import_reference.places import Cubes, cubes_from_corner, cubes_from_first_base, voxels_filled
from avlmaps_models.import_reference.scene import find_scene
from avlmaps_models.import_reference.views import middles_of_view, thinned


def _cells(points_map: np.ndarray, grid: int, cell_m: float) -> np.ndarray:
    """The published formula, point by point."""
    return np.array(
        [
            [int(grid / 2 - int(x / cell_m)), int(grid / 2 - int(y / cell_m)), int(z / cell_m)]
            for x, y, z in points_map.tolist()
        ]
    )


def _habitat_pose(yaw: float, place: tuple[float, float, float]) -> np.ndarray:
    return poses.from_quaternion(np.array(place), np.array([0.0, np.sin(yaw / 2), 0.0, np.cos(yaw / 2)]))


def _nearest(cubes: Cubes, row: int, point_world: np.ndarray) -> np.ndarray:
    """The offset along the grid's axes from the cube of a row that is nearest over the ground."""
    point = poses.apply(poses.inverse(cubes.world_from_grid), point_world)
    off = cubes.middle[cubes.row == row] - point
    return off[np.abs(off[:, :2]).max(axis=1).argmin()]


@given(
    st.floats(-3.1, 3.1),
    st.tuples(*[st.floats(-20.0, 20.0)] * 3),
    st.sampled_from([(1000, 0.05), (300, 0.1), (401, 0.05)]),
    st.integers(0, 1000),
)
def test_a_point_lies_in_the_cubes_of_its_cell(yaw, place, grid_of, seed) -> None:
    grid, cell_m = grid_of
    first = _habitat_pose(yaw, place)
    world_from_map = poses.inverse(reference_map_from_world(first))
    points_map = np.random.default_rng(seed).uniform([-3.0, -3.0, 0.0], [3.0, 3.0, 1.5], (60, 3))
    points_map[:10, :2] *= 0.02  # the wide cells at the origin
    cubes = cubes_from_first_base(_cells(points_map, grid, cell_m), grid, cell_m, first)
    for row, point in enumerate(poses.apply(world_from_map, points_map)):
        wide = np.array([0.5, 0.5, 1.0 if points_map[row, 2] < cell_m else 0.5])
        assert (np.abs(_nearest(cubes, row, point)) <= wide * cell_m + 1e-9).all()


def test_cells_are_not_shifted_against_the_points() -> None:
    rng = np.random.default_rng(1)
    points_map = rng.uniform([-8.0, -8.0, 0.05], [8.0, 8.0, 1.5], (3000, 3))
    first = _habitat_pose(0.6, (11.9, -1.3, -0.1))
    cubes = cubes_from_first_base(_cells(points_map, 1000, 0.05), 1000, 0.05, first)
    truth = poses.apply(poses.inverse(reference_map_from_world(first)), points_map)
    off = np.array([_nearest(cubes, row, point) for row, point in enumerate(truth)])
    assert np.abs(off.mean(axis=0)).max() < 0.002


def test_the_point_of_a_camera_reaches_its_own_cell_from_both_sides() -> None:
    """Ours: T P C p. Theirs: B_0⁻¹ B_i T C p, then the cell, then back."""
    first, later = _habitat_pose(0.4, (1.0, -1.2, 3.0)), _habitat_pose(-1.1, (2.5, -1.2, 1.0))
    seen = np.array([[0.4, -0.2, 2.2], [-1.0, 0.9, 3.1]])
    ours = poses.apply(WORLD_FROM_HABITAT @ later @ base_from_camera(), seen)
    cubes = cubes_from_first_base(
        _cells(poses.apply(reference_map_from_world(first), ours), 1000, 0.05), 1000, 0.05, first
    )
    for row, point in enumerate(ours):
        assert np.abs(_nearest(cubes, row, point)).max() <= 0.025 + 1e-9


def test_cells_of_a_cloud_are_centred_where_they_were_rounded() -> None:
    points = np.random.default_rng(2).uniform(-4.0, 4.0, (500, 3))
    low = points.min(axis=0)
    cubes = cubes_from_corner(np.round((points - low) / 0.05).astype(int), 0.05, low)
    found = poses.apply(cubes.world_from_grid, cubes.middle)
    assert np.abs(found - poses.apply(WORLD_FROM_HABITAT, points)).max() <= 0.025 + 1e-9


@given(st.floats(-3.1, 3.1), st.tuples(*[st.floats(-20.0, 20.0)] * 3))
def test_a_full_floor_has_no_holes_and_no_cell_is_lost(yaw, place) -> None:
    side, first = 31, _habitat_pose(yaw, place)
    row, column = (a.ravel() for a in np.meshgrid(np.arange(side), np.arange(side)))
    cell = np.stack([row + 500 - side // 2, column + 500 - side // 2, np.full(side * side, 6)], axis=1)
    cubes, grid = cubes_from_first_base(cell, 1000, 0.05, first), GridSpec(0.05)
    rows, voxels = voxels_filled(cubes, grid)
    assert (np.diff(rows) >= 0).all() and set(rows) == set(range(side * side))
    filled = set(map(tuple, voxels.tolist()))
    middle = grid.index_of(poses.apply(cubes.world_from_grid, np.array([[0.0, 0.0, 0.325]])))[0]
    for i in range(-9, 10):
        for j in range(-9, 10):
            levels = [(middle[0] + i, middle[1] + j, middle[2] + k) in filled for k in (-1, 0, 1)]
            assert any(levels), (i, j)
    centres = poses.apply(poses.inverse(cubes.world_from_grid), grid.centre_of(voxels))
    assert np.abs(centres[:, 2] - 0.325).max() <= 0.05


def test_cells_along_our_axes_are_taken_one_for_one() -> None:
    rng = np.random.default_rng(4)
    cell = np.unique(rng.integers((1, 1, 1), (400, 400, 30), (5000, 3)), axis=0)  # none of the wide ones
    cubes = cubes_from_first_base(cell, 1000, 0.05, _habitat_pose(np.pi / 2, (1.013, -1.28, 7.021)))
    rows, voxels = voxels_filled(cubes, GridSpec(0.05))
    assert rows.tolist() == list(range(len(cell)))
    assert len(np.unique(voxels, axis=0)) == len(cell)


def _room_pose(heading: float) -> np.ndarray:
    forward = np.array([np.cos(heading), np.sin(heading), 0.0])
    pose = np.eye(4)
    pose[:3, 2], pose[:3, 1] = forward, (0.0, 0.0, -1.0)
    pose[:3, 0] = np.cross(pose[:3, 1], forward)
    pose[:3, 3] = (0.0, 0.0, 1.5)
    return pose


def test_what_a_camera_saw_is_the_nearest_and_lies_ahead() -> None:
    side = np.arange(-4.0, 4.0, 0.05)
    height = np.arange(0.0, 3.0, 0.05)
    y, z = (a.ravel() for a in np.meshgrid(side, height))
    near, behind_it = (np.stack([np.full_like(y, x), y, z], axis=1) for x in (2.0, 4.0))
    places = thinned(np.concatenate([near, behind_it]))
    camera = Pinhole(540.0, 540.0, 540.0, 360.0, 1080, 720)
    ahead, away = middles_of_view(places, [_room_pose(0.0), _room_pose(np.pi)], camera)
    assert np.allclose(ahead, [2.0, 0.0, 1.5], atol=0.2)  # the wall behind the wall is not seen
    assert np.allclose(away, [0.0, 0.0, 1.5])  # nothing is there: its own place
    assert middles_of_view(places, [], camera).shape == (0, 3)


def _touch(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"")
    return path


def test_the_files_of_a_scene_are_found_from_its_folder_and_from_a_file(tmp_path: Path) -> None:
    voxels = _touch(tmp_path / "vlmap/vlmaps.h5df")
    assert find_scene(tmp_path).poses is None
    with_poses = _touch(tmp_path / "poses.txt")
    areas = _touch(tmp_path / "area_map/clip_sparse_map.h5df")
    for source in (tmp_path, voxels):
        scene = find_scene(source)
        assert (scene.folder, scene.voxels, scene.areas, scene.poses) == (tmp_path, voxels, areas, with_poses)
        assert not scene.has_sound_map and not scene.has_visual_map
    own = _touch(tmp_path / "elsewhere/poses.txt")
    assert find_scene(tmp_path, poses=own).poses == own
    assert find_scene(tmp_path, poses=own).camera == tmp_path / "elsewhere/camera.json"


def test_what_is_left_behind_is_noticed(tmp_path: Path) -> None:
    _touch(tmp_path / "vlmap/vlmaps.h5df")
    _touch(tmp_path / "audio_video/audio_data_manual_level_2.pkl")
    _touch(tmp_path / "visual_map/x_query_features.h5df")
    scene = find_scene(tmp_path)
    assert scene.has_sound_map and scene.has_visual_map


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("", "holds no map of the reference code (vlmap/vlmaps.h5df is what it writes)"),
        ("nothing.h5df", "is not there; give a scene's folder or a file such as vlmap/vlmaps.h5df."),
        ("area_map/clip_sparse_map.h5df", "holds the areas alone; give the scene's folder"),
    ],
)
def test_what_is_no_map_is_told(source: str, sentence: str, tmp_path: Path) -> None:
    _touch(tmp_path / "area_map/clip_sparse_map.h5df")
    with pytest.raises(MapError) as fault:
        find_scene(tmp_path / source)
    assert sentence in str(fault.value)
    with pytest.raises(MapError, match="is not there, or is not a file"):
        find_scene(tmp_path, areas=tmp_path / "none.h5df")


def test_a_map_of_the_first_demonstration_is_refused_for_its_lost_heights(tmp_path: Path) -> None:
    _touch(tmp_path / "map/grid_lseg_1.npy")
    with pytest.raises(MapError, match=r"top-down map .*\(map/grid_lseg_1.npy\): the heights in it are lost"):
        find_scene(tmp_path)


@pytest.mark.parametrize("where", [1e9, np.nan, np.inf])
def test_voxels_beyond_the_horizon_are_refused(where: float) -> None:
    with pytest.raises(MapError, match="m from the origin, farther than any building is wide"):
        cubes_from_corner(np.zeros((1, 3), int), 0.05, np.array([0.0, where, 0.0]))


def test_without_h5py_the_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    voxels = _touch(tmp_path / "vlmap/vlmaps.h5df")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(BackendError) as fault:
        import_reference_map(voxels, tmp_path / "m.avlmap")
    assert (
        str(fault.value)
        == f"Reading .h5df files needs h5py; get it with: {install_command('paper', distribution='avlmaps-models')}"
    )
    assert not (tmp_path / "m.avlmap").exists()


def test_nothing_but_a_map_is_replaced(tmp_path: Path) -> None:
    _touch(tmp_path / "mine/thesis.txt")
    with pytest.raises(MapError, match="is there already and is not a map"):
        import_reference_map(tmp_path, tmp_path / "mine")


@pytest.mark.parametrize("given", [{"cell_size_m": 0.0}, {"cell_size_m": float("nan")}, {"max_bad_share": 1.5}])
def test_settings_that_make_no_sense_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(MapError, match="choose between"):
        ImportSettings(**given)
