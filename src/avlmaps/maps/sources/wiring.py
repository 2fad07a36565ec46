"""Whether the channels of an array are those of the microphones that the geometry says: exchanged, or wired in reverse.

Every order of the channels is tried on what was heard along the drive. For each sound and each order, the place is
sought whose delays, from where the robot was in each frame, fit best (``steered``). Only the right order fits all
sounds well. Orders that turn or mirror the array fit a single moment as well; the drive, which turns, does not.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.poses import apply, from_rotation, rotation_to_level
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.correlation import (
    MOST_MICROPHONES,
    SPEED_M_S,
    Correlations,
    SourceSettings,
    at_delay,
    loudest_of_sound,
    signs_of,
)
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.microphones import Microphones

_MOST_SOUNDS, _MOST_FRAMES, _LONGEST_S = 30, 80, 10.0
_LEAST_FRAMES = 6
_MOST_ORDERED = 4  # microphones of which every order is tried; of more, exchanges of two, and rings turned or mirrored
_AZIMUTHS, _AWAY_M, _OVER_EAR_M = 48, (0.5, 1.0, 2.0, 4.0), (-0.9, -0.3, 0.3)
_SMOOTHING = 5.0
# An order fits better when the sounds' fits grow by a factor, and by some standard errors of its logarithm: by much,
# or by little where Student's t makes that improbable for every order that is tried.
_MUCH, _LITTLE, _STANDARD_ERRORS, _IMPROBABLE, _FEWEST_SOUNDS = 1.25, 1.03, 3.0, 1e-3, 3
_LEAST, _POOR = 0.01, 0.12  # a right array in a room that rings for a second fits by more

Order = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Wiring:
    """What was found about the order of the channels."""

    # the microphone (its position's number, from 0) of each channel that fits best; of several that fit as well, that
    # which moves fewest channels
    order: Order
    turned: tuple[int, ...]  # channels whose sign is turned; sources are found with it taken back
    fit: float  # share of the greatest possible correlation with the order of the recording, mean over the sounds
    best_fit: float  # that of ``order``
    sounds: int  # how many were heard well enough

    @property
    def is_right(self) -> bool:
        """Whether nothing else fits better than what the recording says."""
        return not _moved(self.order) and not self.turned


def check_wiring(track: AudioTrack, walk: Trajectory, spans_s: Sequence[tuple[float, float]]) -> Wiring | None:
    """Compare delays between channels, sound by sound along a drive, with the geometry; None for too few sounds."""
    array = track.microphones
    if array is None or not 2 <= len(array) <= MOST_MICROPHONES:
        return None
    inside = [span for span in spans_s if span[1] > walk.stamps_s[0] and span[0] < walk.stamps_s[-1]]
    heard = [one for span in _spread(inside) if (one := _Heard.of(track, array, walk, span)) is not None]
    if len(heard) < _FEWEST_SOUNDS:
        return None
    own, orders = tuple(range(len(array))), _orders(len(array))
    fits = {order: np.array([one.fit(order) for one in heard]) for order in orders}
    best = max(orders, key=lambda order: float(fits[order].sum()))
    signs = signs_of([one.steered for one in heard], SourceSettings.of(len(own))) if len(own) > 2 else np.ones(2)
    taken_back = np.array([one.fit(own, signs) for one in heard])
    if (signs < 0.0).any() and taken_back.sum() > fits[best].sum() and _is_better(taken_back, fits[own]):
        turned = tuple(np.flatnonzero(signs < 0.0).tolist())
        return Wiring(own, turned, float(fits[own].mean()), float(taken_back.mean()), len(heard))
    if _is_better(fits[best], fits[own]):
        alike = [order for order in orders if order == best or not _is_better(fits[best], fits[order])]
        best = min(alike, key=lambda order: (_moved(order), -float(fits[order].mean())))
    else:
        best = own
    return Wiring(best, (), float(fits[own].mean()), float(fits[best].mean()), len(heard))


def _moved(order: Order) -> int:
    return sum(channel != microphone for channel, microphone in enumerate(order))


def _is_better(one: Float[np.ndarray, " s"], other: Float[np.ndarray, " s"], tried: int = 24) -> bool:
    from scipy.special import stdtrit

    more = np.log(np.maximum(one, _LEAST)) - np.log(np.maximum(other, _LEAST))
    errors = float(more.mean() / (more.std(ddof=1) / np.sqrt(len(more)) + 1e-3))
    growth = float(one.mean() / max(other.mean(), _LEAST))
    if one.mean() < _POOR or errors < _STANDARD_ERRORS:
        return False
    return growth > _MUCH or (growth > _LITTLE and errors > float(stdtrit(len(more) - 1, 1.0 - _IMPROBABLE / tried)))


def _spread(spans_s: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    at = np.unique(np.linspace(0, len(spans_s) - 1, min(len(spans_s), _MOST_SOUNDS)).round().astype(int))
    return [spans_s[number] for number in at.tolist()] if len(spans_s) else []


def _orders(count: int) -> list[Order]:
    own = tuple(range(count))
    if count <= _MOST_ORDERED:
        return list(itertools.permutations(own))
    rings = [own[turn:] + own[:turn] for turn in own]
    exchanges = [
        tuple({one: other, other: one}.get(channel, channel) for channel in own)
        for one, other in itertools.combinations(own, 2)
    ]
    return list(dict.fromkeys([*rings, *(ring[::-1] for ring in rings), *exchanges]))


@dataclass(frozen=True, eq=False)
class _Heard:
    """One sound: how well each pair of channels fits each pair of microphones, over places round the robot."""

    found: Correlations  # the correlations
    # sums over the frames of the correlation of a pair of channels, at the delays of a pair of microphones and a place;
    # as a share of the greatest possible
    fits: Float[np.ndarray, "p m m c"]

    @classmethod
    def of(
        cls, track: AudioTrack, array: Microphones, walk: Trajectory, span_s: tuple[float, float]
    ) -> "_Heard | None":
        found = loudest_of_sound(
            track, array, walk, span_s, longest_s=_LONGEST_S, most=_MOST_FRAMES, smoothing=_SMOOTHING
        )
        if len(found.at_s) < _LEAST_FRAMES:
            return None
        poses = walk.at(found.at_s)
        ear = array.in_world_m(poses)
        place = _places(ear, poses @ array.camera_from_robot)
        return cls(found, _pair_fits(found, ear, place))

    @property
    def steered(self) -> tuple[Correlations, Float[np.ndarray, "p c"]]:
        one, other = self.found.pair.T
        return self.found, self.fits[np.arange(len(one)), one, other] * _greatest(self.found)

    def fit(self, order: Order, signs: Float[np.ndarray, " m"] | None = None) -> float:
        pair = self.found.pair
        one, other = np.array(order)[pair].T
        chosen = self.fits[np.arange(len(pair)), one, other]
        if signs is not None:
            chosen = chosen * (signs[pair[:, 0]] * signs[pair[:, 1]])[:, None]
        return float(chosen.sum(axis=0).max())


def _greatest(found: Correlations) -> float:
    return max(float(found.weight.sum()) * len(found.pair), 1e-9)


def _places(ear: Float[np.ndarray, "f m 3"], world_from_robot: Float[np.ndarray, "f 4 4"]) -> Float[np.ndarray, "c 3"]:
    up = world_from_robot[:, :3, 2].mean(axis=0)
    azimuth = 2.0 * np.pi * np.arange(_AZIMUTHS) / _AZIMUTHS
    flat = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    rings = [np.column_stack([flat * away, np.full(_AZIMUTHS, over)]) for away in _AWAY_M for over in _OVER_EAR_M]
    back = from_rotation(rotation_to_level(up / np.linalg.norm(up)).T, ear.mean(axis=(0, 1)))
    return apply(back, np.concatenate(rings))


def _pair_fits(
    found: Correlations, ear: Float[np.ndarray, "f m 3"], place: Float[np.ndarray, "c 3"]
) -> Float[np.ndarray, "p m m c"]:
    count = ear.shape[1]
    total = np.zeros((len(found.pair), count, count, len(place)), np.float32)
    for curve, ears in zip(found.curve, ear, strict=True):
        away = np.linalg.norm(place[None] - ears[:, None], axis=2) / (SPEED_M_S * found.step_s)
        for one, other in itertools.permutations(range(count), 2):
            at = away[one] - away[other] - found.first_s / found.step_s
            total[:, one, other] += at_delay(curve, at.astype(np.float32))
    return total / _greatest(found)
