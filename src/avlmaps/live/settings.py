"""What can be chosen about a live map."""

from dataclasses import dataclass

from avlmaps.core.errors import MapError
from avlmaps.core.numbers import hold_numbers


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """What can be chosen about a live map beside the settings of a build."""

    gates: bool = True
    """Fuse only frames that bring something: the robot moved, or new surface is in view. Without gates every frame
    that is not late is fused and encoded, and the end is that of a build."""
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
        hold_numbers(self, MapError)
        for name in ("most_waiting", "known_views", "first_frames"):
            if not getattr(self, name) >= 1:
                raise MapError(f"{name} of a live map is {getattr(self, name)}; choose 1 or more.")
        for name in ("still_m", "still_deg", "new_share", "snapshot_s", "save_s"):
            if not getattr(self, name) >= 0.0:
                raise MapError(f"{name} of a live map is {getattr(self, name)}; choose 0 or more.")
