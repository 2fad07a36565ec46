"""The completions of `avlmaps shell`: verbs, names of things, sounds and rooms, and file names."""

import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document

from avlmaps.core.files import user_path
from avlmaps.core.lexicon import lexicon
from avlmaps.core.printable import UNSAFE

_MOST_WORDS = 4  # of a name that is being typed
_MOST_SHOWN = 40


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
    """Yield the names that begin so; those of this map first."""
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
    """Yield the files and folders whose names begin so, written as the shell reads them back."""
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
