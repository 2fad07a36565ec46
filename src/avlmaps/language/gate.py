"""Whether a sentence is an order, to the robot, now: decided before anything that could move it.

`gate.toml` has a row for each plain case ("cancel ...", "my brother went ..."). Of the others a small network says how
likely one is no order: four layers of a model of English, fitted to such sentences (`training/language/gate`). Asking
back costs a second and a drive costs more, so the limit is below one half.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from avlmaps.language.learned.english import english
from avlmaps.language.lexer import tokenise
from avlmaps.language.sentence import rewritten
from avlmaps.language.word_classes import filled, table, words_of

_ORDER = "order"
_QUOTE = re.compile(r"""(?<=[\w,]) ["'“‘](?=\w)""")
UNSURE = "unsure"  # the network says so, and no row


@dataclass(frozen=True, slots=True)
class NoOrder:
    """A sentence that may be no order."""

    kind: str  # of its row, or `UNSURE`
    answer: str  # a sentence that says why
    refuses: bool = False  # offers nothing to choose: a quoted order is nobody's


def no_order(text: str) -> NoOrder | None:
    """Return why a sentence may be no order, to the robot, now; None where it is one."""
    # What is said of the robot ("send the rover to the door") is judged as if it were said to it.
    forms = (text, _QUOTE.sub(": ", text), rewritten(text, only_robot=True)[0])
    said, quoted, ordered = (" ".join(token.text for token in tokenise(form)) for form in forms)
    for kind, rows in _rows().items():
        if kind != _ORDER and any(row.search(quoted) for row in rows):
            return NoOrder(kind, table("gate")[kind]["answer"], "refuses" in table("gate")[kind])
    if any(row.search(ordered) for row in _rows()[_ORDER]):
        return None
    unsure = english().no_order(text if ordered == said else ordered) > english().limit
    return NoOrder(UNSURE, "Is this an order, to me, now?") if unsure else None


@cache
def _rows() -> Mapping[str, Sequence[re.Pattern[str]]]:
    words, kinds = words_of("gate"), table("gate").items()
    return {kind: [re.compile(filled(row, words)) for row in of["rows"]] for kind, of in kinds if "rows" in of}
