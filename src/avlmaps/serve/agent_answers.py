"""Answers small enough for an agent: rounded, without what it cannot use, and cut where they are still too long.

A token is counted as a run of up to nine letters with the space before it, a run of up to three digits, or one or two
other signs. That is a little more than tokenizers of language models count (cl100k_base: see the tests' figures).
"""

import re
from collections.abc import Mapping
from typing import Any

import msgspec

MOST_TOKENS = 800
"""Of one answer, unless its client wants more."""
_TOKEN = re.compile(r" ?[A-Za-z]{1,9}|\d{1,3}|[^\sA-Za-z\d]{1,2}")
_DECIMALS = 2
_EXACT = {"world_from_camera": 4}  # decimals of a pose: 0.01 in a rotation is half a degree
# What speaks of machines, or of how an answer is drawn.
_LEFT_OUT = frozenset({"level_from_recording", "elapsed_ms", "color", "voxels", "hits", "clip", "intrinsics", "views"})
_LEFT_OUT_KEY = "left_out"


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
    """Return an answer of at most some tokens: the longest lists lose their ends, and ``left_out`` says how many.

    Args:
        answer: as ``compact`` makes it.
        most: tokens.
    """
    answer = dict(answer)
    while _size(answer) > most:
        lists = [key for key, value in answer.items() if isinstance(value, list) and len(value) > 1]
        if not lists:
            break
        key = max(lists, key=lambda one: _size(answer[one]))
        rows = answer[key]
        gone = max(1, len(rows) // 8)
        answer[key] = rows[:-gone]
        before = answer.get(_LEFT_OUT_KEY, {})
        answer[_LEFT_OUT_KEY] = {**before, key: before.get(key, 0) + gone}
    return answer


def _size(value: Any) -> int:
    return token_count(msgspec.json.encode(value).decode())
