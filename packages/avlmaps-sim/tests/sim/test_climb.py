"""Stairs of a scene are climbed: a walk through a building of two floors sees both."""

import numpy as np
import pytest

from avlmaps_sim.free_space import free_space
from avlmaps_sim.mesh import Material
from avlmaps_sim.scene import Area, Scene, SceneBuilder
from avlmaps_sim.shapes import box
from avlmaps_sim.walk import WalkSettings, climb, walk_through

GREY = Material()
UPPER_M, STEPS, TREAD_M = 2.7, 15, 0.26
TOP_X = 1.5 + STEPS * TREAD_M


def building(stairs: bool = True) -> Scene:
    """Two floors of 7 x 4 m with a well, and a straight flight in it."""
    builder = SceneBuilder("two floors")
    for kind in ("hallway", "bedroom"):
        z = 0.0 if kind == "hallway" else UPPER_M
        outline = np.array([[0.0, 0.0], [7.0, 0.0], [7.0, 4.0], [0.0, 4.0]])
        builder.areas.append(Area(kind, outline, z, z + 2.4, f"{kind} 1"))
    builder.add("floor", box((0, 0, -0.1), (7, 4, 0), GREY))
    for low, high in (((0, 0), (7, 2.8)), ((0, 2.8), (1.5, 4)), ((TOP_X, 2.8), (7, 4))):
        builder.add("floor", box((*low, UPPER_M - 0.2), (*high, UPPER_M), GREY))
    builder.add("ceiling", box((0, 0, 5.1), (7, 4, 5.2), GREY))
    for low, high in (((-0.1, 0), (0, 4)), ((7, 0), (7.1, 4)), ((0, -0.1), (7, 0)), ((0, 4), (7, 4.1))):
        builder.add("wall", box((*low, 0), (*high, 5.1), GREY))
    for step in range(STEPS if stairs else 0):
        x, top = 1.5 + step * TREAD_M, (step + 1) * UPPER_M / STEPS
        builder.add("stairs", box((x, 2.9, top - 0.18), (x + TREAD_M, 4.0, top), GREY))
    return builder.build()


SCENE = building()


def floors(scene: Scene):
    return [free_space(scene, 0.22, 1.6, floor=number) for number in (0, 1)]


def test_the_stairs_of_a_scene_are_a_path_from_floor_to_floor() -> None:
    below, above = floors(SCENE)
    path = climb(SCENE, below, above, 1.6)
    assert path is not None
    assert path[0, 2] == pytest.approx(0.0, abs=0.02) and path[-1, 2] == pytest.approx(UPPER_M, abs=0.02)
    assert bool(below.is_free(path[0, :2])) and bool(above.is_free(path[-1, :2]))
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() < 0.25


def test_without_stairs_there_is_no_path() -> None:
    bare = building(stairs=False)
    assert climb(bare, *floors(bare), 1.6) is None


def test_a_walk_of_every_floor_climbs_and_never_jumps() -> None:
    settings = WalkSettings(every_floor=True, look_around=False)
    poses = walk_through(SCENE, np.random.default_rng(0), settings)
    z = poses[:, 2, 3]
    assert z[0] < 1.6 and z[-1] > UPPER_M + 1.1
    assert np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).max() < 0.08
    between = (z > 1.7) & (z < UPPER_M + 1.0)
    x, y = poses[between, 0, 3], poses[between, 1, 3]
    assert between.any() and (y > 2.8).all() and ((x > 1.4) & (x < TOP_X + 0.1)).all()
    turn = np.abs(np.diff(np.unwrap(np.arctan2(poses[:, 1, 2], poses[:, 0, 2]))))
    assert turn.max() <= settings.turn_rad_s / settings.rate_hz + 0.02


def test_one_floor_is_still_one_floor() -> None:
    for number, least in ((0, 0.0), (1, UPPER_M)):
        z = walk_through(SCENE, np.random.default_rng(0), WalkSettings(floor=number, look_around=False))[:, 2, 3]
        assert (z > least + 1.1).all() and (z < least + 1.6).all()
