"""Which home the demonstration walks through: the first, counted from a seed, that suits the questions."""

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.wording import option
from avlmaps_sim.demo.evidence import Box, Evidence
from avlmaps_sim.demo.questions import FURNITURE, in_a_room, spoken
from avlmaps_sim.hearing import KINDS, Synthesised
from avlmaps_sim.scene import Scene
from avlmaps_sim.scenes import open_scene

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
    """Return the kinds of furniture of which one can be near a place that another is far from."""
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
