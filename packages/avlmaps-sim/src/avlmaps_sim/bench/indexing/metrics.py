"""The figures of the tables: recall within distances, mean distance, and their intervals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps_sim.bench.harness.intervals import wilson
from avlmaps_sim.bench.indexing.tasks import Task
from avlmaps_sim.mesh import Triple

LIMITS_M = (0.5, 1.0, 1.5, 2.0)
_RESAMPLES = 2000


@dataclass(frozen=True, slots=True)
class Answered:
    """A configuration's answer to a task.

    ``position`` is the first goal, metres, world. Distances are horizontal, to the nearest point of the nearest
    target's box and to its middle; for no answer they are the scene's largest.
    """

    task: str
    configuration: str
    position: Triple | None
    off_m: float
    centre_m: float
    found: bool = False


def judged(task: Task, configuration: str, position: Triple | None, largest_m: float, found: bool = False) -> Answered:
    """Compare an answer with the truth; none at all is as wrong as the scene is large."""
    if position is None:
        return Answered(task.name, configuration, None, largest_m, largest_m)
    return Answered(task.name, configuration, position, task.off_m(position), task.centre_off_m(position), found)


@dataclass(frozen=True, slots=True)
class Score:
    """A configuration's figures over all tasks of a table.

    Hits are off by less than each of ``LIMITS_M``; the interval of the mean is bootstrapped over the tasks.
    """

    count: int
    answered: int
    hits: tuple[int, ...]
    mean_m: float
    mean_interval_m: tuple[float, float]

    def recall(self, limit_m: float) -> float:
        """Return the share of the tasks answered within a distance of ``LIMITS_M``."""
        return self.hits[LIMITS_M.index(limit_m)] / self.count if self.count else 0.0

    def recall_interval(self, limit_m: float) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the recall."""
        return wilson(self.hits[LIMITS_M.index(limit_m)], self.count)


def scored(answers: Sequence[Answered], seed: int = 0, *, by_centre: bool = False) -> Score:
    """Sum up answers, by the nearest face of the right thing or by its centre."""
    off_m = np.array([answer.centre_m if by_centre else answer.off_m for answer in answers], np.float64)
    hits = tuple(int((off_m < limit).sum()) for limit in LIMITS_M)
    answered = sum(answer.position is not None for answer in answers)
    mean = float(off_m.mean()) if len(off_m) else 0.0
    return Score(len(answers), answered, hits, mean, bootstrapped_mean(off_m, np.random.default_rng(seed)))


def chance(tasks: Sequence[Task]) -> float:
    """Return the share that is right where one of the candidates of each name is drawn at random."""
    return float(np.mean([len(task.targets) / (len(task.targets) + task.rivals) for task in tasks])) if tasks else 0.0


def bootstrapped_mean(values: Float[np.ndarray, " n"], rng: np.random.Generator) -> tuple[float, float]:
    """Return the 95 % percentile interval of a mean over resamples; of nothing (0, 0)."""
    if not len(values):
        return 0.0, 0.0
    means = values[rng.integers(len(values), size=(_RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return float(low), float(high)
