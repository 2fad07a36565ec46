"""The product of the heat of everything that was queried, over the occupied voxels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.query.evidence import GoalEvidence
from avlmaps.query.factors import FOUND_AT, Factor, lead_of, product_of, times
from avlmaps.query.goals import Goal, Shares, share_voxels, weigh_goals
from avlmaps.query.heat import Heat
from avlmaps.query.voxel_space import Space

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_Where = Callable[[Float[np.ndarray, "n 3"]], Bool[np.ndarray, " n"]]
_MOST_GOALS = 200  # that are looked through for those that lie where they may


@dataclass(frozen=True, eq=False, repr=False)
class Heatmap(Heat):
    """Heat in [0, 1] of every occupied voxel; ``a * b`` fuses two, ``0.7 * a + 0.3 * b`` weighs them.

    ``np.asarray(heat)`` is in the order of the map's ``points``; ``heat.at(points)`` is the heat anywhere.

    Attributes:
        space: the map's voxels.
        factors: the parts of the query, one factor each.
        found_at: from this probability of the first goal on the query is found.
        where: says of places (n, 3), metres, world, which may be goals; None: all.
    """

    space: Space
    factors: tuple[Factor, ...]
    found_at: float = FOUND_AT
    where: "_Where | None" = None

    @classmethod
    def of(cls, factor: Factor, found_at: float = FOUND_AT) -> "Heatmap":
        """Return the heatmap of one thing."""
        return cls(factor.space, (factor,), found_at)

    @cached_property
    def values(self) -> Float32[np.ndarray, " n"]:  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
        """The product of the factors' heat, computed when it is first used."""
        return times(self._of_things, [factor for factor in self.factors if _is_region(factor, self.lead)])

    @cached_property
    def _of_things(self) -> Float32[np.ndarray, " n"]:
        return product_of([factor for factor in self.factors if not _is_region(factor, self.lead)])

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

        def both(places: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
            return before(places) & where(places)

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
        return share_voxels(self.factors, lambda: self.values, lambda: self._of_things)

    @cached_property
    def probability(self) -> float:
        """How likely the first goal is right, all parts of the query together; 0 where there is none."""
        return next((goal.probability for goal in self.goals(1)), 0.0)

    @property
    def found(self) -> bool:
        """Whether the first goal is likely enough to be right; where there is none, nothing is found at any limit."""
        return self.probability >= self.found_at and self.probability > 0.0

    def goals(self, top: int = 3) -> list[Goal]:
        """Return the best distinct places, best first; fewer where there are fewer, none where there is no heat."""
        return [goal for goal, _ in self.weighed(top)]

    def weighed(self, top: int = 3) -> list[tuple[Goal, GoalEvidence]]:
        """Return the goals, each with the evidence that its probability rests on."""
        if self.where is None:
            return weigh_goals(self.factors, self._shares, top)
        every = weigh_goals(self.factors, self._shares, _MOST_GOALS)
        fits = self.where(np.array([goal.position for goal, _ in every]).reshape(-1, 3))
        return [one for one, fit in zip(every, fits.tolist(), strict=True) if fit][:top]

    @overload
    def plot(self, path: str | Path, *, top: int = 3) -> Path: ...
    @overload
    def plot(self, path: None = None, *, top: int = 3, ax: "Axes | None" = None) -> "Figure": ...
    def plot(self, path: str | Path | None = None, *, top: int = 3, ax: "Axes | None" = None) -> "Path | Figure":
        """Draw the map from above, each factor's heat and the product, with the goals numbered.

        Args:
            path: the picture to write; without one, the figure is returned, for a notebook to show.
            top: how many goals are numbered.
            ax: draw the product alone into these axes.

        Raises:
            QueryError: the picture cannot be written there.
        """
        from avlmaps.query.plots import draw_heat, draw_heat_into, save

        if ax is not None:
            draw_heat_into(ax, self.space, self.shown, self.goals(top))
            figure = ax.get_figure(root=True)
            assert figure is not None  # axes that are drawn into have one
            return figure
        figure = draw_heat(self.factors, self.shown, self.found, self.goals(top))
        return figure if path is None else save(figure, path)


def _is_region(factor: Factor, lead: Factor) -> bool:
    return factor.regional and factor is not lead


def product(heatmaps: Sequence[Heatmap]) -> Heatmap:
    """Return the product of one or more heatmaps."""
    product = heatmaps[0]
    for heat in heatmaps[1:]:
        product = product * heat
    return product
