"""How alike two microphones are at each delay, and what that says of a place: GCC-PHAT of short frames, steered.

The phase of each bin counts alike, as in PHAT (Knapp and Carter 1976), times a weight in [0, 1]: what is new in the
frame (power above the decay of what came before, by the precedence of the direct sound) and above the noise. With
phases that differ from the true ones by von Mises noise, the log-likelihood of a source is the sum over frames, pairs
and bins of weight times cosine at the delays of its place (SRP-PHAT, DiBiase 2000), times a concentration. A single
microphone says by how its level changes along the walk: 20 dB less for ten times the distance, down to the reverberant
field.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.columns import take
from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels
from avlmaps.recordings.microphones import Microphones

FRAME_S = 0.064
HOP_S = 0.032
SPEED_M_S = 343.0
_LOW_HZ, _HIGH_HZ = 200.0, 3000.0  # above, arrays of 0.2 m are ambiguous, and cells too coarse
_OVERSAMPLING = 4
_DECAY_DB_PER_S = 120.0  # of rooms that fall by 60 dB in half a second


@dataclass(frozen=True, slots=True)
class Correlations:
    """The frames of a sound, each with the correlation of every pair of microphones."""

    at_s: Float[np.ndarray, " f"]  # middle of each frame, the recording's time
    pair: Int[np.ndarray, "p 2"]  # of channels
    # sum over the bins of weight times cosine, at delays of ``first + i·step`` seconds: by how much the first channel
    # is later than the second
    curve: Float32[np.ndarray, "f p l"]
    first_s: float  # delay of the first
    step_s: float  # between two
    weight: Float[np.ndarray, " f"]  # sum of the bins' weights: how many bins count

    def take(self, frames: Int[np.ndarray, " k"]) -> "Correlations":
        """Return some of the frames."""
        return take(self, frames)

    def turned(self, signs: Float[np.ndarray, " m"]) -> "Correlations":
        """Return the same with the signs of some channels turned."""
        both = (signs[self.pair[:, 0]] * signs[self.pair[:, 1]]).astype(np.float32)
        return replace(self, curve=self.curve * both[:, None])

    def smoothed(self, steps: float) -> "Correlations":
        """Return the same with its curves smoothed over the delay by a Gaussian of that many steps."""
        from scipy.ndimage import gaussian_filter1d

        return replace(self, curve=gaussian_filter1d(self.curve, steps, axis=2)) if steps > 0.0 else self


def spectra(samples: Float[np.ndarray, "m n"], rate_hz: int) -> np.ndarray:
    """Return the short-time spectra (m, frames, bins) of channels, Hann windows of ``FRAME_S`` every ``HOP_S``."""
    size, hop = round(FRAME_S * rate_hz), round(HOP_S * rate_hz)
    if samples.shape[1] < size:
        samples = np.pad(samples, ((0, 0), (0, size - samples.shape[1])))
    frames = np.lib.stride_tricks.sliding_window_view(samples, size, axis=1)[:, ::hop]
    return np.fft.rfft(frames * np.hanning(size).astype(np.float32), axis=2)


def direct_weight(power: Float[np.ndarray, "f b"], noise: Float[np.ndarray, " b"]) -> Float[np.ndarray, "f b"]:
    """Return how much of each bin's power is new and no noise, in [0, 1]."""
    fade = 10.0 ** (-_DECAY_DB_PER_S * HOP_S / 10.0)
    left = np.zeros_like(power)
    for number in range(1, len(power)):
        left[number] = np.maximum(power[number - 1], left[number - 1]) * fade
    fresh = np.clip(1.0 - left / np.maximum(power, 1e-30), 0.0, 1.0) * (power > 0.0)
    return fresh * np.clip(1.0 - 2.0 * noise / np.maximum(power, 1e-30), 0.0, 1.0)


