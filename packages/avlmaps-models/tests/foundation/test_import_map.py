"""Maps of the published code, imported: they lie where our own map of the same recording lies, and answer the same."""

import json
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from reference_map import (
    CELL_M,
    CODES,
    GRID,
    NAMES,
    ROOM_3D,
    WORDS,
    WORLD_FROM_ROOM,
    KnowsTheRoom,
    Seen,
    area_arrays,
    one_voxel,
    reference_arrays,
    walk,
    write_h5,
    write_scene,
    write_walk,
)
from scipy.spatial import KDTree
from tiny.lseg import Sizes as LSegSizes
from tiny.lseg import lseg_layout, random_weights, write_checkpoint

import avlmaps
from avlmaps.cli.main import main
from avlmaps.core import poses, registry
from avlmaps.core.errors import MapError
from avlmaps.core.registry import Backend, Kind
from avlmaps.maps.build import BuildSettings, build_map
from avlmaps.perception.encoders import Encoders, register_profile
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.formats.layouts import base_poses
from avlmaps_models.import_reference.convert import ImportSettings, import_reference_map

SETTINGS = ImportSettings(cell_size_m=CELL_M)
# From a point to the middle of the reference's cell, from there to the middle of ours, and from the point to that of
# our own build: half a diagonal each; the cells at the origin are twice as wide.
FAR_M = 0.5 * np.sqrt(3.0) * CELL_M


@pytest.fixture(scope="module")
def seen() -> list[Seen]:
    return walk()


@pytest.fixture(scope="module")
def arrays(seen: list[Seen]) -> dict[str, np.ndarray]:
    return reference_arrays(seen)


