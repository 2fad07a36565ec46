"""The trainable front end of AudioCLIP: frames of a sound against complex frequency B-spline wavelets, in decibels.

Guzhov et al., "ESResNe(X)t-fbsp: Learning robust time-frequency transformation of audio", IJCNN 2021, and its
published code (https://github.com/AndreyGuzhov/AudioCLIP, MIT). Where that code depends on the order of float32
operations, the order here is the same: the phase of the highest wavelets reaches 3,200 radians, and silence is
decibels of rounding errors.

A sound is given as the published code wants it, in units of 16-bit samples at 44.1 kHz.
"""

import math
from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

RATE_HZ = 44_100
HOP_SAMPLES = 561
_LEAST_POWER = 1e-18  # stands for a power of zero; lesser ones stay
_EPSILON = 1e-8


class Fbsp(nn.Module):
    """One wavelet a frequency: √fb · sinc(fb·t / m)^m · exp(−i·fc·t) over t from −π to π.

    Attributes:
        m: order of each wavelet; 0 makes it a line of the Fourier transform.
        fb: bandwidth of each.
        fc: centre frequency of each, periods a frame.
    """

    def __init__(self, bins: int) -> None:
        super().__init__()
        self.m = nn.Parameter(torch.zeros(bins))
        self.fb = nn.Parameter(torch.ones(bins))
        self.fc = nn.Parameter(torch.arange(bins, dtype=torch.float32))

    def kernels(self) -> torch.Tensor:
        """Return the wavelets, real and imaginary parts (2, bins, 2·(bins − 1)), scaled by 1/√length, on the CPU."""
        length = 2 * (len(self.m) - 1)
        m, fb, fc = (value.detach().float().cpu()[:, None] for value in (self.m, self.fb, self.fc))
        t = math.pi * torch.linspace(-1.0, 1.0, length)[None] + _EPSILON
        x = fb * t / (m + _EPSILON)
        sinc = torch.where(x == 0, torch.ones_like(x), torch.sin(x) / x)
        # sinc to the power of m: a negative number has the phase π
        size, phase = ((sinc**2) ** 0.5) ** 2, m * torch.atan2(torch.zeros_like(sinc), sinc)
        size = size ** (0.5 * m)
        real, imaginary = size * phase.cos(), size * phase.sin()
        cosine, sine = torch.cos(fc * t), -torch.sin(fc * t)
        wavelets = torch.stack((real * cosine - imaginary * sine, real * sine + imaginary * cosine))
        return fb.sqrt() * wavelets / math.sqrt(length)


@dataclass(frozen=True)
class FrontEnd:
    """Turns samples into the picture of three bands that the network looks at, in float32 for every precision.

    Attributes:
        kernels: (2, bins, length) as ``Fbsp.kernels``.
        window: weight of each sample of a frame, at most as many as a wavelet has; the frame lies in its middle.
    """

    kernels: torch.Tensor
    window: torch.Tensor

    @classmethod
    def of(cls, fbsp: Fbsp, window: torch.Tensor, device: torch.device) -> "FrontEnd":
        """Return the front end of trained wavelets."""
        return cls(fbsp.kernels().to(device), window.detach().float().to(device))

    def __call__(self, samples: torch.Tensor) -> torch.Tensor:
        """Return decibels (n, 3, height, frames): low, middle and high third of the frequencies.

        Args:
            samples: (n, samples) in units of 16-bit samples, float32.
        """
        # from [−32768, 32767] to [−1, 1], so that silence is 1.5e-5
        level = (samples + 32768.0) * 2.0 / 65535.0 - 1.0
        around = self.kernels.shape[-1] - len(self.window)
        framed = frames(level, len(self.window)) * self.window
        framed = functional.pad(framed, (around // 2, around - around // 2))
        real, imaginary = (functional.linear(framed, part) for part in self.kernels)
        power = (real**2 + imaginary**2).transpose(1, 2)
        power = power[:, : power.shape[1] // 3 * 3]  # three bands leave the highest bins over
        power = torch.where(power > 0.0, power, torch.full_like(power, _LEAST_POWER))
        return 10.0 * torch.log10(power).unflatten(1, (3, -1))


def frames(signal: torch.Tensor, length: int, hop: int = HOP_SAMPLES) -> torch.Tensor:
    """Return overlapping frames (n, frames, length), zeros at both ends filling up the last one.

    Args:
        signal: (n, samples).
        length: of a frame.
        hop: between the beginnings of two frames.
    """
    count = 1 + max(0, math.ceil((signal.shape[-1] - length) / hop))
    lacking = (count - 1) * hop + length - signal.shape[-1]
    return functional.pad(signal, (lacking // 2, lacking - lacking // 2)).unfold(-1, length, hop)
