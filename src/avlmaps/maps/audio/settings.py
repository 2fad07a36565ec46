"""How sounds are found in a track; apart from what does it, so that a map opens without it."""

from dataclasses import dataclass, field
from typing import Literal

from avlmaps.core.errors import AudioError
from avlmaps.core.numbers import hold_numbers


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
