"""The goals of a robot, their truth, and whether a stop is right."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import atan2, pi

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps_sim.bench.harness.evidence import Box
from avlmaps_sim.mesh import Triple

SUCCESS_M = 1.0  # the paper's
SUCCESS_RAD = pi / 12  # where a command says how to look
Corner = tuple[float, float]


class GoalKind(StrEnum):
    """How a goal is named; the value is the word in tables."""

    OBJECT = "object"
    SOUND = "sound"
    IMAGE = "image"
    AREA = "area"
    SPOT = "spot"
    LOOK = "look"


@dataclass(frozen=True, slots=True)
class Goal:
    """One subgoal with its truth. Any of the right things will do.

    Attributes:
        kind: how it is named.
        said: how a command names it; ``{photo 0}`` stands for the file of the mission's first photo.
        program: the line of a program that goes there.
        boxes: right things; the distance is horizontal, to the nearest point of a box.
        places: right places: where a sound was heard or came from, where a photo was taken, a spot; metres, world.
        rooms: corners of right rooms, top-down; 0 m away inside.
        heading_rad: where the robot is to look, counter-clockwise from +x; None where that does not matter.
        context: the part that says which one is meant, if ambiguous: ``object``, ``sound``, ``image``, ``area``.
    """

    kind: GoalKind
    said: str
    program: str
    boxes: tuple[Box, ...] = ()
    places: tuple[Triple, ...] = ()
    rooms: tuple[tuple[Corner, ...], ...] = ()
    heading_rad: float | None = None
    context: str = ""

    def __post_init__(self) -> None:
        if not (self.boxes or self.places or self.rooms or self.heading_rad is not None):
            raise ValueError(f"the goal {self.said!r} has no right place")

    @property
    def moves(self) -> bool:
        """Whether it is a place to go to, rather than a heading."""
        return self.kind is not GoalKind.LOOK

    def off_m(self, xy: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
        """Return how far places on the ground are from the nearest right thing, horizontally."""
        xy = np.asarray(xy, np.float64).reshape(-1, 2)
        off = np.full(len(xy), np.inf)
        for box in self.boxes:
            low, high = np.array(box.low[:2]), np.array(box.high[:2])
            off = np.minimum(off, np.linalg.norm(np.maximum(np.maximum(low - xy, xy - high), 0.0), axis=1))
        for place in self.places:
            off = np.minimum(off, np.linalg.norm(xy - np.array(place[:2]), axis=1))
        for room in self.rooms:
            off = np.minimum(off, room_distance_m(np.array(room), xy))
        return off

    def off_rad(self, pose: GroundPose) -> float | None:
        """Return how far the robot looks from where it is to look; None where that does not matter.

        At a thing that is to be faced (a goal ``look`` with boxes) any part of it may be ahead.
        """
        if self.heading_rad is not None:
            return abs(wrap_angle(pose.heading_rad - self.heading_rad))
        if self.moves:
            return None
        return min(_off_box_rad(box, pose) for box in self.boxes)

    def reached(self, pose: GroundPose) -> bool:
        """Return whether a stop is right: within a metre for a place, within 15 degrees for a heading."""
        off_rad = self.off_rad(pose)
        near = not self.moves or float(self.off_m(np.array([[pose.x_m, pose.y_m]]))[0]) < SUCCESS_M
        return near and (off_rad is None or off_rad <= SUCCESS_RAD)


def _off_box_rad(box: Box, pose: GroundPose) -> float:
    if box.distance_m((pose.x_m, pose.y_m, 0.0)) == 0.0:
        return 0.0
    corners = [(x, y) for x in (box.low[0], box.high[0]) for y in (box.low[1], box.high[1])]
    angles = [wrap_angle(atan2(y - pose.y_m, x - pose.x_m) - pose.heading_rad) for x, y in corners]
    if max(angles) - min(angles) > pi:  # seen over the shoulder: the span goes the other way round
        return min(abs(angle) for angle in angles)
    return max(0.0, min(angles), -max(angles))


def room_distance_m(corners: Float[np.ndarray, "k 2"], xy: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    """Return how far places are from a polygon; 0 inside."""
    a, b = corners, np.roll(corners, -1, axis=0)
    off = np.full(len(xy), np.inf)
    inside = np.zeros(len(xy), bool)
    for start, end in zip(a, b, strict=True):
        along = end - start
        share = np.clip((xy - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        off = np.minimum(off, np.linalg.norm(xy - start - share[:, None] * along, axis=1))
        crosses = (start[1] > xy[:, 1]) != (end[1] > xy[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            at_x = (end[0] - start[0]) * (xy[:, 1] - start[1]) / (end[1] - start[1]) + start[0]
        inside ^= crosses & (xy[:, 0] < at_x)
    return np.where(inside, 0.0, off)


# The true spots that relations mean, from boxes. The robot works them out from what its map shows.


def between(a: Box, b: Box) -> Triple:
    """Return the middle between the nearest points of two boxes, top-down; of many such the middle one."""
    x, y = (_middle(a.low[axis], a.high[axis], b.low[axis], b.high[axis]) for axis in (0, 1))
    return (x, y, 0.0)


def _middle(low_a: float, high_a: float, low_b: float, high_b: float) -> float:
    return (max(low_a, low_b) + min(high_a, high_b)) / 2


def beside(box: Box, direction: Float[np.ndarray, "2"], distance_m: float) -> Triple:
    """Return the place in a direction (unit vector) from a box's middle, this far beyond its outermost corner."""
    middle = (np.array(box.low[:2]) + np.array(box.high[:2])) / 2
    reach = float(np.abs(direction) @ (np.array(box.high[:2]) - middle))
    x, y = middle + direction * (reach + distance_m)
    return (float(x), float(y), 0.0)


def left_of(box: Box, seen_from: Sequence[float]) -> Float[np.ndarray, "2"]:
    """Return the direction that is to the left of a box for one who looks at its middle from a place."""
    towards = (np.array(box.low[:2]) + np.array(box.high[:2])) / 2 - np.asarray(seen_from, np.float64)[:2]
    towards /= max(float(np.linalg.norm(towards)), 1e-9)
    return np.array([-towards[1], towards[0]])
