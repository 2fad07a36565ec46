"""What comes with a question beside its words: pictures and sounds."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import UInt8
from avlmaps.recordings.audio import Sound

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A picture that came without a file of its own.

    Attributes:
        rgb: its pixels.
        focal_35mm: the focal length for 35 mm film in its EXIF, mm; None where it has none.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    focal_35mm: float | None = None


Attachment = UInt8[np.ndarray, "h w 3"] | Photo | Sound
"""A picture or a sound that comes with a question, instead of a file."""
