"""`avlmaps shell`: one open map, and a prompt or a pipe whose lines are answered one after the other."""

import re
import shlex
import signal
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from io import TextIOWrapper
from threading import Lock
from typing import TYPE_CHECKING, Annotated, Any, Literal, TextIO

from tyro.conf import arg

from avlmaps.cli import go as going
from avlmaps.cli.edit import Changes
from avlmaps.cli.export import Export
from avlmaps.cli.info import Info, describe_path, info_lines, plot_named
from avlmaps.cli.output import AnsweredError, UsageError, emit, error_answer, fault_sentence, kind_of
from avlmaps.cli.query import Locate, Query
from avlmaps.cli.things import Rooms, Sources, Things, sound_lines
from avlmaps.cli.verb import MapVerb
from avlmaps.cli.verbs import read_verb
from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.files import user_path
from avlmaps.core.printable import printable
from avlmaps.core.progress import end_bars, say
from avlmaps.core.wording import Spelling, asked_as

if TYPE_CHECKING:
    from avlmaps.core.motion import GroundPose
    from avlmaps.navigate.robots import RobotDriver
    from avlmaps.query.avlmap import AVLMap

_HELP = """\
A line is a question, as `avlmaps query` takes it, or begins with a verb:
  the red cabinet near the sound of a dog    places in the map
  query --object sofa --area kitchen         the same in parts, with the options of `avlmaps query`
  things [--least 0.7] [--room kitchen] ...  the things, sounds and rooms of the map
  sounds, sources, changes                   its sounds, where they came from, what changed
  rooms [--plot FILE]                        its rooms
  info [--verify]                            a description of the map
  locate photo.jpg                           the pose of the camera that took a photo
  go to the sofa, then turn left             the plan of a command; with --scene the simulated robot drives it
  plot FILE                                  a picture of the last answer, or of the map
  export FILE [--heat "the sofa"]            the map for other programs: .ply, .glb, ... (export --help)
  help                                       this text; VERB --help lists the options of a verb
  quit                                       the end, as Ctrl-D; Ctrl-C stops an answer"""
_MAP_VERBS: dict[str, type[MapVerb]] = {
    "query": Query, "things": Things, "rooms": Rooms, "sources": Sources, "changes": Changes, "locate": Locate,
    "export": Export,
}  # fmt: skip
VERBS = (*_MAP_VERBS, "go", "sounds", "info", "plot", "help", "quit", "exit")
WITH_FILES = ("locate", "plot", "export")
_WITH_WORDS = ("query", "plot", "export")
_PICTURE = re.compile(r"\.(jpe?g|png|webp|bmp|tiff?|ppm|pgm)['\"]?$", re.IGNORECASE)
_FRAME = "recording"
_CONFIRM = "Drive this plan? [y/N]"
_LEAST_COMPLETED = 0.3  # things with this confidence are completed
YES, _NO = frozenset({"y", "yes"}), frozenset({"n", "no", ""})


