"""A program run on the map alone, before any robot moves: where it would go, and whether it can be done at all."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import GoalNotFoundError, QueryError, SeveralFitError
from avlmaps.core.motion import Action, GroundPose, Moved
from avlmaps.language.program import Budget, parse_program, run_program
from avlmaps.language.translator import LearnedTranslator, Translation
from avlmaps.maps.obstacles import Obstacles
from avlmaps.navigate.bodies import BASE, BodyShape
from avlmaps.navigate.driver import Arrival, MapDriver
from avlmaps.navigate.file_access import Readable, offered_by
from avlmaps.navigate.grounding import Heats
from avlmaps.navigate.instruct import Outcome, instruct
from avlmaps.navigate.skills import Robot, RobotSettings
from avlmaps.query.avlmap import AVLMap

_ABSENT = (GoalNotFoundError.__name__, QueryError.__name__)
NO_FILES = Readable((), ())
"""A program may load no file."""


class FreeBody:
    """A body without a world: every movement is done exactly. The driver's own map holds it off the walls."""

    def __init__(self, pose: GroundPose) -> None:
        """Put it at a pose of the level frame."""
        self.pose = pose

    def act(self, action: Action) -> Moved:
        """Take one of the paper's actions."""
        self.pose = self.pose.after(action)
        return Moved(self.pose)


class _StandingDriver:
    """Says of every movement that it is done, and moves nothing: what the map knows is queried without a robot."""

    def __init__(self, pose: GroundPose) -> None:
        self.pose = pose

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        return self.stop()

    def turn(self, angle_rad: float) -> Arrival:
        return self.stop()

    def forward(self, distance_m: float) -> Arrival:
        return self.stop()

    def stop(self) -> Arrival:
        return Arrival(True, self.pose, (), np.zeros((1, 2)))


def consulted(
    words: str,
    translation: Translation,
    avlmap: AVLMap,
    start: GroundPose,
    settings: RobotSettings | None = None,
    heats: Heats | None = None,
) -> Outcome:
    """Return what the map says of a program whose every movement is done at once: notes, why it ends early, choices.

    ``heats`` takes what the map answers, for the drive.
    """
    driver = _StandingDriver(start)
    robot = Robot(avlmap, driver, settings, offered_by(words), pause=lambda _: None, heats=heats)
    trace = run_program(parse_program(translation.program), robot)
    notes = (*avlmap.doubts_of_drives, *translation.notes, *robot.seeker.notes)
    return Outcome(
        words, (translation.program,), notes, (), tuple(robot.moves), trace.error, trace.error_type, 0.0,
        robot.seeker.choices,
    )  # fmt: skip


def unfound(
    words: str,
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
    told = consulted(words, translation, avlmap, start, settings, heats)
    asks = told.error_type == SeveralFitError.__name__
    if told.error is None or not (asks or (told.error_type in _ABSENT and told.moves)):
        return None
    return replace(told, moves=(), error=f"{told.error.rstrip('.')}. The robot was not moved.")


def rehearse(
    words: str,
    translation: Translation,
    avlmap: AVLMap,
    obstacles: Obstacles,
    start: GroundPose,
    *,
    shape: BodyShape = BASE,
    settings: RobotSettings | None = None,
    budget: Budget | None = None,
    readable: Readable = NO_FILES,
    tell: Callable[[str], None] = lambda _: None,
    heats: Heats | None = None,
) -> Outcome:
    """Run a program on the map alone, with a body that meets no obstacle; waits take no time."""
    driver = MapDriver(obstacles, FreeBody(start), shape)
    return instruct(
        words, avlmap, driver, LearnedTranslator(), budget, settings=settings, readable=readable,
        translation=translation, tell=tell, pause=lambda _: None, heats=heats,
    )  # fmt: skip


def path_in_world(outcome: Outcome, avlmap: AVLMap, floor_m: float, most: int = 500) -> Float[np.ndarray, "n 3"]:
    """Return the path of an outcome in the recording frame, thinned evenly.

    Args:
        outcome: of a rehearsal or a drive.
        avlmap: the map.
        floor_m: level height of the floor.
        most: at most this number of points; the first and the last are always there.
    """
    xy = outcome.path
    if len(xy) > most:
        xy = xy[np.unique(np.linspace(0, len(xy) - 1, most).round().astype(int))]
    level = np.column_stack([xy, np.full(len(xy), floor_m)])
    return np.array([avlmap.space.world(point) for point in level]).reshape(-1, 3)
