"""The suite ``avlmaps bench rooms``: the rooms of a map against those of its scene, before and after."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.query.floor_plan import dilated
from avlmaps.query.room_regions import WIDEST_M
from avlmaps.query.voxel_space import connected
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
from avlmaps_sim.scene import Area
from avlmaps_sim.scenes import open_scene

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

CELL_M = 0.1
_WALL_M = (1.2, 1.9)  # heights over the floor at which an opening has no wall
_BESIDE_CELLS = 1  # a wall's faces lie beside the line between two areas
_SEEN = 0.3  # of a room's floor, in columns that hold voxels
_WALKED_M = (0.8, 2.2)  # height of cameras over the floor that they stood on


@dataclass(frozen=True, slots=True, eq=False)
class Floor:
    """A storey in cells of 10 cm; cell (i, j) covers ``origin_m + [i, i + 1) x [j, j + 1) · CELL_M``.

    ``label`` has the true room of each cell, -1 outside; ``kinds`` are the names that are right, several of an open
    plan; ``seen`` says which rooms the map shows some of.
    """

    floor_m: float
    origin_m: Float[np.ndarray, "2"]
    label: Int[np.ndarray, "nx ny"]
    kinds: tuple[tuple[str, ...], ...]
    seen: Bool[np.ndarray, " r"]

    @property
    def middles(self) -> Float[np.ndarray, "nx ny 2"]:
        """Middles of the cells."""
        return self.origin_m + (np.moveaxis(np.indices(self.label.shape), 0, -1) + 0.5) * CELL_M

    def mask(self, outline: Float[np.ndarray, "k 3"]) -> Bool[np.ndarray, "nx ny"]:
        """Return the cells within an outline; none where it lies on another storey."""
        if len(outline) < 3 or abs(float(outline[0, 2]) - self.floor_m) > 1.0:
            return np.zeros(self.label.shape, bool)
        return Area("", outline[:, :2]).contains(self.middles)


def floors_of(
    areas: Sequence[Area],
    walls: Float[np.ndarray, "w 3"],
    seen: Float[np.ndarray, "n 3"],
    cameras: Float[np.ndarray, "k 3"],
    join: bool,
) -> list[Floor]:
    """Return the storeys on which cameras stood.

    ``join`` makes one room of areas with an opening between them that is wider than any door.
    """
    out: list[Floor] = []
    for floor_m in sorted({round(area.floor_m, 2) for area in areas}):
        height = cameras[:, 2] - floor_m
        if ((height > _WALKED_M[0]) & (height < _WALKED_M[1])).any():
            own = [area for area in areas if abs(area.floor_m - floor_m) < 0.02]
            out.append(_floor(own, floor_m, walls, seen, join))
    return out


def _floor(
    areas: Sequence[Area],
    floor_m: float,
    walls: Float[np.ndarray, "w 3"],
    seen: Float[np.ndarray, "n 3"],
    join: bool,
) -> Floor:
    corners = np.concatenate([area.polygon for area in areas])
    origin = np.floor(corners.min(axis=0) / CELL_M - 10.0) * CELL_M
    shape = tuple((np.ceil((corners.max(axis=0) - origin) / CELL_M).astype(int) + 10).tolist())
    empty = Floor(floor_m, origin, np.full(shape, -1), (), np.zeros(0, bool))
    label = empty.label.copy()
    for number, area in enumerate(areas):
        label[area.contains(empty.middles)] = number
    joined = np.arange(len(areas))
    if join:
        between = (walls[:, 2] - floor_m > _WALL_M[0]) & (walls[:, 2] - floor_m < _WALL_M[1])
        pairs = _wide_openings(label, _cells(walls[between], origin, shape))
        joined = connected(len(areas), pairs[:, 0], pairs[:, 1])
    kinds = tuple(
        tuple(sorted({area.kind for area, own in zip(areas, joined.tolist(), strict=True) if own == number}))
        for number in range(int(joined.max()) + 1)
    )
    low = (seen[:, 2] - floor_m > -0.3) & (seen[:, 2] - floor_m < 2.0)
    shown = _cells(seen[low], origin, shape)
    label = np.asarray(np.where(label >= 0, joined[label], -1))
    some = [float(shown[label == number].mean()) >= _SEEN for number in range(len(kinds))]
    return Floor(floor_m, origin, label, kinds, np.array(some))


def _cells(
    points: Float[np.ndarray, "n 3"], origin: Float[np.ndarray, "2"], shape: tuple[int, ...]
) -> Bool[np.ndarray, "nx ny"]:
    out = np.zeros(shape, bool)
    cell = np.floor((points[:, :2] - origin) / CELL_M).astype(int)
    i, j = cell[((cell >= 0) & (cell < shape)).all(axis=1)].T
    out[i, j] = True
    return out


def _wide_openings(label: Int[np.ndarray, "nx ny"], wall: Bool[np.ndarray, "nx ny"]) -> Int[np.ndarray, "p 2"]:
    """Return the pairs of areas between which more than a door's width of their common side has no wall."""
    near = dilated(wall, 1 + 2 * _BESIDE_CELLS, 1 + 2 * _BESIDE_CELLS)
    open_m: dict[tuple[int, int], float] = {}
    for a, b, closed in (
        (label[1:], label[:-1], near[1:] | near[:-1]),
        (label[:, 1:], label[:, :-1], near[:, 1:] | near[:, :-1]),
    ):
        free = (a != b) & (a >= 0) & (b >= 0) & ~closed
        for one, other in zip(a[free].tolist(), b[free].tolist(), strict=True):
            pair = (min(one, other), max(one, other))
            open_m[pair] = open_m.get(pair, 2 * _BESIDE_CELLS * CELL_M) + CELL_M
    wide = [pair for pair, length in open_m.items() if length > WIDEST_M]
    return np.array(wide, np.int64).reshape(-1, 2)


