"""A block of a vision transformer under the names of timm's and DINOv2's checkpoints (transformers has others).

``norm1``, ``attn.qkv``, ``attn.proj``, ``ls1.gamma``, ``norm2``, ``mlp.fc1``, ``mlp.fc2``, ``ls2.gamma``; the scales
``ls1`` and ``ls2`` are DINOv2's alone. All published sizes have heads 64 wide (``HEAD_WIDTH``).
"""

import torch
from torch import nn
from torch.nn import functional

HEAD_WIDTH = 64
EPSILON = 1e-6


class Attention(nn.Module):
    """Attention of all tokens to all.

    Args:
        width: of a token.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.heads = max(1, width // HEAD_WIDTH)
        self.qkv = nn.Linear(width, 3 * width)
        self.proj = nn.Linear(width, width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (n, tokens, width) of the same."""
        n, count, width = x.shape
        query, key, value = self.qkv(x).view(n, count, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)
        seen = functional.scaled_dot_product_attention(query, key, value)
        return self.proj(seen.transpose(1, 2).reshape(n, count, width))


class Mlp(nn.Module):
    """Two layers for each token by itself.

    Args:
        width: of a token.
        hidden: between the layers.
    """

    def __init__(self, width: int, hidden: int) -> None:
        super().__init__()
        self.fc1 = nn.Linear(width, hidden)
        self.fc2 = nn.Linear(hidden, width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (n, tokens, width) of the same."""
        return self.fc2(functional.gelu(self.fc1(x)))


class Scale(nn.Module):
    """A learnt factor for each channel.

    Args:
        width: number of channels.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.gamma = nn.Parameter(torch.ones(width))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (n, tokens, width) of the same."""
        return x * self.gamma


class Block(nn.Module):
    """Attention and MLP, each behind a normalisation and added to what came in.

    Args:
        width: of a token.
        hidden: of the MLP.
        scaled: whether what is added is scaled first, channel by channel.
    """

    def __init__(self, width: int, hidden: int, scaled: bool) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(width, eps=EPSILON)
        self.attn = Attention(width)
        self.ls1 = Scale(width) if scaled else nn.Identity()
        self.norm2 = nn.LayerNorm(width, eps=EPSILON)
        self.mlp = Mlp(width, hidden)
        self.ls2 = Scale(width) if scaled else nn.Identity()

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (n, tokens, width) of the same."""
        x = x + self.ls1(self.attn(self.norm1(x)))
        return x + self.ls2(self.mlp(self.norm2(x)))
