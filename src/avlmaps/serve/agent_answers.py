"""Answers small enough for an agent: rounded, without what it cannot use, and cut where they are still too long.

A token is counted as a run of up to nine letters with the space before it, a run of up to three digits, or one or two
other signs. That is a little more than tokenizers of language models count (cl100k_base: see the tests' figures).
"""

import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

import msgspec
import numpy as np

MOST_TOKENS = 800
"""Of one answer, unless its client wants more."""
_TOKEN = re.compile(r" ?[A-Za-z]{1,9}|\d{1,3}|[^\sA-Za-z\d]{1,2}")
_DECIMALS = 2
_EXACT = {"world_from_camera": 4}  # decimals of a pose: 0.01 in a rotation is half a degree
# What speaks of machines, or of how an answer is drawn.
_LEFT_OUT = frozenset({"level_from_recording", "elapsed_ms", "color", "voxels", "hits", "clip", "intrinsics", "views"})
_LEFT_OUT_KEY, _CUT = "left_out", " ..."


def token_count(text: str) -> int:
    """Return the number of tokens of a text; see the head of this file."""
    return len(_TOKEN.findall(text))


def compact(answer: Any, decimals: int = _DECIMALS, left_out: frozenset[str] = _LEFT_OUT) -> Any:
    """Return JSON with numbers rounded and without keys that are empty, or of no use to an agent."""
    if isinstance(answer, float):
        rounded = round(answer, decimals)
        return int(rounded) if rounded == int(rounded) else rounded
    if isinstance(answer, Mapping):
        kept = {
            str(key): compact(value, _EXACT.get(str(key), decimals), left_out)
            for key, value in answer.items()
            if key not in left_out
        }
        return {key: value for key, value in kept.items() if value is not None and value not in ("", {})}
    return [compact(value, decimals, left_out) for value in answer] if isinstance(answer, list | tuple) else answer


def fitting(answer: dict[str, Any], most: int = MOST_TOKENS) -> dict[str, Any]:
    """Return an answer of at most some tokens; ``left_out`` says how many entries of which lists are missing.

    The longest list loses its end, wherever it stands in the answer; a path loses places between its ends, and where
    no list is left the longest text is cut.
    """
    answer = deepcopy(answer)
    gone: dict[str, int] = {}
    while _size(answer) > most:
        key, rows = max(_lists(answer), key=lambda one: _size(one[1]), default=("", []))
        if not rows:
            break
        cut = max(1, len(rows) // 8)
        if key.rpartition(".")[2] == "path":
            kept = np.unique(np.linspace(0, len(rows) - 1, len(rows) - cut).round().astype(int))
            rows[:] = [rows[at] for at in kept.tolist()]
        else:
            del rows[-cut:]
        gone[key] = gone.get(key, 0) + cut
        answer[_LEFT_OUT_KEY] = gone
    while _size(answer) > most:
        where, key = max(_texts(answer), key=lambda one: len(one[0][one[1]]))
        where[key] = where[key][: len(where[key]) * 3 // 4].removesuffix(_CUT) + _CUT
    return answer


def _lists(answer: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, list[Any]]]:
    """Yield the lists of an answer that can lose an entry, with their keys: ``last.lines``."""
    for key, value in answer.items():
        if isinstance(value, dict):
            yield from _lists(value, f"{path}{key}.")
        elif isinstance(value, list) and len(value) > (2 if key == "path" else 1):
            yield f"{path}{key}", value


def _texts(answer: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield where the texts of an answer stand."""
    for key, value in answer.items():
        rows = value if isinstance(value, list) else [value]
        for one in rows:
            if isinstance(one, dict):
                yield from _texts(one)
        if isinstance(value, str):
            yield answer, key


def _size(value: Any) -> int:
    return token_count(msgspec.json.encode(value).decode())
