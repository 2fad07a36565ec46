"""A file of exchanges with a model, so that a run can be repeated without it.

Each line is one exchange, written whole at once and forced to the disk, so that a kill loses at most the line that is
being written; such a torn last line is not read. Neither a key nor the address of the server is in it.
"""

import hashlib
import os
from pathlib import Path

import msgspec

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.answer import ModelReply, quoted


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

    fingerprint: str
    model: str
    asked: str
    answer: ModelReply


class Replay:
    """The exchanges of one file. A request that was made several times is answered in the recorded order.

    Attributes:
        path: the file.
        recording: whether exchanges are added to it instead of read from it.
    """

    def __init__(self, path: Path) -> None:
        """Open a file that is there, or begin one that is not.

        Raises:
            LanguageError: the file or its folder cannot be read, or it is no file of exchanges.
        """
        self.path, self.recording = path, path.parent.is_dir() and not path.exists()
        self._used: dict[str, int] = {}
        self._lines: list[_Line] = []
        if self.recording:
            return
        try:
            raw = path.read_bytes()
        except OSError as fault:
            raise LanguageError(f"The replay file {path} cannot be opened ({fault.strerror}); give another.") from None
        whole = raw[: raw.rfind(b"\n") + 1]  # a line without its end was being written when the machine stopped
        for number, text in enumerate(whole.splitlines(), 1):
            try:
                self._lines.append(msgspec.json.decode(text, type=_Line))
            except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
                raise LanguageError(
                    f"Line {number} of the replay file {path} is not a recorded exchange; delete the file to record it "
                    "again."
                ) from None

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
                f"The replay file {self.path} holds no answer to this request: {self._difference(request)}; delete the "
                "file to record it again."
            )
        turn = self._used.get(fingerprint, 0)
        self._used[fingerprint] = turn + 1
        return answers[min(turn, len(answers) - 1)]

    def add(self, request: ChatRequest, answer: ModelReply) -> None:
        """Write one exchange at the end of the file.

        Raises:
            LanguageError: it cannot be written.
        """
        line = _Line(request.fingerprint, request.model, request.messages[-1].content, answer)
        try:
            # One write to a file that is only appended to: lines of two programs at once are never mixed up.
            with self.path.open("ab", buffering=0) as file:
                file.write(msgspec.json.encode(line) + b"\n")
                os.fsync(file.fileno())
        except OSError as fault:
            raise LanguageError(f"The replay file {self.path} cannot be written ({fault.strerror}).") from None

    def _difference(self, request: ChatRequest) -> str:
        asked = request.messages[-1].content
        models = {line.model for line in self._lines if line.asked == asked}
        if not self._lines:
            return "the file is empty"
        if not models:
            return f"nothing like {quoted(asked, 120)} was requested when it was recorded"
        if request.model not in models:
            return f"it was recorded with the model {max(models)!r}, not {request.model!r}"
        return "the prompt, the conversation, the temperature, the seed or the most tokens have changed since"
