"""``python -m training.found``: fit the weights; ``--collect`` first queries maps of the development homes again."""

import argparse
import json
from pathlib import Path

import numpy as np
from training.found.fit import fitted, held_out
from training.found.rows import Row, balanced, read_rows, write_rows

import avlmaps.query
from avlmaps.query.factors import FOUND_AT
from avlmaps_sim.bench.found.answers import judged_scene
from avlmaps_sim.bench.found.suite import brier
from avlmaps_sim.bench.indexing import IndexingSettings

SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_200_000, 1_200_014))
WEIGHTS = Path(avlmaps.query.__path__[0]) / "found.json"


def main() -> None:
    """Fit the weights, print how good they are on homes left out, and write them into the package."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--collect", type=Path, metavar="WORK", help="record, map and query the homes in this folder")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--limits", action="store_true", help="compare limits by the thing alone, and write nothing")
    given = parser.parse_args()
    if given.limits:
        compare_limits(read_rows())
        return
    if given.collect is not None:
        settings = IndexingSettings(scenes=tuple(given.scenes), jobs=1)
        answers = [one for spec in given.scenes for one in judged_scene(settings, spec, given.collect)]
        write_rows(Row.of(one, one.evidence) for one in answers if one.evidence is not None)
    rows = read_rows()
    weights, probability, weight = fitted(rows), held_out(rows), balanced(rows)
    right = np.array([row.right for row in rows], float)
    for kind in sorted({row.kind for row in rows}):
        own = np.array([row.kind == kind for row in rows])
        print(f"{kind:15} {own.sum():4} queries, Brier score {brier(probability[own], right[own], weight[own]):.3f}")
    homes = sorted({row.scene for row in rows})
    WEIGHTS.write_text(json.dumps({"homes": homes, "weights": weights}, indent=1) + "\n", encoding="utf-8")


def compare_limits(rows: list[Row]) -> None:
    """Print what limits of the odds do, on homes left out: queries of several parts."""
    rows = [row for row in rows if row.evidence.context]
    right, weight = np.array([row.right for row in rows]), balanced(rows)
    answerable = np.array([row.answerable for row in rows])
    for most_odds in (1e9, 2.5, 2.0, 1.75, 1.5, 1.0):
        p = held_out(rows, most_odds)
        held = np.clip(p, 5e-4, 1.0 - 5e-4)  # probabilities have three digits
        loss = -np.average(np.where(right, np.log(held), np.log1p(-held)), weights=weight)
        found = [int((p[own] >= FOUND_AT).sum()) for own in (right, answerable & ~right, ~answerable)]
        print(f"{most_odds:g}: Brier score {brier(p, right, weight):.4f}, log loss {loss:.4f}, found {found}")


if __name__ == "__main__":
    main()
