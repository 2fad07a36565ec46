"""What can be chosen about a live map, and how it fares: what came, what was dropped and why, how long it took."""

import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.numbers import hold_numbers


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """What can be chosen about a live map beside the settings of a build."""

    gates: bool = True
    """Fuse only frames that bring something: the robot moved, or new surface is in view. Without gates every frame
    that is not late is fused and encoded; a build encodes only those 5 cm or 3.5 degrees apart."""
    most_waiting: int = 2
    """Frames that may wait; when one more comes, the oldest is dropped as late."""
    still_m: float = 0.02
    """A camera that moved less than this since the last fused frame, metres, ..."""
    still_deg: float = 1.0
    """... and turned less than this, degrees, stands still."""
    known_views: int = 8
    """A voxel that this many frames hit is known."""
    new_share: float = 0.02
    """A frame brings new surface where more than this share of its points hit voxels that are not known."""
    first_frames: int = 8
    """Frames in which up, the floor and the depth camera are found first, with gates; without them as in a build."""
    snapshot_s: float = 1.0
    """Seconds from one snapshot for questions to the next, at least; where one takes long, it pauses as long as that
    took, up to a second."""
    save_s: float = 1.5
    """Seconds from one save to the next, at least."""

    def __post_init__(self) -> None:
        hold_numbers(
            self, MapError, least_0="still_m still_deg new_share snapshot_s save_s",
            least_1="most_waiting known_views first_frames",
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class LiveStatus:
    """How a live map fares at a moment.

    Attributes:
        frames_in: frames that came, refused ones left out.
        fused: frames that are in the map's sums.
        encoded: of these, how many were given to the encoder; the others added their surface and colours.
        dropped: frames that are not, by reason: ``late`` (others were waiting), ``still`` (the camera did not move),
            ``known`` (no new surface), ``wrong`` (an encoder failed on it).
        refused: frames and pieces of sound that were no such thing, or out of order.
        waiting: frames that wait.
        frame_ms_p50: milliseconds from a frame's arrival until it is in the sums or dropped by a gate, median.
        frame_ms_p95: 95 % are quicker.
        voxels: of the last snapshot.
        keyframes: of the last snapshot.
        sounds: of the last snapshot.
        snapshot_age_s: since what the last snapshot holds came; NaN without one.
        saved_age_s: since what the last save holds came; NaN without one. It grows also while nothing new comes.
        unsaved_s: since the oldest frame or sound came that a kill would lose now; 0 where there is none.
        memory_mb: resident memory of the process; 0 where the system does not say.
        sound_gaps: gaps in the sound, which are silent.
        doubts: one sentence for each thing that is not as it should be.
    """

    frames_in: int
    fused: int
    encoded: int
    dropped: dict[str, int]
    refused: int
    waiting: int
    frame_ms_p50: float
    frame_ms_p95: float
    voxels: int
    keyframes: int
    sounds: int
    snapshot_age_s: float
    saved_age_s: float
    unsaved_s: float
    memory_mb: float
    sound_gaps: int
    doubts: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON has it; what is not known is None."""
        return {
            key: None if isinstance(value, float) and np.isnan(value) else value for key, value in asdict(self).items()
        }

    def __str__(self) -> str:
        dropped = ", ".join(f"{count} {reason}" for reason, count in sorted(self.dropped.items()))
        took = "" if np.isnan(self.frame_ms_p95) else f", p95 {self.frame_ms_p95:.0f} ms"
        return (
            f"{self.frames_in} frames came, {self.fused} fused, {self.encoded} of them encoded "
            f"({dropped or 'none'} dropped){took}; "
            f"{self.voxels} voxels, {self.keyframes} keyframes, {self.sounds} sounds; {self.memory_mb:.0f} MB"
        )


def memory_mb() -> float:
    """Return the resident memory of the process, MB; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
