"""From a command to what the robot did: translate, parse, run, and try again where the translator can.

A program is data all along, and nothing but the table of skills ever runs. `rehearse` runs it on the map alone, before
any robot moves: where it would go, and whether it can be done at all.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import GoalNotFoundError, LanguageError, ProgramError, QueryError, SeveralFitError
from avlmaps.core.motion import Action, GroundPose, Moved
from avlmaps.core.poses import FRAME
from avlmaps.core.wording import option
from avlmaps.language.program import Budget, Step, Trace, parse_program, run_program
from avlmaps.language.sentence import Attachments
from avlmaps.language.translator import LearnedTranslator, Translation, Translator
from avlmaps.navigate.brake import Brake, braked
from avlmaps.navigate.driver import Arrival, Driver
from avlmaps.navigate.file_access import Readable, offered_by
from avlmaps.navigate.grounding import Heats
from avlmaps.navigate.skills import LoggedMove, Robot, RobotSettings
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import own_names
from avlmaps.query.sound_sources import no_sources

_MOST_PROGRAMS = 6
_NEAR_M = 1.0  # within this distance a goal counts as reached where the paper judges
MOVED_NOTHING = "the program moved nothing"
_ABSENT = (GoalNotFoundError.__name__, QueryError.__name__)
NO_FILES = Readable((), ())
"""A program may load no file."""


@dataclass(frozen=True, slots=True)
class ReportedStep:
    """A step of a program, and the movement that it made, None where it made none."""

    step: Step
    move: LoggedMove | None

    def to_json(self) -> dict[str, Any]:
        """Return the step as JSON has it; a movement is its result."""
        answer = self.step.to_json()
        return answer if self.move is None else {**answer, "result": self.move.to_json()}

    def __str__(self) -> str:
        text = f"line {self.step.line}: {self.step.text}"
        return text if self.move is None else f"{text}: {self.move}"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a command."""

    command: str
    programs: tuple[str, ...]  # that ran, in order; more than one where the translator had to try again
    notes: tuple[str, ...]  # why the map may be wrong, how a part was understood, where it is not sure
    done: tuple[ReportedStep, ...]  # a failed one too
    moves: tuple[LoggedMove, ...]
    error: str | None  # why it was not obeyed to its end, one sentence
    error_type: str | None  # the class of that error
    elapsed_s: float
    choices: tuple[str, ...] = ()  # places of the things that fit equally, if the error asks which is meant

    @property
    def ok(self) -> bool:
        """Whether the program ran to its end and every place was reached."""
        return self.error is None and all(move.reached for move in self.moves)

    @property
    def program(self) -> str:
        """The program; where there were several, one after the other."""
        return "\n# What was left to do:\n".join(self.programs)

    @property
    def subgoals(self) -> tuple[LoggedMove, ...]:
        """The movements to a place, in order."""
        return tuple(move for move in self.moves if move.goal is not None)

    @property
    def actions(self) -> tuple[Action, ...]:
        """All discrete actions, in order."""
        return tuple(action for move in self.moves for action in move.actions)

    @property
    def path(self) -> Float[np.ndarray, "n 2"]:
        """The places passed, level x and y, metres."""
        return np.concatenate([np.zeros((0, 2)), *(move.path for move in self.moves)])

    @property
    def path_m(self) -> float:
        """How far the robot drove."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())

    def to_json(self) -> dict[str, Any]:
        """Return the outcome with the keys of the command line's contract."""
        return {
            "program": self.program,
            "steps": [one.to_json() for one in self.done],
            "actions": [str(action) for action in self.actions],
            "subgoals": [move.to_json() for move in self.subgoals],
            "ok": self.ok,
            "error": self.error,
            "error_type": self.error_type,
            "notes": list(self.notes),
            "choices": list(self.choices),
            "path_m": round(self.path_m, 3),
            "elapsed_s": round(self.elapsed_s, 3),
            "frame": FRAME,
        }


def given_by(avlmap: AVLMap, image: str | None = None, clip: str | None = None, *, said: str = "") -> Attachments:
    """Return what a command to a robot (``said``) may mean: the map's names, and which places its sounds have."""
    sounds_at, own = avlmap.settings.sounds.at, own_names(avlmap, said)
    return Attachments(image, clip, avlmap.knows, sounds_at, own, lambda: no_sources(avlmap))


