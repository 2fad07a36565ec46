"""Running the benchmark: tasks of all scenes, then every configuration of sources of heat; recall and mean distance."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import QueryError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.question import Role
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.query.heatmap import Heatmap, product
from avlmaps_sim.bench.harness.figures import wilson
from avlmaps_sim.bench.harness.settings import SceneSettings, TaskError, in_turn, load_versioned, save_versioned
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.scene_queries import QueriedScene
from avlmaps_sim.bench.indexing.tasks import (
    SCHEMA_VERSION,
    Task,
    TaskKind,
    TaskSet,
    area_tasks,
    near_sound_tasks,
    photo_tasks,
    sound_tasks,
)
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import Scene
from avlmaps_sim.scenes import open_scene

Source = Callable[[QueriedScene, Task, Role], Heatmap | None]

OURS, CEILING = "ours", "true perception"


@dataclass(frozen=True, slots=True)
class Configuration:
    """A row of a table.

    The first of the ``sources`` is what is sought, the others say where it is; ``role`` is ``baseline`` for single
    modalities, ``ours``, ``ceiling``, else ``variant``.
    """

    kind: TaskKind
    name: str
    sources: tuple[Source, ...]
    needs: tuple[Kind, ...] = ()
    role: str = "variant"

    def answer(self, scene: QueriedScene, task: Task) -> tuple[Triple | None, bool]:
        """Return the first goal's place and whether the whole was reported as found.

        The place is None where the map has no answer, or knows nothing of a word.
        """
        try:
            heat = [
                source(scene, task, Role.CONTEXT if number else Role.PRIMARY)
                for number, source in enumerate(self.sources)
            ]
        except QueryError:
            return None, False
        whole = product([one for one in heat if one is not None])
        goals = whole.goals(1)
        return (goals[0].position, whole.found) if goals else (None, False)


_PIXELS, _SOUNDS = (Kind.PIXELS,), (Kind.PIXELS, Kind.SOUNDS)
_VIEWS = (Kind.PIXELS, Kind.VIEWS)
_PHOTOS = (Kind.PIXELS, Kind.LOCAL, Kind.PLACE, Kind.MATCHER)
_object, _sound, _weak = QueriedScene.map_object, QueriedScene.map_sound, QueriedScene.weak_sound
_area, _true_object, _true_sound = QueriedScene.map_area, QueriedScene.true_object, QueriedScene.true_sound

_AREA_ROWS = (
    ("object only", (_object,), _PIXELS, "baseline"),
    ("+ area by the object encoder", (_object, QueriedScene.area_as_object), _PIXELS, "variant"),
    ("+ whole views in each voxel", (_object, QueriedScene.pixel_views), _VIEWS, "variant"),
    ("+ ConceptFusion: regions and views in each voxel", (_object, QueriedScene.region_views), _VIEWS, "variant"),
    ("+ sparse view map by the paper's rules", (_object, QueriedScene.paper_area), _VIEWS, "variant"),
    ("+ sparse view map (ours)", (_object, _area), _VIEWS, OURS),
    ("+ true region map", (_object, QueriedScene.true_area), _PIXELS, "variant"),
    ("true objects + sparse view map", (_true_object, _area), (Kind.VIEWS,), "variant"),
    (CEILING, (_true_object, QueriedScene.true_area), (), "ceiling"),
)
# The primary part stands first: here the sound.
_SOUND_ROWS = (
    ("sound only, weaker encoder", (_weak,), (), "baseline"),
    ("sound only", (_sound,), (Kind.SOUNDS,), "baseline"),
    ("object + sound, weaker encoder", (_weak, _object), _PIXELS, "variant"),
    ("object + sound (ours)", (_sound, _object), _SOUNDS, OURS),
    ("object + true sound", (_true_sound, _object), _PIXELS, "variant"),
    ("true objects + sound", (_sound, _true_object), (Kind.SOUNDS,), "variant"),
    (CEILING, (_true_sound, _true_object), (), "ceiling"),
)
_PHOTO_ROWS = (
    ("object only", (_object,), _PIXELS, "baseline"),
    ("image only", (QueriedScene.map_photo,), _PHOTOS[1:], "baseline"),
    ("object + most alike keyframe, not located", (_object, QueriedScene.alike_keyframe), _PHOTOS, "variant"),
    ("object + image (ours)", (_object, QueriedScene.map_photo), _PHOTOS, OURS),
    ("object + true camera", (_object, QueriedScene.true_camera), _PIXELS, "variant"),
    ("true objects + image", (_true_object, QueriedScene.map_photo), _PHOTOS[1:], "variant"),
    (CEILING, (_true_object, QueriedScene.true_camera), (), "ceiling"),
)
_NEAR_SOUND_ROWS = (
    ("object only", (_object,), _PIXELS, "baseline"),
    ("sound only, weaker encoder", (_weak,), (), "baseline"),
    ("sound only", (_sound,), (Kind.SOUNDS,), "baseline"),
    ("object + sound, weaker encoder", (_object, _weak), _PIXELS, "variant"),
    ("object + sound (ours)", (_object, _sound), _SOUNDS, OURS),
    ("object + true sound", (_object, _true_sound), _PIXELS, "variant"),
    ("true objects + sound", (_true_object, _sound), (Kind.SOUNDS,), "variant"),
    (CEILING, (_true_object, _true_sound), (), "ceiling"),
)
_ROWS = {
    TaskKind.AREA: _AREA_ROWS,
    TaskKind.SOUND: _SOUND_ROWS,
    TaskKind.PHOTO: _PHOTO_ROWS,
    TaskKind.NEAR_SOUND: _NEAR_SOUND_ROWS,
}
CONFIGURATIONS: tuple[Configuration, ...] = tuple(
    Configuration(kind, name, sources, needs, role)
    for kind, rows in _ROWS.items()
    for name, sources, needs, role in rows
)


def configurations(kind: TaskKind) -> tuple[Configuration, ...]:
    """Return the rows of a table, in their order."""
    return tuple(one for one in CONFIGURATIONS if one.kind is kind)


LIMITS_M = (0.5, 1.0, 1.5, 2.0)
_RESAMPLES = 2000


@dataclass(frozen=True, slots=True)
class Answered:
    """A configuration's answer to a task.

    ``position`` is the first goal, metres, world. Distances are horizontal, to the nearest point of the nearest
    target's box and to its middle; for no answer they are the scene's largest.
    """

    task: str
    configuration: str
    position: Triple | None
    off_m: float
    centre_m: float
    found: bool = False


def judged(task: Task, configuration: str, position: Triple | None, largest_m: float, found: bool = False) -> Answered:
    """Compare an answer with the truth; none at all is as wrong as the scene is large."""
    if position is None:
        return Answered(task.name, configuration, None, largest_m, largest_m)
    return Answered(task.name, configuration, position, task.off_m(position), task.centre_off_m(position), found)


@dataclass(frozen=True, slots=True)
class Score:
    """A configuration's figures over all tasks of a table.

    Hits are off by less than each of ``LIMITS_M``; the interval of the mean is bootstrapped over the tasks.
    """

    count: int
    answered: int
    hits: tuple[int, ...]
    mean_m: float
    mean_interval_m: tuple[float, float]

    def recall(self, limit_m: float) -> float:
        """Return the share of the tasks answered within a distance of ``LIMITS_M``."""
        return self.hits[LIMITS_M.index(limit_m)] / self.count if self.count else 0.0

    def recall_interval(self, limit_m: float) -> tuple[float, float]:
        """Return Wilson's 95 % interval of the recall."""
        return wilson(self.hits[LIMITS_M.index(limit_m)], self.count)


