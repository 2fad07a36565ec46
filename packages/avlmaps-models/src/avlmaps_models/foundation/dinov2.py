"""Places by DINOv2 as it is, trained without names or places: for rooms unlike any street, where MegaLoc is too large.

Oquab et al., "DINOv2: learning robust visual features without supervision", 2023 (Apache-2.0):
``facebook/dinov2-small``, ``-base``, ``-large``, ``-giant`` of the hub, by transformers' ``Dinov2Model``; and
``facebook/dinov2-with-registers-*``.

The shorter side of a picture becomes about 224 pixels, both sides the nearest multiples of a patch (14),
by bicubic resizing without aliasing, ImageNet's mean and deviation. (The model's own preparation for classifying cuts
the middle square out; things at the side may identify a place.) The descriptor is, chosen by ``model#way``:

- ``both`` (default): the class token and the patches' mean, each of unit length, one behind the other: 768 numbers for
  ``-small``, 1536 for ``-base``;
- ``class``: the class token alone (384, 768, 1024, 1536);
- ``mean``: the patches' generalised mean alone, the cube root of the mean of their cubes with its sign, as AnyLoc
  (Keetha et al., 2023) has it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.perception.models.checksums import checksum_of, weights_in
from avlmaps.perception.models.names import public_name
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.device import select_device, unit_rows
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.foundation.open_views import hub_model
from avlmaps_models.foundation.pictures import split_model_way
from avlmaps_models.foundation.whole_pictures import imagenet_picture, size_with_short_side

_CLASSES = {"dinov2": "Dinov2Model", "dinov2_with_registers": "Dinov2WithRegistersModel"}
_WAYS = ("both", "class", "mean")
_SHORT_SIDE = 224
_EXPONENT = 3.0


class DinoPlaces:
    """Describes whole pictures by a DINOv2's tokens.

    Args:
        model: the hub's id or a folder, behind ``#`` the kind of descriptor.
        short_side: of the picture that the model sees, pixels.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = "facebook/dinov2-small", short_side: int = _SHORT_SIDE) -> None:
        name, self._way = split_model_way(model, _WAYS)
        self._network, folder = hub_model(name, _CLASSES)
        config: Any = self._network.config
        self._patch, self._short_side = int(config.patch_size), short_side
        self._front = 1 + int(getattr(config, "num_register_tokens", 0))
        self._device = select_device()
        self.card = ModelCard(
            id=public_name(name) + ("" if self._way == _WAYS[0] else f"#{self._way}"),
            dim=int(config.hidden_size) * (2 if self._way == "both" else 1),
            licence="Apache-2.0",
            checksum=checksum_of(weights_in(folder), f"{self._way} short side {short_side}", "bicubic", "ImageNet"),
            note="was not trained to distinguish places; MegaLoc was",
        )

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return nothing: it has learnt what it needs."""
        return {}

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return a unit vector for any picture; its keypoints are not looked at."""
        size = size_with_short_side(rgb.shape[0], rgb.shape[1], self._short_side, self._patch)
        picture = imagenet_picture(rgb, size, self._device, "bicubic")
        with mixed_precision(self._device):
            tokens = self._network(pixel_values=picture).last_hidden_state.to(torch.float32)[0]
        parts = [tokens[0]] if self._way != "mean" else []
        if self._way != "class":
            parts.append(_generalised_mean(tokens[self._front :]))
        return unit_rows(torch.cat([torch.nn.functional.normalize(part, dim=0) for part in parts]))


def _generalised_mean(tokens: torch.Tensor) -> torch.Tensor:
    """Return (d,) of (n, d): the cube root of the mean of cubes, with its sign."""
    cubes = tokens.pow(_EXPONENT).mean(dim=0)
    return cubes.sign() * cubes.abs().pow(1.0 / _EXPONENT)
