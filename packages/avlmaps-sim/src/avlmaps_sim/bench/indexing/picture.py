"""The tables as a picture: recall within half a metre and within two, by configuration, with intervals."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps_sim.bench.harness.paper import paper_figures
from avlmaps_sim.bench.indexing.configurations import configurations
from avlmaps_sim.bench.indexing.metrics import LIMITS_M, scored
from avlmaps_sim.bench.indexing.runs import Outcome
from avlmaps_sim.bench.indexing.tables import TITLE
from avlmaps_sim.bench.indexing.tasks import TaskKind

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
