"""Whether a sentence is an order, to the robot, now: decided before anything that could move it.

`gate.toml` has a row for each plain case ("cancel ...", "my brother went ..."). Of the others a small network says how
likely one is no order: three layers of a model of English, fitted to such sentences (`training/language/gate`). Asking
back costs a second and a drive costs more, so the limit is below one half.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from avlmaps.core.errors import BackendError
from avlmaps.language.lexer import tokenise
from avlmaps.language.sentence import rewritten
from avlmaps.language.word_classes import filled, table, words_of
from avlmaps.perception.embedded.words import WordPieces
from avlmaps.perception.networks import open_network

_ORDER = "order"
_UNSURE = "unsure"
_UNSURE_ANSWER = "Is this an order, to me, now?"
_MOST_PIECES = 64
_WORD = re.compile(r"[a-z]+|\d+|[^\w\s]")


@dataclass(frozen=True, slots=True)
class NoOrder:
    """A sentence that may be no order: the kind of its row, or ``unsure``, and a sentence that says why."""

    kind: str
    answer: str

    @property
    def is_unsure(self) -> bool:
        """Whether the network says so, and no row."""
        return self.kind == _UNSURE


def no_order(text: str) -> NoOrder | None:
    """Return why a sentence may be no order, to the robot, now; None where it is one."""
    said = " ".join(token.text for token in tokenise(text))
    # What is said of the robot ("send the rover to the door") is judged as if it were said to it.
    ordered = " ".join(token.text for token in tokenise(rewritten(text, only_robot=True)[0]))
    closed = (kind for kind, rows in _rows().items() if kind != _ORDER and any(row.search(said) for row in rows))
    kind = next(closed, None)
    if kind is not None:
        return NoOrder(kind, table("gate")[kind]["answer"])
    if any(row.search(ordered) for row in _rows()[_ORDER]):
        return None
    unsure = _judge().probability(text if ordered == said else ordered) > _judge().limit
    return NoOrder(_UNSURE, _UNSURE_ANSWER) if unsure else None


@cache
def _rows() -> Mapping[str, Sequence[re.Pattern[str]]]:
    words, kinds = words_of("gate"), table("gate").items()
    return {kind: [re.compile(filled(row, words)) for row in of["rows"]] for kind, of in kinds if "rows" in of}


class _Judge:
    """The network that says how likely a sentence is no order.

    Attributes:
        limit: from this probability on, a person is asked.
    """

    def __init__(self) -> None:
        folder = files("avlmaps.language.learned").joinpath("weights")
        try:
            facts = json.loads(folder.joinpath("gate.json").read_text(encoding="utf-8"))
            self._network = open_network(folder.joinpath("gate.onnx").read_bytes())
        except (OSError, ValueError) as fault:
            raise BackendError(f"The gate of commands lacks its files ({fault}); install the package again.") from fault
        self._pieces, self.limit = WordPieces(facts["pieces"]), float(facts["limit"])

    def probability(self, text: str) -> float:
        """Return how likely a sentence is no order; pictures in it say nothing."""
        rows = self._pieces.rows
        plain = text.lower().replace("’", "'").encode("ascii", "ignore").decode()
        found = [row for word in _WORD.findall(plain) for row in self._pieces.rows_of_word(word) or [rows["[UNK]"]]]
        if not found:
            return 0.0
        line = np.array([[rows["[CLS]"], *found[:_MOST_PIECES], rows["[SEP]"]]], np.int64)
        (logit,) = self._network.run(None, {"pieces": line})
        return float(1.0 / (1.0 + np.exp(-logit[0])))


@cache
def _judge() -> _Judge:
    return _Judge()
