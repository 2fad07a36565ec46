"""Paths between two places of a map, for a body: what a robot would plan, without a robot."""

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, NotRequired, TypedDict

import numpy as np
from jaxtyping import Float
from msgspec import Meta

from avlmaps.core.errors import NavigationError
from avlmaps.core.poses import FRAME
from avlmaps.maps.obstacles import BodyShape, Obstacles
from avlmaps.navigate.costmap import BASE, costmap_of, obstacles_for, storey_of_walk
from avlmaps.navigate.planner import Planner, Stop
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
    """A path over the floor for a robot's body; with ``found`` false there is none.

    In a map of several storeys ``storeys`` names those that the path is on, in order.
    """

    found: bool
    points: Annotated[list[Position], Meta(description="corners on the floor, from start to stop")]
    length_m: float | None
    cost: Annotated[float | None, Meta(description="its metres, each weighted by how narrow it is there")]
    stop: StopAnswer | None
    note: Annotated[str, Meta(description="why there is none, or empty")]
    frame: Frame
    storeys: NotRequired[Annotated[list[str], Meta(description="that the path is on; of a map of several")]]


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """A place on a storey."""

    xy: Float[np.ndarray, "2"]  # level x and y
    storey: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """A path that may change storeys."""

    stop: Stop  # where the body stops for the place that it goes to
    points: Float[np.ndarray, "n 3"]  # level frame; between two of them on one storey the height is that of its floor
    length_m: float  # along the floors and up or down the stairs
    cost: float  # its metres, each weighted by how narrow it is there; a metre of stairs costs 1
    storeys: tuple[int, ...] = (0,)  # that it is on, in order


