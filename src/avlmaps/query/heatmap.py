"""Heat over the occupied voxels: an array, numbers at any point, products and weighted sums, and their goals."""

import itertools
import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.core.errors import QueryError
from avlmaps.core.question import Part, Role
from avlmaps.query.factors import Factor, lead_of, product_of, times
from avlmaps.query.goals import MOST_GOALS, Goal, GoalEvidence, Shares, holds, share_voxels, weigh_goals
from avlmaps.query.settings import FOUND_AT
from avlmaps.query.voxel_space import Space

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_INSIDE = ("factors", "lead", "of", "only", "shown", "shown_at", "space", "terms", "weighed", "where")
_CONDITIONS = 5  # the first parts of a query, left out in turn: what more parts do to its likelihood is not bounded


class Heat(NDArrayOperatorsMixin, ABC):
    """A number for every voxel of a map: ``np.asarray(heat)`` is in the order of the map's ``points``."""

    space: Space
    __hash__ = object.__hash__  # pyright: ignore[reportAssignmentType] - by identity: ``==`` compares the numbers

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
        """Return the heat at points (..., 3), metres, recording frame. ``QueryError``: they are no points."""
        points = np.asarray(points_world)
        if points.dtype.kind not in "fiu" or points.ndim == 0 or points.shape[-1] != 3 or not np.isfinite(points).all():
            said = f"{points.dtype} of {points.shape}"
            raise QueryError(f"Points are finite x, y, z in metres, an array of shape (..., 3); this is {said}.")
        return self._at(points.reshape(-1, 3).astype(np.float64)).reshape(points.shape[:-1])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """Return the heat as an array."""
        return np.array(self.values, dtype, copy=True if copy is None else copy)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **of_numpy: Any) -> Any:
        """Compute a function of NumPy on the numbers; times one of NumPy's numbers it is a heat."""
        if ufunc is np.multiply and method == "__call__" and isinstance(inputs[0], Real) and not of_numpy:
            return self * inputs[0]
        if any(isinstance(one, Heat) for one in of_numpy.get("out", ())):
            return NotImplemented  # a heat does not change
        return getattr(ufunc, method)(*(one.values if isinstance(one, Heat) else one for one in inputs), **of_numpy)

    def __len__(self) -> int:
        return len(self.space)

    def __getitem__(self, key: Any) -> Any:
        return self.values[key]

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("_") and name not in _INSIDE]

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
        """Return the number of the hottest voxel. ``QueryError``: the map is empty."""
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
        return super().__mul__(other)

    def __rmul__(self, other: object) -> Any:
        return self.__mul__(other)

    def __truediv__(self, other: object) -> Any:
        return self.__mul__(1.0 / float(other)) if isinstance(other, Real) else super().__truediv__(other)

    def __add__(self, other: object) -> Any:
        if isinstance(other, Heat):
            self._require_same(other, "added")
            return Blend(self.space, (*self._terms, *other._terms))
        if isinstance(other, Real) and other == 0:  # of sum([...])
            return self
        return super().__add__(other)

    __radd__ = __add__

    def __sub__(self, other: object) -> Any:
        return self + -1.0 * other if isinstance(other, Heat) else super().__sub__(other)

    def _anew(self, other: object) -> Any:
        return NotImplemented  # ``heat *= 2`` names another heat

    __iadd__ = __isub__ = __imul__ = __itruediv__ = __ifloordiv__ = __imod__ = __ipow__ = _anew

    def __neg__(self) -> "Blend":
        return -1.0 * self

    def _require_same(self, other: "Heat", how: str) -> None:
        if self.space is not other.space:
            raise ValueError(f"two heatmaps of different maps cannot be {how}; ask both of the same AVLMap")


@dataclass(frozen=True, eq=False, repr=False)
class Blend(Heat):
    """A weighted sum of heatmaps: ``0.7 * m.object("chair") + 0.3 * m.sound("dog bark")``."""

    space: Space
    terms: "tuple[tuple[float, Heat], ...]"  # the weights and the heatmaps

    @property
    def _terms(self) -> "tuple[tuple[float, Heat], ...]":
        return self.terms

    @cached_property
    def values(self) -> Float32[np.ndarray, " n"]:  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
        """The sum at every voxel, computed when it is first used."""
        total = np.zeros(len(self.space))
        for weight, heat in self.terms:
            total += weight * heat.values
        return total.astype(np.float32)

    def _at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        return sum((weight * heat.at(points_world) for weight, heat in self.terms), np.zeros(len(points_world)))

    @property
    def name(self) -> str:
        """What was queried: ``0.7 * chair + 0.3 * dog bark``."""
        return " + ".join(f"{weight:g} * {heat.name}" for weight, heat in self.terms)


