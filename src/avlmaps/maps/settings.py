"""Everything about a build that can be chosen, nested by stage. A field's docstring is its help on the command line."""

from dataclasses import dataclass, field, replace
from typing import Literal

from avlmaps.core.errors import MapError
from avlmaps.core.numbers import hold_numbers
from avlmaps.maps.audio.settings import HearingSettings
from avlmaps.maps.fusion.sensor import FusionSettings
from avlmaps.maps.keyframes.choose import KeyframeSettings

SUBMAP_FRAMES = 32
"""Frames of a submap: fewer follow corrections more closely and take more room (docs/guides/map-while-you-drive.md)."""


@dataclass(frozen=True, slots=True)
class FrameSettings:
    """Which frames are fused, and how many at a time."""

    step: int = 1
    """Fuse every n-th frame."""
    per_part: int = 200
    """Frames that are fused, then stored; a stopped build resumes from there. Fewer lose less, more are quicker."""
    on_bad: Literal["skip", "stop"] = "skip"
    """What to do with a frame that cannot be read: leave it out and note it in the map, or stop."""
    max_bad_share: float = 0.05
    """Stop nevertheless when more than this share of the frames cannot be read."""
    per_submap: int = 0
    """Frames of a submap: the map stores their sums and can follow corrected poses. 0 stores none."""

    @property
    def summed(self) -> int:
        """How many frames are added up by themselves."""
        return self.per_submap or self.per_part

    def __post_init__(self) -> None:
        hold_numbers(self, MapError, least_0="per_submap max_bad_share", least_1="step per_part")
        _require(self.max_bad_share <= 1.0, f"max_bad_share is {self.max_bad_share}", "between 0 and 1")


@dataclass(frozen=True, slots=True)
class GravitySettings:
    """Finding the up direction, where the recording does not say, and where the floor is."""

    frames: int = 60
    """Number of frames to look at, spread evenly."""
    camera_height_m: float | None = None
    """Height of the depth camera over the floor in the first frame, metres. Default: found from the frames."""

    def __post_init__(self) -> None:
        hold_numbers(self, MapError, least_1="frames")
        height_m = self.camera_height_m
        _require(
            height_m is None or 0.02 <= height_m <= 10.0,
            f"The height of the camera over the floor is {height_m} m",
            "between 0.02 and 10, in metres",
        )


@dataclass(frozen=True, slots=True)
class BuildSettings:
    """Everything about a build that can be chosen; the resolved settings are written into the map."""

    voxel_size_m: float = 0.05
    """Edge of a voxel, metres."""
    frames: FrameSettings = field(default_factory=FrameSettings)
    """Which frames are fused, and how many at a time."""
    fusion: FusionSettings = field(default_factory=FusionSettings)
    """From frames to voxels."""
    gravity: GravitySettings = field(default_factory=GravitySettings)
    """Finding the up direction."""
    keyframes: KeyframeSettings = field(default_factory=KeyframeSettings)
    """Which frames stand for the walk."""
    hearing: HearingSettings = field(default_factory=HearingSettings)
    """From the sound track to the sounds of a map."""
    seed: int = 0
    """Seed of what is drawn at random (visual words, RANSAC)."""

    def __post_init__(self) -> None:
        hold_numbers(self, MapError, least_0="seed")
        _require(0.001 <= self.voxel_size_m <= 10.0, f"The voxel size is {self.voxel_size_m} m", "between 0.001 and 10")

    def for_profile(self, weight_variance_m2: float) -> "BuildSettings":
        """Return the settings with what was left to the profile filled in."""
        if self.fusion.weight_variance_m2 is not None:
            return self
        return replace(self, fusion=replace(self.fusion, weight_variance_m2=weight_variance_m2))


def _require(holds: bool, fault: str, wanted: str) -> None:
    if not holds:
        raise MapError(f"{fault}; choose {wanted}.")


DEFAULTS = BuildSettings()
