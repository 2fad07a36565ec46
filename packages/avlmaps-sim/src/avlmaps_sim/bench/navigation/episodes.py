"""The outcome of a mission: a record for each stop, stored as JSON lines, so that a run that was broken off resumes."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import msgspec

from avlmaps_sim.bench.navigation.metrics import path_weight
from avlmaps_sim.bench.navigation.missions import GoalKind, Series


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
