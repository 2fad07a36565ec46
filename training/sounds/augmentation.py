"""Changes of mel power while training: other places, microphones, distances and noises, new in every step.

Everything works on batches of normalised mel power (n, frames, bands), since sounds add up in power and rooms,
microphones and pitch are simple there; it costs a few milliseconds a batch and needs no audio. Batches lie on torch's
default device.
"""

from dataclasses import dataclass
from functools import cache

import torch
import torch.nn.functional as functional
from torch import Tensor

from avlmaps.perception.embedded import logmel

FRAMES, BANDS, FLOOR = logmel.WINDOW_FRAMES, logmel.BANDS, logmel.FLOOR
# of the segmentation's settings: 2.5 dB; 0.05 s and 0.02 s in frames of 12 ms
RELEASE, SMOOTHED, PADDED = 10.0**0.25, 5, 2


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How strongly.

    Attributes:
        equaliser_db: standard deviation of a smooth random colour.
        reverberation: share of sounds that are put into a room.
        rt60_s: range of reverberation times, drawn evenly in the logarithm.
        distance_db: range of the direct sound's power over the tail's.
        narrow: share of sounds that lose everything above some band, as codecs and cheap microphones do.
        noisy: share of sounds that get background noise, at snr_db.
        snr_db: range of signal-to-noise ratios.
        segmented: share of sounds that end where they sink into that background, as a segmented track cuts them.
        trimmed: share of sounds that are cut to a loud piece.
        pieces: shortest and longest of these in frames, drawn evenly in the logarithm.
        masks: widths of the masks over bands and frames (SpecAugment; Park et al. 2019).
    """

    equaliser_db: float = 4.0
    reverberation: float = 0.5
    rt60_s: tuple[float, float] = (0.15, 1.3)
    distance_db: tuple[float, float] = (-18.0, 12.0)
    narrow: float = 0.15
    noisy: float = 0.6
    snr_db: tuple[float, float] = (-3.0, 30.0)
    segmented: float = 0.5
    trimmed: float = 0.35
    pieces: tuple[int, int] = (12, 220)
    masks: tuple[int, int] = (8, 50)


def peak_normalised(power: Tensor) -> Tensor:
    """Scale each to a peak of one and put the floor under it, as ``logmel.normalised`` does."""
    return power / power.amax(dim=(1, 2), keepdim=True).clamp_min(1e-12) + FLOOR


def trimmed(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Cut some sounds to a piece around a loud frame, as a segmented track gives them."""
    n = len(power)
    chosen = torch.rand(n, generator=generator) < how.trimmed
    loud = power.sum(dim=2).sqrt()
    centre = torch.multinomial(loud, 1, generator=generator)[:, 0]
    low, high = (float(torch.tensor(frames).log()) for frames in how.pieces)
    half = torch.empty(n).uniform_(low, high, generator=generator).exp() / 2.0
    distance = (torch.arange(FRAMES)[None, :] - centre[:, None]).abs()
    keep = (distance <= half[:, None]) | ~chosen[:, None]
    return torch.where(keep[:, :, None], power, torch.full_like(power, FLOOR))


