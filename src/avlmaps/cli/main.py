"""Reading the command line, running a verb, and turning errors into one sentence and an exit status."""

import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, redirect_stderr
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
from avlmaps.cli.output import AnsweredError, UsageError, emit, error_answer, kind_of, system_sentence
from avlmaps.cli.pipes import READER_GONE, drop, reader_gone
from avlmaps.cli.profiles import Profiles
from avlmaps.cli.query import Query
from avlmaps.cli.record import Record
from avlmaps.cli.serve import Serve
from avlmaps.cli.shell import Shell
from avlmaps.cli.shortened_files import end_at_shortened_files
from avlmaps.cli.teach_sound import TeachSound
from avlmaps.cli.things import Things
from avlmaps.cli.usage import CONFIG, usage_sentence
from avlmaps.cli.verb import Verb, models_in_force
from avlmaps.cli.view import View
from avlmaps.core.errors import AvlmapsError
from avlmaps.core.printable import printable
from avlmaps.core.progress import end_bars

_DESCRIPTION = """Audio-Visual-Language Maps: one 3D map of what a robot saw and recorded, which you query with words.

Every verb takes --json (one JSON object on standard output) and --help. Progress goes to standard error.
Exit status: 0 done, 1 a known error (one sentence says which), 2 a wrong command line.
With --json an error is {"error": {"kind": ..., "message": ...}} on standard output."""

# The language asks for files in words that fit every program; here an option names them.
_ATTACHED = {
    "Which picture? Attach it": "Which picture? Give it with --image FILE",
    "Which recording? Attach it": "Which recording? Give it with --sound-clip FILE",
}
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


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Args:
        arguments: the words after ``avlmaps``; those of this process if None.
    """
    try:
        try:
            _main(sys.argv[1:] if arguments is None else list(arguments))
        finally:
            sys.stdout.flush()  # here, since Python reports a reader that has gone on standard error if it flushes last
    except OSError as error:  # of what was printed last; a verb's own are a sentence already
        if reader_gone():
            sys.exit(READER_GONE)
        drop(sys.stdout)
        sys.exit(_complain(system_sentence(error), 1))
    except KeyboardInterrupt:  # while it was reading its words
        sys.exit(_complain("stopped", 130))


def _main(words: list[str]) -> None:
    if words == ["--version"]:
        from avlmaps.core.version import __version__

        sys.stdout.write(f"avlmaps {__version__}\n")
        sys.exit(0)
    if "OMP_NUM_THREADS" not in os.environ:  # models on torch are another matter: they set their threads by this
        os.environ.setdefault("AVLMAPS_TORCH_THREADS", str(os.cpu_count() or 1))
    # One BLAS thread: small matrices, ours among them, run many times slower on several when a machine is busy.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")  # avlmaps reports a truncated picture in its own words
    shortly = not words or words[0].startswith("-")
    with _usage_in_json() if _wants_json(words) else nullcontext():
        verb = tyro.cli(_any_verb(shortly), prog="avlmaps", description=_DESCRIPTION, args=words, config=CONFIG)
    sys.exit(_run(verb))


def _wants_json(words: Sequence[str]) -> bool:
    """Return whether a command line holds --json; decided before it is read, since it may not be readable."""
    return "--json" in (words[: words.index("--")] if "--" in words else words)


@contextmanager
def _usage_in_json() -> Iterator[None]:
    """Print a command line that cannot be read as a JSON error, too."""
    complaints = io.StringIO()
    try:
        with redirect_stderr(complaints):
            yield
    except SystemExit as stop:
        sys.stderr.write(complaints.getvalue())
        if stop.code not in (0, None):
            _emit_error("usage", usage_sentence(complaints.getvalue()))
        raise


def _any_verb(shortly: bool) -> Any:
    """Return the union of the verbs; the list of them all shows one line of each."""

    def described(name: str, verb: type[Verb]) -> Any:
        first_line = (verb.__doc__ or "").partition("\n")[0]
        return Annotated[verb, tyro.conf.subcommand(name, description=first_line if shortly else None)]

    return Union[tuple(described(name, verb) for name, verb in VERBS.items())]  # noqa: UP007 - made at run time


def _run(verb: Verb) -> int:
    end_at_shortened_files(as_json=verb.json)
    try:
        with models_in_force(verb), _compiling(verb):
            verb.run()
    except AnsweredError as error:
        return _complain(error, 1)
    except UsageError as error:
        return _fail(verb, error, str(error), 2)
    except AvlmapsError as error:
        return _fail(verb, error, str(error), 1)
    except (OSError, MemoryError) as error:
        if isinstance(error, BrokenPipeError) and reader_gone():
            return READER_GONE
        return _fail(verb, error, system_sentence(error), 1)
    except KeyboardInterrupt as stop:
        if (status := getattr(stop, "status", None)) is not None:  # of a robot that was driving; its answer is printed
            return _complain(stop, status)
        return _fail(verb, stop, "stopped; the same command continues where this one ended, where it can", 130)
    except Exception as fault:
        if verb.json:
            _emit_error(
                kind_of(fault), f"{type(fault).__name__}: {fault}; this is a fault of avlmaps, please report it."
            )
        raise
    return 0


def _compiling(verb: Verb) -> AbstractContextManager[None]:
    if not verb.compiles:
        return nullcontext()
    from avlmaps.core.compiling import announce_compiling

    return announce_compiling()


def _fail(verb: Verb, error: BaseException, message: str, status: int) -> int:
    """Print an error in one sentence on standard error, and as JSON on standard output with --json."""
    for said, option in _ATTACHED.items():
        message = message.replace(said, option)
    if verb.json:
        _emit_error(kind_of(error), message)
    return _complain(message, status)


def _emit_error(kind: str, message: str) -> None:
    """Print an error as JSON, unless standard output is what failed: the sentence and the status report it too."""
    try:
        emit({"error": error_answer(kind, message)}, (), as_json=True)
        sys.stdout.flush()
    except OSError:
        drop(sys.stdout)


def _complain(what: object, status: int) -> int:
    end_bars()
    sys.stderr.write(f"avlmaps: {printable(what)}\n")
    return status
