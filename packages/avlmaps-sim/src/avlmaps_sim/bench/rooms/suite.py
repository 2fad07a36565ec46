"""The suite ``avlmaps bench rooms``: the rooms of a map against those of its scene, before and after."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.query.floor_plan import CELL_M as PLAN_CELL_M
from avlmaps_sim.bench.harness.intervals import in_percent, median_interval, of_mean, wilson
from avlmaps_sim.bench.harness.provenance import in_words, provenance
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.runs import IndexingSettings
from avlmaps_sim.bench.output import Table, draw, markdown, write_answer
from avlmaps_sim.bench.rooms.scores import Floor, Judged, Listed, Matched, floors_of, judged
from avlmaps_sim.scenes import open_scene

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

NOTE = (
    "Listed rooms are matched with the true ones so that their intersections over unions (IoU) add up to most; a true "
    "room without one counts 0. Named rightly: of all true rooms, those whose listed room has a right name. Count "
    "right: homes with as many listed rooms as true ones. In the first table an opening wider than 2.2 m makes one "
    "room of two areas, and either name is right; in the second each area is a room by itself. Before: floor of one "
    "likeliest kind, up to walls, as version 0.2.0 listed it. Truth is that of the scene, which no map reads."
)
BEFORE, AFTER = "one likeliest kind (before)", "walls and doorways (after)"
TABLES = {"rooms": True, "areas": False}
_SEEN_VIEWS, _FEWEST_VIEWS = 0.1, 2


def run_rooms(settings: IndexingSettings | None, out: Path) -> Any:
    """List the rooms of scenes, whose maps are those of the suite ``indexing`` in the same folder; write tables."""
    settings = settings or IndexingSettings()
    weights = settings.checked()
    todo = scene_jobs(settings, settings.recorded, settings.scenes, out / "work")
    found = side_by_side(_scene, todo, settings.jobs, "rooms", lambda one: one.spec)
    tables: dict[str, Table] = {}
    for name in TABLES:
        ways = {way: [one[name, way] for one in found] for way in (BEFORE, AFTER)}
        tables[name] = {"columns": _COLUMNS, "rows": [_row(way, own) for way, own in ways.items()]}
    after = [one["rooms", AFTER] for one in found]
    tables["rooms by home"] = {"columns": ["scene", *_COLUMNS[1:]], "rows": [_row(one.scene, [one]) for one in after]}
    answer = {
        "suite": "rooms",
        **provenance(settings, settings.recorded, settings.scenes, weights),
        "note": NOTE,
        "tables": tables,
    }
    written = write_answer(answer, out, f"# Rooms\n\n{in_words(answer)}\n\n{NOTE}\n\n{markdown(tables)}")
    draw(tables, out / "rooms.png")
    return written


def _scene(job: SceneJob) -> dict[tuple[str, str], Judged]:
    place = Workplace(job, open_scene)
    avlmap, truth = place.avlmap, place.truth
    cameras = np.asarray(avlmap.stored.keyframes.world_from_camera, np.float64)[:, :3, 3]
    out: dict[tuple[str, str], Judged] = {}
    for name, join in TABLES.items():
        floors = floors_of(truth.areas, place.wall_points, avlmap.space.centres, cameras, join)
        for way, listed in ((BEFORE, rooms_by_kind), (AFTER, rooms_by_walls)):
            out[name, way] = judged(job.spec, floors, [listed(avlmap, floor) for floor in floors])
    return out


def rooms_by_walls(avlmap: "AVLMap", floor: Floor) -> list[Listed]:
    """Return the rooms of a storey as a map lists them."""
    return [Listed(room.name, floor.mask(room.outline), room.area_m2 or 0.0) for room in avlmap.rooms()]


def rooms_by_kind(avlmap: "AVLMap", floor: Floor) -> list[Listed]:
    """Return the rooms of a storey as version 0.2.0 listed them: connected floor of one likeliest kind."""
    field = avlmap.room_field
    if field is None:
        return []
    plan = field.plan
    region = plan.regions(np.where(field.views >= _SEEN_VIEWS, field.share.argmax(axis=1), -1))
    places = np.asarray(avlmap.stored.keyframes.centre, np.float64).reshape(-1, 3)
    cells = plan.cells_of(places)
    storey = int(np.abs(plan.storeys.floors_m - floor.floor_m).argmin())
    of_cell = region.reshape(plan.wall.shape)[storey]
    at = np.floor((floor.middles - plan.origin_m) / PLAN_CELL_M).astype(int)
    within = ((at >= 0) & (at < of_cell.shape)).all(axis=-1)
    shown = np.where(within, of_cell[tuple(np.clip(at, 0, np.array(of_cell.shape) - 1).transpose(2, 0, 1))], -1)
    out: list[Listed] = []
    for number in np.unique(region[cells]):
        members = cells[region[cells] == number]
        if len(members) >= _FEWEST_VIEWS and (of_cell == number).any():
            kind = field.kinds[int(field.share[members[0]].argmax())]
            out.append(Listed(kind, shown == number, float((of_cell == number).sum()) * PLAN_CELL_M**2))
    return out


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
