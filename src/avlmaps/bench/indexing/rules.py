"""The rules by which tasks are made of a scene, so that each is truly ambiguous and has one right answer.

The object alone never tells: the recording shows at least two things of the category. The context does: the
right one is near the place that the sound or the photo stands for, and every other is clearly farther.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from avlmaps.bench.indexing.tasks import Box, Task, TaskKind
from avlmaps.sim.free_space import STRUCTURE
from avlmaps.sim.mesh import Triple
from avlmaps.sim.scene import Area, SceneObject

NEAR_M = 2.5  # the right thing is at most so far, horizontally, from the place to the thing's box
MARGIN_M = 1.5  # and every other thing of the category at least so much farther
APART_M = 1.0  # what stands in other areas is at least so far from the right things
LEAST_SEEN = 50  # voxels: an eighth of a square metre of surface
LEAST_PIXELS = 0.01  # of a photo that show the thing
_A_CATEGORY = 3  # tasks of one category in a scene and table, at most


@dataclass(frozen=True, slots=True)
class Event:
    """A sound that can be asked for.

    Attributes:
        category: its name.
        place: where it was heard (overlay) or came from (acoustic), metres, world.
    """

    category: str
    place: Triple


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What is truly in a scene and was recorded.

    Attributes:
        scene: its name.
        objects: its things.
        seen: for each thing how many voxels of the map it fills.
        areas: its rooms.
        events: its sounds.
        storey_m: heights between which lies the storey that was recorded; things of others are neither asked for nor
            rivals, since distances are horizontal.
    """

    scene: str
    objects: tuple[SceneObject, ...]
    seen: Int[np.ndarray, " objects"]
    areas: tuple[Area, ...] = ()
    events: tuple[Event, ...] = ()
    storey_m: tuple[float, float] = (-np.inf, np.inf)

    def ambiguous(self) -> dict[str, list[int]]:
        """Return the things of each category of which the recording shows two or more; unseen ones are among them."""
        found: dict[str, list[int]] = {}
        for instance, thing in enumerate(self.objects):
            on_storey = self.storey_m[0] <= thing.centre[2] <= self.storey_m[1]
            if thing.category not in STRUCTURE and on_storey:
                found.setdefault(thing.category, []).append(instance)
        return {name: own for name, own in found.items() if sum(map(self.shows, own)) >= 2}

    def shows(self, instance: int) -> bool:
        """Tell whether the recording shows enough of a thing to ask for it."""
        return bool(self.seen[instance] >= LEAST_SEEN)

    def box(self, instance: int) -> Box:
        """Return the box round a thing."""
        thing = self.objects[instance]
        return Box(thing.low, thing.high)


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A picture that may be asked with.

    Attributes:
        world_from_camera: where it was taken.
        share: for each thing of the scene the part of the pixels that shows it.
    """

    world_from_camera: Float[np.ndarray, "4 4"]
    share: Float[np.ndarray, " objects"]


def alone_near(distance_m: Sequence[float], near_m: float = NEAR_M, margin_m: float = MARGIN_M) -> int | None:
    """Return the one that is near while all others are clearly farther; None where there is no such one."""
    if not len(distance_m):
        return None
    order = np.argsort(distance_m, kind="stable")
    nearest = float(distance_m[order[0]])
    if nearest > near_m or (len(order) > 1 and float(distance_m[order[1]]) - nearest < margin_m):
        return None
    return int(order[0])


def sound_tasks(evidence: Evidence, rng: np.random.Generator, most: int) -> list[Task]:
    """Make tasks "the CATEGORY near the sound of SOUND".

    A sound that was heard in two places stands for both, and the nearer one counts for each thing.
    """
    places: dict[str, list[Triple]] = {}
    for event in evidence.events:
        places.setdefault(event.category, []).append(event.place)
    found: list[Task] = []
    for sound, heard in places.items():
        for category, own in evidence.ambiguous().items():
            away = [[evidence.box(i).distance_m(place) for place in heard] for i in own]
            chosen = alone_near([min(row) for row in away])
            if chosen is None or not evidence.shows(own[chosen]):
                continue
            place = heard[int(np.argmin(away[chosen]))]
            found.append(_task(evidence, TaskKind.SOUND, category, sound, [own[chosen]], own, place))
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
            apart = min(_between_m(evidence.box(i), other) for i in right for other in wrong)
            if apart >= APART_M:
                found.append(_task(evidence, TaskKind.AREA, category, kind, right, own, None))
    return numbered(found, rng, most)


def numbered(tasks: Sequence[Task], rng: np.random.Generator, most: int) -> list[Task]:
    """Draw tasks, few of a category, and name them by their number."""
    from dataclasses import replace

    taken: dict[str, int] = {}
    kept: list[Task] = []
    for index in rng.permutation(len(tasks)):
        task = tasks[index]
        if len(kept) < most and taken.get(task.category, 0) < _A_CATEGORY:
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


def _between_m(a: Box, b: Box) -> float:
    """Return the horizontal distance between two boxes."""
    low_a, high_a, low_b, high_b = (np.asarray(v)[:2] for v in (a.low, a.high, b.low, b.high))
    return float(np.linalg.norm(np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0.0)))
