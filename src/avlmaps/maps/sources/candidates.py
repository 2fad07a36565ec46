"""Where a sound may have come from: cells of the surfaces of a map, and of the air over its floor.

All places are in the level frame (z up).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.maps.sources.correlation import Correlations, SourceSettings, steer

CELL_M = 0.15
_LEG_M = 0.5  # what is hidden is looked up again after this path
_LOWEST_M, _HIGHEST_M = -1.1, 0.6  # of the air in a doorway, from the ear
_AIR_CELL_M = 0.3
_AIR_HEIGHTS_M = (0.4, 0.9, 1.4)
# Near the robot a cell is seen under a wide angle, and what sounds may be a thing that it passes: finer cells of air.
_NEAR_M = 0.9
_NEAR_HEIGHTS_M = (0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7)
_AIR_SHARE = 0.25  # prior probability that a sound comes from the air over the floor: somebody who has walked on
_FLOOR_BELOW_EAR_M = (0.3, 2.2)
_HIGHEST_OVER_EAR_M = 1.6


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Places that a sound may have come from."""

    place_m: Float32[np.ndarray, "c 3"]  # middles, level frame
    prior: Float[np.ndarray, " c"]  # probabilities that sum up to 1
    in_air: Bool[np.ndarray, " c"]  # whether nothing is there

    def __len__(self) -> int:
        return len(self.place_m)


def candidates_of(voxel_m: Float[np.ndarray, "n 3"], ear_m: Float[np.ndarray, "k 3"]) -> Candidates:
    """Return the candidates of a map: surfaces by cells of ``CELL_M``, and the air over the floor.

    Voxels and the ears, where the robot listened, are in the level frame; what is far above or below all ears is
    another storey's.
    """
    low, high = ear_m[:, 2].min() - _FLOOR_BELOW_EAR_M[1], ear_m[:, 2].max() + _HIGHEST_OVER_EAR_M
    here = voxel_m[(voxel_m[:, 2] > low) & (voxel_m[:, 2] < high)]
    if not len(here):
        return Candidates(np.zeros((0, 3), np.float32), np.zeros(0), np.zeros(0, bool))
    from scipy.spatial import KDTree

    surface = _means(here, np.floor(here / CELL_M).astype(np.int64))
    floor = here[here[:, 2] < ear_m[:, 2].min() - _FLOOR_BELOW_EAR_M[0]]
    air, weight = np.zeros((0, 3)), np.zeros(0)
    if len(floor):
        column, lowest = _columns(floor, ear_m)
        is_near = KDTree(ear_m[:, :2]).query(column)[0] < _NEAR_M
        wide = _free(_column_of(column[~is_near], lowest[~is_near], _AIR_HEIGHTS_M), here, _AIR_CELL_M)
        fine = np.concatenate([column[is_near] + CELL_M * np.array(at) for at in _QUARTERS])
        fine = _free(_column_of(fine, np.tile(lowest[is_near], len(_QUARTERS)), _NEAR_HEIGHTS_M), here, CELL_M)
        air = np.concatenate([wide, fine])
        one = len(_AIR_HEIGHTS_M) / (len(_QUARTERS) * len(_NEAR_HEIGHTS_M))  # a column has the same prior in all
        weight = np.append(np.ones(len(wide)), np.full(len(fine), one))
    share = _AIR_SHARE if len(air) else 0.0
    column = _keys(np.floor(surface[:, :2] / CELL_M).astype(np.int64))
    _, which, count = np.unique(column, return_inverse=True, return_counts=True)
    own = count[which] ** -0.5
    prior = np.concatenate([(1.0 - share) * own / own.sum(), share * weight / max(float(weight.sum()), 1e-12)])
    place = np.concatenate([surface, air]).astype(np.float32)
    return Candidates(place, prior, np.arange(len(place)) >= len(surface))


_AROUND = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij"), axis=-1).reshape(9, 2)
_QUARTERS = ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))


def _column_of(
    xy: Float[np.ndarray, "k 2"], lowest: Float[np.ndarray, " k"], heights_m: tuple[float, ...]
) -> Float[np.ndarray, "n 3"]:
    return np.concatenate([np.column_stack([xy, lowest + height]) for height in heights_m])


def _free(air: Float[np.ndarray, "n 3"], here: Float[np.ndarray, "k 3"], cell_m: float) -> Float[np.ndarray, "m 3"]:
    key = _keys(np.floor(np.concatenate([here, air]) / cell_m).astype(np.int64))
    return air[~np.isin(key[len(here) :], key[: len(here)])]


