"""What a day says of a place: there is surface again, rays pass through it, or nobody looked.

For the n voxels of a thing that lie beside no other surface (the floor under a box is no box), n₊ are those where the
day has surface there, and n₋ those through which at least two of its views see, from where it was
seen before. Voxels beside each other say the same thing twice, so that they count by patches of edge a: with voxels of
edge s, k± = n± · s²/a². With one look that was worth nothing either way (a uniform prior), the probability that the
thing is gone is the mean of a Beta distribution:

    P(gone) = (1 + k₋) / (2 + k₋ + k₊)                                                                             (1)

A thing is *gone* where P(gone) ≥ ``GONE_AT`` and (n₊ + n₋)/n ≥ ``LEAST_COVERAGE``; it is *there* where P(gone) < ½
under the same coverage; otherwise it is *unknown*. What nobody looked at has k₊ = k₋ = 0 and P(gone) = ½: "not seen"
never becomes "gone". Evidence of presence against evidence of free space, per thing, is the practice of
Panoptic Multi-TSDFs (Schmid et al. 2022), POCD (Qian et al. 2022) and Khronos (Schmid et al. 2024).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int, UInt16
from avlmaps.core.camera import Pinhole
from avlmaps.core.columns import take
from avlmaps.core.poses import apply, inverse
from avlmaps.core.progress import silence_progress
from avlmaps.days.surfaces import Occupied
from avlmaps.maps.fusion.free_space import FreeViews, block_size, count_through
from avlmaps.maps.grid import GridSpec

LEAST_COVERAGE = 0.15  # a verdict needs this part of a thing's voxels looked at
GONE_AT = 0.7  # gone where it is gone with this probability
PATCH_M = 0.15  # voxels of one patch of this edge are not independent: together they count as one look
THROUGH_VIEWS = 2  # keyframes that see through a voxel, at least: one may have a wrong pose
ANGLE_RAD = math.radians(70.0)  # a view counts where it looks from within this angle of a view that saw the thing
_MOST_SAMPLES = 48  # voxels of a thing by which it is decided which views show it
_BEFORE_M = 0.3  # a view shows what lies up to this far behind where its blocks are free
_LEAST_SEEN = 0.2  # of these samples
_SOME = 0.1  # of a thing's voxels
_FEWEST_OWN, _LEAST_OWN = 8, 0.15  # voxels of a thing that lie beside nothing else, and their part of it


class DayVerdict(StrEnum):
    """What a day says of a thing's place."""

    THERE = "there"
    GONE = "gone"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class VoxelEvidence:
    """The evidence of a day on some voxels: how many they are (n), with surface again (n₊), and seen through (n₋)."""

    voxels: int
    surface: int
    through: int

    def coverage(self) -> float:
        """Return the part of the voxels that was looked at, in [0, 1]."""
        return (self.surface + self.through) / max(self.voxels, 1)

    def p_gone(self, voxel_size_m: float) -> float:
        """Return the probability that the thing is gone: equation (1)."""
        patches = min((voxel_size_m / PATCH_M) ** 2, 1.0)
        return (1.0 + patches * self.through) / (2.0 + patches * (self.through + self.surface))

    def verdict(self, voxel_size_m: float) -> DayVerdict:
        """Return what the day says of the thing."""
        if self.coverage() < LEAST_COVERAGE:
            return DayVerdict.UNKNOWN
        p_gone = self.p_gone(voxel_size_m)
        if p_gone >= GONE_AT:
            return DayVerdict.GONE
        return DayVerdict.THERE if p_gone < 0.5 else DayVerdict.UNKNOWN


