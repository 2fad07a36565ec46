"""Evidence of a device that says directions itself: azimuths, with an offset that nobody knows and with outliers.

An azimuth is that of the source plus the device's constant offset plus von Mises noise, or, with the share of outliers,
anything. Offset, noise and share are those of the device, the same for all sounds: each sound gives each combination a
likelihood (its place summed out), and their product over the sounds is what is known of the device. The evidence of one
sound is the mean over the combinations by what the other sounds say of them. So where the drive does not determine the
offset, the regions are as wide as that makes them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.candidates import CandidateGrid, Candidates, Legs, Walls
from avlmaps.maps.sources.correlation import SourceSettings
from avlmaps.recordings.microphones import DirectionTrack

_BINS = 120  # of 3 degrees: residuals of angles, and offsets
_SPREADS_DEG, _OUTLIERS = (6.0, 12.0, 25.0), (0.05, 0.2, 0.5)
_ELEVATION_DEG = 15.0
_INDEPENDENT_S = 0.25  # directions that follow sooner repeat one another
_MOST = 120  # of a sound
_STEEP = 0.9  # a camera that looks up or down like this heads where its picture's top is
_LEAST_WEIGHT = 1e-3
_SURE_DEG = 15.0
_MOUNTED_DEG, _REMOUNTED = 3.0, 0.05  # between two recordings it moves a little, or was mounted again
_ASTRAY = 0.2  # share of the sounds that say nothing of the device

_GRID = tuple(product(_SPREADS_DEG, _OUTLIERS))


@dataclass(frozen=True, slots=True)
class Device:
    """What is known of a device that says directions."""

    offset_rad: float  # by how much its azimuths are too great, in (-pi, pi]
    offset_sd_rad: float  # circular standard deviation of that
    outliers: float  # share of its azimuths that say nothing
    sounds: int  # that it was found by

    @property
    def row(self) -> Float[np.ndarray, "4"]:
        """The four numbers, in this order."""
        return np.array([self.offset_rad, self.offset_sd_rad, self.outliers, float(self.sounds)])

    @classmethod
    def of(cls, row: Float[np.ndarray, "4"]) -> "Device":
        """Return the device of a row."""
        offset_rad, offset_sd_rad, outliers, sounds = row.tolist()
        return cls(offset_rad, offset_sd_rad, outliers, int(sounds))

    @property
    def sentence(self) -> str:
        """What a person should know of it."""
        offset, spread = np.rad2deg([self.offset_rad, self.offset_sd_rad])
        if spread > _SURE_DEG:
            return (
                f"The offset of the device that says directions is not determined by {self.sounds} sound(s) (one "
                f"standard deviation is {spread:.0f} degrees), so that its directions say little; let the robot drive "
                "past sounds."
            )
        return (
            f"The directions are {offset:+.0f} degrees off ({spread:.0f} degrees of doubt, {self.outliers:.0%} "
            f"outliers), found by {self.sounds} sound(s) along the drive; this is taken back."
        )


@dataclass(frozen=True, slots=True, eq=False)
class Bearings:
    """The directions that were said while one sound lasted."""

    said: DirectionTrack
    weight: Float[np.ndarray, " k"]  # how much each counts
    ear_m: Float[np.ndarray, "k 3"]  # where the device was, level frame
    heading_rad: Float[np.ndarray, " k"]  # where the camera looked on the plan

    @classmethod
    def of(cls, track: DirectionTrack, walk: Trajectory, span_s: tuple[float, float]) -> "Bearings":
        """Return those of a sound."""
        said = track.between(*span_s)
        inside = np.flatnonzero((said.stamp_s >= walk.stamps_s[0]) & (said.stamp_s <= walk.stamps_s[-1]))
        if len(inside) > _MOST:
            inside = inside[np.linspace(0, len(inside) - 1, _MOST).round().astype(int)]
        said = DirectionTrack(
            said.stamp_s[inside], said.azimuth_rad[inside], said.elevation_rad[inside], said.confidence[inside]
        )
        pace_s = float(np.median(np.diff(said.stamp_s))) if len(said) > 1 else _INDEPENDENT_S
        pose = walk.at(said.stamp_s) if len(said) else np.zeros((0, 4, 4))
        ahead = np.where(np.abs(pose[:, 2:3, 2]) > _STEEP, -pose[:, :3, 1], pose[:, :3, 2])
        heading = np.arctan2(ahead[:, 1], ahead[:, 0])
        return cls(said, said.confidence * min(1.0, pace_s / _INDEPENDENT_S), pose[:, :3, 3], heading)

    def __len__(self) -> int:
        return len(self.said)

    def residuals(self, place: Float[np.ndarray, "c 3"], walls: Walls) -> Float[np.ndarray, "c b"]:
        """Return, for each candidate, the weight of the azimuths by how much they are greater than its own."""
        total = np.zeros(len(place) * _BINS, np.float32)
        legs, row = Legs.of(self.ear_m, walls, place), np.arange(len(place)) * _BINS
        for own, gate in zip(legs.rows, legs.gate, strict=True):
            for number in own.tolist():
                away = gate - self.ear_m[number, :2]
                true = np.arctan2(away[:, 1], away[:, 0]) - self.heading_rad[number]
                step = np.rint((self.said.azimuth_rad[number] - true) * _BINS / (2.0 * np.pi)).astype(np.int64)
                total[row + step % _BINS] += np.float32(self.weight[number])
        return total.reshape(len(place), _BINS)

    def elevations(self, place: Float[np.ndarray, "c 3"]) -> Float[np.ndarray, " c"]:
        """Return the log-likelihood of the elevations that were said, against an elevation that says nothing."""
        total = np.zeros(len(place))
        spread = np.deg2rad(_ELEVATION_DEG)
        for number in np.flatnonzero(np.isfinite(self.said.elevation_rad)).tolist():
            away = place - self.ear_m[number]
            true = np.arctan2(away[:, 2], np.linalg.norm(away[:, :2], axis=1))
            off = (self.said.elevation_rad[number] - true) / spread
            density = 0.7 * np.exp(-0.5 * off**2) / (spread * np.sqrt(2.0 * np.pi)) + 0.3 / np.pi
            total += self.weight[number] * np.log(density)
        return total


def _log_density(spread_deg: float, outliers: float) -> Float[np.ndarray, "b o"]:
    kappa = 1.0 / np.deg2rad(spread_deg) ** 2
    angle = 2.0 * np.pi * np.arange(_BINS) / _BINS
    shape = np.exp(kappa * (np.cos(angle) - 1.0))
    density = (1.0 - outliers) * shape * _BINS / shape.sum() + outliers  # over the uniform one
    step = (np.arange(_BINS)[:, None] - np.arange(_BINS)[None]) % _BINS
    return np.log(density)[step].astype(np.float32)


def evidence_of_bearings(
    heard: Sequence[Bearings],
    walls: Sequence[Walls],
    candidates: Candidates,
    expected: Sequence[Float[np.ndarray, " c"]],
    known_rad: tuple[float, float] | None = None,
) -> tuple[list[Float[np.ndarray, " c"]], Device | None]:
    """Return the log-likelihood of each candidate for each sound, and what all say of the device, if they say anything.

    ``expected`` is the log-likelihood of each candidate without the sound, and ``known_rad`` the device's offset and
    its standard deviation, as an earlier recording has shown them.
    """
    place = candidates.place_m.astype(np.float64)
    # Azimuths depend on the plan alone: one candidate for each of its cells stands for those above and below it.
    _, some, cell = np.unique(CandidateGrid.of(place).cell, return_index=True, return_inverse=True)
    tables = [_log_density(*numbers) for numbers in _GRID]
    of_sound: list[Float[np.ndarray, "g o"]] = []
    elevations = [one.elevations(place) for one in heard]
    for one, between, likely, high in zip(heard, walls, expected, elevations, strict=True):
        if not len(one):
            of_sound.append(np.zeros((len(_GRID), _BINS)))
            continue
        share = candidates.prior * np.exp(likely - likely.max() + high - high.max())
        before = np.log(np.bincount(cell.reshape(-1), share) / share.sum() + 1e-300)
        counts = one.residuals(place[some], between)
        of_sound.append(np.stack([_log_sum(before[:, None] + counts @ table) for table in tables]))
    of_device = np.array([_bounded(own) for own in of_sound]).reshape(-1, len(_GRID), _BINS)
    known = of_device.sum(axis=0) + _known_before(known_rad)
    result: list[Float[np.ndarray, " c"]] = []
    for one, between, own, high in zip(heard, walls, of_device, elevations, strict=True):
        if not len(one):
            result.append(np.zeros(len(place)))
            continue
        weight = np.exp(known - own - (known - own).max())  # what the other sounds say
        weight /= weight.sum()
        counts = one.residuals(place, between)
        parts = np.full((0, len(place)), 0.0)
        for number, table in enumerate(tables):
            chosen = np.flatnonzero(weight[number] > _LEAST_WEIGHT * weight.max())
            if len(chosen):
                value = counts @ table[:, chosen] + np.log(weight[number, chosen])
                parts = np.concatenate([parts, _log_sum(value.T)[None]])
        result.append(_log_sum(parts) + high)
    sounds = int((np.ptp(of_device, axis=(1, 2)) > 0.0).sum())  # those of which no direction was said have all alike
    return result, _device(known, sounds) if sounds else None


def _known_before(known_rad: tuple[float, float] | None) -> Float[np.ndarray, " o"]:
    if known_rad is None:
        return np.zeros(_BINS)
    kappa = 1.0 / (known_rad[1] ** 2 + np.deg2rad(_MOUNTED_DEG) ** 2)
    share = np.exp(kappa * (np.cos(2.0 * np.pi * np.arange(_BINS) / _BINS - known_rad[0]) - 1.0))
    return np.log((1.0 - _REMOUNTED) * share / share.sum() + _REMOUNTED / _BINS)


def _bounded(own: Float[np.ndarray, "g o"]) -> Float[np.ndarray, "g o"]:
    share = np.exp(own - own.max())
    return np.log((1.0 - _ASTRAY) * share / share.mean() + _ASTRAY)


def _device(known: Float[np.ndarray, "g o"], sounds: int) -> Device:
    share = np.exp(known - known.max())
    share /= share.sum()
    angle = 2.0 * np.pi * np.arange(_BINS) / _BINS
    mean = complex((share.sum(axis=0) * np.exp(1j * angle)).sum())
    spread = np.sqrt(max(-2.0 * np.log(max(abs(mean), 1e-12)), 0.0))
    bin_rad = 2.0 * np.pi / _BINS / np.sqrt(12.0)
    outliers = float(sum(share[number].sum() * numbers[1] for number, numbers in enumerate(_GRID)))
    return Device(float(np.angle(mean)), float(np.hypot(spread, bin_rad)), outliers, sounds)


def _log_sum(value: Float[np.ndarray, "k n"]) -> Float[np.ndarray, " n"]:
    most = value.max(axis=0)
    return most + np.log(np.exp(value - most).sum(axis=0))


def expected_alone(
    walk: Trajectory, span_s: tuple[float, float], candidates: Candidates, walls: Walls, settings: SourceSettings
) -> Float[np.ndarray, " c"]:
    """Return the log-likelihood of each candidate by where the robot was, for a sound without known microphones."""
    at_s = np.clip(np.linspace(*span_s, 5), walk.stamps_s[0], walk.stamps_s[-1])
    return Legs.of(walk.at(at_s)[:, :3, 3], walls, candidates.place_m.astype(np.float64)).expected(settings)
