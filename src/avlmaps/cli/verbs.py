"""The verbs of the command line, and the parser that reads their words."""

from collections.abc import Sequence
from typing import Annotated, Any, Union

import tyro

from avlmaps.cli.add_sounds import AddSounds
from avlmaps.cli.bench import Bench
from avlmaps.cli.build import Build
from avlmaps.cli.demo import Demo
from avlmaps.cli.export import Export
from avlmaps.cli.go import Go
from avlmaps.cli.import_map import ImportMap
from avlmaps.cli.info import Info
from avlmaps.cli.locate import Locate
from avlmaps.cli.profiles import Profiles
from avlmaps.cli.query import Query
from avlmaps.cli.record import Record
from avlmaps.cli.serve import Serve
from avlmaps.cli.shell import Shell
from avlmaps.cli.teach_sound import TeachSound
from avlmaps.cli.things import Things
from avlmaps.cli.usage import CONFIG
from avlmaps.cli.verb import Verb
from avlmaps.cli.view import View

_DESCRIPTION = """Audio-Visual-Language Maps: one 3D map of what a robot saw and recorded, which you query with words.

Every verb takes --json (one JSON object on standard output) and --help. Progress goes to standard error.
Exit status: 0 done, 1 a known error (one sentence says which), 2 a wrong command line.
With --json an error is {"error": {"kind": ..., "message": ...}} on standard output."""

VERBS: dict[str, type[Verb]] = {
    "demo": Demo,
    "record": Record,
    "add-sounds": AddSounds,
    "build": Build,
    "import-map": ImportMap,
    "info": Info,
    "query": Query,
    "things": Things,
    "shell": Shell,
    "view": View,
    "export": Export,
    "locate": Locate,
    "go": Go,
    "serve": Serve,
    "teach-sound": TeachSound,
    "profiles": Profiles,
    "bench": Bench,
}


def read_command(words: Sequence[str]) -> Verb:
    """Read the words after ``avlmaps``.

    Raises:
        SystemExit: they cannot be read, or request help; either is printed.
    """
    shortly = not words or words[0].startswith("-")
    return tyro.cli(_any_verb(shortly), prog="avlmaps", description=_DESCRIPTION, args=words, config=CONFIG)


def _any_verb(shortly: bool) -> Any:
    """Return the union of the verbs; the list of them all shows one line of each."""

    def described(name: str, verb: type[Verb]) -> Any:
        first_line = (verb.__doc__ or "").partition("\n")[0]
        return Annotated[verb, tyro.conf.subcommand(name, description=first_line if shortly else None)]

    return Union[tuple(described(name, verb) for name, verb in VERBS.items())]  # noqa: UP007 - made at run time
