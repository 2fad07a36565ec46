"""Parts that the view encoders of an open vocabulary share: batches of frames, words in sentences, the learnt scale."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps.recordings.types import Frame
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.device import select_batch, select_device, unit_rows
from avlmaps_models.common.kept_words import KeptWords
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.prompts import AREA_PROMPTS, Prompted

UNKNOWN_LICENCE = "LicenseRef-unknown"
APPLE_RESEARCH = "LicenseRef-apple-amlr"
# By the beginning of the hub's id, or of the last part of it; the longest beginning decides.
_LICENCES = {
    "google/": "Apache-2.0",
    "siglip": "Apache-2.0",
    "openai/": "MIT",
    "clip-vit-": "MIT",
    "laion/": "MIT",
    "facebook/metaclip": "CC-BY-NC-4.0",
    "metaclip": "CC-BY-NC-4.0",
    "pe-core": "Apache-2.0",
    "apple/": APPLE_RESEARCH,
    "mobileclip": APPLE_RESEARCH,
}
_ON_GPU = 64
# Files beside the weights that say how pictures are prepared and texts are cut into tokens.
_SHAPING = ("preprocessor_config.json", "tokenizer.json", "vocab.json", "merges.txt", "open_clip_config.json")


class OpenViews(ABC):
    """A view encoder whose pictures and sentences lie in one space.

    Args:
        card: of the model.
        logit_scale: by how much its cosines count (see ``ScaledEncoder``).
    """

    def __init__(self, card: ModelCard, logit_scale: float) -> None:
        self.card = card
        self.logit_scale = logit_scale
        self._device = select_device()
        self._words = Prompted(self._text_rows, card.dim, card.prompts, KeptWords(card))

    def encode(self, frames: Sequence[Frame]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each frame."""
        batch, found = select_batch(_ON_GPU), [np.zeros((0, self.card.dim), np.float32)]
        for start in range(0, len(frames), batch):
            with mixed_precision(self._device):
                found.append(unit_rows(self._see([frame.rgb for frame in frames[start : start + batch]])))
        return np.concatenate(found)

    def encode_words(self, words: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        """Return a unit vector for each phrase, the mean over the card's sentences."""
        return self._words.encode(words)

    def _text_rows(self, texts: list[str]) -> Float32[np.ndarray, "n d"]:
        with mixed_precision(self._device):
            return unit_rows(self._read(texts))

    @abstractmethod
    def _see(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> torch.Tensor:
        """Return a feature for each picture."""

    @abstractmethod
    def _read(self, texts: list[str]) -> torch.Tensor:
        """Return a feature for each text."""


def views_card(model: str, dim: int, weights: Sequence[Path], folder: Path, *constants: str) -> ModelCard:
    """Return the card of such an encoder.

    Args:
        model: the hub's id, or a path, as the user named it.
        dim: of its features.
        weights: the files of its weights.
        folder: where what else shapes the features lies beside them.
        constants: what of the code does.
    """
    shaping = [path for name in _SHAPING if (path := folder / name).is_file()]
    licence = licence_of(model)
    return ModelCard(
        id=public_name(model),
        dim=dim,
        licence=licence,
        checksum=checksum_of([*weights, *shaping], *constants, *AREA_PROMPTS),
        prompts=AREA_PROMPTS,
        note=note_of(licence),
    )


def licence_of(model: str, known: Mapping[str, str] = _LICENCES) -> str:
    """Return the licence of the weights of a hub's id, or of a path that ends like one."""
    owner_and_name = "/".join(model.replace("--", "/").rstrip("/").lower().split("/")[-2:])
    name = owner_and_name.rpartition("/")[2]
    fits = [beginning for beginning in known if owner_and_name.startswith(beginning) or name.startswith(beginning)]
    return known[max(fits, key=lambda beginning: ("/" not in beginning, len(beginning)))] if fits else UNKNOWN_LICENCE


def note_of(licence: str) -> str:
    """Return the warning of a licence, one sentence, or ``""``."""
    if licence == UNKNOWN_LICENCE:
        return "The licence of these weights is not known here; look at the model's page."
    if licence == APPLE_RESEARCH:
        return "Research only: the weights are under Apple's own licence for research models (apple-amlr)."
    return f"Research only: the weights are under {licence}." if "-NC-" in licence else ""


def hub_model(model: str, classes: Mapping[str, str]) -> tuple[Any, Path]:
    """Return a model of transformers, in float32 on the chosen device, and its folder.

    Args:
        model: the hub's id, or a folder.
        classes: for each ``model_type`` of config.json that is welcome, the class of transformers.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """
    import transformers

    folder = pretrained_folder(model)
    kind = str(load_helper(transformers.AutoConfig, folder, model).model_type)
    if kind not in classes:
        raise BackendError(
            f"{folder} holds a model of the type {kind!r}, expected is {' or '.join(map(repr, classes))}; choose "
            "another model, or another backend for this one (avlmaps profiles)."
        )
    made = load_pretrained(getattr(transformers, classes[kind]), folder, model, select_device(), torch.float32)
    return made.requires_grad_(False), folder


def image_processor(folder: Path, model: str) -> Any:
    """Return the preparation of pictures as ``preprocessor_config.json`` says.

    It is always the one that resizes with Pillow, as these models were trained: the same pictures give the same numbers
    whether torchvision is installed or not.

    Raises:
        BackendError: the file is missing or damaged.
    """
    return load_helper(ImageProcessor, folder, model)


class ImageProcessor:
    """The image processor of a folder, resizing with Pillow."""

    @staticmethod
    def from_pretrained(folder: Path, **settings: Any) -> Any:
        """Return it."""
        from transformers import AutoImageProcessor

        return AutoImageProcessor.from_pretrained(folder, backend="pil", **settings)
