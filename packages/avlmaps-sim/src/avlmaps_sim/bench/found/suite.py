"""The suite ``avlmaps bench found``: Brier scores, what is reported as found, and reliability."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.files import write_bytes_atomically
from avlmaps.query.goals import FACTORS, factor_values
from avlmaps.query.settings import FOUND_AT
from avlmaps_sim.bench.found.answers import Judged, judged_job
from avlmaps_sim.bench.harness.figures import Table, in_percent, in_words, markdown, provenance, wilson, write_answer
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import scene_jobs
from avlmaps_sim.bench.indexing.runs import IndexingSettings
from avlmaps_sim.bench.indexing.suite import TITLE
from avlmaps_sim.bench.indexing.tasks import TaskKind

NOTE = (
    "A first goal is right within 0.5 m of a right place, horizontally. Queries that have no right answer stand beside "
    "those that have: another thing, room or sound in place of the one that is there. The Brier score is the mean of "
    "(probability - right)^2; those that have an answer and those that have none count alike. Its interval is "
    "bootstrapped by whole scenes. Beside it stands that of one who says for each kind of query how often it is right, "
    "and no more."
)
_DRAWS = 2000
_BINS = np.linspace(0.0, 1.0, 11)


def run_found(settings: IndexingSettings | None, out: Path) -> Any:
    """Query scenes, whose maps are those of the suite ``indexing`` in the same folder; write tables."""
    settings = settings or IndexingSettings()
    weights = settings.checked()
    todo = scene_jobs(settings, settings.recorded, settings.scenes, out / "work")
    judge = partial(judged_job, most=settings.tasks_a_scene)
    answers = [one for scene in side_by_side(judge, todo, settings.jobs, "found") for one in scene]
    answer = {
        "suite": "found",
        **provenance(settings, settings.recorded, settings.scenes, weights),
        "note": NOTE,
        "tables": {
            "found": kinds_table(answers),
            "factors": factors_table(answers),
            "reliability": reliability_table(answers),
        },
    }
    page = f"# Is found true?\n\n{in_words(answer)}\n\n{NOTE}\n\n{markdown(answer['tables'])}"
    written = write_answer(answer, out, page)
    write_bytes_atomically(out / "found_answers.json", msgspec.json.encode(answers))
    return written


def kinds_table(answers: Sequence[Judged]) -> Table:
    """Return for each kind of query its Brier score and what is reported as found, by what it truly is."""
    rows: list[list[object]] = []
    tables = {str(kind): TITLE[kind] for kind in TaskKind}
    for kind in [*sorted({one.kind for one in answers}), "all"]:
        own = [one for one in answers if kind in (one.kind, "all")]
        p, right, weight = _numbers(own)
        base = np.average(right, weights=weight)
        cells: list[object] = [
            tables.get(kind, kind),
            len(own),
            round(brier(p, right, weight), 3),
            _brier_interval(own),
            round(float(base * (1 - base)), 3),
        ]
        groups = (
            [one for one in own if one.right],
            [one for one in own if one.answerable and not one.right],
            [one for one in own if not one.answerable],
        )
        cells += map(_share_found, groups)
        rows.append(cells)
    columns = [
        "query",
        "queries",
        "Brier score",
        "95 %",
        "of the rate alone",
        "right: found",
        "wrong: found",
        "none there: found",
    ]
    return {"columns": columns, "rows": rows}


def factors_table(answers: Sequence[Judged]) -> Table:
    """Return the mean of each factor of the probability, by kind of query and by what was reported and is true."""
    rows: list[list[object]] = []
    for kind in sorted({one.kind for one in answers if one.evidence is not None and one.evidence.context}):
        groups = {
            "right, found": [one for one in answers if one.right and one.probability >= FOUND_AT],
            "right, not found": [one for one in answers if one.right and one.probability < FOUND_AT],
            "wrong, found": [one for one in answers if not one.right and one.probability >= FOUND_AT],
        }
        for name, group in groups.items():
            own = [factor_values(one.evidence) for one in group if one.kind == kind and one.evidence is not None]
            means = [[values[factor] for values in own if factor in values] for factor in FACTORS]
            rows.append([kind, name, len(own), *(round(float(np.mean(each)), 2) if each else "" for each in means)])
    return {"columns": ["query", "goals", "queries", *FACTORS], "rows": rows}


def _share_found(group: Sequence[Judged]) -> str:
    if not group:
        return ""
    found = sum(one.probability >= FOUND_AT for one in group)
    return f"{100.0 * found / len(group):.1f}% of {len(group)} ({in_percent(wilson(found, len(group)))})"


def reliability_table(answers: Sequence[Judged]) -> Table:
    """Return how often a goal is right, by its probability."""
    p = np.array([one.probability for one in answers])
    right = np.array([one.right for one in answers], float)
    rows: list[list[object]] = []
    for low, high in pairwise(_BINS.tolist()):
        own = (p >= low) & ((p < high) | (high == 1.0))
        count, hits = int(own.sum()), int(right[own].sum())
        if count:
            share = [round(float(p[own].mean()), 3), round(hits / count, 3), in_percent(wilson(hits, count))]
            rows.append([f"{low:.1f} to {high:.1f}", count, *share])
    return {"columns": ["probability", "queries", "mean of it", "right", "95 %"], "rows": rows}


def brier(
    probability: Float[np.ndarray, " n"], right: Float[np.ndarray, " n"], weight: Float[np.ndarray, " n"] | None = None
) -> float:
    """Return the Brier score: the mean of the squared difference of probability and truth."""
    return float(np.average(np.square(probability - right), weights=weight))


def _brier_interval(answers: Sequence[Judged]) -> str:
    scenes = sorted({one.scene for one in answers})
    if len(scenes) < 2:
        return ""
    p, right, weight = _numbers(answers)
    of_scene = np.searchsorted(scenes, [one.scene for one in answers])
    error = np.bincount(of_scene, weight * np.square(p - right), len(scenes))
    whole = np.bincount(of_scene, weight, len(scenes))
    drawn = np.random.default_rng(0).integers(0, len(scenes), (_DRAWS, len(scenes)))
    low, high = np.quantile(error[drawn].sum(axis=1) / whole[drawn].sum(axis=1), [0.025, 0.975])
    return f"{low:.3f} to {high:.3f}"


def _numbers(
    answers: Sequence[Judged],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    key = [(one.kind, one.answerable) for one in answers]
    return (
        np.array([one.probability for one in answers]),
        np.array([one.right for one in answers], float),
        np.array([1.0 / key.count(one) for one in key]),
    )
