"""A task: what is asked in a scene and which boxes are right; saved so that others ask the same."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Literal, TypeVar

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.sim.mesh import Triple

SCHEMA_VERSION = 1
T = TypeVar("T")


class TaskError(AvlmapsError):
    """Tasks cannot be read, or do not fit what is asked for."""


class TaskKind(StrEnum):
    """Which two modalities a task joins; the value is the paper's word."""

    AREA = "area-object"
    SOUND = "object-sound"
    PHOTO = "visual-object"


@dataclass(frozen=True, slots=True)
class Box:
    """A box along the axes of the scene's world (z up), metres."""

    low: Triple
    high: Triple

    def distance_m(self, position: Triple) -> float:
        """Return the horizontal distance of a place to the box; 0 over it, under it and in it."""
        low, high, at = (np.asarray(v, np.float64)[:2] for v in (self.low, self.high, position))
        return float(np.linalg.norm(np.maximum(np.maximum(low - at, at - high), 0.0)))

    def centre_distance_m(self, position: Triple) -> float:
        """Return the horizontal distance of a place to the middle of the box."""
        low, high, at = (np.asarray(v, np.float64)[:2] for v in (self.low, self.high, position))
        return float(np.linalg.norm((low + high) / 2 - at))


@dataclass(frozen=True, slots=True)
class Task:
    """One question with its truth.

    Attributes:
        name: unique: scene, kind and number.
        kind: which table it belongs to.
        scene: the scene's name, such as ``house:1000000:held-out``.
        category: the object that is asked for.
        context: the sound or the area that tells which one; for a photo what the answer lists call it.
        targets: the boxes that are right; for an area all things of the category in it.
        rivals: how many other things of the category the recording shows.
        place: where the sound was heard or came from, or the photo was taken, metres, world; None for an area.
        photo: ``world_from_camera`` of the photo, row by row; None without one.
    """

    name: str
    kind: TaskKind
    scene: str
    category: str
    context: str
    targets: tuple[Box, ...]
    rivals: int
    place: Triple | None = None
    photo: tuple[tuple[float, float, float, float], ...] | None = None

    def __post_init__(self) -> None:
        if not self.targets:
            raise ValueError(f"the task {self.name} has no target")
        if (self.photo is not None) != (self.kind is TaskKind.PHOTO):
            raise ValueError(f"the task {self.name} is {self.kind}, its photo is {self.photo}")

    @property
    def sentence(self) -> str:
        """The question as a person would put it."""
        words = {TaskKind.AREA: "in the", TaskKind.SOUND: "near the sound of", TaskKind.PHOTO: "near"}
        return f"the {self.category} {words[self.kind]} {self.context}"

    @property
    def world_from_photo(self) -> Float[np.ndarray, "4 4"]:
        """The pose of the camera that took the photo."""
        if self.photo is None:
            raise ValueError(f"the task {self.name} has no photo")
        return np.array(self.photo, np.float64)

    def off_m(self, position: Triple) -> float:
        """Return how far a place is from the nearest target, horizontally to its box."""
        return min(box.distance_m(position) for box in self.targets)

    def centre_off_m(self, position: Triple) -> float:
        """Return how far a place is from the middle of the nearest target, horizontally."""
        return min(box.centre_distance_m(position) for box in self.targets)


@dataclass(frozen=True, slots=True)
class Recorded:
    """How the scenes of a set of tasks were recorded: the same tasks need the same recordings.

    Attributes:
        hearing: ``overlay`` or ``acoustic``.
        frames: at most so many in a scene.
        sources: at most so many sounds in a scene.
        ambiguous: how many kinds of sound are heard in two places.
        sensor: whose faults colour and depth have.
        sounds: name of the folder of clips; ``""`` for sounds made by rule.
        seed: of walks, sounds and tasks.
    """

    hearing: str
    frames: int
    sources: int
    ambiguous: int
    sensor: str
    sounds: str
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSettings:
    """Which scenes a benchmark runs on, and how they are recorded and mapped.

    Attributes:
        scenes: names of scenes.
        profile: which models map them.
        hearing: how sounds reach the microphone; a sound's place is the robot's (``overlay``) or its source's.
        sounds: folder of clips; made by rule if None.
        sensor: whose faults colour and depth have.
        frames: at most so many a scene.
        sources: at most so many sounds a scene.
        ambiguous: how many kinds of sound are heard in two places.
        jobs: scenes side by side; 0 takes as many as there are cores.
        seed: of walks, sounds and all that is asked.
        load: what to ask instead of making it; how the scenes were recorded comes from the file.
        save: where to write what is asked.
    """

    scenes: tuple[str, ...]
    profile: str = "embedded"
    hearing: Literal["overlay", "acoustic"] = "overlay"
    sounds: Path | None = None
    sensor: Literal["clean", "kinect", "realsense"] = "clean"
    frames: int = 600
    sources: int = 14
    ambiguous: int = 2
    jobs: int = 0
    seed: int = 0
    load: Path | None = None
    save: Path | None = None

    @property
    def recorded(self) -> Recorded:
        """How the scenes are recorded."""
        sounds = "" if self.sounds is None else self.sounds.resolve().name
        return Recorded(
            self.hearing, self.frames, self.sources, self.ambiguous, self.sensor, sounds, self.seed
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class TaskSet:
    """Tasks of several scenes, with all that is needed to ask them again."""

    recorded: Recorded
    scenes: tuple[str, ...]
    tasks: tuple[Task, ...]
    schema_version: int = SCHEMA_VERSION


def save_tasks(tasks: TaskSet, path: Path) -> None:
    """Write tasks and their truth as JSON."""
    save_versioned(tasks, path)


def load_tasks(path: Path) -> TaskSet:
    """Read tasks that ``save_tasks`` wrote.

    Raises:
        TaskError: there are none, they are of another schema, or damaged.
    """
    return load_versioned(path, TaskSet, SCHEMA_VERSION)


def save_versioned(tasks: object, path: Path) -> None:
    """Write a dataclass that has a ``schema_version`` as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(path, msgspec.json.format(msgspec.json.encode(tasks), indent=1) + b"\n")


def load_versioned(path: Path, kind: type[T], schema_version: int) -> T:
    """Read what ``save_versioned`` wrote.

    Raises:
        TaskError: there is nothing, it is of another schema, or damaged.
    """
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise TaskError(f"The tasks {path} cannot be read ({fault.strerror}); check the name.") from fault
    try:
        version = msgspec.json.decode(content).get("schema_version")
        if version == schema_version:
            return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, msgspec.ValidationError, AttributeError) as fault:
        raise TaskError(f"The tasks {path} are damaged ({fault}); save them anew with --save-tasks.") from fault
    raise TaskError(f"The tasks {path} are of schema {version}, this avlmaps reads {schema_version}; save them anew.")
