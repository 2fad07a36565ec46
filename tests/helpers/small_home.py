"""A small home: two halves of a room with a door between them, a few things, and sounds that were heard in it."""

import numpy as np

from avlmaps_sim.mesh import Material
from avlmaps_sim.scene import Area, Scene, SceneBuilder
from avlmaps_sim.shapes import box as box_mesh

PLAIN = Material()


def furnished() -> Scene:
    """A room of 8 x 6 m with a wall across it that leaves a door of 1 m, and things in both halves."""
    corners = np.array([[0, 0], [8, 0], [8, 6], [0, 6]], np.float64)
    builder = SceneBuilder("made", areas=[Area("kitchen", corners, name="kitchen")])
    builder.add("floor", box_mesh((0, 0, -0.1), (8, 6, 0), PLAIN))
    for low, high in (
        ((-0.1, -0.1, 0), (0, 6.1, 2.6)), ((8, -0.1, 0), (8.1, 6.1, 2.6)), ((0, -0.1, 0), (8, 0, 2.6)),
        ((0, 6, 0), (8, 6.1, 2.6)), ((3.95, 0, 0), (4.05, 5, 2.6)),
    ):  # fmt: skip
        builder.add("wall", box_mesh(low, high, PLAIN))
    for category, x, y in (
        ("chair", 0.5, 0.5), ("chair", 7.5, 0.5), ("table", 2.0, 3.0), ("lamp", 7.0, 5.0), ("plant", 0.5, 5.5),
        ("lamp", 0.5, 3.0), ("tv", 7.5, 3.0),
    ):  # fmt: skip
        builder.add(category, box_mesh((x - 0.25, y - 0.25, 0), (x + 0.25, y + 0.25, 0.9), PLAIN), area=0)
    return builder.build()


HEARD = (
    ("snoring", 1.5, 1.0), ("doorbell", 6.5, 1.0), ("frying", 2.0, 5.0), ("laughing", 6.0, 5.0),
    ("dog bark", 1.2, 4.0), ("doorbell", 1.2, 2.2), ("blender", 5.0, 2.0), ("toilet flush", 6.0, 3.0),
)  # fmt: skip
