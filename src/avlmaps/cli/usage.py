"""How words become a verb's fields, for the command line and for the shell alike."""

import io
import re
from collections.abc import Sequence
from contextlib import redirect_stderr
from typing import TypeVar

import tyro

from avlmaps.cli.output import UsageError
from avlmaps.cli.verb import Verb

CONFIG = (tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff)
V = TypeVar("V", bound=Verb)


def usage_sentence(printed: str) -> str:
    """Return the fault in the words, out of the frame that the parser prints."""
    # a title, a rule, what is wrong, a rule, and help
    parts = re.split(r"\n *[-─]{3,} *\n", re.sub("[╭╮╰╯│]", " ", printed))
    return " ".join(parts[min(1, len(parts) - 1)].split())


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
    raise UsageError(usage_sentence(printed.getvalue()))
