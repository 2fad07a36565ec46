"""The figures of runs: subgoals in a row, independent ones, success weighted by path length. Pure functions."""

from collections.abc import Sequence

import numpy as np

from avlmaps.core.motion import FORWARD_M

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
