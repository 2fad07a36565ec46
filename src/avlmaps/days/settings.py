"""All that can be chosen when a map of another day is merged."""

from dataclasses import dataclass, field

import numpy as np

from avlmaps.core.timeline import DAY_S


@dataclass(frozen=True, slots=True)
class AlignSettings:
    """When a map counts as one of the same place, and where in it."""

    tried: int = 60
    """Keyframes of the other map that are located, at most, spread over its walk."""
    enough: int = 16
    """This number that agree is enough."""
    least: int = 5
    """Fewer are no proof: one thing that stands in two homes can place some keyframes beside each other."""
    least_spread_m: float = 1.5
    """The agreeing keyframes stand this far apart at least, so that no single thing made them agree."""
    least_share: float = 0.4
    """This part of the located keyframes must agree."""
    agree_m: float = 0.3
    """Two keyframes agree where they place each other's camera within this."""
    agree_rad: float = float(np.deg2rad(4.0))
    """And within this angle."""
    refine_from: float = 0.5
    """Surfaces refine the transform where the agreeing keyframes scatter by more than this part of a voxel. A voxel
    knows no better where in it its surface lies: measured, votes that scatter less are right within 3 mm, and laying
    surface on surface would cost 1.5 cm."""
    tilt_rad: float = float(np.deg2rad(5.0))
    """The up directions of both maps differ by no more."""
    least_agreement: float = 0.75
    """Of the surface of the other map that the first one looked at, this part lies on its surface and not where
    it saw through. Changed things cost some percent; a wrong place leaves less than half."""
    least_looked: int = 1000
    """Voxels of the other map that the first one looked at: fewer prove nothing."""


@dataclass(frozen=True, slots=True)
class ChangeSettings:
    """From depth to what is there, gone, new and moved; see ``evidence`` for the rule."""

    least_coverage: float = 0.15
    """A verdict needs this part of a thing's voxels looked at."""
    gone_at: float = 0.7
    """Gone where it is gone with this probability."""
    patch_m: float = 0.15
    """Voxels of one patch of this edge are not independent: together they count as one look."""
    through_views: int = 2
    """Keyframes that see through a voxel, at least: one may have a wrong pose."""
    angle_rad: float = float(np.deg2rad(70.0))
    """A view counts against a thing where it looks from within this angle of a view that saw it."""
    overlap: float = 0.25
    """A thing is the one of an earlier day where this part of the smaller of the two lies in the other."""
    same_place: float = 0.6
    """With another name, where this part of the smaller lies in the other, and it is this part of its voxels."""
    reach_m: float = 20.0
    """What moved farther is not recognised."""
    within_s: float = 30 * DAY_S
    """Nor what comes back after more time."""
    least_likeness: float = 0.3
    """Of size, colour and looks together, in [0, 1], for a thing to be the one that is gone from elsewhere."""
    likeness_unnamed: float = 0.5
    """Likewise, where the names differ and one of them has little confidence."""
    confident_at: float = 0.5
    """A name of less confidence does not speak against another."""
    least_voxels: int = 12
    """Surface that nothing names counts as a changed thing from this number of voxels that rays pass through on another
    day."""
    most_m: float = 2.0
    """And up to this extent: longer ones are no thing that somebody carries."""
    lowest_voxels: float = 2.5
    """Nor is what is flatter: a table's top of which one day saw a little more."""


@dataclass(frozen=True, slots=True)
class MergeSettings:
    """Everything about a merge."""

    align: AlignSettings = field(default_factory=AlignSettings)
    """Where the other map is."""
    changes: ChangeSettings = field(default_factory=ChangeSettings)
    """What became of the things."""
    least_confidence: float = 0.5
    """Things of less are not followed, in [0, 1]."""
    seed: int = 0
    """Of the poses' sampling."""
