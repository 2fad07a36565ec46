"""The truth of a recorded scene, and the rule that makes a goal unambiguous: one near, all others farther."""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np
from jaxtyping import Float, Int

from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import Area, SceneObject

NEAR_M = 2.5  # the right thing is at most this far, horizontally, from the place to the thing's box
MARGIN_M = 1.5  # every other thing of the category is at least this much farther
LEAST_SEEN = 50  # voxels: an eighth of a square metre of surface


@dataclass(frozen=True, slots=True)
class Box:
    """A box along the axes of the scene's world (z up), metres."""

    low: Triple
    high: Triple

    def distance_m(self, position: Triple) -> float:
        """Return the horizontal distance of a place to the box; 0 over it, under it and in it."""
        low, high, at = (np.asarray(v, np.float64)[:2] for v in (self.low, self.high, position))
        return float(np.linalg.norm(np.maximum(np.maximum(low - at, at - high), 0.0)))

    def centre_distance_m(self, position: Triple) -> float:
        """Return the horizontal distance of a place to the middle of the box."""
        low, high, at = (np.asarray(v, np.float64)[:2] for v in (self.low, self.high, position))
        return float(np.linalg.norm((low + high) / 2 - at))


@dataclass(frozen=True, slots=True)
class Event:
    """A sound that can be queried.

    ``place`` is where it was heard (overlay) or came from (acoustic), metres, world; ``track`` has the robot's places
    while it was heard (overlay), or none.
    """

    category: str
    place: Triple
    track: tuple[Triple, ...] = ()

    @property
    def right(self) -> "tuple[Box, ...]":
        """The right answers to a question for this sound: its places, as boxes without extent."""
        return tuple(Box(at, at) for at in (self.track or (self.place,)))


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """The things and sounds that are truly in a scene and were recorded.

    ``seen`` says how many voxels of the map each thing fills. Things of other storeys than that between the heights
    ``storey_m`` are neither queried nor rivals, since distances are horizontal.
    """

    scene: str
    objects: tuple[SceneObject, ...]
    seen: Int[np.ndarray, " objects"]
    areas: tuple[Area, ...] = ()
    events: tuple[Event, ...] = ()
    storey_m: tuple[float, float] = (-np.inf, np.inf)

    def ambiguous(self) -> dict[str, list[int]]:
        """Return the things of each category of which the recording shows two or more; unseen ones are among them."""
        found: dict[str, list[int]] = {}
        for instance, thing in enumerate(self.objects):
            on_storey = self.storey_m[0] <= thing.centre[2] <= self.storey_m[1]
            if thing.category not in STRUCTURE and on_storey:
                found.setdefault(thing.category, []).append(instance)
        return {name: own for name, own in found.items() if sum(map(self.shows, own)) >= 2}

    def shows(self, instance: int) -> bool:
        """Return whether the recording shows enough of a thing to query it."""
        return bool(self.seen[instance] >= LEAST_SEEN)

    def box(self, instance: int) -> Box:
        """Return the box round a thing."""
        thing = self.objects[instance]
        return Box(thing.low, thing.high)


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A picture that a query may use. ``share`` is for each thing of the scene the part of the pixels that shows it."""

    world_from_camera: Float[np.ndarray, "4 4"]
    share: Float[np.ndarray, " objects"]


def photo_name(world_from_camera: Float[np.ndarray, "4 4"]) -> str:
    """Return the name of the file that holds the photo taken from a pose."""
    return f"{sha256(world_from_camera.round(9).tobytes()).hexdigest()[:12]}.png"


def alone_near(distance_m: Sequence[float], near_m: float = NEAR_M, margin_m: float = MARGIN_M) -> int | None:
    """Return the one that is near while all others are clearly farther; None where there is no such one."""
    if not len(distance_m):
        return None
    order = np.argsort(distance_m, kind="stable")
    nearest = float(distance_m[order[0]])
    if nearest > near_m or (len(order) > 1 and float(distance_m[order[1]]) - nearest < margin_m):
        return None
    return int(order[0])


def heard_places(events: Sequence[Event]) -> dict[str, list[Event]]:
    """Return the events of each category, in the order in which they were heard."""
    heard: dict[str, list[Event]] = {}
    for event in events:
        heard.setdefault(event.category, []).append(event)
    return heard


def shown_boxes(evidence: Evidence) -> dict[str, list[Box]]:
    """Return the boxes of each category of which the recording shows a thing, unseen things of it among them."""
    low, high = evidence.storey_m
    found: dict[str, list[int]] = {}
    for instance, thing in enumerate(evidence.objects):
        if thing.category not in STRUCTURE and low <= thing.centre[2] <= high:
            found.setdefault(thing.category, []).append(instance)
    return {
        name: [evidence.box(i) for i in own] for name, own in sorted(found.items()) if any(map(evidence.shows, own))
    }


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
