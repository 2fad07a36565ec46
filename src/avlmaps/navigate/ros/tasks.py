"""The goals that a robot's own stack takes, over any transport."""

from abc import ABC, abstractmethod
from typing import ClassVar

from avlmaps.core.motion import GroundPose
from avlmaps.navigate.ros.frames import Frames
from avlmaps.navigate.ros.goals import Task
from avlmaps.navigate.ros.settings import RosSettings


class Tasks(ABC):
    """Makes the tasks of one kind of robot.

    Attributes:
        frames: the robot's frames, and how they lie to the map.
        settings: names, patience, speeds.
    """

    called: ClassVar[str]
    """The program that drives the robot, as notes name it."""

    def __init__(self, frames: Frames, settings: RosSettings) -> None:
        self.frames, self.settings = frames, settings

    @abstractmethod
    def pose(self, pose: GroundPose) -> Task:
        """Return the task of standing at a pose, level frame."""

    def turn(self, start: GroundPose, angle_rad: float) -> tuple[Task, ...]:
        """Return the tasks of a turn on the spot; the first whose server is there is done."""
        return (self.pose(start.turned(angle_rad)),)

    def forward(self, start: GroundPose, distance_m: float) -> tuple[Task, ...]:
        """Return the tasks of a straight drive; the first whose server is there is done."""
        return (self.pose(start.ahead(distance_m)),)