@dataclass(frozen=True, slots=True, eq=False)
class DayViews:
    """How far the keyframes of one recording saw freely, in the map's world; ``pose`` is world_from_camera of each."""

    clear_mm: UInt16[np.ndarray, "k rows columns"]
    pose: Float[np.ndarray, "k 4 4"]
    camera: Pinhole

    def __len__(self) -> int:
        return len(self.pose)

    def through(self, index: Int[np.ndarray, "n 3"], grid: GridSpec) -> Int[np.ndarray, " n"]:
        """Return how many views see through each voxel; see ``count_through``."""
        views = FreeViews(np.asarray(self.clear_mm), np.asarray(self.pose, np.float64))
        with silence_progress(True):
            return count_through(np.asarray(index, np.int32), grid, self.camera, [views])

    def show(self, points: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " k"]:
        """Return which views show a thing: its points are in the picture, and nothing is in front of them."""
        if not (len(points) and len(self)):
            return np.zeros(len(self), bool)
        some = points[:: max(1, len(points) // _MOST_SAMPLES)]
        camera, size = self.camera, block_size(self.camera)
        own = np.einsum("kij,mj->kmi", inverse(self.pose)[:, :3, :3], some) + inverse(self.pose)[:, None, :3, 3]
        depth = np.maximum(own[..., 2], 1e-6)
        u = camera.fx * own[..., 0] / depth + camera.cx
        v = camera.fy * own[..., 1] / depth + camera.cy
        inside = (own[..., 2] > 0.05) & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
        column, row = (np.where(inside, one, 0.0).astype(np.int64) // size for one in (u, v))
        clear_m = self.clear_mm[np.arange(len(self))[:, None], row, column] / 1000.0
        shown = inside & (clear_m > 0.0) & (clear_m >= own[..., 2] - _BEFORE_M)
        return shown.mean(axis=1) >= _LEAST_SEEN

    def directions(self, middle: Float[np.ndarray, "3"]) -> Float[np.ndarray, "k 3"]:
        """Return the unit vectors from a place to the cameras."""
        to = self.pose[:, :3, 3] - middle
        return to / np.maximum(np.linalg.norm(to, axis=1, keepdims=True), 1e-9)


@dataclass(frozen=True, slots=True, eq=False)
class Day:
    """What one day knows of the map's world."""

    views: DayViews  # what its keyframes looked at
    occupied: Occupied  # its surface, in the grid of its own world
    recording_from_map: Float[np.ndarray, "4 4"]  # into that world
    surface: Occupied  # its surface, in the grid of the map

    def has_surface(self, points: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Return where the day has surface; see ``Occupied.near``."""
        return self.occupied.near(apply(self.recording_from_map, points))


def seen_again(
    index: Int[np.ndarray, "n 3"], grid: GridSpec, before: Sequence[DayViews], known: Occupied, day: Day
) -> VoxelEvidence:
    """Return what a day says of a thing's voxels.

    ``before`` are the views of the days on which it was there: near to those a view must look from. Beside what else
    ``known``, the surface of the map until then, has, new surface says nothing of the thing.
    """
    allowed = _from_where_it_was_seen(grid.centre_of(np.asarray(index)), before, day.views)
    through = np.zeros(len(index), bool)
    if allowed.sum() >= THROUGH_VIEWS:
        through = take(day.views, allowed).through(index, grid) >= THROUGH_VIEWS
    own = known.alone(index)
    return _counted(through, day.has_surface(grid.centre_of(np.asarray(index))), own)


def seen_before(
    index: Int[np.ndarray, "n 3"], grid: GridSpec, before: Sequence[DayViews], known: Occupied, day: Day
) -> DayVerdict:
    """Return what earlier days say of the place of a thing: gone says that they looked through it.

    ``before`` are the views of all earlier days, ``known`` is the surface as those who looked last left it.
    """
    through = np.sum([day.through(index, grid) for day in before], axis=0) >= THROUGH_VIEWS
    seen = _counted(through, known.near(grid.centre_of(np.asarray(index))), day.surface.alone(index))
    return seen.verdict(grid.voxel_size_m)


def _counted(
    through: Bool[np.ndarray, " n"], surface: Bool[np.ndarray, " n"], own: Bool[np.ndarray, " n"]
) -> VoxelEvidence:
    # Of a thing that leans on a wall all voxels lie beside it. Where rays pass through more than some of them, the
    # surface behind is the wall's, and says nothing of the thing.
    through = through & ~surface
    if own.sum() >= max(_FEWEST_OWN, _LEAST_OWN * len(own)):
        through, surface = through[own], surface[own]
    elif through.sum() > _SOME * len(own):
        surface = surface & own
    return VoxelEvidence(len(through), int(surface.sum()), int(through.sum()))


def _from_where_it_was_seen(
    points: Float[np.ndarray, "n 3"], before: Sequence[DayViews], views: DayViews
) -> Bool[np.ndarray, " k"]:
    middle = points.mean(axis=0)
    known = [day.directions(middle)[day.show(points)] for day in before]
    seen_from = np.concatenate([np.zeros((0, 3)), *known])
    if not len(seen_from):
        return np.zeros(len(views), bool)
    alike = (views.directions(middle) @ seen_from.T).max(axis=1)
    return alike >= math.cos(ANGLE_RAD)
