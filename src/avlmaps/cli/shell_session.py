"""The session of `avlmaps shell`: one open map, and an answer for each line."""

import re
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal

from avlmaps.cli import export as exporting
from avlmaps.cli import go as going
from avlmaps.cli import locate as locating
from avlmaps.cli import query as querying
from avlmaps.cli import rooms as naming
from avlmaps.cli import things as listing
from avlmaps.cli.info import Info, describe_path, info_lines, plot_named
from avlmaps.cli.output import UsageError, query_lines
from avlmaps.cli.usage import read_verb
from avlmaps.core.errors import AvlmapsError
from avlmaps.core.files import user_path
from avlmaps.core.printable import printable
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from avlmaps.core.motion import GroundPose
    from avlmaps.query.avlmap import AVLMap

_HELP = """\
A line is a question, as `avlmaps query` takes it, or begins with a verb:
  the red cabinet near the sound of a dog    places in the map
  query --object sofa --area kitchen         the same in parts, with the options of `avlmaps query`
  things [--least 0.7] [--room kitchen] ...  the things, sounds and rooms of the map
  sounds                                     its sounds
  rooms [--plot FILE]                        its rooms
  info [--verify]                            a description of the map
  locate photo.jpg                           the pose of the camera that took a photo
  go to the sofa, then turn left             the plan of a command; with --scene the simulated robot drives it
  plot FILE                                  a picture of the last answer, or of the map
  export FILE [--heat "the sofa"]            the map for other programs: .ply, .glb, ... (export --help)
  help                                       this text; VERB --help lists the options of a verb
  quit                                       the end, as Ctrl-D; Ctrl-C stops an answer"""
_PICTURE = re.compile(r"\.(jpe?g|png|webp|bmp|tiff?|ppm|pgm)['\"]?$", re.IGNORECASE)
_CONFIRM = "Drive this plan? [y/N]"
_LEAST_COMPLETED = 0.3  # things with this confidence are completed


