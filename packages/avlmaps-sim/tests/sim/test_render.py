"""The renderer against closed forms, against laws that hold for any renderer, and against another one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from avlmaps.core.camera import Pinhole
from avlmaps_sim import shapes
from avlmaps_sim.mesh import Material, Mesh, triangles_of
from avlmaps_sim.render import SKY, Renderer
from avlmaps_sim.scene import NOTHING, Area, Light, Scene, SceneBuilder

CAMERA = Pinhole(140.0, 150.0, 81.0, 59.0, 160, 120)
GREY = Material((0.6, 0.6, 0.6))


def looking(eye, forward, roll_rad: float = 0.0) -> np.ndarray:
    """Return world_from_camera of a camera at a place that looks along a direction, upright but for a roll."""
    z = np.asarray(forward, float) / np.linalg.norm(forward)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([c * x + s * y, c * y - s * x, z])
    pose[:3, 3] = eye
    return pose


def scene_of(**meshes: Mesh) -> Scene:
    builder = SceneBuilder("test")
    for category, mesh in meshes.items():
        builder.add(category.replace("_", " "), mesh)
    return builder.build()


def soup(rng: np.random.Generator, count: int, size: float = 1.0) -> Mesh:
    """Return triangles at random round the origin."""
    middle = rng.uniform(-3, 3, (count, 1, 3))
    vertex = (middle + rng.normal(scale=size, size=(count, 3, 3))).reshape(-1, 3)
    return triangles_of(vertex, np.arange(3 * count).reshape(-1, 3), GREY)


def depth_of(scene: Scene, pose: np.ndarray, camera: Pinhole = CAMERA) -> np.ndarray:
    return Renderer(scene, lit=False).render(camera, pose).depth_m


@pytest.mark.parametrize("roll", [0.0, 0.7])
def test_depth_in_a_box_room_is_that_of_the_wall_that_the_ray_meets(roll):
    low, high = np.array([-2.0, -1.5, 0.0]), np.array([3.0, 1.7, 2.6])
    room = scene_of(wall=shapes.box(tuple(low), tuple(high), GREY))
    pose = looking([0.3, 0.2, 1.2], [0.8, -0.5, -0.3], roll)
    rays = CAMERA.rays() @ pose[:3, :3].T
    true = (np.where(rays > 0, high, low) - pose[:3, 3]) / rays
    assert np.allclose(depth_of(room, pose), true.min(axis=-1), rtol=1e-5)


def test_depth_of_a_fine_sphere_is_that_of_the_sphere():
    radius, centre = 0.8, np.array([3.0, 0.2, 1.0])
    ball = scene_of(ball=shapes.ellipsoid(tuple(centre), (radius,) * 3, GREY, sides=128, rows=64))
    pose = looking([0.0, 0.0, 1.1], [1.0, 0.05, 0.0])
    rays = CAMERA.rays() @ pose[:3, :3].T
    to_centre = centre - pose[:3, 3]
    a, b = np.sum(rays**2, axis=-1), rays @ to_centre
    under_root = b**2 - a * (to_centre @ to_centre - radius**2)
    well_inside = under_root > 0.05 * a * radius**2
    near = (b - np.sqrt(np.maximum(under_root, 0))) / a
    depth = depth_of(ball, pose)
    assert np.abs(depth - near)[well_inside].max() < 2e-3
    assert not depth[under_root < -0.02 * a * radius**2].any()


@given(seed=st.integers(0, 10_000), heading=st.floats(-3.1, 3.1), shift=st.floats(-5, 5))
def test_moving_the_world_and_the_camera_together_changes_no_depth(seed, heading, shift):
    mesh = soup(np.random.default_rng(seed), 30)
    pose = looking([4.0, -3.0, 2.0], [-1.0, 0.8, -0.5])
    c, s = np.cos(heading), np.sin(heading)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]], [shift, -shift, 0.5]
    there = mesh.turned(heading).moved(shift, -shift, 0.5)
    before, after = depth_of(scene_of(thing=mesh), pose), depth_of(scene_of(thing=there), moved @ pose)
    # coordinates are rounded to 1/256 pixel, so a pixel whose centre lies on an edge may change hands
    assert np.mean(~np.isclose(before, after, rtol=1e-3)) < 2e-3


@given(seed=st.integers(0, 10_000))
def test_a_surface_cut_into_slivers_has_neither_holes_nor_overlap(seed):
    rng = np.random.default_rng(seed)
    corners = np.array([[2.0, -9, -9], [2, 9, -9], [2, 9, 9], [2, -9, 9]])
    inner = np.column_stack([np.full(60, 2.0), rng.uniform(-2, 2, (60, 2))])
    vertex = np.concatenate([corners, inner])
    mesh = triangles_of(vertex, Delaunay(vertex[:, 1:]).simplices, GREY)
    depth = depth_of(
        scene_of(wall=mesh), looking([0.0, 0.1, 0.2], [1.0, rng.uniform(-0.5, 0.5), 0.1], rng.uniform(0, 3))
    )
    assert (depth > 0).all()


def test_each_pixel_of_a_cut_surface_belongs_to_exactly_one_piece():
    quad = np.array([[2.0, -0.8, -0.7], [2, 0.9, -0.6], [2, 0.8, 0.7], [2, -0.9, 0.6]])
    pose = looking([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    one, other = (
        depth_of(scene_of(part=triangles_of(quad, np.array([t]), GREY)), pose) for t in ([0, 1, 2], [0, 2, 3])
    )
    both = depth_of(scene_of(whole=triangles_of(quad, np.array([[0, 1, 2], [0, 2, 3]]), GREY)), pose)
    assert not ((one > 0) & (other > 0)).any()
    assert np.array_equal((one > 0) | (other > 0), both > 0)


@given(seed=st.integers(0, 10_000))
def test_nothing_behind_the_camera_is_seen(seed):
    mesh = soup(np.random.default_rng(seed), 20)
    eye, forward = np.array([1.0, 2.0, 0.5]), np.array([0.5, 1.0, -0.2])
    ahead = (mesh.corners() - eye) @ forward > 0
    behind = ~ahead.any(axis=1)
    kept = Mesh(mesh.vertex, mesh.triangle[behind], mesh.uv[behind], mesh.material[behind], mesh.materials)
    view = Renderer(scene_of(thing=kept), lit=False).render(CAMERA, looking(eye, forward))
    assert (view.instance == NOTHING).all()
    assert (view.category == NOTHING).all()
    assert not view.depth_m.any()
    assert (view.rgb == SKY).all()


def test_a_wall_that_passes_through_the_plane_of_the_camera_is_drawn_to_the_edge_of_the_view():
    # a floor and a ceiling that reach far behind the camera
    mesh = shapes.box((-50.0, -50.0, 0.0), (50.0, 50.0, 3.0), GREY)
    pose = looking([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    depth, rays = depth_of(scene_of(floor=mesh), pose), CAMERA.rays() @ pose[:3, :3].T
    down = rays[..., 2] < -0.05
    assert np.allclose(depth[down], (-1.0 / rays[..., 2])[down], rtol=1e-4)


def test_the_nearer_of_two_things_is_seen_whatever_their_order():
    near, far = (shapes.slab(x, 0.0, 0.5, 0.1, 1.0, 1.0, GREY) for x in (2.0, 4.0))
    pose = looking([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    for scene in (scene_of(near=near, far=far), scene_of(far=far, near=near)):
        view = Renderer(scene, lit=False).render(CAMERA, pose)
        assert scene.objects[view.instance[59, 81]].category == "near"
        assert scene.categories[view.category[59, 81]] == "near"


def test_many_small_things_behind_a_wall_are_hidden_and_those_before_it_are_not():
    rng = np.random.default_rng(3)
    builder = SceneBuilder("test")
    builder.add("wall", shapes.slab(3.0, 0.0, -5.0, 0.1, 12.0, 10.0, GREY))
    for x in (4.5, 1.5):
        for _ in range(150):
            y, z = rng.uniform(-1.5, 1.5, 2)
            builder.add("far" if x > 3 else "near", shapes.ellipsoid((x, y, z), (0.05,) * 3, GREY))
    scene = builder.build()
    view = Renderer(scene, lit=False).render(CAMERA, looking([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    seen = {scene.categories[k] for k in np.unique(view.category)}
    assert seen == {"wall", "near"}


def _embree(mesh: Mesh, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return depth and triangle of every pixel by casting its ray."""
    rtcore_scene = pytest.importorskip("embreex.rtcore_scene")
    from embreex.mesh_construction import TriangleMesh

    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, mesh.corners().astype(np.float32))
    rays = (CAMERA.rays() @ pose[:3, :3].T).reshape(-1, 3).astype(np.float32)
    origin = np.broadcast_to(pose[:3, 3].astype(np.float32), rays.shape)
    hit = scene.run(np.ascontiguousarray(origin), rays, output=True)
    shape = CAMERA.height, CAMERA.width
    depth = np.where(hit["primID"] >= 0, hit["tfar"], 0.0)
    return depth.reshape(shape), np.asarray(hit["primID"]).reshape(shape)


