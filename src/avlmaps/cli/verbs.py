"""The verbs of the command line, and how words become a verb's fields, for the command line and for the shell alike."""

import dataclasses
import io
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from functools import cache
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Any, TypeVar, Union, get_type_hints

import tyro

from avlmaps.cli.output import UsageError
from avlmaps.cli.verb import Verb
from avlmaps.core.errors import BackendError
from avlmaps.core.extras import OTHERS, how_to_get
from avlmaps.core.registry import brought, entry_points
from avlmaps.core.words import did_you_mean, nearest

_DESCRIPTION = """Audio-Visual-Language Maps: one 3D map of what a robot saw and recorded, which you query with words.

Every verb takes --json (one JSON object on standard output) and --help. Progress goes to standard error.
Exit status: 0 done, 1 a known error (one sentence says which), 2 a wrong command line.
With --json an error is {"error": {"kind": ..., "message": ...}} on standard output."""

ENTRY_POINT_GROUP = "avlmaps.verbs"
# The verbs with their files here, "" of other packages, as help lists them: in the order in which a person comes to use
# them; further verbs of other packages follow.
_KNOWN = {
    "demo": "", "record": "", "add-sounds": "", "calibrate": "build", "build": "build", "live": "live", "merge": "edit",
    "import-map": "", "info": "info", "query": "query", "things": "things", "rooms": "things", "sources": "things",
    "changes": "edit", "edit": "edit", "shell": "shell", "view": "view", "export": "export", "locate": "query",
    "go": "go", "serve": "serve", "teach-sound": "models", "profiles": "models", "bench": "",
}  # fmt: skip
_OWN = tuple(name for name, file in _KNOWN.items() if file)


def _own(name: str) -> type[Verb]:
    return getattr(import_module(f"avlmaps.cli.{_KNOWN[name]}"), name.title().replace("-", ""))


@cache
def installed() -> tuple[dict[str, type[Verb]], dict[str, str]]:
    """Return the verbs that are installed, and why each other one that is known cannot be had."""
    found, missing = {name: _own(name) for name in _OWN}, dict[str, str]()
    for entry in entry_points(ENTRY_POINT_GROUP):
        try:
            found.setdefault(entry.name, brought(entry, "the verb"))
        except BackendError as fault:  # it takes no other verb with it
            missing[entry.name] = str(fault)
    for name in (name for one in OTHERS for name in one.verbs if name not in found and name not in missing):
        missing[name] = f"The verb {name} is not installed; get it with: {how_to_get('verbs', name)}"
    ordered = {name: found[name] for name in (*_KNOWN, *sorted(found)) if name in found}
    return ordered, missing


def read_command(words: Sequence[str]) -> Verb:
    """Read the words after ``avlmaps``; ``SystemExit`` where they request help, which is printed.

    Raises:
        BackendError: the verb is one of a package that is not installed.
        UsageError: they cannot be read.
    """
    name = words[0] if words else ""
    if name not in _OWN:
        verbs, missing = installed()
        if name in missing:
            raise BackendError(missing[name])
        if name not in verbs:
            if set(words) & {"--help", "-h"}:
                tyro.cli(_any_verb(verbs), prog="avlmaps", description=_DESCRIPTION, args=words, config=CONFIG)
            raise UsageError(meant(words, "", verbs), "avlmaps --help")
    return read_verb(_own(name) if name in _OWN else installed()[0][name], words[1:], f"avlmaps {name}")


def _any_verb(verbs: dict[str, type[Verb]]) -> Any:
    def described(name: str, verb: type[Verb]) -> Any:
        return Annotated[verb, tyro.conf.subcommand(name, description=(verb.__doc__ or "").partition("\n")[0])]

    return Union[tuple(described(name, verb) for name, verb in verbs.items())]  # noqa: UP007 - made at run time


CONFIG = (tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff)
_NO_NUMBER = r"invalid literal for int\(\) with base 10|could not convert string to float"  # as Python says it
V = TypeVar("V", bound=Verb)
Options = TypeVar("Options")