def settings_after(translation: Translation, settings: RobotSettings) -> RobotSettings:
    """Return settings with the numbers that choose a thing: the first of them may have chosen a meaning."""
    return replace(settings, choose=settings.choose[1:]) if translation.chosen else settings


def instruct(
    command: str,
    avlmap: AVLMap,
    driver: Driver,
    translator: Translator,
    budget: Budget | None = None,
    *,
    settings: RobotSettings | None = None,
    readable: Readable | None = None,
    translation: Translation | None = None,
    tell: Callable[[str], None] = lambda _: None,
    pause: Callable[[float], None] | None = None,
    brake: Brake | None = None,
    heats: Heats | None = None,
) -> Outcome:
    """Do what a command says. An area that is forbidden meanwhile ends it.

    Args:
        command: what a person says, such as ``go to the chair near the sound of glass breaking``.
        avlmap: the map.
        driver: moves the robot, in the map's level frame.
        translator: turns the command into a program; a learned one that knows no map is given this one.
        budget: what each run of a program may use up.
        settings: how the robot takes its skills.
        readable: which files the program may load; by default those in the working directory, and those that the
            command names.
        translation: the translator's answer to the command, if it exists already.
        tell: called with each line: the program, what is found, each step.
        pause: waits for some seconds, for the skill ``wait``; by default as long as nothing stops the drive.
        brake: stops the drive from another thread.
        heats: what this map answered before, so that it is not queried again.

    Raises:
        LanguageError: the command was not understood. All later faults are in the outcome.
    """
    begin = perf_counter()
    if translation is None and isinstance(translator, LearnedTranslator) and not translator.knows_map:
        translator = LearnedTranslator(given_by(avlmap, said=command))
    translation = translation or translator.program_for(command)
    brake = brake or Brake(avlmap)
    with braked(driver, brake) as held:
        files = readable or offered_by(command)
        robot = Robot(avlmap, held, settings, files, lambda line: tell(f"  {line}"), pause or brake.pause, heats)
        run = _Run(command, translator, robot, budget, brake, tell)
        for doubt in (*avlmap.data.info.doubts, *avlmap.edited.unheeded):
            run.note(doubt)
        run.through(translation)
    run.judge()
    error, error_type = (None, None) if run.last is None else (run.last.error, run.last.error_type)
    return Outcome(
        command, tuple(run.programs), (*run.notes, *robot.seeker.notes), tuple(run.done), tuple(robot.moves), error,
        error_type, perf_counter() - begin, robot.seeker.choices,
    )  # fmt: skip


@dataclass(slots=True)
class _Run:
    """The programs of one command, one after the other until one runs to its end."""

    command: str
    translator: Translator
    robot: Robot
    budget: Budget | None
    brake: Brake
    tell: Callable[[str], None]
    programs: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    done: list[ReportedStep] = field(default_factory=list)
    last: Trace | None = None

    def through(self, translation: Translation | None) -> None:
        while translation is not None:
            self.programs.append(translation.program)
            for note in translation.notes:
                self.note(note)
            if translation.plan:
                self.tell(translation.plan)
            for line in translation.program.splitlines():
                self.tell(f"> {line}")
            self.last = self.ran(translation.program)
            asks = self.last.error_type == SeveralFitError.__name__  # the person answers, and no translator
            if self.last.error is None or asks or len(self.programs) == _MOST_PROGRAMS or self.brake.pulled:
                return
            translation = self.repaired(translation.program, self.last)
            if translation is not None:
                self.tell(f"failed: {self.last.error}")

    def ran(self, text: str) -> Trace:
        try:
            program = parse_program(text)
        except ProgramError as fault:
            return Trace((), str(fault), type(fault).__name__, 0.0)
        return run_program(program, self.robot, self.budget, self.on_step)

    def on_step(self, step: Step) -> None:
        moved = self.robot.moves[sum(one.move is not None for one in self.done) :]
        self.done.append(ReportedStep(step, moved[-1] if moved else None))
        if moved or step.error is None:
            self.tell(str(self.done[-1]))

    def repaired(self, program: str, trace: Trace) -> Translation | None:
        done = [one.step.text for one in self.done if one.step.error is None]
        try:
            return self.translator.repair(self.command, program, trace.error or "", done)
        except LanguageError as fault:
            self.note(f"no other program came: {fault}")
            return None

    def judge(self) -> None:
        """Note what a person might take for more than it is."""
        is_done = self.last is not None and self.last.error is None
        if is_done and not self.robot.moves:
            self.note(MOVED_NOTHING)
        if is_done and self.robot.seeker.numbers:
            self.note(f"{option('choose')} has no effect: nothing is left to choose.")
        for move in self.robot.moves:
            if move.reached and move.distance_m is not None and move.distance_m > _NEAR_M:
                what = move.name or move.skill
                self.note(f"{what}: the robot stopped {move.distance_m:.2f} m from it")

    def note(self, note: str) -> None:
        if note not in self.notes:  # a plan carries those of its rehearsal
            self.notes.append(note)
            self.tell(f"note: {note}")


