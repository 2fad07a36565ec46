"""Fit the linear model on statistics of recorded clips, as they are and in rooms and noise."""

import numpy as np
import torch
from training.sounds.augmentation import (
    Augmentation,
    coloured,
    in_noise,
    in_rooms,
    peak_normalised,
    segmented,
    trimmed,
)
from training.sounds.clips import Examples
from training.sounds.fit import steady_noise
from training.sounds.kinds import RECORDED

from avlmaps.perception.embedded.sound_statistics import StatisticsModel, standardised, statistics

PENALTY = 0.3  # of the ridge regression, where a statistic has variance one
COPIES = 16  # of each clip, in rooms and noise, half of them short pieces
COPIES_SHARE = 0.5  # of a kind's weight
ELSEWHERE = Augmentation(
    trimmed=0.5, pieces=(15, 220), reverberation=0.7, equaliser_db=3.0, narrow=0.1, noisy=0.6, snr_db=(5.0, 30.0)
)
_BATCH = 64


def fit_statistics(examples: Examples, seed: int = 2) -> StatisticsModel:
    """Return the ridge regression of one-hot kinds on statistics, every kind weighing the same.

    Pitch, speed and length stay as they are: the statistics of a changed clip are those of another sound. The columns
    are all kinds that have recordings; those of which ``examples`` holds none are zero.
    """
    dry = statistics(examples.recorded)
    mean, deviation = dry.mean(axis=0), dry.std(axis=0) + 1e-6
    generator = torch.Generator().manual_seed(seed)
    torch.manual_seed(seed)  # the rooms are drawn from the common generator
    copies = [_elsewhere(examples.recorded, generator) for _ in range(COPIES)]
    values = standardised(np.concatenate([dry, *copies]), mean, deviation).astype(np.float64)
    kinds = np.tile(examples.recorded_kinds, 1 + COPIES)
    weight = np.repeat([1.0 - COPIES_SHARE, *[COPIES_SHARE / COPIES] * COPIES], len(dry))
    weight /= np.bincount(kinds, weights=weight, minlength=len(RECORDED))[kinds]
    weight /= weight.sum()
    target = (kinds[:, None] == np.arange(len(RECORDED))).astype(np.float64)
    middle, share = weight @ values, weight @ target
    free = values - middle
    weighted = free * weight[:, None]
    slopes = np.linalg.solve(weighted.T @ free + PENALTY * np.eye(values.shape[1]), weighted.T @ (target - share))
    offset = share - middle @ slopes
    return StatisticsModel(*(np.asarray(part, np.float32) for part in (mean, deviation, slopes, offset)))


def _elsewhere(mels: np.ndarray, generator: torch.Generator) -> np.ndarray:
    """Return the statistics of clips with another colour, half of them cut, most in a room, more than half in noise."""
    parts = []
    for at in range(0, len(mels), _BATCH):
        power = torch.from_numpy(mels[at : at + _BATCH]).float()
        power = coloured(trimmed(power, ELSEWHERE, generator), ELSEWHERE, generator)
        power = in_rooms(peak_normalised(power), ELSEWHERE, generator)
        power, background = in_noise(power, steady_noise(len(power), generator), ELSEWHERE, generator)
        parts.append(statistics(peak_normalised(segmented(power, background, ELSEWHERE, generator)).numpy()))
    return np.concatenate(parts)
