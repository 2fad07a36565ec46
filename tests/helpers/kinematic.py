"""A driver that goes exactly where it is told, and a world of polygons that can be turned and mirrored."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from avlmaps.core.motion import Action, GroundPose
from avlmaps.maps.grid import GridSpec
from avlmaps.navigate.driver import Arrival
from avlmaps.navigate.footprint import Outline
from avlmaps.navigate.grounding import Destination
from avlmaps.navigate.skills import Robot, RobotSettings
from avlmaps.query.voxel_space import Space

UP = np.array([0.0, 0.0, 1.0])


@dataclass
class KinematicDriver:
    """Moves a pose without a world in its way; ``level_from_world`` where they differ; unreached where it is said."""

    pose: GroundPose
    level_from_world: np.ndarray = field(default_factory=lambda: np.eye(3))
    reaches: bool = True
    turns: bool = True
    told: list[str] = field(default_factory=list)

    def go_to(self, place: np.ndarray, *, face: np.ndarray | None = None) -> Arrival:
        self.told.append("go_to")
        start = self.pose
        x, y, _ = self.level_from_world @ np.asarray(place, float)
        heading = np.arctan2(y - start.y_m, x - start.x_m) if self.reaches else start.heading_rad
        self.pose = GroundPose(x, y, heading) if self.reaches else start
        if face is not None:
            dx, dy = (self.level_from_world @ np.asarray(face, float))[:2] - (self.pose.x_m, self.pose.y_m)
            if np.hypot(dx, dy) > 1e-9:
                self.pose = GroundPose(self.pose.x_m, self.pose.y_m, np.arctan2(dy, dx))
        return self._came(start, (Action.FORWARD,), "" if self.reaches else "a wall is in the way")

    def turn(self, angle_rad: float) -> Arrival:
        self.told.append(f"turn {angle_rad:.6f}")
        start = self.pose
        if self.turns:
            self.pose = start.turned(angle_rad)
        return self._came(start, (Action.LEFT if angle_rad > 0 else Action.RIGHT,), "" if self.turns else "it is stuck")

    def forward(self, distance_m: float) -> Arrival:
        self.told.append(f"forward {distance_m:.6f}")
        start = self.pose
        self.pose = start.ahead(distance_m)
        return self._came(start, (Action.FORWARD,))

    def stop(self) -> Arrival:
        return self._came(self.pose, (Action.STOP,))

    def _came(self, start: GroundPose, actions: tuple[Action, ...], note: str = "") -> Arrival:
        path = np.array([[start.x_m, start.y_m], [self.pose.x_m, self.pose.y_m]])
        return Arrival(not note, self.pose, actions, path, note)


class KnownThings:
    """A seeker that knows polygons by name, and nothing of a map."""

    def __init__(self, **polygons: np.ndarray) -> None:
        self.things = {
            name: Destination(
                name, Outline(np.asarray(corners, float)), np.append(np.mean(corners, axis=0), 0.4), solid=True
            )
            for name, corners in polygons.items()
        }
        self.notes: list[str] = []

    def best(self, target: Any, here: object = None) -> Destination:
        return self.things[target]

    referent = nearest = best

    def pair(self, a: Any, b: Any, here: np.ndarray) -> tuple[Destination, Destination]:
        return self.things[a], self.things[b]


def robot_among(pose: GroundPose, settings: RobotSettings | None = None, **polygons: np.ndarray) -> Robot:
    """Return a robot at a pose that knows polygons, on a floor at height 0."""
    empty: Any = SimpleNamespace(space=Space(GridSpec(0.05), np.zeros((0, 3), np.int64), UP), storeys=None)
    robot = Robot(empty, KinematicDriver(pose), settings)
    robot.seeker = KnownThings(**polygons)  # pyright: ignore[reportAttributeAccessIssue]
    return robot


def box(x: float, y: float, width: float = 1.0, depth: float = 1.0) -> np.ndarray:
    """Return the corners of a box round a middle, counter-clockwise."""
    return np.array([x, y]) + 0.5 * np.array([[-width, -depth], [width, -depth], [width, depth], [-width, depth]])
