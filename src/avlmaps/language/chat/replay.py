"""A file of exchanges with a model, so that a run can be repeated without it.

Each line is one exchange, written whole at once and forced to the disk, so that a kill loses at most the line that is
being written; such a torn last line is not read. Neither a key nor the address of the server is in it.
"""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.answer import ModelReply, quoted

_VERSION = 1


class Message(msgspec.Struct, frozen=True):
    """One turn of a conversation; `role` is system, user or assistant."""

    role: str
    content: str


class ChatRequest(msgspec.Struct, frozen=True):
    """All that decides what a model answers, as far as it can be decided."""

    model: str
    messages: tuple[Message, ...]
    temperature: float | None
    seed: int | None
    max_tokens: int

    @property
    def fingerprint(self) -> str:
        """A hash of all of it."""
        return hashlib.sha256(msgspec.json.encode(self)).hexdigest()


class _Line(msgspec.Struct):
    """One exchange in a file; all but `fingerprint` and `answer` is there to be read and to explain a mismatch."""

    version: int
    fingerprint: str
    model: str
    prompt: str
    asked: str
    answer: ModelReply


@dataclass(slots=True)
class Replay:
    """The exchanges of one file. A request that was made several times is answered in the recorded order.

    Attributes:
        path: the file.
        recording: whether exchanges are added to it instead of read from it.
    """

    path: Path
    recording: bool
    _lines: list[_Line] = field(default_factory=list)
    _used: dict[str, int] = field(default_factory=dict)

    @classmethod
    def open(cls, path: Path) -> "Replay":
        """Return the exchanges of a file that is there; one that is not will be filled.

        Raises:
            LanguageError: the file or its folder cannot be read, or it is no file of exchanges.
        """
        if path.parent.is_dir() and not path.exists():
            return cls(path, recording=True)
        try:
            raw = path.read_bytes()
        except OSError as fault:
            raise LanguageError(f"The replay file {path} cannot be opened ({fault.strerror}); give another.") from None
        whole = raw[: raw.rfind(b"\n") + 1]  # a line without its end was being written when the machine stopped
        lines = [_line(path, number, text) for number, text in enumerate(whole.splitlines(), 1) if text.strip()]
        return cls(path, recording=False, _lines=lines)

    @property
    def model(self) -> str | None:
        """The model that was recorded first."""
        return self._lines[0].model if self._lines else None

    def answer(self, request: ChatRequest) -> ModelReply:
        """Return the recorded answer to this very request.

        Raises:
            LanguageError: it was never made; what differs is said.
        """
        fingerprint = request.fingerprint
        answers = [line.answer for line in self._lines if line.fingerprint == fingerprint]
        if not answers:
            raise LanguageError(
                f"The replay file {self.path} holds no answer to this request ({fingerprint[:12]}): "
                f"{self._difference(request)}; delete the file to record it again."
            )
        turn = self._used.get(fingerprint, 0)
        self._used[fingerprint] = turn + 1
        return answers[min(turn, len(answers) - 1)]

    def add(self, request: ChatRequest, answer: ModelReply) -> None:
        """Write one exchange at the end of the file.

        Raises:
            LanguageError: it cannot be written.
        """
        asked = request.messages[-1].content
        line = _Line(_VERSION, request.fingerprint, request.model, _prompt_hash(request.messages), asked, answer)
        raw = msgspec.json.encode(line) + b"\n"
        try:
            # One write to a file that is only appended to: lines of two programs at once are never mixed up.
            handle = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o644)
            try:
                written = os.write(handle, raw)
                os.fsync(handle)
            finally:
                os.close(handle)
        except OSError as fault:
            raise LanguageError(f"The replay file {self.path} cannot be written ({fault.strerror}).") from None
        if written != len(raw):
            raise LanguageError(
                f"The replay file {self.path} was cut off: the disk is full; make room and record again."
            )

    def _difference(self, request: ChatRequest) -> str:
        """Say in what the request differs from those of the file."""
        asked = request.messages[-1].content
        like = [line for line in self._lines if line.asked == asked]
        if not self._lines:
            return "the file is empty"
        if not like:
            return f"nothing like {quoted(asked, 120)} was requested when it was recorded"
        if all(line.model != request.model for line in like):
            return f"it was recorded with the model {like[-1].model!r}, not {request.model!r}"
        if all(line.prompt != _prompt_hash(request.messages) for line in like):
            return "the skills or the words of the prompt have changed since"
        return (
            "the conversation before it, or the temperature, seed or most tokens, are others than when it was recorded"
        )


def _prompt_hash(messages: Sequence[Message]) -> str:
    return hashlib.sha256(messages[0].content.encode()).hexdigest()[:16]


def _line(path: Path, number: int, text: bytes) -> _Line:
    try:
        line = msgspec.json.decode(text, type=_Line)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        raise LanguageError(
            f"Line {number} of the replay file {path} is not a recorded exchange; delete the file to record it again."
        ) from None
    if line.version != _VERSION:
        raise LanguageError(
            f"The replay file {path} has version {line.version}, not {_VERSION}; delete it to record it again."
        )
    return line
