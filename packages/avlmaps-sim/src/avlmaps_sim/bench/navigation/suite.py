"""Tables I, II and VI and the lists of commands as ``avlmaps bench navigation`` writes them."""

from pathlib import Path
from typing import Any

import msgspec

from avlmaps.core.files import write_bytes_atomically
from avlmaps.navigate.costmap import BASE
from avlmaps_sim.bench.harness.figures import (
    chosen_on,
    clip_table,
    in_words,
    markdown,
    paper_figures,
    paper_source,
    provenance,
    shown_scene,
    write_answer,
)
from avlmaps_sim.bench.navigation.commands import COMMANDS, SPATIAL
from avlmaps_sim.bench.navigation.episodes import Episode, Score, Share, is_reachable, of_kind, scored, share_of
from avlmaps_sim.bench.navigation.map_variants import CEILING, OURS, configurations
from avlmaps_sim.bench.navigation.missions import GoalKind, NavigationSettings, Series
from avlmaps_sim.bench.navigation.runs import Outcome, run

_PAPER = "paper (Matterport3D, other goals)"
_SOUNDS = (Series.SOUNDS_1, Series.SOUNDS_2, Series.SOUNDS_3)
TITLE = {
    Series.SOUNDS_1: "Table I: four sounds, range 1 (domestic)",
    Series.SOUNDS_2: "Table I: four sounds, range 2 (and human)",
    Series.SOUNDS_3: "Table I: four sounds, range 3 (and animals)",
    Series.IMAGES: "Table II: an image and two objects",
    Series.PAIRS: "Table VI: an ambiguous sound and an ambiguous object",
    Series.COMMANDS: f"Real-world list: {len(COMMANDS)} commands",
    Series.SPATIAL: f"Real-world list: {len(SPATIAL)} multimodal spatial goals",
}
LENGTH = {**dict.fromkeys(_SOUNDS, 4), Series.IMAGES: 3, Series.PAIRS: 2, Series.COMMANDS: 0, Series.SPATIAL: 0}
_KINDS: dict[Series, tuple[tuple[str, GoalKind], ...]] = {
    Series.IMAGES: (("image %", GoalKind.IMAGE), ("objects %", GoalKind.OBJECT)),
    Series.PAIRS: (("sound %", GoalKind.SOUND), ("object %", GoalKind.OBJECT)),
}
_TAIL = ("SPL", "95 %", "path m", "actions", "contacts", "foretold")


def of(outcome: Outcome, series: Series, configuration: str) -> list[Episode]:
    """Return a row's episodes."""
    return [one for one in outcome.episodes if one.series is series and one.configuration == configuration]


def tables(outcome: Outcome) -> dict[str, dict[str, Any]]:
    """Return every table, ``{name: {"columns", "rows"}}``."""
    shown = [series for series in Series if series in outcome.settings.series]
    made = {TITLE[series]: _table(outcome, series) for series in shown}
    if {Series.COMMANDS, Series.SPATIAL} & set(shown):
        made["Commands and spatial goals, form by form"] = _forms(outcome)
    made = {**made, "All experiments": _figures(outcome), "Scenes": _scenes(outcome)}
    if outcome.missions.recorded.sounds:
        made["Clips that were heard"] = clip_table(clip for one in outcome.scenes for clip in one.clips)
    return made


def columns(series: Series) -> list[str]:
    """Return the names of a series' columns."""
    rows = [title for k in range(1, LENGTH[series] + 1) for title in (f"{k} in a row %", "95 %")]
    whole = [] if LENGTH[series] else ["all reached %", "95 %"]
    kinds = [title for name, _ in _KINDS.get(series, ()) for title in (name, "95 %")]
    return ["configuration", "sequences", *rows, *whole, "subgoals %", "95 %", *kinds, *_TAIL]


def _table(outcome: Outcome, series: Series) -> dict[str, Any]:
    rows: list[list[Any]] = []
    for one in configurations(series):
        episodes = of(outcome, series, one.name)
        if episodes:
            score = scored(episodes, LENGTH[series], outcome.settings.seed)
            rows.append(_row(one.name, series, score, _kind_shares(outcome, series, episodes)))
        else:
            rows.append([one.name, 0, *[""] * (len(columns(series)) - 2)])
    paper = [_paper_row(series, row) for row in paper_figures("navigation")["tables"].get(str(series), ())]
    chosen = chosen_on(outcome.missions.scenes)
    return {"columns": columns(series), "rows": [*rows, *paper], **({"chosen on": chosen} if chosen else {})}


