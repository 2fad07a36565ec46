"""The known name that a misspelt one probably means."""

from collections.abc import Iterable
from difflib import get_close_matches

_MOST_COMPARED = 200


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is spelt most like one, if any comes close."""
    close = get_close_matches(name[:100], list(known)[:_MOST_COMPARED], n=1)
    return close[0] if close else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence about an unknown name: ``; did you mean chair?``, or a full stop."""
    close = nearest(name, known)
    return f"; did you mean {close}?" if close else "."
