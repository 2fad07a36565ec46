"""What is done to mel power while training: other places, microphones, distances and noises, new in every step.

Everything works on batches of normalised mel power (n, frames, bands), since sounds add up in power and rooms,
microphones and pitch are simple there; it costs a few milliseconds a batch and needs no audio.
"""

from dataclasses import dataclass

import torch
import torch.nn.functional as functional
from torch import Tensor

from avlmaps.perception.embedded import logmel

FRAMES, BANDS, FLOOR = logmel.WINDOW_FRAMES, logmel.BANDS, logmel.FLOOR


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How strongly.

    Attributes:
        stretch: largest change of speed, as a power of e.
        bands_shift: largest change of pitch, in mel bands.
        equaliser_db: standard deviation of a smooth random colour.
        reverberation: share of sounds that are put into a room.
        noisy: share of sounds that get background noise, at snr_db.
        snr_db: range of signal-to-noise ratios.
        trimmed: share of sounds of which only a loud piece is kept.
        masks: widths of the masks over bands and frames (SpecAugment; Park et al. 2019).
    """

    stretch: float = 0.2
    bands_shift: float = 2.5
    equaliser_db: float = 4.0
    reverberation: float = 0.3
    noisy: float = 0.6
    snr_db: tuple[float, float] = (-3.0, 30.0)
    trimmed: float = 0.3
    masks: tuple[int, int] = (8, 50)


def peak_normalised(power: Tensor) -> Tensor:
    """Scale each to a peak of one and put the floor under it, as ``logmel.normalised`` does."""
    return power / power.amax(dim=(1, 2), keepdim=True).clamp_min(1e-12) + FLOOR


def moved(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Change speed and pitch a little and move in time, all in one resampling of the logarithm."""
    n = len(power)

    def uniform(low: float, high: float) -> Tensor:
        return low + (high - low) * torch.rand(n, generator=generator)

    speed = torch.exp(uniform(-how.stretch, how.stretch))
    theta = torch.zeros(n, 2, 3)
    theta[:, 0, 0] = 1.0
    theta[:, 0, 2] = uniform(-how.bands_shift, how.bands_shift) * 2.0 / BANDS
    theta[:, 1, 1] = speed
    theta[:, 1, 2] = 0.0
    grid = functional.affine_grid(theta, [n, 1, FRAMES, BANDS], align_corners=False)
    log = functional.grid_sample(power.log()[:, None], grid, padding_mode="border", align_corners=False)[:, 0].exp()
    inside = grid[..., 1].abs().amax(dim=2, keepdim=True) <= 1.0
    log = torch.where(inside, log, torch.full_like(log, FLOOR))
    shift = torch.randint(0, FRAMES, (n,), generator=generator)
    index = (torch.arange(FRAMES)[None, :] + shift[:, None]) % FRAMES
    return torch.gather(log, 1, index[:, :, None].expand(-1, -1, BANDS))


def trimmed(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Keep only a piece around a loud frame of some sounds, as a segmented track gives them."""
    n = len(power)
    chosen = torch.rand(n, generator=generator) < how.trimmed
    loud = power.sum(dim=2).sqrt()
    centre = torch.multinomial(loud, 1, generator=generator)[:, 0]
    half = torch.exp(torch.empty(n).uniform_(3.0, 5.4, generator=generator)) / 2.0  # 20 to 220 frames
    distance = (torch.arange(FRAMES)[None, :] - centre[:, None]).abs()
    keep = (distance <= half[:, None]) | ~chosen[:, None]
    return torch.where(keep[:, :, None], power, torch.full_like(power, FLOOR))


def coloured(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Give each sound a smooth random frequency response."""
    knots = how.equaliser_db * torch.randn(len(power), 1, 6, generator=generator)
    curve = functional.interpolate(knots, size=BANDS, mode="linear", align_corners=True)
    return power * 10.0 ** (curve / 10.0)


def in_rooms(power: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Add an exponential tail to some sounds: one reverberation time of 0.2 to 1 s a batch, levels of their own."""
    chosen = torch.rand(len(power), generator=generator) < how.reverberation
    seconds = float(torch.empty(1).uniform_(0.2, 1.0, generator=generator))
    level = 10.0 ** torch.empty(int(chosen.sum())).uniform_(-2.0, -0.5, generator=generator)
    lag = (torch.arange(FRAMES)[:, None] - torch.arange(FRAMES)[None, :]).float() * logmel.HOP_SAMPLES / logmel.RATE_HZ
    tail = torch.exp(-13.8 * lag.clamp_min(0.0) / seconds) * (lag > 0)
    power = power.clone()
    power[chosen] += level[:, None, None] * (tail @ power[chosen])
    return power


def in_noise(power: Tensor, noise: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Add background at a random signal-to-noise ratio, measured where the sound is active."""
    n = len(power)
    level = power.sum(dim=2)
    active = level > 0.01 * level.amax(dim=1, keepdim=True)
    signal = (level * active).sum(dim=1) / active.sum(dim=1)
    low, high = how.snr_db
    snr_db = torch.empty(n).uniform_(low, high, generator=generator)
    chosen = (torch.rand(n, generator=generator) < how.noisy).float()
    gain = chosen * signal / noise.sum(dim=2).mean(dim=1) * 10.0 ** (-snr_db / 10.0)
    return power + gain[:, None, None] * noise


def heard(power: Tensor) -> Tensor:
    """Do what ``logmel.heard`` does, for a batch, in torch."""
    bands_first = power.transpose(1, 2)
    smooth = bands_first @ torch.from_numpy(logmel.smoothing_matrix())
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


def augmented(power: Tensor, noise: Tensor, how: Augmentation, generator: torch.Generator) -> Tensor:
    """Return what the network hears of a batch, each sound in new circumstances."""
    power = trimmed(moved(power, how, generator), how, generator)
    power = in_rooms(coloured(power, how, generator), how, generator)
    return masked(heard(peak_normalised(in_noise(power, noise, how, generator))), how, generator)
