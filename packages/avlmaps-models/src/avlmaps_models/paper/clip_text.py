"""The text tower of OpenAI's CLIP under the names of its own checkpoints, and its tokens.

LSeg (CLIP ViT-B/32) and AudioCLIP (CLIP RN50) carry this tower inside their checkpoints. Radford et al., "Learning
transferable visual models from natural language supervision", 2021; published at https://github.com/openai/CLIP (MIT).
Sizes are those of the checkpoint: 49,408 tokens, context 77, width 512, 8 heads, 12 layers; the published dim is 512
(ViT-B/32) or 1024 (RN50).
"""

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

_HEAD_WIDTH = 64  # in every published CLIP


@dataclass(frozen=True, slots=True)
class ClipTextSizes:
    """How large a text tower is.

    Attributes:
        tokens: entries of the vocabulary, the start and end of a text among them.
        context: longest text, tokens.
        width: of the residual stream.
        layers: number of blocks.
        dim: length of a feature.
    """

    tokens: int = 49408
    context: int = 77
    width: int = 512
    layers: int = 12
    dim: int = 1024

    @property
    def heads(self) -> int:
        """Number of attention heads, each 64 wide; one in a tower that is narrower."""
        return max(1, self.width // _HEAD_WIDTH)

    @classmethod
    def of(cls, state: Mapping[str, torch.Tensor], prefix: str = "") -> "ClipTextSizes":
        """Return the sizes of the tower in a checkpoint whose keys for it begin with ``prefix``.

        Raises:
            KeyError: there is no such tower in it.
        """
        tokens, width = state[f"{prefix}token_embedding.weight"].shape
        blocks = {key for key in state if key.startswith(f"{prefix}transformer.resblocks.")}
        return cls(
            tokens=tokens,
            context=state[f"{prefix}positional_embedding"].shape[0],
            width=width,
            layers=len({key.removeprefix(prefix).split(".")[2] for key in blocks}),
            dim=state[f"{prefix}text_projection"].shape[1],
        )


class _Attention(nn.Module):
    """Self-attention; a causal one lets a token see itself and those before it only."""

    def __init__(self, width: int, heads: int, causal: bool) -> None:
        super().__init__()
        self.heads, self.causal = heads, causal
        self.in_proj_weight = nn.Parameter(torch.zeros(3 * width, width))
        self.in_proj_bias = nn.Parameter(torch.zeros(3 * width))
        self.out_proj = nn.Linear(width, width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        n, length, width = x.shape
        mixed = functional.linear(x, self.in_proj_weight, self.in_proj_bias)
        query, key, value = mixed.view(n, length, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)
        seen = functional.scaled_dot_product_attention(query, key, value, is_causal=self.causal)
        return self.out_proj(seen.transpose(1, 2).reshape(n, length, width))


class _QuickGelu(nn.Module):
    """CLIP's approximation of GELU, x·sigmoid(1.702 x)."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x * torch.sigmoid(1.702 * x)


class ClipBlock(nn.Module):
    """One layer of either tower: attention and two linear layers, each before its own residual."""

    def __init__(self, width: int, heads: int, causal: bool = True) -> None:
        super().__init__()
        self.attn = _Attention(width, heads, causal)
        self.ln_1 = nn.LayerNorm(width)
        self.mlp = nn.Sequential(
            OrderedDict(c_fc=nn.Linear(width, 4 * width), gelu=_QuickGelu(), c_proj=nn.Linear(4 * width, width))
        )
        self.ln_2 = nn.LayerNorm(width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (n, length, width) from the same."""
        x = x + self.attn(self.ln_1(x))
        return x + self.mlp(self.ln_2(x))


class ClipTextTower(nn.Module):
    """Tokens to one feature a text, not normalised."""

    def __init__(self, sizes: ClipTextSizes) -> None:
        super().__init__()
        self.sizes = sizes
        self.token_embedding = nn.Embedding(sizes.tokens, sizes.width)
        self.positional_embedding = nn.Parameter(torch.zeros(sizes.context, sizes.width))
        self.transformer = nn.Module()
        self.transformer.resblocks = nn.Sequential(*(ClipBlock(sizes.width, sizes.heads) for _ in range(sizes.layers)))
        self.ln_final = nn.LayerNorm(sizes.width)
        self.text_projection = nn.Parameter(torch.zeros(sizes.width, sizes.dim))

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Return (n, dim), each text's feature read off at its end token.

        Args:
            tokens: (n, length), length at most the context; what follows the end token does not matter, since no
                token sees those behind it.
        """
        x = self.token_embedding(tokens) + self.positional_embedding[: tokens.shape[1]]
        x = self.ln_final(self.transformer.resblocks(x))  # pyright: ignore[reportCallIssue]
        end = tokens.argmax(dim=-1)  # its number is the highest of all
        return x[torch.arange(len(x), device=x.device), end] @ self.text_projection


def padded(texts: Sequence[Sequence[int]]) -> torch.Tensor:
    """Return texts of tokens as one (n, longest) tensor, zeros behind the ends."""
    longest = max(map(len, texts))
    return torch.tensor([[*text, *[0] * (longest - len(text))] for text in texts], dtype=torch.long)
