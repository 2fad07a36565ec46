"""Sending a robot on a mission: sentence, program, skills, driver, body; and judging every stop."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.motion import FORWARD_M, Action, GroundPose, Moved
from avlmaps.language.program import Budget, parse_program, run_program
from avlmaps.language.translator import Translator
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.navigate.driver import Body, Driver
from avlmaps.navigate.file_access import Readable
from avlmaps.navigate.skills import LoggedMove, Robot, RobotSettings
from avlmaps_sim.bench.navigation.episodes import Episode, Leg, path_length_m
from avlmaps_sim.bench.navigation.evidence import Floor
from avlmaps_sim.bench.navigation.map_variants import Configuration, KnownScene, Perceived
from avlmaps_sim.bench.navigation.missions import Goal, Mission

_EXACT_M = 1e-6


@dataclass(frozen=True, eq=False)
class Foreknowledge:
    """The obstacles that a map knows before a robot drives."""

    obstacles: Obstacles
    radius_m: float

    def room_m(self, xy: tuple[float, float]) -> float:
        """Return the distance from a place (level x and y) to the nearest occupied cell, inf beyond the radius."""
        cell_m, origin = self.obstacles.cell_size_m, self.obstacles.origin_m
        at = np.asarray(xy, np.float64) - origin
        low = np.maximum(np.floor((at - self.radius_m) / cell_m).astype(np.int64), 0)
        high = np.maximum(np.floor((at + self.radius_m) / cell_m).astype(np.int64) + 1, 0)
        near = self.obstacles.states[low[0] : high[0], low[1] : high[1]] == CellState.OCCUPIED
        corner = (np.argwhere(near) + low) * cell_m
        if not len(corner):
            return np.inf
        apart = np.maximum(np.maximum(corner - at, at - corner - cell_m), 0.0)
        return float(np.linalg.norm(apart, axis=1).min())

    def foretells(self, xy: tuple[float, float]) -> bool:
        """Return whether the map shows an obstacle within the robot's radius of a place (level x and y)."""
        return self.room_m(xy) < self.radius_m - _EXACT_M


class WatchedBody:
    """Passes every movement on to a body and counts what it touched."""

    def __init__(self, body: Body, known: Foreknowledge) -> None:
        self._body, self._known = body, known
        self.contacts = 0
        self.foretold = 0

    @property
    def pose(self) -> GroundPose:
        """Where the body is."""
        return self._body.pose

    def act(self, action: Action) -> Moved:
        """Take an action."""
        aimed = self.pose.ahead(FORWARD_M) if action is Action.FORWARD else self.pose
        return self._counted(aimed, self._body.act(action))

    def _counted(self, aimed: GroundPose, moved: Moved) -> Moved:
        if moved.contact:
            self.contacts += 1
            self.foretold += self._known.foretells((aimed.x_m, aimed.y_m))
        return moved


# No limit by the clock: how busy a machine is must not decide what a robot reaches.
_BUDGET = Budget(seconds=1e6)
_MOST_HEATS = 100  # in memory
Launch = Callable[[GroundPose], tuple[Driver, WatchedBody]]


@dataclass(slots=True)
class _Log:
    """The commands and movements of a mission until now."""

    commands: list[str] = field(default_factory=list)
    programs: list[str] = field(default_factory=list)
    legs: list[Leg] = field(default_factory=list)
    understood: bool = True


@dataclass(frozen=True, eq=False)
class Pilot:
    """Everything that a mission in one scene needs.

    ``launch`` puts a body at a place and gives a driver for it; without a translator the missions' own programs run.
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

        Where a program breaks off, because the map does not know a goal, the robot goes to those that it has not been
        to one by one, from where it stands, so that each counts by itself.
        """
        if len(self.scene.heats) > _MOST_HEATS:
            self.scene.heats.clear()
        driver, body = self.launch(mission.pose)
        asked = Perceived(self.scene, configuration.senses)
        robot = Robot(asked, driver, RobotSettings(guess=self.guess, persist=True), Readable((self.photos,)))
        log = self._driven(mission, robot, driver)
        return Episode(
            mission.name, mission.series, mission.scene, configuration.name, self.seed, tuple(log.commands),
            tuple(log.programs), tuple(log.legs), body.contacts, body.foretold, log.understood, key,
        )  # fmt: skip

    def _driven(self, mission: Mission, robot: Robot, driver: Driver) -> _Log:
        files, goals, log = self.photo_names(mission), mission.goals, _Log()
        error = self._command(mission.sentence(files), mission.program(files), goals, robot, log)
        broke_off = error is not None and log.understood and len(goals) > 1
        for number in range(len(log.legs), len(goals)):
            if broke_off:
                alone = goals[number : number + 1]
                own = self._command(mission.sentence(files, number), mission.program(files, number), alone, robot, log)
            else:
                own = error
            if len(log.legs) <= number:
                log.legs.append(self._missed(goals[number], driver.pose, own or "The program ends before it."))
        return log

    def _command(self, command: str, program: str, goals: Sequence[Goal], robot: Robot, log: _Log) -> str | None:
        """Give the robot a command and judge its stops; return why it broke off, None where it did not."""
        log.commands.append(command)
        try:
            if self.translator is not None:
                program = self.translator.program_for(command).program
            log.programs.append(program)
            parsed = parse_program(program)
        except AvlmapsError as fault:
            log.understood = False
            return str(fault)
        begin, before = robot.driver.pose, len(robot.moves)
        trace = run_program(parsed, robot, _BUDGET)
        log.legs += self._judged(goals, begin, robot.moves[before:])
        return trace.error

    def _judged(self, goals: Sequence[Goal], begin: GroundPose, moves: Sequence[LoggedMove]) -> list[Leg]:
        legs: list[Leg] = []
        for move in moves:
            pose = GroundPose(move.stop[0], move.stop[1], move.heading_rad)
            if len(legs) < len(goals) and goals[len(legs)].moves == (move.goal is not None):
                legs.append(self._leg(goals[len(legs)], begin, pose, move))
            begin = pose
        return legs

    def _leg(self, goal: Goal, begin: GroundPose, pose: GroundPose, move: LoggedMove) -> Leg:
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