@dataclass(frozen=True, kw_only=True)
class Shell(MapVerb):
    """Query a map line by line, at a prompt or from a pipe, without a new start for each question.

    A line is a question or begins with a verb; `help` lists the verbs. On a terminal there are a history and completion
    (pip install 'avlmaps[shell]'). Questions from a pipe are answered line by line, with --json by one object for each
    line; the exit status is 1 if one of them failed.

    Example: avlmaps shell home.avlmap

    Example: avlmaps shell home.avlmap --json < questions.txt
    """

    scene: str | None = None
    """Scene in which `go` drives the simulated robot after you confirm the plan: house:SEED, office:SEED or a file."""
    start: Annotated[str | None, arg(metavar="X,Y,HEADING")] = None
    """Where the simulated robot starts: metres, degrees counter-clockwise from +x. Default: where the walk began."""
    body: Literal["base", "drone"] = "base"
    """Body of the simulated robot: a wheeled base or a drone, which have different obstacles."""
    guess: bool = False
    """Let `go` drive to the best guess where the map has no confident answer."""
    no_history: bool = False
    """Neither read nor write the history of questions ($XDG_STATE_HOME/avlmaps/shell_history)."""

    def run(self) -> None:
        start = going.read_start(self.start)
        if start is not None and self.scene is None:
            raise UsageError("--start places the simulated robot; give its --scene as well.")
        session = ShellSession(self, start)
        interactive = sys.stdin.isatty() and not self.json
        lines = _prompt(session, not self.no_history) if interactive else _piped()
        if interactive:
            say(f"{session.opened!r}")
            say("Ask in words; help lists the verbs, Ctrl-D ends.")
        with asked_as(Spelling.LINE):
            failed, answered = answer_lines(session, lines, self.json)
        if failed and not interactive:
            raise AnsweredError(f"{failed} of {answered} lines failed.")


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a line, as JSON has it and for a person, and whether it did what the line asks for."""

    answer: Mapping[str, Any]
    lines: Iterable[str]
    ok: bool = True


class ShellSession:
    """One map that stays open, and what was queried last."""

    def __init__(self, given: Shell, start: "GroundPose | None" = None) -> None:
        self.given, self._start = given, start
        self._robot: RobotDriver | None = None
        self._last: Query | None = None
        self._names: tuple[str, ...] | None = None
        self._asked: tuple[str, str, tuple[int, ...], int] | None = None  # a command, its choices, and among how many
        self._lock = Lock()
        self.opened = given.opened()

    def answer(self, line: str, confirms: Callable[[str], bool]) -> Reply:
        word, _, rest = line.partition(" ")
        word, rest = word.lower(), rest.strip()
        with self._lock:
            asked, self._asked = self._asked, None
            if asked is not None and (line.isdecimal() or line.lower() in YES):
                said, after, chosen, choices = asked
                number = int(line) if line.isdecimal() else choices  # yes to the only one
                if not 1 <= number <= choices or (choices > 1 and not line.isdecimal()):
                    self._asked = asked
                    raise UsageError(f"Choose a number, 1 to {choices}, or say it in other words.")
                return self._go(said, after, confirms, (*chosen, number))
            if word == "go":
                return self._go(line, rest, confirms)
            if word not in VERBS or not _is_for_verb(word, rest):
                return self._ask(Query(map=self.given.map, sentence=line))
            if word == "query" and not rest.startswith(("-", "'", '"')):
                return self._ask(Query(map=self.given.map, sentence=rest))
            if word in _MAP_VERBS:
                out = ["--out"] if word == "export" and rest[:1] not in ("", "-") else []
                verb = read_verb(_MAP_VERBS[word], [str(self.given.map), *out, *_split(rest)], word)
                return self._ask(verb)
            return getattr(self, f"_{word}")(rest)

    def names(self) -> tuple[str, ...]:
        """Return the names of what the map holds, those of things first; none while a question is being answered."""
        if self._names is None and self._lock.acquire(blocking=False):
            try:
                self._names = _names_in(self.opened)
            except AvlmapsError:  # the map can be queried in part; the lexicon's names are still completed
                self._names = ()
            finally:
                self._lock.release()
        return self._names or ()

    def _ask(self, verb: MapVerb) -> Reply:
        answer = verb.answer(self.opened)
        if isinstance(verb, Query):
            self._last = verb
        return Reply(answer, verb.lines(answer))

    def _sounds(self, rest: str) -> Reply:
        from avlmaps.query.selection import MapLists

        if rest:
            raise UsageError(f"sounds takes no words; {rest!r} is too much.")
        sounds = MapLists(self.opened).sounds()
        return Reply({"map": str(self.given.map), "frame": _FRAME, "sounds": sounds}, sound_lines(sounds))

    def _info(self, rest: str) -> Reply:
        verb = read_verb(Info, [str(self.given.map), *_split(rest)], "info")
        answer = describe_path(verb.path, verify=verb.verify, plot=verb.plot)
        return Reply(answer, info_lines(answer, verbose=verb.verbose))

    def _plot(self, rest: str) -> Reply:
        words = _split(rest)
        if len(words) != 1 or words[0].startswith("-"):
            raise UsageError("plot takes the name of a picture, such as: plot heat.png")
        file = user_path(words[0])
        if self._last is None:
            plotted = str(plot_named(self.opened, file))
        else:
            plotted = replace(self._last, plot=file).answer(self.opened).get("plot")
            if plotted is None:
                raise UsageError("The last answer has no heat to draw; ask another question.")
        return Reply({"plot": plotted}, [f"wrote {plotted}"])

    def _help(self, rest: str) -> Reply:
        lines = _HELP.splitlines()
        return Reply({"help": lines}, lines)

    def _go(self, line: str, rest: str, confirms: Callable[[str], bool], choose: tuple[int, ...] = ()) -> Reply:
        """Plan a command, and drive it in the scene where there is one and the user confirms.

        Where it asks which of several meanings or things is meant, the next line may be the number.
        """
        if not rest:
            raise UsageError("go takes a command, such as: go to the sofa, then turn left")
        quoted = len(rest) > 1 and rest[0] == rest[-1] and rest[0] in "'\""
        given = self.given
        command = going.Go(
            map=given.map, sentence=rest[1:-1] if quoted else line, scene=given.scene, body=given.body,
            guess=given.guess, choose=choose,
        )  # fmt: skip
        avlmap = self.opened
        translator = going.translator_for(command, avlmap)
        from avlmaps.language.translator import UnclearError

        try:
            translation = translator.program_for(command.sentence)
        except UnclearError as question:
            self._asked = (line, rest, choose, len(question.choices)) if question.numbered else None
            raise
        plan = going.plan_answer(command, translation, avlmap)
        self._asked = (line, rest, choose, len(plan["choices"])) if plan["choices"] else None
        if going.failure(plan) is not None:
            return _driven(plan)
        if given.scene is None:
            return Reply(plan, [*going.go_lines(plan), "planned only; --scene of avlmaps shell lets a robot drive"])
        for text in going.go_lines(plan):
            say(text)
        if not confirms(_CONFIRM):
            return Reply(plan, ["not driven"])
        from avlmaps.navigate.interrupts import raised_signals

        with raised_signals():
            if self._robot is None:
                self._robot = going.robot_of(command, avlmap, self._start)
            return _driven(going.drive(command, avlmap, self._robot, translator, translation))


def _driven(answer: dict[str, Any]) -> Reply:
    failed = going.failure(answer)
    if failed is not None:
        sys.stderr.write(f"avlmaps: {printable(failed['message'])}\n")
    return Reply({**answer, "error": failed}, going.go_lines(answer), failed is None)


def _is_for_verb(word: str, rest: str) -> bool:
    """Return whether a line that begins with a verb is for it; "things near the sofa" is a question."""
    if word in _WITH_WORDS or not rest or rest.startswith("-"):
        return True
    return word == "locate" and (bool(_PICTURE.search(rest.split(" -")[0])) or user_path(rest).is_file())


def _split(rest: str) -> list[str]:
    try:
        return shlex.split(rest)
    except ValueError as fault:
        raise UsageError(f"The words cannot be separated ({fault}); close each quote.") from None


def _names_in(opened: "AVLMap") -> tuple[str, ...]:
    models = opened.data.info.models
    things = [t.name for t in opened.things(None, _LEAST_COMPLETED)] if "pixels" in models else []
    rooms = [room.name for room in opened.rooms()] if "views" in models else []
    sounds = [event.names[0] for event in opened.sounds() if event.names]
    return tuple(dict.fromkeys([*things, *rooms, *sounds]))


class Lines:
    """The lines of a shell, one after the other.

    The answer to a question is the next line where that is a yes or a no. Any other line means no, and is the next
    line of the shell.
    """

    def __init__(self, read: Callable[[str], str | None], interactive: bool = False) -> None:
        """Take what reads a line after it showed a question, "" at the prompt; it returns None at the end.

        Ctrl-C stops one answer where a person types the lines, else the shell.
        """
        self._read, self.interactive = read, interactive
        self._kept: str | None = None

    def next(self) -> str | None:
        """Return the next line; None at the end."""
        line, self._kept = self._kept or self._read(""), None
        return line and line.strip()

    def confirms(self, question: str) -> bool:
        """Return whether the answer to a question is yes."""
        line = self._read(question) or ""
        if line.strip().lower() not in YES | _NO:
            self._kept = line
        return line.strip().lower() in YES


def piped_lines(stream: TextIO) -> Lines:
    """Return the lines of a file or a pipe."""

    def read(question: str) -> str | None:
        if question:
            say(question)
        return stream.readline() or None

    return Lines(read)


def answer_lines(session: ShellSession, lines: Lines, as_json: bool) -> tuple[int, int]:
    """Answer every line, also after one that fails; return how many failed, and how many there were."""
    failed = done = 0
    while True:
        try:
            line = lines.next()
            if line is None or line.lower() in ("quit", "exit"):
                return failed, failed + done
            if not line or line.startswith("#"):
                continue
            reply = session.answer(line, lines.confirms)
            emit(reply.answer, reply.lines, as_json)
            failed, done = failed + (not reply.ok), done + reply.ok
        except BrokenPipeError:
            raise
        except KeyboardInterrupt as stop:
            if not lines.interactive or getattr(stop, "number", signal.SIGINT) != signal.SIGINT:
                raise
            failed += 1
            _report(stop, str(stop) or "stopped", as_json)
        except Exception as fault:  # noqa: BLE001 - one line that fails must not end the others
            failed += 1
            known = isinstance(fault, AvlmapsError | UsageError)
            _report(fault, str(fault) if known else fault_sentence(fault), as_json)
        sys.stdout.flush()


def _report(error: BaseException, sentence: str, as_json: bool) -> None:
    end_bars()
    if as_json:
        emit({"error": error_answer(kind_of(error), sentence)}, (), as_json=True)
    sys.stderr.write(f"avlmaps: {printable(sentence)}\n")


def _piped() -> Lines:
    if isinstance(sys.stdin, TextIOWrapper):
        sys.stdin.reconfigure(errors="replace")  # a line that is not UTF-8 is not understood, and the next one is
    return piped_lines(sys.stdin)


def _prompt(session: ShellSession, with_history: bool) -> Lines:
    try:
        from avlmaps.cli.shell_prompt import NameCompleter, prompt_reader
    except ImportError:
        raise BackendError(
            f"A prompt on a terminal needs prompt-toolkit; get it with: {install_command('shell')}, or pipe lines in."
        ) from None
    completer = NameCompleter(VERBS, WITH_FILES, session.names)
    return Lines(prompt_reader(completer, with_history), interactive=True)
