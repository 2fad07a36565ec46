"""A mission: the command to a robot in a scene, its start, and the right goals; saved so that others run the same."""

import json
from dataclasses import dataclass, replace
from enum import StrEnum
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose
from avlmaps_sim.bench.harness.settings import Recorded, load_versioned, save_versioned
from avlmaps_sim.bench.navigation.goals import Goal

SCHEMA_VERSION = 1
Row = tuple[float, float, float, float]


class Series(StrEnum):
    """Which experiment a mission belongs to; the value is the word on the command line."""

    SOUNDS_1 = "sounds-1"
    SOUNDS_2 = "sounds-2"
    SOUNDS_3 = "sounds-3"
    IMAGES = "images"
    PAIRS = "pairs"
    COMMANDS = "commands"
    SPATIAL = "spatial"


@dataclass(frozen=True, slots=True)
class Mission:
    """One or several subgoals in one command.

    Attributes:
        name: unique: scene, series and number.
        series: which experiment it belongs to.
        scene: the scene's name, such as ``house:1000001:held-out``.
        start: x and y in metres and heading in radians, counter-clockwise from +x.
        goals: in the order in which they are to be reached.
        command: a sentence with ``{0}``, ``{1}`` ... for what the goals are called; ``""`` names one after another.
        photos: ``world_from_camera`` of every photo, row by row.
        form: of a list's command before it was filled.
    """

    name: str
    series: Series
    scene: str
    start: tuple[float, float, float]
    goals: tuple[Goal, ...]
    command: str = ""
    photos: tuple[tuple[Row, ...], ...] = ()
    form: str = ""

    def __post_init__(self) -> None:
        if not self.goals:
            raise ValueError(f"the mission {self.name} has no goal")

    @property
    def pose(self) -> GroundPose:
        """Where the robot starts."""
        return GroundPose(*self.start)

    @property
    def world_from_photos(self) -> list[Float[np.ndarray, "4 4"]]:
        """The poses of the cameras that took the photos."""
        return [np.array(photo, np.float64) for photo in self.photos]

    def sentence(self, files: tuple[str, ...] = (), only: int | None = None) -> str:
        """Return the command as a person would give it.

        ``only`` names just one goal: a robot whose program broke off gets the remaining goals one by one.
        """
        said = [_named(goal.said, files) for goal in self.goals]
        if only is not None:
            return joined([said[only]]) if self.goals[only].moves else f"Face {said[only]}."
        text = self.command or joined(said)
        for number, words in enumerate(said):
            text = text.replace(f"{{{number}}}", words)
        return _named(text, files)

    def program(self, files: tuple[str, ...] = (), only: int | None = None) -> str:
        """Return the program that a perfect translator would write, for all goals or for one of them."""
        goals = self.goals if only is None else self.goals[only : only + 1]
        return "\n".join(_named(goal.program, files) for goal in goals)

    @property
    def fingerprint(self) -> str:
        """A short name of all that it holds."""
        return sha256(msgspec.json.encode(self)).hexdigest()[:16]


def _named(text: str, files: tuple[str, ...]) -> str:
    for number, file in enumerate(files):
        text = text.replace(f"{{photo {number}}}", file)
    return text


def joined(said: list[str]) -> str:
    """Return one sentence that names places one after another."""
    if len(said) == 1:
        return f"Go to {said[0]}."
    middle = "".join(f", then go to {words}" for words in said[1:-1])
    return f"First go to {said[0]}{middle}, and then go to {said[-1]}."


@dataclass(frozen=True, slots=True)
class MissionSet:
    """Missions of several scenes, with all that is needed to run them again.

    By ``asked`` a run that was broken off knows its own.
    """

    recorded: Recorded
    scenes: tuple[str, ...]
    radius_m: float
    missions: tuple[Mission, ...]
    asked: str = ""
    schema_version: int = SCHEMA_VERSION


def save_missions(missions: MissionSet, path: Path) -> None:
    """Write missions and their truth as JSON."""
    save_versioned(missions, path)


def load_missions(path: Path) -> MissionSet:
    """Read missions that ``save_missions`` wrote.

    Raises:
        TaskError: there are none, they are of another schema, or damaged.
    """
    return load_versioned(path, MissionSet, SCHEMA_VERSION)


def allocated(made: list[list[Mission]], total: int) -> list[Mission]:
    """Take ``total`` missions from scenes in turn: the first of each, then the second of each, and so on."""
    longest = max(map(len, made), default=0)
    turns = [own[number] for number in range(longest) for own in made if number < len(own)]
    kept = {mission.name for mission in turns[:total]}
    return [mission for own in made for mission in own if mission.name in kept]


def numbered(missions: list[Mission]) -> list[Mission]:
    """Name missions of one scene by series and number."""
    count: dict[Series, int] = {}
    named: list[Mission] = []
    for mission in missions:
        number = count.get(mission.series, 0)
        count[mission.series] = number + 1
        named.append(replace(mission, name=f"{mission.scene}/{mission.series}/{number:03d}"))
    return named


def asked_for(*facts: object) -> str:
    """Return a short name of everything that missions were made from."""
    return sha256(json.dumps(facts, default=str).encode()).hexdigest()[:16]