def usage_sentence(printed: str) -> str:
    """Return the fault in the words out of what the parser prints: between a title and the rule before help."""
    # in a box the title lies in its upper edge
    printed = re.sub(r"^╭─ [^\n]*╮$", "title\n────", printed.lstrip(), count=1, flags=re.MULTILINE)
    parts = re.split(r"\n *[-─]{3,} *\n", re.sub("[╭╮╰╯│]", " ", printed))
    return " ".join(parts[min(1, len(parts) - 1)].split())


def meant(words: Sequence[str], printed: str, verbs: Mapping[str, type[Verb]]) -> str:
    """Return the fault in a command line in one sentence, with the verb or option that was probably meant."""
    sentence, name = usage_sentence(printed), words[0] if words else ""
    sentence = re.sub(_NO_NUMBER, "no number", sentence)
    if not name or name.startswith("-"):
        return f"a verb comes first: {', '.join(verbs)}."
    if name not in verbs:
        return f"there is no verb {name[:60]!r}{did_you_mean(name, verbs)} The verbs: {', '.join(verbs)}."
    options, before_dashes = _options(verbs[name]), list(takewhile(lambda word: word != "--", words[1:]))
    given = [word.partition("=")[0] for word in before_dashes if re.match("--[a-z]", word)]
    unknown = [word for word in given if word.replace("_", "-") not in options]
    if unknown and (close := nearest(unknown[0].replace("_", "-"), options)) is not None:
        return f"there is no option {unknown[0]}; did you mean {close}?"
    plain = [word for word in words[1:] if not word.startswith("-")]
    if "sentence" in verbs[name].__dataclass_fields__:
        if sentence.startswith("Missing from") and plain and not Path(plain[0]).exists():
            return f"{name} needs a map and a sentence; the map comes first, and there is none at {plain[0][:80]!r}."
        before = list(takewhile(lambda word: word.startswith("-"), words[1:]))
        run = list(takewhile(lambda word: not word.startswith("-"), words[1 + len(before) :]))
        if "Unrecognized" in sentence and len(run) > 2 and Path(run[0]).exists():
            quoted = [*before, run[0], " ".join(run[1:]), *words[1 + len(before) + len(run) :]]
            return f"put the sentence in quotes: avlmaps {name} {shlex.join(quoted)}"
    return sentence


def _options(verb: type[Any]) -> tuple[str, ...]:
    names, hints = ["--help"], get_type_hints(verb, include_extras=True)
    for each in dataclasses.fields(verb):
        group, notes = each.default_factory, getattr(hints[each.name], "__metadata__", ())
        if isinstance(group, type) and dataclasses.is_dataclass(group):
            names += _options(group)
        elif tyro.conf.Positional not in notes:
            given = next((note.name for note in notes if getattr(note, "name", None)), each.name)
            names.append(f"--{given.replace('_', '-')}")
    return tuple(names)


def at_home(given: Options) -> Options:
    """Return a verb, or a group of its options, with the ~ of its paths as the user's home: shells leave --out=~/x."""
    changed: dict[str, Any] = {}
    for each in dataclasses.fields(given):  # pyright: ignore[reportArgumentType] - a dataclass
        value = getattr(given, each.name)
        found = tuple(map(_at_home, value)) if isinstance(value, tuple) else _at_home(value)
        if found != value:
            changed[each.name] = found
    return dataclasses.replace(given, **changed) if changed else given  # pyright: ignore[reportArgumentType]


def _at_home(value: Any) -> Any:
    if isinstance(value, Path) and str(value).startswith("~"):
        from avlmaps.core.files import user_path

        return user_path(value)
    return at_home(value) if dataclasses.is_dataclass(value) else value


def read_verb(verb: type[V], words: Sequence[str], prog: str) -> V:
    """Read the words of one verb, as `read_command` does; ``prog`` ends in its name."""
    printed = io.StringIO()
    try:
        with redirect_stderr(printed):
            read = at_home(tyro.cli(verb, prog=prog, args=list(words), config=CONFIG))
    except SystemExit as stop:
        if stop.code in (0, None):
            sys.stderr.write(printed.getvalue())
            raise
        name = prog.split()[-1]
        raise UsageError(meant([name, *words], printed.getvalue(), {name: verb}), f"{prog} --help") from None
    read.require_bounds()
    return read
