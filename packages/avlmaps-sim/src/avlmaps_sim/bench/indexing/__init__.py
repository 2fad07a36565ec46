"""The cross-modal indexing benchmark: the paper's Tables III, IV and V on homes made by rule."""

from avlmaps_sim.bench.harness.evidence import Box
from avlmaps_sim.bench.indexing.runs import DEFAULT_SCENES, PAPER_SIZES, IndexingSettings, Outcome, run
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind, TaskSet, load_tasks, save_tasks

__all__ = [
    "DEFAULT_SCENES",
    "PAPER_SIZES",
    "Box",
    "IndexingSettings",
    "Outcome",
    "Task",
    "TaskKind",
    "TaskSet",
    "load_tasks",
    "run",
    "save_tasks",
]
