"""How often the embedded text encoder puts the right label first, on phrases that were written before it was trained.

The list is ``data/words_heldout.csv``: every query is ranked against the labels of all kinds at once.
"""

import csv
from collections.abc import Sequence
from importlib.resources import files
from time import thread_time

import numpy as np

from avlmaps.perception.embedded.words import EmbeddedWords
from avlmaps_sim.bench.harness.figures import wilson

_FIVE = 5
# training/words/teacher_figures.json, of the day in it: all-MiniLM-L6-v2 in float32 on the same list, (first, among
# five); the base install cannot run it, so the counts are stored here and a test holds them to the file.
TEACHER = {"object": (116, 150), "room": (24, 37), "sound": (96, 124), "all": (236, 311)}


def heldout() -> list[tuple[str, str, str]]:
    """Return the rows (query, label, kind) of the held-out list."""
    text = files("avlmaps_sim.bench").joinpath("data/words_heldout.csv").read_text(encoding="utf-8")
    return [(row["query"], row["label"], row["kind"]) for row in csv.DictReader(text.splitlines())]


def places(encoder: EmbeddedWords, rows: Sequence[tuple[str, str, str]]) -> np.ndarray:
    """Return for each row how many labels came before the right one."""
    labels = sorted({label for _, label, _ in rows})
    cosines = encoder.encode([query for query, _, _ in rows]) @ encoder.encode(labels).T
    order = np.argsort(-cosines, axis=1, kind="stable")
    right = np.array([labels.index(label) for _, label, _ in rows])
    return np.argmax(order == right[:, None], axis=1)


def _milliseconds_a_phrase(encoder: EmbeddedWords, phrases: Sequence[str]) -> float:
    spent = []
    for turn in range(5):
        fresh = [f"{phrase} {number} {turn}" for number, phrase in enumerate(phrases)]
        start = thread_time()
        encoder.encode(fresh)
        spent.append((thread_time() - start) * 1e3 / len(fresh))
    return min(spent)


def _share(hits: int, count: int) -> str:
    low, high = wilson(hits, count)
    return f"{hits}/{count} = {hits / count:.3f} [{low:.3f}, {high:.3f}]"


def run() -> dict[str, list]:
    """Return the table ``{"columns", "rows"}``: ours and the teacher's, for each kind of query, with 95 % intervals."""
    encoder, rows = EmbeddedWords(), heldout()
    place = places(encoder, rows)
    spent = f"{_milliseconds_a_phrase(encoder, [query for query, _, _ in rows]):.3f}"
    table = []
    for kind, (teacher_first, teacher_five) in TEACHER.items():
        these = place[[kind in ("all", row[2]) for row in rows]]
        count, first, five = len(these), int((these == 0).sum()), int((these < _FIVE).sum())
        table.append([kind, encoder.card.id, _share(first, count), _share(five, count), spent])
        table.append([kind, "teacher", _share(teacher_first, count), _share(teacher_five, count), ""])
    return {"columns": ["queries", "encoder", "first", "among five", "CPU ms a phrase"], "rows": table}
