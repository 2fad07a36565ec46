"""A task: the query of a scene and the boxes that are right; and the rules that make each truly ambiguous.

The name of the goal alone never identifies it: the recording shows at least two things of the category, or holds the
sound at several places. The context does: the right one is near it, and every other is clearly farther.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from avlmaps_sim.bench.harness.evidence import Box, Evidence, Photo, alone_near, heard_places, photo_name, shown_boxes
from avlmaps_sim.bench.harness.settings import Recorded
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
    """One question with its truth."""

    name: str  # unique: scene, kind and number
    kind: TaskKind  # which table it belongs to
    scene: str  # the scene's name, such as ``house:1000000:held-out``
    category: str  # what is sought: an object, or a sound (``object-sound``)
    context: str  # the part that says which one: an area, an object, a sound; for a photo the name in the answer lists
    # The boxes that are right; for an area all things of the category in it, for a sound the places of the robot while
    # it was heard.
    targets: tuple[Box, ...]
    rivals: int  # the number of other things of the category that the recording shows, or of other places of the sound
    # Where the sound was heard or came from, or the photo was taken, metres, world; None for an area.
    place: Triple | None = None
    # ``world_from_camera`` of the photo, row by row; None without one.
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

    @property
    def photo_name(self) -> str:
        """The photo's file in the folder ``photos`` of the scene's work."""
        return photo_name(self.world_from_photo)

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


APART_M = 1.0  # things in other areas are at least this far from the right things
LEAST_PIXELS = 0.01  # of a photo that show the thing
_LEAST_PLACES = 3  # of a sound that is sought, so that a coin does not win
_A_CATEGORY = 3  # tasks of one category in a scene and table, at most
_A_SOUND = 10  # the same for a sound that is sought: few sounds play at two places


def sound_tasks(evidence: Evidence, rng: np.random.Generator, most: int) -> list[Task]:
    """Make tasks "the sound of SOUND near the OBJECT" (Table IV): of three places or more, one is near such a thing.

    Any thing of the category may be the near one; a thing that the recording does not show counts as well.
    """
    found: list[Task] = []
    boxes = shown_boxes(evidence)
    for sound, heard in heard_places(evidence.events).items():
        for category, own in boxes.items() if len(heard) >= _LEAST_PLACES else ():
            away = [min(box.distance_m(event.place) for box in own) for event in heard]
            chosen = alone_near(away)
            if chosen is not None:
                event = heard[chosen]
                rivals = len(heard) - 1
                found.append(
                    Task("", TaskKind.SOUND, evidence.scene, sound, category, event.right, rivals, event.place)
                )
    return numbered(found, rng, most, _A_SOUND)


def near_sound_tasks(evidence: Evidence, rng: np.random.Generator, most: int) -> list[Task]:
    """Make tasks "the CATEGORY near the sound of SOUND".

    A sound that was heard in two places stands for both, and the nearer one counts for each thing.
    """
    found: list[Task] = []
    for sound, events in heard_places(evidence.events).items():
        heard = [event.place for event in events]
        for category, own in evidence.ambiguous().items():
            away = [[evidence.box(i).distance_m(place) for place in heard] for i in own]
            chosen = alone_near([min(row) for row in away])
            if chosen is None or not evidence.shows(own[chosen]):
                continue
            place = heard[int(np.argmin(away[chosen]))]
            found.append(_task(evidence, TaskKind.NEAR_SOUND, category, sound, [own[chosen]], own, place))
    return numbered(found, rng, most)


def photo_tasks(evidence: Evidence, photos: Sequence[Photo], rng: np.random.Generator, most: int) -> list[Task]:
    """Make tasks "the CATEGORY near this photo"; the thing is in the picture, and one photo serves one task."""
    found: list[Task] = []
    for number, photo in enumerate(photos):
        x, y, z = (float(v) for v in photo.world_from_camera[:3, 3])
        choices: list[Task] = []
        for category, own in evidence.ambiguous().items():
            chosen = alone_near([evidence.box(i).distance_m((x, y, z)) for i in own])
            if chosen is None or not evidence.shows(own[chosen]) or photo.share[own[chosen]] < LEAST_PIXELS:
                continue
            name = f"photo {number}"
            pose = tuple(tuple(row) for row in photo.world_from_camera.tolist())
            choices.append(
                _task(evidence, TaskKind.PHOTO, category, name, [own[chosen]], own, (x, y, z), pose)  # pyright: ignore[reportArgumentType]
            )
        if choices:
            found.append(choices[int(rng.integers(len(choices)))])
    return numbered(found, rng, most)


def area_tasks(evidence: Evidence, rng: np.random.Generator, most: int) -> list[Task]:
    """Make tasks "the CATEGORY in the AREA": shown in areas of two kinds or more, all those of one kind are right."""
    found: list[Task] = []
    for category, own in evidence.ambiguous().items():
        inside = [i for i in own if evidence.objects[i].area >= 0]
        kind_of = {i: evidence.areas[evidence.objects[i].area].kind for i in inside}
        shown = {kind_of[i] for i in inside if evidence.shows(i)}
        if len(shown) < 2 or len(inside) < len(own):
            continue
        for kind in sorted(shown):
            right = [i for i in inside if kind_of[i] == kind]
            wrong = [evidence.box(i) for i in inside if kind_of[i] != kind]
            apart = min(between_m(evidence.box(i), other) for i in right for other in wrong)
            if apart >= APART_M:
                found.append(_task(evidence, TaskKind.AREA, category, kind, right, own, None))
    return numbered(found, rng, most)


def numbered(tasks: Sequence[Task], rng: np.random.Generator, most: int, of_one: int = _A_CATEGORY) -> list[Task]:
    """Draw tasks, few of a category, and name them by their number."""
    taken: dict[str, int] = {}
    kept: list[Task] = []
    for index in rng.permutation(len(tasks)):
        task = tasks[index]
        if len(kept) < most and taken.get(task.category, 0) < of_one:
            taken[task.category] = taken.get(task.category, 0) + 1
            kept.append(replace(task, name=f"{task.scene}/{task.kind}/{len(kept):02d}"))
    return kept


def _task(
    evidence: Evidence,
    kind: TaskKind,
    category: str,
    context: str,
    right: Sequence[int],
    own: Sequence[int],
    place: Triple | None,
    photo: tuple[tuple[float, float, float, float], ...] | None = None,
) -> Task:
    rivals = sum(evidence.shows(i) for i in own if i not in right)
    targets = tuple(evidence.box(i) for i in right)
    return Task("", kind, evidence.scene, category, context, targets, rivals, place, photo)


def between_m(a: Box, b: Box) -> float:
    """Return the horizontal distance between two boxes."""
    low_a, high_a, low_b, high_b = (np.asarray(v)[:2] for v in (a.low, a.high, b.low, b.high))
    return float(np.linalg.norm(np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0.0)))
