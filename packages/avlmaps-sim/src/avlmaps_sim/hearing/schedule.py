"""When each source sounds: as the robot comes by, one after the other, far enough apart."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from avlmaps_sim.hearing.sources import Source
from avlmaps_sim.mesh import Triple
from avlmaps_sim.mixing.spacing import Walk
from avlmaps_sim.scene import Scene

_OTHER_ROOM_M = 4.0  # a source in another room counts as this much farther away
_STEP_S = 0.1


@dataclass(frozen=True, slots=True)
class ScheduleRule:
    """How sounds share the time of a walk.

    Attributes:
        pause_s: least silence between two; negative lets them overlap by as much.
        distance_m: least distance between any two places at which the robot records different sounds, as in the paper,
            and between any two sources.
        twins_m: least distance between two sources of one kind.
        reach_m: a source that the robot passes at no less than this (mean over the sound) does not play at all.
    """

    pause_s: float = 1.0
    distance_m: float = 2.0
    twins_m: float = 4.0
    reach_m: float = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class Sounding:
    """A source, and when it sounds.

    Attributes:
        source: what.
        onset_s: when it begins to sound (the recording's time, at the source).
        offset_s: when it ends.
        robot: where the robot is when it is half over.
    """

    source: Source
    onset_s: float
    offset_s: float
    robot: Triple


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
    """Takes sources into the schedule one by one."""

    scene: Scene
    walk: Walk
    rule: ScheduleRule
    found: list[Sounding] = field(default_factory=list)
    _areas: np.ndarray | None = None

    def take_several_of(self, sources: Sequence[Source], places: int) -> bool:
        """Let as many of these play that are far apart from each other, or none."""
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
        """Let the first of these play for which there is room."""
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
