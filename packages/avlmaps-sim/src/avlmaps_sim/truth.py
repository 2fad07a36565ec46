"""The truth of a simulated recording, written beside it for evaluation; mapping never reads it."""

import csv
import io
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core import poses
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.recordings.layout import DESCRIPTION, POSES_HEADER, UNFINISHED
from avlmaps_sim.hearing.schedule import Sounding
from avlmaps_sim.mesh import Triple
from avlmaps_sim.mixing.add_sounds import EVENTS
from avlmaps_sim.mixing.add_sounds import EVENTS_HEADER as COMMON_HEADER
from avlmaps_sim.scene import Area, Scene, SceneObject

OBJECTS, AREAS = "objects.json", "areas.json"
TRUE_POSES, SIMULATION, SEMANTIC = "true_poses.csv", "simulation.json", "semantic"
EVENTS_HEADER = (*COMMON_HEADER, "source_x", "source_y", "source_z", "instance")


@dataclass(frozen=True, slots=True)
class HeardEvent:
    """One sound of a recording."""

    onset_s: float  # when it is first heard, the recording's time
    offset_s: float  # when it ends
    category: str  # what it is
    clip: str  # the clip's name
    robot: Triple  # where the robot was when it was half over
    source: Triple  # where it came from
    instance: int  # the object that made it, −1 for none


@dataclass(frozen=True, slots=True)
class Truth:
    """The truth of a scene: sounds, things, rooms."""

    simulation: dict[str, Any]  # the scene's name, the seed and the settings that made the recording
    events: tuple[HeardEvent, ...]  # in the order of their onsets
    objects: tuple[SceneObject, ...]  # indexed by the instance that ``semantic/`` and the events name
    areas: tuple[Area, ...]  # the rooms


def write_truth(out: Path, scene: Scene, soundings: Sequence[Sounding], simulation: dict[str, Any]) -> None:
    """Write the events, the objects, the rooms, and how all was made, into a recording's folder."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(EVENTS_HEADER)
    for s in soundings:
        places = [f"{value:.4f}" for value in (*s.robot, *s.source.position)]
        times = (f"{s.onset_s:.4f}", f"{s.offset_s:.4f}")
        row = (*times, s.source.category, s.source.clip, *places[:3], "0.0", *places[3:], s.source.instance)
        table.writerow(row)
    write_bytes_atomically(out / EVENTS, text.getvalue().encode("utf-8"))
    _write_json(out / OBJECTS, [_object(*pair) for pair in enumerate(scene.objects)])
    _write_json(out / AREAS, [_area(*pair) for pair in enumerate(scene.areas)])
    _write_json(out / SIMULATION, simulation)


def write_true_poses(
    out: Path, stamps_s: Float[np.ndarray, " n"], world_from_camera: Float[np.ndarray, "n 4 4"]
) -> None:
    """Write where the camera truly was, beside the odometry that drifts."""
    numbers = np.column_stack([stamps_s, world_from_camera[:, :3, 3], poses.to_quaternion(world_from_camera)])
    lines = [",".join(repr(float(number)) for number in row) for row in numbers]
    write_bytes_atomically(out / TRUE_POSES, "\n".join([POSES_HEADER, *lines, ""]).encode("utf-8"))


def read_truth(recording: Path) -> Truth:
    """Read the truth beside a recording.

    ``RecordingError``: there is none, or a file does not hold what this program writes.
    """
    for name in (EVENTS, OBJECTS, AREAS, SIMULATION):
        if not (recording / name).is_file():
            raise RecordingError(f"{recording} has no {name}; only recordings made by avlmaps record know the truth.")
    try:
        with (recording / EVENTS).open(newline="", encoding="utf-8") as stream:
            events = tuple(_event(row) for row in csv.DictReader(stream))
        simulation, objects, areas = (_read_json(recording / name) for name in (SIMULATION, OBJECTS, AREAS))
        return Truth(
            simulation,
            events,
            tuple(_read_object(entry) for entry in objects),
            tuple(_read_area(entry) for entry in areas),
        )
    except (KeyError, ValueError, TypeError) as error:
        raise RecordingError(f"The truth beside {recording} is damaged ({error!r}); record it again.") from None


def _event(row: dict[str, str]) -> HeardEvent:
    robot = (float(row["x"]), float(row["y"]), float(row["z"]))
    source = (float(row["source_x"]), float(row["source_y"]), float(row["source_z"]))
    times = (float(row["onset_s"]), float(row["offset_s"]))
    return HeardEvent(*times, row["category"], row["clip"], robot, source, int(row["instance"]))


def _object(instance: int, thing: SceneObject) -> dict[str, Any]:
    return {
        "instance": instance,
        "category": thing.category,
        "name": thing.name,
        "family": thing.family,
        "area": thing.area,
        "heading_rad": round(float(thing.heading_rad), 5),
        **{key: _rounded(getattr(thing, key)) for key in ("low", "high", "centre", "size")},
    }


def _area(index: int, area: Area) -> dict[str, Any]:
    return {
        "area": index,
        "kind": area.kind,
        "name": area.name,
        "polygon": [_rounded(corner) for corner in area.polygon.tolist()],
        "floor_m": round(float(area.floor_m), 4),
        "ceiling_m": round(float(area.ceiling_m), 4),
    }


def _read_object(entry: dict[str, Any]) -> SceneObject:
    low, high = (tuple(float(v) for v in entry[key]) for key in ("low", "high"))
    return SceneObject(
        entry["category"], low, high, entry["heading_rad"], entry["family"], entry["name"], entry["area"]  # pyright: ignore[reportArgumentType]
    )  # fmt: skip


def _read_area(entry: dict[str, Any]) -> Area:
    polygon = np.array(entry["polygon"], np.float64).reshape(-1, 2)
    return Area(entry["kind"], polygon, entry["floor_m"], entry["ceiling_m"], entry["name"])


def _rounded(values: Sequence[float | int]) -> list[float]:
    return [round(float(value), 4) for value in values]


def clear_unfinished(out: Path) -> None:
    """Take away the truth that a recording left which was cut short; never anything else."""
    if not (out / UNFINISHED).exists() or (out / DESCRIPTION).exists():
        return
    shutil.rmtree(out / SEMANTIC, ignore_errors=True)
    for name in (EVENTS, OBJECTS, AREAS, TRUE_POSES, SIMULATION):
        (out / name).unlink(missing_ok=True)


def _read_json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def _write_json(path: Path, content: Any) -> None:
    write_bytes_atomically(path, (json.dumps(content, indent=1) + "\n").encode("utf-8"))
