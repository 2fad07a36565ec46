"""Channels that are wired the other way round: found by what fits best, and taken back before sources are sought.

A turned sign turns the correlation with every other channel: where their peaks should meet they have holes. So every
choice of signs is tried, and the one whose places fit all sounds best is taken, where it is likelier than a mistake of
wiring is rare.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.correlation import Correlations
from avlmaps.maps.sources.settings import SourceSettings
from avlmaps.maps.sources.steered import loudest_of_sound, steer_pairs
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.microphones import Microphones

MOST_MICROPHONES = 8  # more choices than can be tried beyond
_RARE = 2.4  # log-odds against a turned channel
_MOST_SOUNDS, _MOST_FRAMES, _MOST_PLACES, _LONGEST_S = 6, 40, 4000, 5.0


def signs_of(
    steered: Sequence[tuple[Correlations, Float[np.ndarray, "p c"]]], settings: SourceSettings
) -> Float[np.ndarray, " m"]:
    """Return 1 or -1 for each channel; 1 for all where nothing speaks clearly for another choice.

    Args:
        steered: for each sound its correlations, and the steered sum of each pair at each candidate.
        settings: how much a sum counts.
    """
    pair = steered[0][0].pair
    count = int(pair.max()) + 1
    best, chosen = -np.inf, np.ones(count)
    for tail in itertools.product((1.0, -1.0), repeat=count - 1):
        signs = np.array([1.0, *tail])
        turned = min(int((signs < 0.0).sum()), int((signs > 0.0).sum()))
        both = signs[pair[:, 0]] * signs[pair[:, 1]]
        value = sum(settings.weighed(both @ sums, found).max() for found, sums in steered) - _RARE * turned
        if value > best:
            best, chosen = value, signs
    return chosen if (chosen < 0.0).sum() <= count / 2 else -chosen


def signs_along(
    track: AudioTrack,
    microphones: Microphones,
    walk: Trajectory,
    spans_s: Sequence[tuple[float, float]],
    place_m: Float[np.ndarray, "c 3"],
    settings: SourceSettings,
) -> Float[np.ndarray, " m"]:
    """Return the sign of each channel by some sounds along a walk; 1 for all of two channels, or of very many.

    The candidates ``place_m`` are in the frame of the walk's poses; the spans are onset and offset of sounds.

    Raises:
        AudioError: the track cannot be read.
    """
    plain = np.ones(len(microphones))
    if not 3 <= len(microphones) <= MOST_MICROPHONES:  # the delay of a single pair fits somewhere either way
        return plain
    place = place_m[:: -(-len(place_m) // _MOST_PLACES)].astype(np.float64)
    steered: list[tuple[Correlations, Float[np.ndarray, "p c"]]] = []
    for span_s in sorted(spans_s, key=lambda span: span[0] - span[1])[:_MOST_SOUNDS]:
        found = loudest_of_sound(
            track, microphones, walk, span_s, longest_s=_LONGEST_S, most=_MOST_FRAMES, smoothing=settings.smoothing
        )
        if len(found.at_s):
            steered.append((found, steer_pairs(found, microphones.in_world_m(walk.at(found.at_s)), place)))
    return signs_of(steered, settings) if steered else plain
