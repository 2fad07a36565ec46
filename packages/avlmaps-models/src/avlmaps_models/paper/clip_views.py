"""Areas as the paper's maps have them: CLIP ViT-L/14, pictures and the bare names of areas in one space.

Radford et al., "Learning transferable visual models from natural language supervision", 2021 (MIT). The weights are
those of ``openai/clip-vit-large-patch14`` on the hub, run by transformers, or OpenAI's own file (``ViT-L-14.pt``, or
its ``state_dict`` saved alone), run by ``clip_network``; both hold the same numbers. 768 numbers a feature, pictures of
224 pixels: the shorter side resized by Pillow, the middle square cut out. The published code puts an area's name into
no sentence.
"""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import select_device
from avlmaps_models.common.files import model_file
from avlmaps_models.common.pretrained import load_helper
from avlmaps_models.common.published import network_from
from avlmaps_models.common.texts import text_features
from avlmaps_models.foundation.open_views import OpenViews, hub_model, licence_of
from avlmaps_models.paper.archives import read_weights
from avlmaps_models.paper.clip_network import NO_WEIGHTS, Clip, ClipSizes, clip_picture
from avlmaps_models.paper.clip_text import padded
from avlmaps_models.paper.clip_tokens import clip_tokens
from avlmaps_models.paper.prompts import AREA_PROMPTS

_FILES = (".pt", ".pth")
_TOKENIZER = ("tokenizer.json", "vocab.json", "merges.txt")
_GET = (
    "curl -LO https://openaipublic.azureedge.net/clip/models/"
    "b8cca3fd41ae0c99ba7e8951adf17d267cdb84cd88be6f7c2e0eca1737a03836/ViT-L-14.pt"
)


class PaperClipViews(OpenViews):
    """Encodes views with a CLIP as the published code does.

    Args:
        model: a hub's id, a folder in its layout, or a file of OpenAI's (``.pt``).

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = "openai/clip-vit-large-patch14") -> None:
        is_file = Path(model).suffix in _FILES
        self._towers: _Towers = _OpenAiTowers(model) if is_file else _HubTowers(model)
        card = ModelCard(
            id=public_name(model),
            dim=self._towers.dim,
            licence="MIT" if is_file else licence_of(model),
            checksum=checksum_of(self._towers.files, "clip-paper", *AREA_PROMPTS),
            prompts=AREA_PROMPTS,
            note="sees the middle square of a picture only",
        )
        super().__init__(card, self._towers.logit_scale)

    def _see(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> torch.Tensor:
        pixels = np.stack([clip_picture(rgb, self._towers.side) for rgb in pictures])
        return self._towers.see(torch.from_numpy(pixels).to(self._device))

    def _read(self, texts: list[str]) -> torch.Tensor:
        return self._towers.read(texts)


class _Towers(ABC):
    """A CLIP on the chosen device.

    Attributes:
        dim: length of a feature.
        side: of the square picture that it sees, pixels.
        logit_scale: by how much its cosines count.
        files: what shapes its features.
    """

    dim: int
    side: int
    logit_scale: float
    files: list[Path]

    @abstractmethod
    def see(self, pixels: torch.Tensor) -> torch.Tensor:
        """Return a feature for each of (n, 3, side, side) pictures."""

    @abstractmethod
    def read(self, texts: list[str]) -> torch.Tensor:
        """Return a feature for each text."""


class _HubTowers(_Towers):
    def __init__(self, model: str) -> None:
        from transformers import AutoTokenizer

        self._network, folder = hub_model(model, {"clip": "CLIPModel"})
        self._tokens: Any = load_helper(AutoTokenizer, folder, model)
        config = self._network.config
        self._longest = int(config.text_config.max_position_embeddings)
        self.dim, self.side = int(config.projection_dim), int(config.vision_config.image_size)
        self.logit_scale = float(self._network.logit_scale.exp())
        self.files = [*weights_in(folder), *(path for name in _TOKENIZER if (path := folder / name).is_file())]

    def see(self, pixels: torch.Tensor) -> torch.Tensor:
        return self._network.get_image_features(pixel_values=pixels).pooler_output

    def read(self, texts: list[str]) -> torch.Tensor:
        return text_features(self._network, self._tokens, texts, self._longest)


class _OpenAiTowers(_Towers):
    def __init__(self, model: str) -> None:
        path = model_file(model, _GET)
        self._network, self._device = _network_of(path), select_device()
        self._network.to(self._device)
        self._tokens = clip_tokens()
        text = self._network.sizes
        if len(self._tokens) != text.tokens:
            raise BackendError(
                f"{path} was trained with {text.tokens} tokens, the list of merges that was found makes "
                f"{len(self._tokens)}; get the published file: {_GET}"
            )
        self.dim, self.side = text.dim, self._network.side
        self.logit_scale = float(self._network.logit_scale.exp())
        self.files = [path]

    def see(self, pixels: torch.Tensor) -> torch.Tensor:
        return self._network.visual(pixels)

    def read(self, texts: list[str]) -> torch.Tensor:
        return self._network(padded(self._tokens.encode(texts)).to(self._device))


def _network_of(path: Path) -> Clip:
    state = read_weights(path, _GET)
    idle = [key for key in NO_WEIGHTS if key in state]
    what = "a CLIP with a vision transformer in OpenAI's layout"
    return network_from(lambda: Clip(ClipSizes.of(state)), what, state, path, _GET, idle)
