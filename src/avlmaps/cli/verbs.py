"""The verbs of the command line, and the parser that reads their words."""

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Union

import tyro

from avlmaps.cli.usage import CONFIG, at_home
from avlmaps.cli.verb import Verb
from avlmaps.core.distributions import OTHERS, how_to_get
from avlmaps.core.errors import BackendError
from avlmaps.core.registry import brought, entry_points

_DESCRIPTION = """Audio-Visual-Language Maps: one 3D map of what a robot saw and recorded, which you query with words.

Every verb takes --json (one JSON object on standard output) and --help. Progress goes to standard error.
Exit status: 0 done, 1 a known error (one sentence says which), 2 a wrong command line.
With --json an error is {"error": {"kind": ..., "message": ...}} on standard output."""

ENTRY_POINT_GROUP = "avlmaps.verbs"
_OWN = (
    "calibrate", "build", "live", "merge", "info", "query", "things", "rooms", "sources", "changes", "edit", "shell",
    "view", "export", "locate", "go", "serve", "teach-sound", "profiles",
)  # fmt: skip
# As help lists them: in the order in which a person comes to use them; other packages' own verbs follow.
_ORDER = (
    "demo", "record", "add-sounds", "calibrate", "build", "live", "merge", "import-map", "info", "query", "things",
    "rooms", "sources", "changes", "edit", "shell", "view", "export", "locate", "go", "serve", "teach-sound",
    "profiles", "bench",
)  # fmt: skip


if TYPE_CHECKING:
    VERBS: dict[str, type[Verb]]


def _own(name: str) -> type[Verb]:
    """Load one of our verbs; the others stay where they are, since one command needs no other's modules."""
    return getattr(import_module(f"avlmaps.cli.{name.replace('-', '_')}"), name.title().replace("-", ""))


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
    ordered = {name: found[name] for name in (*_ORDER, *sorted(found)) if name in found}
    return ordered, missing


def __getattr__(name: str) -> Any:
    if name == "VERBS":  # those of other packages are loaded when the list is needed
        return installed()[0]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def read_command(words: Sequence[str]) -> Verb:
    """Read the words after ``avlmaps``.

    Raises:
        BackendError: the verb is one of a package that is not installed.
        SystemExit: they cannot be read, or request help; either is printed.
    """
    name = words[0] if words else ""
    if name not in _OWN:
        verbs, missing = installed()
        if name in missing:
            raise BackendError(missing[name])
        if name not in verbs:
            every = _any_verb(verbs, shortly=not words or name.startswith("-"))
            return tyro.cli(every, prog="avlmaps", description=_DESCRIPTION, args=words, config=CONFIG)
    verb = _own(name) if name in _OWN else installed()[0][name]
    return at_home(tyro.cli(verb, prog=f"avlmaps {name}", args=words[1:], config=CONFIG))


def _any_verb(verbs: dict[str, type[Verb]], shortly: bool) -> Any:
    """Return the union of the verbs; the list of them all shows one line of each."""

    def described(name: str, verb: type[Verb]) -> Any:
        first_line = (verb.__doc__ or "").partition("\n")[0]
        return Annotated[verb, tyro.conf.subcommand(name, description=first_line if shortly else None)]

    return Union[tuple(described(name, verb) for name, verb in verbs.items())]  # noqa: UP007 - made at run time
