"""Reading the command line, running a verb, and turning errors into one sentence and an exit status."""

import io
import os
import select
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from avlmaps.cli import output
from avlmaps.core.errors import AskError, AvlmapsError, BackendError
from avlmaps.core.printable import printable
from avlmaps.core.progress import announce_compiling, end_bars
from avlmaps.core.wording import Spelling, options_as

if TYPE_CHECKING:
    from avlmaps.cli.verb import Verb

READER_GONE = 141
"""Exit status where a reader went away: what a shell reports for a program that SIGPIPE (13) ended."""
# The language asks for files in words that fit every program; here an option names them.
_ATTACHED = {
    "Which picture? Attach it": "Which picture? Give it with --image FILE",
    "Which recording? Attach it": "Which recording? Give it with --sound-clip FILE",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the words after ``avlmaps``, by default those of this process, and exit."""
    _settle_streams()
    try:
        try:
            with options_as(Spelling.FLAG):
                _main(sys.argv[1:] if arguments is None else list(arguments))
        finally:
            sys.stdout.flush()  # here, since Python reports a reader that has gone on standard error if it flushes last
    except OSError as error:  # of what was printed last; a verb's own are a sentence already
        if _reader_gone():
            sys.exit(READER_GONE)
        _drop(sys.stdout)
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
    from avlmaps.cli.verbs import read_command

    try:
        verb = read_command(words)
        _require_map_first(verb)
    except (BackendError, output.UsageError) as error:  # BackendError: the verb is of a package that is not installed
        # The line may not be readable: its words alone say whether JSON is wanted.
        if "--json" in (words[: words.index("--")] if "--" in words else words):
            _emit_error(output.kind_of(error), str(error))
        _complain(error, 1)
        if isinstance(error, output.UsageError) and error.help:
            sys.stderr.write(f"For all of it: {error.help}\n")
        sys.exit(2 if isinstance(error, output.UsageError) else 1)
    sys.exit(_run(verb))


def _run(verb: "Verb") -> int:
    try:
        with _models_in_force(verb), announce_compiling() if verb.compiles else nullcontext():
            verb.run()
    except output.AnsweredError as error:
        return _complain(error, error.status)
    except (output.UsageError, AskError) as error:
        return _fail(verb, error, str(error), 2)
    except AvlmapsError as error:
        return _fail(verb, error, str(error), 1)
    except KeyboardInterrupt as stop:
        if (status := getattr(stop, "status", None)) is not None:  # of a robot that was driving; its answer is printed
            return _complain(stop, status)
        return _fail(verb, stop, str(stop) or "stopped; a build continues from what it has stored", 130)
    except Exception as fault:
        if isinstance(fault, BrokenPipeError) and _reader_gone():
            return READER_GONE
        if isinstance(fault, OSError) or output.is_short_of_memory(fault):
            return _fail(verb, fault, output.fault_sentence(fault), 1)
        if verb.json:
            _emit_error(output.kind_of(fault), output.fault_sentence(fault))
        raise
    return 0


def _require_map_first(verb: "Verb") -> None:
    place, words = getattr(verb, "map", None), getattr(verb, "sentence", None)
    if place is not None and words and not place.exists() and Path(words, "map.json").is_file():
        name = type(verb).__name__.lower()
        raise output.UsageError(f"{words} is the map, and it comes first: avlmaps {name} {words} {str(place)!r}")


def _fail(verb: "Verb", error: BaseException, message: str, status: int) -> int:
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
        _drop(sys.stdout)


def _complain(what: object, status: int) -> int:
    end_bars()
    sys.stderr.write(f"avlmaps: {printable(what)}\n")
    return status


def _settle_streams() -> None:
    """Make the standard streams usable: characters that an encoding lacks become escapes, a closed one goes nowhere.

    What is printed to a closed standard output is lost, which is an error.
    """
    for name, flags in (("stdin", "r"), ("stdout", "r"), ("stderr", "w")):
        if getattr(sys, name) is None:
            number = os.open(os.devnull, os.O_RDONLY if flags == "r" else os.O_WRONLY)
            setattr(sys, name, open(number, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: PTH123, SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors in ("strict", "surrogateescape"):
            stream.reconfigure(errors="backslashreplace")


def _reader_gone() -> bool:
    """Return whether standard output or error is a pipe without a reader; if so, drop what is still written there.

    Another pipe may have broken, a connection to a robot or a worker: that is a fault, and is reported.
    """
    gone = [stream for stream in (sys.stdout, sys.stderr) if _is_broken(stream)]
    for stream in gone:
        _drop(stream)
    return bool(gone)


def _is_broken(stream: TextIO) -> bool:
    try:
        stream.flush()
        number = stream.fileno()
    except BrokenPipeError:  # the words that could not be written are still in the buffer
        return True
    except (OSError, ValueError):  # closed, or no file at all
        return False
    if not hasattr(select, "poll"):
        return False
    watch = select.poll()
    watch.register(number, 0)  # errors are reported in any case
    return any(event & select.POLLERR for _, event in watch.poll(0))


def _drop(stream: TextIO) -> None:
    """Let all that a stream still holds, or gets, go nowhere: Python would report it on standard error when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


@contextmanager
def _models_in_force(verb: object) -> Iterator[None]:
    options = {"folder": "models", "device": "device", "precision": "precision", "batch": "batch"}
    values = ((name, getattr(verb, option, None)) for name, option in options.items())
    given: dict[str, Any] = {name: value for name, value in values if value is not None}
    if not given:
        yield
        return
    from avlmaps.perception.models import environment_of, model_settings, using_models

    if "folder" in given:
        given["folder"] = given["folder"].absolute()
    settings = replace(model_settings(), **given)
    variables = environment_of(settings)
    before = {name: os.environ.get(name) for name in variables}
    with using_models(settings):
        os.environ.update(variables)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