@pytest.fixture(scope="module")
def scene(seen: list[Seen], arrays: dict[str, np.ndarray], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_scene(tmp_path_factory.mktemp("data") / "5LpN3gDmAk7_1", seen)
    write_h5(folder / "vlmap/vlmaps.h5df", arrays)
    write_h5(folder / "area_map/clip_sparse_map.h5df", area_arrays(seen))
    return folder


@pytest.fixture(scope="module")
def imported(scene: Path) -> AVLMap:
    return import_reference_map(scene, scene.parent / "theirs.avlmap", SETTINGS, progress=False)


@pytest.fixture
def room_words(seen: list[Seen], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Put a pixel encoder that knows the room in the place of LSeg."""
    monkeypatch.setattr(KnowsTheRoom, "seen", seen)
    lseg = Backend(Kind.PIXELS, "lseg", "reference_map:KnowsTheRoom", model="demo_e200.ckpt", licence="MIT")
    monkeypatch.setitem(registry._registered, (Kind.PIXELS, "lseg"), lseg)
    registry.forget_loaded()
    yield
    registry.forget_loaded()


def _own(scene: Path, path: Path) -> AVLMap:
    register_profile(Encoders(name="room words", pixels="lseg"))
    recording = avlmaps.open_recording(scene)
    made = build_map(recording, path, "room words", BuildSettings(voxel_size_m=CELL_M), progress=False)
    return AVLMap(made, path=path)


def test_the_map_is_whole_and_tells_what_it_is(imported: AVLMap, arrays: dict[str, np.ndarray]) -> None:
    stored = AVLMap.open(imported.path)
    counts = stored.data.info.counts
    assert (counts.frames, counts.keyframes, counts.sounds) == (14, 14, 0)
    assert len(arrays["grid_pos"]) < counts.voxels < 1.2 * len(arrays["grid_pos"])
    assert stored.encoders.name == "paper" and stored.data.grid.voxel_size_m == CELL_M
    assert {kind: (m.id, m.dim, m.checksum) for kind, m in stored.data.info.models.items()} == {
        "pixels": ("demo_e200.ckpt", 512, ""),
        "views": ("openai/clip-vit-large-patch14", 768, ""),
    }
    assert any("from which weights its features are is not recorded" in notice for notice in stored.data.info.notices)
    assert stored.data.info.recording.name == "5LpN3gDmAk7_1" and stored.data.info.recording.format == "vlmaps.h5df"
    norm = np.linalg.norm(stored.data.voxels.feature.astype(np.float64), axis=1)
    assert np.allclose(norm, 1.0, atol=2e-3)
    assert stored.data.up_in_world.tolist() == [0.0, 0.0, 1.0]


def test_each_voxel_lies_on_the_thing_that_its_feature_names(imported: AVLMap) -> None:
    centres = imported.data.grid.centre_of(imported.data.voxels.index)
    in_room = poses.apply(poses.inverse(WORLD_FROM_ROOM), centres)
    named = np.argmax(imported.data.voxels.feature.astype(np.float32) @ CODES.T, axis=1)
    off = np.full(len(centres), np.inf)
    for name, box in zip(NAMES, ROOM_3D.scene.boxes, strict=True):
        mine = named == WORDS.index(name)
        outside = np.maximum(np.maximum(box[0] - in_room, in_room - box[1]), 0.0)
        off[mine] = np.minimum(off[mine], np.linalg.norm(outside, axis=1)[mine])
    wall = named == WORDS.index("wall")
    off[wall] = np.abs(np.stack([in_room, in_room - ROOM_3D.size])).min(axis=(0, 2))[wall]
    assert set(named) >= {WORDS.index(name) for name in ("sofa", "fridge", "table", "wall", "plant")}
    assert off.max() < 2 * FAR_M + CELL_M
    assert np.median(off) < 0.5 * CELL_M


def test_voxels_lie_where_our_own_build_of_the_recording_has_them(
    scene: Path, imported: AVLMap, room_words: None, tmp_path: Path
) -> None:
    own = _own(scene, tmp_path / "own.avlmap")
    ours, theirs = (stored.data.grid.centre_of(stored.data.voxels.index) for stored in (own, imported))
    assert KDTree(ours).query(theirs)[0].max() < 3 * FAR_M + 0.5 * CELL_M
    # What the reference keeps: from the first base's height (and a cell below it) to the camera's.
    height = ours[:, 2] - WORLD_FROM_ROOM[2, 3]
    kept = ours[(height > 0.0) & (height < 1.5 - CELL_M)]
    away, nearest = KDTree(theirs).query(kept)
    assert np.mean(away < 3 * FAR_M) > 0.99  # the rest was farther than 6 m from the camera
    # No shift: half a cell of one would show in the mean.
    shift = (theirs[nearest] - kept)[away < 3 * FAR_M].mean(axis=0)
    assert np.abs(shift).max() < 0.15 * CELL_M


def test_goals_are_those_of_our_own_map(scene: Path, imported: AVLMap, room_words: None, tmp_path: Path) -> None:
    own = _own(scene, tmp_path / "own.avlmap")
    theirs = AVLMap.open(imported.path)
    for word in ("sofa", "fridge", "sideboard"):
        here, there = (asked.object(word, primary=True).goals(top=1)[0] for asked in (own, theirs))
        assert theirs.object(word, primary=True).found
        assert np.linalg.norm(np.subtract(here.position, there.position)[:2]) < 0.4, word


@pytest.mark.parametrize("dim", [512, 32])
def test_lseg_itself_is_taken_though_its_weights_are_not_known(dim: int, imported: AVLMap, models: Path) -> None:
    layout = lseg_layout(LSegSizes(dim=dim))
    write_checkpoint(models / "demo_e200.ckpt", random_weights(layout, half=("clip_pretrained.",)))
    registry.forget_loaded()
    stored = AVLMap.open(imported.path)
    if dim == 512:
        heat = stored.object("sofa", primary=True)
        assert heat.values.min() >= 0.0 and np.isfinite(heat.values).all()
    else:
        with pytest.raises(MapError, match=r"have 512 numbers, those of demo_e200\.ckpt 32"):
            stored.require_model(Kind.PIXELS)
    registry.forget_loaded()


def test_a_voxel_has_the_feature_colour_and_weight_of_the_cell_that_holds_its_middle(
    imported: AVLMap, arrays: dict[str, np.ndarray], seen: list[Seen]
) -> None:
    """The published formulas again, from the middle of each of our voxels to the reference's cell."""
    voxels, first = imported.data.voxels, base_poses(seen[0].habitat_from_base)
    in_map = poses.apply(poses.inverse(first), imported.data.grid.centre_of(voxels.index)) / CELL_M
    alike = held = 0
    for i, (x, y, z) in enumerate(in_map.tolist()):
        number = arrays["occupied_ids"][int(GRID / 2 - int(x)), int(GRID / 2 - int(y)), int(z)] if z >= 0.0 else -1
        if number < 0 or int(z) == 0:
            continue
        held += 1
        feature = arrays["grid_feat"][number] / np.linalg.norm(arrays["grid_feat"][number])
        alike += (
            np.allclose(voxels.feature[i], feature, atol=1e-3)
            and np.array_equal(voxels.rgb[i], arrays["grid_rgb"][number])
            and np.isclose(voxels.weight[i], max(arrays["weight"][number], 1e-30), rtol=1e-5)
        )
    layer = np.floor(in_map[:, 2])
    assert held > 0.8 * (layer > 0).sum()  # the others hold the middle of a cell that held no middle of ours
    assert alike > 0.9 * held  # the others hold such a cell besides


def test_keyframes_have_the_cameras_poses_and_the_views(scene: Path, imported: AVLMap, seen: list[Seen]) -> None:
    recording = avlmaps.open_recording(scene)
    keyframes = imported.data.keyframes
    assert np.allclose(keyframes.world_from_camera, recording.world_from_camera, atol=1e-6)
    assert np.allclose(keyframes.stamp_s, recording.stamps_s)
    assert np.allclose(keyframes.view, area_arrays(seen)["clip_sparse_map"], atol=1e-6)
    assert (imported.data.rig.rgb, imported.data.rig.depth) == (recording.rig.rgb, recording.rig.depth)
    for index, centre in enumerate(keyframes.centre):
        depth, pose = recording.frame(index).depth_m, recording.world_from_camera[index]
        rays = recording.rig.depth.backproject(depth).reshape(-1, 3)
        truth = np.median(poses.apply(pose, rays[rays[:, 2] < 6.0]), axis=0)
        assert np.linalg.norm(centre[:2] - truth[:2]) < 1.5, index
        assert (poses.inverse(pose) @ [*centre, 1.0])[2] > 0.3, "ahead of the camera"


def test_photos_are_refused_in_a_sentence(imported: AVLMap, scene: Path) -> None:
    with pytest.raises(MapError, match="was built without a model for local"):
        imported.image(scene / "rgb/000003.png")
    assert not imported.sound("dog").found


def test_a_single_cell_goes_where_the_golden_vector_says(tmp_path: Path) -> None:
    """The first pose of the published scene; a cell 2 m ahead of it, 1 m to its left and 0.5 m up."""
    (tmp_path / "poses.txt").write_text("11.92911911 -1.28434992 -0.11747979 0 0 0 1\n")
    write_h5(tmp_path / "vlmap/vlmaps.h5df", one_voxel(grid=1000, layers=30, cell=(500 - 40, 500 - 20, 10)))
    stored = import_reference_map(tmp_path, tmp_path / "m.avlmap", progress=False)
    place = np.array([0.11747979 + 2.025, -11.92911911 + 1.025, -1.28434992 + 0.525])
    assert stored.data.voxels.index.tolist() == [np.floor(place / 0.05).astype(int).tolist()]
    assert stored.data.voxels.rgb.tolist() == [[200, 200, 200]]
    assert np.allclose(stored.data.voxels.feature, 512**-0.5, atol=1e-4)


def test_the_same_files_give_the_same_map_and_are_not_read_twice(scene: Path, imported: AVLMap, capsys) -> None:
    before = (imported.path / "map.json").read_bytes()
    again = import_reference_map(scene, imported.path, SETTINGS)
    assert (imported.path / "map.json").read_bytes() == before and "nothing to do" in capsys.readouterr().err
    anew = import_reference_map(scene, imported.path, SETTINGS, overwrite=True, progress=False)
    files = {name.replace(".2.", "."): file for name, file in anew.data.info.files.items()}  # of the second time
    assert files == again.data.info.files
    with pytest.raises(MapError, match="is a finished map already, of 5LpN3gDmAk7_1; give another path"):
        import_reference_map(scene, imported.path, ImportSettings(cell_size_m=0.2))


def test_without_areas_the_walk_stays_and_areas_are_refused(scene: Path, tmp_path: Path) -> None:
    stored = import_reference_map(scene / "vlmap/vlmaps.h5df", tmp_path / "m.avlmap", SETTINGS, progress=False)
    assert len(stored.data.keyframes) == 14 and stored.data.keyframes.view.shape == (14, 768)  # found beside
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "vlmaps.h5df").symlink_to(scene / "vlmap/vlmaps.h5df")
    stored = import_reference_map(
        alone / "vlmaps.h5df", tmp_path / "n.avlmap", SETTINGS, poses=scene / "poses.txt", progress=False
    )
    assert len(stored.data.keyframes) == 14 and stored.data.keyframes.view.shape == (14, 0)
    assert "views" not in stored.data.info.models
    with pytest.raises(avlmaps.core.errors.AvlmapsError, match="views"):
        stored.area("kitchen")


def test_the_first_pose_may_come_from_the_area_map(scene: Path, imported: AVLMap, tmp_path: Path) -> None:
    stored = import_reference_map(
        _copy(scene / "vlmap/vlmaps.h5df", tmp_path / "vlmaps.h5df"),
        tmp_path / "m.avlmap",
        SETTINGS,
        areas=scene / "area_map/clip_sparse_map.h5df",
        progress=False,
    )
    assert np.array_equal(stored.data.voxels.index, imported.data.voxels.index)


def _copy(source: Path, target: Path) -> Path:
    target.write_bytes(source.read_bytes())
    return target


def _cloud(arrays: dict[str, np.ndarray], order: tuple[int, int, int]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Make a map whose grid lies over a cloud of points, as the relatives do; return it and the points."""
    rng = np.random.default_rng(0)
    points = rng.uniform([-3.0, -0.4, 2.0], [4.0, 1.7, 6.0], (200, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    cell = np.round((points - low) / CELL_M).astype(np.int32)
    _, first = np.unique(cell, axis=0, return_index=True)
    size = np.ceil((high - low) / CELL_M + 1).astype(int)
    chosen = list(order)
    made = {
        "mapped_iter_list": np.arange(3, dtype=np.int32),
        "grid_feat": rng.normal(size=(len(first), 512)).astype(np.float32),
        "grid_pos": cell[first][:, chosen],
        "weight": np.ones(len(first), np.float32),
        "occupied_ids": -np.ones(size[chosen], np.int32),
        "grid_rgb": np.zeros((len(first), 3), np.uint8),
        "pcd_min": low,
        "pcd_max": high,
        "cs": np.float64(CELL_M),
    }
    return made, points[first]


@pytest.mark.parametrize(
    ("name", "order"),
    [("vlmap_multi_floor/vlmaps_multi_floor.h5df", (0, 2, 1)), ("vlmap_cam/vlmaps_cam.h5df", (0, 1, 2))],
)
def test_grids_over_a_cloud_need_no_pose(
    name: str, order: tuple[int, int, int], arrays: dict[str, np.ndarray], tmp_path: Path
) -> None:
    made, points = _cloud(arrays, order)
    write_h5(tmp_path / name, made)
    stored = import_reference_map(tmp_path, tmp_path / "m.avlmap", progress=False)
    assert stored.data.grid.voxel_size_m == CELL_M and len(stored.data.keyframes) == 0
    expected = np.stack([-points[:, 2], -points[:, 0], points[:, 1]], axis=1)  # x right, y up, z backward, turned
    away = KDTree(stored.data.grid.centre_of(stored.data.voxels.index)).query(expected)[0]
    assert away.max() < 2 * FAR_M


def test_features_of_nothing_stay_nothing(arrays: dict[str, np.ndarray], scene: Path, tmp_path: Path) -> None:
    feat = arrays["grid_feat"].copy()
    feat[:50] = 0.0
    source = write_h5(tmp_path / "vlmaps.h5df", {**arrays, "grid_feat": feat})
    stored = import_reference_map(source, tmp_path / "m.avlmap", SETTINGS, poses=scene / "poses.txt", progress=False)
    norm = np.linalg.norm(stored.data.voxels.feature.astype(np.float64), axis=1)
    nothing = norm == 0.0
    assert 0 < nothing.sum() <= 80 and np.allclose(norm[~nothing], 1.0, atol=2e-3)
    assert (np.asarray(stored.data.voxels.weight)[nothing] == 0.0).all()


def test_weights_that_vanish_do_not_take_the_feature_with_them(
    arrays: dict[str, np.ndarray], scene: Path, tmp_path: Path
) -> None:
    made = {**arrays, "weight": np.zeros_like(arrays["weight"]), "grid_feat": arrays["grid_feat"] * np.float32(1e-15)}
    source = write_h5(tmp_path / "vlmaps.h5df", made)
    stored = import_reference_map(source, tmp_path / "m.avlmap", SETTINGS, poses=scene / "poses.txt", progress=False)
    assert np.allclose(np.linalg.norm(stored.data.voxels.feature.astype(np.float64), axis=1), 1.0, atol=2e-3)


def _without(arrays: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    return {key: value for key, value in arrays.items() if key != name}


def _with_nan(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    feat = arrays["grid_feat"].copy()
    feat[7, 3] = np.nan
    return {**arrays, "grid_feat": feat}


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda a: _without(a, "grid_feat"), "has no grid_feat, as a map of the reference code has"),
        (lambda a: _without(a, "occupied_ids"), "has no occupied_ids"),
        (lambda a: {**a, "grid_feat": a["grid_feat"][:, :256]}, r"grid_feat is float32 of \(\d+, 256\), and a map"),
        (lambda a: {**a, "grid_pos": a["grid_pos"].astype(float)}, "grid_pos is float64 .* whole numbers"),
        (lambda a: {**a, "weight": a["weight"][:-1]}, "weight is float32 of"),
        (lambda a: {**a, "grid_pos": a["grid_pos"] + 200}, "is in cell .* outside of the grid"),
        (lambda a: {**a, "grid_pos": np.zeros_like(a["grid_pos"])}, "names the same cell twice"),
        (lambda a: {k: v if k == "occupied_ids" else v[:0] for k, v in a.items()}, "holds no voxels; the map is empty"),
        (_with_nan, r"1 of \d+ voxels hold NaN, infinity .* \(the first is 7\), more than 0%"),
        (lambda a: {**a, "weight": -a["weight"]}, r"voxels hold NaN, infinity or a colour or weight that is none"),
        (lambda a: {**a, "weight": np.array([b"x"] * len(a["weight"]))}, r"weight is \|S1 of"),
        (
            lambda a: {**a, "pcd_min": np.zeros(3), "pcd_max": np.ones(3), "cs": np.float64(0.05)},
            "grid has .* cells, but",
        ),
        (lambda a: {**a, "pcd_min": np.zeros(3), "pcd_max": np.ones(3), "cs": np.float64(0.0)}, "cs is 0.0"),
    ],
)
def test_what_is_wrong_with_the_voxels_is_one_sentence(
    spoil, sentence: str, arrays: dict[str, np.ndarray], scene: Path, tmp_path: Path
) -> None:
    source = write_h5(tmp_path / "vlmaps.h5df", spoil(arrays))
    with pytest.raises(MapError, match=sentence) as fault:
        import_reference_map(source, tmp_path / "m.avlmap", SETTINGS, poses=scene / "poses.txt", progress=False)
    assert str(source) in str(fault.value) and "\n" not in str(fault.value)
    assert not (tmp_path / "m.avlmap/map.json").exists()


def test_few_bad_voxels_can_be_left_out(arrays: dict[str, np.ndarray], scene: Path, tmp_path: Path) -> None:
    source = write_h5(tmp_path / "vlmaps.h5df", _with_nan(arrays))
    settings = ImportSettings(CELL_M, max_bad_share=0.01)
    stored = import_reference_map(source, tmp_path / "m.avlmap", settings, poses=scene / "poses.txt", progress=False)
    assert np.isfinite(stored.data.voxels.feature).all()
    assert any(notice.startswith("1 of") and "left out" in notice for notice in stored.data.info.notices)


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda a: _without(a, "robot_pose_list"), "has no robot_pose_list"),
        (lambda a: {**a, "clip_sparse_map": a["clip_sparse_map"][:, :512]}, r"is float32 of \(14, 512\)"),
        (lambda a: {**a, "clip_sparse_map": a["clip_sparse_map"] * np.nan}, "14 of 14 features .* hold NaN"),
        (lambda a: {**a, "robot_pose_list": a["robot_pose_list"] * 2.0}, "robot_pose_list 0 is not a rigid transform"),
        (lambda a: {k: v[1:] for k, v in a.items()}, "begins with another pose than"),
    ],
)
def test_what_is_wrong_with_the_areas_is_one_sentence(
    spoil, sentence: str, scene: Path, seen: list[Seen], tmp_path: Path
) -> None:
    areas = write_h5(tmp_path / "clip_sparse_map.h5df", spoil(area_arrays(seen)))
    with pytest.raises(MapError, match=sentence) as fault:
        import_reference_map(scene, tmp_path / "m.avlmap", SETTINGS, areas=areas, progress=False)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("keep", [0, 5, 700, 3000, 0.5, 0.97])
def test_a_truncated_file_is_one_sentence(keep: float, scene: Path, tmp_path: Path) -> None:
    whole = (scene / "vlmap/vlmaps.h5df").read_bytes()
    source = tmp_path / "vlmaps.h5df"
    source.write_bytes(whole[: int(keep if keep > 1 else keep * len(whole))])
    with pytest.raises(MapError, match=r"cannot be read \(.*\): it is truncated, damaged or no HDF5 file") as fault:
        import_reference_map(source, tmp_path / "m.avlmap", SETTINGS, poses=scene / "poses.txt", progress=False)
    assert "\n" not in str(fault.value)


def test_flipped_bytes_never_escape_as_another_error(scene: Path, tmp_path: Path) -> None:
    source = write_h5(tmp_path / "vlmaps.h5df", one_voxel())
    whole, rng, told = source.read_bytes(), np.random.default_rng(3), 0
    assert len(whole) < 40_000
    for _ in range(60):
        spoiled = bytearray(whole)
        for at in rng.integers(0, len(whole), 12):
            spoiled[at] = rng.integers(256)
        source.write_bytes(bytes(spoiled))
        try:
            import_reference_map(
                source, tmp_path / "m.avlmap", poses=scene / "poses.txt", overwrite=True, progress=False
            )
        except MapError as fault:
            assert "\n" not in str(fault)
            told += 1
    assert told > 5


def test_a_grid_larger_than_any_building_is_one_sentence(scene: Path, tmp_path: Path) -> None:
    source = write_h5(tmp_path / "vlmaps.h5df", {k: v for k, v in one_voxel().items() if k != "occupied_ids"})
    with h5py.File(source, "a") as file:
        file.create_dataset("occupied_ids", (10**7, 10**7, 10**7), "i4", chunks=(8, 8, 8))
    with pytest.raises(MapError, match="than a building has"):
        import_reference_map(source, tmp_path / "m.avlmap", poses=scene / "poses.txt", progress=False)


def test_links_to_other_files_are_not_followed(arrays: dict[str, np.ndarray], scene: Path, tmp_path: Path) -> None:
    write_h5(tmp_path / "other.h5", {"weight": arrays["weight"]})
    source = write_h5(tmp_path / "vlmaps.h5df", _without(arrays, "weight"))
    with h5py.File(source, "a") as file:
        file["weight"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/weight")
    with pytest.raises(MapError, match="weight is not an array stored in this file"):
        import_reference_map(source, tmp_path / "m.avlmap", SETTINGS, poses=scene / "poses.txt", progress=False)


def test_without_any_pose_the_sentence_says_what_to_give(scene: Path, tmp_path: Path) -> None:
    source = _copy(scene / "vlmap/vlmaps.h5df", tmp_path / "vlmaps.h5df")
    with pytest.raises(MapError, match=r"does not say where its grid lies .* give it with poses=FILE"):
        import_reference_map(source, tmp_path / "m.avlmap", SETTINGS, progress=False)


@pytest.fixture
def with_walks(scene: Path, seen: list[Seen], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The scene, and two walks of seven seconds each below it: low, then high; low again."""
    folder = tmp_path / "scene_1"
    folder.mkdir()
    for name in ("vlmap", "area_map", "poses.txt", "rgb"):
        (folder / name).symlink_to(scene / name)
    slowly = [one for one in seen for _ in range(12)]
    write_walk(folder / "audio_video/000000", slowly, {1.0: 300.0, 4.0: 3000.0}, "output_level_1.wav")
    write_walk(folder / "audio_video/000007", slowly[::-1], {2.0: 300.0}, "output_level_1.wav")
    ears = Backend(Kind.SOUNDS, "pitch", "reference_map:HearsPitch")
    monkeypatch.setitem(registry._registered, (Kind.SOUNDS, "pitch"), ears)
    registry.forget_loaded()
    return folder


def test_the_walks_below_are_heard_anew_where_they_were_walked(
    with_walks: Path, seen: list[Seen], tmp_path: Path
) -> None:
    settings = ImportSettings(CELL_M, track="output_level_1.wav", hear_with="pitch")
    stored = import_reference_map(with_walks, tmp_path / "m.avlmap", settings, progress=False)
    sounds = AVLMap.open(stored.path).data.sounds
    begin_s = stored.data.info.recording.duration_s
    second_s = begin_s + (14 * 12 - 1) / 25
    assert np.allclose(sounds.onset_s, [begin_s + 1.0, begin_s + 4.0, second_s + 2.0], atol=0.1)
    assert np.allclose(sounds.offset_s - sounds.onset_s, 1.0, atol=0.15)
    assert sounds.feature.tolist() == [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]
    assert len(set(stored.data.sounds.clips)) == 3 and all(clip.is_file() for clip in stored.data.sounds.clips)
    assert not (stored.path / "parts").exists()
    assert (stored.data.info.models["sounds"].backend, stored.data.info.models["sounds"].checksum) == (
        "pitch",
        "fedcba9876543210",
    )
    walked = avlmaps.open_recording(with_walks / "audio_video/000007").world_from_camera[:, :3, 3]
    track = sounds.track[sounds.track_offsets[2] : sounds.track_offsets[3]]
    assert np.allclose(track[0], walked[50], atol=0.3) and KDTree(walked).query(track)[0].max() < 0.3
    heat = stored.sound("high")
    assert heat.found
    first = seen[4 * 25 // 12].habitat_from_base
    expected = np.array([-first[2, 3], -first[0, 3]])
    assert np.linalg.norm(np.subtract(heat.goals(top=1)[0].position[:2], expected)) < 3.0


def test_a_track_that_is_not_there_is_one_sentence(with_walks: Path, tmp_path: Path) -> None:
    for track, sentence in (
        ("output_level_4.wav", "has a output_level_4.wav; there are: output_level_1.wav."),
        ("../poses.txt", "is no file's name"),
        ("*.wav", "No folder below"),
    ):
        settings = ImportSettings(CELL_M, track=track, hear_with="pitch")
        with pytest.raises(MapError) as fault:
            import_reference_map(with_walks, tmp_path / "m.avlmap", settings, progress=False)
        assert sentence in str(fault.value)


def test_the_command_tells_as_info_does_and_what_it_left(scene: Path, tmp_path: Path, capsys) -> None:
    for name in ("audio_video/audio_data_level_1.pkl", "visual_map/5LpN3gDmAk7_1_reference_features.h5df"):
        (scene / name).parent.mkdir(exist_ok=True)
        (scene / name).write_bytes(f"cos\nsystem\n(S'touch {tmp_path}/ran'\ntR.".encode())
    out = tmp_path / "m.avlmap"
    answers = []
    for words in (["import-map", str(scene), "--out", str(out), "--cell-size", "0.1"], ["info", str(out)]):
        with pytest.raises(SystemExit) as stop:
            main([*words, "--json"])
        said = capsys.readouterr()
        assert stop.value.code == 0, said.err
        answers.append(json.loads(said.out))
    assert answers[0] == answers[1]
    assert not (tmp_path / "ran").exists()
    assert answers[0]["models"] == {"pixels": "demo_e200.ckpt", "views": "openai/clip-vit-large-patch14"}
    told = " ".join(answers[0]["notices"])
    assert "audio_data*.pkl" in told and "path on the machine" in told
