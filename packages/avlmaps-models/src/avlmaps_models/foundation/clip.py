"""Areas by CLIP: whole pictures and sentences in one space.

Radford et al., "Learning transferable visual models from natural language supervision", 2021. Checkpoints of the hub in
transformers' layout: ``openai/clip-vit-base-patch32`` and ``-base-patch16`` (512 numbers a feature), ``-large-patch14``
and ``-large-patch14-336`` (768; all MIT), ``laion/CLIP-ViT-*`` (MIT), and with the same interface MetaCLIP 2,
``facebook/metaclip-2-worldwide-*`` (CC-BY-NC-4.0, research only).

Pictures are resized by the shorter side (224 or 336 pixels, bicubic) and cut to the middle square, as the model's
``preprocessor_config.json`` says: what lies at the far sides of a wide picture is not seen. A text is read at its end
token. The learnt scale of the cosines is about 100.
"""

from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8

from avlmaps_models.common.checksums import weights_in
from avlmaps_models.common.pretrained import load_helper
from avlmaps_models.common.texts import text_features
from avlmaps_models.foundation.open_views import OpenViews, hub_model, image_processor, views_card

_CLASSES = {"clip": "CLIPModel", "metaclip_2": "MetaClip2Model"}


class ClipViews(OpenViews):
    """Encodes views with a CLIP of transformers.

    Args:
        model: the hub's id, or a folder.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = "openai/clip-vit-large-patch14") -> None:
        from transformers import AutoTokenizer

        self._network, folder = hub_model(model, _CLASSES)
        self._prepare: Any = image_processor(folder, model)
        self._tokens: Any = load_helper(AutoTokenizer, folder, model)
        config = self._network.config
        self._longest = int(config.text_config.max_position_embeddings)
        card = views_card(model, int(config.projection_dim), weights_in(folder), folder)
        super().__init__(card, float(self._network.logit_scale.exp()))

    def _see(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> torch.Tensor:
        pixels = self._prepare(images=pictures, input_data_format="channels_last", return_tensors="pt")["pixel_values"]
        return self._network.get_image_features(pixel_values=pixels.to(self._device)).pooler_output

    def _read(self, texts: list[str]) -> torch.Tensor:
        return text_features(self._network, self._tokens, texts, self._longest)
