"""What can be chosen about a live map."""

from dataclasses import dataclass

from avlmaps.core.errors import MapError
from avlmaps.core.numbers import hold_numbers


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """What can be chosen about a live map beside the settings of a build."""

    gates: bool = True
    """Fuse only frames that bring something: the robot moved, or new surface is in view. Without gates every frame
    that is not late is fused, and the end is bit by bit that of a build."""
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
    looks: int = 12
    """Encoded looks at a place, as near as a new one, beside which that is worth nothing. With gates."""
    encoded_share: float = 0.05
    """A fused frame is encoded where more than this share of its points is worth it; else it adds its surface and
    colours alone. Twice that with one frame waiting behind it, and so on."""
    fresh_s: float = 0.06
    """A frame that waited longer in the queue, seconds, is not encoded at once, so that those behind it are not late.
    With gates."""
    kept_frames: int = 256
    """Frames that were not encoded, came late or were dropped by a gate, and wait on the disk (2.2 MB each at 640x480)
    until there is time: when no frame comes for half a second, when those that come bring nothing new, and at the end.
    0 stores none. With gates."""
    later_looks: int = 100
    """As `looks`, for these."""
    first_frames: int = 8
    """Frames in which up, the floor and the depth camera are found first, with gates; without them as in a build."""
    snapshot_s: float = 1.0
    """Seconds from one snapshot for questions to the next, at least; where one takes long, it pauses as long as that
    took, up to a second."""
    save_s: float = 1.5
    """Seconds from one save to the next, at least."""

    def __post_init__(self) -> None:
        hold_numbers(self, MapError)
        for name in ("most_waiting", "known_views", "looks", "later_looks", "first_frames"):
            if not getattr(self, name) >= 1:
                raise MapError(f"{name} of a live map is {getattr(self, name)}; choose 1 or more.")
        for name in (
            "still_m",
            "still_deg",
            "new_share",
            "encoded_share",
            "fresh_s",
            "kept_frames",
            "snapshot_s",
            "save_s",
        ):
            if not getattr(self, name) >= 0.0:
                raise MapError(f"{name} of a live map is {getattr(self, name)}; choose 0 or more.")
