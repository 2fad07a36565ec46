"""Dense features of CLIP without training: what its last block says of each patch by itself.

CLIP (Radford et al., ICML 2021; MIT): ``openai/clip-vit-base-patch16`` and ``-base-patch32`` (512 numbers a feature),
``-large-patch14`` and ``-large-patch14-336`` (768), as transformers runs them (``CLIPModel``). CLIP compares a whole
picture with a text; its last attention gathers the picture into one token. Without it, each patch has a feature of its
own in the same space (MaskCLIP: Zhou et al., ECCV 2022). A picture goes in with CLIP's own mean and deviation, its
shorter side 448 pixels, its shape the same, with position embeddings interpolated to that grid (28x37 patches of 16
pixels for 640x480).

What the last block does, chosen by ``model#way``; then follow the final layer norm and the visual projection:

- ``value`` (default): value and output projection alone, without the residual and the MLP, which carry what CLIP
  needs for the whole picture and blur the patches;
- ``maskclip``: the same with the residual and the MLP, as MaskCLIP's code for vision transformers has it;
- ``neighbours``: without residual and MLP, too, but each patch takes the mean of its neighbours' values, by the
  likeness of their keys and a Gaussian of five patches (NACLIP: Hajimiri et al., WACV 2025).
"""

from typing import Any

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.device import inference, unit_rows
from avlmaps_models.common.picture_sizes import working_size
from avlmaps_models.common.prompts import CLIP_PROMPTS
from avlmaps_models.foundation.clip_tower import ClipTower
from avlmaps_models.foundation.open_pixels import OpenPixels
from avlmaps_models.foundation.pictures import split_model_way

_WAYS = ("value", "maskclip", "neighbours")
_BATCH_ON_GPU = 32
# NACLIP's standard deviation of the neighbourhood, patches.
_NEAR_PATCHES = 5.0


class ClipPatches(OpenPixels):
    """A feature for every patch of the working size, in the space of CLIP.

    Args:
        model: hub id or folder, behind ``#`` what the last block does.
        short_side: shorter side of the picture that the model sees, pixels.
    """

    def __init__(self, model: str = "openai/clip-vit-base-patch16", short_side: int = 448) -> None:
        name, way = split_model_way(model, _WAYS)
        self._clip = ClipTower(name)
        self._way, self._short_side = way, short_side
        card = ModelCard(
            id=self._clip.name + ("" if way == _WAYS[0] else f"#{way}"),
            dim=self._clip.dim,
            licence=self._clip.licence,
            checksum=self._clip.checksum(f"clip patches {way} short side {short_side}", *CLIP_PROMPTS),
            prompts=CLIP_PROMPTS,
            note="CLIP was trained on whole pictures: its patches are noisier than those of tipsv2",
        )
        super().__init__(card, self._clip.words, self._clip.logit_scale, _BATCH_ON_GPU)

    def _encode_pictures(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> Float32[np.ndarray, "b hf wf d"]:
        patch = self._clip.patch
        height, width = pictures[0].shape[:2]
        size = working_size(height, width, self._short_side, patch)
        grid = size[0] // patch, size[1] // patch
        with inference():
            tokens = _before_the_last(self._clip.vision, self._clip.pixels(pictures, size))
            tokens = _last_block(self._clip.vision.encoder.layers[-1], tokens, grid, self._way)
            patches = unit_rows(self._clip.projected(tokens[:, 1:]))
        return patches.reshape(len(pictures), *grid, -1)


def _before_the_last(vision: Any, pixels: torch.Tensor) -> torch.Tensor:
    """Return the input of a ``CLIPVisionModel``'s last block: class token and patches (b, 1 + n, d)."""
    hidden = vision.pre_layrnorm(vision.embeddings(pixels, interpolate_pos_encoding=True))
    for layer in vision.encoder.layers[:-1]:
        hidden = layer(hidden, None)
    return hidden


def _last_block(layer: Any, hidden: torch.Tensor, grid: tuple[int, int], way: str) -> torch.Tensor:
    """Return the tokens behind the last block, whose patches do not attend to the whole picture."""
    attention, normal = layer.self_attn, layer.layer_norm1(hidden)
    value = attention.v_proj(normal)
    if way == "neighbours":
        heads = (*value.shape[:2], attention.num_heads, attention.head_dim)
        key = attention.k_proj(normal).view(heads).transpose(1, 2)
        value = torch.nn.functional.scaled_dot_product_attention(
            key,
            key,
            value.view(heads).transpose(1, 2),
            attn_mask=_nearness(grid, hidden.device, hidden.dtype),
            scale=attention.scale,
        )
        value = value.transpose(1, 2).reshape(hidden.shape)
    own = attention.out_proj(value)
    if way != "maskclip":
        return own
    hidden = hidden + own
    return hidden + layer.mlp(layer.layer_norm2(hidden))


def _nearness(grid: tuple[int, int], device: torch.device, precision: torch.dtype) -> torch.Tensor:
    """Return the bias on the likeness of two patches: exp(−d² / (2σ²)), d in patches; 0 for the class token."""
    rows, columns = grid
    number = torch.arange(rows * columns, device=device)
    place = torch.stack([number // columns, number % columns], dim=1).to(torch.float32)
    squared = (place[:, None] - place[None]).square().sum(dim=-1)
    near = torch.zeros(1 + len(number), 1 + len(number), device=device)
    near[1:, 1:] = torch.exp(squared / (-2.0 * _NEAR_PATCHES**2))
    return near.to(precision)