@dataclass(frozen=True, slots=True, eq=False)
class Listed:
    """A room that a map lists, on a storey."""

    name: str
    mask: Bool[np.ndarray, "nx ny"]
    area_m2: float


@dataclass(frozen=True, slots=True)
class Matched:
    """A true room and the listed one that it is matched with.

    The overlap is intersection over union; the error of the listed area is a share of the true one, NaN without one.
    """

    kinds: tuple[str, ...]
    name: str = ""
    overlap: float = 0.0
    area_error: float = float("nan")

    @property
    def is_named(self) -> bool:
        """Whether the name is right."""
        return bool(self.name) and any(_same(self.name, kind) for kind in self.kinds)


@dataclass(frozen=True, slots=True)
class Judged:
    """The rooms of a scene. ``listed`` does not count those of true rooms that the map does not show."""

    scene: str
    rooms: tuple[Matched, ...]
    listed: int


def judged(scene: str, floors: Sequence[Floor], listed: Sequence[Sequence[Listed]]) -> Judged:
    """Match the listed rooms of each storey with the true ones, so that their overlaps add up to most."""
    rooms: list[Matched] = []
    count = 0
    for floor, own in zip(floors, listed, strict=True):
        shown = [one for one in own if one.mask.any() and not _mostly_unseen(floor, one.mask)]
        count += len(shown)
        rooms += _matched(floor, shown)
    return Judged(scene, tuple(rooms), count)


def _mostly_unseen(floor: Floor, mask: Bool[np.ndarray, "nx ny"]) -> bool:
    unseen = np.append(~floor.seen, False)[floor.label]
    return bool(unseen[mask].mean() > 0.5)


def _matched(floor: Floor, listed: Sequence[Listed]) -> list[Matched]:
    from scipy.optimize import linear_sum_assignment

    true = np.flatnonzero(floor.seen)
    overlap = np.zeros((len(true), len(listed)))
    for row, number in enumerate(true):
        for column, one in enumerate(listed):
            own = floor.label == number
            overlap[row, column] = (own & one.mask).sum() / (own | one.mask).sum()
    matches = dict(zip(*(side.tolist() for side in linear_sum_assignment(-overlap)), strict=True))
    out: list[Matched] = []
    for row, number in enumerate(true):
        column = matches.get(row, -1)
        if column < 0 or overlap[row, column] <= 0.0:
            out.append(Matched(floor.kinds[number]))
            continue
        area_m2 = float((floor.label == number).sum()) * CELL_M**2
        error = abs(listed[column].area_m2 - area_m2) / area_m2
        out.append(Matched(floor.kinds[number], listed[column].name, float(overlap[row, column]), error))
    return out


def _same(name: str, kind: str) -> bool:
    known = lexicon()
    a, b = known.find(name, EntryKind.ROOM), known.find(kind, EntryKind.ROOM)
    return name == kind or (a is not None and a == b) or known.is_a(name, kind, EntryKind.ROOM)


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
    found = side_by_side(_scene, todo, settings.jobs, "rooms")
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
    return write_answer(answer, out, f"# Rooms\n\n{in_words(answer)}\n\n{NOTE}\n\n{markdown(tables)}")


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
    """Return the rooms of a storey as a map lists them, an open plan under the name of its largest part."""
    rooms = ((next(iter(room.parts), room.name), room) for room in avlmap.rooms())
    return [Listed(name, floor.mask(room.outline), room.area_m2 or 0.0) for name, room in rooms]


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
