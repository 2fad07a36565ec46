"""Tables III, IV and V as ``avlmaps bench indexing`` writes them, the paper's own figures beside ours."""

from collections.abc import Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.files import write_bytes_atomically
from avlmaps_sim.bench.harness.figures import (
    chosen_on,
    clip_table,
    in_percent,
    in_words,
    markdown,
    paper_figures,
    paper_source,
    provenance,
    shown_scene,
    wilson,
    write_answer,
)
from avlmaps_sim.bench.harness.settings import TaskError, load_versioned
from avlmaps_sim.bench.indexing.runs import (
    LIMITS_M,
    OURS,
    IndexingSettings,
    Outcome,
    Score,
    chance,
    configurations,
    judged,
    run,
    scored,
)
from avlmaps_sim.bench.indexing.tasks import SCHEMA_VERSION, Task, TaskKind, TaskSet
from avlmaps_sim.mesh import Triple

TITLE = {
    TaskKind.AREA: "Table III: an object in an area",
    TaskKind.SOUND: "Table IV: a sound near an object",
    TaskKind.PHOTO: "Table V: an object near a photo",
    TaskKind.NEAR_SOUND: "An object near a sound (not in the paper)",
}
_PAPER = "paper (Matterport3D, other data)"


def columns() -> list[str]:
    """Return the names of a table's columns."""
    recalls = [title for limit in LIMITS_M for title in (f"R@1 < {limit:g} m %", "95 %")]
    return ["configuration", "tasks", *recalls, "mean m", "95 %", "answered %"]


def tables(outcome: Outcome) -> dict[str, dict[str, Any]]:
    """Return every table, ``{name: {"columns", "rows"}}``."""
    made = {TITLE[kind]: _table(outcome, kind) for kind in TaskKind}
    made = {**made, "Ours beside one modality and the ceiling": _figures(outcome)}
    made = {**made, "Ours reported as found": _found(outcome), "Scenes": _scenes(outcome)}
    if outcome.tasks.recorded.sounds:
        made["Clips that were heard"] = clip_table(clip for one in outcome.scenes for clip in one.clips)
    return made


def _table(outcome: Outcome, kind: TaskKind) -> dict[str, Any]:
    tasks = [task for task in outcome.tasks.tasks if task.kind is kind]
    rows = [_chance(tasks)]
    for one in configurations(kind):
        answers = outcome.answers(kind, one.name)
        if answers:
            rows.append(_row(one.name, scored(answers, outcome.settings.seed)))
            if one.role == OURS:
                rows.append(_row(f"{one.name}, by the centre", scored(answers, outcome.settings.seed, by_centre=True)))
        else:
            rows.append([one.name, 0, *[""] * (len(columns()) - 2)])
    table = {"columns": columns(), "rows": [*rows, *_paper_rows(kind)]}
    chosen = chosen_on(outcome.tasks.scenes)
    return {**table, "chosen on": chosen} if chosen else table


def open_tasks(path: Path) -> tuple[Task, ...]:
    """Read what ``--save-tasks`` wrote; ``TaskError`` where the file holds none."""
    return load_versioned(path, TaskSet, SCHEMA_VERSION).tasks


def score_others(tasks: Sequence[Task], places: Mapping[str, Triple]) -> dict[str, dict[str, Any]]:
    """Judge another system's answers by the rules of ours.

    ``places`` are first goals by the task's name, metres, in the world of the recording; the height does not count.
    A task left out is no hit, in the mean as far off as its scene's targets lie apart. Returns a table of each kind.
    ``TaskError``: a place belongs to no task, or is none.
    """
    if strange := sorted(places.keys() - {task.name for task in tasks}):
        raise TaskError(f"{len(strange)} of {len(places)} answers belong to no task, such as {strange[0]!r}.")
    for name, at in places.items():
        if len(at) != 3 or not all(isinstance(v, Real) and np.isfinite(v) for v in at):
            raise TaskError(f"The answer to {name} is {at}; give x, y and z in metres.")
    ends: dict[str, list[Sequence[float]]] = {task.scene: [] for task in tasks}
    for task in tasks:
        ends[task.scene] += [end[:2] for box in task.targets for end in (box.low, box.high)]
    largest_m = {scene: float(np.linalg.norm(np.ptp(own, axis=0))) for scene, own in ends.items()}
    made: dict[str, dict[str, Any]] = {}
    for kind in dict.fromkeys(task.kind for task in tasks):
        own = [task for task in tasks if task.kind is kind]
        answers = [judged(task, "yours", places.get(task.name), largest_m[task.scene]) for task in own]
        centre = _row("yours, by the centre", scored(answers, by_centre=True))
        made[TITLE[kind]] = {"columns": columns(), "rows": [_chance(own), _row("yours", scored(answers)), centre]}
    return made


def _chance(tasks: Sequence[Task]) -> list[Any]:
    return ["chance: one of the candidates", len(tasks), _percent(chance(tasks)), *[""] * (len(columns()) - 3)]


