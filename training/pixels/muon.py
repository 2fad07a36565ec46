"""Muon: steps along each layer's momentum made orthogonal, so that no direction learns faster than another.

The method is Keller Jordan's (2024); the size of a step follows Liu et al., "Muon is Scalable for LLM Training"
(2025), so that one learning rate serves this and AdamW. PyTorch's own ``torch.optim.Muon`` takes no convolutions.
"""

from collections import defaultdict
from collections.abc import Iterable

import torch
from torch import Tensor
from training.pixels.network import has_bfloat16

# Coefficients of the quintic iteration that takes singular values between 0 and 1 near 1 in five rounds.
_QUINTIC = (3.4445, -4.7750, 2.0315)
_ROUNDS = 5


def orthogonal(matrix: Tensor) -> Tensor:
    """Return about U Vᵀ of each matrix's U S Vᵀ, (..., m, n); singular values come out between about 0.7 and 1.2."""
    tall = matrix.shape[-2] > matrix.shape[-1]
    x = matrix.mT if tall else matrix
    x = x / (x.norm(dim=(-2, -1), keepdim=True) + 1e-7)
    if has_bfloat16(x.device):  # the iteration is crude by itself; half of the time goes into it otherwise
        x = x.bfloat16()
    a, b, c = _QUINTIC
    for _ in range(_ROUNDS):
        square = x @ x.mT
        x = a * x + (b * square + c * square @ square) @ x
    x = x.to(matrix.dtype)
    return x.mT if tall else x


class Muon(torch.optim.Optimizer):
    """Muon for weights of two or more dimensions; a convolution's kernel counts as one row for each output."""

    def __init__(self, params: Iterable[Tensor], lr: float, momentum: float = 0.95, weight_decay: float = 0.02) -> None:
        """Begin without momentum."""
        super().__init__(list(params), {"lr": lr, "momentum": momentum, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:
        """Take one step along the gradients that are there; kernels of one shape take it together."""
        for group in self.param_groups:
            alike: dict[torch.Size, list[Tensor]] = defaultdict(list)
            for weight in group["params"]:
                if weight.grad is not None:
                    alike[weight.shape].append(weight)
            for shape, weights in alike.items():
                gradients = torch.stack([weight.grad for weight in weights if weight.grad is not None])
                speeds = [self.state[weight].setdefault("momentum", torch.zeros_like(weight)) for weight in weights]
                torch._foreach_lerp_(speeds, list(gradients), 1.0 - group["momentum"])
                ahead = gradients.lerp(torch.stack(speeds), group["momentum"]).flatten(2)
                size = 0.2 * max(ahead.shape[1:]) ** 0.5
                torch._foreach_mul_(weights, 1.0 - group["lr"] * group["weight_decay"])
                steps = orthogonal(ahead).reshape(-1, *shape)
                torch._foreach_add_(weights, list(steps), alpha=-group["lr"] * size)
