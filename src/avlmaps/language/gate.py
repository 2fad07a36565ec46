"""Whether a sentence is an order, to the robot, now: decided before anything that could move it.

`gate.toml` has a row for each plain case ("cancel ...", "my brother went ..."). Asking back costs a second, and a drive
costs more.
"""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from avlmaps.language.lexer import tokenise


@dataclass(frozen=True, slots=True)
class NoOrder:
    """A sentence that may be no order.

    Attributes:
        kind: the kind of its row: ``cancelled``, ``postponed``, ``asked``, ``reported``, ``other`` (said to somebody
            else), ``wished``, ``sarcastic`` or ``crossed``.
        answer: one sentence that says why nothing is driven.
    """

    kind: str
    answer: str


@dataclass(frozen=True, slots=True)
class _Row:
    kind: str
    answer: str
    says: re.Pattern[str]


def no_order(text: str) -> NoOrder | None:
    """Return why a sentence may be no order, to the robot, now; None where it is one."""
    said = " ".join(token.text for token in tokenise(text))
    for row in _rows():
        if row.says.search(said):
            return NoOrder(row.kind, row.answer)
    return None


@cache
def _rows() -> Sequence[_Row]:
    book = tomllib.loads(files("avlmaps.language").joinpath("gate.toml").read_text(encoding="utf-8"))
    words = book.pop("words")
    for name in words:  # a row may use those before it
        for other, said in words.items():
            words[other] = said.replace(f"{{{name}}}", words[name]) if other != name else said

    def compiled(row: str) -> re.Pattern[str]:
        for name, said in words.items():
            row = row.replace(f"{{{name}}}", said)
        return re.compile(row)

    return [_Row(kind, of["answer"], compiled(row)) for kind, of in book.items() for row in of["rows"]]
