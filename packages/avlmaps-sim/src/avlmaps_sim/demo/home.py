"""The home of the demonstration, the first from a seed that suits the questions, and photos off the walk."""

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AvlmapsError
from avlmaps.core.wording import option
from avlmaps_sim.demo.evidence import Box, Evidence
from avlmaps_sim.demo.questions import FURNITURE, PhotoView, in_a_room, spoken
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.hearing import KINDS, Synthesised
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import NOTHING, Scene
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.views import random_views

# Homes of these seeds, and the held-out families of furniture that they are made of, no training has seen.
FIRST_SEED, SEEDS_APART = 3_000_000, 1000
_TRIES = 40
_ROOMS = (5, 9)
_LARGEST_M2 = 110.0
_FEWEST_SOUNDS = 6
_FEWEST_FAR_APART, _FAR_M = 4, 4.0
_EVERYWHERE = {"door", "folding door", "window", "picture"}


def choose_home(seed: int) -> Scene:
    """Return the first home from a seed on that fits; only its furniture decides, never an answer of a map.

    Raises:
        AvlmapsError: none of many fits.
    """
    for number in range(_TRIES):
        scene = open_scene(f"house:{FIRST_SEED + SEEDS_APART * seed + number}:held-out")
        if fits(scene):
            return scene
    raise AvlmapsError(
        f"None of {_TRIES} homes from seed {seed} on fits the demonstration; try another {option('seed')}."
    )


def fits(scene: Scene) -> bool:
    """Return whether a home is of one floor, neither small nor large, and holds what the questions need."""
    if len({area.floor_m for area in scene.areas}) != 1 or not _ROOMS[0] <= len(scene.areas) <= _ROOMS[1]:
        return False
    if sum(_area_m2(area.polygon) for area in scene.areas) > _LARGEST_M2:
        return False
    every = np.ones(len(scene.objects), bool)
    evidence = Evidence(scene.objects, every, scene.areas, (), np.zeros(0), np.zeros((0, 3)))
    in_room = in_a_room(evidence, np.random.default_rng(0))
    return (
        bool(spoken(thing.category for thing in scene.objects))
        and in_room is not None
        and in_room.about in FURNITURE
        and len(_far_apart(evidence)) >= _FEWEST_FAR_APART
        and len(sounds_of(scene)) >= _FEWEST_SOUNDS
    )


def _far_apart(evidence: Evidence) -> list[str]:
    found: list[str] = []
    for category, own in evidence.ambiguous().items():
        boxes = [Box.of(evidence.objects[i]) for i in own]
        if category in FURNITURE and max(a.apart_m(b) for a in boxes for b in boxes) >= _FAR_M:
            found.append(category)
    return found


def sounds_of(scene: Scene) -> tuple[str, ...]:
    """Return the kinds of sound that things of a home make, those of doors and windows left out."""
    categories = {thing.category for thing in scene.objects} - _EVERYWHERE
    made = set(Synthesised().categories)
    here = {kind.names[0] for kind in KINDS if kind.indoors and categories & set(kind.objects)}
    return tuple(sorted(here & made))


def _area_m2(polygon: Float[np.ndarray, "k 2"]) -> float:
    x, y = polygon.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


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
