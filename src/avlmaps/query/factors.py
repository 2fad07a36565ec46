"""The heat of one thing that was queried, at every occupied voxel: the paper's equations, evaluated exactly.

``NearThings`` (objects) falls with the 3D distance to the nearest voxel, ``NearAnchors`` (images, areas,
sounds) with the horizontal distance from scored places.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.core.question import Part, Role
from avlmaps.query.voxel_space import Space, middle_of
from avlmaps.query.words import share

if TYPE_CHECKING:
    from avlmaps.maps.sources.candidates import Spread

# Scores are products of float32 vectors; their last digits depend on the order of summation, hence on the processor.
ROUNDING = 1e-6
# The distances of this many pairs of points are computed one by one, which is faster than a search tree.
_FEW_PAIRS = 65_536
# Pairs of a point and an anchor that are compared at once: some megabytes.
_PAIRS = 1 << 18

UNDERSTOOD_ONLY = "understood only"
"""Begins the note on a name of which a word is not understood: each of several that are found may be meant."""


class Factor(ABC):
    """The heat of one part of the query."""

    space: Space  # the map's voxels
    part: Part  # the part of the query
    falloff_per_m: float  # ε
    anchors: Float[np.ndarray, "a 3"]  # (a, 3) places that the heat falls from, metres, world
    instance: Int[np.ndarray, " a"]  # (a,) number of the distinct thing that each anchor belongs to
    # (instances,) in [0, 1]: the probability that each matches the part; 0.5 and more is yes.
    confidence: Float[np.ndarray, " i"]
    found: bool  # whether the map holds the part
    understood: str  # what the encoder could act on
    note: str  # one sentence on why it was not found, or ``""``
    middles: Float[np.ndarray, "i 3"]  # (instances, 3) of each instance its middle, where lists put it
    flat: bool  # whether the heat is the same at every height
    # Whether the heat says in which region a place lies, not how near it is; ``held`` says it of things.
    regional: bool = False
    is_named: bool = True  # whether what was said of it is understood; False where only a colour is ("red elephant")
    plain: "Callable[[], Factor] | None" = None  # without its colour; None where it has none
    # The heat and the anchors of all voxels, once they were computed.
    _of_all: tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]] | None = None

    @abstractmethod
    def heat_and_anchors(
        self, among: Bool[np.ndarray, " n"] | None = None
    ) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return heat in [0, 1] of every voxel, or of some and 0 for others, and the anchor that each has it from."""

    def _all_heat_and_anchors(self) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        if self._of_all is None:
            object.__setattr__(self, "_of_all", self.heat_and_anchors())  # the value is frozen; this adds nothing to it
        assert self._of_all is not None
        return self._of_all

    @property
    def values(self) -> Float32[np.ndarray, " n"]:
        """Heat in [0, 1] of every voxel, computed when it is first used."""
        return self._all_heat_and_anchors()[0]

    def anchor_of(self, voxels: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        """Return the anchor that each of these voxels has its heat from; they must have some."""
        return self._all_heat_and_anchors()[1][voxels]

    def among(self, voxels: Bool[np.ndarray, " n"]) -> Float32[np.ndarray, " n"]:
        """Return the heat of some voxels, 0 for others: what a product needs where another factor leaves little."""
        if self._of_all is not None:
            return np.where(voxels, self.values, np.float32(0.0))
        return self.heat_and_anchors(voxels)[0]

    @abstractmethod
    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        """Return the heat at any points."""

    def held(self, lead: "Factor") -> Float[np.ndarray, " i"]:
        """Return how far each instance of a lead lies in this region, in [0, 1]: the mean over its voxels."""
        heat, count = self.at(lead.anchors), len(lead.confidence)
        own = np.maximum(np.bincount(lead.instance, minlength=count), 1)
        return np.bincount(lead.instance, heat, minlength=count) / own

    def spread_of(self, instance: int) -> "Spread | None":
        """Return how well the place of an instance is known; None where it is known as well as any."""
        del instance
        return None

    def cones(self) -> "Factor":
        """Return the heat that falls off round the anchors, of what may have another extent."""
        return self

    def for_product(self) -> "Factor":
        """Return this factor as it counts in a product: what is sought with its unsure instances."""
        return self.include_uncertain() if self.part.role is Role.PRIMARY else self

    def include_uncertain(self) -> "Factor":
        """Return this factor with all that may be meant, however unsure."""
        return self

    @cached_property
    def shown(self) -> Float32[np.ndarray, " n"]:
        """Heat times the confidence of the instance that it comes from, in [0, 1]: what pictures show."""
        return self.weighted(self.values)

    def weighted(self, heat: Float32[np.ndarray, " n"]) -> Float32[np.ndarray, " n"]:
        """Return heat times the confidence of the instance of this factor that each voxel belongs to."""
        shown = np.zeros_like(heat)
        hot = np.flatnonzero((heat > 0.0) & (self.values > 0.0))
        if len(hot):
            shown[hot] = heat[hot] * self.confidence[self.instance[self.anchor_of(hot)]]
        return shown


@dataclass(frozen=True, eq=False)
class NearThings(Factor):
    """Heat of an object: max(1 − ε·d, 0), d the 3D distance to the nearest of its voxels."""

    space: Space
    part: Part
    falloff_per_m: float
    mask: Bool[np.ndarray, " n"]  # which voxels are the object; the anchors are their middles, in the same order
    instance: Int[np.ndarray, " a"]
    confidence: Float[np.ndarray, " i"]
    found: bool
    understood: str = ""
    note: str = ""
    # Adds the instances whose confidence is too low to count in a query for the thing alone: the context may select one
    # of them. None where there are no others.
    with_uncertain: "Callable[[], NearThings] | None" = None
    is_named: bool = True  # see ``Factor``
    plain: "Callable[[], Factor] | None" = None  # see ``Factor``
    flat: bool = field(default=False, init=False)

    def include_uncertain(self) -> "NearThings":
        """Return this factor with its unsure instances."""
        return self._with_uncertain

    @cached_property
    def _with_uncertain(self) -> "NearThings":
        if self.with_uncertain is None:
            return self
        all_of_it = self.with_uncertain()  # context makes none of them likelier than the first of the thing alone
        sure = np.minimum(all_of_it.confidence, self.confidence.max(initial=0.0))
        return replace(all_of_it, confidence=sure.astype(all_of_it.confidence.dtype))

    @cached_property
    def anchors(self) -> Float[np.ndarray, "a 3"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The middles of the object's voxels."""
        return self.space.centres_of(self.mask)

    @cached_property
    def middles(self) -> Float[np.ndarray, "i 3"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Of each instance, the voxel nearest to its middle."""
        order, ends = np.argsort(self.instance, kind="stable"), np.cumsum(np.bincount(self.instance))
        return np.array([middle_of(own) for own in np.split(self.anchors[order], ends)[:-1]]).reshape(-1, 3)

    def heat_and_anchors(
        self, among: Bool[np.ndarray, " n"] | None = None
    ) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return the heat, and the nearest voxel of the object."""
        return object_heat(self.space, self.mask, self.falloff_per_m, among)

    @cached_property
    def _tree(self):
        from scipy.spatial import KDTree

        return KDTree(self.anchors, balanced_tree=False, compact_nodes=False)

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        """Return the heat at any points."""
        if not len(self.anchors):
            return np.zeros(len(points_world))
        if len(points_world) == 1 or len(points_world) * len(self.anchors) <= _FEW_PAIRS:
            apart = points_world[:, None, :] - self.anchors
            distance = np.sqrt(np.einsum("mak,mak->ma", apart, apart)).min(axis=1)
        else:
            distance = self._tree.query(points_world)[0]
        return np.maximum(1.0 - self.falloff_per_m * distance, 0.0)


@dataclass(frozen=True, eq=False)
class NearAnchors(Factor):
    """Heat of an image, an area or a sound: max over anchors of s − ε·d_xy, floored at 0."""

    space: Space
    part: Part
    falloff_per_m: float
    anchors: Float[np.ndarray, "a 3"]
    scores: Float[np.ndarray, " a"]  # (a,) in [0, 1], one for each anchor
    instance: Int[np.ndarray, " a"]
    found: bool
    understood: str = ""
    note: str = ""
    certainty: float = 1.0  # the confidence of every instance: 1 where the scores are calibrated already
    flat: bool = field(default=True, init=False)

    def __post_init__(self) -> None:
        if len(self.anchors) != len(self.scores) or len(self.anchors) != len(self.instance):
            raise ValueError(f"{len(self.anchors)} anchors, {len(self.scores)} scores, {len(self.instance)} instances")
        if len(self.scores) and not (np.min(self.scores) >= 0.0 and np.max(self.scores) <= 1.0):
            raise ValueError("an anchor's score is outside [0, 1] or NaN")
        if not 0.0 <= self.certainty <= 1.0:
            raise ValueError(f"certainty is {self.certainty}; it must lie in [0, 1]")

    @cached_property
    def confidence(self) -> Float[np.ndarray, " i"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The certainty, for each instance."""
        return np.full(int(self.instance.max(initial=-1)) + 1, self.certainty)

    @cached_property
    def middles(self) -> Float[np.ndarray, "i 3"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Of each instance, the middle of its best anchors."""
        each = [np.flatnonzero(self.instance == number) for number in range(len(self.confidence))]
        best = [own[self.scores[own] == self.scores[own].max()] for own in each]
        return np.array([self.anchors[top].mean(axis=0) for top in best]).reshape(-1, 3)

    def heat_and_anchors(
        self, among: Bool[np.ndarray, " n"] | None = None
    ) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return the heat, and the anchor whose cone is highest there."""
        return anchor_heat(self.space, self.anchors, self.scores, self.falloff_per_m, among)

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        """Return the heat at any points."""
        heat = np.zeros(len(points_world))
        points, anchors = self.space.level(points_world)[:, :2], self.space.level(self.anchors)[:, :2]
        several = max(1, _PAIRS // max(len(anchors), 1))
        for a in range(0, len(points) if len(anchors) else 0, several):
            away = points[a : a + several, None] - anchors[None]
            cones = self.scores - self.falloff_per_m * np.hypot(away[..., 0], away[..., 1])
            heat[a : a + several] = np.maximum(cones.max(axis=1), 0.0)
        return heat


def product_of(factors: Sequence[Factor]) -> Float32[np.ndarray, " n"]:
    """Return the product of the heat of factors at every voxel: of the lead first, which falls fastest."""
    lead = lead_of(factors)
    return times(lead.values, [factor for factor in factors if factor is not lead])


def times(heat: Float32[np.ndarray, " n"], factors: Sequence[Factor]) -> Float32[np.ndarray, " n"]:
    """Return heat times that of more factors, which are computed where some is left."""
    for factor in factors:
        heat = heat * factor.among(heat > 0.0)
    return heat


def lead_of(factors: Sequence[Factor]) -> Factor:
    """Return the factor whose instances are the goals: the primary one, else the first object, else the first."""
    primary = next((factor for factor in factors if factor.part.role is Role.PRIMARY), None)
    return primary or next((factor for factor in factors if isinstance(factor, NearThings)), factors[0])


def stretch_scores(scores: Float[np.ndarray, " a"]) -> Float[np.ndarray, " a"]:
    """Stretch scores to [0, 1] as the paper does, all to 1 where equal. ``ValueError``: a score is NaN or infinite."""
    if not np.isfinite(scores).all():
        raise ValueError("a score is NaN or infinite")
    low, high = np.min(scores, initial=np.inf), np.max(scores, initial=-np.inf)
    if high - low <= ROUNDING * max(1.0, abs(low), abs(high)):
        return np.ones(len(scores))
    return np.clip((scores - low) / (high - low), 0.0, 1.0)


def object_heat(
    space: Space, mask: Bool[np.ndarray, " n"], falloff_per_m: float, among: Bool[np.ndarray, " n"] | None = None
) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Return max(1 − ε·d, 0) for every voxel, d the 3D distance in metres to the nearest voxel of the mask, and which.

    Squared distances between voxel indices are whole numbers, so nothing is approximated. ``among``: the voxels that
    are wanted; others have no heat. The nearest is a number among those of the mask, −1 where there is no heat.
    """
    from avlmaps.query.kernels import nearest_squared

    voxel_size_m = space.grid.voxel_size_m
    blocks = space.blocks if among is None else space.blocks.chosen(among)
    things = space.blocks.chosen(mask)
    reach = int(np.ceil(min(1.0 / (falloff_per_m * voxel_size_m), 40_000.0)))
    limit = np.int32(reach**2)
    blocks = blocks.some(blocks.near(things, reach))  # no voxel of another block has any heat
    squared, nearest = np.full(len(blocks.order), limit, np.int32), np.full(len(blocks.order), -1, np.int32)
    if len(things):
        share(
            lambda a, b: nearest_squared(
                blocks.index, blocks.starts, blocks.low, blocks.high,
                things.index, things.starts, things.low, things.high, limit, squared, nearest, a, b,
            ),
            len(blocks),
            least=64,
        )  # fmt: skip
    heat, anchor = np.zeros(len(space), np.float32), np.full(len(space), -1, np.int32)
    hot = np.flatnonzero(squared < limit)
    rows = blocks.order[hot]
    heat[rows] = np.maximum(1.0 - falloff_per_m * voxel_size_m * np.sqrt(squared[hot], dtype=np.float32), 0.0)
    anchor[rows] = np.searchsorted(np.flatnonzero(mask), things.order)[nearest[hot]]
    return heat, anchor


def anchor_heat(
    space: Space, anchors: Float[np.ndarray, "a 3"], scores: Float[np.ndarray, " a"], falloff_per_m: float,
    among: Bool[np.ndarray, " n"] | None = None,
) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:  # fmt: skip
    """Return max over anchors of s − ε·d_xy, floored at 0, for every voxel, and which anchor was highest (−1: none).

    ``anchors``: metres, world. ``scores``: s, in [0, 1]. ``among``: the voxels that are wanted; others have no heat.
    """
    from avlmaps.query.kernels import cone_heat

    order = np.argsort(-np.asarray(scores, np.float64), kind="stable")
    order = order[np.asarray(scores)[order] > 0.0]
    ground = np.ascontiguousarray(space.level(np.asarray(anchors, np.float64).reshape(-1, 3))[order, :2])
    sorted_scores = np.asarray(scores, np.float64)[order]
    blocks = space.blocks if among is None else space.blocks.chosen(among)
    horizontal = space.horizontal if among is None else space.horizontal_of(blocks)
    values, anchor = np.zeros(len(space), np.float32), np.full(len(space), -1, np.int32)
    if not len(ground):
        return values, anchor
    heat, winner = np.empty(len(horizontal), np.float64), np.empty(len(horizontal), np.int32)
    share(
        lambda a, b: cone_heat(
            horizontal, blocks.starts, ground, sorted_scores, float(falloff_per_m), heat, winner, a, b
        ),
        len(blocks),
        least=64,
    )
    values[blocks.order] = heat
    anchor[blocks.order] = np.append(order, -1).astype(np.int32)[winner]
    return values, anchor
