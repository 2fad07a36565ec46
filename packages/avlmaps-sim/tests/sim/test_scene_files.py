"""Buildings from files in the layouts that data sets publish: what is read is what was written, and errors say why."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scene_writers import Gltf, box_mesh, boxes_glb, labelled_boxes, write_ply, y_up

from avlmaps.core.errors import SceneError
from avlmaps_sim.files import load_gltf, load_scene
from avlmaps_sim.files.hm3d import read_annotation
from avlmaps_sim.files.labels import coloured, cut, plain
from avlmaps_sim.files.matterport import read_house
from avlmaps_sim.files.ply import read_ply
from avlmaps_sim.mesh import Material, triangles_of
from avlmaps_sim.scene import Scene, SceneObject
from avlmaps_sim.walk import WalkSettings, walk_through

FLOOR = ((0.0, 0.0, -0.1), (6.0, 4.0, 0.0))
CHAIR = ((1.0, 1.0, 0.0), (1.5, 1.5, 0.9))
TABLE = ((3.0, 2.0, 0.0), (4.4, 3.0, 0.75))
BOXES = (FLOOR, CHAIR, TABLE)


def found(scene: Scene, category: str) -> SceneObject:
    (thing,) = [thing for thing in scene.objects if thing.category == category]
    return thing


def check_boxes(
    scene: Scene, names: tuple[str, str, str] = ("floor", "chair", "table"), within_m: float = 1e-5
) -> None:
    """The three boxes lie where they were written, as triangles and as boxes."""
    for category, (low, high) in zip(names, BOXES, strict=True):
        thing = found(scene, category)
        assert thing.low == pytest.approx(low, abs=within_m)
        assert thing.high == pytest.approx(high, abs=within_m)
        mine = scene.mesh.corners()[scene.instance == scene.objects.index(thing)].reshape(-1, 3)
        assert mine.min(axis=0) == pytest.approx(np.array(low), abs=within_m)
        assert mine.max(axis=0) == pytest.approx(np.array(high), abs=within_m)


# --- glTF


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_names_and_places_of_a_gltf_file_are_read(tmp_path: Path, ending: str) -> None:
    names = [("floor#1/slab", FLOOR), ("chair#1/seat", CHAIR), ("table#1/top", TABLE)]
    scene = load_scene(boxes_glb(tmp_path / f"house.{ending}", names))
    assert scene.name == "house"
    check_boxes(scene)
    assert found(scene, "chair").name == "chair#1"


def test_parts_of_one_instance_become_one_object(tmp_path: Path) -> None:
    legs, seat = ((1.0, 1.0, 0.0), (1.5, 1.5, 0.4)), ((1.0, 1.0, 0.4), (1.5, 1.5, 0.9))
    scene = load_scene(boxes_glb(tmp_path / "a.glb", [("chair#7/0", legs), ("chair#7/1", seat), ("chair#8/0", TABLE)]))
    assert sorted((o.name, round(o.size[2], 3)) for o in scene.objects) == [("chair#7", 0.9), ("chair#8", 0.75)]


@given(
    turn=st.floats(-3.1, 3.1), size=st.floats(0.2, 3.0),
    place=st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5)),
)  # fmt: skip
def test_nested_nodes_move_turn_and_scale_what_they_hold(
    tmp_path_factory: pytest.TempPathFactory, turn: float, size: float, place: tuple[float, float, float]
) -> None:
    gltf = Gltf()
    vertex, triangle = box_mesh((0, 0, 0), (1, 2, 3))
    outer = gltf.node(name="outer", translation=list(place))
    middle = gltf.node(outer, name="middle", rotation=[0.0, float(np.sin(turn / 2)), 0.0, float(np.cos(turn / 2))])
    gltf.node(middle, name="box", mesh=gltf.mesh(vertex, triangle), scale=[size, size, size])
    scene = load_scene(gltf.write(tmp_path_factory.mktemp("nested") / "a.glb"), "y")
    c, s = np.cos(turn), np.sin(turn)
    there = size * vertex @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T + place
    expected = np.stack([there[:, 0], -there[:, 2], there[:, 1]], axis=1)[triangle]
    assert scene.mesh.corners() == pytest.approx(expected, abs=1e-4)


def test_a_mesh_that_two_nodes_show_is_there_twice(tmp_path: Path) -> None:
    gltf = Gltf()
    shape = gltf.mesh(*box_mesh((0, 0, 0), (1, 1, 1)))
    for k in range(2):
        gltf.node(name=f"Stool_{k}", mesh=shape, translation=[3.0 * k, 0.0, 0.0])
    scene = load_scene(gltf.write(tmp_path / "a.glb"))
    assert [o.category for o in scene.objects] == ["stool", "stool"]
    assert sorted(o.low[0] for o in scene.objects) == pytest.approx([0.0, 3.0])


def test_extras_of_a_node_its_mesh_or_a_node_above_name_a_thing(tmp_path: Path) -> None:
    gltf = Gltf()
    shape = box_mesh((0, 0, 0), (1, 1, 1))
    gltf.node(name="a", mesh=gltf.mesh(*shape), extras={"category": "sofa", "instance": "sofa#3"})
    gltf.node(name="b", mesh=gltf.mesh(*shape, extras={"category": "lamp"}))
    above = gltf.node(name="c", extras={"category": "plant", "instance": "ficus"})
    for part in ("pot", "leaves"):
        gltf.node(above, name=part, mesh=gltf.mesh(*shape))
    scene = load_scene(gltf.write(tmp_path / "a.glb"))
    assert sorted((o.category, o.name) for o in scene.objects) == [
        ("lamp", "b"),
        ("plant", "ficus"),
        ("sofa", "sofa#3"),
    ]


def test_a_mesh_of_two_materials_is_one_thing(tmp_path: Path) -> None:
    gltf = Gltf()
    red, blue = (gltf.material(baseColorFactor=c) for c in ([1, 0, 0, 1], [0, 0, 1, 1]))
    shape = gltf.mesh(*box_mesh((0, 0, 0), (1, 1, 1)), material=red)
    second = gltf.mesh(*box_mesh((1, 0, 0), (2, 1, 1)), material=blue)
    gltf.tree["meshes"][shape]["primitives"] += gltf.tree["meshes"].pop(second)["primitives"]
    gltf.node(name="Coffee Table", mesh=shape)
    scene = load_scene(gltf.write(tmp_path / "a.glb"))
    assert [o.category for o in scene.objects] == ["coffee table"]
    assert np.array(sorted(m.colour for m in scene.mesh.materials)) == pytest.approx(np.array([[0, 0, 1], [1, 0, 0]]))


def up_file(folder: Path, z_up: bool) -> Path:
    return boxes_glb(folder / "a.glb", [("thing", FLOOR), ("chair", CHAIR)], z_up)


def test_gltf_is_y_up_unless_something_says_otherwise(tmp_path: Path) -> None:
    assert found(load_scene(up_file(tmp_path, z_up=False)), "chair").high == pytest.approx(CHAIR[1])
    assert found(load_scene(up_file(tmp_path, z_up=True), up_axis="z"), "chair").high == pytest.approx(CHAIR[1])
    assert found(load_scene(up_file(tmp_path, z_up=True)), "chair").size == pytest.approx((0.5, 0.9, 0.5))
    (tmp_path / "a.objects.json").write_text('{"up": "z"}')
    assert found(load_scene(up_file(tmp_path, z_up=True)), "chair").high == pytest.approx(CHAIR[1])


@pytest.mark.parametrize("z_up", [False, True])
def test_what_is_called_floor_lies_flat(tmp_path: Path, z_up: bool) -> None:
    scene = load_scene(boxes_glb(tmp_path / "a.glb", [("floor", FLOOR), ("chair", CHAIR), ("table", TABLE)], z_up))
    check_boxes(scene)


def quad_of(gltf: Gltf, **look: int | np.ndarray) -> None:
    """A square in glTF's xy plane; the picture's first row is at its top."""
    vertex = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    gltf.node(name="poster", mesh=gltf.mesh(vertex, np.array([[0, 1, 2], [0, 2, 3]]), uv=uv, **look))  # pyright: ignore


def colour_at(scene: Scene, x: float, z: float) -> np.ndarray:
    """The texel that shows at a place of the poster, by barycentric interpolation of uv."""
    for corners, uv, kind in zip(scene.mesh.corners(), scene.mesh.uv, scene.mesh.material, strict=True):
        weights = np.linalg.solve(np.vstack([corners[:, 0], corners[:, 2], np.ones(3)]), [x, z, 1.0])
        if (weights > -1e-9).all():
            material = scene.mesh.materials[kind]
            assert material.texture is not None
            height, width = material.texture.shape[:2]
            u, v = weights @ uv
            return material.texture[int(v % 1.0 * height), int(u % 1.0 * width)]
    raise AssertionError("no triangle there")


PICTURE = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8)


def test_pictures_hang_upright_and_are_not_mirrored(tmp_path: Path) -> None:
    gltf = Gltf()
    quad_of(gltf, material=gltf.material(PICTURE, baseColorFactor=[1, 1, 1, 1], roughnessFactor=0.25))
    scene = load_scene(gltf.write(tmp_path / "a.glb"))
    assert colour_at(scene, 0.25, 0.75).tolist() == [255, 0, 0]
    assert colour_at(scene, 0.75, 0.75).tolist() == [0, 255, 0]
    assert colour_at(scene, 0.25, 0.25).tolist() == [0, 0, 255]
    (material,) = scene.mesh.materials
    assert material.gloss == pytest.approx(0.75)
    assert material.texture_size_m == (1.0, 1.0)


def test_pictures_in_another_folder_are_found(tmp_path: Path) -> None:
    import cv2

    (tmp_path / "pictures").mkdir()
    cv2.imwrite(str(tmp_path / "pictures" / "p.png"), PICTURE[..., ::-1])
    gltf = Gltf()
    quad_of(gltf, material=gltf.material(uri="../pictures/p.png"))
    scene = load_scene(gltf.write(tmp_path / "models" / "a.gltf"))
    assert colour_at(scene, 0.75, 0.25).tolist() == [255, 255, 0]


def test_a_linear_colour_factor_becomes_srgb(tmp_path: Path) -> None:
    gltf = Gltf()
    quad_of(gltf, material=gltf.material(baseColorFactor=[0.2140411, 1.0, 0.0, 1.0]))
    (material,) = load_scene(gltf.write(tmp_path / "a.glb")).mesh.materials
    assert material.colour == pytest.approx((0.5, 1.0, 0.0), abs=0.004)


def test_colours_of_vertices_blend_over_their_triangle() -> None:
    vertex = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]], float)
    colour = np.array([[100, 100, 40], [50, 200, 140], [140, 80, 60]], np.uint8)
    mesh = coloured(vertex, np.array([[0, 1, 2]]), colour)
    picture = mesh.materials[0].texture
    assert picture is not None
    height, width = picture.shape[:2]
    for weights in (np.eye(3)[0], np.eye(3)[1], np.eye(3)[2], np.full(3, 1 / 3)):
        u, v = (weights @ mesh.uv[0]) * [width, height] - 0.5
        i, j = int(v), int(u)
        fu, fv = u - j, v - i
        i1, j1 = min(i + 1, height - 1), min(j + 1, width - 1)
        texels = picture.astype(float)
        shown = (1 - fv) * ((1 - fu) * texels[i, j] + fu * texels[i, j1])
        shown += fv * ((1 - fu) * texels[i1, j] + fu * texels[i1, j1])
        assert shown == pytest.approx(weights @ colour, abs=1.0)


def test_regions_of_the_side_car_become_areas(tmp_path: Path) -> None:
    path = boxes_glb(tmp_path / "a.glb", [("floor", FLOOR), ("chair", CHAIR), ("table", TABLE)])
    regions = [
        {"name": "kitchen", "min": [0, 0], "max": [2, 4]},
        {"name": "study 2", "kind": "office", "polygon": [[2, 0], [6, 0], [6, 4], [2, 4]], "ceiling": 2.5},
    ]
    (tmp_path / "a.objects.json").write_text(json.dumps({"regions": regions}))
    scene = load_scene(path)
    assert [(a.kind, a.name) for a in scene.areas] == [("kitchen", "kitchen"), ("office", "study 2")]
    assert scene.areas[1].ceiling_m == 2.5 and scene.areas[0].floor_m == pytest.approx(0.0, abs=1e-6)
    assert (found(scene, "chair").area, found(scene, "table").area) == (0, 1)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("SM_CoffeeTable_01.002", "coffee table"), ("chair_12", "chair"), ("tv_monitor", "tv monitor"), ("Sofa", "sofa"),
     ("wall-plug", "wall plug"), ("bed2", "bed")],
)  # fmt: skip
def test_names_are_read_as_a_person_would_write_them(name: str, expected: str) -> None:
    assert plain(name) == expected


# --- PLY


@pytest.mark.parametrize("order", ["binary_little_endian", "binary_big_endian", "ascii"])
@given(sides=st.lists(st.integers(3, 6), min_size=1, max_size=6), seed=st.integers(0, 100))
def test_polygons_of_a_ply_keep_their_property_when_they_are_cut(
    tmp_path_factory: pytest.TempPathFactory, order: str, sides: list[int], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    vertex = rng.uniform(-5, 5, (sum(sides), 3)).astype(np.float32)
    faces = [list(range(start - n, start)) for n, start in zip(sides, np.cumsum(sides), strict=True)]
    owner = rng.integers(0, 1000, len(sides))
    colour = rng.integers(0, 256, (len(vertex), 3))
    path = write_ply(tmp_path_factory.mktemp("ply") / "a.ply", vertex, faces, colour, order, object_id=owner)
    ply = read_ply(path)
    assert ply.vertex == pytest.approx(vertex, rel=1e-6)
    assert ply.colour is not None
    assert np.array_equal(ply.colour, colour)
    triangles = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
    assert ply.triangle.tolist() == [list(t) for t in triangles]
    assert ply.face["object_id"].tolist() == [int(o) for o, n in zip(owner, sides, strict=True) for _ in range(n - 2)]


@given(seed=st.integers(0, 1000), longest_m=st.floats(0.2, 1.0))
def test_cutting_triangles_keeps_their_surface_and_their_picture(seed: int, longest_m: float) -> None:
    rng = np.random.default_rng(seed)
    vertex = rng.uniform(-1, 1, (6, 3))
    mesh = triangles_of(vertex, np.array([[0, 1, 2], [3, 4, 5]]), Material(), rng.uniform(0, 1, (2, 3, 2)))
    fine, origin = cut(mesh, longest_m)
    corners = fine.corners().astype(float)
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= longest_m + 1e-6
    for k in range(2):
        mine = origin == k
        assert fine.areas_m2()[mine].sum() == pytest.approx(mesh.areas_m2()[k], rel=1e-4)
        places = np.column_stack([corners[mine].reshape(-1, 3), np.ones(3 * mine.sum())])
        whole = np.column_stack([mesh.corners()[k].astype(float), np.ones(3)])
        weights = np.linalg.lstsq(whole.T, places.T, rcond=None)[0].T
        assert fine.uv[mine].reshape(-1, 2) == pytest.approx(weights @ mesh.uv[k], abs=1e-3)


# --- Matterport3D

HOUSE = """ASCII 1.1
H test - 0 0 8 2 3 3 3 2 0 1 0 0 0 0 0 0 0 -0.1 6 4 2.6 0 0 0 0 0
L 0 2 - 0 0 0 0 0 -0.1 6 4 2.6 0 0 0 0 0
R 0 0 0 0 k 1 2 0 0 0 0 2 4 2.6 2.6 0 0 0 0
R 1 0 0 0 l 4 2 0 2 0 0 6 4 2.6 2.6 0 0 0 0
S 0 0 0 - 1 2 0 0 0 1 0 0 0 2 4 2.6 0 0 0 0 0
V 0 0 - 0 0 0 0 0 1 0 0 0
V 1 0 - 2 0 0 0 0 1 0 0 0
V 2 0 - 2 4 0 0 0 1 0 0 0
V 3 0 - 0 4 0 0 0 1 0 0 0
C 0 4 floor 2 floor 0 0 0 0 0
C 1 10 dining#chair 3 chair 0 0 0 0 0
C 2 20 conference#table 5 table 0 0 0 0 0
O 0 0 0 3 2 0 1 0 0 0 1 0 3 2 0.05 0 0 0 0 0 0 0 0
O 1 0 1 1.25 1.25 0.45 1 0 0 0 1 0 0.25 0.25 0.45 0 0 0 0 0 0 0 0
O 2 1 2 3.7 2.5 0.4 1 0 0 0 1 0 0.7 0.5 0.4 0 0 0 0 0 0 0 0
E 0 0 70 1 0 0 0 0 0 0 1 1 1 0 0 0 0 0
E 1 1 71 1 0 0 0 0 0 0 1 1 1 0 0 0 0 0
E 2 2 72 1 0 0 0 0 0 0 1 1 1 0 0 0 0 0
"""


def matterport(folder: Path, textured: bool = True, property_name: str = "object_id", z_up: bool = True) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "test.house").write_text(HOUSE)
    vertex, quads, owner = labelled_boxes(BOXES)
    ids = owner if property_name == "object_id" else owner + 70
    colour = np.full((len(vertex), 3), 90)
    write_ply(folder / "test_semantic.ply", vertex, quads.tolist(), colour, **{property_name: ids})
    if textured:
        boxes_glb(folder / "test.glb", [("whole", box) for box in BOXES], z_up=z_up)
    return folder


@pytest.mark.parametrize("textured", [True, False])
def test_a_matterport_building_has_its_objects_and_rooms(tmp_path: Path, textured: bool) -> None:
    scene = load_scene(matterport(tmp_path, textured))
    assert scene.name == "test"
    check_boxes(scene, within_m=0.13 if textured else 1e-5)
    assert found(scene, "chair").name == "dining chair#1"
    assert [a.kind for a in scene.areas] == ["kitchen", "living room"]
    assert scene.areas[0].polygon.tolist() == [[0, 0], [2, 0], [2, 4], [0, 4]]
    assert (found(scene, "chair").area, found(scene, "table").area) == (0, 1)
    assert (scene.areas[1].floor_m, scene.areas[1].ceiling_m) == (0.0, 2.6)


def test_any_file_of_a_matterport_building_stands_for_it(tmp_path: Path) -> None:
    folder = matterport(tmp_path)
    for name in ("test.glb", "test_semantic.ply", "test.house"):
        assert len(load_scene(folder / name).areas) == 2


def test_a_matterport_mesh_with_y_up_is_turned_to_fit(tmp_path: Path) -> None:
    check_boxes(load_scene(matterport(tmp_path, z_up=False)), within_m=0.13)


def test_faces_that_name_segments_are_looked_up_in_the_house(tmp_path: Path) -> None:
    check_boxes(load_scene(matterport(tmp_path, textured=False, property_name="face_material")))


def test_a_matterport_building_can_be_walked(tmp_path: Path) -> None:
    poses = walk_through(load_scene(matterport(tmp_path)), np.random.default_rng(0), WalkSettings(look_around=False))
    assert len(poses) > 20


# --- Replica


def replica(folder: Path) -> Path:
    vertex, quads, owner = labelled_boxes(BOXES)
    colour = np.random.default_rng(0).integers(0, 256, (len(vertex), 3))
    write_ply(folder / "habitat" / "mesh_semantic.ply", vertex, quads.tolist(), colour, object_id=owner + 3)
    names = ("floor", "chair", "side-table")
    info = {
        "classes": [{"id": 10 + k, "name": name} for k, name in enumerate(names)],
        "objects": [{"id": 3 + k, "class_id": 10 + k, "class_name": name} for k, name in enumerate(names)],
    }
    (folder / "habitat" / "info_semantic.json").write_text(json.dumps(info))
    return folder


def test_a_replica_scene_has_its_objects(tmp_path: Path) -> None:
    folder = replica(tmp_path / "room_0")
    for path in (folder, folder / "habitat", folder / "habitat" / "mesh_semantic.ply"):
        scene = load_scene(path)
        assert scene.name == "room_0"
        check_boxes(scene, ("floor", "chair", "side table"))


# --- HM3D

PAINT = {1: (0x5F, 0x00, 0xA2), 2: (0xFF, 0x10, 0x00), 3: (0x00, 0x80, 0x33)}
ANNOTATION = """HM3D Semantic Annotations
1,5F00A2,"floor",0
2,FF1000,"chair",0
3,008033,"coffee table, low",1
"""


def hm3d(folder: Path, painted_by: str = "texture", same_mesh: bool = True) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "abc.semantic.txt").write_text(ANNOTATION)
    gltf = Gltf()
    picture = np.array([[PAINT[1], PAINT[2], PAINT[3]]], np.uint8).repeat(4, axis=0).repeat(4, axis=1)
    look = gltf.material(picture) if painted_by == "texture" else None
    for number, (low, high) in enumerate(BOXES):
        vertex, triangle = box_mesh(low, high)
        uv = np.tile([[(number + 0.5) / 3, 0.5]], (8, 1))
        colour = np.tile([PAINT[number + 1]], (8, 1))
        shape = (
            gltf.mesh(y_up(vertex), triangle, material=look, uv=uv)
            if painted_by == "texture"
            else gltf.mesh(y_up(vertex), triangle, colour=colour)
        )
        gltf.node(name=f"m{number}", mesh=shape)
    gltf.write(folder / "abc.semantic.glb")
    boxes_glb(folder / "abc.glb", [(f"m{k}", box) for k, box in enumerate(BOXES if same_mesh else BOXES[::-1])])
    return folder


@pytest.mark.parametrize("painted_by", ["texture", "vertices"])
@pytest.mark.parametrize("same_mesh", [True, False])
def test_an_hm3d_building_has_its_objects_and_regions(tmp_path: Path, painted_by: str, same_mesh: bool) -> None:
    folder = hm3d(tmp_path, painted_by, same_mesh)
    for path in (folder, folder / "abc.glb"):
        scene = load_scene(path)
        check_boxes(scene, ("floor", "chair", "coffee table, low"), within_m=1e-5 if same_mesh else 0.13)
        assert [(a.kind, a.name) for a in scene.areas] == [("room", "room#0")]
        assert scene.areas[0].floor_m == pytest.approx(0.0, abs=0.11)
        assert found(scene, "chair").area == 0


def test_hm3d_without_plain_pictures_says_what_to_fetch(tmp_path: Path) -> None:
    folder = hm3d(tmp_path)
    shutil.move(folder / "abc.glb", folder / "abc.basis.glb")
    with pytest.raises(SceneError, match=r"packed for graphics cards .* fetch abc\.glb as well"):
        load_scene(folder / "abc.basis.glb")


# --- ReplicaCAD and HSSD


def data_set(root: Path, origin: str = "asset_local") -> Path:
    """A data set laid out as HSSD is, with one model stored away from its origin and one with z up."""
    up = {"up": [0, 1, 0], "front": [0, 0, -1]}
    folders = {"stages": {"paths": {".json": ["stages"]}}, "objects": {"paths": {".json": ["objects/*"]}}}
    boxes_glb(root / "stages" / "s.glb", [("shell", FLOOR), ("shell", ((0, 0, 0), (6, 0.1, 2.6)))])
    (root / "stages" / "s.stage_config.json").write_text(json.dumps({"render_asset": "s.glb", **up}))
    boxes_glb(root / "objects" / "a" / "a1.glb", [("x", ((-0.25, -0.25, 0.0), (0.25, 0.25, 0.9)))])
    (root / "objects" / "a" / "a1.object_config.json").write_text(
        json.dumps({"render_asset": "a1.glb", "semantic_id": 4, **up})
    )
    boxes_glb(root / "objects" / "b" / "b1.glb", [("x", ((-0.5, -0.7, 0.0), (0.5, 0.7, 0.25)))], z_up=True)
    (root / "objects" / "b" / "b1.object_config.json").write_text(
        json.dumps({"render_asset": "b1.glb", "semantic_id": 5, "up": [0, 0, 1], "front": [0, 1, 0]})
    )
    (root / "semantics" / "scenes").mkdir(parents=True)
    lexicon = {"classes": [{"id": 4, "name": "chair"}, {"id": 5, "name": "table"}]}
    (root / "semantics" / "test_semantic_lexicon.json").write_text(json.dumps(lexicon))
    loop = [[0, 0, 0], [6, 0, 0], [6, 0, -4], [0, 0, -4]]
    region = {"name": "kitchen|1", "label": "kitchen", "poly_loop": loop, "floor_height": 0.0, "extrusion_height": 2.7}
    (root / "semantics" / "scenes" / "home.semantic_config.json").write_text(
        json.dumps({"region_annotations": [region]})
    )
    (root / "test.scene_dataset_config.json").write_text(json.dumps(folders))
    # The chair stands at its place; the table (1 x 1.4 x 0.25) is made three times as high and turned by 90 degrees.
    half = float(np.sqrt(0.5))
    chair_z, table_z = (0.0, 0.0) if origin == "asset_local" else (0.45, 0.375)
    scene = {
        "stage_instance": {"template_name": "stages/s"},
        "translation_origin": origin,
        "object_instances": [
            {"template_name": "a1", "translation": [1.25, chair_z, -1.25], "motion_type": "static"},
            {"template_name": "objects/b/b1", "translation": [3.7, table_z, -2.5], "rotation": [half, 0.0, half, 0.0],
             "non_uniform_scale": [1.0, 3.0, 1.0]},
        ],
    }  # fmt: skip
    (root / "scenes").mkdir()
    path = root / "scenes" / "home.scene_instance.json"
    path.write_text(json.dumps(scene))
    return path


@pytest.mark.parametrize("origin", ["asset_local", "COM"])
def test_a_scene_put_together_from_models_has_each_at_its_place(tmp_path: Path, origin: str) -> None:
    scene = load_scene(data_set(tmp_path, origin))
    assert scene.name == "home"
    chair, table = found(scene, "chair"), found(scene, "table")
    assert (*chair.low, *chair.high) == pytest.approx((*CHAIR[0], *CHAIR[1]), abs=1e-5)
    assert (*table.low, *table.high) == pytest.approx((*TABLE[0], *TABLE[1]), abs=1e-5)
    assert found(scene, "floor").high == pytest.approx(FLOOR[1], abs=1e-5)
    assert [(a.kind, a.ceiling_m) for a in scene.areas] == [("kitchen", 2.7)]
    assert scene.areas[0].contains(np.array([3.0, 2.0])) and chair.area == 0


URDF = """<robot name="fridge"><link name="body"><visual><origin xyz="0 0 0"/><geometry>
<mesh filename="a1.glb" scale="1 1 1"/></geometry></visual></link>
<link name="door"><visual><geometry><mesh filename="a1.glb"/></geometry></visual></link>
<joint name="hinge" type="revolute"><parent link="body"/><child link="door"/>
<origin xyz="0 2 0" rpy="0 0 0"/></joint></robot>"""


def test_things_with_joints_are_put_together_closed(tmp_path: Path) -> None:
    path = data_set(tmp_path)
    (tmp_path / "urdf" / "fridge").mkdir(parents=True)
    (tmp_path / "urdf" / "fridge" / "fridge.urdf").write_text(URDF)
    shutil.copy(tmp_path / "objects" / "a" / "a1.glb", tmp_path / "urdf" / "fridge" / "a1.glb")
    scene = json.loads(path.read_text())
    scene["articulated_object_instances"] = [{"template_name": "fridge", "translation": [5.0, 0.0, -1.0]}]
    path.write_text(json.dumps(scene))
    fridge = found(load_scene(path), "fridge")
    assert (*fridge.low, *fridge.high) == pytest.approx((4.75, 0.75, 0.0, 5.25, 1.25, 2.9), abs=1e-5)


# --- what is wrong with a file is said in one sentence


def truncated(path: Path, keep: float = 0.6) -> Path:
    content = path.read_bytes()
    path.write_bytes(content[: int(keep * len(content))])
    return path


def changed(path: Path, old: str, new: str) -> Path:
    path.write_text(path.read_text().replace(old, new))
    return path


def replica_without_ids(folder: Path) -> Path:
    vertex, quads, _ = labelled_boxes(BOXES)
    write_ply(replica(folder) / "habitat" / "mesh_semantic.ply", vertex, quads.tolist())
    return folder


def packed(folder: Path) -> Path:
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(*box_mesh((0, 0, 0), (1, 1, 1))))
    gltf.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return gltf.write(folder / "a.glb")


def other_building(folder: Path) -> Path:
    boxes_glb(matterport(folder) / "test.glb", [("whole", ((50, 50, 0), (51, 51, 1)))])
    return folder


def removed(path: Path) -> Path:
    path.unlink()
    return path.parent


WRONG: dict[str, tuple[Callable[[Path], Path], str]] = {
    "missing": (lambda f: f / "no.glb", "there is no .*no.glb"),
    "no building": (lambda f: _text(f / "a.txt", "hello"), "a.txt is not a building that can be read"),
    "empty folder": (lambda f: f, "holds 0 glTF files"),
    "no glb": (lambda f: _text(f / "a.glb", "this is not a GLB file at all"), "does not begin with glTF"),
    "truncated glb": (
        lambda f: truncated(boxes_glb(f / "a.glb", [("a", CHAIR)])),
        r"truncated: it has \d+ of \d+ bytes",
    ),
    "gltf without bin": (lambda f: _without_bin(f), "cannot be read as glTF"),
    "old gltf": (lambda f: _text(f / "a.gltf", '{"asset": {"version": "1.0"}}'), "glTF 1.0; version 2 is read"),
    "no json": (lambda f: _text(f / "a.gltf", '{"asset": '), "is not JSON"),
    "packed": (packed, "packed with KHR_draco_mesh_compression; unpack it"),
    "no triangles": (
        lambda f: _text(f / "a.gltf", '{"asset": {"version": "2.0"}}'),
        "holds no triangles|cannot be read",
    ),
    "side-car": (lambda f: _side_car(f), "region 0 of .*objects.json has no name and outline"),
    "truncated ply": (lambda f: truncated(matterport(f) / "test_semantic.ply"), "truncated or damaged"),
    "no ply": (lambda f: removed(matterport(f) / "test_semantic.ply"), "cannot read .*test_semantic.ply"),
    "ply header": (lambda f: changed(replica_ascii(f), "property float x", "property half x"), "no PLY file says"),
    "truncated house": (lambda f: changed(matterport(f) / "test.house", "O 2 1 2", "Q"), "has 2 of 3 objects"),
    "house version": (lambda f: changed(matterport(f) / "test.house", "1.1", "0.9"), "not with 'ASCII 1.1'"),
    "house line": (
        lambda f: changed(matterport(f) / "test.house", "C 2 20 conference#table 5 table 0 0 0 0 0", "C 2 20"),
        "line 13 of",
    ),
    "other building": (other_building, "do not show the same building"),
    "no ids": (replica_without_ids, "have no object_id"),
    "replica info": (lambda f: changed(replica(f) / "habitat" / "info_semantic.json", "objects", "o"), "does not list"),
    "hm3d header": (lambda f: changed(hm3d(f) / "abc.semantic.txt", "HM3D", "X"), "not with 'HM3D Semantic"),
    "hm3d line": (lambda f: changed(hm3d(f) / "abc.semantic.txt", "FF1000", "red"), "line 3 of"),
    "no template": (lambda f: _no_template(f), "no template a1 is below"),
    "instance": (lambda f: changed(data_set(f), "stage_instance", "stage"), "is not laid out as a scene instance"),
}


def _text(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def _without_bin(folder: Path) -> Path:
    path = boxes_glb(folder / "a.gltf", [("a", CHAIR)])
    path.with_suffix(".bin").unlink()
    return path


def _side_car(folder: Path) -> Path:
    (folder / "a.objects.json").write_text('{"regions": [{"name": "x"}]}')
    return boxes_glb(folder / "a.glb", [("a", CHAIR)])


def replica_ascii(folder: Path) -> Path:
    vertex, quads, owner = labelled_boxes(BOXES)
    return write_ply(
        replica(folder) / "habitat" / "mesh_semantic.ply", vertex, quads.tolist(), order="ascii", object_id=owner
    )


def _no_template(folder: Path) -> Path:
    path = data_set(folder)
    shutil.rmtree(folder / "objects" / "a")
    return path


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path: Path, case: str) -> None:
    make, sentence = WRONG[case]
    with pytest.raises(SceneError, match=sentence) as caught:
        load_scene(make(tmp_path))
    assert "\n" not in str(caught.value)


@given(keep=st.floats(0.0, 0.999))
def test_no_truncated_file_escapes_as_another_error(tmp_path_factory: pytest.TempPathFactory, keep: float) -> None:
    folder = tmp_path_factory.mktemp("cut")
    with pytest.raises(SceneError):
        load_gltf(truncated(boxes_glb(folder / "a.glb", [("a", CHAIR)]), keep))
    vertex, quads, owner = labelled_boxes(BOXES)
    with pytest.raises(SceneError):
        read_ply(truncated(write_ply(folder / "a.ply", vertex, quads.tolist(), object_id=owner), keep))
    for name, text, read in (("a.house", HOUSE, read_house), ("a.semantic.txt", ANNOTATION, read_annotation)):
        (folder / name).write_text(text[: int(keep * len(text))])
        try:
            read(folder / name)
        except SceneError as error:
            assert name in str(error)


# --- a house that an artist made


@pytest.fixture(scope="module")
def small_house(shared_data: Path) -> tuple[Scene, dict]:
    path = shared_data / "scenes" / "small_house.glb"
    if not path.exists():
        pytest.skip("needs ../shared/scenes/small_house.glb, which is not part of this repository")
    return load_scene(path), json.loads(path.with_suffix(".objects.json").read_text())


@pytest.mark.shared
def test_the_small_house_has_every_object_of_its_list_at_its_place(small_house: tuple[Scene, dict]) -> None:
    scene, notes = small_house
    expected = {thing["instance"]: thing for thing in notes["objects"]}
    assert {thing.name for thing in scene.objects} == set(expected)
    for thing in scene.objects:
        assert thing.category == expected[thing.name]["category"]
        assert thing.centre == pytest.approx(expected[thing.name]["center"], abs=2e-3)
        assert thing.size == pytest.approx(expected[thing.name]["size"], abs=2e-3)
    assert [area.kind for area in scene.areas] == [region["name"] for region in notes["regions"]]
    assert sum(material.texture is not None for material in scene.mesh.materials) > 50


@pytest.mark.shared
def test_the_small_house_is_walked_through_every_area(small_house: tuple[Scene, dict]) -> None:
    scene, _ = small_house
    poses = walk_through(scene, np.random.default_rng(0))
    place = poses[:, :2, 3]
    assert 600 < len(poses) < 3000
    for area in scene.areas:
        assert area.contains(place).sum() > 20, area.kind
    things = [t for t in scene.objects if max(t.size) > 0.5 and t.category not in ("floor", "wall", "carpet")]
    low, high = (np.array([getattr(t, end)[:2] for t in things]) for end in ("low", "high"))
    away = np.linalg.norm(np.maximum(np.maximum(low - place[:, None], place[:, None] - high), 0), axis=2)
    assert (away.min(axis=0) < 3.0).mean() > 0.95


@pytest.mark.shared
def test_a_room_without_names_stands_on_its_largest_level_surfaces() -> None:
    file = Path(__file__).resolve().parents[4].parent / "shared/field/round4/room_z_up_unlabelled.glb"
    if not file.is_file():
        pytest.skip("files of other hands are not beside the repository")
    size_m = np.ptp(load_scene(file).mesh.corners().reshape(-1, 3), axis=0)
    assert size_m == pytest.approx([6.0, 4.0, 2.6], abs=0.25)


def test_the_axis_that_habitats_stage_says_is_up(tmp_path: Path) -> None:
    file = tmp_path / "hall.glb"
    shutil.copy(boxes_glb(tmp_path / "box.glb", [("part", ((0.0, 0.0, 0.0), (4.0, 4.0, 4.0)))], z_up=True), file)
    with pytest.raises(SceneError, match="y or its z axis"):
        load_gltf(file)
    (tmp_path / "hall.stage_config.json").write_text('{"render_asset": "hall.glb", "up": [0, 0, 1]}')
    assert load_gltf(file).mesh.high == pytest.approx([4, 4, 4], abs=1e-5)
