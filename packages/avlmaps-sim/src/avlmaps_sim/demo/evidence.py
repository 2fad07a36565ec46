"""The truth of the home and the part of it that the walk showed; questions and verdicts come from it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from avlmaps.recordings.types import Recording
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import Area, SceneObject
from avlmaps_sim.truth import SEMANTIC, HeardEvent, read_truth

# A thing was shown when it filled at least this share of the picture in at least this many frames.
LEAST_SHARE, LEAST_FRAMES = 0.006, 2


@dataclass(frozen=True, slots=True)
class Box:
    """A true place: the box round a thing, or a single point; metres, world."""

    low: Triple
    high: Triple

    @classmethod
    def of(cls, thing: SceneObject) -> "Box":
        """Return the box round a thing."""
        return cls(thing.low, thing.high)

    @classmethod
    def at(cls, place: Sequence[float]) -> "Box":
        """Return a box without extent."""
        x, y, z = (float(value) for value in place)
        return cls((x, y, z), (x, y, z))

    def distance_m(self, place: Sequence[float]) -> float:
        """Return the horizontal distance from a place to the nearest point of the box; 0 inside."""
        low, high, xy = (np.asarray(v, float)[:2] for v in (self.low, self.high, place))
        return float(np.linalg.norm(np.maximum(np.maximum(low - xy, xy - high), 0.0)))

    def apart_m(self, other: "Box") -> float:
        """Return the horizontal distance between two boxes; 0 where they overlap."""
        low_a, high_a, low_b, high_b = (np.asarray(v)[:2] for v in (self.low, self.high, other.low, other.high))
        return float(np.linalg.norm(np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """A home and a walk through it.

    ``shown`` are the things that the walk showed well; events are in the order of their onsets.
    """

    objects: tuple[SceneObject, ...]
    shown: Bool[np.ndarray, " objects"]
    areas: tuple[Area, ...]
    events: tuple[HeardEvent, ...]
    stamps_s: Float[np.ndarray, " n"]
    walk: Float[np.ndarray, "n 3"]

    @classmethod
    def of(cls, recording: Recording) -> "Evidence":
        """Read the truth beside a recording, and count in its instance pictures what was shown.

        ``RecordingError``: the recording has no truth.
        """
        truth = read_truth(recording.path)
        shown = _shown(recording.path / SEMANTIC, len(truth.objects))
        walk = np.asarray(recording.world_from_camera)[:, :3, 3]
        return cls(truth.objects, shown, truth.areas, truth.events, np.asarray(recording.stamps_s), walk)

    def of_category(self, category: str) -> list[int]:
        """Return the things of a category, shown or not."""
        return [i for i, thing in enumerate(self.objects) if thing.category == category]

    def ambiguous(self) -> dict[str, list[int]]:
        """Return the things of each category of which the walk showed two or more; unseen ones are among them."""
        names = sorted({thing.category for thing in self.objects} - set(STRUCTURE))
        every = {name: self.of_category(name) for name in names}
        return {name: own for name, own in every.items() if int(self.shown[own].sum()) >= 2}

    def kind_of_area(self, instance: int) -> str:
        """Return the kind of room that a thing stands in, or ``""``."""
        area = self.objects[instance].area
        return self.areas[area].kind if area >= 0 else ""

    def heard_from(self, event: HeardEvent) -> list[Box]:
        """Return the places of the robot while a sound was heard; at least one."""
        during = (self.stamps_s >= event.onset_s) & (self.stamps_s <= event.offset_s)
        return [Box.at(event.robot), *(Box.at(place) for place in self.walk[during])]


def _shown(folder: Path, count: int) -> Bool[np.ndarray, " objects"]:
    import cv2

    frames: Int[np.ndarray, " objects"] = np.zeros(count, np.int64)
    for file in sorted(folder.glob("*.png")):
        instance = np.asarray(cv2.imread(str(file), cv2.IMREAD_UNCHANGED))
        pixels = np.bincount(instance.ravel(), minlength=count + 1)[1 : count + 1]
        frames += pixels >= LEAST_SHARE * instance.size
    return frames >= LEAST_FRAMES
