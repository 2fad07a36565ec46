"""The one family of errors that a user can meet: each is one sentence, what failed, with which numbers, and what to do.

The command line prints it without a traceback and exits 1. Mistakes of a programmer (wrong shapes, wrong types) stay
``ValueError`` and ``TypeError``.
"""

import re

from avlmaps.core.printable import printable


class AvlmapsError(Exception):
    """Base of every error that a user can cause and fix; its sentence is safe to print, including quoted text."""

    def __str__(self) -> str:
        return printable(super().__str__())


class RecordingError(AvlmapsError):
    """A recording cannot be read: a missing frame, a truncated file, a pose that is not a pose."""


class AudioError(AvlmapsError):
    """A sound or an audio track cannot be read or used."""


class NoAudioStreamError(AudioError):
    """A video has no sound, which for most videos is not a fault."""


class MapError(AvlmapsError):
    """A map cannot be built, opened or merged: another schema, another profile, a damaged file."""


class NoFloorError(MapError):
    """A map is whole, but holds too little to find a floor to drive on."""


class BackendError(AvlmapsError):
    """A model backend is unknown, not installed, or does not fit its module."""


class QueryError(AvlmapsError):
    """This map cannot answer the query: an empty phrase, an unreadable picture, a missing modality."""


class AskError(QueryError):
    """What a query is given does not fit together, or is not of its form; no map could answer it."""


class SceneError(AvlmapsError):
    """A scene cannot be read from its files: one is missing, truncated, or not what its layout says."""


class LanguageError(AvlmapsError):
    """A command cannot be turned into a program: it was not understood, or no chat model gave a usable answer."""


class ProgramError(AvlmapsError):
    """A program is refused or stopped: it is not of the allowed syntax, misuses a skill, or exceeds its budget."""


class NavigationError(AvlmapsError):
    """A robot cannot be driven: no path leads there, it is stuck, or its connection failed."""


class GoalNotFoundError(AvlmapsError):
    """The map does not hold the thing that a command names; skills raise it, and the trace records it."""


class SeveralFitError(AvlmapsError):
    """Several things fit a name equally; ``choices`` says in words where each is, the first is chosen by 1."""

    def __init__(self, message: str, choices: tuple[str, ...]) -> None:
        super().__init__(message)
        self.choices = choices


class NonConformanceError(AssertionError):
    """Something brought by a package breaks a promise; the sentence says which."""


def kind_named(error_type: str) -> str:
    """Return the kind of an error for programs, by the name of its class: ``goal-not-found``."""
    return "-".join(re.findall("[A-Z][a-z]*", error_type.removesuffix("Error"))).lower()


def hold(condition: object, promise: str) -> None:
    """Raise ``NonConformanceError`` with a promise that does not hold."""
    if not condition:
        raise NonConformanceError(promise)
