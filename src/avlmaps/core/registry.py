"""The registry of backends: names to places in the code, imported when first used.

Other packages add theirs through the entry point group ``avlmaps.backends``; an entry's name is
``kind:name`` (``sounds:my-clap``) and its value ``package.module:Class``. The class is called without
arguments. A package with many backends, or with backends that can run several models, brings a list of `Backend`
through the group ``avlmaps.backend_lists`` (``avlmaps-models`` does). A backend that can run several models is called
with the chosen one, which a name carries behind an ``@``: ``views:clip@openai/clip-vit-large-patch14``.
"""

import importlib
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.extras import how_to_get, install_command

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

ENTRY_POINT_GROUP = "avlmaps.backends"
LISTS_GROUP = "avlmaps.backend_lists"


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
    """One entry of the registry."""

    kind: Kind  # the module that it serves
    name: str
    target: str  # ``package.module:Class``
    extra: str = ""  # the optional install that it needs
    needs: tuple[str, ...] = ()  # top-level packages that must be importable
    # that it runs unless another is chosen: a hub's id or a file's name, given to its class; "" where the class takes
    # no argument
    model: str = ""
    licence: str = ""  # of that model's weights, for ``avlmaps profiles``; "" where the class alone decides it
    slow: bool = False  # features take longer to make than to store and read; those on torch always do
    # of pixels: the other frames add surfaces and colours alone, for a model that takes a second a frame
    keyframes_only: bool = False
    also: tuple[str, ...] = ()  # further models that it needs
    matcher: str = ""  # of local features: that was made for them; "" where any does
    distribution: str = "avlmaps"

    @property
    def is_slow(self) -> bool:
        """Whether its features are worth storing: ``slow``, or on torch."""
        return self.slow or "torch" in self.needs

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that it needs and that are not installed."""
        return tuple(package for package in self.needs if find_spec(package) is None)

    @property
    def how_to_get(self) -> str:
        """The command that installs what is missing."""
        if self.extra:
            return install_command(self.extra, distribution=self.distribution)
        return f"pip install {' '.join(self.missing)}"


_EMBEDDED = "avlmaps.perception.embedded"
_BUILT_IN = (
    Backend(Kind.WORDS, "embedded", f"{_EMBEDDED}.words:EmbeddedWords"),
    Backend(Kind.PIXELS, "colours", f"{_EMBEDDED}.colours:ColourWords"),
    Backend(Kind.PIXELS, "embedded", f"{_EMBEDDED}.pixels:EmbeddedPixels"),
    Backend(Kind.PIXELS, "embedded-synthetic", f"{_EMBEDDED}.pixels:synthetic_pixels"),
    Backend(Kind.VIEWS, "embedded", f"{_EMBEDDED}.pixels:EmbeddedViews"),
    Backend(Kind.VIEWS, "embedded-synthetic", f"{_EMBEDDED}.pixels:synthetic_views"),
    Backend(Kind.SOUNDS, "embedded", f"{_EMBEDDED}.sounds:EmbeddedSounds"),
    Backend(Kind.LOCAL, "xfeat", f"{_EMBEDDED}.keypoints:XFeat", licence="Apache-2.0", matcher="xfeat"),
    Backend(Kind.PLACE, "xfeat", f"{_EMBEDDED}.keypoints:xfeat_places"),
    Backend(Kind.MATCHER, "xfeat", f"{_EMBEDDED}.keypoints:xfeat_matcher"),
    Backend(Kind.PLACE, "vlad", f"{_EMBEDDED}.keypoints:Vlad"),
    Backend(Kind.MATCHER, "mutual-ratio", f"{_EMBEDDED}.keypoints:MutualRatio"),
)

_TRAINED = (
    Backend(Kind.PIXELS, "trained", f"{_EMBEDDED}.pixels:trained_pixels", model="eyes", licence="your own"),
    Backend(Kind.VIEWS, "trained", f"{_EMBEDDED}.pixels:trained_views", model="eyes", licence="your own"),
)
# Backends of older releases, which maps still name, and what to do.
_GONE = {"rootsift": "photos are located by better keypoints since 0.3: build the map again from its recording"}
_registered: dict[tuple[Kind, str], Backend] = {(b.kind, b.name): b for b in (*_BUILT_IN, *_TRAINED)}


def entry_points(group: str) -> "EntryPoints":
    """Return the entry points of a group; the module that finds them is loaded when a name is not built in."""
    from importlib import metadata

    return metadata.entry_points(group=group)


def brought(entry: "EntryPoint", what: str, error: type[AvlmapsError] = BackendError) -> Any:
    """Return what an entry point of another package leads to; raises ``error`` where it cannot be imported."""
    try:
        return entry.load()
    except Exception as fault:  # an import runs another's code
        raise error(
            f"{what[0].upper()}{what[1:]} {entry.name!r} cannot be loaded from {entry.value} ({fault}); fix or remove "
            "the package that brings it."
        ) from fault


def register(backend: Backend) -> None:
    """Add a backend for this process (a notebook's, a test's); packages use the entry point."""
    _registered[backend.kind, backend.name] = backend
    load.cache_clear()


def backends() -> list[Backend]:
    """Return every backend that is known, built in, registered or brought by another package."""
    found = dict(_registered)
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        kind, _, name = entry.name.partition(":")
        if kind in set(Kind) and name:
            found.setdefault((Kind(kind), name), Backend(Kind(kind), name, entry.value))
    for entry in entry_points(group=LISTS_GROUP):
        for backend in brought(entry, "the list of backends"):
            found.setdefault((backend.kind, backend.name), backend)
    return sorted(found.values(), key=lambda b: (b.kind, b.name))


def forget_loaded() -> None:
    """Let go of all backends that were made; the next ``load`` makes them again (other files, another device)."""
    load.cache_clear()


def find(kind: Kind, name: str) -> Backend:
    """Return the registry's entry of that kind and name (without ``@model``), or raise ``BackendError``."""
    if (kind, name) in _registered:  # installed packages need not be searched
        return _registered[kind, name]
    known = {b.name: b for b in backends() if b.kind == kind}
    if name not in known:
        if name in _GONE:
            raise BackendError(f"The {kind} backend {name!r} is gone; {_GONE[name]}.")
        if get := how_to_get("backends", f"{kind}:{name}"):
            raise BackendError(f"The {kind} backend {name!r} is not installed; get it with: {get}")
        raise BackendError(
            f"There is no {kind} backend called {name!r}; known are: {', '.join(sorted(known)) or 'none'}."
        )
    return known[name]


@cache
def load(kind: Kind, name: str) -> Any:
    """Return the backend of a name in a profile, made once in a process; ``name@model`` chooses one of several models.

    Raises:
        BackendError: there is none of that name, a package or the model that it needs is missing, it cannot be
            imported, or it has no models to choose from.
    """
    name, _, model = name.partition("@")
    backend = find(kind, name)
    if model and not backend.model:
        raise BackendError(f"The {kind} backend {name!r} has no models to choose from; leave @{model} out.")
    if backend.missing:
        missing = ", ".join(backend.missing)
        raise BackendError(f"The {kind} backend {name!r} needs {missing}; get it with: {backend.how_to_get}")
    module, _, attribute = backend.target.partition(":")
    try:
        made = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as fault:
        raise BackendError(
            f"The {kind} backend {name!r} cannot be loaded from {backend.target} ({fault}); fix or remove the package "
            "that brings it."
        ) from fault
    chosen = model or backend.model
    return made(chosen) if chosen else made()
