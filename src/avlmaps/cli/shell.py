"""`avlmaps shell`: one open map, and a prompt that answers line after line."""

import signal
import sys
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.go import read_start
from avlmaps.cli.output import AnsweredError, UsageError, emit, error_answer, fault_sentence, kind_of
from avlmaps.cli.shell_session import VERBS, WITH_FILES, Over, SessionSettings, ShellSession
from avlmaps.cli.verb import ModelVerb
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.printable import printable
from avlmaps.core.progress import end_bars, say

if TYPE_CHECKING:
    from avlmaps.cli.shell_lines import Lines


@dataclass(frozen=True, kw_only=True)
class Shell(ModelVerb):
    """Query a map line by line, at a prompt or from a pipe, without a new start for each question.

    A line is a question or begins with a verb; `help` lists the verbs. On a terminal there are a history and completion
    (pip install 'avlmaps[shell]'). Questions from a pipe are answered line by line, with --json by one object for each
    line; the exit status is 1 if one of them failed.

    Examples:
    avlmaps shell home.avlmap
    avlmaps shell home.avlmap --json < questions.txt
    """

    compiles: ClassVar[bool] = True

    map: Positional[Path]
    """Map folder (NAME.avlmap)."""
    scene: str | None = None
    """Scene in which `go` drives the simulated robot after you confirm the plan: house:SEED, office:SEED or a file."""
    start: Annotated[str | None, arg(metavar="X,Y,HEADING")] = None
    """Where the simulated robot starts: metres, degrees counter-clockwise from +x. Default: where the walk began."""
    body: Literal["base", "drone"] = "base"
    """Body of the simulated robot: a wheeled base or a drone, which have different obstacles."""
    guess: bool = False
    """Let `go` drive to the best guess where the map has no confident answer."""
    no_history: bool = False
    """Neither read nor write the history of questions ($XDG_STATE_HOME/avlmaps/shell_history)."""

    def run(self) -> None:
        """Answer line after line."""
        start = read_start(self.start)
        if start is not None and self.scene is None:
            raise UsageError("--start places the simulated robot; give its --scene as well.")
        session = ShellSession(SessionSettings(self.map, self.scene, start, self.body, self.guess))
        interactive = sys.stdin.isatty() and not self.json
        lines = _prompt(session, not self.no_history) if interactive else _piped()
        if interactive:
            say(f"{session.opened!r}")
            say("Ask in words; help lists the verbs, Ctrl-D ends.")
        failed, answered = answer_lines(session, lines, self.json)
        if failed and not interactive:
            raise AnsweredError(f"{failed} of {answered} lines failed.")


def answer_lines(session: ShellSession, lines: "Lines", as_json: bool) -> tuple[int, int]:
    """Answer every line; an error is one sentence, and the next line follows.

    Returns:
        How many lines failed, and how many there were.
    """
    failed = done = 0
    while True:
        try:
            line = lines.next()
            if line is None:
                return failed, failed + done
            if not line or line.startswith("#"):
                continue
            reply = session.answer(line, lines.confirms)
            emit(reply.answer, reply.lines, as_json)
            failed, done = failed + (not reply.ok), done + reply.ok
        except Over:
            return failed, failed + done
        except (AvlmapsError, UsageError) as error:
            failed += 1
            _report(error, str(error), as_json)
        except BrokenPipeError:
            raise
        except KeyboardInterrupt as stop:
            if not lines.interactive or getattr(stop, "number", signal.SIGINT) != signal.SIGINT:
                raise
            failed += 1
            _report(stop, str(stop) or "stopped", as_json)
        except Exception as fault:  # noqa: BLE001 - one line that fails must not end the others
            failed += 1
            _report(fault, fault_sentence(fault), as_json)
        sys.stdout.flush()


def _report(error: BaseException, sentence: str, as_json: bool) -> None:
    end_bars()
    if as_json:
        emit({"error": error_answer(kind_of(error), sentence)}, (), as_json=True)
    sys.stderr.write(f"avlmaps: {printable(sentence)}\n")


def _piped() -> "Lines":
    """Return the lines of standard input."""
    from avlmaps.cli.shell_lines import PipedLines

    if isinstance(sys.stdin, TextIOWrapper):
        sys.stdin.reconfigure(errors="replace")  # a line that is not UTF-8 is not understood, and the next one is
    return PipedLines(sys.stdin)


def _prompt(session: ShellSession, with_history: bool) -> "Lines":
    """Return the lines that a person types.

    Raises:
        BackendError: prompt-toolkit is not installed.
    """
    try:
        from avlmaps.cli.shell_names import NameCompleter
        from avlmaps.cli.shell_prompt import PromptLines
    except ImportError:
        raise BackendError(
            f"A prompt on a terminal needs prompt-toolkit; get it with: {install_command('shell')}, or pipe lines in."
        ) from None
    return PromptLines(NameCompleter(("go", *VERBS), WITH_FILES, session.names), with_history)
