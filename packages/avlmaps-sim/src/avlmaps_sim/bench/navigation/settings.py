"""The settings of the navigation benchmark."""

from dataclasses import dataclass
from math import ceil
from typing import Literal

from avlmaps_sim.bench.harness.settings import SceneSettings, TaskError
from avlmaps_sim.bench.navigation.missions import Series

DEFAULT_SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_000_001, 1_000_013))
Language = Literal["learned", "rules", "chat", "none"]
_PAIRS_OF_200 = 119


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationSettings(SceneSettings):
    """The settings of the benchmark.

    Attributes:
        scenes: held-out homes by default.
        series: which experiments.
        sequences: of four sounds (at each range), and of an image and two things; pairs are 119 for each 200.
        language: what turns sentences into programs; ``none`` gives robots the programs themselves.
        guess: whether robots go to the best guess where nothing is found, as the paper's always do.
    """

    scenes: tuple[str, ...] = DEFAULT_SCENES
    series: tuple[Series, ...] = tuple(Series)
    sequences: int = 200
    language: Language = "learned"
    guess: bool = True

    def __post_init__(self) -> None:
        if self.frames < 20 or self.sequences < 1 or self.jobs < 0 or not self.scenes or not self.series:
            raise TaskError(
                f"The benchmark cannot run with {self.frames} frames, {self.sequences} sequences, {self.jobs} jobs, "
                f"{len(self.scenes)} scenes and {len(self.series)} series; take at least 20 frames, one of the others, "
                "and 0 jobs for as many as there are cores."
            )

    def total(self, series: Series) -> int | None:
        """Return how many missions of a series are run in all; None for the lists, which every scene is given."""
        if series in (Series.COMMANDS, Series.SPATIAL):
            return None
        return ceil(self.sequences * _PAIRS_OF_200 / 200) if series is Series.PAIRS else self.sequences
