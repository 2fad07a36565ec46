"""The numbers of the evidence, chosen on development homes (docs/guides/where-sounds-come-from.md)."""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.maps.sources.correlation import Correlations


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """From correlations to probabilities.

    Attributes:
        concentration: how much a steered sum counts, after it was divided by its greatest possible value to the power
            ``saturation``: bins of neighbouring frames repeat one another.
        saturation: see above.
        smoothing: of the correlations, in steps of their delay: half a cell of the candidates.
        level_noise_db: by how much a sound's own loudness changes while it sounds (one microphone).
        reverberant_m: distance at which rooms return as much sound as comes straight (one microphone).
        hidden: log-odds against a place behind a wall.
        reach_m: distance from the robot by which a place becomes e times less likely.
        blur_m: standard deviations of the errors of place that most and some events have.
        wide: share of those of the second.
        astray: share of the events whose evidence says nothing.
    """

    concentration: float = 9.0
    saturation: float = 0.7
    smoothing: float = 5.0
    level_noise_db: float = 8.0
    reverberant_m: float = 0.6
    hidden: float = 1.5
    reach_m: float = 2.5
    blur_m: tuple[float, float] = (0.075, 0.35)
    wide: float = 0.15
    astray: float = 0.03

    def weighed(self, steered: Float[np.ndarray, " c"], found: Correlations) -> Float[np.ndarray, " c"]:
        """Return the log-likelihood of steered sums, but for a constant."""
        greatest = max(float(found.weight.sum()) * len(found.pair), 1.0)
        return self.concentration * steered / greatest**self.saturation

    @classmethod
    def of(cls, channels: int) -> "SourceSettings":
        """Return those of a number of microphones."""
        return _OF_CHANNELS.get(channels, cls())


_OF_CHANNELS = {
    0: SourceSettings(blur_m=(0.07, 0.35), wide=0.1, astray=0.02),  # a device's directions alone
    1: SourceSettings(reach_m=1.0, blur_m=(0.15, 0.6)),
    2: SourceSettings(wide=0.3),
}
