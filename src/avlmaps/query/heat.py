"""Heat as a program uses it: an array over the voxels, numbers at any point, and weighted sums."""

from abc import ABC, abstractmethod
from numbers import Real
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32
from avlmaps.core.errors import QueryError
from avlmaps.query.voxel_space import Space


class Heat(ABC):
    """A number for every voxel of a map: ``np.asarray(heat)`` is in the order of the map's ``points``."""

    space: Space
    __array_priority__ = 100.0  # NumPy's numbers leave products to this class

    @property
    @abstractmethod
    def values(self) -> Float32[np.ndarray, " n"]:
        """The heat of every voxel."""

    @abstractmethod
    def _at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]: ...

    @property
    @abstractmethod
    def name(self) -> str:
        """What was queried."""

    @property
    @abstractmethod
    def _terms(self) -> "tuple[tuple[float, Heat], ...]": ...

    def at(self, points_world: Any) -> Float[np.ndarray, "*m"]:
        """Return the heat at any points.

        Args:
            points_world: one point, or an array (..., 3) of them; metres, recording frame.

        Raises:
            QueryError: they are no points.
        """
        points = np.asarray(points_world)
        if points.dtype.kind not in "fiu" or points.ndim == 0 or points.shape[-1] != 3 or not np.isfinite(points).all():
            said = f"{points.dtype} of {points.shape}"
            raise QueryError(f"Points are finite x, y, z in metres, an array of shape (..., 3); this is {said}.")
        return self._at(points.reshape(-1, 3).astype(np.float64)).reshape(points.shape[:-1])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """Return the heat as an array."""
        return np.array(self.values, dtype, copy=True if copy is None else copy)

    def __len__(self) -> int:
        return len(self.space)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, {len(self):,} voxels)"

    def max(self, **of_numpy: Any) -> float:
        """Return the highest heat; 0 for an empty map. ``np.max(heat)`` calls it, with keywords of its own."""
        del of_numpy
        return float(self.values.max()) if len(self) else 0.0

    def min(self, **of_numpy: Any) -> float:
        """Return the lowest heat; 0 for an empty map."""
        del of_numpy
        return float(self.values.min()) if len(self) else 0.0

    def argmax(self) -> int:
        """Return the number of the hottest voxel.

        Raises:
            QueryError: the map is empty.
        """
        if not len(self):
            raise QueryError("The map holds no voxels, so that none is the hottest.")
        return int(self.values.argmax())

    def __mul__(self, other: object) -> Any:
        if isinstance(other, Real):
            return Blend(self.space, tuple((float(other) * weight, heat) for weight, heat in self._terms))
        if isinstance(other, Heat):
            self._require_same(other, "multiplied")
            pairs = [(a * b, one * two) for a, one in self._terms for b, two in other._terms]
            return Blend(self.space, tuple(pairs))
        return self.values * other if isinstance(other, np.ndarray) else NotImplemented

    def __rmul__(self, other: object) -> Any:
        return self.__mul__(other)

    def __truediv__(self, other: object) -> Any:
        return self.__mul__(1.0 / float(other)) if isinstance(other, Real) else NotImplemented

    def __add__(self, other: object) -> Any:
        if isinstance(other, Heat):
            self._require_same(other, "added")
            return Blend(self.space, (*self._terms, *other._terms))
        if isinstance(other, Real) and other == 0:  # of sum([...])
            return self
        return self.values + other if isinstance(other, Real | np.ndarray) else NotImplemented

    __radd__ = __add__

    def __sub__(self, other: object) -> Any:
        if isinstance(other, Real | np.ndarray):
            return self.values - other
        return self + -1.0 * other if isinstance(other, Heat) else NotImplemented

    def __rsub__(self, other: object) -> Any:
        return np.asarray(other) - self.values if isinstance(other, Real | np.ndarray) else NotImplemented

    def __neg__(self) -> "Blend":
        return -1.0 * self

    def __gt__(self, other: Any) -> Bool[np.ndarray, " n"]:
        return self.values > np.asarray(other)

    def __ge__(self, other: Any) -> Bool[np.ndarray, " n"]:
        return self.values >= np.asarray(other)

    def __lt__(self, other: Any) -> Bool[np.ndarray, " n"]:
        return self.values < np.asarray(other)

    def __le__(self, other: Any) -> Bool[np.ndarray, " n"]:
        return self.values <= np.asarray(other)

    def _require_same(self, other: "Heat", how: str) -> None:
        if self.space is not other.space:
            raise ValueError(f"two heatmaps of different maps cannot be {how}; ask both of the same AVLMap")


class Blend(Heat):
    """A weighted sum of heatmaps: ``0.7 * m.object("chair") + 0.3 * m.sound("dog bark")``.

    Attributes:
        space: the map's voxels.
        terms: the weights and the heatmaps.
    """

    def __init__(self, space: Space, terms: "tuple[tuple[float, Heat], ...]") -> None:
        self.space = space
        self.terms = terms
        self._values: Float32[np.ndarray, " n"] | None = None

    @property
    def _terms(self) -> "tuple[tuple[float, Heat], ...]":
        return self.terms

    @property
    def values(self) -> Float32[np.ndarray, " n"]:
        """The sum at every voxel, computed when it is first used."""
        if self._values is None:
            total = np.zeros(len(self.space))
            for weight, heat in self.terms:
                total += weight * heat.values
            self._values = total.astype(np.float32)
        return self._values

    def _at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        return sum((weight * heat.at(points_world) for weight, heat in self.terms), np.zeros(len(points_world)))

    @property
    def name(self) -> str:
        """What was queried: ``0.7 * chair + 0.3 * dog bark``."""
        return " + ".join(f"{weight:g} * {heat.name}" for weight, heat in self.terms)
