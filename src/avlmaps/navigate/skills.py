"""The robot: every skill of the vocabulary over a map that is queried and a driver that moves a body.

Places in programs are in the world, as in the map's answers; what is left, north or straight ahead is computed in
the level frame, where the robot moves. Headings are counter-clockwise from +x; a program's turns are clockwise and its
compass has 0 in the north, as people say it, and only this module translates.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi, radians
from time import sleep
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import GoalNotFoundError, NavigationError, ProgramError
from avlmaps.core.motion import Action, wrap_angle
from avlmaps.language.program.vocabulary import Clip, Heat, Picture, Place, Target
from avlmaps.navigate.costmap import floor_of_walk, storey_of_walk
from avlmaps.navigate.driver import Arrival, Driver, Planning
from avlmaps.navigate.file_access import Readable
from avlmaps.navigate.footprint import Outline, bearing_rad, middle_between, to_the_left
from avlmaps.navigate.grounding import Destination, Heats, Seeker, kind_of, number_of, text_of
from avlmaps.navigate.planner import Offs
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap

_NORTH, _EAST = np.array([0.0, 1.0]), np.array([1.0, 0.0])
_OFF_M = 0.3  # a stop that is farther off than this from the side or the distance that was asked for is none
_MOST_M, _MOST_TURNS_DEG, _MOST_WAIT_S = 1000.0, 3600.0, 600.0


Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class LoggedMove:
    """One movement that a skill made."""

    skill: str
    name: str  # of the thing that it went to; "" for a turn or a place
    goal: Triple | None  # where it was to end, world, metres; None for a turn
    stop: Triple  # where it ended, world, on the floor
    distance_m: float | None  # from the goal to the stop, over the ground (the world need not be level)
    heading_rad: float  # where it looks then, level frame, counter-clockwise from +x
    reached: bool
    actions: tuple[Action, ...]
    path: Float[np.ndarray, "n 2"]  # level x and y of the places passed
    note: str = ""  # what the driver had to say
    contacts: int = 0  # how often the robot touched something

    def to_json(self) -> dict[str, Any]:
        """Return it as a subgoal or a step's result is printed."""
        return {
            "skill": self.skill,
            "name": self.name,
            **({} if self.goal is None else {"goal": _rounded(self.goal)}),
            "stop": _rounded(self.stop),
            **({} if self.distance_m is None else {"distance_m": round(self.distance_m, 4)}),
            "heading_rad": round(self.heading_rad, 4),
            "reached": self.reached,
            **({"contacts": self.contacts} if self.contacts else {}),
            **({"note": self.note} if self.note else {}),
        }

    def __str__(self) -> str:
        x, y, z = self.stop
        where = f"stands at ({x:.2f}, {y:.2f}, {z:.2f}) m, heading {np.rad2deg(self.heading_rad):.0f}°"
        away = "" if self.distance_m is None else f", {self.distance_m:.2f} m from the goal"
        return where + away + (f" ({self.note.rstrip('.')})" if self.note else "")


def _joined(arrivals: Sequence[Arrival]) -> Arrival:
    last = arrivals[-1]
    notes = dict.fromkeys(arrival.note for arrival in arrivals if arrival.note)
    return Arrival(
        all(arrival.reached for arrival in arrivals),
        last.pose,
        tuple(action for arrival in arrivals for action in arrival.actions),
        np.concatenate([arrival.path for arrival in arrivals]),
        "; ".join(notes),
        sum(arrival.contacts for arrival in arrivals),
    )


def _rounded(place: Triple) -> list[float]:
    return [round(value, 4) for value in place]


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """How a robot takes its skills."""

    guess: bool = False
    """Go to the best guess where nothing is found, and to the nearest of several things that fit equally."""
    choose: tuple[int, ...] = ()
    """Which of several things that fit equally is meant: a number from 1 for each name that asks, in their order."""
    persist: bool = False
    """Drive as the paper's evaluation does: on where a place is not reached, and to the nearest of several things."""
    waits: bool = True
    """Let the seconds of a `wait` pass; a plan passes over them."""


