"""Which things of a scene sound, and when: as the robot comes by, one after the other, far enough apart."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.recordings.audio import Sound
from avlmaps_sim.hearing.sound_library import ANYWHERE, Bank, SoundKind, Synthesised, chosen_categories, kind_of
from avlmaps_sim.mesh import Triple
from avlmaps_sim.mixing.spacing import Walk
from avlmaps_sim.scene import Scene

_REACH_M = 2.5  # a source is placed only where the robot comes so near
_STOREY_M = 2.0
_FLOOR_PLACES = 12  # candidates on the floor for each kind
_OFF_THE_WAY_M = 0.6  # nothing sounds where the robot drives
_FROM_WALL_M = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Something that sounds once."""

    category: str  # what it sounds like
    position: Triple  # where, metres, world
    instance: int  # the object that makes it, an index into the scene's objects; −1 for none
    clip: str  # the name of the clip
    sound: Sound  # the sound itself, as recorded close by
    level_db: float = 0.0  # loudness at 1 m against other kinds


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


_OTHER_ROOM_M = 4.0  # a source in another room counts as this much farther away
_STEP_S = 0.1


@dataclass(frozen=True, slots=True)
class ScheduleRule:
    """How sounds share the time of a walk."""

    pause_s: float = 1.0  # least silence between two; negative lets them overlap by as much
    # Least distance between any two places at which the robot records different sounds, as in the paper, and between
    # any two sources.
    distance_m: float = 2.0
    twins_m: float = 4.0  # least distance between two sources of one kind
    # A source that the robot passes at no less than this (mean over the sound) does not play at all.
    reach_m: float = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Sounding:
    """A source, and when it sounds."""

    source: Source  # what
    onset_s: float  # when it begins to sound (the recording's time, at the source)
    offset_s: float  # when it ends
    robot: Triple  # where the robot is when it is half over


def schedule(
    scene: Scene,
    sources: Sequence[Source],
    stamps_s: Float[np.ndarray, " n"],
    robot: Float[np.ndarray, "n 3"],
    rule: ScheduleRule | None = None,
    most: int | None = None,
    ambiguous: int = 0,
    places: int = 2,
) -> list[Sounding]:
    """Let sources sound when the robot is nearest to them, as far as the rule allows; what finds no room is left out.

    Each kind plays once, from the first of its sources for which there is room; ``ambiguous`` of the kinds play in
    ``places`` places that are far apart, and these come first. The most wanted sources come first; one in another room
    than the robot counts as farther away.
    """
    planner = _Planner(scene, Walk.along(stamps_s, robot), rule or ScheduleRule())
    most = len(sources) if most is None else most
    kinds: dict[str, list[Source]] = {}
    for source in sources:
        kinds.setdefault(source.category, []).append(source)
    for name, own in list(kinds.items()):
        if ambiguous > 0 and len(planner.found) + places <= most and planner.take_several_of(own, places):
            ambiguous -= 1
            del kinds[name]
    for own in kinds.values():
        if len(planner.found) < most:
            planner.take_one_of(own)
    return sorted(planner.found, key=lambda sounding: sounding.onset_s)


@dataclass(slots=True)
class _Planner:
    scene: Scene
    walk: Walk
    rule: ScheduleRule
    found: list[Sounding] = field(default_factory=list)
    _areas: np.ndarray | None = None

    def take_several_of(self, sources: Sequence[Source], places: int) -> bool:
        before = len(self.found)
        for first in range(len(sources)):
            for source in sources[first:]:
                taken = [sounding.source for sounding in self.found[before:]]
                if all(_distance_m(source, other) >= self.rule.twins_m for other in taken):
                    self.take_one_of([source])
                if len(self.found) == before + places:
                    return True
            del self.found[before:]
        return False

    def take_one_of(self, sources: Sequence[Source]) -> bool:
        for source in sources:
            if any(_distance_m(source, other.source) < self.rule.distance_m for other in self.found):
                continue
            cost = self._mean_distance_m(source)
            free = _free_onsets(self.walk, self.found, _steps(source), self.rule) & (cost < self.rule.reach_m)
            if free.any():
                self.found.append(self._sounding(source, int(np.where(free, cost, np.inf).argmin())))
                return True
        return False

    def _sounding(self, source: Source, step: int) -> Sounding:
        onset_s = float(self.walk.stamps_s[step])
        half = self.walk.position[self.walk.index(onset_s + source.sound.duration_s / 2)]
        robot = (float(half[0]), float(half[1]), float(half[2]))
        return Sounding(source, onset_s, onset_s + source.sound.duration_s, robot)

    def _mean_distance_m(self, source: Source) -> Float[np.ndarray, " onsets"]:
        if self._areas is None:
            self._areas = np.array([self.scene.area_at(place) for place in self.walk.position])
        distance_m = np.linalg.norm(self.walk.position - np.asarray(source.position), axis=1)
        at_object = self.scene.objects[source.instance].area if source.instance >= 0 else -1
        own = at_object if at_object >= 0 else self.scene.area_at(source.position)
        if own >= 0:
            distance_m = distance_m + _OTHER_ROOM_M * ((self._areas != own) & (self._areas >= 0))
        steps = _steps(source)
        total = np.concatenate([[0.0], np.cumsum(distance_m)])
        return (total[steps:] - total[:-steps]) / steps if steps <= len(distance_m) else np.zeros(0)


def _distance_m(a: Source, b: Source) -> float:
    return float(np.linalg.norm(np.subtract(a.position, b.position)))


def _steps(source: Source) -> int:
    return int(np.ceil(source.sound.duration_s / _STEP_S)) + 1


def _free_onsets(walk: Walk, found: Sequence[Sounding], steps: int, rule: ScheduleRule) -> Bool[np.ndarray, " onsets"]:
    """Return at which onsets a sound of ``steps`` steps would satisfy the rule."""
    if steps > len(walk.stamps_s):
        return np.zeros(0, bool)
    taken = np.zeros(len(walk.stamps_s), bool)
    for other in found:
        begin, end = other.onset_s - rule.pause_s, other.offset_s + rule.pause_s
        taken |= (walk.stamps_s > begin) & (walk.stamps_s < end)
        heard = walk.position[walk.index(other.onset_s) : walk.index(other.offset_s) + 1]
        away = np.linalg.norm(walk.position[:, None] - heard[None], axis=2).min(axis=1)
        taken |= away < rule.distance_m
    blocked = np.concatenate([[0], np.cumsum(taken)])
    return blocked[steps:] == blocked[:-steps]