def _keys(cell: Int[np.ndarray, "n k"]) -> Int[np.ndarray, " n"]:
    low = cell.min(axis=0)
    return np.asarray(np.ravel_multi_index(tuple((cell - low).T), tuple(cell.max(axis=0) - low + 1)))


def _means(point: Float[np.ndarray, "n 3"], cell: Int[np.ndarray, "n 3"]) -> Float[np.ndarray, "c 3"]:
    _, which, count = np.unique(_keys(cell), return_inverse=True, return_counts=True)
    return np.stack([np.bincount(which, point[:, axis]) for axis in range(3)], axis=1) / count[:, None]


def _columns(
    floor: Float[np.ndarray, "n 3"], ear_m: Float[np.ndarray, "e 3"]
) -> tuple[Float[np.ndarray, "k 2"], Float[np.ndarray, " k"]]:
    cell = np.floor(floor[:, :2] / _AIR_CELL_M).astype(np.int64)
    _, first, which = np.unique(_keys(cell), return_index=True, return_inverse=True)
    column, lowest = cell[first], np.full(len(first), np.inf)
    np.minimum.at(lowest, which, floor[:, 2])
    level = float(np.quantile(lowest, 0.2))
    flat = np.abs(lowest - level) < 0.25
    passed = (np.floor(ear_m[:, None, :2] / _AIR_CELL_M).astype(np.int64) + _AROUND).reshape(-1, 2)
    known = np.concatenate([column[flat], passed])
    _, first = np.unique(_keys(known), return_index=True)
    height = np.append(lowest[flat], np.full(len(passed), level))
    return (known[first] + 0.5) * _AIR_CELL_M, height[first]