def _row(name: str, score: Score) -> list[Any]:
    recalls = [
        cell for limit in LIMITS_M for cell in (_percent(score.recall(limit)), in_percent(score.recall_interval(limit)))
    ]
    mean = [round(score.mean_m, 2), "{:.2f} to {:.2f}".format(*score.mean_interval_m)]
    return [name, score.count, *recalls, *mean, _percent(score.answered / score.count)]


def _paper_rows(kind: TaskKind) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for row in paper_figures("indexing")["tables"][str(kind)]:
        recalls = [cell for figure in row["recall_percent"] for cell in ("" if figure is None else figure, "")]
        mean = "" if row["mean_m"] is None else row["mean_m"]
        rows.append([f"{row['name']}, {_PAPER}", row["tasks"] or "", *recalls, mean, "", ""])
    return rows


def _figures(outcome: Outcome) -> dict[str, Any]:
    rows: list[list[Any]] = []
    for kind in TaskKind:
        by_role: dict[str, list[float]] = {}
        for one in configurations(kind):
            answers = outcome.answers(kind, one.name)
            if answers:
                by_role.setdefault(one.role, []).append(100 * scored(answers).recall(LIMITS_M[0]))
        ours, ceiling = (by_role.get(role, [None])[0] for role in (OURS, "ceiling"))
        best = max(by_role.get("baseline", []), default=None)
        lead = None if ours is None or best is None else ours - best
        share = None if ours is None or not ceiling else 100 * ours / ceiling
        rows.append([TITLE[kind], *["" if v is None else round(v, 1) for v in (ours, best, lead, ceiling, share)]])
    titles = ["table", "ours %", "best single modality %", "lead, points", "ceiling %", "of it %"]
    return {"columns": titles, "rows": rows}


def _found(outcome: Outcome) -> dict[str, Any]:
    rows: list[list[Any]] = []
    for kind in TaskKind:
        ours = next(one for one in configurations(kind) if one.role == OURS)
        answers = outcome.answers(kind, ours.name)
        cells: list[object] = []
        for right in (True, False):
            found = [answer.found for answer in answers if (answer.off_m < LIMITS_M[0]) == right]
            count, hits = len(found), sum(found)
            cells += [count, _percent(hits / count), in_percent(wilson(hits, count))] if count else [0, "", ""]
        rows.append([TITLE[kind], *cells])
    group = ("of them found %", "95 %")
    return {"columns": ["table", "first goal within 0.5 m", *group, "farther", *group], "rows": rows}


def _scenes(outcome: Outcome) -> dict[str, Any]:
    rows = [
        [shown_scene(one.scene), one.frames, one.voxels, f"{one.sounds[0]} of {one.sounds[1]}", *_by_kind(one.tasks)]
        for one in outcome.scenes
    ]
    total = _by_kind(outcome.tasks.tasks)
    return {
        "columns": ["scene", "frames", "voxels", "sounds found", *map(str, TaskKind)],
        "rows": [*rows, ["in all", sum(row[1] for row in rows), sum(row[2] for row in rows), "", *total]],
    }


def _by_kind(tasks: Sequence[Task]) -> list[int]:
    return [sum(task.kind is kind for task in tasks) for kind in TaskKind]


def _percent(share: float) -> float:
    return round(100.0 * share, 1)


NOTE = (
    "An answer is the first goal. Its distance is horizontal, to the nearest point of the box round the right thing, "
    "or to where the robot was while the right sound was heard; "
    "no answer counts as the largest distance in the scene. Intervals are 95 %: Wilson's for recalls, bootstrapped for "
    "means, both over tasks as if each stood for itself."
)


def run_indexing(settings: IndexingSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write its tables (JSON, Markdown, CSV), and ``indexing_answers.json``.

    Recordings, maps, tasks and answers stay in the folder ``work`` of ``out``.
    """
    settings = settings or IndexingSettings()
    outcome = run(settings, out / "work")
    answer = {
        "suite": "indexing",
        **provenance(settings, outcome.tasks.recorded, outcome.tasks.scenes, outcome.weights),
        "note": NOTE,
        "paper": paper_source("indexing"),
        "tables": tables(outcome),
    }
    page = f"# Cross-modal indexing\n\n{in_words(answer)}\n\n{NOTE}\n\nPaper: {answer['paper']}\n\n"
    written = write_answer(answer, out, page + markdown(answer["tables"]))
    write_bytes_atomically(out / "indexing_answers.json", _answers(outcome))
    return written


def _answers(outcome: Outcome) -> bytes:
    by_task: dict[str, list[Any]] = {}
    for given in (one for scene in outcome.scenes for one in scene.answers):
        off_m = {"off_m": round(given.off_m, 3), "centre_off_m": round(given.centre_m, 3)}
        named = {"configuration": given.configuration, "position": given.position}
        by_task.setdefault(given.task, []).append({**named, **off_m})
    listed = [
        {"task": task.name, "asked": task.sentence, "rivals": task.rivals, "answers": by_task.get(task.name, [])}
        for task in outcome.tasks.tasks
    ]
    return msgspec.json.format(msgspec.json.encode(listed), indent=1) + b"\n"
