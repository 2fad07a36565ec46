"""The registry of backends: names to places in the code, imported when first used.

Other packages add theirs through the entry point group ``avlmaps.backends``; an entry's name is
``kind:name`` (``sounds:my-clap``) and its value ``package.module:Class``. The class is called without
arguments.
"""

import importlib
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import Any

from avlmaps.core.errors import BackendError

ENTRY_POINT_GROUP = "avlmaps.backends"


class Kind(StrEnum):
    """The modules of the system that a model can stand behind."""

    WORDS = "words"
    PIXELS = "pixels"
    VIEWS = "views"
    SOUNDS = "sounds"
    LOCAL = "local"
    PLACE = "place"
    MATCHER = "matcher"


@dataclass(frozen=True, slots=True)
class Backend:
    """One entry of the registry.

    Attributes:
        kind: which module it serves.
        name: its name in a profile.
        target: ``package.module:Class``.
        extra: the optional install that it needs, or ``""``.
        needs: top-level packages that must be importable.
    """

    kind: Kind
    name: str
    target: str
    extra: str = ""
    needs: tuple[str, ...] = ()

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that it needs and that are not installed."""
        return tuple(package for package in self.needs if find_spec(package) is None)

    @property
    def how_to_get(self) -> str:
        """The command that installs what is missing."""
        return f"pip install 'avlmaps[{self.extra}]'" if self.extra else f"pip install {' '.join(self.missing)}"


_EMBEDDED = "avlmaps.perception.embedded"
_BUILT_IN = (
    Backend(Kind.WORDS, "embedded", f"{_EMBEDDED}.words:EmbeddedWords"),
    Backend(Kind.PIXELS, "colours", f"{_EMBEDDED}.colours:ColourWords"),
    Backend(Kind.PIXELS, "embedded", f"{_EMBEDDED}.pixels:EmbeddedPixels"),
    Backend(Kind.VIEWS, "embedded", f"{_EMBEDDED}.views:EmbeddedViews"),
    Backend(Kind.SOUNDS, "embedded", f"{_EMBEDDED}.sounds:EmbeddedSounds"),
    Backend(Kind.LOCAL, "rootsift", f"{_EMBEDDED}.rootsift:RootSift"),
    Backend(Kind.PLACE, "vlad", f"{_EMBEDDED}.vlad:Vlad"),
    Backend(Kind.MATCHER, "mutual-ratio", f"{_EMBEDDED}.matching:MutualRatio"),
)
_registered: dict[tuple[Kind, str], Backend] = {(b.kind, b.name): b for b in _BUILT_IN}


def register(backend: Backend) -> None:
    """Add a backend for this process (a notebook's, a test's); the entry point is the way for packages."""
    _registered[backend.kind, backend.name] = backend
    _load.cache_clear()


def backends() -> list[Backend]:
    """Return every backend that is known, built in, registered or brought by another package."""
    found = dict(_registered)
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        kind, _, name = entry.name.partition(":")
        if kind in set(Kind) and name:
            found.setdefault((Kind(kind), name), Backend(Kind(kind), name, entry.value))
    return sorted(found.values(), key=lambda b: (b.kind, b.name))


def load(kind: Kind, name: str) -> Any:
    """Return the backend of that kind and name, made once in a process.

    Raises:
        BackendError: there is none of that name, a package that it needs is missing, or it cannot be imported.
    """
    return _load(kind, name)


@cache
def _load(kind: Kind, name: str) -> Any:
    known = {b.name: b for b in backends() if b.kind == kind}
    if name not in known:
        raise BackendError(
            f"There is no {kind} backend called {name!r}; known are: {', '.join(sorted(known)) or 'none'}."
        )
    backend = known[name]
    if backend.missing:
        missing = ", ".join(backend.missing)
        raise BackendError(f"The {kind} backend {name!r} needs {missing}; get it with: {backend.how_to_get}")
    module, _, attribute = backend.target.partition(":")
    try:
        made = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as fault:
        raise BackendError(
            f"The {kind} backend {name!r} cannot be loaded from {backend.target} ({fault}); mend or remove the package "
            "that brings it."
        ) from fault
    return made()
