"""From a command to what the robot did: translate, parse, run, and try again where the translator can.

The whole path in one function; a program is data all along, and nothing but the table of skills ever runs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import LanguageError, ProgramError, SeveralFitError
from avlmaps.core.motion import Action
from avlmaps.core.poses import FRAME
from avlmaps.language.program import Budget, Step, Trace, parse_program, run_program
from avlmaps.language.sentence import Attachments
from avlmaps.language.translator import LearnedTranslator, Translation, Translator
from avlmaps.navigate.brake import Brake, braked
from avlmaps.navigate.driver import Driver
from avlmaps.navigate.file_access import Readable, offered_by
from avlmaps.navigate.grounding import Heats
from avlmaps.navigate.skills import LoggedMove, Robot, RobotSettings
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.sound_sources import no_sources
from avlmaps.query.whereabouts import own_names

_MOST_PROGRAMS = 6
_NEAR_M = 1.0  # within this distance a goal counts as reached where the paper judges


@dataclass(frozen=True, slots=True)
class ReportedStep:
    """A step of a program, and the movement that it made.

    Attributes:
        step: the call of a skill.
        move: what the robot did; None where it did not move.
    """

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
    """The outcome of a command.

    Attributes:
        command: what was said.
        programs: what ran, in order; more than one where the translator had to try again.
        notes: what a person should know: why the map may be wrong, how a part was understood, where the map's
            confidence is low.
        done: every step, a failed one too.
        moves: every movement.
        error: why it was not obeyed to its end, one sentence; None where it was.
        error_type: the class of that error.
        elapsed_s: from the command to the end.
        choices: where each of the things is that fit equally, if the error asks which is meant.
    """

    command: str
    programs: tuple[str, ...]
    notes: tuple[str, ...]
    done: tuple[ReportedStep, ...]
    moves: tuple[LoggedMove, ...]
    error: str | None
    error_type: str | None
    elapsed_s: float
    choices: tuple[str, ...] = ()

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


def _silent(_: str) -> None:
    """Report nothing."""


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
    tell: Callable[[str], None] = _silent,
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
        for doubt in avlmap.doubts_of_drives:
            run.note(doubt)
        run.through(translation)
    run.judge()
    error, error_type = (None, None) if run.last is None else (run.last.error, run.last.error_type)
    return Outcome(
        command, tuple(run.programs), (*run.notes, *robot.seeker.notes), tuple(run.done), tuple(robot.moves), error,
        error_type, perf_counter() - begin, robot.seeker.choices,
    )  # fmt: skip


class _Run:
    """The programs of one command, one after the other until one runs to its end."""

    def __init__(
        self,
        command: str,
        translator: Translator,
        robot: Robot,
        budget: Budget | None,
        brake: Brake,
        tell: Callable[[str], None],
    ) -> None:
        self.command = command
        self.translator = translator
        self.robot = robot
        self.budget, self.brake = budget, brake
        self.tell = tell
        self.programs: list[str] = []
        self.notes: list[str] = []
        self.done: list[ReportedStep] = []
        self.last: Trace | None = None

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
        """Return the program that the translator writes instead; the request lists what was done."""
        done = [one.step.text for one in self.done if one.step.error is None]
        try:
            return self.translator.repair(self.command, program, trace.error or "", done)
        except LanguageError as fault:
            self.note(f"no other program came: {fault}")
            return None

    def judge(self) -> None:
        """Note what a person might take for more than it is."""
        if self.last is not None and self.last.error is None and not self.robot.moves:
            self.note("the program moved nothing")
        for move in self.robot.moves:
            if move.reached and move.distance_m is not None and move.distance_m > _NEAR_M:
                what = move.name or move.skill
                self.note(f"{what}: the nearest place where the robot could stop is {move.distance_m:.2f} m from it")

    def note(self, note: str) -> None:
        if note not in self.notes:  # a plan carries those of its rehearsal
            self.notes.append(note)
            self.tell(f"note: {note}")