class Robot:
    """A robot that knows a map and can drive. Each public method is a skill, for programs, plans and chat models alike.

    Its types and its docstring are all that they know of it; it must bound its own work, and one whose thing is not in
    the map raises ``GoalNotFoundError``. Names are those of the paper and of VLMaps, and angles are in degrees.
    A phrase or a heatmap means the likeliest thing. Where several fit equally the skill fails and asks which; a
    program that means any of them says so (`get_nearest_pos`). Settings may take the nearest without a question, as the
    paper's programs do. ``moves`` are the movements that it made.
    """

    def __init__(
        self,
        avlmap: AVLMap,
        driver: Driver,
        settings: RobotSettings | None = None,
        readable: Readable | None = None,
        tell: Callable[[str], None] = lambda _: None,
        pause: Callable[[float], None] = sleep,
        heats: Heats | None = None,
    ) -> None:
        """Make a robot of a map and what drives it in the map's level frame.

        A program may load the files that are ``readable``, those in the working directory by default. ``tell`` is given
        a line for each thing found; ``pause`` waits for some seconds; ``heats`` is what this map answered before.
        """
        self.avlmap, self.driver, self._pause = avlmap, driver, pause
        self.settings = settings or RobotSettings()
        choose = None if self.settings.guess or self.settings.persist else self.settings.choose
        self.seeker = Seeker(
            avlmap, self.settings.guess, readable or Readable(), tell, storey_of_walk(avlmap), heats, choose
        )
        self.moves: list[LoggedMove] = []

    def load_image(self, path: str) -> Picture:
        """Load a picture from a file, to ask where it was taken."""
        from avlmaps.query.modalities import read_picture

        read_picture(self.seeker.readable.find(text_of(path, "load_image"), "picture"))
        return Picture(path)

    def load_sound(self, path: str) -> Clip:
        """Load a recorded sound from a file, to ask where one like it was heard."""
        from avlmaps.query.modalities import read_clip

        read_clip(self.seeker.readable.find(text_of(path, "load_sound"), "clip"))
        return Clip(path)

    def get_major_map(
        self,
        obj: str | None = None,
        sound: str | Clip | None = None,
        img: Picture | None = None,
        area: str | None = None,
        at: str = "robot",
    ) -> Heat:
        """Return the heatmap of what is sought itself (falls to nothing within 0.5 m). Give exactly one thing.

        A sound is sought where it was heard, or with at="source" where it came from.
        """
        return cast("Heat", self.seeker.heat("get_major_map", obj, sound, img, area, at, primary=True))

    def get_map(
        self,
        obj: str | None = None,
        sound: str | Clip | None = None,
        img: Picture | None = None,
        area: str | None = None,
        at: str = "robot",
    ) -> Heat:
        """Return the heatmap of what the sought thing is near or in (falls off over 5 m). Give exactly one thing.

        A sound is taken where it was heard, or with at="source" where it came from.
        """
        return cast("Heat", self.seeker.heat("get_map", obj, sound, img, area, at, primary=False))

    def get_max_pos_3d(self, heat: Heat) -> Place:
        """Return the best place of a heatmap, or of several multiplied with each other."""
        if not isinstance(heat, Heatmap):
            raise ProgramError(f"get_max_pos_3d takes a heatmap, such as get_major_map returns, not {kind_of(heat)}.")
        return self.seeker.place_of(heat)

    def get_pos(self, target: Target) -> Place:
        """Return the place of the thing that a phrase or a heatmap means; where several fit equally it asks which."""
        return self.seeker.place_of_thing(self.seeker.referent(target, self._here))

    def get_nearest_pos(self, target: Target) -> Place:
        """Return the place of the nearest thing that a phrase or a heatmap may mean; it means the same later."""
        return self.seeker.place_of_thing(self.seeker.nearest(target, self._here))

    def get_all_pos(self, target: Target) -> list[Place]:
        """Return the places of all objects of that name that the map is confident of, the nearest first; [] of none."""
        try:
            return [self.seeker.place_of_thing(thing) for thing in self.seeker.every(target, self._here)]
        except GoalNotFoundError:
            return []

    def get_nth_pos(self, target: Target, number: float = 1, order: str = "nearest") -> Place:
        """Return the place of the nth thing in an order: nearest, farthest, left, right, north, south, east or west."""
        which = number_of(number, "get_nth_pos", _MOST_M, "things")
        return self.seeker.place_of_thing(self.seeker.nth(target, self._here, int(which), order))

    def exists(self, target: Target) -> bool:
        """Return whether the map is confident of something of that name, or of a heatmap's best place."""
        return self.seeker.finds(target)

    def get_distance(self, a: Target, b: Target) -> float:
        """Return how many metres of floor are between the nearest points of two things."""
        one, other = (self.seeker.nearest(target, self._here) for target in (a, b))
        near, far = one.outline.gap_to(other.outline)
        return float(np.linalg.norm(near - far))

    def get_contour(self, target: Target) -> list[Place]:
        """Return the outline of an object's best instance, or inside a room, counter-clockwise."""
        thing = self.seeker.best(target)
        return [self._place(self._on_floor(corner, thing)) for corner in self.seeker.contour(thing).corners]

    def current_pos(self) -> Place:
        """Return the place where the robot stands now; keep it to come back later."""
        return self._place(self._on_floor(self._here))

    def move_to(self, target: Target) -> None:
        """Drive to a place, or as near to it as the robot can stand and see it."""
        thing = self.seeker.best(target)
        self._go("move_to", thing, thing.place, face=thing.place if thing.solid else None)

    def move_to_object(self, name: Target, distance_m: float = 0.0) -> None:
        """Drive to where it sees the object, so far from its edge; where several fit it asks which."""
        thing = self.seeker.referent(name, self._here)
        metres = _distance("move_to_object", distance_m)
        stop = self._stop(thing, metres > 0.0, lambda _, edge_m: np.abs(edge_m - metres))
        stop = thing.outline.before(self._here, metres) if stop is None else stop
        edge, height_m = thing.outline.nearest_to(stop), thing.place[2]
        face = self._on_floor(thing.outline.centre)
        self._go("move_to_object", thing, np.append(edge, height_m), face, np.append(stop, height_m))

    def move_in_between(self, a: Target, b: Target) -> None:
        """Drive to the middle between the nearest points of two things."""
        first, second = self.seeker.pair(a, b, self._here)
        middle = middle_between(first.outline, second.outline)
        name = f"between {first.name or 'a place'} and {second.name or 'a place'}"
        both = Destination(name, Outline.at(middle), self._on_floor(middle, first, second))
        self._go("move_in_between", both, both.place)

    def move_to_left(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the left side of a thing, as seen from the robot, that distance from its edge."""
        self._go_beside("move_to_left", target, to_the_left, distance_m)

    def move_to_right(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the right side of a thing, as seen from the robot, that distance from its edge."""
        self._go_beside("move_to_right", target, lambda ahead: -to_the_left(ahead), distance_m)

    def move_behind(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive behind a thing, as seen from the robot, that distance from its edge."""
        self._go_beside("move_behind", target, lambda ahead: ahead, distance_m)

    def move_north(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the north (+y) of a thing, that distance from its edge."""
        self._go_beside("move_north", target, lambda _: _NORTH, distance_m)

    def move_south(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the south (−y) of a thing, that distance from its edge."""
        self._go_beside("move_south", target, lambda _: -_NORTH, distance_m)

    def move_east(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the east (+x) of a thing, that distance from its edge."""
        self._go_beside("move_east", target, lambda _: _EAST, distance_m)

    def move_west(self, target: Target, distance_m: float = 0.5) -> None:
        """Drive to the west (−x) of a thing, that distance from its edge."""
        self._go_beside("move_west", target, lambda _: -_EAST, distance_m)

    def face(self, target: Target) -> None:
        """Turn on the spot until the thing is straight ahead."""
        self._turn_to_see("face", target, at_rad=0.0)

    def turn(self, angle_deg: float) -> None:
        """Turn on the spot: to the right by a positive angle, to the left by a negative one."""
        angle = number_of(angle_deg, "turn", _MOST_TURNS_DEG, "degrees")
        self._done("turn", "", None, [self.driver.turn(-radians(angle))])

    def turn_absolute(self, compass_deg: float) -> None:
        """Turn on the spot to a heading on the compass: 0 north (+y), 90 east (+x), 180 south, 270 west."""
        compass = number_of(compass_deg, "turn_absolute", _MOST_TURNS_DEG, "degrees")
        self._turn_towards("turn_absolute", "", pi / 2 - radians(compass))

    def move_forward(self, distance_m: float) -> None:
        """Drive straight ahead; with a negative distance turn round first, so that the robot sees where it goes."""
        distance_m = number_of(distance_m, "move_forward", _MOST_M, "metres")
        end = self.driver.pose.ahead(distance_m)
        arrivals = [self.driver.turn(pi)] if distance_m < 0.0 else []
        if all(arrival.reached for arrival in arrivals):  # half turned, it would drive somewhere else
            arrivals.append(self.driver.forward(abs(distance_m)))
        self._done("move_forward", "", self._on_floor(np.array([end.x_m, end.y_m])), arrivals)

    def with_object_on_left(self, target: Target) -> None:
        """Turn on the spot until the thing is straight to the left of the robot."""
        self._turn_to_see("with_object_on_left", target, at_rad=pi / 2)

    def with_object_on_right(self, target: Target) -> None:
        """Turn on the spot until the thing is straight to the right of the robot."""
        self._turn_to_see("with_object_on_right", target, at_rad=-pi / 2)

    def wait(self, duration_s: float) -> None:
        """Stand still for some seconds, at most 600."""
        seconds = max(0.0, number_of(duration_s, "wait", _MOST_WAIT_S, "seconds"))
        if self.settings.waits:
            self._pause(seconds)

    @cached_property
    def floor_m(self) -> float:
        """Level height of the floor that the robot is on."""
        return floor_of_walk(self.avlmap)

    @property
    def _here(self) -> Float[np.ndarray, "2"]:
        pose = self.driver.pose
        return np.array([pose.x_m, pose.y_m])

    def _on_floor(self, xy: Float[np.ndarray, "2"], *things: Destination) -> Float[np.ndarray, "3"]:
        storeys, floors = self.avlmap.storeys, [self.floor_m]
        if storeys is not None and things:
            numbers = storeys.of(np.array([thing.place[2] for thing in things]))
            floors = [storeys[number].floor_m for number in numbers.tolist()]
        return np.append(xy, max(floors, key=lambda floor_m: abs(floor_m - self.floor_m)))

    def _place(self, level: Float[np.ndarray, "3"]) -> Place:
        return Place(*_triple(self.avlmap.space.world(level)))

    def _go_beside(
        self,
        skill: str,
        target: Target,
        direction: Callable[[Float[np.ndarray, "2"]], Float[np.ndarray, "2"]],
        distance_m: float,
    ) -> None:
        thing = self.seeker.referent(target, self._here)
        distance_m = _distance(skill, distance_m)
        bearing = bearing_rad(self._here, thing.outline.centre)
        bearing = self.driver.pose.heading_rad if bearing is None else bearing
        side = direction(np.array([np.cos(bearing), np.sin(bearing)]))
        goal = self._on_floor(thing.outline.beside(side, distance_m), thing)
        stop = self._stop(thing, True, lambda xy, _: np.linalg.norm(xy - goal[:2], axis=1))
        self._go(skill, thing, goal, to=None if stop is None else np.append(stop, goal[2]))

    def _stop(self, thing: Destination, exactly: bool, off_m: Offs) -> Float[np.ndarray, "2"] | None:
        if not isinstance(self.driver, Planning):
            return None
        stop = self.driver.stop_beside(thing.outline, self.avlmap.space.world(thing.place), off_m)
        if stop is not None and exactly and stop.beside_m > _OFF_M and not self.settings.persist:
            what = thing.name or "the place"
            nearest = f"the nearest place from which it sees {what} is {stop.beside_m:.2f} m off"
            raise NavigationError(f"The robot cannot stand there: {nearest}; say another side or distance.")
        return None if stop is None else stop.xy

    def _go(
        self, skill: str, thing: Destination, goal: Float[np.ndarray, "3"],
        face: Float[np.ndarray, "3"] | None = None, to: Float[np.ndarray, "3"] | None = None,
    ) -> None:  # fmt: skip
        world = self.avlmap.space.world
        looked_at = None if face is None else world(face)
        self._done(skill, thing.name, goal, [self.driver.go_to(world(goal if to is None else to), face=looked_at)])

    def _turn_to_see(self, skill: str, target: Target, at_rad: float) -> None:
        thing = self.seeker.nearest(target, self._here)  # a turn costs less than a question
        bearing = bearing_rad(self._here, thing.outline.centre)
        heading = self.driver.pose.heading_rad if bearing is None else bearing - at_rad
        self._turn_towards(skill, thing.name, heading)

    def _turn_towards(self, skill: str, name: str, heading_rad: float) -> None:
        angle = wrap_angle(heading_rad - self.driver.pose.heading_rad)
        self._done(skill, name, None, [self.driver.turn(angle)])

    def _done(self, skill: str, name: str, goal: Float[np.ndarray, "3"] | None, arrivals: Sequence[Arrival]) -> None:
        """Store the result of a movement, and stop where it was to a place: there the paper's tasks are judged.

        A robot that takes no discrete actions has ended its goal by itself; its driver's stop would be everybody's.
        """
        if goal is not None and arrivals[-1].actions and arrivals[-1].actions[-1] is not Action.STOP:
            arrivals = [*arrivals, self.driver.stop()]
        arrival = _joined(arrivals)
        world = self.avlmap.space.world
        pose = arrival.pose
        here = np.array([pose.x_m, pose.y_m])
        stop = _triple(world(self._on_floor(here)))
        target = None if goal is None else _triple(world(goal))
        away_m = None if goal is None else float(np.hypot(*(goal[:2] - here)))
        move = LoggedMove(
            skill, name, target, stop, away_m, pose.heading_rad, arrival.reached, arrival.actions, arrival.path,
            arrival.note, arrival.contacts,
        )  # fmt: skip
        self.moves.append(move)
        if not move.reached and not self.settings.persist:
            raise NavigationError(_not_reached(move))


def _distance(skill: str, distance_m: float) -> float:
    metres = number_of(distance_m, skill, _MOST_M, "metres")
    if metres < 0.0:
        raise ProgramError(f"{skill} takes a distance of 0 m or more, not {metres:g}; go to the other side.")
    return metres


def _triple(vector: Float[np.ndarray, "3"]) -> Triple:
    x, y, z = (float(value) for value in vector)
    return x, y, z


def _not_reached(move: LoggedMove) -> str:
    why = move.note.rstrip(".") or "the driver gave up"
    if move.distance_m is None:
        return f"{move.skill} could not be finished: {why}; the robot looks along {np.rad2deg(move.heading_rad):.0f}°."
    what = move.name or "The place"
    return f"{what} was not reached: {why}; the robot was {move.distance_m:.2f} m from it."