def coloured(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Give each sound a smooth random frequency response; some lose their highest bands."""
    knots = how.equaliser_db * torch.randn(len(power), 1, 6, generator=generator)
    curve = functional.interpolate(knots, size=BANDS, mode="linear", align_corners=True)
    cut = torch.randint(BANDS // 2, BANDS, (len(power), 1, 1), generator=generator)
    chosen = torch.rand(len(power), 1, 1, generator=generator) < how.narrow
    lost = chosen & (torch.arange(BANDS)[None, None, :] >= cut)
    return power * 10.0 ** (curve / 10.0) * torch.where(lost, 1e-4, 1.0)


@cache
def _draws() -> Tensor:
    generator = torch.Generator(torch.get_default_device()).manual_seed(0)
    return 0.5 + 0.5 * torch.empty(64, FRAMES, BANDS).exponential_(generator=generator)


def fluctuations(count: int, generator: torch.Generator) -> Tensor:
    """Return how the power of noise fluctuates about one (count, frames, bands), from a bank: drawing again is slow."""
    bank = _draws()
    shift = int(torch.randint(FRAMES, (1,), generator=generator))
    return bank.roll(shift, dims=1)[torch.randint(len(bank), (count,), generator=generator)]


def steady_noise(count: int, generator: torch.Generator) -> Tensor:
    """Return mel power of noise of random colour: from falling by 25 dB over the bands to rising by 16 (white: 12)."""
    power = fluctuations(count, generator)
    tilt_db = 41.0 * torch.rand(count, 1, 1, generator=generator) - 25.0
    return power * 10.0 ** (tilt_db * torch.linspace(0.0, 1.0, BANDS) / 10.0)


def in_rooms(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Put some sounds into rooms: a diffuse tail that decays band by band, from beside the source to far behind it.

    A room's response in power is the direct sound and noise that decays exponentially, faster in high bands. At 4 m in
    a living room the tail holds 50 times the power of the direct sound; that ratio is drawn from ``distance_db``.
    """
    chosen = torch.rand(len(power), generator=generator) < how.reverberation
    count = int(chosen.sum())
    if not count:
        return power
    low, high = (float(torch.tensor(seconds).log()) for seconds in how.rt60_s)
    rt60_s = torch.empty(count, 1, 1).uniform_(low, high, generator=generator).exp()
    treble = torch.empty(count, 1, 1).uniform_(0.4, 1.1, generator=generator)
    rt60_s = rt60_s * (1.0 + (treble - 1.0) * torch.linspace(0.0, 1.0, BANDS))
    keep = torch.exp(-13.8 * logmel.HOP_SAMPLES / logmel.RATE_HZ / rt60_s)
    wet = (1.0 - keep) * power[chosen]
    for doubling in range(9):  # a first-order recursion over time as a scan: lags of 1, 2, 4 ... 256 frames
        lag = 2**doubling
        wet = torch.cat([wet[:, :lag], wet[:, lag:] + keep**lag * wet[:, :-lag]], dim=1)
    wet = wet * fluctuations(count, generator)
    direct_db = torch.empty(count, 1, 1).uniform_(*how.distance_db, generator=generator)
    power = power.clone()
    power[chosen] = 10.0 ** (direct_db / 10.0) * power[chosen] + wet
    return power


def in_noise(power: Tensor, noise: Tensor, how: Augmentation, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Add background at a random signal-to-noise ratio, measured where the sound is active.

    Returns:
        the sum, and the mean power of the background in every band (n, bands), zero where there is none.
    """
    n = len(power)
    level = power.sum(dim=2)
    active = level > 0.01 * level.amax(dim=1, keepdim=True)
    signal = (level * active).sum(dim=1) / active.sum(dim=1)
    low, high = how.snr_db
    snr_db = torch.empty(n).uniform_(low, high, generator=generator)
    chosen = (torch.rand(n, generator=generator) < how.noisy).float()
    gain = chosen * signal / noise.sum(dim=2).mean(dim=1) * 10.0 ** (-snr_db / 10.0)
    return power + gain[:, None, None] * noise, gain[:, None] * noise.mean(dim=1)


def segmented(power: Tensor, background: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Cut some sounds to where they stand out from their background, and leave silence around them.

    A map holds segments: the background ends a little after the sound does. The rule is that of
    ``avlmaps.maps.audio.segmentation``, without the joining of close runs: the first to the last frame whose mean
    excess over the bands passes ``release_db``, and ``padding_s`` on either side.

    Args:
        power: sounds in their background (n, frames, bands).
        background: its mean power in every band (n, bands); sounds without any stay whole.
        how: how many.
        generator: draws which.
    """
    chosen = (torch.rand(len(power), generator=generator) < how.segmented) & (background.sum(dim=1) > 0.0)
    excess = (power / background[:, None].clamp_min(1e-12)).mean(dim=2)
    smooth = functional.avg_pool1d(excess[:, None], SMOOTHED, stride=1, padding=SMOOTHED // 2)[:, 0]
    stands_out = (smooth > RELEASE).float()
    after_first = stands_out.cummax(dim=1).values
    before_last = stands_out.flip(1).cummax(dim=1).values.flip(1)
    within = functional.max_pool1d((after_first * before_last)[:, None], 2 * PADDED + 1, stride=1, padding=PADDED)[:, 0]
    whole = ~chosen | (within.amax(dim=1) == 0.0)
    return torch.where((whole[:, None] | (within > 0.0))[:, :, None], power, torch.zeros_like(power))


def in_circumstances(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Put some sounds into rooms and some into noise, and cut some of these as a map cuts them."""
    power = in_rooms(power, how, generator)
    power, background = in_noise(power, steady_noise(len(power), generator), how, generator)
    return peak_normalised(segmented(power, background, how, generator))


def heard(power: Tensor) -> Tensor:
    """Do what ``logmel.heard`` does, for a batch, in torch."""
    bands_first = power.transpose(1, 2).contiguous()
    smooth = bands_first @ torch.from_numpy(logmel.smoothing_matrix()).to(power.device)
    pcen = logmel.pcen(bands_first, smooth)
    log = torch.log10(bands_first + FLOOR)
    log = (log - log.mean(dim=(1, 2), keepdim=True)) / logmel.LOG_SCALE
    return torch.stack([pcen, log], dim=1)


def masked(features: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Set a strip of bands and a strip of frames to zero."""
    n = len(features)
    for axis, size, widest in ((2, BANDS, how.masks[0]), (3, FRAMES, how.masks[1])):
        width = torch.rand(n, generator=generator) * widest
        start = torch.rand(n, generator=generator) * (size - width)
        place = torch.arange(size)[None, :]
        keep = ((place < start[:, None]) | (place >= (start + width)[:, None])).float()
        features = features * keep.reshape(n, 1, *((size, 1) if axis == 2 else (1, size)))
    return features
