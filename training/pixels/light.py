"""Pictures as other cameras under other lights show them, drawn for a whole batch where the network is."""

import torch
import torch.nn.functional as functional
from torch import Tensor

# Share of colour pictures whose channels are shuffled: leaves are mostly green and basins white, but not always.
STRANGE_COLOURS = 0.1
# Shares of pictures that are blurred, and that get noise.
BLURRED, NOISY = 0.3, 0.5
_REACH = 3  # of the blur, pixels; its sigma is at most 1.2


def in_other_light(rgb: Tensor, kept: Tensor, multiple: int, generator: torch.Generator | None = None) -> Tensor:
    """Return what the network looks at: pictures in other light, zeros where colour is withheld and in the margin.

    Args:
        rgb: (n, h, w, 3) of 8 bit.
        kept: (n,) whether the picture has a colour.
        multiple: h and w are padded to multiples of this.
        generator: of the light, on the pictures' device.

    Returns:
        (n, 3, h', w') in about −1 to 1.
    """
    n, device = len(rgb), rgb.device

    def uniform(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(n, *shape, device=device, generator=generator)

    def normal(sigma: float, *shape: int) -> Tensor:
        return sigma * torch.randn(n, *shape, device=device, generator=generator)

    x = rgb.permute(0, 3, 1, 2).float() / 255.0
    order = torch.rand(n, 3, device=device, generator=generator).argsort(dim=1)
    order = torch.where(uniform(0, 1, 1) < STRANGE_COLOURS, order, torch.arange(3, device=device))
    x = x.gather(1, order[:, :, None, None].expand_as(x))
    grey = x.mean(dim=1, keepdim=True)
    x = grey + (x - grey) * uniform(0.0, 1.5, 1, 1, 1)
    gain = uniform(0.6, 1.4, 1, 1, 1) * normal(0.08, 3, 1, 1).exp()
    x = x.clamp_min(1e-6) ** normal(0.25, 1, 1, 1).exp() * gain
    x = _blurred(x, torch.where(uniform(0, 1) < BLURRED, uniform(0.4, 1.2), torch.full((n,), 0.05, device=device)))
    noise = torch.where(uniform(0, 1, 1, 1, 1) < NOISY, uniform(0.0, 0.06, 1, 1, 1), 0.0)
    x = x + noise * torch.randn(x.shape, device=device, generator=generator)
    x = (x.clamp(0.0, 1.2) * 2.0 - 1.0) * kept[:, None, None, None]
    return functional.pad(x, (0, -x.shape[3] % multiple, 0, -x.shape[2] % multiple))


def _blurred(x: Tensor, sigma_px: Tensor) -> Tensor:
    """Blur each picture by its own Gaussian."""
    n, channels, h, w = x.shape
    at = torch.arange(-_REACH, _REACH + 1, device=x.device)
    kernel = torch.exp(-0.5 * (at[None] / sigma_px[:, None]) ** 2)
    kernel = (kernel / kernel.sum(dim=1, keepdim=True)).repeat_interleave(channels, 0)[:, None]
    flat = functional.pad(x, (_REACH,) * 4, mode="replicate").reshape(1, n * channels, h + 2 * _REACH, w + 2 * _REACH)
    flat = functional.conv2d(flat, kernel[:, :, :, None], groups=n * channels)
    return functional.conv2d(flat, kernel[:, :, None, :], groups=n * channels).reshape(x.shape)
