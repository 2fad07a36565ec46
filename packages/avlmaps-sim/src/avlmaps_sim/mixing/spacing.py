"""Where along a walk sounds may play: not close to one another in time, nor in place."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from scipy.spatial import KDTree

_GRID_S = 0.1
_STRIDE_M = 0.1  # a camera that is held still trembles; only a move by this distance counts as walking

Measure = Literal["straight", "walked"]


@dataclass(frozen=True, slots=True)
class Walk:
    """A robot's path on a fine time grid."""

    stamps_s: Float[np.ndarray, " n"]  # the grid, seconds
    position: Float[np.ndarray, "n 3"]  # where the robot was, metres, world
    walked_m: Float[np.ndarray, " n"]  # how far it had walked by then, trembling left out

    @classmethod
    def along(cls, stamps_s: Float[np.ndarray, " f"], position: Float[np.ndarray, "f 3"]) -> "Walk":
        """Interpolate a walk, known at some stamps, every tenth of a second."""
        grid = np.arange(stamps_s[0], stamps_s[-1] + 1e-9, _GRID_S)
        fine = np.stack([np.interp(grid, stamps_s, position[:, axis]) for axis in range(3)], axis=1)
        return cls(grid, fine, _walked(fine))

    def index(self, stamp_s: float) -> int:
        """Return the grid point nearest to a time."""
        return int(np.clip(round((stamp_s - self.stamps_s[0]) / _GRID_S), 0, len(self.stamps_s) - 1))


@dataclass(frozen=True, slots=True)
class Spacing:
    """The rule for sounds on a walk."""

    pause_s: float  # least silence between two sounds
    distance_m: float  # least distance between two sounds
    # ``straight``: in a straight line between any two places where the robot was while they sounded, the paper's rule;
    # ``walked``: along the walk, between the places where each was half over.
    measure: Measure = "straight"


@dataclass(slots=True)
class Placer:
    """Puts sounds of given lengths on a walk, each as early as the rule allows."""

    walk: Walk
    spacing: Spacing
    onsets_s: list[float] = field(default_factory=list)
    lengths_s: list[float] = field(default_factory=list)
    _tree: "KDTree | None" = field(default=None, init=False)
    _in_tree: int = field(default=0, init=False)

    def place(self, length_s: float) -> float | None:
        """Put a sound of this length after the last one, and return its onset; None where there is no room left."""
        stamps_s = self.walk.stamps_s
        earliest = self.onsets_s[-1] + self.lengths_s[-1] + self.spacing.pause_s if self.onsets_s else stamps_s[0]
        for onset_s in stamps_s[np.searchsorted(stamps_s, earliest - 1e-9) :]:
            if onset_s + length_s > stamps_s[-1] + 1e-9:
                return None
            if self._far_enough(float(onset_s), length_s):
                self.onsets_s.append(float(onset_s))
                self.lengths_s.append(length_s)
                return float(onset_s)
        return None

    def _far_enough(self, onset_s: float, length_s: float) -> bool:
        distance_m = self.spacing.distance_m
        if distance_m <= 0.0 or not self.onsets_s:
            return True
        walk = self.walk
        if self.spacing.measure == "walked":  # how far it had walked never falls, so the last sound is the nearest
            here, there = onset_s + length_s / 2.0, self.onsets_s[-1] + self.lengths_s[-1] / 2.0
            return bool(walk.walked_m[walk.index(here)] - walk.walked_m[walk.index(there)] >= distance_m)
        own = walk.position[walk.index(onset_s) : walk.index(onset_s + length_s) + 1]
        nearest_m, _ = self._places().query(own, distance_upper_bound=distance_m)
        return bool(np.isinf(nearest_m).all())

    def _places(self) -> "KDTree":
        from scipy.spatial import KDTree

        if self._tree is None or self._in_tree != len(self.onsets_s):
            walk, spans = self.walk, zip(self.onsets_s, self.lengths_s, strict=True)
            heard = [walk.position[walk.index(at) : walk.index(at + length) + 1] for at, length in spans]
            self._tree, self._in_tree = KDTree(np.concatenate(heard)), len(heard)
        tree = self._tree
        assert tree is not None
        return tree


def capacity(walk: Walk, spacing: Spacing, length_s: float, enough: int) -> int:
    """Return how many sounds of one length fit, counting no further than ``enough``."""
    placer = Placer(walk, spacing)
    while len(placer.onsets_s) < enough and placer.place(length_s) is not None:
        pass
    return len(placer.onsets_s)


def chosen_spacing(walk: Walk, spacing: Spacing, length_s: float, wanted: int = 3) -> Spacing:
    """Return the paper's rule, or, where it leaves room for fewer sounds than wanted, the rule along the walk.

    A room that is hardly larger than the distance has room for one sound by the paper's rule, however long the
    walk in it.
    """
    if spacing.distance_m <= 0.0 or capacity(walk, spacing, length_s, wanted) >= wanted:
        return spacing
    along = replace(spacing, measure="walked")
    return along if capacity(walk, along, length_s, wanted) > capacity(walk, spacing, length_s, wanted) else spacing


def _walked(position: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    marks, lengths = [0], [0.0]
    for i, place in enumerate(position):
        stride_m = float(np.linalg.norm(place - position[marks[-1]]))
        if stride_m >= _STRIDE_M:
            marks.append(i)
            lengths.append(lengths[-1] + stride_m)
    return np.interp(np.arange(len(position)), marks, lengths)
