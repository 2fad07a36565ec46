"""The prompt of `avlmaps shell`, with its history; needs prompt-toolkit."""

import signal
from pathlib import Path

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import Completer
from prompt_toolkit.history import FileHistory, InMemoryHistory
from prompt_toolkit.output import create_output

from avlmaps.cli.shell_lines import YES, checked
from avlmaps.core.files import state_file
from avlmaps.core.progress import say

_MOST_HISTORY_BYTES = 1_000_000


class PromptLines:
    """Lines that a person types, with history and completion."""

    interactive = True

    def __init__(self, completer: Completer, with_history: bool = True) -> None:
        output = create_output(always_prefer_tty=True)
        # A shell that starts a command in the background has SIGINT ignored; at a prompt Ctrl-C stops an answer.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        history = _history() if with_history else InMemoryHistory()
        self._questions = PromptSession(
            "avlmaps> ", history=history, completer=completer, complete_in_thread=True, output=output
        )
        self._confirmations = PromptSession(output=output)

    def next(self) -> str | None:
        """Return the next line; None after Ctrl-D. Ctrl-C begins a new line."""
        while True:
            try:
                line = self._questions.prompt()
            except KeyboardInterrupt:
                continue
            except EOFError:
                return None
            return checked(line)

    def confirms(self, question: str) -> bool:
        """Return whether the person says yes; Ctrl-C and Ctrl-D mean no."""
        try:
            return self._confirmations.prompt(f"{question} ").strip().lower() in YES
        except (KeyboardInterrupt, EOFError):
            return False


def _history() -> FileHistory | InMemoryHistory:
    """Return the history in its file, which nobody else may read; that of this session where there can be no file."""
    path = state_file("shell_history")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with path.open("ab+") as file:
            path.chmod(0o600)
            if file.tell() > _MOST_HISTORY_BYTES:
                _shorten(path)
    except OSError as error:
        say(f"note: there is no history: {path}: {error.strerror}.")
        return InMemoryHistory()
    return FileHistory(str(path))


def _shorten(path: Path) -> None:
    """Drop the earlier half of a history; its entries begin with an empty line."""
    content = path.read_bytes()[-_MOST_HISTORY_BYTES // 2 :]
    path.write_bytes(content[max(content.find(b"\n\n"), 0) :])
