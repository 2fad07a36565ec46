"""Errors of requests, their HTTP status, and sentences without a path of this machine."""

import re
from collections.abc import Iterable
from pathlib import Path

from avlmaps.core.errors import AvlmapsError, LanguageError, NavigationError, NoFloorError, QueryError
from avlmaps.core.files import user_path
from avlmaps.core.printable import printable
from avlmaps.query.asking import AskError
from avlmaps.query.schema import ErrorAnswer

_STATUS = {"map": 503}  # of a backend that is missing none: no retry helps, and other queries are answered
_ABSOLUTE = re.compile(r"(?<![\w.:/~<>-])(?:/[\w.@+~-]+){2,}|\b[A-Za-z]:\\[^\s]+|\\\\[^\s]+")
_GENERAL = "The server cannot read one of its files; its log names the file."


class RequestError(AvlmapsError):
    """A request that is refused.

    Attributes:
        status: HTTP status.
        kind: word for programs.
        headers: further headers of the response.
    """

    def __init__(self, message: str, status: int = 400, kind: str = "usage", **headers: str) -> None:
        super().__init__(message)
        self.status = status
        self.kind = kind
        self.headers = {name.replace("_", "-"): value for name, value in headers.items()}


def without_folders(text: str) -> str:
    """Return a text in which each absolute path is the name of its file alone."""
    return _ABSOLUTE.sub(lambda found: re.split(r"[/\\\\]", found.group())[-1], text)


def busy(waiting: int) -> RequestError:
    """Return the error of a full queue."""
    return RequestError(
        f"The server has {waiting} queries waiting; send this one again in a second.", 503, "busy", Retry_After="1"
    )


def too_slow(seconds: float) -> RequestError:
    """Return the error of a query that took too long."""
    return RequestError(f"The answer took longer than {seconds:g} s; send a simpler query.", 504, "timeout")


class Privacy:
    """Takes this machine's paths out of sentences."""

    def __init__(self, names: Iterable[tuple[Path, str]]) -> None:
        """Remember the folders that may be named."""
        spellings: dict[str, str] = {}
        for path, name in names:
            for spelling in (str(path), str(user_path(path).absolute()), str(user_path(path).resolve())):
                spellings[spelling] = name
        self._spellings = sorted(spellings.items(), key=lambda pair: -len(pair[0]))

    def cleaned(self, sentence: str) -> str:
        """Return a sentence of ours with public names; a general one where a path is left."""
        for spelling, name in self._spellings:
            sentence = sentence.replace(spelling, name)
        return _GENERAL if _ABSOLUTE.search(sentence) else sentence

    def described(self, error: BaseException) -> tuple[int, ErrorAnswer]:
        """Return the HTTP status and the JSON of an error."""
        if isinstance(error, RequestError):
            return error.status, _answer(error.kind, str(error))
        if isinstance(error, AskError):
            return 400, _answer("usage", str(error))
        if isinstance(error, NoFloorError):  # the map is whole, and no retry helps
            return 422, _answer("map", str(error))
        if isinstance(error, AvlmapsError):
            kind = _kind(error)
            # These quote nothing but the client's own words, which may look like a path; others may quote a file.
            ours = not isinstance(error, QueryError | LanguageError | NavigationError)
            message = self.cleaned(str(error)) if ours else str(error)
            return _STATUS.get(kind, 422), _answer(kind, message)
        if isinstance(error, OSError | MemoryError):
            what = "memory" if isinstance(error, MemoryError) else error.strerror or "a file"
            return 503, _answer("system", f"The server lacks what this needs ({printable(what)}); its log says more.")
        return 500, _answer(
            "internal", "This is a fault of avlmaps; the server's log has the details. Please report it."
        )


def _kind(error: AvlmapsError) -> str:
    return "-".join(re.findall("[A-Z][a-z]*", type(error).__name__.removesuffix("Error"))).lower()


def _answer(kind: str, message: str) -> ErrorAnswer:
    return {"error": {"kind": kind, "message": message}}