_CELL_M = 0.1
_BELOW_M, _ABOVE_M, _LAYER_M = 0.9, 0.6, 0.15  # of the ear
_FILLED = 0.7
_STEP_M = 0.08
_AT_CANDIDATE_M = 0.3  # a wall so near to a candidate is the surface that it lies on
_PASS_CELLS = 2  # of the plan in one of the path


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """The walls of a storey on a plan."""

    solid: Bool[np.ndarray, "nx ny"]  # cells of ``_CELL_M`` that are walls
    origin_m: Float[np.ndarray, "2"]  # lowest corner

    @classmethod
    def of(cls, voxel_m: Float[np.ndarray, "n 3"], ear_height_m: float) -> "Walls":
        """Return the walls between some way below an ear and some way above it."""
        bottom = ear_height_m - _BELOW_M
        layers = round((_BELOW_M + _ABOVE_M) / _LAYER_M)
        inside = (voxel_m[:, 2] >= bottom) & (voxel_m[:, 2] < bottom + layers * _LAYER_M)
        origin = voxel_m[:, :2].min(axis=0) - 2 * _CELL_M if len(voxel_m) else np.zeros(2)
        size = (np.ceil((voxel_m[:, :2].max(axis=0) - origin) / _CELL_M) + 3).astype(int) if len(voxel_m) else [1, 1]
        filled = np.zeros((int(size[0]), int(size[1]), layers), bool)
        cell = np.floor((voxel_m[inside, :2] - origin) / _CELL_M).astype(int)
        layer = np.clip(((voxel_m[inside, 2] - bottom) / _LAYER_M).astype(int), 0, layers - 1)
        filled[cell[:, 0], cell[:, 1], layer] = True
        return cls(filled.mean(axis=2) >= _FILLED, np.asarray(origin, np.float64))

    def behind(self, ear_xy: Float[np.ndarray, "2"], place_xy: Float[np.ndarray, "c 2"]) -> Bool[np.ndarray, " c"]:
        """Return which places have a wall between them and an ear."""
        away = np.linalg.norm(place_xy - ear_xy, axis=1)
        begin, along = (ear_xy - self.origin_m) / _CELL_M, (place_xy - ear_xy) / _CELL_M
        last, blocked = np.array(self.solid.shape) - 1, np.zeros(len(place_xy), bool)
        if not self.solid.any():
            return blocked
        for at_m in np.arange(0.2, float(away.max(initial=0.0)), _STEP_M):
            there = np.flatnonzero((away - _AT_CANDIDATE_M > at_m) & ~blocked)
            if not len(there):
                continue
            cell = (begin + along[there] * (at_m / away[there])[:, None]).astype(np.int64)
            column, row = np.minimum(np.maximum(cell, 0), last).T
            blocked[there] = self.solid[column, row]
        return blocked

    def seen_through(
        self, ear_xy: Float[np.ndarray, "2"], place_xy: Float[np.ndarray, "c 2"]
    ) -> tuple[Float[np.ndarray, "c 2"], Float[np.ndarray, " c"]]:
        """Return where the path from an ear to each place is last in sight, and how long the rest of it is.

        Of a place in sight that is the place itself, and no rest; NaN where no path leads there.
        """
        hidden = self.behind(ear_xy, place_xy)
        gate, rest_m = place_xy.astype(np.float64).copy(), np.zeros(len(place_xy))
        if hidden.any():
            gate[hidden], rest_m[hidden] = self._gates(ear_xy, place_xy[hidden])
        return gate, rest_m

    def _gates(
        self, ear_xy: Float[np.ndarray, "2"], place_xy: Float[np.ndarray, "c 2"]
    ) -> tuple[Float[np.ndarray, "c 2"], Float[np.ndarray, " c"]]:
        from scipy.sparse.csgraph import dijkstra

        free, step_m = self._coarse(), _CELL_M * _PASS_CELLS
        number = np.full(free.shape, -1)
        number[free] = np.arange(int(free.sum()))
        nodes = np.argwhere(free)
        middle = self.origin_m + (nodes + 0.5) * step_m
        if not len(nodes):
            return np.full(place_xy.shape, np.nan), np.zeros(len(place_xy))
        start = int(np.argmin(((middle - ear_xy) ** 2).sum(axis=1)))
        length, before = dijkstra(_graph(number, step_m), directed=False, indices=start, return_predecessors=True)
        seen = ~self.behind(ear_xy, middle) | (np.arange(len(nodes)) == start)
        gate = np.full(len(nodes), -1)
        for node in np.argsort(length, kind="stable").tolist():
            if seen[node]:
                gate[node] = node
            elif before[node] >= 0:
                gate[node] = gate[before[node]]
        from scipy.spatial import KDTree

        near = np.asarray(KDTree(middle).query(place_xy)[1])
        through = gate[near]
        known = (through >= 0) & np.isfinite(length[near])
        found = np.where(known[:, None], middle[through], np.nan)
        rest_m = np.zeros(len(near))
        rest_m[known] = length[near[known]] - length[through[known]]
        return found, rest_m

    def _coarse(self) -> Bool[np.ndarray, "mx my"]:
        nx, ny = (side // _PASS_CELLS for side in self.solid.shape)
        cut = self.solid[: nx * _PASS_CELLS, : ny * _PASS_CELLS]
        return np.logical_not(np.asarray(cut.reshape(nx, _PASS_CELLS, ny, _PASS_CELLS).any(axis=(1, 3))))


def _graph(number: Int[np.ndarray, "nx ny"], step_m: float) -> Any:
    from scipy.sparse import csr_matrix

    pairs: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        here = number[: number.shape[0] - dx, max(-dy, 0) : number.shape[1] - max(dy, 0)]
        there = number[dx:, max(dy, 0) : number.shape[1] - max(-dy, 0)]
        both = (here >= 0) & (there >= 0)
        pairs.append((here[both], there[both], np.full(int(both.sum()), step_m * np.hypot(dx, dy))))
    (one, other, length), size = (np.concatenate(column) for column in zip(*pairs, strict=True)), int(number.max()) + 1
    return csr_matrix((length, (one, other)), shape=(size, size))


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """The robot's path in pieces, with what it saw from each."""

    rows: list[np.ndarray]  # the frames of each piece
    gate: list[Float[np.ndarray, "c 2"]]  # of each piece, where the path to each candidate is last in sight
    rest_m: Float[np.ndarray, "l c"]  # length of the path from there; 0 of what is in sight
    away_m: Float[np.ndarray, "l c"]  # length of the whole path

    @classmethod
    def of(cls, ear: Float[np.ndarray, "k 3"], walls: Walls, place: Float[np.ndarray, "c 3"]) -> "Legs":
        """Cut a path into pieces and look round from each."""
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ear, axis=0), axis=1))])
        piece = (gone / _LEG_M).astype(int)
        rows = [np.flatnonzero(piece == number) for number in np.unique(piece)]
        middles = [ear[own].mean(axis=0) for own in rows]
        gates, rests = zip(*(walls.seen_through(m[:2], place[:, :2]) for m in middles), strict=True)
        known = [np.where(np.isfinite(gate), gate, place[:, :2]) for gate in gates]
        rest_m = np.stack([np.where(np.isfinite(g[:, 0]), r, 5.0) for g, r in zip(gates, rests, strict=True)])
        away = [np.linalg.norm(gate - m[:2], axis=1) for gate, m in zip(known, middles, strict=True)]
        return cls(rows, known, rest_m, np.stack(away) + rest_m)

    def expected(self, settings: SourceSettings) -> Float[np.ndarray, " c"]:
        """Return the log-likelihood of each candidate by where the robot was."""
        count = np.array([len(own) for own in self.rows], np.float64)
        hidden = (count[:, None] * (self.rest_m > 0.0)).sum(axis=0) / count.sum()
        return -settings.hidden * hidden - self.away_m.min(axis=0) / settings.reach_m

    def steered(
        self, found: Correlations, ear: Float[np.ndarray, "f m 3"], place: Float[np.ndarray, "c 3"], middle: int
    ) -> tuple[Float[np.ndarray, " c"], Float[np.ndarray, " c"]]:
        """Return the steered sums of the frames before the middle one, and of the others."""
        halves = [np.zeros(len(place)), np.zeros(len(place))]
        for own, gate, rest_m in zip(self.rows, self.gate, self.rest_m, strict=True):
            height = ear[own, :, 2].mean()
            seems = place.copy()
            seems[:, :2] = gate
            hidden = rest_m > 0.0
            seems[hidden, 2] = np.clip(seems[hidden, 2], height + _LOWEST_M, height + _HIGHEST_M)
            for half, rows in enumerate((own[own < middle], own[own >= middle])):
                if len(rows):
                    halves[half] += steer(found.take(rows), ear[rows], seems)
        return halves[0], halves[1]


