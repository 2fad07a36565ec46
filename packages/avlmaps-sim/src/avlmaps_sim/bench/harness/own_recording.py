"""A recording of the user's own with true boxes beside it (``objects.json``), to be measured like a simulated one.

``objects.json`` is a list of things: ``{"category": "chair", "low": [x, y, z], "high": [x, y, z]}``, metres, along the
axes of the recording's world, whose z axis points up; ``"area"`` may give the number of its room. ``areas.json`` lists
rooms (``{"kind": "kitchen", "polygon": [[x, y], ...], "floor_m": 0, "ceiling_m": 2.6}``) and ``events.csv`` the sounds
(as ``avlmaps add-sounds`` writes it); without them the tables that need them are empty. Every tenth frame is held out
of the map and serves as a photo.
"""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from avlmaps.core.poses import apply
from avlmaps.recordings.types import Recording, Subset
from avlmaps_sim.bench.harness.evidence import Photo
from avlmaps_sim.bench.harness.settings import TaskError
from avlmaps_sim.mesh import Triple
from avlmaps_sim.scene import NOTHING, Area, SceneObject
from avlmaps_sim.truth import AREAS, OBJECTS, HeardEvent, Truth

_HELD_OUT = 10  # one of this many frames is a photo
_GROWN_M = 0.05
_MOST_TILT = 0.996  # cosine of 5 degrees
_STRIDE_PX = 4


def is_recording(spec: str) -> bool:
    """Return whether a scene's name is a folder with ``objects.json``."""
    return (Path(spec) / OBJECTS).is_file()


@dataclass(eq=False)
class OwnRecording:
    """A recording and the truth beside it."""

    whole: Recording
    truth: Truth

    @classmethod
    def open(cls, folder: Path) -> "OwnRecording":
        """Open a recording and read the truth beside it.

        Raises:
            TaskError: a file of the truth is damaged, or the recording has fewer than 20 frames.
            RecordingError: it is not a recording.
        """
        from avlmaps.recordings.open import open_recording

        recording = open_recording(folder)
        if len(recording) < 20:
            raise TaskError(f"{folder} has {len(recording)} frames; a benchmark takes at least 20.")
        try:
            objects = tuple(map(_thing, json.loads((folder / OBJECTS).read_text(encoding="utf-8"))))
            areas = json.loads((folder / AREAS).read_text(encoding="utf-8")) if (folder / AREAS).is_file() else []
            truth = Truth({}, tuple(_events(folder / "events.csv")), objects, tuple(map(_area, areas)))
        except (KeyError, ValueError, TypeError, AttributeError) as fault:
            raise TaskError(
                f"The truth beside {folder} cannot be read ({fault!r}); each thing of {OBJECTS} takes a category, low "
                "and high (three numbers each, metres)."
            ) from fault
        if not objects:
            raise TaskError(f"{folder / OBJECTS} lists no thing; add at least two of one category.")
        return cls(recording, truth)

    @cached_property
    def mapped(self) -> Recording:
        """The frames that become the map."""
        numbers = np.arange(len(self.whole))
        return Subset(self.whole, numbers[numbers % _HELD_OUT != _HELD_OUT - 1])

    def label(self, centres: Float[np.ndarray, "n 3"], up_in_world: Float[np.ndarray, "3"]) -> Int[np.ndarray, " n"]:
        """Return the smallest box round each point, -1 for none.

        ``TaskError``: the world's z axis does not point up.
        """
        if float(up_in_world[2]) < _MOST_TILT:
            raise TaskError(
                f"The z axis of {self.whole.path} does not point up (up is {np.round(up_in_world, 2).tolist()}); turn "
                "its poses and boxes so that it does."
            )
        things = self.truth.objects
        label = np.full(len(centres), NOTHING)
        for number in sorted(range(len(things)), key=lambda n: -float(np.prod(things[n].size))):  # smallest last
            low, high = np.array(things[number].low) - _GROWN_M, np.array(things[number].high) + _GROWN_M
            label[((centres >= low) & (centres <= high)).all(axis=1)] = number
        return label

    def photos(self, count: int) -> list[Photo]:
        """Return held-out frames, spread over the walk, and what of them each thing fills."""
        held_out = np.arange(_HELD_OUT - 1, len(self.whole), _HELD_OUT)
        chosen = held_out[np.linspace(0, len(held_out) - 1, min(count, len(held_out))).round().astype(int)]
        return [self._photo(int(number)) for number in chosen]

    def _photo(self, number: int) -> Photo:
        frame = self.whole.frame(number)
        depth_m, camera = frame.depth_m[::_STRIDE_PX, ::_STRIDE_PX].astype(np.float64), frame.rig.depth
        row, column = np.nonzero(depth_m > 0.0)
        z = depth_m[row, column]
        x = (column * _STRIDE_PX + 0.5 - camera.cx) / camera.fx * z
        y = (row * _STRIDE_PX + 0.5 - camera.cy) / camera.fy * z
        points = apply(frame.world_from_camera, np.stack([x, y, z], axis=1))
        label = self.label(points, np.array([0.0, 0.0, 1.0]))
        shown = np.bincount(label[label != NOTHING], minlength=len(self.truth.objects))
        return Photo(self.whole.world_from_camera[number], shown / max(1, depth_m.size))

    def picture(self, world_from_camera: Float[np.ndarray, "4 4"]) -> UInt8[np.ndarray, "h w 3"]:
        """Return the colour picture of the frame taken from a pose."""
        away = np.abs(self.whole.world_from_camera - world_from_camera).sum(axis=(1, 2))
        return self.whole.frame(int(np.argmin(away))).rgb


def _thing(entry: dict[str, Any]) -> SceneObject:
    low, high = _triple(entry["low"]), _triple(entry["high"])
    if any(a > b for a, b in zip(low, high, strict=True)):
        raise ValueError(f"low {low} lies above high {high}")
    return SceneObject(
        str(entry["category"]), low, high, name=str(entry.get("name", "")), area=int(entry.get("area", -1))
    )


def _area(entry: dict[str, Any]) -> Area:
    polygon = np.array(entry["polygon"], np.float64).reshape(-1, 2)
    return Area(entry["kind"], polygon, float(entry["floor_m"]), float(entry["ceiling_m"]), str(entry.get("name", "")))


def _events(path: Path) -> list[HeardEvent]:
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as stream:
        return [_event(row) for row in csv.DictReader(stream)]


def _event(row: dict[str, str]) -> HeardEvent:
    robot = _triple([row[name] for name in ("x", "y", "z")])
    source = _triple([row.get(f"source_{name}") or row[name] for name in ("x", "y", "z")])
    times = float(row["onset_s"]), float(row["offset_s"])
    return HeardEvent(*times, row["category"], row.get("clip", ""), robot, source, NOTHING)


def _triple(values: Sequence[Any]) -> Triple:
    x, y, z = (float(value) for value in values)
    if not np.isfinite([x, y, z]).all():
        raise ValueError(f"{values} holds NaN or infinity")
    return x, y, z
