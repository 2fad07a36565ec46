"""``python -m training.found``: fit the weights; ``--collect`` first queries maps of the development homes again."""

import argparse
import json
from pathlib import Path

import numpy as np
from training.found.fit import fitted, held_out
from training.found.rows import Row, balanced, read_rows, write_rows

import avlmaps.query
from avlmaps_sim.bench.found.answers import judged_scene
from avlmaps_sim.bench.found.suite import brier
from avlmaps_sim.bench.indexing.runs import IndexingSettings

SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_200_000, 1_200_014))
WEIGHTS = Path(avlmaps.query.__path__[0]) / "found.json"


def main() -> None:
    """Fit the weights, print how good they are on homes left out, and write them into the package."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--collect", type=Path, metavar="WORK", help="record, map and query the homes in this folder")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    given = parser.parse_args()
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


if __name__ == "__main__":
    main()
