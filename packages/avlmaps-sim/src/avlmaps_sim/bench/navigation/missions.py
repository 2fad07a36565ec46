"""A mission: the command to a robot in a scene, its start, its goals with names, programs and truth; saved, loaded."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from hashlib import sha256
from math import atan2, ceil, pi
from typing import Literal

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps_sim.bench.harness.evidence import Box, room_distance_m
from avlmaps_sim.bench.harness.settings import Recorded, SceneSettings, TaskError
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
    """One subgoal with its truth. Any of the right things will do."""

    kind: GoalKind  # how it is named
    said: str  # how a command names it; ``{photo 0}`` stands for the file of the mission's first photo
    program: str  # the line of a program that goes there
    boxes: tuple[Box, ...] = ()  # right things; the distance is horizontal, to the nearest point of a box
    # Right places: where a sound was heard or came from, where a photo was taken, a spot; metres, world.
    places: tuple[Triple, ...] = ()
    rooms: tuple[tuple[Corner, ...], ...] = ()  # corners of right rooms, top-down; 0 m away inside
    # Where the robot is to look, counter-clockwise from +x; None where that does not matter.
    heading_rad: float | None = None
    context: str = ""  # the part that says which one is meant, if ambiguous: ``object``, ``sound``, ``image``, ``area``

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


SCHEMA_VERSION = 1
Row = tuple[float, float, float, float]


class Series(StrEnum):
    """Which experiment a mission belongs to; the value is the word on the command line."""

    SOUNDS_1 = "sounds-1"
    SOUNDS_2 = "sounds-2"
    SOUNDS_3 = "sounds-3"
    IMAGES = "images"
    PAIRS = "pairs"
    COMMANDS = "commands"
    SPATIAL = "spatial"


@dataclass(frozen=True, slots=True)
class Mission:
    """One or several subgoals in one command."""

    name: str  # unique: scene, series and number
    series: Series  # which experiment it belongs to
    scene: str  # the scene's name, such as ``house:1000001:held-out``
    start: tuple[float, float, float]  # x and y in metres and heading in radians, counter-clockwise from +x
    goals: tuple[Goal, ...]  # in the order in which they are to be reached
    # A sentence with ``{0}``, ``{1}`` ... for what the goals are called; ``""`` names one after another.
    command: str = ""
    photos: tuple[tuple[Row, ...], ...] = ()  # ``world_from_camera`` of every photo, row by row
    form: str = ""  # of a list's command before it was filled

    def __post_init__(self) -> None:
        if not self.goals:
            raise ValueError(f"the mission {self.name} has no goal")

    @property
    def pose(self) -> GroundPose:
        """Where the robot starts."""
        return GroundPose(*self.start)

    @property
    def world_from_photos(self) -> list[Float[np.ndarray, "4 4"]]:
        """The poses of the cameras that took the photos."""
        return [np.array(photo, np.float64) for photo in self.photos]

    def sentence(self, files: tuple[str, ...] = (), only: int | None = None) -> str:
        """Return the command as a person would give it.

        ``only`` names just one goal: a robot whose program broke off gets the remaining goals one by one.
        """
        said = [_named(goal.said, files) for goal in self.goals]
        if only is not None:
            return joined([said[only]]) if self.goals[only].moves else f"Face {said[only]}."
        text = self.command or joined(said)
        for number, words in enumerate(said):
            text = text.replace(f"{{{number}}}", words)
        return _named(text, files)

    def program(self, files: tuple[str, ...] = (), only: int | None = None) -> str:
        """Return the program that a perfect translator would write, for all goals or for one of them."""
        goals = self.goals if only is None else self.goals[only : only + 1]
        return "\n".join(_named(goal.program, files) for goal in goals)

    @property
    def fingerprint(self) -> str:
        """A short name of all that it holds."""
        return sha256(msgspec.json.encode(self)).hexdigest()[:16]


def _named(text: str, files: tuple[str, ...]) -> str:
    for number, file in enumerate(files):
        text = text.replace(f"{{photo {number}}}", file)
    return text


def joined(said: list[str]) -> str:
    """Return one sentence that names places one after another."""
    if len(said) == 1:
        return f"Go to {said[0]}."
    middle = "".join(f", then go to {words}" for words in said[1:-1])
    return f"First go to {said[0]}{middle}, and then go to {said[-1]}."


@dataclass(frozen=True, slots=True)
class MissionSet:
    """Missions of several scenes, with all that is needed to run them again.

    By ``asked`` a run that was broken off knows its own.
    """

    recorded: Recorded
    scenes: tuple[str, ...]
    radius_m: float
    missions: tuple[Mission, ...]
    asked: str = ""
    schema_version: int = SCHEMA_VERSION


def numbered(missions: list[Mission]) -> list[Mission]:
    """Name missions of one scene by series and number."""
    count: dict[Series, int] = {}
    named: list[Mission] = []
    for mission in missions:
        number = count.get(mission.series, 0)
        count[mission.series] = number + 1
        named.append(replace(mission, name=f"{mission.scene}/{mission.series}/{number:03d}"))
    return named


def asked_for(*facts: object) -> str:
    """Return a short name of everything that missions were made from."""
    return sha256(json.dumps(facts, default=str).encode()).hexdigest()[:16]


DEFAULT_SCENES = tuple(f"house:{seed}:held-out" for seed in range(1_000_001, 1_000_013))
Language = Literal["learned", "rules", "chat", "none"]
_PAIRS_OF_200 = 119


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationSettings(SceneSettings):
    """The settings of the benchmark."""

    scenes: tuple[str, ...] = DEFAULT_SCENES  # held-out homes by default
    series: tuple[Series, ...] = tuple(Series)  # which experiments
    sequences: int = 200  # of four sounds (at each range), and of an image and two things; pairs are 119 for each 200
    language: Language = "learned"  # what turns sentences into programs; ``none`` gives robots the programs themselves
    guess: bool = True  # whether robots go to the best guess where nothing is found, as the paper's always do

    def __post_init__(self) -> None:
        if self.frames < 20 or self.sequences < 1 or self.jobs < 0 or not self.scenes or not self.series:
            raise TaskError(
                f"The benchmark cannot run with {self.frames} frames, {self.sequences} sequences, {self.jobs} jobs, "
                f"{len(self.scenes)} scenes and {len(self.series)} series; take at least 20 frames, one of the others, "
                "and 0 jobs for as many as there are cores."
            )

    def total(self, series: Series) -> int | None:
        """Return how many missions of a series are run in all; None for the lists, which every scene is given."""
        if series in (Series.COMMANDS, Series.SPATIAL):
            return None
        return ceil(self.sequences * _PAIRS_OF_200 / 200) if series is Series.PAIRS else self.sequences


PHOTO = "{photo %d}"


def object_heat(category: str, major: bool = True) -> str:
    """Return the expression of a kind of thing's heat."""
    return f'robot.{_map(major)}(obj="{category}")'


