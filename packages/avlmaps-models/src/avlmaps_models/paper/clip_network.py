"""OpenAI's CLIP with a vision transformer, whole, under the names of its own checkpoints.

Radford et al., "Learning transferable visual models from natural language supervision", 2021; published at
https://github.com/openai/CLIP (MIT). The text tower's keys lie at the top, the image tower's below ``visual``. LSeg's
checkpoint holds a whole ViT-B/32 (width 768, 12 layers, patches of 32), areas are seen by ViT-L/14 (1024, 24, 14).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32, UInt8
from PIL import Image
from torch import nn

from avlmaps_models.paper.clip_text import ClipBlock, ClipTextSizes, ClipTextTower

MEAN = (0.48145466, 0.4578275, 0.40821073)
DEVIATION = (0.26862954, 0.26130258, 0.27577711)
NO_WEIGHTS = ("input_resolution", "context_length", "vocab_size")
"""Numbers that the scripted archives hold beside the weights; the weights' shapes say the same."""
_HEAD_WIDTH = 64  # in every published CLIP


@dataclass(frozen=True, slots=True)
class ClipSizes:
    """How large a CLIP is.

    Attributes:
        text: of its text tower.
        side: of the square picture that it sees, pixels.
        patch: side of a patch, pixels.
        width: of the image tower's residual stream.
        layers: blocks of the image tower.
    """

    text: ClipTextSizes
    side: int
    patch: int
    width: int
    layers: int

    @classmethod
    def of(cls, state: Mapping[str, torch.Tensor], prefix: str = "") -> "ClipSizes":
        """Return the sizes of the CLIP in a checkpoint whose keys for it begin with ``prefix``.

        Raises:
            KeyError: there is no CLIP with a vision transformer in it.
        """
        width, _, patch, _ = state[f"{prefix}visual.conv1.weight"].shape
        blocks = f"{prefix}visual.transformer.resblocks."
        patches = len(state[f"{prefix}visual.positional_embedding"]) - 1
        return cls(
            text=ClipTextSizes.of(state, prefix),
            side=patch * round(patches**0.5),
            patch=patch,
            width=width,
            layers=len({key.removeprefix(blocks).split(".")[0] for key in state if key.startswith(blocks)}),
        )


class _ImageTower(nn.Module):
    def __init__(self, sizes: ClipSizes) -> None:
        super().__init__()
        width, heads = sizes.width, max(1, sizes.width // _HEAD_WIDTH)
        self.conv1 = nn.Conv2d(3, width, sizes.patch, sizes.patch, bias=False)
        self.class_embedding = nn.Parameter(torch.zeros(width))
        self.positional_embedding = nn.Parameter(torch.zeros((sizes.side // sizes.patch) ** 2 + 1, width))
        self.ln_pre = nn.LayerNorm(width)
        self.transformer = nn.Module()
        blocks = (ClipBlock(width, heads, causal=False) for _ in range(sizes.layers))
        self.transformer.resblocks = nn.Sequential(*blocks)
        self.ln_post = nn.LayerNorm(width)
        self.proj = nn.Parameter(torch.zeros(width, sizes.text.dim))

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        patches = self.conv1(pictures).flatten(2).transpose(1, 2)
        first = self.class_embedding.expand(len(patches), 1, -1)
        x = self.ln_pre(torch.cat([first, patches], dim=1) + self.positional_embedding)
        x = self.transformer.resblocks(x)  # pyright: ignore[reportCallIssue]
        return self.ln_post(x[:, 0]) @ self.proj


class Clip(ClipTextTower):
    """Both towers. Called with tokens it returns texts' features; neither tower's features are normalised."""

    def __init__(self, sizes: ClipSizes) -> None:
        super().__init__(sizes.text)
        self.side = sizes.side
        self.visual: nn.Module = _ImageTower(sizes)
        self.logit_scale = nn.Parameter(torch.zeros(()))


def clip_picture(rgb: UInt8[np.ndarray, "h w 3"], side: int) -> Float32[np.ndarray, "3 side side"]:
    """Return a picture as CLIP was trained to see it: its middle square, normalised.

    The shorter side is resized to ``side`` pixels by Pillow's bicubic filter, as the published preprocessing does it;
    other libraries' bicubic filters give other numbers.
    """
    height, width = rgb.shape[:2]
    size = (side, max(side, side * height // width)) if width <= height else (max(side, side * width // height), side)
    resized = Image.fromarray(np.ascontiguousarray(rgb)).resize(size, Image.Resampling.BICUBIC)
    left, top = round((size[0] - side) / 2.0), round((size[1] - side) / 2.0)
    middle = np.asarray(resized.crop((left, top, left + side, top + side)), np.float32) / np.float32(255.0)
    normal = (middle - np.array(MEAN, np.float32)) / np.array(DEVIATION, np.float32)
    return np.ascontiguousarray(normal.transpose(2, 0, 1), np.float32)
