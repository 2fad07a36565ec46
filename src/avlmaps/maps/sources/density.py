"""From evidence to probabilities: where on the plan a sound came from, with regions that hold it as often as they say.

Evidence errs by more than its own noise: sources are inside things, surfaces are where the camera saw them, poses
stray. So the density is spread by two Gaussians, and a share of it is what is expected of an event without evidence.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.maps.sources.candidates import CELL_M
from avlmaps.maps.sources.correlation import SourceSettings

RIGHT_M = 0.5
"""A goal so near to what it is for is right, level."""
_MARGIN = 5
_FAR_M = 1.0  # a place farther off than this is simply wrong
_BEST, _MOST = 64, 1500  # cells that may be the answer, and that it is compared with


@dataclass(frozen=True, eq=False)
class CandidateGrid:
    """The cells of ``CELL_M`` over and under the candidates, level frame.

    Attributes:
        low: (2,) number of the lowest cell.
        shape: how many there are along x and y.
        cell: (c,) flat cell of each candidate.
        is_held: (nx, ny) whether a candidate lies there.
    """

    low: Int[np.ndarray, "2"]
    shape: tuple[int, int]
    cell: Int[np.ndarray, " c"]
    is_held: Bool[np.ndarray, "nx ny"]

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
    """How well the place of a source is known.

    Attributes:
        right: probability that the source lies within ``RIGHT_M`` of its likeliest place.
        within_50_m: radius round that place, level, which holds it with a probability of 0.5.
        within_90_m: of 0.9.
    """

    right: float
    within_50_m: float
    within_90_m: float

    def around(self, place: str) -> str:
        """Return in words how near to a place the source lies."""
        return f"within {self.within_50_m:.2f} m of {place} with 50 %, within {self.within_90_m:.2f} m with 90 %"


@dataclass(frozen=True, eq=False)
class Density:
    """How likely a sound came from each cell of a plan.

    Attributes:
        plan: the cells.
        share: (nx, ny) probabilities that sum up to 1.
    """

    plan: CandidateGrid
    share: Float[np.ndarray, "nx ny"]

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

        Args:
            plan: of the candidates.
            prior: of each candidate.
            evidence: log-likelihood of each, sound and expectation together.
            expected: log-likelihood without the sound: near the robot, in sight.
            settings: the errors.
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
        """How well the place is known; a cell that the circle of ``RIGHT_M`` cuts counts in part."""
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
