"""DINOv2's vision transformer under the names of its own checkpoints (not transformers').

Oquab et al., "DINOv2: learning robust visual features without supervision", 2023; published code
facebookresearch/dinov2 (Apache-2.0). Models that were trained from it (MegaLoc, SALAD) keep its names: ``cls_token``,
``pos_embed``, ``patch_embed.proj``, ``blocks.N.{norm1,attn.qkv,attn.proj,ls1.gamma,norm2,mlp.fc1,mlp.fc2,ls2.gamma}``,
``norm``. All published sizes have heads 64 wide and an MLP whose width the checkpoint shows.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

from avlmaps_models.common.transformer import EPSILON, Block

# The published code makes the grid's scale a tenth of a patch larger, so that rounding never loses a row. It moves
# every interpolated embedding a little, and so belongs to the model.
_OFFSET = 0.1


@dataclass(frozen=True, slots=True)
class DinoSizes:
    """How large a transformer is.

    Attributes:
        width: of the residual stream.
        depth: number of blocks.
        hidden: width of a block's MLP.
        patch: edge of a patch, pixels.
        grid: patches along an edge of the square that its position embeddings were trained for.
    """

    width: int = 768
    depth: int = 12
    hidden: int = 3072
    patch: int = 14
    grid: int = 37

    @classmethod
    def of(cls, state: Mapping[str, torch.Tensor], prefix: str = "") -> "DinoSizes":
        """Return the sizes of the transformer whose weights are under a prefix.

        Raises:
            KeyError: there is none.
        """
        width, _, patch, _ = state[f"{prefix}patch_embed.proj.weight"].shape
        blocks = {key[len(prefix) :].split(".")[1] for key in state if key.startswith(f"{prefix}blocks.")}
        return cls(
            width=width,
            depth=len(blocks),
            hidden=state[f"{prefix}blocks.0.mlp.fc1.weight"].shape[0],
            patch=patch,
            grid=round((state[f"{prefix}pos_embed"].shape[1] - 1) ** 0.5),
        )


class DinoNetwork(nn.Module):
    """Pictures to the normalised tokens of the last block."""

    def __init__(self, sizes: DinoSizes) -> None:
        super().__init__()
        self.sizes = sizes
        self.cls_token = nn.Parameter(torch.zeros(1, 1, sizes.width))
        self.pos_embed = nn.Parameter(torch.zeros(1, 1 + sizes.grid**2, sizes.width))
        self.patch_embed = nn.Module()
        self.patch_embed.proj = nn.Conv2d(3, sizes.width, sizes.patch, stride=sizes.patch)
        self.blocks = nn.ModuleList(Block(sizes.width, sizes.hidden, scaled=True) for _ in range(sizes.depth))
        self.norm = nn.LayerNorm(sizes.width, eps=EPSILON)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return (n, 1 + rows·columns, width): the class token, then the patches row by row.

        Args:
            pictures: (n, 3, height, width), both sides multiples of a patch.
        """
        patches = self.patch_embed.proj(pictures)  # pyright: ignore[reportCallIssue]
        rows, columns = patches.shape[-2:]
        x = torch.cat([self.cls_token.expand(len(patches), -1, -1), patches.flatten(2).transpose(1, 2)], dim=1)
        x = x + self._places(rows, columns).to(x.dtype)
        for block in self.blocks:
            x = block(x)
        return self.norm(x)

    def _places(self, rows: int, columns: int) -> torch.Tensor:
        """Return the position embeddings of a grid."""
        grid = self.sizes.grid
        if rows == columns == grid:
            return self.pos_embed
        own = self.pos_embed[:, 1:].to(torch.float32).view(1, grid, grid, -1).permute(0, 3, 1, 2)
        scale = ((rows + _OFFSET) / grid, (columns + _OFFSET) / grid)
        wide = functional.interpolate(own, scale_factor=scale, mode="bicubic", align_corners=False)
        return torch.cat([self.pos_embed[:, :1], wide.permute(0, 2, 3, 1).flatten(1, 2)], dim=1)
