"""The suite as ``avlmaps bench navigation`` runs it: tables as JSON, Markdown and a picture, and every stop."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from avlmaps.core.files import write_bytes_atomically
from avlmaps.navigate.bodies import BASE
from avlmaps_sim.bench.harness.paper import paper_figures, paper_source
from avlmaps_sim.bench.harness.provenance import in_words, provenance
from avlmaps_sim.bench.navigation.configurations import CEILING, OURS, configurations
from avlmaps_sim.bench.navigation.episodes import Episode
from avlmaps_sim.bench.navigation.missions import Series
from avlmaps_sim.bench.navigation.runs import Outcome, run
from avlmaps_sim.bench.navigation.scores import Share, scored
from avlmaps_sim.bench.navigation.settings import NavigationSettings
from avlmaps_sim.bench.navigation.tables import LENGTH, TITLE, of, tables
from avlmaps_sim.bench.output import markdown, write_answer

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


NOTE = (
    "A subgoal is reached where the robot stops within 1 m of a right thing: horizontally, to the nearest point of its "
    "box, to where the sound was heard (overlay) or came from (acoustic), or to where the photo was taken. SPL is "
    "success weighted by path length (Anderson et al. 2018) over subgoals. A contact is foretold where the map showed "
    "an obstacle within the body's radius of where it was about to be. Intervals are 95 %: Wilson's over sequences, "
    "bootstrapped by whole sequences for subgoals and SPL."
)


def run_navigation(settings: NavigationSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write its tables (JSON, Markdown, CSV), ``navigation.png`` and ``navigation_episodes.jsonl``.

    Recordings and maps stay in the folder ``work`` of ``out``, what robots did in ``episodes``.
    """
    settings = settings or NavigationSettings()
    outcome = run(settings, out)
    answer = {
        "suite": "navigation",
        **provenance(settings, outcome.missions.recorded, outcome.missions.scenes, outcome.weights),
        "language": settings.language,
        "guess": settings.guess,
        "body": {"radius_m": BASE.radius_m, "height_m": BASE.height_m},
        "note": NOTE,
        "paper": paper_source("navigation"),
        "tables": tables(outcome),
    }
    language = "Programs are given." if settings.language == "none" else f"Language by {settings.language}."
    head = f"{in_words(answer)} {language} {len(outcome.episodes)} episodes."
    page = f"# Navigation\n\n{head}\n\n{NOTE}\n\nPaper: {answer['paper']}\n\n"
    written = write_answer(answer, out, page + markdown(answer["tables"]))
    write_bytes_atomically(out / "navigation_episodes.jsonl", _lines(outcome.episodes))
    draw_rates(outcome, out / "navigation.png")
    return written


def _lines(episodes: list[Episode]) -> bytes:
    """Return every episode, in the order of the missions, to look into failures."""
    return b"".join(msgspec.json.encode(episode) + b"\n" for episode in episodes)
