"""Labelled queries of a scene; for each the first goal's probability, its evidence, and whether it is right."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.registry import Kind
from avlmaps.query.goals import GoalEvidence
from avlmaps.query.heatmap import Heatmap, product
from avlmaps.query.rooms import area_names
from avlmaps_sim.bench.harness.evidence import Box, Evidence, shown_boxes
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.runs import IndexingSettings, scene_tasks
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind, between_m
from avlmaps_sim.bench.objects import STRUCTURE
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import Area
from avlmaps_sim.scenes import open_scene

NEAR_M, FAR_M = 2.0, 4.0  # a thing within the first is near another; only from the second on it is not
_PAIRS = 30  # queries for a thing near a thing, of a scene


@dataclass(frozen=True, slots=True)
class LabelledQuery:
    """A query and what answers it.

    The sought part is the first; ``targets`` are the boxes that are right, none where nothing is.
    """

    kind: str
    parts: tuple[Part, ...]
    targets: tuple[Box, ...] = ()
    task: Task | None = None

    @property
    def words(self) -> str:
        """The query in a few words."""
        return " + ".join(part.query for part in self.parts)

    def off_m(self, position: Triple) -> float:
        """Return how far a place is from the nearest right one, horizontally; infinity where none is right."""
        return min((box.distance_m(position) for box in self.targets), default=np.inf)


def labelled_queries(
    evidence: Evidence, tasks: Sequence[Task], names: Sequence[str], sounds: Sequence[str], rooms: Sequence[str],
    rng: np.random.Generator,
) -> list[LabelledQuery]:  # fmt: skip
    """Return the queries of a scene. Names, sounds and rooms are those that the map's encoders know."""
    held = [thing.category for thing in evidence.objects]
    absent = [name for name in names if not _any_is(held, name) and name not in STRUCTURE]
    silent = [name for name in sounds if name not in {event.category for event in evidence.events}]
    found = [_of_task(task) for task in tasks]
    for task in tasks:
        found += _twins(task, evidence, absent, silent, rng)
    found += _pairs(evidence, absent, rng)
    return [*found, *_alone(evidence, [name for name in names if name not in STRUCTURE], silent, rooms)]


def _of_task(task: Task, sought: str | None = None, context: str | None = None) -> LabelledQuery:
    kinds = {
        TaskKind.AREA: (Modality.OBJECT, Modality.AREA),
        TaskKind.SOUND: (Modality.SOUND, Modality.OBJECT),
        TaskKind.PHOTO: (Modality.OBJECT, Modality.IMAGE),
        TaskKind.NEAR_SOUND: (Modality.OBJECT, Modality.SOUND),
    }
    first, second = kinds[task.kind]
    parts = (
        Part(first, sought or task.category, Role.PRIMARY),
        Part(second, context or task.context, is_file=second is Modality.IMAGE),
    )
    targets = task.targets if sought is None and context is None else ()
    return LabelledQuery(str(task.kind), parts, targets, task if task.kind is TaskKind.PHOTO else None)


def _twins(
    task: Task, evidence: Evidence, absent: Sequence[str], silent: Sequence[str], rng: np.random.Generator
) -> Iterator[LabelledQuery]:
    lacking = str(rng.choice(absent)) if len(absent) else None
    if task.kind is TaskKind.SOUND:
        if lacking:
            yield _of_task(task, context=lacking)
        if len(silent):
            yield _of_task(task, sought=str(rng.choice(silent)))
        return
    if lacking:
        yield _of_task(task, sought=lacking)
    if task.kind is TaskKind.AREA:
        elsewhere = [
            kind for kind in sorted({area.kind for area in evidence.areas}) if not _holds(evidence, task, kind)
        ]
        if elsewhere:
            yield _of_task(task, context=str(rng.choice(elsewhere)))
    if task.kind is TaskKind.NEAR_SOUND and len(silent):
        yield _of_task(task, context=str(rng.choice(silent)))


def _pairs(evidence: Evidence, absent: Sequence[str], rng: np.random.Generator) -> Iterator[LabelledQuery]:
    """Yield queries for a thing near a thing: right where one stands within 2 m; nothing is where none does within 4 m.

    As often as that the home lacks the thing, or what it is near.
    """
    boxes = shown_boxes(evidence)
    names = list(boxes)
    for _ in range(_PAIRS if len(names) > 1 else 0):
        sought, mark = (str(name) for name in rng.choice(names, 2, replace=False))
        gaps = [min(between_m(own, other) for other in boxes[mark]) for own in boxes[sought]]
        near = tuple(own for own, gap in zip(boxes[sought], gaps, strict=True) if gap <= NEAR_M)
        if near or min(gaps) > FAR_M:
            yield _near(sought, mark, near)
        if len(absent):
            lacking = str(rng.choice(absent))
            yield _near(lacking, mark) if rng.random() < 0.6 else _near(sought, lacking)


def _near(sought: str, mark: str, targets: tuple[Box, ...] = ()) -> LabelledQuery:
    return LabelledQuery(
        "object-object", (Part(Modality.OBJECT, sought, Role.PRIMARY), Part(Modality.OBJECT, mark)), targets
    )


