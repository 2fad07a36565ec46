"""Where the lines of `avlmaps shell` come from: a person at a prompt (`shell_prompt`), or a pipe."""

from typing import Protocol, TextIO

from avlmaps.cli.output import UsageError
from avlmaps.core.progress import say

LONGEST_LINE = 10_000
"""Characters of a line; a sentence may have far fewer."""
YES = frozenset({"y", "yes"})
_NO = frozenset({"n", "no", ""})


def checked(line: str) -> str:
    """Return a line without blanks round it.

    Raises:
        UsageError: it is too long.
    """
    if len(line) >= LONGEST_LINE:
        raise UsageError(f"A line has {LONGEST_LINE:,} characters or more; give a shorter one.")
    return line.strip()


class Lines(Protocol):
    """Gives the lines of a shell, one after the other."""

    interactive: bool
    """Whether a person types them: Ctrl-C then stops one answer and not the shell."""

    def next(self) -> str | None:
        """Return the next line; None at the end.

        Raises:
            UsageError: the line is too long.
        """
        ...

    def confirms(self, question: str) -> bool:
        """Return whether the answer to a question is yes."""
        ...


class PipedLines:
    """Lines of a file or a pipe.

    The answer to a question is the next line where that is a yes or a no. Any other line means no, and is the next
    line of the shell.
    """

    interactive = False

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._kept: str | None = None

    def next(self) -> str | None:
        """Return the next line; None at the end; see `Lines`."""
        if self._kept is not None:
            line, self._kept = self._kept, None
            return line
        line = self._stream.readline(LONGEST_LINE)
        if len(line) == LONGEST_LINE and not line.endswith("\n"):
            while (rest := self._stream.readline(LONGEST_LINE)) and not rest.endswith("\n"):
                pass
        return checked(line) if line else None

    def confirms(self, question: str) -> bool:
        """Return whether the next line says yes."""
        say(question)
        line = self.next()
        if line is not None and line.lower() not in YES | _NO:
            self._kept = line
        return line is not None and line.lower() in YES
