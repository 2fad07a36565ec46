"""Paths between two places of a map, for a body: what a robot would plan, without a robot."""

import threading
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, TypedDict

import numpy as np
from jaxtyping import Float
from msgspec import Meta

from avlmaps.core.errors import NavigationError
from avlmaps.core.poses import FRAME
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.navigate.bodies import BASE, BodyShape
from avlmaps.navigate.costmap import costmap_of, obstacles_for
from avlmaps.navigate.planner import Planner, Stop, Way
from avlmaps.query.answer import Answer
from avlmaps.query.schema import Frame, Position

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap


class StopAnswer(TypedDict):
    """Where the body stops for a place."""

    position: Position
    beside_m: Annotated[float, Meta(description="distance from the place; 0 where the body stands in the place itself")]
    seen: Annotated[bool, Meta(description="whether the place can be seen from there")]


class PathAnswer(TypedDict):
    """A path over the floor for a robot's body; with ``found`` false there is none."""

    found: bool
    points: Annotated[list[Position], Meta(description="corners on the floor, from start to stop")]
    length_m: float | None
    cost: Annotated[float | None, Meta(description="its metres, each weighted by how narrow it is there")]
    stop: StopAnswer | None
    note: Annotated[str, Meta(description="why there is none, or empty")]
    frame: Frame


class PathFinder:
    """Plans over one map's floor for one body; several threads may share it.

    Attributes:
        avlmap: the map.
        shape: the body.
    """

    def __init__(self, avlmap: "AVLMap", shape: BodyShape = BASE) -> None:
        self.avlmap = avlmap
        self.shape = shape
        self._lock = threading.Lock()

    @cached_property
    def obstacles(self) -> Obstacles:
        """What stands on the floor."""
        return obstacles_for(self.avlmap, self.shape)

    @cached_property
    def planner(self) -> Planner:
        """The planner."""
        return Planner(costmap_of(self.obstacles, self.shape.radius_m))

    def level_xy(self, place: Float[np.ndarray, " n"]) -> Float[np.ndarray, "2"]:
        """Return level x and y of a place.

        Args:
            place: three numbers are a point of the recording frame, two are x and y of the level frame already.
        """
        return self.avlmap.space.level(place)[:2] if len(place) == 3 else np.asarray(place, np.float64)

    def state_at(self, level_xy: Float[np.ndarray, "2"]) -> CellState:
        """Return whether the floor at a place is free, occupied or unknown."""
        obstacles = self.obstacles
        cell = np.floor((level_xy - obstacles.origin_m) / obstacles.cell_size_m)
        if not (np.all(cell >= 0) and np.all(cell < obstacles.states.shape)):  # NaN is off the grid, too
            return CellState.UNKNOWN
        return CellState(int(obstacles.states[tuple(cell.astype(np.int64))]))

    def between(self, start: Float[np.ndarray, "2"], place: Float[np.ndarray, "2"]) -> tuple[Stop, Way] | None:
        """Return where a body that comes from a start stops for a place, and the path to it; None where there is none.

        Args:
            start: level x and y.
            place: level x and y.
        """
        with self._lock:  # the planner's own caches are not made for threads
            stop = self.planner.stop_for(start, place)
            way = None if stop is None else self.planner.way(start, stop.xy)
        return None if stop is None or way is None else (stop, way)

    def answer(self, start: Float[np.ndarray, " n"], place: Float[np.ndarray, " n"]) -> PathAnswer:
        """Return the path between two places as JSON; see ``level_xy`` for the numbers of a place.

        Raises:
            NavigationError: a coordinate is not finite.
            MapError: the map holds too little to find a floor.
        """
        if not (np.isfinite(start).all() and np.isfinite(place).all()):
            raise NavigationError("A coordinate is not a finite number; give metres, such as 1.5,2.0.")
        found = self.between(self.level_xy(start), self.level_xy(place))
        if found is None:
            holds = self.planner.costmap.holds
            off = [name for name, at in (("start", start), ("goal", place)) if not holds(self.level_xy(at))]
            note = f"the {' and the '.join(off)} lies outside of the map" if off else "no free floor leads there"
            return {"found": False, "points": [], "length_m": None, "cost": None, "stop": None, "note": note,
                    "frame": FRAME}  # fmt: skip
        stop, way = found
        return {
            "found": True,
            "points": [self.on_floor(xy) for xy in way.points],
            "length_m": way.length_m,
            "cost": way.cost,
            "stop": {"position": self.on_floor(stop.xy), "beside_m": stop.beside_m, "seen": bool(stop.seen)},
            "note": "",
            "frame": FRAME,
        }

    def on_floor(self, level_xy: Float[np.ndarray, "2"]) -> list[float]:
        """Return the point of the floor at a level x and y, recording frame."""
        point = self.avlmap.space.world(np.append(level_xy, self.obstacles.floor_m))
        return [float(value) for value in point]


class NearGoal(TypedDict):
    """One goal, and how far a body drives to it."""

    position: Position
    score: float
    probability: Annotated[float, Meta(description="that it is right, all parts together")]
    reachable: bool
    path_m: Annotated[float | None, Meta(description="length of the path from the place")]
    stop: StopAnswer | None


class NearGoalsAnswer(TypedDict):
    """Goals of a query, those with the shortest path first; with ``found`` false they are guesses."""

    found: bool
    probability: Annotated[float, Meta(description="that the first goal of the query is right")]
    goals: list[NearGoal]
    frame: Frame


def goals_near(finder: PathFinder, answer: Answer, near: Float[np.ndarray, " n"], top: int = 3) -> NearGoalsAnswer:
    """Return the goals of an answer by the length of the path to each; those that no path reaches come last.

    Goals of half the best score and less are left out: near and wrong helps nobody.

    Args:
        finder: plans over the map that was queried.
        answer: of the query.
        near: where the body is; see ``PathFinder.level_xy``.
        top: most goals.

    Raises:
        MapError: the map holds too little to find a floor.
    """
    start = finder.level_xy(near)
    likely = [goal for goal in answer.goals if goal.score >= 0.5 * answer.goals[0].score]
    goals: list[NearGoal] = []
    for goal in likely:
        found = finder.between(start, finder.level_xy(np.array(goal.position)))
        stop = None
        if found is not None:
            seen = bool(found[0].seen)
            stop = StopAnswer(position=finder.on_floor(found[0].xy), beside_m=found[0].beside_m, seen=seen)
        goals.append(
            {
                "position": list(goal.position),
                "score": goal.score,
                "probability": goal.probability,
                "reachable": found is not None,
                "path_m": None if found is None else found[1].length_m,
                "stop": stop,
            }
        )
    goals.sort(key=lambda one: (one["path_m"] is None, one["path_m"] or 0.0))
    return {"found": answer.found, "probability": answer.probability, "goals": goals[:top], "frame": FRAME}
