"""Running the benchmark: every scene in a process of its own, every configuration asked the same tasks."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter

from avlmaps.bench.indexing.configurations import CONFIGURATIONS
from avlmaps.bench.indexing.metrics import Answered, judged
from avlmaps.bench.indexing.prepared import SceneJob, Workplace, kinds_of
from avlmaps.bench.indexing.tasks import SceneSettings, Task, TaskError, TaskKind, TaskSet, load_tasks, save_tasks
from avlmaps.core.progress import progress, say, silence
from avlmaps.sim.scene import Scene
from avlmaps.sim.scenes import open_scene

DEFAULT_SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_012))


@dataclass(frozen=True, slots=True, kw_only=True)
class IndexingSettings(SceneSettings):
    """What the benchmark is run on.

    Attributes:
        scenes: held-out homes by default.
        tasks_a_scene: at most so many a scene and table.
    """

    scenes: tuple[str, ...] = DEFAULT_SCENES
    tasks_a_scene: int = 20

    def __post_init__(self) -> None:
        if self.frames < 20 or self.tasks_a_scene < 1 or self.jobs < 0:
            raise TaskError(
                f"The benchmark cannot run with {self.frames} frames, {self.tasks_a_scene} tasks a scene and "
                f"{self.jobs} jobs; take at least 20 frames, 1 task, and 0 jobs for as many as there are cores."
            )


@dataclass(frozen=True, slots=True)
class SceneOutcome:
    """What became of one scene.

    Attributes:
        scene: its name.
        tasks: what was asked.
        answers: of every configuration that the profile has the models for.
        frames: how many the map was made of.
        voxels: how many it has.
        sounds: how many sounds were heard, and how many there were.
        seconds: how long it all took.
    """

    scene: str
    tasks: tuple[Task, ...]
    answers: tuple[Answered, ...]
    frames: int
    voxels: int
    sounds: tuple[int, int]
    seconds: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of all scenes."""

    settings: IndexingSettings
    tasks: TaskSet
    scenes: tuple[SceneOutcome, ...]

    def answers(self, kind: TaskKind, configuration: str) -> list[Answered]:
        """Return a configuration's answers to the tasks of a table; none where the profile lacks a model for it."""
        asked = {task.name for task in self.tasks.tasks if task.kind is kind}
        return [
            answer
            for scene in self.scenes
            for answer in scene.answers
            if answer.configuration == configuration and answer.task in asked
        ]


def run(settings: IndexingSettings, work: Path, open_spec: Callable[[str], Scene] = open_scene) -> Outcome:
    """Record, map and ask every scene.

    Args:
        settings: what.
        work: folder in which recordings and maps are kept; a run that was broken off goes on from there.
        open_spec: makes a scene of its name (tests give small ones).

    Raises:
        TaskError: the tasks cannot be read, or a scene yields none.
    """
    given = None if settings.load is None else load_tasks(settings.load)
    recorded = settings.recorded if given is None else given.recorded
    if given is not None and given.recorded.sounds != settings.recorded.sounds:
        wanted = f"name the folder {given.recorded.sounds!r} with --sounds"
        raise TaskError(f"The tasks {settings.load} were made with other sounds; {wanted or 'leave --sounds out'}.")
    names = settings.scenes if given is None else given.scenes
    jobs = [SceneJob(name, recorded, settings.sounds, settings.profile, work) for name in names]
    own = {name: None if given is None else [t for t in given.tasks if t.scene == name] for name in names}
    work.mkdir(parents=True, exist_ok=True)
    outcomes: list[SceneOutcome] = []
    todo = [(job, own[job.spec], settings.tasks_a_scene) for job in jobs]
    for outcome in progress(_outcomes(todo, settings.jobs, open_spec), "indexing", total=len(todo), unit="scene"):
        counts = ", ".join(f"{count} {kind}" for kind, count in kinds_of(outcome.tasks).items())
        say(f"{outcome.scene}: {outcome.frames} frames, {outcome.voxels} voxels, {counts}; {outcome.seconds:.0f} s")
        outcomes.append(outcome)
    tasks = given or TaskSet(recorded, names, tuple(task for outcome in outcomes for task in outcome.tasks))
    if not tasks.tasks:
        raise TaskError(
            f"The {len(names)} scenes yield no task; take larger ones, or more frames than {recorded.frames}."
        )
    if settings.save is not None:
        save_tasks(tasks, settings.save)
    return Outcome(settings, tasks, tuple(outcomes))


_Todo = tuple[SceneJob, list[Task] | None, int]


def _outcomes(todo: Sequence[_Todo], jobs: int, open_spec: Callable[[str], Scene]) -> Iterator[SceneOutcome]:
    workers = min(jobs or os.cpu_count() or 1, len(todo))
    if workers < 2:
        yield from (ask_scene(*one, open_spec) for one in todo)
        return
    with get_context("spawn").Pool(workers, silence, maxtasksperchild=1) as pool:
        calls: Iterable[tuple[_Todo, Callable[[str], Scene]]] = [(one, open_spec) for one in todo]
        yield from pool.imap(_ask, calls)


def _ask(call: tuple[_Todo, Callable[[str], Scene]]) -> SceneOutcome:
    (job, tasks, most), open_spec = call
    return ask_scene(job, tasks, most, open_spec)


def ask_scene(
    job: SceneJob, tasks: Sequence[Task] | None, most: int, open_spec: Callable[[str], Scene] = open_scene
) -> SceneOutcome:
    """Make a scene ready and put every task to every configuration that the profile has the models for.

    Args:
        job: which scene.
        tasks: what to ask; None makes tasks.
        most: at most so many of each kind are made.
        open_spec: makes a scene of its name.
    """
    begin = perf_counter()
    place = Workplace(job, open_spec)
    asked = tuple(place.tasks(most) if tasks is None else tasks)
    scene = place.asked_scene
    answers = [
        judged(task, one.name, one.answer(scene, task), scene.largest_m)
        for task in asked
        for one in CONFIGURATIONS
        if one.kind is task.kind and scene.has(one.needs)
    ]
    info = scene.asked.stored.info.counts
    sounds = (info.sounds, len(scene.truth.events))
    return SceneOutcome(job.spec, asked, tuple(answers), info.frames, info.voxels, sounds, perf_counter() - begin)
