"""The evidence for missions of a scene: its true ground, and the things, sounds and photos that can be driven to."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose
from avlmaps_sim.bench.harness.evidence import Box, Evidence, Photo, alone_near, shown_boxes
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind
from avlmaps_sim.bench.navigation.missions import (
    PHOTO,
    SUCCESS_M,
    Goal,
    a_sound,
    an_area,
    an_image,
    an_object,
    in_area,
    near_image,
    near_sound,
    sound_near_image,
    sound_near_object,
)
from avlmaps_sim.free_space import FreeSpace, floor_heights, free_space
from avlmaps_sim.mesh import Triple
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


_SHOWN = 0.02  # of a photo's pixels that a thing fills, to count
_THINGS_IN_PHOTO = 2  # a photo of bare walls is in no query


@dataclass(frozen=True, eq=False)
class Ground:
    """A scene's evidence and its floor. Everything that it offers can be reached in truth."""

    evidence: Evidence
    floor: Floor
    photos: tuple[Photo, ...] = ()
    tasks: tuple[Task, ...] = ()

    def _reachable(self, goals: Sequence[Goal]) -> list[Goal]:
        return [goal for goal in goals if self.floor.reachable(goal)]

    @cached_property
    def heard(self) -> dict[str, list[Triple]]:
        """The places of each sound, in the order of the names."""
        places: dict[str, list[Triple]] = {}
        for event in self.evidence.events:
            places.setdefault(event.category, []).append(event.place)
        return dict(sorted(places.items()))

    @cached_property
    def sounds(self) -> list[tuple[str, Goal]]:
        """Every sound with its goal."""
        made = [(name, a_sound(name, places)) for name, places in self.heard.items()]
        return [(name, goal) for name, goal in made if self.floor.reachable(goal)]

    @cached_property
    def boxes(self) -> dict[str, list[Box]]:
        """The things of each category of which the recording shows some; also those of them that it does not show."""
        return shown_boxes(self.evidence)

    @cached_property
    def objects(self) -> list[Goal]:
        """A goal for each category."""
        return self._reachable([an_object(name, own) for name, own in self.boxes.items()])

    @cached_property
    def single(self) -> list[Goal]:
        """Goals for categories of which there is only one thing, so that relations to it are clear."""
        return self._reachable([an_object(name, own) for name, own in self.boxes.items() if len(own) == 1])

    @cached_property
    def areas(self) -> list[Goal]:
        """A goal for each kind of room on the storey."""
        low, high = self.evidence.storey_m
        rooms: dict[str, list[tuple[tuple[float, float], ...]]] = {}
        for area in self.evidence.areas:
            if low - 1.0 <= area.floor_m <= high:
                corners = tuple((float(x), float(y)) for x, y in area.polygon)
                rooms.setdefault(area.kind, []).append(corners)
        return self._reachable([an_area(kind, own) for kind, own in sorted(rooms.items())])

    @cached_property
    def good_photos(self) -> list[int]:
        """Photos that show some things, taken where a robot can come."""
        return [
            number
            for number, photo in enumerate(self.photos)
            if np.count_nonzero(photo.share >= _SHOWN) >= _THINGS_IN_PHOTO
            and self.floor.reachable(an_image(0, camera_of(photo)))
        ]

    def ambiguous_things(self, kind: TaskKind) -> list[tuple[Goal, Task]]:
        """Return goals for things that their name alone does not identify; a photo is called ``{photo 0}``."""
        made: list[tuple[Goal, Task]] = []
        for task in self.tasks:
            if task.kind is not kind:
                continue
            if kind is TaskKind.NEAR_SOUND:
                goal = near_sound(task.category, task.context, task.targets)
            elif kind is TaskKind.PHOTO:
                goal = near_image(task.category, 0, task.targets)
            else:
                goal = in_area(task.category, task.context, task.targets)
            if self.floor.reachable(goal):
                made.append((goal, task))
        return made

    def ambiguous_sounds(self) -> list[tuple[Goal, Photo | None]]:
        """Return goals for sounds that played in two places or more, identified by a thing or a photo near one."""
        made: list[tuple[Goal, Photo | None]] = []
        for sound, places in self.heard.items():
            if len(places) < 2:
                continue
            for category, own in self.boxes.items():
                chosen = alone_near([min(box.distance_m(place) for box in own) for place in places])
                if chosen is not None:
                    made.append((sound_near_object(sound, category, places[chosen]), None))
            for number in self.good_photos:
                photo = self.photos[number]
                away = [float(np.hypot(*np.subtract(place, camera_of(photo))[:2])) for place in places]
                chosen = alone_near(away)
                if chosen is not None:
                    made.append((sound_near_image(sound, 0, places[chosen]), photo))
        return [(goal, photo) for goal, photo in made if self.floor.reachable(goal)]


def camera_of(photo: Photo) -> Triple:
    """Return where a photo was taken."""
    x, y, z = (float(value) for value in photo.world_from_camera[:3, 3])
    return (x, y, z)


def renumbered(goal: Goal, photo: int) -> Goal:
    """Return a goal that calls its photo by another number."""
    before, after = PHOTO % 0, PHOTO % photo
    return replace(goal, said=goal.said.replace(before, after), program=goal.program.replace(before, after))
