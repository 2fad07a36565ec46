"""The tables as a picture: subgoals in a row and by themselves, by configuration, with intervals."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps_sim.bench.harness.paper import paper_figures
from avlmaps_sim.bench.navigation.configurations import CEILING, OURS, configurations
from avlmaps_sim.bench.navigation.missions import Series
from avlmaps_sim.bench.navigation.runs import Outcome
from avlmaps_sim.bench.navigation.scores import Share, scored
from avlmaps_sim.bench.navigation.tables import LENGTH, TITLE, of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {OURS: "#e07b39", CEILING: "#5d8a66"}
_BASELINES = ("#b8c0c8", "#7fa6c9", "#8d99a6", "#55708a")
_PAPERS = ("#efe8f7", "#e0d5ef", "#cdbde4", "#b9a5d6")


def draw_rates(outcome: Outcome, path: Path) -> None:
    """Draw groups of bars for each series: 1, 2, ... subgoals in a row, then subgoals by themselves."""
    from matplotlib.figure import Figure

    shown = [series for series in Series if series in outcome.settings.series]
    figure = Figure(figsize=(10, 2.4 * len(shown) + 0.8), layout="constrained")
    panes = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
    for axes, series in zip(panes, shown, strict=True):
        _draw(axes, outcome, series)
    recorded = outcome.missions.recorded
    figure.suptitle(
        f"Navigation: {len(outcome.missions.scenes)} scenes, profile {outcome.settings.profile}, language "
        f"{outcome.settings.language}, hearing {recorded.hearing}, sensor {recorded.sensor}",
        fontsize=11,
    )
    figure.savefig(path, dpi=110)


def _draw(axes: "Axes", outcome: Outcome, series: Series) -> None:
    length = LENGTH[series]
    labels = [*(f"{k} in a row" for k in range(1, length + 1)), *([] if length else ["all"]), "subgoals"]
    bars: list[tuple[str, str, list[float], list[Share]]] = []
    plain = iter(_BASELINES)
    for one in configurations(series):
        episodes = of(outcome, series, one.name)
        colour = _COLOURS.get(one.name) or next(plain)
        if episodes:
            score = scored(episodes, length, outcome.settings.seed)
            shares = [*score.rows, *([] if length else [score.whole]), score.subgoals]
            bars.append((one.name, colour, [share.percent for share in shares], shares))
    papers = paper_figures("navigation")["tables"].get(str(series), ())
    for paper, shade in zip(papers, _PAPERS[-len(papers) :], strict=False):
        figures = [*paper["in_a_row_percent"], paper["independent_percent"]] if length else [paper["all_percent"], None]
        if any(figure is not None for figure in figures):
            bars.append((f"{paper['name']} (paper)", shade, [figure or 0.0 for figure in figures], []))
    width = 0.8 / max(len(bars), 1)
    for number, (name, colour, heights, shares) in enumerate(bars):
        at = np.arange(len(labels)) + (number - (len(bars) - 1) / 2) * width
        axes.bar(at, heights, width * 0.94, color=colour, label=name)
        for x, share in zip(at, shares, strict=False):
            low, high = (100 * bound for bound in share.interval)
            axes.plot([x, x], [low, high], color="#333333", linewidth=1.0)
    axes.set_xticks(np.arange(len(labels)), labels, fontsize=8)
    axes.set_ylim(0, 104)
    axes.set_ylabel("%", fontsize=8)
    axes.set_title(TITLE[series], loc="left", fontsize=10, fontweight="bold")
    axes.spines[["top", "right"]].set_visible(False)
    if bars:
        axes.legend(fontsize=7, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
