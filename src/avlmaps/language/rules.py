"""Deprecated: `RulesTranslator` is `LearnedTranslator` of `avlmaps.language.learned_translator`."""

import warnings
from typing import Any

from avlmaps.language import learned_translator

_RENAMED = {"RulesTranslator": "LearnedTranslator"}


def __getattr__(name: str) -> Any:
    """Return what the other module has, with a warning.

    Raises:
        AttributeError: neither has it.
    """
    new = _RENAMED.get(name, name)
    if name.startswith("_") or not hasattr(learned_translator, new):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(
        f"avlmaps.language.rules.{name} is avlmaps.language.learned_translator.{new} now.",
        DeprecationWarning,
        stacklevel=2,
    )
    return getattr(learned_translator, new)