def sound_heat(sound: str, major: bool = True) -> str:
    """Return the expression of a sound's heat."""
    return f'robot.{_map(major)}(sound="{spoken(sound)}")'


def image_heat(photo: int, major: bool = True) -> str:
    """Return the expression of a photo's heat."""
    return f'robot.{_map(major)}(img=robot.load_image("{PHOTO % photo}"))'


def area_heat(area: str, major: bool = True) -> str:
    """Return the expression of an area's heat."""
    return f'robot.{_map(major)}(area="{area}")'


def _map(major: bool) -> str:
    return "get_major_map" if major else "get_map"


def go_to(heat: str) -> str:
    """Return the line that goes to the best place of a heat."""
    return f"robot.move_to(robot.get_max_pos_3d({heat}))"


def an_object(category: str, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY": any of that kind."""
    return Goal(GoalKind.OBJECT, f"the {category}", f'robot.move_to_object("{category}")', tuple(boxes))


def spoken(sound: str) -> str:
    """Return a person's word for a kind of sound: of "fan or air conditioner" the first."""
    return sound.split(" or ")[0]


def a_sound(sound: str, places: Sequence[Triple]) -> Goal:
    """Return the goal "the sound of SOUND": anywhere it was heard."""
    said = f"the sound of {spoken(sound)}"
    return Goal(GoalKind.SOUND, said, go_to(sound_heat(sound)), places=tuple(places))


def an_image(photo: int, camera: Triple) -> Goal:
    """Return the goal "the image FILE": where it was taken."""
    return Goal(GoalKind.IMAGE, f"the image {PHOTO % photo}", go_to(image_heat(photo)), places=(camera,))


def an_area(area: str, rooms: Sequence[Sequence[tuple[float, float]]]) -> Goal:
    """Return the goal "the AREA": in any room of that kind."""
    corners = tuple(tuple(room) for room in rooms)
    return Goal(GoalKind.AREA, f"the {area}", go_to(area_heat(area)), rooms=corners)


def near_sound(category: str, sound: str, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY near the sound of SOUND"."""
    heat = f"{object_heat(category)} * {sound_heat(sound, major=False)}"
    said = f"the {category} near the sound of {spoken(sound)}"
    return Goal(GoalKind.OBJECT, said, go_to(heat), tuple(boxes), context="sound")


def near_image(category: str, photo: int, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY near the image FILE"."""
    heat = f"{object_heat(category)} * {image_heat(photo, major=False)}"
    said = f"the {category} near the image {PHOTO % photo}"
    return Goal(GoalKind.OBJECT, said, go_to(heat), tuple(boxes), context="image")


def in_area(category: str, area: str, boxes: Sequence[Box]) -> Goal:
    """Return the goal "the CATEGORY in the AREA"."""
    heat = f"{object_heat(category)} * {area_heat(area, major=False)}"
    return Goal(GoalKind.OBJECT, f"the {category} in the {area}", go_to(heat), tuple(boxes), context="area")


def sound_near_object(sound: str, category: str, place: Triple) -> Goal:
    """Return the goal "the sound of SOUND near the CATEGORY"."""
    heat = f"{sound_heat(sound)} * {object_heat(category, major=False)}"
    said = f"the sound of {spoken(sound)} near the {category}"
    return Goal(GoalKind.SOUND, said, go_to(heat), places=(place,), context="object")


def sound_near_image(sound: str, photo: int, place: Triple) -> Goal:
    """Return the goal "the sound of SOUND near the image FILE"."""
    heat = f"{sound_heat(sound)} * {image_heat(photo, major=False)}"
    said = f"the sound of {spoken(sound)} near the image {PHOTO % photo}"
    return Goal(GoalKind.SOUND, said, go_to(heat), places=(place,), context="image")


def heat_of(goal: Goal) -> str:
    """Return the expression of what a goal names, as an argument of a skill."""
    line = goal.program
    for before in ("robot.move_to(robot.get_max_pos_3d(", "robot.move_to_object("):
        if line.startswith(before):
            return line.removeprefix(before)[: -2 if before.count("(") == 2 else -1]
    raise ValueError(f"{line!r} goes to nothing that has a heat")