def correlate(
    samples: Float[np.ndarray, "m n"],
    rate_hz: int,
    start_s: float,
    quiet_s: float,
    longest_m: float,
    delay_s: Float[np.ndarray, " m"] | None = None,
    high_hz: float = _HIGH_HZ,
) -> Correlations:
    """Correlate every pair of channels in short frames.

    The first ``quiet_s`` of the samples, which begin at ``start_s``, are before the sound: its noise. ``longest_m`` is
    the distance of the farthest two microphones; by ``delay_s`` each channel is late, which is taken back.
    """
    spectrum = spectra(samples, rate_hz)
    size = round(FRAME_S * rate_hz)
    hz = np.fft.rfftfreq(size, 1.0 / rate_hz)
    band = (hz >= _LOW_HZ) & (hz <= min(high_hz, 0.45 * rate_hz))
    power = (np.abs(spectrum[..., band]) ** 2).mean(axis=0).astype(np.float64)
    before = max(int((quiet_s - FRAME_S) / HOP_S), 0)
    noise = np.quantile(power[: max(before, 1)], 0.5, axis=0) if before else np.quantile(power, 0.05, axis=0) * 0.5
    weight = direct_weight(power, noise)
    weight[:before] = 0.0
    pair = np.array(list(itertools.combinations(range(len(samples)), 2)), np.int64).reshape(-1, 2)
    padded = size * _OVERSAMPLING
    reach = int(np.ceil((longest_m / SPEED_M_S * rate_hz + 1.0) * _OVERSAMPLING))
    curve = np.zeros((len(power), len(pair), 2 * reach + 1), np.float32)
    unit = np.zeros((len(samples), len(power), padded // 2 + 1), np.complex64)
    late = np.zeros(len(samples)) if delay_s is None else delay_s
    early = 2.0 * np.pi * late[:, None, None] * hz[band]
    unit[..., : len(hz)][..., band] = np.exp(1j * (np.angle(spectrum[..., band]) + early))
    full = np.zeros((len(power), padded // 2 + 1), np.float32)
    full[:, : len(hz)][:, band] = weight
    for number, (one, other) in enumerate(pair):
        found = np.fft.irfft(unit[one] * unit[other].conj() * full, padded, axis=1) * (padded / 2)
        curve[:, number] = np.concatenate([found[:, -reach:], found[:, : reach + 1]], axis=1)
    at_s = start_s + np.arange(len(power)) * HOP_S + FRAME_S / 2
    step_s = 1.0 / (rate_hz * _OVERSAMPLING)
    return Correlations(at_s, pair, curve, -reach * step_s, step_s, weight.sum(axis=1))


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """From correlations to probabilities."""

    # how much a steered sum counts, after it was divided by its greatest possible value to the power ``saturation``:
    # bins of neighbouring frames repeat one another
    concentration: float = 9.0
    saturation: float = 0.7
    smoothing: float = 5.0  # of the correlations, in steps of their delay: half a cell of the candidates
    level_noise_db: float = 8.0  # by how much a sound's own loudness changes while it sounds (one microphone)
    reverberant_m: float = 0.6  # where rooms return as much sound as comes straight (one microphone)
    hidden: float = 1.5  # log-odds against a place behind a wall
    reach_m: float = 2.5  # distance from the robot by which a place becomes e times less likely
    # standard deviations of the errors of place that most and some events have
    blur_m: tuple[float, float] = (0.075, 0.35)
    wide: float = 0.15  # share of those of the second
    astray: float = 0.03  # share of the events whose evidence says nothing

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


MOST_FRAMES = 150
_BEFORE_S = 1.0  # of a sound, by which its noise is known


def loudest_frames(found: Correlations, most: int = MOST_FRAMES) -> Int[np.ndarray, " k"]:
    """Return the frames that say most, in the order of time."""
    useful = np.flatnonzero(found.weight > 0.0)
    return np.sort(useful[np.argsort(-found.weight[useful], kind="stable")[:most]])


def loudest_of_sound(
    track: AudioTrack,
    microphones: Microphones,
    walk: Trajectory,
    span_s: tuple[float, float],
    *,
    longest_s: float,
    most: int,
    smoothing: float,
) -> Correlations:
    """Return the frames of a sound that say most of those at which the robot's place is known; perhaps none.

    At most ``longest_s`` of the sound are read, and ``most`` frames chosen; ``smoothing`` of their curves is in steps.
    """
    onset_s, offset_s = span_s
    begin_s = max(onset_s - _BEFORE_S, track.start_s)
    sound = read_channels(track, begin_s, min(offset_s, onset_s + longest_s))
    found = correlate(
        sound.samples, sound.rate_hz, begin_s, onset_s - begin_s, microphones.longest_m, microphones.delay_s
    )
    found = found.take(np.flatnonzero((found.at_s >= walk.stamps_s[0]) & (found.at_s <= walk.stamps_s[-1])))
    return found.take(loudest_frames(found, most)).smoothed(smoothing)


def steer(
    found: Correlations, ear_m: Float[np.ndarray, "f m 3"], place_m: Float[np.ndarray, "c 3"]
) -> Float[np.ndarray, " c"]:
    """Return the sum over frames and pairs of the correlation at the delays of each place; see ``steer_pairs``."""
    return steer_pairs(found, ear_m, place_m).sum(axis=0)


def steer_pairs(
    found: Correlations, ear_m: Float[np.ndarray, "f m 3"], place_m: Float[np.ndarray, "c 3"]
) -> Float[np.ndarray, "p c"]:
    """Return for each pair the sum over frames of the correlation at the delays of each place.

    ``ear_m`` is where the microphones were in each frame, ``place_m`` where the sound seems to come from, in one frame
    of reference.
    """
    total = np.zeros((len(found.pair), len(place_m)), np.float32)
    place = np.ascontiguousarray(place_m.T, np.float32)
    scale = np.float32(1.0 / (SPEED_M_S * found.step_s))
    first = np.float32(found.first_s / found.step_s)
    for curve, ears in zip(found.curve, ear_m.astype(np.float32), strict=True):
        away = np.stack([
            np.sqrt((place[0] - x) ** 2 + (place[1] - y) ** 2 + (place[2] - z) ** 2) for x, y, z in ears
        ]) * scale  # fmt: skip
        for number, (one, other) in enumerate(found.pair):
            total[number] += at_delay(curve[number], away[one] - away[other] - first)
    return total.astype(np.float64)


def at_delay(curve: Float32[np.ndarray, "*p l"], at: Float32[np.ndarray, " c"]) -> Float32[np.ndarray, "*p c"]:
    """Return curves between their steps; ``at`` is in steps from the first."""
    whole = np.clip(at.astype(np.int32), 0, curve.shape[-1] - 2)
    part = at - whole.astype(np.float32)
    return curve[..., whole] * (1.0 - part) + curve[..., whole + 1] * part


_WINDOW_S = 0.3
_LOUD = 0.9
_LEVEL_LOW_HZ, _LEVEL_HIGH_HZ = 300.0, 6000.0
_ABOVE_NOISE = 4.0
_NEAREST_M = 0.3


def levels_db(
    samples: Float[np.ndarray, " n"], rate_hz: int, start_s: float, quiet_s: float
) -> tuple[Float[np.ndarray, " w"], Float[np.ndarray, " w"]]:
    """Return times and levels of the loud frames of a sound, one for each ``_WINDOW_S`` in which it stands out.

    The first ``quiet_s`` of the samples, which begin at ``start_s``, are before the sound.
    """
    spectrum = spectra(samples[None], rate_hz)[0]
    hz = np.linspace(0.0, rate_hz / 2.0, spectrum.shape[1])
    power = (np.abs(spectrum[:, (hz > _LEVEL_LOW_HZ) & (hz < _LEVEL_HIGH_HZ)]) ** 2).sum(axis=1).astype(np.float64)
    before = max(int(quiet_s / HOP_S) - 1, 0)
    noise = float(np.median(power[:before])) if before else 0.0
    at_s = start_s + (np.arange(len(power)) + 1) * HOP_S
    window = ((at_s - start_s - quiet_s) / _WINDOW_S).astype(int)
    heard = (np.arange(len(power)) >= before) & (power > _ABOVE_NOISE * noise) & (power > 0.0)
    numbers = [number for number in np.unique(window[heard]).tolist() if (heard & (window == number)).sum() > 1]
    within = [heard & (window == number) for number in numbers]
    times = np.array([at_s[inside].mean() for inside in within])
    return times, np.array([10.0 * np.log10(np.quantile(power[inside], _LOUD)) for inside in within])


def unknown_offset(
    measured_db: Float[np.ndarray, " k"],
    distance_m: Float[np.ndarray, "k c"],
    noise_db: float,
    reverberant_m: float = np.inf,
) -> Float[np.ndarray, " c"]:
    """Return the log-likelihood of each place by levels, or ratios of direct to reverberant sound, measured at others.

    The loudness is integrated out. Distances are from each measurement to each candidate; at ``reverberant_m`` a level
    is that of the reverberant field, inf for ratios.
    """
    against_1_m_db = 10.0 * np.log10(1.0 / np.maximum(distance_m, _NEAREST_M) ** 2 + 1.0 / reverberant_m**2)
    rest = measured_db[:, None] - against_1_m_db
    return -0.5 * ((rest - rest.mean(axis=0)) ** 2).sum(axis=0) / noise_db**2


MOST_MICROPHONES = 8  # more choices than can be tried beyond
_RARE = 2.4  # log-odds against a turned channel
_MOST_SOUNDS, _MOST_FRAMES, _MOST_PLACES, _LONGEST_S = 6, 40, 4000, 5.0


def signs_of(
    steered: Sequence[tuple[Correlations, Float[np.ndarray, "p c"]]], settings: SourceSettings
) -> Float[np.ndarray, " m"]:
    """Return 1 or -1 for each channel; 1 for all where nothing speaks clearly for another choice.

    ``steered`` is, for each sound, its correlations, and the steered sum of each pair at each candidate.
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
