"""A row's figures over the episodes of one configuration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from avlmaps_sim.bench.harness.figures import in_percent, wilson
from avlmaps_sim.bench.navigation.episodes import Episode, Leg
from avlmaps_sim.bench.navigation.metrics import grouped_interval, in_a_row, independent
from avlmaps_sim.bench.navigation.missions import GoalKind


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
