"""A command typed into a page: its readings, its program, the path planned on the map, and a simulated drive."""

import threading
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps.language.translator import LearnedTranslator, explanation
from avlmaps.maps.obstacles import BodyShape
from avlmaps.navigate.costmap import BASE, obstacles_for
from avlmaps.navigate.driver import MapDriver
from avlmaps.navigate.file_access import Readable
from avlmaps.navigate.instruct import FreeBody, Outcome, given_by, instruct, rehearse
from avlmaps.navigate.skills import RobotSettings

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.query.avlmap import AVLMap

MakeRobot = Callable[["AVLMap"], MapDriver]
"""Puts a robot that really moves (a simulated one) into the world that a map was made of."""
_MOST_READINGS = 5


class Guide:
    """Plans commands on one map, and drives the robot of the map's scene where there is one.

    The robot stays where a command left it; the next one begins there.
    """

    def __init__(self, avlmap: "AVLMap", robot: MakeRobot | None = None, shape: BodyShape = BASE) -> None:
        self._avlmap, self._make_robot, self._shape = avlmap, robot, shape
        self._robot: MapDriver | None = None
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
        if self._robot is None and self._make_robot is not None:
            self._robot = self._make_robot(self._avlmap)

    def obey(
        self,
        command: str,
        start: GroundPose | None = None,
        *,
        folder: Path | None = None,
        photo: str | None = None,
        clip: str | None = None,
    ) -> dict[str, Any]:
        """Read a command, plan it on the map, and drive it where there is a robot; return what was planned and driven.

        Without a robot it begins at ``start``, level frame, by default where the walk began. A program may read the
        files of ``folder``; ``photo`` and ``clip`` in it are what "this photo" and "this recording" mean.

        Raises:
            LanguageError: the command is not understood.
            NavigationError: there is no room for the robot.
        """
        translator = LearnedTranslator(given_by(self._avlmap, photo, clip, said=command))
        readings = explanation(translator, command)[:_MOST_READINGS]
        translation = translator.program_for(command)
        readable = Readable(() if folder is None else (folder,))
        with self._lock:
            self.prepare()
            begin = (start or self._start()) if self._robot is None else self._robot.pose
            planner = MapDriver(self._obstacles, FreeBody(begin), self._shape)
            planned, driven = rehearse(command, translation, self._avlmap, planner, readable=readable), None
            if self._robot is not None:
                driven = instruct(
                    command, self._avlmap, self._robot, translator, settings=RobotSettings(waits=False),
                    readable=readable, translation=translation,
                )  # fmt: skip
            end = (self._robot or planner).pose
        return {
            "command": command,
            "readings": readings,
            "plan": translation.plan,
            "program": translation.program,
            "notes": list(translation.notes),
            "planned": self._told(planned),
            "driven": None if driven is None else self._told(driven),
            "pose": [end.x_m, end.y_m, end.heading_rad],
        }

    @cached_property
    def _obstacles(self) -> "Obstacles":
        return obstacles_for(self._avlmap, self._shape) if self._robot is None else self._robot.obstacles

    def _start(self) -> GroundPose:
        cameras = np.asarray(self._avlmap.data.keyframes.world_from_camera)
        if not len(cameras):
            raise NavigationError("The map has no keyframe that says where its walk began; give a start.")
        level = np.asarray(self._obstacles.level_from_world) @ cameras[0, :3]
        return GroundPose(float(level[0, 3]), float(level[1, 3]), float(np.arctan2(level[1, 2], level[0, 2])))

    def _told(self, outcome: Outcome) -> dict[str, Any]:
        places = np.column_stack([outcome.path, np.full(len(outcome.path), self._obstacles.floor_m)])
        return outcome.to_json() | {"places": places.round(4).tolist()}
