"""Layers of a model of English, as the gate and the reader take them.

They are the first of all-MiniLM-L6-v2, fitted to tell orders from what is no order (`training/language/gate`). The
reader takes the state of each word in its sentence behind three layers, the gate the verdict of a fourth.
"""

import json
import re
from collections.abc import Sequence
from functools import cache, lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.errors import BackendError
from avlmaps.perception.embedded.words import WordPieces
from avlmaps.perception.networks import open_network

WEIGHTS = files("avlmaps.language.learned").joinpath("weights")
WIDTH = 384  # numbers of a state
_MOST_PIECES = 78
_WORD = re.compile(r"[a-z]+|\d+|[^\w\s]")


def loaded(folder: Traversable, what: str, facts: str, graphs: Sequence[str], end: str = "") -> tuple[Any, list[bytes]]:
    """Return the facts and the graphs of some networks; raises BackendError where a file is missing or is none."""
    try:
        read = [folder.joinpath(f"{name}.onnx").read_bytes() for name in graphs]
        return json.loads(folder.joinpath(f"{facts}.json").read_text(encoding="utf-8")), read
    except (OSError, ValueError) as fault:
        raise BackendError(f"{what} lacks its files ({fault}); install the package again{end}.") from fault


class English:
    """The layers, and the gate's ``limit``: from this probability of being no order on, a person is asked."""

    def __init__(self) -> None:
        facts, graphs = loaded(WEIGHTS, "The gate of commands", "gate", ("gate", "order"))
        self._pieces, self.limit = WordPieces(facts["pieces"]), float(facts["limit"])
        self._layers, self._order = map(open_network, graphs)
        self._run = lru_cache(maxsize=64)(self._states_of)  # the gate and the reader often ask for one line

    def no_order(self, text: str) -> float:
        """Return how likely a sentence is no order; pictures in it say nothing."""
        if not self._rows(text):
            return 0.0
        logit = np.asarray(self._order.run(None, {"states": self.sentence(text)[None]})[0])
        return float(1.0 / (1.0 + np.exp(-logit[0])))

    def sentence(self, text: str) -> Float32[np.ndarray, "n 384"]:
        """Return the states of a sentence's pieces, of its begin and of its end."""
        return self._run(tuple(self._rows(text)[:_MOST_PIECES]))

    def states(self, words: Sequence[str]) -> Float32[np.ndarray, "n 384"]:
        """Return the state of each word in its sentence, the mean of its pieces'; 0 for words beyond the last piece."""
        each = [self._rows(word) or [self._pieces.rows["[UNK]"]] for word in words]
        owners = np.repeat(np.arange(len(each)), [len(rows) for rows in each])[:_MOST_PIECES]
        found = [row for rows in each for row in rows][:_MOST_PIECES]
        states = np.zeros((len(words), WIDTH), np.float32)
        np.add.at(states, owners, self._run(tuple(found))[1:-1])
        return states / np.maximum(np.bincount(owners, minlength=len(words)), 1)[:, None].astype(np.float32)

    def _rows(self, text: str) -> list[int]:
        plain = text.lower().replace("’", "'").encode("ascii", "ignore").decode()
        unknown = [self._pieces.rows["[UNK]"]]
        return [row for word in _WORD.findall(plain) for row in self._pieces.rows_of_word(word) or unknown]

    def _states_of(self, found: tuple[int, ...]) -> Float32[np.ndarray, "n 384"]:
        rows = self._pieces.rows
        line = np.array([[rows["[CLS]"], *found, rows["[SEP]"]]], np.int64)
        return np.asarray(self._layers.run(["states"], {"pieces": line})[0])[0]


@cache
def english() -> English:
    """Return the layers that ship; they are loaded at the first call."""
    return English()
