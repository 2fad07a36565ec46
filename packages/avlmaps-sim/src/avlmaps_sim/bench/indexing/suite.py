"""The suite as ``avlmaps bench indexing`` runs it: tables as JSON, Markdown and a picture, and every answer."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from avlmaps.core.files import write_bytes_atomically
from avlmaps_sim.bench.harness.paper import paper_figures, paper_source
from avlmaps_sim.bench.harness.provenance import in_words, provenance
from avlmaps_sim.bench.indexing.configurations import configurations
from avlmaps_sim.bench.indexing.metrics import LIMITS_M, scored
from avlmaps_sim.bench.indexing.runs import IndexingSettings, Outcome, run
from avlmaps_sim.bench.indexing.tables import TITLE, tables
from avlmaps_sim.bench.indexing.tasks import TaskKind
from avlmaps_sim.bench.output import markdown, write_answer

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"baseline": "#b8c0c8", "variant": "#7fa6c9", "ours": "#e07b39", "ceiling": "#5d8a66", "paper": "#d9cfe8"}


def draw_recalls(outcome: Outcome, path: Path) -> None:
    """Draw a bar for every configuration: solid within 0.5 m with its interval, pale within 2 m."""
    from matplotlib.figure import Figure

    rows = [len(configurations(kind)) + len(paper_figures("indexing")["tables"][str(kind)]) for kind in TaskKind]
    figure = Figure(figsize=(10, 0.36 * sum(rows) + 2.6), layout="constrained")
    panes = figure.subplots(len(rows), 1, height_ratios=rows, sharex=True)
    for axes, kind in zip(panes, TaskKind, strict=True):
        _draw(axes, outcome, kind)
    panes[-1].set_xlabel("recall@1, %: solid within 0.5 m (line: 95 % interval), pale within 2 m")
    recorded = outcome.tasks.recorded
    figure.suptitle(
        f"Cross-modal indexing: {len(outcome.tasks.scenes)} scenes, profile {outcome.settings.profile}, "
        f"rules {outcome.settings.rules}, hearing {recorded.hearing}, sensor {recorded.sensor}",
        fontsize=11,
    )
    figure.savefig(path, dpi=110)


def _draw(axes: "Axes", outcome: Outcome, kind: TaskKind) -> None:
    names: list[str] = []
    count = 0
    for one in configurations(kind):
        answers = outcome.answers(kind, one.name)
        names.append(one.name if answers else f"{one.name} (no model)")
        if answers:
            score, row = scored(answers), len(names) - 1
            count = score.count
            near, far = 100 * score.recall(LIMITS_M[0]), 100 * score.recall(LIMITS_M[-1])
            low, high = (100 * bound for bound in score.recall_interval(LIMITS_M[0]))
            _bar(axes, row, near, far, _COLOURS[one.role], high)
            axes.plot([low, high], [row, row], color="#333333", linewidth=1.2)
    for paper in paper_figures("indexing")["tables"][str(kind)]:
        figures = paper["recall_percent"]
        names.append(f"{paper['name']} (paper, other data)")
        if figures[0] is not None:
            _bar(axes, len(names) - 1, figures[0], figures[-1], _COLOURS["paper"])
    axes.set_yticks(np.arange(len(names)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, 108)
    axes.set_title(f"{TITLE[kind]}, {count} tasks", loc="left", fontsize=10, fontweight="bold")
    axes.spines[["top", "right"]].set_visible(False)


def _bar(axes: "Axes", row: int, near: float, far: float, colour: str, high: float = 0.0) -> None:
    """Draw one bar, and its figures right of it and of its interval's end."""
    axes.barh(row, far, color=colour, alpha=0.35, height=0.72)
    axes.barh(row, near, color=colour, height=0.72)
    axes.text(max(far, high) + 0.6, row, f"{near:.0f} / {far:.0f}", va="center", fontsize=7)


NOTE = (
    "An answer is the first goal. Its distance is horizontal, to the nearest point of the box round the right thing, "
    "or to where the robot was while the right sound was heard; "
    "no answer counts as the largest distance in the scene. Intervals are 95 %: Wilson's for recalls, bootstrapped for "
    "means, both over tasks as if each stood for itself."
)


def run_indexing(settings: IndexingSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write its tables (JSON, Markdown, CSV), ``indexing.png`` and ``indexing_answers.json``.

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
    draw_recalls(outcome, out / "indexing.png")
    return written


def _answers(outcome: Outcome) -> bytes:
    """Return every answer beside its task, to look into failures."""
    by_task: dict[str, list[Any]] = {}
    for scene in outcome.scenes:
        for given in scene.answers:
            by_task.setdefault(given.task, []).append(
                {
                    "configuration": given.configuration,
                    "position": given.position,
                    "off_m": round(given.off_m, 3),
                    "centre_off_m": round(given.centre_m, 3),
                }
            )
    listed = [
        {"task": task.name, "asked": task.sentence, "rivals": task.rivals, "answers": by_task.get(task.name, [])}
        for task in outcome.tasks.tasks
    ]
    return msgspec.json.format(msgspec.json.encode(listed), indent=1) + b"\n"
