"""The commonest command, ``avlmaps query MAP WORDS``, without the parser of the command line.

Loading the parser takes longer than the answer to one question about one thing. All else takes the usual path.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from avlmaps.cli.output import emit, query_lines


@dataclass(frozen=True, kw_only=True)
class PlainQuery:
    """The fields of ``Query`` that a plain command line gives."""

    map: Path
    sentence: str
    top: int = 3
    json: bool = False

    compiles: ClassVar[bool] = False

    def run(self) -> None:
        """Answer the query."""
        from avlmaps.cli.asking import answered
        from avlmaps.query.avlmap import AVLMap

        answer = answered(lambda: AVLMap.open(self.map), self.sentence, self.top, once=True)
        emit(answer, query_lines(answer), self.json)


def read_plain_query(words: Sequence[str]) -> PlainQuery | None:
    """Return the query of a command line that holds a map, a sentence, ``--json`` and ``--top N`` only, else None."""
    if not words or words[0] != "query":
        return None
    places: list[str] = []
    options: dict[str, Any] = {}
    rest = iter(words[1:])
    for word in rest:
        if word == "--json" and "json" not in options:
            options["json"] = True
        elif word == "--top" and "top" not in options and re.fullmatch("[1-9][0-9]{0,5}", number := next(rest, "")):
            options["top"] = int(number)
        elif word.startswith("-") or not word.strip():
            return None
        else:
            places.append(word)
    return PlainQuery(map=Path(places[0]), sentence=places[1], **options) if len(places) == 2 else None
