"""Areas by SigLIP 2: whole pictures and sentences in one space, trained pair by pair with a sigmoid.

Tschannen et al., "SigLIP 2: Multilingual vision-language encoders", 2025 (published with google-research/big_vision;
Apache-2.0). Checkpoints of the hub in transformers' layout: those of a fixed size
(``google/siglip2-base-patch16-224``, ``-large-patch16-256``, ``-so400m-patch14-384``, ``-giant-opt-patch16-384``; they
load as ``SiglipModel``: 768, 1024, 1152 and 1536 numbers a feature) and those that keep a picture's shape
(``google/siglip2-base-patch16-naflex``, ``-so400m-patch16-naflex``; ``Siglip2Model``, at most 256 patches). The first
SigLIP (``google/siglip-*``) has the layout of the fixed ones and works as well.

Pictures of the fixed ones are squashed to their square, mean and deviation 0.5, as ``preprocessor_config.json`` says. A
text is small letters, cut to 63 tokens, an end token behind it, padded to exactly 64: the model was trained without a
mask and reads the feature off at the last place. So the published tokenizer.json is used as it is and the rest done
here; what other programs make of it has changed with their releases.

The model holds a scale (about 112) and a bias (about -16.6) for its sigmoid. A query compares names of rooms with one
another, where the bias cancels; ``logit_bias`` stores it for callers that need the likelihood of one caption (for a
bare name that is small even where it is right).
"""

import json
import string
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Int64, UInt8

from avlmaps.core.errors import BackendError
from avlmaps_models.common.checksums import weights_in
from avlmaps_models.foundation.open_views import OpenViews, hub_model, image_processor, views_card

_CLASSES = {"siglip": "SiglipModel", "siglip2": "Siglip2Model"}
_FIRST_SIGLIP_END = "</s>"
_PUNCTUATION = str.maketrans("", "", string.punctuation)


class SiglipViews(OpenViews):
    """Encodes views with a SigLIP 2 of transformers.

    Args:
        model: the hub's id, or a folder.

    Attributes:
        logit_bias: of the model's sigmoid.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = "google/siglip2-base-patch16-224") -> None:
        self._network, folder = hub_model(model, _CLASSES)
        self._prepare: Any = image_processor(folder, model)
        text = self._network.config.text_config
        self._tokens = SiglipTokens(folder, int(text.max_position_embeddings), f"hf download {model}")
        self.logit_bias = float(self._network.logit_bias)
        card = views_card(model, int(text.projection_size), weights_in(folder), folder, "small letters, no mask")
        super().__init__(card, float(self._network.logit_scale.exp()))

    def _see(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> torch.Tensor:
        seen = self._prepare(images=pictures, input_data_format="channels_last", return_tensors="pt")
        return self._network.get_image_features(
            **{name: value.to(self._device) for name, value in seen.items()}
        ).pooler_output

    def _read(self, texts: list[str]) -> torch.Tensor:
        ids = torch.from_numpy(self._tokens.encode(texts)).to(self._device)
        return self._network.get_text_features(input_ids=ids).pooler_output


class SiglipTokens:
    """Turns texts into rows of tokens of one length, as the models were trained.

    Args:
        folder: of the model; holds tokenizer.json and tokenizer_config.json.
        length: of a row.
        how_to_get: the command that brings the files, for the error.

    Raises:
        BackendError: they are missing or damaged.
    """

    def __init__(self, folder: Path, length: int, how_to_get: str) -> None:
        from tokenizers import Tokenizer

        self._length = length
        path = folder / "tokenizer.json"
        try:
            self._tokenizer = Tokenizer.from_file(str(path))
            config = json.loads((folder / "tokenizer_config.json").read_text(encoding="utf-8"))
            end = _name(config.get("eos_token", "<eos>"))
            padding = _name(config.get("pad_token", "<pad>"))
        except Exception as fault:  # tokenizers raises plain Exception
            raise BackendError(
                f"{path} and tokenizer_config.json cannot be read ({type(fault).__name__}: {fault}); get them again "
                f"with: {how_to_get}"
            ) from fault
        self._tokenizer.no_padding()
        self._tokenizer.no_truncation()
        # The first SigLIP's texts lose their punctuation; SigLIP 2's keep it.
        self._bare = end == _FIRST_SIGLIP_END
        self._end, self._padding = self._number(end, path), self._number(padding, path)

    def encode(self, texts: list[str]) -> Int64[np.ndarray, "n length"]:
        """Return a row for each text."""
        rows = np.full((len(texts), self._length), self._padding, np.int64)
        for row, text in zip(rows, texts, strict=True):
            ids = self._tokenizer.encode(self._canonical(text), add_special_tokens=True).ids
            ids = [*ids[:-1], self._end] if ids and ids[-1] == self._end else [*ids, self._end]
            ids = ids if len(ids) <= self._length else [*ids[: self._length - 1], self._end]
            row[: len(ids)] = ids
        return rows

    def _canonical(self, text: str) -> str:
        text = text.lower()
        return " ".join((text.translate(_PUNCTUATION) if self._bare else text).split())

    def _number(self, token: str, path: Path) -> int:
        number = self._tokenizer.token_to_id(token)
        if number is None:
            raise BackendError(f"{path} has no token {token!r}; it is not the tokenizer of this model.")
        return number


def _name(token: str | dict[str, Any]) -> str:
    return token if isinstance(token, str) else str(token["content"])
