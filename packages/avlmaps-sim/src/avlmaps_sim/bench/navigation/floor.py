"""The ground of a scene as it truly is: where a robot can stand, what it can reach, how long the shortest path is."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose
from avlmaps_sim.bench.navigation.missions import SUCCESS_M, Goal
from avlmaps_sim.free_space import FreeSpace, floor_heights, free_space
from avlmaps_sim.scene import Scene

_AS_NEAR_M = 0.1  # places that are as near to a thing as a robot comes, within this
_ROOM_M = 0.1  # this much more than its radius is free round a robot at the start
_TRIES = 60


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """The part of one floor that the recording walked.

    Floors are counted from the lowest; in ``space`` stands a robot of the radius.
    """

    space: FreeSpace
    radius_m: float
    number: int = 0
    _ways: dict[tuple[object, ...], Float[np.ndarray, "nx ny"]] = field(default_factory=dict, repr=False)

    @classmethod
    def walked(
        cls, scene: Scene, camera: Float[np.ndarray, "n 3"], radius_m: float = 0.2, height_m: float = 1.5
    ) -> "Floor":
        """Return the floor below a walk, connected with its places."""
        eye_m = float(np.median(camera[:, 2]))
        below = [index for index, height in enumerate(floor_heights(scene)) if height < eye_m]
        number = below[-1] if below else 0
        whole = free_space(scene, radius_m, height_m, floor=number)
        parts = [whole.part_with(camera[index, :2]) for index in (0, len(camera) // 2)]
        return cls(max(parts, key=lambda part: part.area_m2), radius_m, number)

    def reachable(self, goal: Goal) -> bool:
        """Return whether some place from which the goal counts as reached can be driven to."""
        if not goal.moves:
            return True
        middles = self.space.middles()
        return bool(len(middles) and (goal.off_m(middles) < SUCCESS_M).any())

    def room_at(self, goal: Goal) -> float:
        """Return how near to a goal a robot can stand, metres."""
        middles = self.space.middles()
        return float(goal.off_m(middles).min()) if len(middles) else np.inf

    def shortest_m(self, goal: Goal, xy: Float[np.ndarray, "2"]) -> float:
        """Return the length of the shortest path from a place to a goal: to where a robot comes nearest to it.

        0 for a goal that is only looked at; inf where there is no way.
        """
        if not goal.moves:
            return 0.0
        key = (goal.boxes, goal.places, goal.rooms)
        if key not in self._ways:
            middles = self.space.middles()
            off = goal.off_m(middles)
            ends = middles[off <= off.min(initial=np.inf) + _AS_NEAR_M]
            self._ways[key] = self.space.distances_to_any_m(ends)
        i, j = self.space.cell_of(self.space.nearest(np.asarray(xy, np.float64)))
        return float(self._ways[key][i, j])

    def draw_start(self, rng: np.random.Generator, goal: Goal | None = None, apart_m: float = 0.0) -> GroundPose:
        """Draw a free place with some room round it, where it can be had at some distance from the first goal."""
        cells = np.argwhere(self.space.free & (self.space.clearance_m >= self.radius_m + _ROOM_M))
        cells = cells if len(cells) else np.argwhere(self.space.free)
        chosen = self.space.middle_of(cells[int(rng.integers(len(cells)))])
        for _ in range(_TRIES if goal is not None and goal.moves else 0):
            if goal is None or float(goal.off_m(chosen[None])[0]) >= apart_m:
                break
            chosen = self.space.middle_of(cells[int(rng.integers(len(cells)))])
        heading = float(rng.uniform(-np.pi, np.pi))
        return GroundPose(round(float(chosen[0]), 4), round(float(chosen[1]), 4), round(heading, 4))
