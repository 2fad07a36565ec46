"""Running the benchmark: first all scenes' tasks are made, then every configuration answers them; scene by scene."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from time import perf_counter

import msgspec

from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps_sim.bench.harness.settings import SceneSettings, TaskError
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.configurations import CONFIGURATIONS
from avlmaps_sim.bench.indexing.metrics import Answered, judged
from avlmaps_sim.bench.indexing.rules import area_tasks, near_sound_tasks, photo_tasks, sound_tasks
from avlmaps_sim.bench.indexing.scene_queries import QueriedScene
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind, TaskSet, load_tasks, save_tasks
from avlmaps_sim.scene import Scene
from avlmaps_sim.scenes import open_scene

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
_QUERYING = 7  # raised when they are queried by other rules


@dataclass(frozen=True, slots=True, kw_only=True)
class IndexingSettings(SceneSettings):
    """The settings of the benchmark.

    Attributes:
        scenes: held-out homes by default, or recordings with ``objects.json``.
        tasks_a_scene: limit of tasks a scene and table.
        sizes: limit of tasks a table, over all scenes; taken from the scenes in turn. None: all that they offer.
    """

    scenes: tuple[str, ...] = DEFAULT_SCENES
    tasks_a_scene: int = 20
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
    seconds: float
    clips: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of all scenes.

    ``weights`` are the checksums of the models, by module.
    """

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
    """The work of one process: make a scene's tasks, or answer some."""

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
        save_tasks(tasks, settings.save)
    todo = [
        _Todo(job, open_spec, tasks=tuple(task for task in tasks.tasks if task.scene == job.spec))
        for job in scene_jobs(settings, tasks.recorded, tasks.scenes, work)
    ]
    scenes = side_by_side(_run_scene, todo, settings.jobs, "indexing", _named)
    return Outcome(settings, tasks, tuple(scenes), weights)


def _named(todo: _Todo) -> str:
    return todo.job.spec


def _tasks(settings: IndexingSettings, work: Path, open_spec: Callable[[str], Scene]) -> TaskSet:
    """Return the tasks of a file, or make them."""
    if settings.load is not None:
        given = load_tasks(settings.load)
        if given.recorded.sounds != settings.recorded.sounds:
            wanted = f"name the folder {given.recorded.sounds!r} with" if given.recorded.sounds else "leave out"
            raise TaskError(f"The tasks {settings.load} were made with other sounds; {wanted} {option('sounds')}.")
        return given
    jobs = scene_jobs(settings, settings.recorded, settings.scenes, work)
    todo = [_Todo(job, open_spec, settings.tasks_a_scene) for job in jobs]
    made = side_by_side(_made, todo, settings.jobs, "mapping", _named)
    own = tuple(task for kind in TaskKind for task in _in_turn(made, kind, settings.sizes))
    if not own:
        raise TaskError(
            f"The {len(settings.scenes)} scenes yield no task; take larger ones, or more frames than {settings.frames}."
        )
    return TaskSet(settings.recorded, settings.scenes, own)


def _in_turn(made: Sequence[Sequence[Task]], kind: TaskKind, sizes: Mapping[TaskKind, int] | None) -> list[Task]:
    own = [[task for task in scene if task.kind is kind] for scene in made]
    longest = max(map(len, own), default=0)
    turns = [scene[number] for number in range(longest) for scene in own if number < len(scene)]
    kept = {task.name for task in turns[: None if sizes is None else sizes[kind]]}
    return [task for scene in own for task in scene if task.name in kept]


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
        save_tasks(TaskSet(job.recorded, (job.spec,), tuple(tasks)), path)
    return list(load_tasks(path).tasks)


def _run_scene(todo: _Todo) -> SceneOutcome:
    """Put a scene's tasks to every configuration that the profile has the models for, unless that is done."""
    begin = perf_counter()
    place = Workplace(todo.job, todo.open_spec)
    info = place.avlmap.data.info
    fingerprint = sha256(msgspec.json.encode(todo.tasks)).hexdigest()
    path = todo.job.folder / f"answers-{_key(todo.job, _QUERYING, info.build_key, fingerprint)}.json"
    if not path.exists():
        write_bytes_atomically(path, msgspec.json.encode(_answers(place, todo.tasks)))
    answers = msgspec.json.decode(path.read_bytes(), type=tuple[Answered, ...])
    sounds = (info.counts.sounds, len(place.truth.events))
    seconds = perf_counter() - begin
    clips = tuple((event.category, event.clip) for event in place.truth.events)
    counts = info.counts
    return SceneOutcome(todo.job.spec, todo.tasks, answers, counts.frames, counts.voxels, sounds, seconds, clips)


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
