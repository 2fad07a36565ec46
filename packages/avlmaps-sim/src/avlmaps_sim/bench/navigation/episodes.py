"""The outcome of a mission, kept as JSON lines so that a broken run resumes, and the figures of a row of outcomes."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import msgspec
import numpy as np

from avlmaps.core.motion import FORWARD_M
from avlmaps_sim.bench.harness.figures import in_percent, wilson
from avlmaps_sim.bench.navigation.missions import GoalKind, Series

_RESAMPLES = 2000


def in_a_row(reached: Sequence[Sequence[bool]], length: int) -> list[int]:
    """Return how many sequences have the first 1, 2, ... ``length`` subgoals all reached."""
    return [sum(len(own) >= k and all(own[:k]) for own in reached) for k in range(1, length + 1)]


def independent(reached: Sequence[Sequence[bool]]) -> tuple[int, int]:
    """Return how many subgoals were reached, and of how many, regardless of those before."""
    return sum(sum(own) for own in reached), sum(len(own) for own in reached)


def path_weight(reached: bool, shortest_m: float, path_m: float) -> float:
    """Return a subgoal's success weighted by path length, S·l / max(p, l), after Anderson et al. (2018).

    Paths shorter than one step count as one step, so that standing at the goal already is neither 0 nor undefined.
    ``shortest_m`` is infinite where truth has no path.
    """
    if not reached:
        return 0.0
    if not np.isfinite(shortest_m):  # reached over ground that truth calls closed: nothing to compare with
        return 1.0
    shortest_m = max(shortest_m, FORWARD_M)
    return shortest_m / max(path_m, shortest_m)


def spl(legs: Sequence[tuple[bool, float, float]]) -> float:
    """Return the mean of ``path_weight`` over subgoals; 0 of none."""
    return float(np.mean([path_weight(*leg) for leg in legs])) if legs else 0.0


def path_length_m(path: Sequence[Sequence[float]]) -> float:
    """Return the length of a path through places on the ground."""
    places = np.asarray(path, np.float64).reshape(-1, 2)
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def grouped_interval(groups: Sequence[Sequence[float]], seed: int = 0) -> tuple[float, float]:
    """Return the 95 % bootstrapped interval of the mean of all values, whole groups being drawn.

    Subgoals of one sequence hang together: they are drawn together.
    """
    total = np.array([sum(group) for group in groups], np.float64)
    count = np.array([len(group) for group in groups], np.float64)
    if not count.sum():
        return 0.0, 0.0
    drawn = np.random.default_rng(seed).integers(len(groups), size=(_RESAMPLES, len(groups)))
    means = total[drawn].sum(axis=1) / np.maximum(count[drawn].sum(axis=1), 1.0)
    low, high = np.percentile(means, (2.5, 97.5))
    return float(low), float(high)


@dataclass(frozen=True, slots=True)
class Leg:
    """The outcome of one subgoal.

    ``stop`` (x, y, heading) is None where the robot stopped for no such goal; ``off_m`` is its horizontal distance to
    the nearest right thing. ``shortest_m`` is None where truth has no path from where it stood before.
    """

    said: str
    kind: GoalKind
    stop: tuple[float, float, float] | None
    off_m: float | None
    reached: bool
    reachable: bool
    shortest_m: float | None
    path_m: float = 0.0
    actions: int = 0
    contacts: int = 0
    note: str = ""

    @property
    def weight(self) -> float:
        """Its success, weighted by path length."""
        shortest_m = float("inf") if self.shortest_m is None else self.shortest_m
        return path_weight(self.reached, shortest_m, self.path_m)


@dataclass(frozen=True, slots=True)
class Episode:
    """The outcome of one mission with the encoders of one configuration.

    It has several commands where a program broke off and the rest was commanded again. Of the contacts the map had
    ``foretold`` some; ``key`` names everything that the episode depends on.
    """

    mission: str
    series: Series
    scene: str
    configuration: str
    seed: int
    commands: tuple[str, ...]
    programs: tuple[str, ...]
    legs: tuple[Leg, ...]
    contacts: int
    foretold: int
    understood: bool
    key: str

    @property
    def reached(self) -> list[bool]:
        """Which subgoals were reached."""
        return [leg.reached for leg in self.legs]


class Journal:
    """The episodes of one scene, in a file of JSON lines; a line that a kill cut short is dropped."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> dict[str, Episode]:
        """Return the stored episodes, by their keys."""
        return {episode.key: episode for episode in self._lines()}

    def _lines(self) -> Iterator[Episode]:
        if not self.path.exists():
            return
        for line in self.path.read_bytes().splitlines():
            try:
                yield msgspec.json.decode(line, type=Episode)
            except (msgspec.DecodeError, msgspec.ValidationError):
                continue  # cut short, or written by another version: it is run again

    def add(self, episode: Episode) -> None:
        """Append one, on the disk when this returns."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("ab+") as file:
            cut = file.tell() > 0 and not _ends_a_line(file)
            file.write((b"\n" if cut else b"") + msgspec.json.encode(episode) + b"\n")
            file.flush()
            os.fsync(file.fileno())

    def count(self) -> int:
        """Return how many lines there are, without reading what they say."""
        return self.path.read_bytes().count(b"\n") if self.path.exists() else 0


def _ends_a_line(file: BinaryIO) -> bool:
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


@dataclass(frozen=True, slots=True)
class Share:
    """A share with its count and its 95 % interval."""

    hits: int
    count: int
    interval: tuple[float, float]

    @property
    def percent(self) -> float:
        """The share in percent; 0 of nothing."""
        return round(100.0 * self.hits / self.count, 1) if self.count else 0.0

    @property
    def bounds(self) -> str:
        """The interval in percent."""
        return in_percent(self.interval)


@dataclass(frozen=True, slots=True)
class Score:
    """The figures of a row.

    ``rows`` are shares of the missions whose first 1, 2, ... subgoals were all reached, ``whole`` of those of which all
    were; path and actions are means of a subgoal, touches are counted in all.
    """

    sequences: int
    rows: tuple[Share, ...]
    subgoals: Share
    whole: Share
    spl: float
    spl_interval: tuple[float, float]
    path_m: float
    actions: float
    contacts: int
    foretold: int


def scored(episodes: Sequence[Episode], length: int, seed: int = 0) -> Score:
    """Sum up episodes; ``length`` is that of the longest mission, for subgoals in a row."""
    reached = [episode.reached for episode in episodes]
    rows = [Share(hits, len(reached), wilson(hits, len(reached))) for hits in in_a_row(reached, length)]
    hits, count = independent(reached)
    groups = [[float(one) for one in own] for own in reached]
    weights = [[leg.weight for leg in episode.legs] for episode in episodes]
    legs = [leg for episode in episodes for leg in episode.legs]
    whole = sum(all(own) for own in reached)
    return Score(
        len(episodes), tuple(rows), Share(hits, count, grouped_interval(groups, seed)),
        Share(whole, len(reached), wilson(whole, len(reached))),
        _mean([weight for own in weights for weight in own]), grouped_interval(weights, seed),
        _mean([leg.path_m for leg in legs]), _mean([float(leg.actions) for leg in legs]),
        sum(episode.contacts for episode in episodes), sum(episode.foretold for episode in episodes),
    )  # fmt: skip


def share_of(episodes: Sequence[Episode], which: Callable[[Leg], bool], seed: int = 0) -> Share:
    """Return the share of some of the subgoals that were reached."""
    groups = [[float(leg.reached) for leg in episode.legs if which(leg)] for episode in episodes]
    groups = [group for group in groups if group]
    hits, count = int(sum(map(sum, groups))), sum(map(len, groups))
    return Share(hits, count, grouped_interval(groups, seed))


def of_kind(*kinds: GoalKind) -> Callable[[Leg], bool]:
    """Return a function that selects subgoals of some kinds."""
    return lambda leg: leg.kind in kinds


def is_reachable(leg: Leg) -> bool:
    """Return whether any robot of this size could have reached a subgoal."""
    return leg.reachable


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0
