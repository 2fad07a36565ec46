"""Placing sounds in a scene: at the things that make them, or on the floor of the rooms where they occur."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from avlmaps.recordings.audio import Sound
from avlmaps_sim.hearing.kinds import ANYWHERE, SoundKind, kind_of
from avlmaps_sim.hearing.sound_library import Bank, Synthesised, chosen_categories
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import Scene

_REACH_M = 2.5  # a source is placed only where the robot comes so near
_STOREY_M = 2.0
_FLOOR_PLACES = 12  # candidates on the floor for each kind
_OFF_THE_WAY_M = 0.6  # nothing sounds where the robot drives
_FROM_WALL_M = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Something that sounds once.

    Attributes:
        category: what it sounds like.
        position: where, metres, world.
        instance: the object that makes it, an index into the scene's objects; −1 for none.
        clip: the name of the clip.
        sound: the sound itself, as recorded close by.
        level_db: loudness at 1 m against other kinds.
    """

    category: str
    position: Triple
    instance: int
    clip: str
    sound: Sound
    level_db: float = 0.0


@dataclass(frozen=True, slots=True)
class _Place:
    position: Triple
    instance: int


def candidates(
    scene: Scene,
    rng: np.random.Generator,
    kinds: int,
    categories: Sequence[str] | None = None,
    *,
    bank: Bank | None = None,
    walk: Float[np.ndarray, "n 3"] | None = None,
) -> list[Source]:
    """Return several places for each of several kinds of sound, to choose from (see ``schedule``).

    Only places that the ``walk`` comes near to are taken.
    """
    bank = bank or Synthesised()
    names = chosen_categories(bank, tuple(categories) if categories else None)
    found: list[Source] = []
    for index in rng.permutation(len(names)):
        name = names[index]
        places = _places(scene, kind_of(name), rng, walk)[:_FLOOR_PLACES]
        if places and kinds > 0:
            kinds -= 1
            clips = [_source(name, place, bank, rng) for place in places[:2]]
            found += [replace(clips[i % 2], position=p.position, instance=p.instance) for i, p in enumerate(places)]
    return found


def _source(name: str, place: _Place, bank: Bank, rng: np.random.Generator) -> Source:
    clip, sound = bank.draw(name, rng)
    return Source(name, place.position, place.instance, clip, sound, kind_of(name).level_db)


def _places(
    scene: Scene, kind: SoundKind, rng: np.random.Generator, walk: Float[np.ndarray, "n 3"] | None
) -> list[_Place]:
    found: list[_Place] = []
    for category in kind.objects:
        own = [i for i, thing in enumerate(scene.objects) if thing.category == category]
        at = [_Place(_mouth(scene, int(i), kind), int(i)) for i in rng.permutation(np.array(own, int))]
        found += [place for place in at if _is_near(place, walk)]
        if found and category == kind.objects[0]:
            return found
    if found:
        return [found[i] for i in rng.permutation(len(found))]
    return [place for place in _on_floor(scene, kind, rng, walk) if _is_near(place, walk)]


def _mouth(scene: Scene, instance: int, kind: SoundKind) -> Triple:
    thing = scene.objects[instance]
    x, y, _ = thing.centre
    low, high = thing.low[2], thing.high[2]
    area = scene.areas[thing.area] if thing.area >= 0 else None
    floor_m = area.floor_m if area is not None else min(low, 0.0)
    return (x, y, float(np.clip(floor_m + kind.height_m, low, high + 0.1)))


def _on_floor(
    scene: Scene, kind: SoundKind, rng: np.random.Generator, walk: Float[np.ndarray, "n 3"] | None
) -> list[_Place]:
    areas = [area for area in scene.areas if kind.floor == ANYWHERE or area.kind in kind.floor]
    if not kind.floor or (scene.areas and not areas):
        return []
    if not areas:  # a scene without rooms: where the robot goes, or nowhere
        if walk is None:
            return []
        near = walk[rng.integers(len(walk), size=_FLOOR_PLACES)] + rng.uniform(-1.0, 1.0, (_FLOOR_PLACES, 3))
        low = float(scene.mesh.low[2])
        return [_Place((float(x), float(y), low + kind.height_m), -1) for x, y, _ in near]
    found = []
    for _ in range(_FLOOR_PLACES):
        area = areas[int(rng.integers(len(areas)))]
        low, high = area.polygon.min(axis=0) + _FROM_WALL_M, area.polygon.max(axis=0) - _FROM_WALL_M
        xy = rng.uniform(np.minimum(low, high), np.maximum(low, high))
        clear = walk is None or np.linalg.norm(walk[:, :2] - xy, axis=1).min() >= _OFF_THE_WAY_M
        if clear and bool(area.contains(xy)):
            found.append(_Place((float(xy[0]), float(xy[1]), area.floor_m + kind.height_m), -1))
    return found


def _is_near(place: _Place, walk: Float[np.ndarray, "n 3"] | None) -> bool:
    if walk is None:
        return True
    away = walk - np.asarray(place.position)
    same_storey = np.abs(away[:, 2]) < _STOREY_M
    return bool((np.linalg.norm(away[:, :2], axis=1)[same_storey] < _REACH_M).any())
