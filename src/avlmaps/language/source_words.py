"""Whether a sentence asks where a sound came from, and not where somebody heard it."""

import re

_ORIGIN = re.compile(
    r"\b(?:come|comes|came|coming|originat(?:e|es|ed|ing)) from\b|\bfrom where\b|\bsources? of\b|"
    r"\b(?:where|what|which \w+)\b.*\bfrom\W*$|\b(?:what|who) (?:is |was )?(?:made|makes|making|causes|caused)\b"
)


def asks_for_source(text: str) -> bool:
    """Return whether a sentence means the place where a sound came from: "where does the barking come from?"."""
    return _ORIGIN.search(text.lower()) is not None