def scored(answers: Sequence[Answered], seed: int = 0, *, by_centre: bool = False) -> Score:
    """Sum up answers, by the nearest face of the right thing or by its centre."""
    off_m = np.array([answer.centre_m if by_centre else answer.off_m for answer in answers], np.float64)
    is_answered = np.array([answer.position is not None for answer in answers], bool)
    hits = tuple(int((is_answered & (off_m < limit)).sum()) for limit in LIMITS_M)
    mean = float(off_m.mean()) if len(off_m) else 0.0
    interval_m = bootstrapped_mean(off_m, np.random.default_rng(seed))
    return Score(len(answers), int(is_answered.sum()), hits, mean, interval_m)


def chance(tasks: Sequence[Task]) -> float:
    """Return the share that is right where one of the candidates of each name is drawn at random."""
    right = [1 if task.kind is TaskKind.SOUND else len(task.targets) for task in tasks]  # boxes of one sound: its track
    return float(np.mean([own / (own + task.rivals) for own, task in zip(right, tasks, strict=True)])) if tasks else 0.0


def bootstrapped_mean(values: Float[np.ndarray, " n"], rng: np.random.Generator) -> tuple[float, float]:
    """Return the 95 % percentile interval of a mean over resamples; of nothing (0, 0)."""
    if not len(values):
        return 0.0, 0.0
    means = values[rng.integers(len(values), size=(_RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return float(low), float(high)


DEFAULT_SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_012))
# The paper's numbers of tasks; it does not give that of Table V, but its percentages are those of 159.
PAPER_SIZES: Mapping[TaskKind, int] = {
    TaskKind.AREA: 100,
    TaskKind.SOUND: 119,
    TaskKind.PHOTO: 159,
    TaskKind.NEAR_SOUND: 119,
}
_PHOTOS_A_TASK = 12  # tried for each that is wanted
_MAKING = 3  # raised when tasks are made by other rules
_QUERYING = 9  # raised when they are queried by other rules


@dataclass(frozen=True, slots=True, kw_only=True)
class IndexingSettings(SceneSettings):
    """The settings of the benchmark."""

    scenes: tuple[str, ...] = DEFAULT_SCENES  # held-out homes by default, or recordings with ``objects.json``
    tasks_a_scene: int = 20  # limit of tasks a scene and table
    # Limit of tasks a table, over all scenes; taken from the scenes in turn. None: all that they offer.
    sizes: Mapping[TaskKind, int] | None = field(default_factory=lambda: dict(PAPER_SIZES))

    def __post_init__(self) -> None:
        if self.frames < 20 or self.tasks_a_scene < 1 or self.jobs < 0:
            raise TaskError(
                f"The benchmark cannot run with {self.frames} frames, {self.tasks_a_scene} tasks a scene and "
                f"{self.jobs} jobs; take at least 20 frames, 1 task, and 0 jobs for one a core."
            )


@dataclass(frozen=True, slots=True)
class SceneOutcome:
    """The outcome of one scene.

    ``sounds`` counts those that were detected, and those that there were; ``clips`` are sound and clip of every event.
    """

    scene: str
    tasks: tuple[Task, ...]
    answers: tuple[Answered, ...]
    frames: int
    voxels: int
    sounds: tuple[int, int]
    clips: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of all scenes. ``weights`` are the checksums of the models, by module."""

    settings: IndexingSettings
    tasks: TaskSet
    scenes: tuple[SceneOutcome, ...]
    weights: Mapping[str, str] = field(default_factory=dict)

    def answers(self, kind: TaskKind, configuration: str) -> list[Answered]:
        """Return a configuration's answers to the tasks of a table; none where the profile lacks a model for it."""
        asked = {task.name for task in self.tasks.tasks if task.kind is kind}
        return [
            answer
            for scene in self.scenes
            for answer in scene.answers
            if answer.configuration == configuration and answer.task in asked
        ]


@dataclass(frozen=True, slots=True)
class _Todo:
    job: SceneJob
    open_spec: Callable[[str], Scene]
    most: int = 0
    tasks: tuple[Task, ...] = ()


def run(settings: IndexingSettings, work: Path, open_spec: Callable[[str], Scene] = open_scene) -> Outcome:
    """Record, map and ask every scene; a run that was stopped resumes from what ``work`` holds.

    Raises:
        TaskError: the tasks cannot be read, or no scene yields any.
        BackendError: a model is missing; nothing is recorded then.
    """
    weights = settings.checked()
    work.mkdir(parents=True, exist_ok=True)
    tasks = _tasks(settings, work, open_spec)
    if settings.save is not None:
        save_versioned(tasks, settings.save)
    todo = [
        _Todo(job, open_spec, tasks=tuple(task for task in tasks.tasks if task.scene == job.spec))
        for job in scene_jobs(settings, tasks.recorded, tasks.scenes, work)
    ]
    scenes = side_by_side(_run_scene, todo, settings.jobs, "indexing")
    return Outcome(settings, tasks, tuple(scenes), weights)


def _tasks(settings: IndexingSettings, work: Path, open_spec: Callable[[str], Scene]) -> TaskSet:
    if (given := settings.given(TaskSet, SCHEMA_VERSION)) is not None:
        return given
    jobs = scene_jobs(settings, settings.recorded, settings.scenes, work)
    todo = [_Todo(job, open_spec, settings.tasks_a_scene) for job in jobs]
    made = side_by_side(_made, todo, settings.jobs, "mapping")
    own = tuple(
        task
        for kind in TaskKind
        for task in in_turn(
            [[task for task in scene if task.kind is kind] for scene in made],
            None if settings.sizes is None else settings.sizes[kind],
        )
    )
    if not own:
        raise TaskError(
            f"The {len(settings.scenes)} scenes yield no task; take larger ones, or more frames than {settings.frames}."
        )
    return TaskSet(settings.recorded, settings.scenes, own)


def _made(todo: _Todo) -> list[Task]:
    return scene_tasks(todo.job, todo.open_spec, todo.most)


def scene_tasks(job: SceneJob, open_spec: Callable[[str], Scene], most: int) -> list[Task]:
    """Record and map a scene, and make its tasks: the same for a seed, whichever are taken."""
    place = Workplace(job, open_spec)
    path = job.folder / f"tasks-{_key(job, _MAKING, place.avlmap.data.info.build_key, most)}.json"
    if not path.exists():
        evidence, rng = place.evidence, job.rng
        photos = place.photos(_PHOTOS_A_TASK * most)
        tasks = [
            *area_tasks(evidence, rng(1), most),
            *near_sound_tasks(evidence, rng(2), most),
            *photo_tasks(evidence, photos, rng(3), most),
            *sound_tasks(evidence, rng(5), most),
        ]
        for task in tasks:  # drawn now, while the scene is open
            if task.photo is not None:
                place.photo_file(task.world_from_photo)
        save_versioned(TaskSet(job.recorded, (job.spec,), tuple(tasks)), path)
    return list(load_versioned(path, TaskSet, SCHEMA_VERSION).tasks)


def _run_scene(todo: _Todo) -> SceneOutcome:
    place = Workplace(todo.job, todo.open_spec)
    info = place.avlmap.data.info
    fingerprint = sha256(msgspec.json.encode(todo.tasks)).hexdigest()
    path = todo.job.folder / f"answers-{_key(todo.job, _QUERYING, info.build_key, fingerprint)}.json"
    if not path.exists():
        write_bytes_atomically(path, msgspec.json.encode(_answers(place, todo.tasks)))
    answers = msgspec.json.decode(path.read_bytes(), type=tuple[Answered, ...])
    sounds = (info.counts.sounds, len(place.truth.events))
    clips = tuple((event.category, event.clip) for event in place.truth.events)
    counts = info.counts
    return SceneOutcome(todo.job.spec, todo.tasks, answers, counts.frames, counts.voxels, sounds, clips)


def _answers(place: Workplace, tasks: Sequence[Task]) -> list[Answered]:
    recorded = place.job.recorded
    scene = QueriedScene(
        place.avlmap, place.recording, place.truth, place.label, recorded.hearing,
        lambda task: place.photo(task.world_from_photo), recorded.seed,
    )  # fmt: skip
    return [
        judged(task, one.name, position, scene.largest_m, found)
        for task in tasks
        for one in CONFIGURATIONS
        if one.kind is task.kind and place.has(one.needs)
        for position, found in [one.answer(scene, task)]
    ]


def _key(job: SceneJob, recipe: int, *facts: object) -> str:
    return sha256(repr((job.map_name, __version__, recipe, *facts)).encode()).hexdigest()[:12]
