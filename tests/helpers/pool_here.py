"""A pool of workers in this process, for tests of what a cluster does."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass
class Here:
    """A pool in this process, which does jobs in an order of its own."""

    cores: int = 3
    seed: int = 0
    times: int = 1
    change: Callable[[Any], Any] = lambda job: job

    def run(self, function: Callable[[Any], Any], jobs: Sequence[Any]) -> Generator[tuple[int, Any]]:
        for number in np.random.default_rng(self.seed).permutation(len(jobs)).tolist():
            done = [function(self.change(jobs[number])) for _ in range(self.times)]
            yield number, done[-1]
