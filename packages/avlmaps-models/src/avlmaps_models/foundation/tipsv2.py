"""Dense features of TIPSv2, whose patches were trained to agree with text (Cao et al., CVPR 2026; Apache-2.0).

Any of ``google/tipsv2-b14`` (768 numbers a feature), ``-l14`` (1024), ``-so400m14`` (1152) and ``-g14`` (1536), as
transformers runs them (``Tipsv2Model``; published code: google-deepmind/tips). A picture goes in as RGB in [0, 1] with
no mean or deviation taken out, its shorter side 448 pixels as its authors measure segmentation, its shape preserved:
640x480 gives 32x43 patches of 14 pixels, with position embeddings interpolated to that grid.

Two kinds of patch features, chosen by ``model#way``:

- ``values`` (default), with which the authors measure zero-shot segmentation: in the last block each patch takes its
own value instead of attending to others (MaskCLIP's idea); the block's residuals and its MLP stay;
- ``last``, the final patch tokens as the model returns them.

Both are compared with the text tower's mean over tokens. The two class tokens in front (the second is a register
token that learnt from synthetic captions) are left out.
"""

from typing import Any, Literal, cast

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import (
    inference,
    select_device,
    select_dtype,
    to_numpy,
    unit_rows,
)
from avlmaps_models.common.picture_sizes import working_size
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.prompts import TIPS_PROMPTS, Prompted
from avlmaps_models.common.texts import text_features
from avlmaps_models.foundation.open_pixels import OpenPixels
from avlmaps_models.foundation.pictures import split_model_way, stack_pictures

Way = Literal["values", "last"]
_WAYS: tuple[Way, ...] = ("values", "last")
_BATCH_ON_GPU = 16


class TipsPixels(OpenPixels):
    """A feature for every 14 x 14 pixels of the working size, in the space of TIPSv2's text encoder.

    Args:
        model: hub id or folder, behind ``#`` the kind of features.
        short_side: shorter side of the picture that the model sees, pixels.
    """

    def __init__(self, model: str = "google/tipsv2-b14", short_side: int = 448) -> None:
        from transformers import Tipsv2Model, Tipsv2Tokenizer

        name, way = split_model_way(model, _WAYS)
        folder = pretrained_folder(name)
        self._device = select_device()
        self._type = select_dtype(self._device)
        self._model: Any = load_pretrained(Tipsv2Model, folder, name, self._device, self._type)
        self._tokenizer = load_helper(Tipsv2Tokenizer, folder, name)
        self._way, self._short_side = cast(Way, way), short_side
        vision = self._model.config.vision_config
        self._patch, self._front = int(vision.patch_size), 1 + int(vision.num_register_tokens)
        self._most_tokens = int(self._model.config.text_config.max_position_embeddings)
        dim = int(vision.hidden_size)
        card = ModelCard(
            id=public_name(name) + ("" if way == _WAYS[0] else f"#{way}"),
            dim=dim,
            licence="Apache-2.0",
            checksum=checksum_of(weights_in(folder), f"tipsv2 {way} short side {short_side}", *TIPS_PROMPTS),
            prompts=TIPS_PROMPTS,
            note="a thing smaller than a patch (1/32 of the picture's height) is mixed with its surroundings",
        )
        words = Prompted(self._encode_texts, dim, TIPS_PROMPTS)
        super().__init__(card, words, 1.0 / float(self._model.temperature.detach()), _BATCH_ON_GPU)

    def _encode_pictures(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> Float32[np.ndarray, "b hf wf d"]:
        height, width = pictures[0].shape[:2]
        size = working_size(height, width, self._short_side, self._patch)
        with inference():
            pixels = stack_pictures(pictures, size, self._device, self._type)
            vision = self._model.vision_model
            tokens = _of_values(vision, pixels) if self._way == "values" else vision(pixels).last_hidden_state
            patches = unit_rows(tokens[:, self._front :])
        return patches.reshape(len(pictures), size[0] // self._patch, size[1] // self._patch, -1)

    def _encode_texts(self, texts: list[str]) -> Float32[np.ndarray, "n d"]:
        with inference():
            return to_numpy(text_features(self._model, self._tokenizer, texts, self._most_tokens))


def _of_values(vision: Any, pixels: torch.Tensor) -> torch.Tensor:
    """Return the normalised tokens (b, n, d) of a ``Tipsv2VisionModel`` whose last block attends to nothing."""
    *before, last = vision.encoder.layer
    hidden = vision.embeddings(pixels)
    for layer in before:
        hidden = layer(hidden)
    own = last.attention.o_proj(last.attention.v_proj(last.norm1(hidden)))
    hidden = hidden + last.layer_scale1(own)
    hidden = hidden + last.layer_scale2(last.mlp(last.norm2(hidden)))
    return vision.layernorm(hidden)
