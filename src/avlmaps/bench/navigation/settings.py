"""What the navigation benchmark is run on."""

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Literal

from avlmaps.bench.indexing.tasks import Recorded, TaskError
from avlmaps.bench.navigation.missions import Series

DEFAULT_SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_000_001, 1_000_013))
Language = Literal["rules", "chat", "none"]
_PAIRS_OF_200 = 119


@dataclass(frozen=True, slots=True)
class NavigationSettings:
    """What the benchmark is run on.

    Attributes:
        scenes: names of scenes; held-out homes by default.
        series: which experiments.
        profile: which models map the scenes.
        hearing: how sounds reach the microphone; a sound's place is the robot's (``overlay``) or its source's.
        sounds: folder of clips; made by rule if None.
        sensor: whose faults colour and depth have.
        frames: at most so many a scene.
        sources: at most so many sounds a scene.
        ambiguous: how many kinds of sound are heard in two places.
        sequences: of four sounds (at each range), and of an image and two things; pairs are 119 for each 200.
        language: what turns sentences into programs; ``none`` gives robots the programs themselves.
        guess: whether robots go to the best guess where the map is not sure, as the paper's always do.
        jobs: scenes side by side; 0 takes as many as there are cores.
        seed: of walks, sounds, goals and starts.
        load: missions to run instead of making some; how scenes were recorded comes from the file.
        save: where to write the missions as well.
    """

    scenes: tuple[str, ...] = DEFAULT_SCENES
    series: tuple[Series, ...] = tuple(Series)
    profile: str = "embedded"
    hearing: Literal["overlay", "acoustic"] = "overlay"
    sounds: Path | None = None
    sensor: Literal["clean", "kinect", "realsense"] = "clean"
    frames: int = 600
    sources: int = 14
    ambiguous: int = 2
    sequences: int = 200
    language: Language = "rules"
    guess: bool = True
    jobs: int = 0
    seed: int = 0
    load: Path | None = None
    save: Path | None = None

    def __post_init__(self) -> None:
        if self.frames < 20 or self.sequences < 1 or self.jobs < 0 or not self.scenes or not self.series:
            raise TaskError(
                f"The benchmark cannot run with {self.frames} frames, {self.sequences} sequences, {self.jobs} jobs, "
                f"{len(self.scenes)} scenes and {len(self.series)} series; take at least 20 frames, one of the others, "
                "and 0 jobs for as many as there are cores."
            )

    @property
    def recorded(self) -> Recorded:
        """How the scenes are recorded."""
        sounds = "" if self.sounds is None else self.sounds.resolve().name
        return Recorded(
            self.hearing, self.frames, self.sources, self.ambiguous, self.sensor, sounds, self.seed
        )  # fmt: skip

    def total(self, series: Series) -> int | None:
        """Return how many missions of a series are run in all; None for the lists, which every scene is given."""
        if series in (Series.COMMANDS, Series.SPATIAL):
            return None
        return ceil(self.sequences * _PAIRS_OF_200 / 200) if series is Series.PAIRS else self.sequences
