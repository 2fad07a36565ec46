"""The storeys of a map, and the stairs between them, found in its voxels.

A floor is a height at which much surface has headroom and over which the camera was carried; two of them at least
1.8 m apart are two storeys. Stairs are surface with headroom that climbs from one floor to the next by steps of at most
0.26 m, wide enough for a person.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int

_APART_M = 1.8  # two floors closer than this are one storey with a step, a landing or stairs
_BELOW_M = 0.15  # what lies at most this far below a floor belongs to its storey
_CELL_M = 0.1  # of the columns that surfaces are looked for in, or the voxels' edge where that is more
_HEADROOM_M = 1.5
_KNEE_M = 0.5  # what reaches higher over a step stands beside it, and is no next step
_RISE_M = 0.26  # of a step, the voxels' edge included
_LEAST_M2, _LEAST_SHARE = 1.0, 0.15  # of a floor; the share is that of the largest
_CARRIED_M = (0.1, 2.3)  # heights over the floor at which a camera is carried
_CAMERA_M = 1.3  # over a floor that nobody measured
_ROUND_M = 0.25  # about a camera lies what it stands over
_SAME_M = 0.12  # two heights closer than this are one
_STOOD_SHARE = 0.02  # of the cameras: fewer do not make a storey
_BODY_M = 0.2  # radius of who climbs
_GAP = 2  # columns that a step may reach: narrow ones are unseen
_MOST_KEYS = 2**62
_FOOT, _STEP, _TOP = 0, 1, 2  # where a place lies: on the lower floor, between, on the upper floor
_ORDINALS = ("ground", "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


@dataclass(frozen=True, slots=True)
class Storey:
    """A floor and what stands on it; heights are z of the level frame, metres."""

    number: int  # from 0, the lowest of the map
    floor_m: float
    low_m: float  # what lies higher belongs to the storey,
    high_m: float  # if it lies lower than this

    @property
    def name(self) -> str:
        """As it is called in Britain: ground floor, first floor, second floor."""
        return f"{_ORDINALS[self.number] if self.number < len(_ORDINALS) else f'{self.number}th'} floor"


@dataclass(frozen=True, slots=True, eq=False)
class Stairs:
    """A flight, or several with landings, from one storey to the next."""

    below: int  # number of the lower storey; the upper one is the next
    points: Float[np.ndarray, "n 3"]  # path up, level frame, metres, from the lower floor to the upper one


@dataclass(frozen=True, slots=True, eq=False)
class Storeys:
    """The storeys of a map, and the stairs between them."""

    all: tuple[Storey, ...]  # lowest first
    stairs: tuple[Stairs, ...] = ()  # those that the map holds
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)  # unit vector in the recording frame, along which heights are

    @classmethod
    def single(cls, floor_m: float) -> "Storeys":
        """Return one storey that everything belongs to, with its floor at a height."""
        return cls((Storey(0, floor_m, -np.inf, np.inf),))

    def __len__(self) -> int:
        return len(self.all)

    def __getitem__(self, number: int) -> Storey:
        return self.all[number]

    @property
    def floors_m(self) -> Float[np.ndarray, " s"]:
        """Heights of the floors, rising."""
        return np.array([storey.floor_m for storey in self.all])

    def of(self, level_z_m: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Return the number of the storey of each height; what lies below all floors belongs to the lowest."""
        low = np.array([storey.low_m for storey in self.all[1:]])
        return np.searchsorted(low, np.asarray(level_z_m, np.float64), side="right").astype(np.int64)

    def of_places(self, places: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        """Return the number of the storey of each place, recording frame, metres."""
        return self.of(np.asarray(places, np.float64).reshape(-1, 3) @ np.array(self.up))

    def route(self, start: int, end: int) -> tuple[Stairs, ...] | None:
        """Return one stair for each change of storey, in the order they are climbed or descended; None without."""
        low, high = min(start, end), max(start, end)
        by_storey = {stairs.below: stairs for stairs in reversed(self.stairs)}
        if any(number not in by_storey for number in range(low, high)):
            return None
        climbed = tuple(by_storey[number] for number in range(low, high))
        if start <= end:
            return climbed
        return tuple(Stairs(one.below, one.points[::-1]) for one in reversed(climbed))

    def refusal(self, start: int, end: int, climbs: bool) -> str:
        """Return why a body comes from no storey to another, as a part of a sentence; ``""`` where it does."""
        if start == end:
            return ""
        one, other = self.all[start], self.all[end]
        where = (
            f"the place is on the {other.name}, whose floor lies at {other.floor_m:.2f} m, and the robot on the "
            f"{one.name} at {one.floor_m:.2f} m"
        )
        if self.route(start, end) is None:
            return f"{where}; the map holds no stairs between them: map them too, or name a place on the {one.name}"
        stays = f"{where}; the robot of this profile does not climb stairs: name a place on the {one.name}"
        return "" if climbs else stays


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """Occupied cells (i, j, k) as rising numbers: one column after the other, each from below."""

    keys: Int[np.ndarray, " n"]
    span: tuple[int, int, int]  # extents of the grid, margins included
    low: Int[np.ndarray, "3"]  # index of its first cell
    cell_m: tuple[float, float]  # edges of a cell along x and y, and along z

    @classmethod
    def of(cls, level: Float[np.ndarray, "n 3"], voxel_size_m: float) -> "_Columns | None":
        wide = max(_CELL_M, voxel_size_m)
        index = np.floor(level / np.array([wide, wide, voxel_size_m])).astype(np.int64)
        low = index.min(axis=0) - _GAP - 2
        high = index.max(axis=0) + _GAP + 3
        span: list[int] = (high - low).tolist()
        if float(span[0]) * span[1] * span[2] > _MOST_KEYS:
            return None
        index = index - low
        keys: Int[np.ndarray, " n"] = np.unique((index[:, 0] * span[1] + index[:, 1]) * span[2] + index[:, 2])
        return cls(keys, (span[0], span[1], span[2]), low, (wide, voxel_size_m))

    def surfaces(self) -> Int[np.ndarray, " m"]:
        column = self.keys // self.span[2]
        room = max(1, int(_HEADROOM_M / self.cell_m[1]))
        free = np.ones(len(self.keys), bool)
        free[:-1] = (column[1:] != column[:-1]) | (np.diff(self.keys) > room)
        return self.keys[free]

    def heights_m(self, keys: Int[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        return (keys % self.span[2] + self.low[2] + 0.5) * self.cell_m[1]

    def middles(self, keys: Int[np.ndarray, " m"]) -> Float[np.ndarray, "m 3"]:
        column = keys // self.span[2]
        xy = (np.stack([column // self.span[1], column % self.span[1]], axis=1) + self.low[:2] + 0.5) * self.cell_m[0]
        return np.c_[xy, self.heights_m(keys)]

    def under(self, surface: Int[np.ndarray, " m"], cameras: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, " k"]:
        from scipy.spatial import KDTree

        place, under = self.middles(surface), np.full(len(cameras), np.nan)
        close = KDTree(place[:, :2]).query_ball_point(cameras[:, :2], _ROUND_M)
        for number, rows in enumerate(close):
            down_m = cameras[number, 2] - place[rows, 2]
            there = place[rows, 2][(down_m >= _CARRIED_M[0]) & (down_m <= _CARRIED_M[1])]
            under[number] = np.median(there) if len(there) else np.nan
        return under

    def clear(self, keys: Int[np.ndarray, " m"]) -> Bool[np.ndarray, " m"]:
        reach = int(np.ceil(_BODY_M / self.cell_m[0]))
        knee, head = (max(1, round(height / self.cell_m[1])) for height in (_KNEE_M, _HEADROOM_M))
        out = np.ones(len(keys), bool)
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                if np.hypot(i, j) * self.cell_m[0] <= _BODY_M + 1e-9:
                    there = keys + (i * self.span[1] + j) * self.span[2]
                    first = np.searchsorted(self.keys, there + knee)
                    out &= first == np.searchsorted(self.keys, there + head, side="right")
        return out


def said_storeys(storeys: Storeys | None) -> str:
    """Return which storeys a map has, as a part of a sentence: "it holds 2 storeys: ground floor (0.02 m), ..."."""
    if storeys is None:
        return "it holds one storey"
    return f"it holds {len(storeys)} storeys: " + ", ".join(f"{one.name} ({one.floor_m:.2f} m)" for one in storeys.all)


def find_storeys(
    level: Float[np.ndarray, "n 3"], voxel_size_m: float, cameras: Float[np.ndarray, "k 3"]
) -> Storeys | None:
    """Find the storeys of a map; None for a map that has one, or that has none at all.

    ``level`` is the middles of its voxels, and ``cameras`` where its cameras were, level frame, metres; a storey is
    where one was carried.
    """
    cameras = np.asarray(cameras, np.float64).reshape(-1, 3)
    columns = None if not len(level) or stayed_on_one(cameras[:, 2]) else _Columns.of(level, voxel_size_m)
    if columns is None:
        return None
    surface = columns.surfaces()
    floors_m = _floors(columns, surface, cameras)
    if len(floors_m) < 2:
        return None
    edges = [-np.inf, *(floor_m - _BELOW_M for floor_m in floors_m[1:]), np.inf]
    storeys = [Storey(number, floor_m, *edges[number : number + 2]) for number, floor_m in enumerate(floors_m)]
    stairs = [one for below in range(len(storeys) - 1) for one in _stairs(columns, surface, storeys, below)]
    return Storeys(tuple(storeys), tuple(stairs))


def one_storey(floors_m: Sequence[tuple[float, float]], cameras_m: Float[np.ndarray, " k"]) -> Storeys:
    """Return the storey of a map that has one: its floor is the one that most cameras looked at.

    ``floors_m`` is height and weight of every floor, step and landing that is known. Where none is, the floor is
    guessed from the level z of the cameras.
    """
    if floors_m:
        return Storeys.single(min(floors_m, key=lambda floor: (-floor[1], floor[0]))[0])
    return Storeys.single(float(np.median(cameras_m)) - _CAMERA_M if len(cameras_m) else 0.0)


def stayed_on_one(cameras_m: Float[np.ndarray, " k"]) -> bool:
    """Return whether cameras differ too little in height to have been on two storeys; without any it is not known."""
    return bool(len(cameras_m)) and float(np.ptp(cameras_m)) < 0.5 * _APART_M


def _floors(columns: _Columns, surface: Int[np.ndarray, " m"], cameras: Float[np.ndarray, "k 3"]) -> list[float]:
    height_m, cell_m2 = columns.heights_m(surface), columns.cell_m[0] ** 2
    layer = surface % columns.span[2]
    count = np.bincount(layer, minlength=columns.span[2])
    pairs_m2 = (count + np.append(count[1:], 0)) * cell_m2  # a plane between two layers is split among them
    before, after = np.append(-1.0, pairs_m2[:-1]), np.append(pairs_m2[1:], -1.0)
    least = max(_LEAST_M2, _LEAST_SHARE * float(pairs_m2.max()))
    peaks = np.flatnonzero((pairs_m2 >= least) & (pairs_m2 >= before) & (pairs_m2 > after))
    known = [(float(np.median(height_m[(layer == at) | (layer == at + 1)])), float(pairs_m2[at])) for at in peaks]
    under_m = columns.under(surface, cameras)
    stood = [int(np.count_nonzero(np.abs(under_m - at_m) <= _SAME_M)) for at_m, _ in known]
    for camera_m in cameras[np.isnan(under_m), 2].tolist():  # it never saw what it stood on: the largest level below it
        below = [k for k, (at_m, _) in enumerate(known) if _CARRIED_M[0] <= camera_m - at_m <= _CARRIED_M[1]]
        if below:
            stood[max(below, key=lambda k: known[k][1])] += 1
    fewest = max(1.0, _STOOD_SHARE * len(cameras))
    chosen: list[float] = []
    for number in sorted(range(len(known)), key=lambda number: (-stood[number], -known[number][1])):
        apart = all(abs(known[number][0] - other) >= _APART_M for other in chosen)
        if stood[number] >= fewest and apart:
            chosen.append(known[number][0])
    return sorted(chosen)


def _stairs(columns: _Columns, surface: Int[np.ndarray, " m"], storeys: Sequence[Storey], below: int) -> list[Stairs]:
    from scipy.sparse import csgraph, csr_array

    low_m, high_m = storeys[below].floor_m, storeys[below + 1].floor_m
    z = columns.heights_m(surface)
    edge = columns.cell_m[1] + 0.5 * _CELL_M
    between = np.flatnonzero((z > low_m + edge) & (z < high_m - edge))
    steps = between[columns.clear(surface[between])]
    kind = np.full(len(surface), -1)
    kind[steps], kind[np.abs(z - low_m) <= edge], kind[np.abs(z - high_m) <= edge] = _STEP, _FOOT, _TOP
    nodes, kind, z = surface[kind >= 0], kind[kind >= 0], z[kind >= 0]
    one, other, cost = _strides(columns, nodes, z, np.flatnonzero(kind == _STEP))
    # Floors join nothing here: a slope of steps is one by itself.
    inner = kind[other] == _STEP
    shape = (len(nodes), len(nodes))
    _, slope = csgraph.connected_components(csr_array((cost[inner], (one[inner], other[inner])), shape), directed=False)
    foot, top = (np.unique(slope[one[kind[other] == end]]) for end in (_FOOT, _TOP))
    out: list[Stairs] = []
    for number in foot[np.isin(foot, top)].tolist():
        mine = slope[one] == number
        start, end, length = one[mine], other[mine], cost[mine]
        at_foot = np.flatnonzero(kind[end] == _FOOT)
        pairs = np.concatenate([start, end[at_foot]]), np.concatenate([end, start[at_foot]])
        graph = csr_array((np.concatenate([length, length[at_foot]]), pairs), shape)
        feet, tops = (np.unique(end[kind[end] == which]) for which in (_FOOT, _TOP))
        shortest: Any = csgraph.dijkstra  # its types know no min_only with predecessors
        total, before, _ = shortest(graph, indices=feet, return_predecessors=True, min_only=True)
        path = [int(tops[np.argmin(total[tops])])]
        while before[path[-1]] >= 0:
            path.append(int(before[path[-1]]))
        out.append(Stairs(below, columns.middles(nodes[path[::-1]])))
    return out


def _strides(
    columns: _Columns, nodes: Int[np.ndarray, " m"], z_m: Float[np.ndarray, " m"], steps: Int[np.ndarray, " s"]
) -> tuple[Int[np.ndarray, " e"], Int[np.ndarray, " e"], Float[np.ndarray, " e"]]:
    rise = int(_RISE_M / columns.cell_m[1] + 1e-6)
    pairs: list[Int[np.ndarray, "2 e"]] = []
    for i, j in product(range(-_GAP, _GAP + 1), repeat=2):
        if i or j:
            lowest: Int[np.ndarray, " s"] = nodes[steps] + (i * columns.span[1] + j) * columns.span[2] - rise
            at = np.minimum(np.searchsorted(nodes, lowest), len(nodes) - 1)
            hit = (nodes[at] >= lowest) & (nodes[at] <= lowest + 2 * rise)
            pairs.append(np.stack([steps[hit], at[hit]]))
    one, other = np.concatenate(pairs, axis=1)
    apart_m = columns.middles(nodes[one])[:, :2] - columns.middles(nodes[other])[:, :2]
    around = np.bincount(one, minlength=len(nodes)) / len(pairs)
    cost = np.hypot(np.hypot(apart_m[:, 0], apart_m[:, 1]), z_m[one] - z_m[other])
    return one, other, cost * (3.0 - 2.0 * around[one])  # the middle of a flight is cheaper than its edge
