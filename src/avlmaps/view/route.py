"""A command typed into a page: its readings, its program, the path planned on the map, and a simulated drive."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps.language.translator import LearnedTranslator, explanation
from avlmaps.navigate.bodies import BASE, BodyShape
from avlmaps.navigate.costmap import obstacles_for
from avlmaps.navigate.driver import MapDriver
from avlmaps.navigate.file_access import Readable
from avlmaps.navigate.instruct import Outcome, given_by, instruct
from avlmaps.navigate.rehearsal import FreeBody
from avlmaps.navigate.skills import RobotSettings

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.navigate.driver import Driver
    from avlmaps.query.avlmap import AVLMap

MakeRobot = Callable[["AVLMap"], "Driver"]
"""Puts a robot that really moves (a simulated one) into the world that a map was made of."""
_MOST_READINGS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """One drive.

    Attributes:
        outcome: what came of it.
        places: (n, 3) the places passed, level frame, on the floor.
    """

    outcome: Outcome
    places: Float[np.ndarray, "n 3"]

    def to_json(self) -> dict[str, Any]:
        """Return the outcome with the keys of ``avlmaps go --json``, and the places."""
        return self.outcome.to_json() | {"places": self.places.round(4).tolist()}


class Guide:
    """Plans commands on one map, and drives the robot of the map's scene where there is one.

    The robot stays where a command left it; the next one begins there.

    Attributes:
        avlmap: the map.
    """

    def __init__(self, avlmap: "AVLMap", robot: MakeRobot | None = None, shape: BodyShape = BASE) -> None:
        self.avlmap = avlmap
        self._make_robot, self._shape = robot, shape
        self._robot: Driver | None = None
        self._lock = threading.Lock()

    @property
    def has_robot(self) -> bool:
        """Whether a robot moves; else commands are planned only."""
        return self._make_robot is not None

    def prepare(self) -> None:
        """Put the robot into its scene now.

        Raises:
            SceneError: the scene is not the one that was mapped.
            NavigationError: there is no room for the robot.
        """
        self._driver()

    def obey(
        self,
        command: str,
        start: GroundPose | None = None,
        *,
        folder: Path | None = None,
        photo: str | None = None,
        clip: str | None = None,
    ) -> dict[str, Any]:
        """Read a command, plan it on the map, and drive it where there is a robot.

        Args:
            command: what a person says.
            start: where it begins without a robot, level frame; where the walk began if None.
            folder: whose files a program may read.
            photo: file in the folder that "this photo" means.
            clip: file in the folder that "this recording" means.

        Returns:
            The readings, the program, what was planned and driven, and where it ended (``pose``: x, y, heading).

        Raises:
            LanguageError: the command is not understood.
            NavigationError: there is no room for the robot.
        """
        translator = LearnedTranslator(given_by(self.avlmap, photo, clip, said=command))
        readings = explanation(translator, command)[:_MOST_READINGS]
        translation = translator.program_for(command)
        readable = Readable(() if folder is None else (folder,))
        settings = RobotSettings(waits=False)

        def run(driver: "Driver") -> Drive:
            outcome = instruct(
                command, self.avlmap, driver, translator, settings=settings, readable=readable, translation=translation
            )
            return Drive(outcome, self._on_floor(outcome.path))

        answer: dict[str, Any] = {
            "command": command,
            "readings": readings,
            "plan": translation.plan,
            "program": translation.program,
            "notes": list(translation.notes),
        }
        with self._lock:
            robot = self._driver()
            begin = robot.pose if robot is not None else start or self._start()
            planner = MapDriver(self.obstacles, FreeBody(begin), self._shape)
            planned, driven = run(planner), None if robot is None else run(robot)
            end = planner.pose if robot is None else robot.pose
        told = None if driven is None else driven.to_json()
        return answer | {"planned": planned.to_json(), "driven": told, "pose": [end.x_m, end.y_m, end.heading_rad]}

    @cached_property
    def obstacles(self) -> "Obstacles":
        """The obstacles that the map knows."""
        return obstacles_for(self.avlmap, self._shape)

    def _driver(self) -> "Driver | None":
        if self._robot is None and self._make_robot is not None:
            self._robot = self._make_robot(self.avlmap)
        return self._robot

    def _start(self) -> GroundPose:
        """Return where the walk began; from there the robot gets out to the floor that it may stand on."""
        cameras = np.asarray(self.avlmap.data.keyframes.world_from_camera)
        if not len(cameras):
            raise NavigationError("The map has no keyframe that says where its walk began; give a start.")
        level = np.asarray(self.obstacles.level_from_world) @ cameras[0, :3]
        return GroundPose(float(level[0, 3]), float(level[1, 3]), float(np.arctan2(level[1, 2], level[0, 2])))

    def _on_floor(self, xy: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
        return np.column_stack([xy, np.full(len(xy), self.obstacles.floor_m)])
