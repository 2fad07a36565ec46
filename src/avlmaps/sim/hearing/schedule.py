"""When each source sounds: as the robot comes by, one after the other, far enough apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.recordings.spacing import Walk
from avlmaps.sim.hearing.sources import Source
from avlmaps.sim.mesh import Triple
from avlmaps.sim.scene import Scene

_OTHER_ROOM_M = 4.0  # a source in another room counts as so much farther away
_STEP_S = 0.1


@dataclass(frozen=True, slots=True)
class ScheduleRule:
    """How sounds share the time of a walk.

    Attributes:
        pause_s: least silence between two; negative lets them overlap by as much.
        distance_m: least distance between any two places at which the robot hears different sounds, as in the paper.
        reach_m: a source that the robot passes at no less than this (mean over the sound) is not heard at all.
    """

    pause_s: float = 1.0
    distance_m: float = 2.0
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
) -> list[Sounding]:
    """Let every source sound when the robot is nearest to it, as far as the rule allows; those without room are left out.

    Those with the fewest possible onsets choose first.

    Args:
        scene: its rooms; a source in another room than the robot counts as farther away.
        sources: what may sound.
        stamps_s: when the robot was where.
        robot: its places.
        rule: what keeps sounds apart.

    Returns:
        In the order of their onsets.
    """
    rule = rule or ScheduleRule()
    walk = Walk.along(stamps_s, robot)
    areas = np.array([scene.area_at(place) for place in walk.position])
    wanted = [_mean_distance_m(scene, source, walk, areas) for source in sources]
    order = sorted(range(len(sources)), key=lambda i: int((wanted[i] < rule.reach_m).sum()))
    found: list[Sounding] = []
    for i in order:
        source, cost = sources[i], wanted[i]
        free = _free_onsets(walk, found, _steps(source), rule)[: len(cost)] & (cost < rule.reach_m)
        if free.any():
            best = int(np.where(free, cost, np.inf).argmin())
            onset_s = float(walk.stamps_s[best])
            half = walk.position[walk.index(onset_s + source.sound.duration_s / 2)]
            at = (float(half[0]), float(half[1]), float(half[2]))
            found.append(Sounding(source, onset_s, onset_s + source.sound.duration_s, at))
    return sorted(found, key=lambda sounding: sounding.onset_s)


def _steps(source: Source) -> int:
    return int(np.ceil(source.sound.duration_s / _STEP_S)) + 1


def _mean_distance_m(scene: Scene, source: Source, walk: Walk, areas: np.ndarray) -> Float[np.ndarray, " onsets"]:
    """Return for every onset that leaves room how far away the robot is from the source while it sounds, on average."""
    distance_m = np.linalg.norm(walk.position - np.asarray(source.position), axis=1)
    own = scene.objects[source.instance].area if source.instance >= 0 else scene.area_at(source.position)
    if own >= 0:
        distance_m = distance_m + _OTHER_ROOM_M * ((areas != own) & (areas >= 0))
    steps = _steps(source)
    if steps > len(distance_m):
        return np.zeros(0)
    total = np.concatenate([[0.0], np.cumsum(distance_m)])
    return (total[steps:] - total[:-steps]) / steps


def _free_onsets(walk: Walk, found: Sequence[Sounding], steps: int, rule: ScheduleRule) -> Bool[np.ndarray, " onsets"]:
    """Tell at which onsets a sound of so many steps would keep the rule."""
    taken = np.zeros(len(walk.stamps_s), bool)
    for other in found:
        begin, end = other.onset_s - rule.pause_s, other.offset_s + rule.pause_s
        taken |= (walk.stamps_s > begin) & (walk.stamps_s < end)
        heard = walk.position[walk.index(other.onset_s) : walk.index(other.offset_s) + 1]
        away = np.linalg.norm(walk.position[:, None] - heard[None], axis=2).min(axis=1)
        taken |= away < rule.distance_m
    blocked = np.concatenate([[0], np.cumsum(taken)])
    return blocked[steps:] == blocked[:-steps] if steps <= len(taken) else np.zeros(0, bool)
