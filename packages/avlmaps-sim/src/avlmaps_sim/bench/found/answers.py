"""Asking a scene its labelled queries: for each the first goal's probability, its evidence, and whether it is right."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.registry import Kind
from avlmaps.query.goals import GoalEvidence
from avlmaps.query.heatmap import Heatmap, product
from avlmaps.query.modalities.area import area_names
from avlmaps_sim.bench.found.queries import LabelledQuery, labelled_queries
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.runs import IndexingSettings, scene_tasks
from avlmaps_sim.bench.indexing.tasks import Task
from avlmaps_sim.scenes import open_scene

REACH_M = 0.5  # a goal within this of a right place is right


@dataclass(frozen=True, slots=True)
class Judged:
    """The answer to one query.

    ``right`` and the probability are those of the first goal, 0 without one.
    """

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
    """A map under query; each part's heat is computed once."""

    def __init__(self, place: Workplace) -> None:
        self._place = place
        self._known: dict[tuple[object, ...], Heatmap | None] = {}

    def judge(self, query: LabelledQuery) -> Judged:
        """Ask one query."""
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