RIGHT_M = 0.5
"""A goal so near to what it is for is right, level."""
_MARGIN = 5
_FAR_M = 1.0  # a place farther off than this is simply wrong
_BEST, _MOST = 64, 1500  # cells that may be the answer, and that it is compared with


@dataclass(frozen=True, eq=False)
class CandidateGrid:
    """The cells of ``CELL_M`` over and under the candidates, level frame."""

    low: Int[np.ndarray, "2"]  # number of the lowest cell
    shape: tuple[int, int]  # how many there are along x and y
    cell: Int[np.ndarray, " c"]  # flat cell of each candidate
    is_held: Bool[np.ndarray, "nx ny"]  # whether a candidate lies there

    @classmethod
    def of(cls, place_m: Float[np.ndarray, "c 3"]) -> "CandidateGrid":
        """Return the grid of candidates; there is at least one."""
        cell = np.floor(np.asarray(place_m, np.float64)[:, :2] / CELL_M).astype(np.int64)
        low = cell.min(axis=0) - _MARGIN
        size = cell.max(axis=0) - low + _MARGIN + 1
        shape = (int(size[0]), int(size[1]))
        flat = (cell[:, 0] - low[0]) * shape[1] + cell[:, 1] - low[1]
        return cls(low, shape, flat, np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape) > 0)

    def sums(self, share: Float[np.ndarray, " c"]) -> Float[np.ndarray, "nx ny"]:
        """Return the sum of the candidates' shares in each cell."""
        return np.bincount(self.cell, share, minlength=self.shape[0] * self.shape[1]).reshape(self.shape)

    def cell_of(self, xy_m: Float[np.ndarray, "n 2"]) -> Int[np.ndarray, " n"]:
        """Return the flat cell of places; those off the plan get the nearest of its rim."""
        cell = np.floor(xy_m / CELL_M).astype(np.int64) - self.low
        cell = np.clip(cell, 0, np.array(self.shape) - 1)
        return cell[:, 0] * self.shape[1] + cell[:, 1]

    def middle_m(self, flat: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        """Return the middles of cells."""
        return (np.stack(np.unravel_index(flat, self.shape), axis=1) + self.low + 0.5) * CELL_M


@dataclass(frozen=True, slots=True)
class Spread:
    """How well the place of a source is known: by circles, level, round its likeliest place."""

    right: float  # probability that the source lies within ``RIGHT_M``
    within_50_m: float  # radius that holds it with a probability of 0.5
    within_90_m: float  # of 0.9

    def around(self, place: str) -> str:
        """Return in words how near to a place the source lies."""
        return f"within {self.within_50_m:.2f} m of {place} with 50 %, within {self.within_90_m:.2f} m with 90 %"


@dataclass(frozen=True, eq=False)
class Density:
    """How likely a sound came from each cell of a plan."""

    plan: CandidateGrid
    share: Float[np.ndarray, "nx ny"]  # probabilities that sum up to 1

    @classmethod
    def of(
        cls,
        plan: CandidateGrid,
        prior: Float[np.ndarray, " c"],
        evidence: Float[np.ndarray, " c"],
        expected: Float[np.ndarray, " c"],
        settings: SourceSettings,
    ) -> "Density":
        """Return the density of a source.

        Of each candidate, ``evidence`` is the log-likelihood by sound and expectation together, ``expected`` that
        without the sound: near the robot, in sight.
        """
        from scipy.ndimage import gaussian_filter

        sharp = plan.sums(_shares(prior, evidence))
        near, far = (gaussian_filter(sharp, blur / CELL_M, mode="constant") for blur in settings.blur_m)
        spread = np.where(plan.is_held, (1.0 - settings.wide) * near + settings.wide * far, 0.0)
        spread /= max(float(spread.sum()), 1e-300)
        return cls(plan, (1.0 - settings.astray) * spread + settings.astray * plan.sums(_shares(prior, expected)))

    @cached_property
    def _order(self) -> Int[np.ndarray, " n"]:
        return np.argsort(-self.share.ravel(), kind="stable")

    def region(self, probability: float) -> Bool[np.ndarray, "nx ny"]:
        """Return the smallest set of cells that holds a probability."""
        total = np.cumsum(self.share.ravel()[self._order])
        count = min(int(np.searchsorted(total, probability)) + 1, len(total))
        inside = np.zeros(self.share.size, bool)
        inside[self._order[:count]] = True
        return inside.reshape(self.share.shape)

    def likelier_than(self, cell: int) -> float:
        """Return the probability of the cells that come before a flat cell: regions of more hold it."""
        before = int(np.flatnonzero(self._order == cell)[0])
        return float(self.share.ravel()[self._order[:before]].sum())

    def area_m2(self, probability: float) -> float:
        """Return the area of that region, m²."""
        return float(self.region(probability).sum()) * CELL_M**2

    @cached_property
    def position_m(self) -> Float[np.ndarray, "2"]:
        """The cell with the least expected distance from the source; anything beyond ``_FAR_M`` is wrong alike."""
        most = self._order[:_MOST]
        place, share = self.plan.middle_m(most), self.share.ravel()[most]
        away = np.linalg.norm(place[:_BEST, None] - place[None], axis=2)
        best = place[int(np.argmin((np.minimum(away, _FAR_M) * share).sum(axis=1)))]
        near = np.linalg.norm(place - best, axis=1) < 2.0 * CELL_M  # between the cells' middles
        return (place[near] * share[near, None]).sum(axis=0) / share[near].sum()

    @cached_property
    def _away_and_share(self) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        held = np.flatnonzero(self.share.ravel() > 0.0)
        return np.linalg.norm(self.plan.middle_m(held) - self.position_m, axis=1), self.share.ravel()[held]

    def within_m(self, probability: float) -> float:
        """Return the radius of the circle round the position that holds a probability, metres."""
        away, share = self._away_and_share
        order = np.argsort(away, kind="stable")
        total = np.cumsum(share[order])
        return float(away[order][min(int(np.searchsorted(total, probability)), len(order) - 1)])

    @cached_property
    def spread(self) -> Spread:
        """How far from ``position_m`` the source may be: circles round it that hold it with a probability.

        Of a cell on the edge of the circle of ``RIGHT_M`` the part inside counts.
        """
        away, share = self._away_and_share
        inside = np.clip((RIGHT_M - away) / CELL_M + 0.5, 0.0, 1.0)
        right = float((inside * share).sum())
        return Spread(min(right, 1.0), self.within_m(0.5), self.within_m(0.9))

    def of_candidates(
        self, prior: Float[np.ndarray, " c"], evidence: Float[np.ndarray, " c"]
    ) -> Float[np.ndarray, " c"]:
        """Return the probability of each candidate: that of its cell, shared out by the evidence for its height."""
        # An even part of the prior leaves a share in cells that only the spread of the density reaches.
        own = _shares(prior, evidence) + 1e-9 * prior
        return own * (self.share.ravel() / np.maximum(self.plan.sums(own).ravel(), 1e-300))[self.plan.cell]


def log_same_place(one: Density, other: Density, prior: Float[np.ndarray, " c"]) -> float:
    """Return the logarithm of how much likelier two sounds are of one place than of two (a Bayes factor)."""
    expected = one.plan.sums(prior)
    held = expected > 0.0
    return float(np.log(max(float((one.share[held] * other.share[held] / expected[held]).sum()), 1e-12)))


def _shares(prior: Float[np.ndarray, " c"], evidence: Float[np.ndarray, " c"]) -> Float[np.ndarray, " c"]:
    share = prior * np.exp(evidence - evidence.max(initial=-np.inf))
    return share / max(float(share.sum()), 1e-300)
