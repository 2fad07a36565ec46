"""Floors to drive over: scenes of boxes, and the obstacle grid that a perfect map of a scene would hold."""

from collections.abc import Sequence

import numpy as np

from avlmaps.maps.obstacles import SIGHT_M, CellState, Obstacles
from avlmaps_sim import shapes
from avlmaps_sim.free_space import floor_cells, floor_heights
from avlmaps_sim.grid_kernels import mark_slab
from avlmaps_sim.mesh import Material
from avlmaps_sim.scene import Scene, SceneBuilder

GREY = Material((0.5, 0.5, 0.5))
WALL_M = 0.1
Box = tuple[float, float, float, float, float, float]


def hall(width_m: float, depth_m: float, boxes: Sequence[Box] = ()) -> Scene:
    """Return a room from (0, 0) to its width and depth, with walls round it and boxes (low x y z, high x y z) in it."""
    build = SceneBuilder("hall")
    w, d, t = width_m, depth_m, WALL_M
    build.add("floor", shapes.box((-t, -t, -0.1), (w + t, d + t, 0.0), GREY))
    for low, high in (
        ((-t, -t), (0, d + t)),
        ((w, -t), (w + t, d + t)),
        ((-t, -t), (w + t, 0)),
        ((-t, d), (w + t, d + t)),
    ):
        build.add("wall", shapes.box((*low, 0.0), (*high, 2.5), GREY))
    for box in boxes:
        build.add("box", shapes.box(box[:3], box[3:], GREY))
    return build.build()


def seen(scene: Scene, cell_size_m: float = 0.05, height_m: float = 1.5, step_m: float = 0.1) -> Obstacles:
    """Return what a map that misses nothing of a scene knows of its floor."""
    corners = scene.mesh.corners().astype(np.float64)
    floor_m = floor_heights(scene)[0]
    low = np.floor(scene.mesh.low[:2].astype(np.float64) / cell_size_m) - 1
    shape = tuple(int(n) for n in np.ceil(scene.mesh.high[:2] / cell_size_m) + 1 - low)
    origin = low * cell_size_m
    occupied, tall = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    mark_slab(corners, floor_m + step_m, floor_m + height_m, origin, cell_size_m, occupied)
    mark_slab(corners, floor_m + SIGHT_M[0], floor_m + SIGHT_M[1], origin, cell_size_m, tall)
    ground = floor_cells(scene, floor_m, origin, (shape[0], shape[1]), cell_size_m)
    states = np.where(occupied, CellState.OCCUPIED, np.where(ground, CellState.FREE, CellState.UNKNOWN))
    return Obstacles(np.eye(3), origin, cell_size_m, floor_m, states.astype(np.uint8), tall)
