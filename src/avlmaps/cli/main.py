"""Reading the command line, running a verb, and turning errors into one sentence and an exit status."""

import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, redirect_stderr
from pathlib import Path
from typing import TYPE_CHECKING

from avlmaps.cli import output
from avlmaps.cli.process import (
    READER_GONE,
    drop,
    end_at_shortened_files,
    models_in_force,
    reader_gone,
    require_address_space,
    settle_streams,
)
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.printable import printable
from avlmaps.core.progress import end_bars
from avlmaps.core.wording import Spelling, options_as

if TYPE_CHECKING:
    from avlmaps.cli.verb import Verb

# The language asks for files in words that fit every program; here an option names them.
_ATTACHED = {
    "Which picture? Attach it": "Which picture? Give it with --image FILE",
    "Which recording? Attach it": "Which recording? Give it with --sound-clip FILE",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Args:
        arguments: the words after ``avlmaps``; those of this process if None.
    """
    settle_streams()
    try:
        try:
            with options_as(Spelling.FLAG):
                _main(sys.argv[1:] if arguments is None else list(arguments))
        finally:
            sys.stdout.flush()  # here, since Python reports a reader that has gone on standard error if it flushes last
    except OSError as error:  # of what was printed last; a verb's own are a sentence already
        if reader_gone():
            sys.exit(READER_GONE)
        drop(sys.stdout)
        sys.exit(_complain(output.system_sentence(error), 1))
    except Exception as fault:  # of loading the verbs; what a verb meets is a sentence already
        if not output.is_short_of_memory(fault):
            raise
        sys.exit(_complain(output.fault_sentence(fault), 1))
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
    try:
        with _usage(words):
            from avlmaps.cli.verbs import read_command

            verb = read_command(words)
    except BackendError as error:  # the verb is of a package that is not installed
        if _wants_json(words):
            _emit_error(output.kind_of(error), str(error))
        sys.exit(_complain(error, 1))
    sys.exit(_run(verb))


def _wants_json(words: Sequence[str]) -> bool:
    """Return whether a command line holds --json; decided before it is read, since it may not be readable."""
    return "--json" in (words[: words.index("--")] if "--" in words else words)


@contextmanager
def _usage(words: Sequence[str]) -> Iterator[None]:
    """Say in a sentence what was probably meant by a command line that cannot be read; with --json in JSON, too."""
    complaints = io.StringIO()
    try:
        with redirect_stderr(complaints):
            yield
    except SystemExit as stop:
        if stop.code in (0, None):
            sys.stderr.write(complaints.getvalue())
            raise
        from avlmaps.cli.verbs import VERBS, meant

        sentence = meant(words, complaints.getvalue(), VERBS)
        verb = f"{words[0]} " if words and words[0] in VERBS else ""
        sys.stderr.write(f"avlmaps: {printable(sentence)}\nFor all of it: avlmaps {verb}--help\n")
        if _wants_json(words):
            _emit_error("usage", sentence)
        raise


def _run(verb: "Verb") -> int:
    end_at_shortened_files(as_json=verb.json)
    try:
        with models_in_force(verb), _compiling(verb):
            verb.run()
    except output.AnsweredError as error:
        return _complain(error, error.status)
    except output.UsageError as error:
        return _fail(verb, error, str(error), 2)
    except AvlmapsError as error:
        return _fail(verb, error, _swapped(verb) or str(error), 1)
    except KeyboardInterrupt as stop:
        if (status := getattr(stop, "status", None)) is not None:  # of a robot that was driving; its answer is printed
            return _complain(stop, status)
        return _fail(verb, stop, "stopped; a build continues where it ended, by the same command", 130)
    except Exception as fault:
        if isinstance(fault, BrokenPipeError) and reader_gone():
            return READER_GONE
        if isinstance(fault, OSError) or output.is_short_of_memory(fault):
            return _fail(verb, fault, output.fault_sentence(fault), 1)
        if verb.json:
            _emit_error(output.kind_of(fault), output.fault_sentence(fault))
        raise
    return 0


def _swapped(verb: "Verb") -> str | None:
    """Return a sentence where the words of a query or a command stand in the place of its map."""
    place, words = getattr(verb, "map", None), getattr(verb, "sentence", None)
    if place is None or not words or place.exists() or not Path(words, "map.json").is_file():
        return None
    return f"{words} is the map, and it comes first: avlmaps {_name_of(verb)} {words} {str(place)!r}"


def _name_of(verb: "Verb") -> str:
    from avlmaps.cli.verbs import VERBS

    return next((name for name, kind in VERBS.items() if isinstance(verb, kind)), "query")


def _compiling(verb: "Verb") -> AbstractContextManager[None]:
    if not verb.compiles:
        return nullcontext()
    require_address_space()
    from avlmaps.core.progress import announce_compiling

    return announce_compiling()


def _fail(verb: "Verb", error: BaseException, message: str, status: int) -> int:
    """Print an error in one sentence on standard error, and as JSON on standard output with --json."""
    for said, option in _ATTACHED.items():
        message = message.replace(said, option)
    if verb.json:
        _emit_error(output.kind_of(error), message)
    return _complain(message, status)


def _emit_error(kind: str, message: str) -> None:
    """Print an error as JSON, unless standard output is what failed: the sentence and the status report it too."""
    try:
        output.emit({"error": output.error_answer(kind, message)}, (), as_json=True)
        sys.stdout.flush()
    except OSError:
        drop(sys.stdout)


def _complain(what: object, status: int) -> int:
    end_bars()
    sys.stderr.write(f"avlmaps: {printable(what)}\n")
    return status
