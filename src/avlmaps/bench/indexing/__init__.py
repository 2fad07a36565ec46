"""The cross-modal indexing benchmark: the paper's Tables III, IV and V on homes made by rule."""

from avlmaps.bench.indexing.runs import DEFAULT_SCENES, IndexingSettings, Outcome, run
from avlmaps.bench.indexing.tasks import Box, Task, TaskKind, TaskSet, load_tasks, save_tasks

__all__ = [
    "DEFAULT_SCENES",
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
