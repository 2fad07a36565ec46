"""A task: the query of a scene and the boxes that are right; saved so that others ask the same."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps_sim.bench.harness.evidence import Box
from avlmaps_sim.bench.harness.settings import Recorded, load_versioned, save_versioned
from avlmaps_sim.mesh import Triple

SCHEMA_VERSION = 2


class TaskKind(StrEnum):
    """Which two modalities a task joins: the context, then what is sought. The first three are the paper's."""

    AREA = "area-object"
    SOUND = "object-sound"
    PHOTO = "visual-object"
    NEAR_SOUND = "sound-object"


@dataclass(frozen=True, slots=True)
class Task:
    """One question with its truth.

    Attributes:
        name: unique: scene, kind and number.
        kind: which table it belongs to.
        scene: the scene's name, such as ``house:1000000:held-out``.
        category: what is sought: an object, or a sound (``object-sound``).
        context: the part that says which one: an area, an object, a sound; for a photo the name in the answer lists.
        targets: the boxes that are right; for an area all things of the category in it, for a sound the places of the
            robot while it was heard.
        rivals: the number of other things of the category that the recording shows, or of other places of the sound.
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
    def object_name(self) -> str:
        """The object that the query names."""
        return self.context if self.kind is TaskKind.SOUND else self.category

    @property
    def sound_name(self) -> str:
        """The sound that the query names."""
        return self.category if self.kind is TaskKind.SOUND else self.context

    @property
    def sentence(self) -> str:
        """The query as a person would put it."""
        forms = {
            TaskKind.AREA: "the {} in the {}",
            TaskKind.SOUND: "the sound of {} near the {}",
            TaskKind.PHOTO: "the {} near {}",
            TaskKind.NEAR_SOUND: "the {} near the sound of {}",
        }
        return forms[self.kind].format(self.category, self.context)

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
