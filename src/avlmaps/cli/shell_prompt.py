"""The prompt of `avlmaps shell`, with its history and its completions; needs prompt-toolkit.

Completed are verbs, names of things, sounds and rooms, and file names.
"""

import shlex
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.history import FileHistory, InMemoryHistory
from prompt_toolkit.output import create_output

from avlmaps.core.files import state_file, user_path
from avlmaps.core.lexicon import lexicon
from avlmaps.core.printable import UNSAFE
from avlmaps.core.progress import say

_MOST_WORDS = 4  # of a name that is being typed
_MOST_SHOWN = 40


def prompt_reader(completer: Completer, with_history: bool = True) -> Callable[[str], str | None]:
    """Return what reads a line that a person types: "" after Ctrl-C, None after Ctrl-D."""
    output = create_output(always_prefer_tty=True)
    # A shell that starts a command in the background has SIGINT ignored; at a prompt Ctrl-C stops an answer.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    history = _history() if with_history else InMemoryHistory()
    questions = PromptSession("avlmaps> ", history=history, completer=completer, complete_in_thread=True, output=output)
    confirmations = PromptSession(output=output)

    def read(question: str) -> str | None:
        try:
            return confirmations.prompt(f"{question} ") if question else questions.prompt()
        except KeyboardInterrupt:
            return ""
        except EOFError:
            return None

    return read


def _history() -> FileHistory | InMemoryHistory:
    path = state_file("shell_history")
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        path.touch(0o600)
        path.chmod(0o600)  # nobody else reads it
    except OSError as error:
        say(f"note: there is no history: {path}: {error.strerror}.")
        return InMemoryHistory()
    return FileHistory(str(path))


def completions(line: str, verbs: Sequence[str], file_verbs: Sequence[str], here: Iterable[str]) -> list[Completion]:
    """Return the completions of a line, at most 40."""
    first, blank, rest = line.lstrip().partition(" ")
    if blank and first in file_verbs:
        return list(_files(rest.lstrip()))[:_MOST_SHOWN]
    begun = [] if blank else [verb for verb in verbs if verb.startswith(first.lower())]
    found = [Completion(verb, -len(first), display_meta="verb") for verb in begun]
    words = line.split(" ")
    for count in range(min(_MOST_WORDS, len(words)), 0, -1):
        named = list(_named(" ".join(words[-count:]), here))
        if named:
            found += named
            break
    return found[:_MOST_SHOWN] if line.strip() else []


def _named(typed: str, here: Iterable[str]) -> Iterator[Completion]:
    if not typed.strip() or typed[0] == " ":
        return
    names = dict.fromkeys(_lexicon_names(), "") | dict.fromkeys(here, "in this map")
    for name in sorted(names, key=lambda one: (not names[one], one)):
        if name.startswith(typed.lower()) and not UNSAFE.search(name):
            yield Completion(name, -len(typed), display_meta=names[name])


@cache
def _lexicon_names() -> tuple[str, ...]:
    words = lexicon()
    names = {name for entry in words.entries() for name in (entry.name, *entry.synonyms)}
    return tuple(sorted(names | {*words.colours, *words.materials}))


def _files(typed: str) -> Iterator[Completion]:
    plain = typed.replace("\\ ", " ").strip("'\"")
    folder, _, begin = plain.rpartition("/")
    base = user_path(f"{folder}/" if plain.startswith("/") else folder or ".")
    try:
        entries = sorted(base.iterdir())
    except OSError:
        return
    for entry in entries:
        name = entry.name
        if not name.startswith(begin) or UNSAFE.search(name) or (name.startswith(".") and not begin):
            continue
        whole = f"{folder}/{name}" if "/" in plain else name
        yield Completion(shlex.quote(whole) + ("/" if entry.is_dir() else ""), -len(typed))


class NameCompleter(Completer):
    """Completes at the prompt."""

    def __init__(self, verbs: Sequence[str], file_verbs: Sequence[str], here: Callable[[], Iterable[str]]) -> None:
        self._verbs, self._file_verbs, self._here = verbs, file_verbs, here

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterator[Completion]:
        """Yield the completions of what stands before the cursor."""
        yield from completions(document.text_before_cursor, self._verbs, self._file_verbs, tuple(self._here()))
