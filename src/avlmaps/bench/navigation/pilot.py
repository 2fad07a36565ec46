"""Sending a robot on a mission: sentence, program, skills, driver, body; and judging every stop."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avlmaps.bench.navigation.configurations import Configuration
from avlmaps.bench.navigation.episodes import Episode, Leg
from avlmaps.bench.navigation.floor import Floor
from avlmaps.bench.navigation.goals import Goal
from avlmaps.bench.navigation.metrics import path_length_m
from avlmaps.bench.navigation.missions import Mission
from avlmaps.bench.navigation.perceived import KnownScene, Perceived
from avlmaps.bench.navigation.watched import WatchedBody
from avlmaps.core.errors import AvlmapsError
from avlmaps.core.motion import GroundPose
from avlmaps.language.program import Budget, parse_program, run_program
from avlmaps.language.translator import Translator
from avlmaps.navigate.driver import Driver
from avlmaps.navigate.moves import Move
from avlmaps.navigate.readable import Readable
from avlmaps.navigate.skills import Robot, RobotSettings

# No limit by the clock: how busy a machine is must not decide what a robot reaches.
_BUDGET = Budget(seconds=1e6)
_MOST_HEATS = 100  # kept in memory
Launch = Callable[[GroundPose], tuple[Driver, WatchedBody]]


@dataclass(frozen=True, eq=False)
class Pilot:
    """What is needed to send robots on missions in one scene.

    Attributes:
        scene: its map and its truth.
        floor: where one can truly drive.
        launch: puts a body at a place and gives a driver for it.
        translator: from sentences to programs; None runs the missions' own programs.
        photos: folder of the photos.
        photo_names: the files of a mission's photos, as it names them.
        guess: whether robots go to the best guess where the map is not sure.
        seed: of the benchmark.
    """

    scene: KnownScene
    floor: Floor
    launch: Launch
    translator: Translator | None
    photos: Path
    photo_names: Callable[[Mission], tuple[str, ...]]
    guess: bool = True
    seed: int = 0

    def run(self, mission: Mission, configuration: Configuration, key: str = "") -> Episode:
        """Send a robot on a mission.

        Where a program breaks off at a goal that the map does not know, the robot is told the remaining goals, from
        where it stands, so that they count by themselves.

        Args:
            mission: what to do.
            configuration: whose senses.
            key: of the record.
        """
        if len(self.scene.heats) > _MOST_HEATS:
            self.scene.heats.clear()
        driver, body = self.launch(mission.pose)
        asked = Perceived(self.scene, configuration.senses)
        robot = Robot(asked, driver, RobotSettings(guess=self.guess, persist=True), Readable((self.photos,)))
        told, programs, legs, understood = self._driven(mission, robot, driver)
        return Episode(
            mission.name, mission.series, mission.scene, configuration.name, self.seed, tuple(told), tuple(programs),
            tuple(legs), body.contacts, body.foretold, understood, key,
        )  # fmt: skip

    def _driven(self, mission: Mission, robot: Robot, driver: Driver) -> tuple[list[str], list[str], list[Leg], bool]:
        files = self.photo_names(mission)
        told: list[str] = []
        programs: list[str] = []
        legs: list[Leg] = []
        while len(legs) < len(mission.goals):
            told.append(mission.sentence(len(legs), files))
            rest = mission.goals[len(legs) :]
            try:
                program = self._program(mission, len(legs), files, told[-1])
                programs.append(program)
                parsed = parse_program(program)
            except AvlmapsError as fault:
                legs += [self._missed(goal, driver.pose, str(fault)) for goal in rest]
                return told, programs, legs, False
            begin, before = driver.pose, len(robot.moves)
            trace = run_program(parsed, robot, _BUDGET)
            legs += self._judged(rest, begin, robot.moves[before:])
            if trace.error is None:
                rest = mission.goals[len(legs) :]
                legs += [self._missed(goal, driver.pose, "The program ends before it.") for goal in rest]
            elif len(legs) < len(mission.goals):
                legs.append(self._missed(mission.goals[len(legs)], driver.pose, trace.error))
        return told, programs, legs, True

    def _program(self, mission: Mission, first: int, files: tuple[str, ...], command: str) -> str:
        if self.translator is None:
            return mission.program(first, files)
        return self.translator.program_for(command).program

    def _judged(self, goals: Sequence[Goal], begin: GroundPose, moves: Sequence[Move]) -> list[Leg]:
        """Return a leg for each movement that was for a goal: a place for a place, a turn for a way to look."""
        legs: list[Leg] = []
        for move in moves:
            pose = GroundPose(move.stop[0], move.stop[1], move.heading_rad)
            if len(legs) < len(goals) and goals[len(legs)].moves == (move.goal is not None):
                legs.append(self._leg(goals[len(legs)], begin, pose, move))
            begin = pose
        return legs

    def _leg(self, goal: Goal, begin: GroundPose, pose: GroundPose, move: Move) -> Leg:
        off_m = float(goal.off_m(np.array([[pose.x_m, pose.y_m]]))[0])
        stop = (round(pose.x_m, 4), round(pose.y_m, 4), round(pose.heading_rad, 4))
        return Leg(
            goal.said, goal.kind, stop, round(off_m, 4) if np.isfinite(off_m) else None, goal.reached(pose),
            self.floor.reachable(goal), self._shortest_m(goal, begin), round(path_length_m(move.path.tolist()), 4),
            len(move.actions), move.contacts, move.note,
        )  # fmt: skip

    def _missed(self, goal: Goal, pose: GroundPose, note: str) -> Leg:
        reachable, shortest_m = self.floor.reachable(goal), self._shortest_m(goal, pose)
        return Leg(goal.said, goal.kind, None, None, False, reachable, shortest_m, note=note)

    def _shortest_m(self, goal: Goal, pose: GroundPose) -> float | None:
        shortest_m = self.floor.shortest_m(goal, np.array([pose.x_m, pose.y_m]))
        return round(shortest_m, 4) if np.isfinite(shortest_m) else None