@pytest.mark.parametrize("seed", range(4))
def test_it_sees_what_a_ray_caster_sees(seed):
    rng = np.random.default_rng(seed)
    mesh = soup(rng, 400, 0.5)
    pose = looking(rng.uniform(-1, 1, 3), rng.normal(size=3), rng.uniform(0, 3))
    true, _ = _embree(mesh, pose)
    true = np.where(true < 0.02, 0.0, true)
    depth = depth_of(scene_of(thing=mesh), pose)
    off = np.abs(depth - true) > 2e-3 + 1e-3 * true
    assert off.mean() < 2e-3  # pixels whose centre lies within 1/256 pixel of an edge


def test_a_picture_lies_on_its_surface_the_right_way_up():
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[0, 0], picture[0, 1], picture[1, 0], picture[1, 1] = (250, 0, 0), (0, 250, 0), (0, 0, 250), (250, 250, 0)
    picture = np.kron(picture, np.ones((32, 32, 1), np.uint8))
    look = Material((1.0, 1.0, 1.0), texture=picture)
    poster = shapes.sheet((2.0, 1.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 2.0), look, fill=True)
    view = Renderer(scene_of(poster=poster), lit=False).render(CAMERA, looking([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    found = [view.rgb[v, u].tolist() for v, u in ((30, 50), (30, 110), (90, 50), (90, 110))]
    assert found == [[250, 0, 0], [0, 250, 0], [0, 0, 250], [250, 250, 0]]


def test_a_fine_pattern_far_away_turns_grey_and_does_not_shimmer():
    board = np.kron((np.indices((64, 64)).sum(axis=0) % 2).astype(np.uint8) * 255, np.ones((1, 1), np.uint8))
    look = Material((1.0, 1.0, 1.0), texture=np.repeat(board[..., None], 3, axis=2), texture_size_m=(0.2, 0.2))
    wall = scene_of(wall=shapes.sheet((6.0, 9.0, -9.0), (0.0, -18.0, 0.0), (0.0, 0.0, 18.0), look))
    view = Renderer(wall, lit=False).render(CAMERA, looking([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    assert view.rgb.std() < 3.0
    assert abs(view.rgb.mean() - 255 * np.sqrt(0.5)) < 6.0  # the mean of the light, not of the values


def test_what_lies_behind_glass_shines_through_but_depth_is_that_of_the_glass():
    glass, red = Material((0.8, 0.9, 0.9), opacity=0.2), Material((0.9, 0.05, 0.05))
    scene = scene_of(
        window=shapes.slab(2.0, 0.0, -2.0, 0.01, 4.0, 4.0, glass), thing=shapes.slab(3.0, 0, -2, 1, 4, 4, red)
    )
    view = Renderer(scene, lit=False).render(CAMERA, looking([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    red_value, green_value, _ = view.rgb[60, 80].astype(int)
    assert red_value > 1.7 * green_value
    assert view.depth_m[60, 80] == pytest.approx(1.995, abs=1e-3)
    assert scene.objects[view.instance[60, 80]].category == "window"


def test_an_empty_scene_is_all_sky():
    view = Renderer(SceneBuilder("empty").build()).render(CAMERA, np.eye(4))
    assert (view.rgb == SKY).all()
    assert not view.depth_m.any()


def test_the_same_view_is_drawn_the_same_twice_and_at_another_size_between():
    builder = SceneBuilder("room")
    builder.add("wall", shapes.box((-3.0, -3.0, 0.0), (3.0, 3.0, 2.6), GREY))
    builder.add("ball", shapes.ellipsoid((2.0, 0.0, 1.0), (0.4,) * 3, GREY))
    builder.areas.append(Area("room", np.array([[-3.0, -3], [3, -3], [3, 3], [-3, 3]])))
    builder.lights.append(Light((0.0, 1.0, 2.3)))
    renderer, pose = Renderer(builder.build()), looking([-2.0, 0.0, 1.2], [1.0, 0.0, 0.0])
    first = renderer.render(CAMERA, pose)
    renderer.render(CAMERA.resized(50, 40), pose)
    again = renderer.render(CAMERA, pose)
    assert np.array_equal(first.rgb, again.rgb)
    assert np.array_equal(first.depth_m, again.depth_m)
