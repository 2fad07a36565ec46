"""The known name that a misspelt one probably means."""

from collections.abc import Callable, Iterable
from difflib import get_close_matches
from itertools import islice
from pathlib import Path

_MOST_COMPARED = 200


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is spelt most like one, if any comes close."""
    close = get_close_matches(name[:100], list(known)[:_MOST_COMPARED], n=1)
    return close[0] if close else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence about an unknown name: ``; did you mean chair?``, or a full stop."""
    close = nearest(name, known)
    return f"; did you mean {close}?" if close else "."


def near_path(path: Path, fits: Callable[[Path], bool] = lambda _: True) -> Path | None:
    """Return what lies beside a path that is not there and is spelt most like it, if any comes close."""
    try:
        beside = [one.name for one in islice(path.parent.iterdir(), _MOST_COMPARED) if fits(one)]
    except OSError:
        return None
    names = {name.casefold(): name for name in beside if name != path.name}
    close = nearest(path.name.casefold(), names)
    return path.with_name(names[close]) if close else None
