"""How words become a verb's fields, for the command line and for the shell alike."""

import dataclasses
import io
import re
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from typing import Any, TypeVar, get_type_hints

import tyro

from avlmaps.cli.output import UsageError
from avlmaps.cli.verb import Verb
from avlmaps.core.suggestions import did_you_mean, nearest

CONFIG = (tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff)
V = TypeVar("V", bound=Verb)
_CHOICE = re.compile(r"invalid choice '(?P<given>[^']*)' for argument .*Expected one of \((?P<known>[^)]*)\)")


def usage_sentence(printed: str) -> str:
    """Return the fault in the words, out of the frame that the parser prints."""
    # a title, a rule, what is wrong, a rule, and help; in a box the title lies in its upper edge
    printed = re.sub(r"^╭─ [^\n]*╮$", "title\n────", printed.lstrip(), count=1, flags=re.MULTILINE)
    parts = re.split(r"\n *[-─]{3,} *\n", re.sub("[╭╮╰╯│]", " ", printed))
    return " ".join(parts[min(1, len(parts) - 1)].split())


def meant(words: Sequence[str], printed: str, verbs: Mapping[str, type[Verb]]) -> str:
    """Return the fault in a command line in one sentence, with the verb, option or value that was probably meant.

    Args:
        words: after ``avlmaps``.
        printed: what the parser prints about them.
        verbs: the verbs by their names.
    """
    sentence = usage_sentence(printed)
    name = words[0] if words else ""
    if name and not name.startswith("-") and name not in verbs:
        return f"there is no verb {name[:60]!r}{did_you_mean(name, verbs)} The verbs: {', '.join(verbs)}."
    choice = _CHOICE.search(sentence)
    if choice is not None:
        return sentence.rstrip(".") + did_you_mean(choice["given"], re.findall(r"'([^']*)'", choice["known"]))
    known = option_names(verbs[name]) if name in verbs else ()
    given = [word.partition("=")[0] for word in _before_dashes(words[1:]) if re.match("--[a-z]", word)]
    unknown = [word for word in given if word.replace("_", "-") not in known]
    close = nearest(unknown[0].replace("_", "-"), known) if unknown and known else None
    if close is None:
        return sentence
    said = f"Unrecognized options: {unknown[0]}" if "Unrecognized" not in sentence else sentence
    said = said.partition(" Perhaps you meant")[0]
    return f"{said.rstrip('.')}; did you mean {close}?"


def _before_dashes(words: Sequence[str]) -> Sequence[str]:
    return words[: words.index("--")] if "--" in words else words


def option_names(verb: type[Any]) -> tuple[str, ...]:
    """Return the options of a verb as they are typed, those of its groups among them."""
    names: list[str] = ["--help"]
    for field in dataclasses.fields(verb):
        kind = get_type_hints(verb, include_extras=True)[field.name]
        notes = getattr(kind, "__metadata__", ())
        bare = kind.__origin__ if notes else kind
        if dataclasses.is_dataclass(bare):
            names += option_names(bare if isinstance(bare, type) else type(bare))
        elif tyro.conf.Positional not in notes and "Positional" not in str(notes):
            names.append("--" + field.name.replace("_", "-"))
            names += [alias for note in notes for alias in getattr(note, "aliases", None) or ()]
    return tuple(names)


def read_verb(verb: type[V], words: Sequence[str], name: str) -> V:
    """Read the words of one verb.

    Raises:
        UsageError: they cannot be read.
        SystemExit: they request help, which is printed; its status is 0.
    """
    printed = io.StringIO()
    try:
        with redirect_stderr(printed):
            return tyro.cli(verb, prog=name, args=list(words), config=CONFIG)
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
    raise UsageError(meant([name, *words], printed.getvalue(), {name: verb}))
