"""Everything about a build that can be chosen, nested by stage. A field's docstring is its help on the command line."""

from dataclasses import dataclass, field, replace
from typing import Literal

from avlmaps.core.errors import AudioError, MapError
from avlmaps.core.numbers import hold_numbers
from avlmaps.maps.fusion.sensor import FusionSettings

SUBMAP_FRAMES = 32
"""Frames of a submap: fewer follow corrections more closely and take more room (docs/guides/map-while-you-drive.md)."""


@dataclass(frozen=True, slots=True)
class KeyframeSettings:
    """When a frame becomes a keyframe."""

    translation_m: float = 0.1
    """Distance that the camera moved since the last keyframe, metres."""

    rotation_deg: float = 7.0
    """Or angle that it turned, degrees."""

    max_gap_s: float = 5.0
    """Or time that went by, seconds; a robot that stands still adds a keyframe now and then."""

    thumbnail_width_px: int = 320
    """Width of the thumbnails that the map stores."""

    max_depth_m: float = 6.0
    """Keypoints farther away get no 3D point: the depth of most sensors is poor out there."""

    def __post_init__(self) -> None:
        hold_numbers(self, MapError, positive="translation_m rotation_deg max_gap_s thumbnail_width_px max_depth_m")


DEFAULT_KEYFRAMES = KeyframeSettings()


@dataclass(frozen=True, slots=True)
class SegmentationSettings:
    """Finding the sounds in a track."""

    method: Literal["adaptive", "silence"] = "adaptive"
    """adaptive: energy against the background as it is there and then; silence: the paper's fixed threshold."""
    onset_db: float = 6.0
    """A sound must somewhere be this much above the background, dB."""
    release_db: float = 2.5
    """It lasts as long as it is this much above the background, dB."""
    smoothing_s: float = 0.05
    """The excess over the background is averaged over this time before it is compared, seconds."""
    background_window_s: float = 40.0
    """The background is found within this time, seconds; a longer sound is background."""
    range_db: float = 65.0
    """A level this much below the loudest moment of the track is not a sound, however silent the background."""
    tail_db: float = 50.0
    """A sound ends where it has fallen this much below its own loudest moment."""
    merge_gap_s: float = 1.0
    """Pauses up to this long divide no sound."""
    min_length_s: float = 0.03
    """A shorter stretch is not a sound."""
    max_length_s: float = 30.0
    """A longer sound is cut where it is quietest."""
    padding_s: float = 0.02
    """This time is added at both ends, seconds."""
    silence_threshold: float = 0.0
    """Of method silence: samples beyond this, of either sign, are sound."""
    silence_s: float = 1.0
    """Of method silence: a pause of this length divides two sounds."""

    def __post_init__(self) -> None:
        hold_numbers(
            self, AudioError, positive="smoothing_s background_window_s range_db tail_db max_length_s silence_s",
            least_0="merge_gap_s min_length_s padding_s silence_threshold release_db",
        )  # fmt: skip
        if self.onset_db < self.release_db:
            raise AudioError(f"onset_db is {self.onset_db}, less than release_db ({self.release_db}); choose more.")
        if self.max_length_s <= self.min_length_s:
            raise AudioError(f"max_length_s is {self.max_length_s}, not more than min_length_s ({self.min_length_s}).")


@dataclass(frozen=True, slots=True)
class SoundChangeSettings:
    """Cutting a track where what sounds changes."""

    change_s: float = 0.2
    """A stretch this long that is wholly unlike its surroundings is one of its own; a more alike stretch must last
    longer. No stretch is shorter."""
    max_length_s: float = 5.0
    """A stretch that lasts longer is cut where that costs least: the robot moves on, and its places with it."""

    def __post_init__(self) -> None:
        hold_numbers(self, AudioError, positive="change_s max_length_s")
        if self.max_length_s < 2.0 * self.change_s:
            raise AudioError(f"max_length_s is {self.max_length_s}; choose at least twice change_s ({self.change_s}).")


@dataclass(frozen=True, slots=True)
class HearingSettings:
    """From the sound track to the sounds of a map."""

    segmentation: SegmentationSettings = field(default_factory=SegmentationSettings)
    """Finding the sounds in the track."""
    noise_reduction_db: float = 12.0
    """The background is made quieter by at most this, dB, before a sound is encoded; 0 leaves it as it is."""
    quiet_s: float = 5.0
    """Seconds before and after a sound, with no other sound in them, from which the background is learnt."""
    cut: Literal["auto", "energy", "changes"] = "auto"
    """energy: sounds are what stands out from the background; changes: the whole track is used, divided at its change
    points; auto: changes where the sound model gives a feature every few hundredths of a second."""
    changes: SoundChangeSettings = field(default_factory=SoundChangeSettings)
    """Dividing the track where what sounds changes."""

    def __post_init__(self) -> None:
        hold_numbers(self, AudioError, least_0="noise_reduction_db quiet_s")


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
    look_m: float = 0.05
    """Encode keyframes and frames this far apart, metres; others add surfaces and colours. 0 encodes every frame."""
    look_deg: float = 3.5
    """Or turned by this angle, degrees; 0 encodes every frame."""

    @property
    def summed(self) -> int:
        """How many frames are added up by themselves."""
        return self.per_submap or self.per_part

    def __post_init__(self) -> None:
        hold_numbers(self, MapError, least_0="per_submap max_bad_share look_m look_deg", least_1="step per_part")
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
        fault = f"The height of the camera over the floor is {height_m} m"
        _require(height_m is None or 0.02 <= height_m <= 10.0, fault, "between 0.02 and 10, in metres")


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
