"""How many queries of a list find their label first, or among the first five."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from training.words.phrases import HELDOUT, read_queries

Encode = Callable[[Sequence[str]], np.ndarray]


def ranked(encode: Encode, path: Path) -> dict[str, tuple[int, int, int]]:
    """Return, for each kind and for ``all``, (right first, right among five, queries).

    Every query is ranked against the labels of all kinds at once.
    """
    queries = read_queries(path)
    labels = sorted({row.label for row in read_queries(HELDOUT)})
    right = np.array([labels.index(row.label) for row in queries])
    order = np.argsort(-(encode([row.query for row in queries]) @ encode(labels).T), axis=1, kind="stable")
    place = np.argmax(order == right[:, None], axis=1)
    found = {}
    for kind in ("object", "room", "sound", "all"):
        these = place[[kind in ("all", row.kind) for row in queries]]
        found[kind] = (int((these == 0).sum()), int((these < 5).sum()), len(these))
    return found