class FreeBody:
    """A body without a world: every movement is done exactly. The driver's own map holds it off the walls."""

    def __init__(self, pose: GroundPose) -> None:
        self.pose = pose

    def act(self, action: Action) -> Moved:
        """Take one of the paper's actions."""
        self.pose = self.pose.after(action)
        return Moved(self.pose)


class InstantDriver:
    """Is wherever it is sent, at once and through walls: for what the map knows of a program, without a robot."""

    def __init__(self, avlmap: AVLMap, pose: GroundPose) -> None:
        self._space, self.pose = avlmap.space, pose

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Be there, looking where it looked before."""
        x_m, y_m, _ = (float(value) for value in self._space.level(place))
        return self._at(lambda: replace(self.pose, x_m=x_m, y_m=y_m))

    def turn(self, angle_rad: float) -> Arrival:
        """Look there."""
        return self._at(lambda: self.pose.turned(angle_rad))

    def forward(self, distance_m: float) -> Arrival:
        """Be straight ahead."""
        return self._at(lambda: self.pose.ahead(distance_m))

    def stop(self) -> Arrival:
        """Stand."""
        return self._at(lambda: self.pose)

    def _at(self, pose_after: Callable[[], GroundPose]) -> Arrival:
        note = ""
        try:
            self.pose = pose_after()
        except ValueError:  # a `GroundPose` lies within 1e9 m
            note = "the place is off the map"
        return Arrival(not note, self.pose, (), np.array([[self.pose.x_m, self.pose.y_m]]), note)


def rehearse(
    command: str,
    translation: Translation,
    avlmap: AVLMap,
    driver: Driver,
    *,
    settings: RobotSettings | None = None,
    budget: Budget | None = None,
    readable: Readable | None = NO_FILES,
    heats: Heats | None = None,
) -> Outcome:
    """Plan: run a program on the map alone; waits take no time.

    The driver is an `InstantDriver` for what the map knows, or, for the path as well, a ``MapDriver`` of a `FreeBody`.
    """
    return instruct(
        command, avlmap, driver, LearnedTranslator(), budget, settings=settings, readable=readable,
        translation=translation, pause=lambda _: None, heats=heats,
    )  # fmt: skip


def unfound(
    command: str,
    translation: Translation,
    avlmap: AVLMap,
    start: GroundPose,
    settings: RobotSettings | None = None,
    heats: Heats | None = None,
) -> Outcome | None:
    """Return the outcome of a program that the map lets not run to its end; None for any other.

    It would drive and then ask for what the map lacks, or several things fit equally and none was chosen. The program's
    steps must depend on nothing that a drive would find out.
    """
    driver = InstantDriver(avlmap, start)
    told = rehearse(command, translation, avlmap, driver, settings=settings, readable=None, heats=heats)
    asks = told.error_type == SeveralFitError.__name__
    if told.error is None or not (asks or (told.error_type in _ABSENT and told.moves)):
        return None
    return replace(told, done=(), moves=(), error=f"{told.error.rstrip('.')}. The robot was not moved.")


def path_in_world(outcome: Outcome, avlmap: AVLMap, floor_m: float, most: int = 500) -> Float[np.ndarray, "n 3"]:
    """Return the path of an outcome in the recording frame, thinned evenly to ``most`` points, its ends among them.

    ``floor_m`` is the level height of the floor.
    """
    xy = outcome.path
    if len(xy) > most:
        xy = xy[np.unique(np.linspace(0, len(xy) - 1, most).round().astype(int))]
    level = np.column_stack([xy, np.full(len(xy), floor_m)])
    return np.array([avlmap.space.world(point) for point in level]).reshape(-1, 3)
