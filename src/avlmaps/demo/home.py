"""Which home the demonstration walks through: the first, counted from a seed, that can be asked about."""

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AvlmapsError
from avlmaps.demo.questions import FURNITURE, spoken
from avlmaps.sim.hearing import KINDS, Synthesised
from avlmaps.sim.scene import Scene
from avlmaps.sim.scenes import open_scene

# Homes of these seeds, and the held-out families of furniture that they are made of, no training has seen.
FIRST_SEED, SEEDS_APART = 3_000_000, 1000
_TRIES = 40
_ROOMS = (5, 9)
_LARGEST_M2 = 110.0
_FEWEST_SOUNDS = 6
_EVERYWHERE = {"door", "folding door", "window", "picture"}


def choose_home(seed: int) -> Scene:
    """Return the first home from a seed on that fits; only what stands in it decides, never what a map answers.

    Raises:
        AvlmapsError: none of many fits.
    """
    for number in range(_TRIES):
        scene = open_scene(f"house:{FIRST_SEED + SEEDS_APART * seed + number}:held-out")
        if fits(scene):
            return scene
    raise AvlmapsError(f"None of {_TRIES} homes from seed {seed} on fits the demonstration; try another --seed.")


def fits(scene: Scene) -> bool:
    """Tell whether a home is of one floor, neither small nor large, and holds what the questions ask for."""
    if len({area.floor_m for area in scene.areas}) != 1 or not _ROOMS[0] <= len(scene.areas) <= _ROOMS[1]:
        return False
    if sum(_area_m2(area.polygon) for area in scene.areas) > _LARGEST_M2:
        return False
    categories = {thing.category for thing in scene.objects}
    kinds_of_area = {
        name: {scene.areas[t.area].kind for t in scene.objects if t.category == name and t.area >= 0}
        for name in categories & set(FURNITURE)
    }
    in_two_rooms = [name for name, kinds in kinds_of_area.items() if len(kinds) >= 2]
    return bool(spoken(categories)) and len(in_two_rooms) >= 3 and len(sounds_of(scene)) >= _FEWEST_SOUNDS


def sounds_of(scene: Scene) -> tuple[str, ...]:
    """Return the kinds of sound that things of a home make, those of doors and windows left out."""
    categories = {thing.category for thing in scene.objects} - _EVERYWHERE
    made = set(Synthesised().categories)
    here = {kind.names[0] for kind in KINDS if kind.indoors and categories & set(kind.objects)}
    return tuple(sorted(here & made))


def _area_m2(polygon: Float[np.ndarray, "k 2"]) -> float:
    x, y = polygon.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
