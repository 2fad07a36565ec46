"""Areas by TIPSv2's class token of whole pictures, from the same run that gives the patches."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from avlmaps.recordings.types import Frame
from avlmaps_models.light.pixels import LightPictures


class LightViews(LightPictures):
    """A feature for each picture."""

    _module = "views"
    _limit = "learnt from captions of pictures, not from rooms"

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        rows = [self._tower.view(frame.rgb) for frame in frames]
        return np.stack(rows) if rows else np.zeros((0, self.card.dim), np.float32)
