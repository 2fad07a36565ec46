"""Mirrors: what they reflect is the world turned round their plane, by closed forms and against such a world drawn."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps_sim import shapes
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, triangles_of
from avlmaps_sim.render import Plane, Renderer, in_front_of, reflected
from avlmaps_sim.scene import Scene, SceneBuilder
from avlmaps_sim.views import camera_poses

CAMERA = Pinhole(150.0, 150.0, 80.0, 60.0, 160, 120)
WALL, RED = Material((0.8, 0.8, 0.8)), Material((0.9, 0.1, 0.1))
GLASS = replace(material("mirror", np.random.default_rng(0)), texture=None, texture_size_m=(1.0, 1.0))


def room(tilt_rad: float = 0.0) -> Scene:
    """Return a room of 6 x 4 x 3 m; a mirror of 1.6 m at x = 0.05, a red ball that only the mirror shows."""
    builder = SceneBuilder("room")
    builder.add("wall", shapes.box((0.0, -2.0, 0.0), (6.0, 2.0, 3.0), WALL))
    pane = shapes.sheet((0.0, -0.8, -0.8), (0.0, 1.6, 0.0), (0.0, 0.0, 1.6), GLASS)
    builder.add("mirror", pane.tilted("y", tilt_rad).moved(0.05, 0.0, 1.5))
    builder.add("ball", shapes.ellipsoid((4.0, 0.0, 1.5), (0.3, 0.3, 0.3), RED, 40, 24))
    return builder.build()


def views(scene: Scene, place: tuple[float, float, float], heading: float = np.pi, mirrors: bool = True):
    pose = camera_poses(np.array([place]), np.array([heading]), np.zeros(1), np.zeros(1))[0]
    return Renderer(replace(scene, mirrors=mirrors), lit=False).render(CAMERA, pose)


def test_a_flat_mirror_shows_the_wall_behind_the_camera_as_far_away_as_light_travels():
    view = views(room(), (2.0, -1.0, 2.4))
    mirror = view.category == room().categories.index("mirror")
    # The wall at x = 6 appears at x = 0.05 - 5.95; side walls, floor and ceiling appear nearer.
    assert view.depth_m[mirror].max() == pytest.approx(2.0 + 5.9, abs=1e-3)
    plain = views(room(), (2.0, -1.0, 2.4), mirrors=False)
    assert plain.depth_m[mirror].max() == pytest.approx(1.95, abs=1e-3)
    np.testing.assert_array_equal(view.category, plain.category)
    np.testing.assert_array_equal(view.depth_m[~mirror], plain.depth_m[~mirror])
    np.testing.assert_array_equal(view.rgb[~mirror], plain.rgb[~mirror])


def test_a_mirror_shows_what_stands_behind_the_camera():
    view = views(room(), (2.0, 0.0, 1.5))
    red = (view.rgb[..., 0] > 2.0 * view.rgb[..., 1]) & (view.category == room().categories.index("mirror"))
    assert red.sum() > 50
    # From the camera to the glass 1.95 m, from there to the ball's near side 3.65 m.
    assert view.depth_m[red].min() == pytest.approx(1.95 + 3.65, abs=0.01)
    plain = views(room(), (2.0, 0.0, 1.5), mirrors=False).rgb
    assert (plain[..., 0][red] < 1.2 * plain[..., 1][red]).all()


@pytest.mark.parametrize("tilt", [0.15, -0.15])
def test_a_leaning_mirror_reflects_although_the_wall_behind_crosses_its_plane(tilt: float):
    view = views(room(tilt), (2.0, -0.3, 1.4))
    mirror = view.category == room().categories.index("mirror")
    assert (view.depth_m[mirror] > 3.0).mean() > 0.95


def test_a_mirror_from_behind_or_out_of_sight_changes_nothing():
    away = views(room(), (2.0, 0.0, 1.5), heading=0.0)
    plain = views(room(), (2.0, 0.0, 1.5), heading=0.0, mirrors=False)
    np.testing.assert_array_equal(away.rgb, plain.rgb)


def test_the_reflection_is_a_view_of_the_world_turned_round():
    """Draw the world mirrored at x = 0.05 in truth, without wall and mirror, and compare inside the mirror."""
    view = views(room(), (2.5, -0.6, 1.7))
    mirror = view.category == room().categories.index("mirror")
    far = SceneBuilder("beyond")
    far.add("wall", shapes.box((-5.9, -2.0, 0.0), (6.0, 2.0, 3.0), WALL))
    far.add("ball", shapes.ellipsoid((0.1 - 4.0, 0.0, 1.5), (0.3, 0.3, 0.3), RED, 40, 24))
    beyond = views(far.build(), (2.5, -0.6, 1.7))
    close = np.abs(view.depth_m - beyond.depth_m)[mirror] < 0.02
    assert close.mean() > 0.98  # the outlines of two meshes of one ball differ by a pixel here and there


@given(st.integers(0, 2**31), st.tuples(*[st.floats(-1, 1)] * 3), st.floats(-1, 1))
def test_cutting_leaves_what_lies_in_front(seed: int, normal: tuple[float, float, float], offset: float):
    across = np.array(normal)
    if np.linalg.norm(across) < 0.1:
        return
    plane = Plane(across / np.linalg.norm(across), offset)
    mesh = triangles_of(np.random.default_rng(seed).uniform(-2, 2, (60, 3)), np.arange(60).reshape(-1, 3), WALL)
    corner = mesh.corners().reshape(-1, 9)
    first, second = in_front_of(plane, corner)
    height = corner.reshape(-1, 3, 3) @ plane.normal - plane.offset_m

    def area(nine: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(nine.reshape(-1, 3, 3).astype(float), 1, 0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    kept, whole = area(first) + area(second), area(corner)
    assert (kept <= whole * (1 + 1e-4) + 1e-6).all()
    np.testing.assert_allclose(kept[(height > 0.01).all(axis=1)], whole[(height > 0.01).all(axis=1)], rtol=1e-5)
    np.testing.assert_allclose(kept[(height < 0.0).all(axis=1)], 0.0)
    for part in (first, second):
        there = area(part) > 1e-6
        assert (part[there].reshape(-1, 3, 3) @ plane.normal - plane.offset_m > -1e-3).all()
    # The two halves of a triangle add up to it.
    other = Plane(-plane.normal, -plane.offset_m)
    back = sum(area(part) for part in in_front_of(other, corner))
    assert np.abs(kept + back - whole).max() < 0.03  # within the width of the glass


def test_reflecting_twice_is_nothing():
    plane = Plane(np.array([0.6, 0.0, 0.8]), 0.7)
    rotation, shift = reflected(plane, *reflected(plane, np.eye(3), np.array([0.1, 0.2, 0.3])))
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(shift, [0.1, 0.2, 0.3], atol=1e-12)