_Where = Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, " n"] | Bool[np.ndarray, " n"]]


@dataclass(frozen=True, eq=False, repr=False)
class Heatmap(Heat):
    """Heat in [0, 1] of every occupied voxel; ``a * b`` fuses two, ``0.7 * a + 0.3 * b`` weighs them."""

    space: Space  # the map's voxels
    factors: tuple[Factor, ...]  # the parts of the query, one factor each
    found_at: float = FOUND_AT  # from this probability of the first goal on the query is found
    # Says of places (n, 3), metres, world, how likely each may be a goal, at most: 0 for those that may not. None: all.
    where: "_Where | None" = None

    @classmethod
    def of(cls, factor: Factor, found_at: float = FOUND_AT) -> "Heatmap":
        """Return the heatmap of one thing."""
        return cls(factor.space, (factor,), found_at)

    @cached_property
    def values(self) -> Float32[np.ndarray, " n"]:  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
        """The product of the factors' heat, computed when it is first used."""
        return times(self._of_things, [factor for factor in self.factors if holds(factor, self.lead)])

    @cached_property
    def _of_things(self) -> Float32[np.ndarray, " n"]:
        return product_of([factor for factor in self.factors if not holds(factor, self.lead)])

    @overload
    def __mul__(self, other: "Heatmap") -> "Heatmap": ...
    @overload
    def __mul__(self, other: object) -> Any: ...
    def __mul__(self, other: object) -> Any:
        if not isinstance(other, Heatmap):
            return Heat.__mul__(self, other)
        self._require_same(other, "multiplied")
        one, two = self._in_company(), other._in_company()
        where = self.where if other.where is None else other.only(self.where).where
        return Heatmap(self.space, one.factors + two.factors, max(self.found_at, other.found_at), where)

    def only(self, where: "_Where | None") -> "Heatmap":
        """Return the heatmap whose goals lie only where a function says so; that of before counts as well."""
        before = self.where
        if where is None or before is None:
            return replace(self, where=where or before)

        def both(places: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
            return np.minimum(before(places), where(places), dtype=np.float64)

        return replace(self, where=both)

    def include_uncertain(self) -> "Heatmap":
        """Return the heatmap that includes instances of low confidence: for a caller that must guess."""
        uncertain = [Heatmap.of(factor.include_uncertain(), self.found_at) for factor in self.factors]
        return product(uncertain).only(self.where)

    def _in_company(self) -> "Heatmap":
        return Heatmap.of(self.factors[0].for_product(), self.found_at) if len(self.factors) == 1 else self

    @property
    def _terms(self) -> "tuple[tuple[float, Heat], ...]":
        return ((1.0, self),)

    def _at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        heat = np.ones(len(points_world))
        for factor in self.factors:
            heat *= factor.at(points_world)
        return heat

    @property
    def name(self) -> str:
        """What was queried: ``chair * dog bark``."""
        return " * ".join(factor.part.query for factor in self.factors)

    def _repr_png_(self) -> bytes:
        from avlmaps.query.plots import png_of

        return png_of(self.plot())

    @property
    def peak(self) -> float:
        """The highest heat; 0 for an empty map."""
        return float(self.values.max(initial=0.0))

    @property
    def shown(self) -> Float32[np.ndarray, " n"]:
        """The heat that pictures show: times the confidence that the lead's instance there is what was queried."""
        return self.lead.weighted(self.values)

    def shown_at(self, voxels: Int[np.ndarray, " m"]) -> Float32[np.ndarray, " m"]:
        """Return ``shown`` of some voxels, in their order; heat that is not known yet is computed for these alone."""
        if "values" in vars(self) or len(self.factors) > 1:
            return self.shown[voxels]
        among = np.zeros(len(self.space), np.bool_)
        among[voxels] = True
        heat, anchor = self.lead.heat_and_anchors(among)
        heat, anchor = heat[voxels], anchor[voxels]
        hot = heat > 0.0
        heat[hot] *= self.lead.confidence[self.lead.instance[anchor[hot]]]
        return heat

    @property
    def lead(self) -> Factor:
        """The factor whose instances are the goals."""
        return lead_of(self.factors)

    @cached_property
    def _shares(self) -> Shares:
        return share_voxels(self.factors, lambda: self._of_things)

    @cached_property
    def probability(self) -> float:
        """How likely the first goal is right, all parts of the query together; 0 where there is none."""
        return next((goal.probability for goal in self.goals(1)), 0.0)

    @property
    def found(self) -> bool:
        """Whether the first goal is likely enough to be right; where there is none, nothing is found at any limit."""
        return self.probability >= self.found_at and self.probability > 0.0

    @cached_property
    def _most(self) -> float:
        # No answer is likelier than that to fewer of its conditions: near and in what it lies, and its colour.
        asked = (self.lead, *(factor for factor in self.factors if factor is not self.lead))[:_CONDITIONS]
        ways = [[one, *([one.plain().for_product()] if one.plain else [])] for one in asked]
        parts = itertools.product(ways[0], *([*each, None] for each in ways[1:]))
        fewer = [kept for part in parts if len(kept := tuple(filter(None, part))) > 1 and kept != asked]
        firsts = [weigh_goals(kept, Heatmap(self.space, kept)._shares, 1) for kept in fewer]
        return min((goal.probability for first in firsts for goal, _ in first), default=1.0)

    def goals(self, top: int = 3) -> list[Goal]:
        """Return the best distinct places, best first; none where there is no heat."""
        return [goal for goal, _ in self.weighed(top)]

    def weighed(self, top: int = 3) -> list[tuple[Goal, GoalEvidence]]:
        """Return the goals, each with the evidence that its probability rests on."""
        if self.where is None:
            return weigh_goals(self.factors, self._shares, top, self._most)
        return self._where_it_may[:top]

    @cached_property
    def _where_it_may(self) -> list[tuple[Goal, GoalEvidence]]:
        assert self.where is not None
        every = weigh_goals(self.factors, self._shares, MOST_GOALS, self._most)
        most = self.where(np.array([goal.position for goal, _ in every]).reshape(-1, 3))
        return [
            (replace(goal, probability=round(min(goal.probability, float(sure)), 3)), evidence)
            for (goal, evidence), sure in zip(every, most.tolist(), strict=True)
            if sure
        ]

    @overload
    def plot(self, path: str | Path, *, top: int = 3) -> Path: ...
    @overload
    def plot(self, path: None = None, *, top: int = 3, ax: "Axes | None" = None) -> "Figure": ...
    def plot(self, path: str | Path | None = None, *, top: int = 3, ax: "Axes | None" = None) -> "Path | Figure":
        """Draw the map from above, each factor's heat and the product, with the goals numbered, and return the figure.

        With a path the picture is written there, and the path returned. ``QueryError``: it cannot be.
        """
        from avlmaps.query.plots import draw_heat, draw_heat_into, save

        if ax is not None:
            draw_heat_into(ax, self.space, self.shown, self.goals(top))
            figure = ax.get_figure(root=True)
            assert figure is not None  # axes that are drawn into have one
            return figure
        figure = draw_heat(self.factors, self.shown, self.found, self.goals(top))
        return figure if path is None else save(figure, path)


def product(heatmaps: Sequence[Heatmap]) -> Heatmap:
    """Return the product of one or more heatmaps."""
    product = heatmaps[0]
    for heat in heatmaps[1:]:
        product = product * heat
    return product


_BYTES_PER_VOXEL, _BYTES = 12, 4096  # of a factor that was used: heat, mask or winner, and its twin with unsure things


class HeatCache:
    """Remembers heat up to a size; what was queried longest ago goes first. Threads may use it."""

    def __init__(self, most_bytes: int, watch: Callable[[Part], object] = lambda part: None) -> None:
        # ``watch`` is given each part before its heat is looked up.
        self._most_bytes, self._watch = most_bytes, watch
        self._held: OrderedDict[Part, tuple[Heatmap, int]] = OrderedDict()
        self._held_bytes = 0
        self._lock = threading.Lock()

    def anew(self) -> "HeatCache":
        """Return an empty cache of this size."""
        return HeatCache(self._most_bytes, self._watch)

    def heat(self, part: Part, find: Callable[[], Heatmap]) -> Heatmap:
        """Return the heat of a part; that of a file, whose name says nothing, is found each time."""
        self._watch(part)
        if part.is_file:
            return find()
        with self._lock:
            held = self._held.get(part)
            if held is not None:
                self._held.move_to_end(part)
        if held is not None:
            if part.role is Role.CONTEXT:  # queried again: its heat everywhere serves every further query
                _ = held[0].values
            return held[0]
        heat = find()
        self._hold(part, heat)
        return heat

    def _hold(self, part: Part, heat: Heatmap) -> None:
        size = sum(len(heat.space) * _BYTES_PER_VOXEL + _BYTES for _ in heat.factors)
        with self._lock:
            if part in self._held or size > self._most_bytes:
                return
            self._held[part] = heat, size
            self._held_bytes += size
            while self._held_bytes > self._most_bytes:
                self._held_bytes -= self._held.popitem(last=False)[1][1]