class Over(Exception):  # noqa: N818 - no error: the user ends the shell
    """The shell ends."""


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a line.

    Attributes:
        answer: as JSON has it.
        lines: for a person.
        ok: whether it did what the line asks for.
    """

    answer: Mapping[str, Any]
    lines: Iterable[str]
    ok: bool = True


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """The settings of a session.

    Attributes:
        map: folder of the map.
        scene: in which the simulated robot drives; None plans only.
        start: where it starts; None is where the walk began.
        body: of the robot.
        guess: whether it drives to the best guess where the map has no confident answer.
    """

    map: Path
    scene: str | None = None
    start: "GroundPose | None" = None
    body: Literal["base", "drone"] = "base"
    guess: bool = False


class ShellSession:
    """One map that stays open, and what was queried last.

    Attributes:
        given: the map, and the robot of `go`.
    """

    def __init__(self, given: SessionSettings) -> None:
        """Open the map.

        Raises:
            MapError: the map cannot be opened.
        """
        self.given = given
        self._robot: going.Ready | None = None
        self._last: querying.Query | None = None
        self._names: tuple[str, ...] | None = None
        self._lock = Lock()
        self._opened, self._seen = self._open()

    def _open(self) -> "tuple[AVLMap, tuple[int, ...]]":
        from avlmaps.query.avlmap import AVLMap

        seen = self._signature()
        return AVLMap.open(self.given.map), seen

    def _signature(self) -> tuple[int, ...]:
        """Return the state that changes when a build replaces the map."""
        try:
            found = (self.given.map / "map.json").stat()
        except OSError:
            return ()
        return found.st_ino, found.st_mtime_ns, found.st_size

    @property
    def opened(self) -> "AVLMap":
        """The map; opened again where it was replaced on disk since."""
        if self._signature() not in (self._seen, ()):
            self._opened, self._seen = self._open()
            self._names, self._robot = None, None
            say(f"note: {self.given.map} was replaced on disk and is opened again.")
        return self._opened

    def answer(self, line: str, confirms: Callable[[str], bool]) -> Reply:
        """Answer a line.

        Raises:
            AvlmapsError: what the verb raises.
            UsageError: the words do not fit together.
        """
        word, _, rest = line.partition(" ")
        word, rest = word.lower(), rest.strip()
        with self._lock:
            if word == "go":
                return self._go(line, rest, confirms)
            if word in VERBS and _is_for_verb(word, rest):
                return VERBS[word](self, rest)
            return self._ask(querying.Query(map=self.given.map, sentence=line))

    def names(self) -> tuple[str, ...]:
        """Return the names of what the map holds, those of things first; none while a question is being answered."""
        if self._names is None and self._lock.acquire(blocking=False):
            try:
                self._names = _names_in(self._opened)
            except AvlmapsError:  # the map can be queried in part; the lexicon's names are still completed
                self._names = ()
            finally:
                self._lock.release()
        return self._names or ()

    def _ask(self, query: querying.Query) -> Reply:
        answer = querying.ask(query, self.opened)
        self._last = query
        return Reply(answer, query_lines(answer))

    def query(self, rest: str) -> Reply:
        """Query in parts, or by a sentence."""
        if rest.startswith(("-", "'", '"')):
            words = [str(self.given.map), *_split(rest)]
            return self._ask(read_verb(querying.Query, words, "query"))
        return self._ask(querying.Query(map=self.given.map, sentence=rest))

    def things(self, rest: str) -> Reply:
        """List things, sounds and rooms."""
        verb = read_verb(listing.Things, [str(self.given.map), *_split(rest)], "things")
        answer = listing.contents(verb, self.opened)
        return Reply(answer, listing.contents_lines(answer))

    def sounds(self, rest: str) -> Reply:
        """List the sounds."""
        from avlmaps.core.poses import FRAME
        from avlmaps.query.selection import MapLists

        _no_words("sounds", rest)
        sounds = MapLists(self.opened).sounds()
        return Reply({"map": str(self.given.map), "frame": FRAME, "sounds": sounds}, listing.sound_lines(sounds))

    def rooms(self, rest: str) -> Reply:
        """List the rooms."""
        verb = read_verb(naming.Rooms, [str(self.given.map), *_split(rest)], "rooms")
        answer = naming.rooms(verb, self.opened)
        return Reply(answer, naming.rooms_lines(answer))

    def info(self, rest: str) -> Reply:
        """Describe the map."""
        verb = read_verb(Info, [str(self.given.map), *_split(rest)], "info")
        answer = describe_path(verb.path, verb.format, verify=verb.verify, plot=verb.plot)
        return Reply(answer, info_lines(answer, verbose=verb.verbose))

    def locate(self, rest: str) -> Reply:
        """Locate a photo."""
        verb = read_verb(locating.Locate, [str(self.given.map), *_split(rest)], "locate")
        answer = locating.locate_photo(verb.map, verb.image, verb.intrinsics, self.opened)
        return Reply(answer, locating.locate_lines(answer))

    def plot(self, rest: str) -> Reply:
        """Draw the last answer, or the map."""
        words = _split(rest)
        if len(words) != 1 or words[0].startswith("-"):
            raise UsageError("plot takes the name of a picture, such as: plot heat.png")
        file = user_path(words[0])
        if self._last is None:
            plotted = str(plot_named(self.opened.stored, file))
        else:
            answer = querying.ask(replace(self._last, plot=file), self.opened)
            plotted = answer.get("plot")
            if plotted is None:
                raise UsageError("The last answer has no heat to draw; ask another question.")
        return Reply({"plot": plotted}, [f"wrote {plotted}"])

    def export(self, rest: str) -> Reply:
        """Write the map for other programs."""
        words = _split(rest)
        out = ["--out", *words] if words and not words[0].startswith("-") else words
        verb = read_verb(exporting.Export, [str(self.given.map), *out], "export")
        answer = exporting.export(verb, self.opened)
        return Reply(answer, exporting.export_lines(answer))

    def help(self, rest: str) -> Reply:
        """List the verbs."""
        lines = _HELP.splitlines()
        return Reply({"help": lines}, lines)

    def quit(self, rest: str) -> Reply:
        """End the shell."""
        raise Over

    def _go(self, line: str, rest: str, confirms: Callable[[str], bool]) -> Reply:
        """Plan a command, and drive it in the scene where there is one and the user confirms."""
        if not rest:
            raise UsageError("go takes a command, such as: go to the sofa, then turn left")
        quoted = len(rest) > 1 and rest[0] == rest[-1] and rest[0] in "'\""
        given = self.given
        command = going.Go(
            map=given.map, sentence=rest[1:-1] if quoted else line, scene=given.scene, body=given.body,
            guess=given.guess,
        )  # fmt: skip
        avlmap = self.opened
        translator = going.translator_for(command, avlmap)
        translation = translator.program_for(command.sentence)
        plan = going.plan_answer(command, translation, avlmap)
        if (missing := going.failure(plan)) is not None:
            sys.stderr.write(f"avlmaps: {printable(missing['message'])}\n")
            return Reply({**plan, "error": missing}, going.go_lines(plan), False)
        if given.scene is None:
            return Reply(plan, [*going.go_lines(plan), "planned only; --scene of avlmaps shell lets a robot drive"])
        for text in going.go_lines(plan):
            say(text)
        if not confirms(_CONFIRM):
            return Reply(plan, ["not driven"])
        from avlmaps.navigate.interrupts import raised_signals

        with raised_signals():
            if self._robot is None:
                self._robot = going.simulated_robot(command, avlmap, given.start)
            here = replace(self._robot, start=self._robot.driver.pose)
            answer = going.drive(command, avlmap, here, translator, translation)
        failed = going.failure(answer)
        if failed is not None:
            sys.stderr.write(f"avlmaps: {printable(failed['message'])}\n")
        return Reply({**answer, "error": failed}, going.go_lines(answer), failed is None)


VERBS: dict[str, Callable[[ShellSession, str], Reply]] = {
    "query": ShellSession.query,
    "things": ShellSession.things,
    "sounds": ShellSession.sounds,
    "rooms": ShellSession.rooms,
    "info": ShellSession.info,
    "locate": ShellSession.locate,
    "plot": ShellSession.plot,
    "export": ShellSession.export,
    "help": ShellSession.help,
    "quit": ShellSession.quit,
    "exit": ShellSession.quit,
}
_WITH_WORDS = ("query", "plot", "export")
WITH_FILES = ("locate", "plot", "export")


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


def _no_words(verb: str, rest: str) -> None:
    if rest:
        raise UsageError(f"{verb} takes no words; {rest!r} is too much.")


def _names_in(opened: "AVLMap") -> tuple[str, ...]:
    models = opened.stored.info.models
    things: Sequence[str] = [t.name for t in opened.things(None, _LEAST_COMPLETED)] if "pixels" in models else []
    rooms = [room.name for room in opened.rooms()] if "views" in models else []
    sounds = [event.names[0] for event in opened.sounds() if event.names]
    return tuple(dict.fromkeys([*things, *rooms, *sounds]))