class PathFinder:
    """Plans over one map's floors for one body; several threads may share it.

    A body that climbs goes by the stairs of the map to another storey.
    """

    def __init__(self, avlmap: "AVLMap", shape: BodyShape = BASE) -> None:
        self.avlmap, self.shape = avlmap, shape
        self._lock = threading.RLock()
        self._planners: dict[int, tuple[Obstacles, Planner]] = {}

    def planner(self, storey: int) -> Planner:
        """Return the planner of a storey."""
        return self._planned(storey)[1]

    def _planned(self, storey: int) -> tuple[Obstacles, Planner]:
        with self._lock:
            if storey not in self._planners:
                obstacles = obstacles_for(self.avlmap, self.shape, storey)
                self._planners[storey] = obstacles, Planner(costmap_of(obstacles, self.shape.radius_m))
            return self._planners[storey]

    def spot(self, place: Float[np.ndarray, " n"]) -> Spot:
        """Return level x and y of a place, and its storey.

        Three numbers are a point of the recording frame, two are x and y of the level frame, on the storey where the
        walk of the map began.
        """
        if len(place) == 2:
            return Spot(np.asarray(place, np.float64), storey_of_walk(self.avlmap))
        level, storeys = self.avlmap.space.level(place), self.avlmap.storeys
        return Spot(level[:2], 0 if storeys is None else int(storeys.of(level[2:])[0]))

    def between(self, start: Spot, place: Spot) -> Route | None:
        """Return where a body that comes from a start stops for a place, and the path to it; None where there is none.

        Like all that plans, it raises ``MapError`` where the map holds too little to find a floor.
        """
        storeys = self.avlmap.storeys
        if storeys is None or start.storey == place.storey:
            return self._on_one(start, place)
        stairs = storeys.route(start.storey, place.storey)
        if stairs is None or not self.shape.climbs:
            return None
        legs: list[Route] = []
        at, step = start, 1 if place.storey > start.storey else -1
        for flight in stairs:
            leg = self._on_one(at, Spot(flight.points[0, :2], at.storey))
            if leg is None:
                return None
            points = np.concatenate([leg.points[-1:], flight.points])
            length_m = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
            legs += [leg, Route(leg.stop, points, length_m, length_m, (at.storey, at.storey + step))]
            at = Spot(flight.points[-1, :2], at.storey + step)
        last = self._on_one(at, place)
        return None if last is None else _joined([*legs, last])

    def _on_one(self, start: Spot, place: Spot) -> Route | None:
        obstacles, planner = self._planned(start.storey)
        if self._forbidden(place):
            return None
        with self._lock:  # the planner's own caches are not made for threads
            stop = planner.stop_for(start.xy, place.xy)
            way = None if stop is None else planner.way(start.xy, stop.xy)
        if stop is None or way is None:
            return None
        points = np.column_stack([way.points, np.full(len(way.points), obstacles.floor_m)])
        return Route(stop, points, way.length_m, way.cost, (start.storey,))

    def answer(self, start: Float[np.ndarray, " n"], place: Float[np.ndarray, " n"]) -> PathAnswer:
        """Return the path between two places as JSON; see ``spot`` for the numbers of a place."""
        if not (np.isfinite(start).all() and np.isfinite(place).all()):
            raise NavigationError("A coordinate is not a finite number; give metres, such as 1.5,2.0.")
        one, other = self.spot(start), self.spot(place)
        found, storeys = self.between(one, other), self.avlmap.storeys
        if found is None:
            return {"found": False, "points": [], "length_m": None, "cost": None, "stop": None,
                    "note": self._no_path(one, other), "frame": FRAME}  # fmt: skip
        answer: PathAnswer = {
            "found": True,
            "points": [self._world(point) for point in found.points],
            "length_m": found.length_m,
            "cost": found.cost,
            "stop": self.stop_answer(found),
            "note": "",
            "frame": FRAME,
        }
        if storeys is not None:
            answer["storeys"] = [storeys[number].name for number in found.storeys]
        return answer

    def stop_answer(self, route: Route) -> StopAnswer:
        """Return where a body stops at the end of a route."""
        at = np.append(route.stop.xy, self._planned(route.storeys[-1])[0].floor_m)
        return {"position": self._world(at), "beside_m": route.stop.beside_m, "seen": bool(route.stop.seen)}

    def _no_path(self, start: Spot, goal: Spot) -> str:
        ends, storeys = {"start": start, "goal": goal}, self.avlmap.storeys
        off = [name for name, at in ends.items() if not self.planner(at.storey).costmap.holds(at.xy)]
        if off:
            return f"the {' and the '.join(off)} {'lies' if len(off) == 1 else 'lie'} outside of the map"
        note = "" if storeys is None else storeys.refusal(start.storey, goal.storey, self.shape.climbs)
        return note or self._forbidden(goal) or "no free floor leads there"

    def _forbidden(self, spot: Spot) -> str:
        obstacles, _ = self._planned(spot.storey)
        return obstacles.forbids(self.avlmap.space.world(np.append(spot.xy, obstacles.floor_m)))

    def _world(self, level: Float[np.ndarray, "3"]) -> list[float]:
        return [float(value) for value in self.avlmap.space.world(level)]


def _joined(legs: "list[Route]") -> Route:
    points = np.concatenate([legs[0].points[:1], *(leg.points[1:] for leg in legs)])
    storeys = tuple(dict.fromkeys(number for leg in legs for number in leg.storeys))
    length_m = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return Route(legs[-1].stop, points, length_m, sum(leg.cost for leg in legs), storeys)


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

    Goals of half the best score and less are left out: near and wrong helps nobody. ``near`` is where the body is.
    """
    start = finder.spot(near)
    likely = [goal for goal in answer.goals if goal.score >= 0.5 * answer.goals[0].score]
    goals: list[NearGoal] = []
    for goal in likely:
        found = finder.between(start, finder.spot(np.array(goal.position)))
        goals.append(
            {
                "position": list(goal.position),
                "score": goal.score,
                "probability": goal.probability,
                "reachable": found is not None,
                "path_m": None if found is None else found.length_m,
                "stop": None if found is None else finder.stop_answer(found),
            }
        )
    goals.sort(key=lambda one: (one["path_m"] is None, one["path_m"] or 0.0))
    return {"found": answer.found, "probability": answer.probability, "goals": goals[:top], "frame": FRAME}