def _holds(evidence: Evidence, task: Task, kind: str) -> bool:
    return any(
        thing.area < 0 or evidence.areas[thing.area].kind == kind
        for thing in evidence.objects
        if lexicon().is_a(thing.category, task.category, EntryKind.THING) or thing.category == task.category
    )


def _alone(
    evidence: Evidence, names: Sequence[str], silent: Sequence[str], rooms: Sequence[str]
) -> Iterator[LabelledQuery]:
    """Yield a query for each name; names of things that are there but that the recording hardly shows are left out."""
    for name in names:
        own = [i for i, thing in enumerate(evidence.objects) if _is(thing.category, name)]
        if not own or any(map(evidence.shows, own)):
            yield _single("object", Modality.OBJECT, name, [evidence.box(i) for i in own])
    for name in sorted({event.category for event in evidence.events}):
        right = [box for event in evidence.events if event.category == name for box in event.right]
        yield _single("sound", Modality.SOUND, name, right)
    for name in silent:
        yield _single("sound", Modality.SOUND, name, ())
    for name in rooms:
        own = [area for area in evidence.areas if area.kind == name or lexicon().is_a(area.kind, name, EntryKind.ROOM)]
        yield _single("area", Modality.AREA, name, [_box_of(area) for area in own])


def _single(kind: str, modality: Modality, name: str, targets: Sequence[Box]) -> LabelledQuery:
    return LabelledQuery(kind, (Part(modality, name, Role.PRIMARY),), tuple(targets))


def _box_of(area: Area) -> Box:
    low, high = area.polygon.min(axis=0), area.polygon.max(axis=0)
    return Box((float(low[0]), float(low[1]), area.floor_m), (float(high[0]), float(high[1]), area.ceiling_m))


def _is(category: str, name: str) -> bool:
    return category == name or lexicon().is_a(category, name, EntryKind.THING)


def _any_is(held: Sequence[str], name: str) -> bool:
    return any(_is(category, name) or lexicon().is_a(name, category, EntryKind.THING) for category in held)


REACH_M = 0.5  # a goal within this of a right place is right


@dataclass(frozen=True, slots=True)
class Judged:
    """The answer to one query. ``right`` and the probability are those of the first goal, 0 without one."""

    scene: str
    kind: str
    words: str
    answerable: bool
    right: bool
    probability: float
    evidence: GoalEvidence | None = None


def judged_scene(settings: IndexingSettings, spec: str, work: Path) -> list[Judged]:
    """Return the answers of a scene's map to its labelled queries; it is recorded and mapped if need be.

    ``work`` is shared with the suite ``indexing``.
    """
    (job,) = scene_jobs(settings, settings.recorded, (spec,), work)
    return judged_job(job, settings.tasks_a_scene)


def judged_job(job: SceneJob, most: int) -> list[Judged]:
    """Return the same for a job, with up to ``most`` tasks of each table."""
    return judged(Workplace(job, open_scene), scene_tasks(job, open_scene, most))


def judged(place: Workplace, tasks: Sequence[Task]) -> list[Judged]:
    """Return the answers of a scene's map to its labelled queries."""
    encoders = place.avlmap.encoders
    names = [name for name in encoders.pixels.vocabulary if lexicon().find(name, EntryKind.THING) is not None]
    sounds = [entry.name for entry in lexicon().entries(EntryKind.SOUND)] if place.has((Kind.SOUNDS,)) else []
    rooms = area_names(encoders.views) if place.has((Kind.VIEWS,)) else ()
    queries = labelled_queries(place.evidence, tasks, names, sounds, rooms, place.job.rng(7))
    asked = _Asked(place)
    return [asked.judge(query) for query in queries]


class _Asked:
    def __init__(self, place: Workplace) -> None:
        self._place = place
        self._known: dict[tuple[object, ...], Heatmap | None] = {}

    def judge(self, query: LabelledQuery) -> Judged:
        heats = [self._heat(part, query.task) for part in query.parts]
        known = [heat for heat in heats if heat is not None]
        facts = self._place.job.spec, query.kind, query.words, bool(query.targets)
        weighed = product(known).weighed(1) if len(known) == len(heats) else []
        if not weighed:
            return Judged(*facts, False, 0.0)
        goal, evidence = weighed[0]
        return Judged(*facts, query.off_m(goal.position) < REACH_M, goal.probability, evidence)

    def _heat(self, part: Part, task: Task | None) -> Heatmap | None:
        key = (part, task.name if task is not None and part.modality is Modality.IMAGE else "")
        if key not in self._known:
            try:
                self._known[key] = self._computed(part, task)
            except QueryError:
                self._known[key] = None
        return self._known[key]

    def _computed(self, part: Part, task: Task | None) -> Heatmap:
        avlmap = self._place.avlmap
        if part.modality is not Modality.IMAGE or task is None:
            return avlmap.heat(part)
        return avlmap.image(self._place.photo(task.world_from_photo), primary=part.role is Role.PRIMARY)
