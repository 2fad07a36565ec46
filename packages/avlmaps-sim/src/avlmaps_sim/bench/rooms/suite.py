"""The suite ``avlmaps bench rooms``: the rooms of a map against those of its scene, before and after."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps_sim.bench.harness.figures import (
    Table,
    in_percent,
    in_words,
    markdown,
    median_interval,
    of_mean,
    provenance,
    wilson,
    write_answer,
)
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.runs import IndexingSettings
from avlmaps_sim.bench.rooms.scores import Floor, Judged, Listed, Matched, floors_of, judged
from avlmaps_sim.scenes import open_scene

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

NOTE = (
    "Listed rooms are matched with the true ones so that their intersections over unions (IoU) add up to most; a true "
    "room without one counts 0. Named rightly: of all true rooms, those whose listed room has a right name. Count "
    "right: homes with as many listed rooms as true ones. In the first table an opening wider than 2.2 m makes one "
    "room of two areas, and either name is right; in the second each area is a room by itself. "
    "Truth is that of the scene, which no map reads."
)
WAY = "walls and doorways"
TABLES = {"rooms": True, "areas": False}


def run_rooms(settings: IndexingSettings | None, out: Path) -> Any:
    """List the rooms of scenes, whose maps are those of the suite ``indexing`` in the same folder; write tables."""
    settings = settings or IndexingSettings()
    weights = settings.checked()
    todo = scene_jobs(settings, settings.recorded, settings.scenes, out / "work")
    found = side_by_side(_scene, todo, settings.jobs, "rooms", lambda one: one.spec)
    tables: dict[str, Table] = {}
    for name in TABLES:
        tables[name] = {"columns": _COLUMNS, "rows": [_row(WAY, [one[name] for one in found])]}
    by_home = [_row(one["rooms"].scene, [one["rooms"]]) for one in found]
    tables["rooms by home"] = {"columns": ["scene", *_COLUMNS[1:]], "rows": by_home}
    answer = {
        "suite": "rooms",
        **provenance(settings, settings.recorded, settings.scenes, weights),
        "note": NOTE,
        "tables": tables,
    }
    written = write_answer(answer, out, f"# Rooms\n\n{in_words(answer)}\n\n{NOTE}\n\n{markdown(tables)}")
    return written


def _scene(job: SceneJob) -> dict[str, Judged]:
    place = Workplace(job, open_scene)
    avlmap, truth = place.avlmap, place.truth
    cameras = np.asarray(avlmap.data.keyframes.world_from_camera, np.float64)[:, :3, 3]
    out: dict[str, Judged] = {}
    for name, join in TABLES.items():
        floors = floors_of(truth.areas, place.wall_points, avlmap.space.centres, cameras, join)
        out[name] = judged(job.spec, floors, [rooms_by_walls(avlmap, floor) for floor in floors])
    return out


def rooms_by_walls(avlmap: "AVLMap", floor: Floor) -> list[Listed]:
    """Return the rooms of a storey as a map lists them."""
    return [Listed(room.name, floor.mask(room.outline), room.area_m2 or 0.0) for room in avlmap.rooms()]


_COLUMNS = [
    "rooms by", "homes", "true rooms", "listed", "mean IoU", "95 %", "IoU over 0.5 %", "95 %",
    "named rightly %", "95 %", "count right", "median area error %", "95 %",
]  # fmt: skip


def _row(way: str, homes: Sequence[Judged]) -> list[object]:
    rooms: list[Matched] = [room for home in homes for room in home.rooms]
    overlap = np.array([room.overlap for room in rooms])
    by_home = np.array([np.mean([room.overlap for room in home.rooms]) for home in homes if home.rooms])
    low, high = of_mean(by_home if len(by_home) > 1 else overlap)
    over, named = int((overlap > 0.5).sum()), sum(room.is_named for room in rooms)
    error = np.array([room.area_error for room in rooms])
    error = error[np.isfinite(error)]
    middle = median_interval(error) if len(error) else (1.0, 0.0, 1.0)
    right = sum(home.listed == len(home.rooms) for home in homes)
    return [
        way, len(homes), len(rooms), sum(home.listed for home in homes),
        round(float(overlap.mean()), 3), f"{low:.3f} to {high:.3f}",
        *_share(over, len(rooms)), *_share(named, len(rooms)), f"{right} of {len(homes)}",
        round(100.0 * middle[0], 1), in_percent(middle[1:]),
    ]  # fmt: skip


def _share(hits: int, count: int) -> tuple[float, str]:
    return round(100.0 * hits / max(count, 1), 1), in_percent(wilson(hits, count))
