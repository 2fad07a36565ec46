"""Photos that the robot did not take: from places off its walk, of what it did see."""

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole
from avlmaps_sim.demo.evidence import Evidence
from avlmaps_sim.demo.questions import PhotoView
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import NOTHING, Scene
from avlmaps_sim.views import random_views

_TRIED = 150
_OFF_THE_WALK_M = 0.4
# The robot must have looked the same way from not too far: a wall's other side can be recognised by nobody.
_LOOKED_FROM_M, _LOOKED_ALIKE_RAD = 2.0, np.deg2rad(45.0)
_DEPTH_M = (1.0, 5.0)
_STOREY_M = 1.5
# A bare wall could be any: at least this many things, walls not counted, fill this share of a picture each.
_FEWEST_THINGS, _LEAST_SHARE = 2, 0.01


def photo_views(
    scene: Scene,
    renderer: Renderer,
    camera: Pinhole,
    evidence: Evidence,
    world_from_camera: Float[np.ndarray, "n 4 4"],
    rng: np.random.Generator,
) -> list[PhotoView]:
    """Return pictures off the walk, looking at what the walk looked at too; those that show most things first."""
    found: list[tuple[int, PhotoView]] = []
    is_thing = np.array([thing.category not in STRUCTURE for thing in scene.objects], bool)
    for pose in random_views(scene, rng, _TRIED, camera):
        away = np.linalg.norm(evidence.walk - pose[:3, 3], axis=1)
        away_m = float(np.linalg.norm((evidence.walk - pose[:3, 3])[:, :2], axis=1).min())
        alike = world_from_camera[:, :3, 2] @ pose[:3, 2] > np.cos(_LOOKED_ALIKE_RAD)
        if away_m < _OFF_THE_WALK_M or away.min() > _STOREY_M or not (alike & (away < _LOOKED_FROM_M)).any():
            continue
        view = renderer.render(camera, pose)
        solid = view.instance != NOTHING
        middle_m = float(np.median(view.depth_m[solid])) if solid.mean() > 0.9 else 0.0
        if _DEPTH_M[0] <= middle_m <= _DEPTH_M[1]:
            share = np.bincount(view.instance[solid], minlength=len(scene.objects)) / solid.size
            things = int((share[is_thing] >= _LEAST_SHARE).sum())
            found += [(things, PhotoView(pose, share, away_m))] if things >= _FEWEST_THINGS else []
    return [photo for _, photo in sorted(found, key=lambda entry: -entry[0])]
