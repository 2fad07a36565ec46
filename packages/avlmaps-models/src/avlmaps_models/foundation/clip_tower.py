"""A CLIP of transformers as the pixel encoders use it: its picture tower, its words, its scale."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, UInt8

from avlmaps.perception.models import public_name
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import inference, select_device, select_dtype, to_numpy
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.prompts import CLIP_PROMPTS, Prompted
from avlmaps_models.common.texts import text_features
from avlmaps_models.foundation.open_views import licence_of
from avlmaps_models.foundation.pictures import Size, stack_pictures

# Of red, green and blue in [0, 1], as published with the weights.
_MEAN = (0.48145466, 0.4578275, 0.40821073)
_DEVIATION = (0.26862954, 0.26130258, 0.27577711)


class ClipTower:
    """A CLIP, loaded.

    Attributes:
        vision: the ``CLIPVisionModel``.
        words: features of words.
        name: what it is called in a map.
        dim: length of a feature.
        patch: edge of a patch, pixels.
        image_size: edge of the pictures that it was trained on, pixels.
        logit_scale: by what its training multiplied cosines.
        licence: of the weights, where the name shows it.
        device: where it runs.
    """

    def __init__(self, model: str) -> None:
        """Load it.

        Args:
            model: hub id or folder.

        Raises:
            BackendError: it is not here, or another model.
        """
        from transformers import CLIPModel, CLIPTokenizer

        self._folder = pretrained_folder(model)
        self.device = select_device()
        self._type = select_dtype(self.device)
        self._model: Any = load_pretrained(CLIPModel, self._folder, model, self.device, self._type)
        self._tokenizer: Any = load_helper(CLIPTokenizer, self._folder, model)
        self.vision: Any = self._model.vision_model
        config = self._model.config
        self.name, self.dim = public_name(model), int(config.projection_dim)
        self.patch, self.image_size = int(config.vision_config.patch_size), int(config.vision_config.image_size)
        self._most_tokens = int(config.text_config.max_position_embeddings)
        self.logit_scale = float(self._model.logit_scale.detach().float().exp())
        self.licence = licence_of(model)
        self.words = Prompted(self._encode_texts, self.dim, CLIP_PROMPTS)
        self._mean = torch.tensor(_MEAN, device=self.device)[:, None, None]
        self._deviation = torch.tensor(_DEVIATION, device=self.device)[:, None, None]

    def checksum(self, *constants: str) -> str:
        """Return the hex SHA-256 of its weights and of what else shapes the features."""
        return checksum_of(weights_in(self._folder), *constants)

    def pixels(self, pictures: Sequence[UInt8[np.ndarray, "h w 3"]], size: Size) -> torch.Tensor:
        """Return pictures of one shape as (b, 3, height, width), resized to ``size``, normalised as CLIP wants them."""
        picture = stack_pictures(pictures, size, self.device, torch.float32)
        return ((picture - self._mean) / self._deviation).to(self._type)

    def whole(self, rgb: UInt8[np.ndarray, "h w 3"]) -> torch.Tensor:
        """Return the middle square of a picture as CLIP was trained to see one (1, 3, side, side)."""
        height, width = rgb.shape[:2]
        side = min(height, width)
        y, x = (height - side) // 2, (width - side) // 2
        return self.pixels([rgb[y : y + side, x : x + side]], (self.image_size, self.image_size))

    def projected(self, tokens: torch.Tensor) -> torch.Tensor:
        """Return tokens of the picture tower in the space of words: final layer norm and visual projection."""
        return self._model.visual_projection(self.vision.post_layernorm(tokens))

    def picture_features(self, pixels: torch.Tensor) -> torch.Tensor:
        """Return the feature (b, d) of each whole picture, as CLIP compares it with texts."""
        return self._model.get_image_features(pixel_values=pixels).pooler_output

    def _encode_texts(self, texts: list[str]) -> Float[np.ndarray, "n d"]:
        with inference():
            return to_numpy(text_features(self._model, self._tokenizer, texts, self._most_tokens))