def _kind_shares(outcome: Outcome, series: Series, episodes: list[Episode]) -> list[Share]:
    return [share_of(episodes, of_kind(kind), outcome.settings.seed) for _, kind in _KINDS.get(series, ())]


def _row(name: str, series: Series, score: Score, kinds: list[Share]) -> list[Any]:
    shares = [*score.rows, *([] if LENGTH[series] else [score.whole]), score.subgoals, *kinds]
    cells = [cell for share in shares for cell in (share.percent, share.bounds)]
    spl = [round(score.spl, 3), "{:.3f} to {:.3f}".format(*score.spl_interval)]
    means = [round(score.path_m, 2), round(score.actions, 1)]
    return [name, score.sequences, *cells, *spl, *means, score.contacts, score.foretold]


def _paper_row(series: Series, paper: dict[str, Any]) -> list[Any]:
    if LENGTH[series]:
        figures = [*paper["in_a_row_percent"], paper["independent_percent"]]
        figures += [paper.get(f"{name.split()[0].rstrip('s')}_percent") for name, _ in _KINDS.get(series, ())]
    else:
        figures = [paper["all_percent"], None]
    cells = [cell for figure in figures for cell in ("" if figure is None else figure, "")]
    return [f"{paper['name']}, {_PAPER}", paper["sequences"], *cells, *[""] * len(_TAIL)]


def _forms(outcome: Outcome) -> dict[str, Any]:
    rows: list[list[Any]] = []
    for series in (Series.COMMANDS, Series.SPATIAL):
        forms = dict.fromkeys(one.form for one in outcome.missions.missions if one.series is series)
        for form in forms:
            names = {one.name for one in outcome.missions.missions if one.series is series and one.form == form}
            own, true = (
                [e for e in of(outcome, series, which) if e.mission in names] for which in (OURS, CEILING)
            )  # fmt: skip
            understood = sum(e.understood for e in true)
            rows.append([str(series), form, len(names), _whole(own), _whole(true), f"{understood} of {len(true)}"])
    return {"columns": ["list", "command", "filled", f"{OURS} %", f"{CEILING} %", "understood"], "rows": rows}


def _whole(episodes: list[Episode]) -> object:
    return scored(episodes, 0).whole.percent if episodes else ""


def _figures(outcome: Outcome) -> dict[str, Any]:
    true = [one for one in outcome.episodes if one.configuration == CEILING]
    reachable = share_of(true, is_reachable, outcome.settings.seed)
    rows: list[list[Any]] = []
    if reachable.count:
        row = ["true perception: reachable subgoals that were reached, %", reachable.percent, reachable.bounds]
        rows.append([*row, reachable.count])
    predicted = sum(one.foretold for one in outcome.episodes)
    rows.append(["contacts that the map could have foretold", predicted, "", len(outcome.episodes)])
    understood = [one.understood for one in outcome.episodes]
    rows.append(["missions whose commands were understood", sum(understood), "", len(understood)])
    return {"columns": ["figure", "measured", "95 %", "of"], "rows": rows}


def _scenes(outcome: Outcome) -> dict[str, Any]:
    shown = [series for series in Series if series in outcome.settings.series]
    rows: list[list[Any]] = []
    for one in outcome.scenes:
        own = [mission for mission in outcome.missions.missions if mission.scene == one.scene]
        counts = [sum(mission.series is series for mission in own) for series in shown]
        rows.append([shown_scene(one.scene), one.frames, one.voxels, f"{one.sounds[0]} of {one.sounds[1]}", *counts])
    total = [sum(row[column] for row in rows) for column in (1, 2)]
    counts = [sum(row[4 + column] for row in rows) for column in range(len(shown))]
    return {
        "columns": ["scene", "frames", "voxels", "sounds found", *map(str, shown)],
        "rows": [*rows, ["in all", *total, "", *counts]],
    }


NOTE = (
    "A subgoal is reached where the robot stops within 1 m of a right thing: horizontally, to the nearest point of its "
    "box, to where the sound was heard (overlay) or came from (acoustic), or to where the photo was taken. SPL is "
    "success weighted by path length (Anderson et al. 2018) over subgoals. A contact is foretold where the map showed "
    "an obstacle within the body's radius of where it was about to be. Intervals are 95 %: Wilson's over sequences, "
    "bootstrapped by whole sequences for subgoals and SPL."
)


def run_navigation(settings: NavigationSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write its tables (JSON, Markdown, CSV), and ``navigation_episodes.jsonl``.

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
    return written


def _lines(episodes: list[Episode]) -> bytes:
    return b"".join(msgspec.json.encode(episode) + b"\n" for episode in episodes)
