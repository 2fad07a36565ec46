"""Texts through a text encoder of transformers."""

from collections.abc import Sequence
from typing import Any

import torch


def text_tokens(tokenizer: Any, texts: Sequence[str], longest: int, device: torch.device) -> Any:
    """Return the tokens of texts, ``input_ids`` and ``attention_mask``, filled up to the longest of them.

    Args:
        tokenizer: of transformers.
        texts: what is longer than the model can read is cut off.
        longest: that many tokens the model can read.
        device: where they go.
    """
    read = tokenizer(list(texts), padding=True, truncation=True, max_length=longest, return_tensors="pt")
    return read.to(device)


def text_features(model: Any, tokenizer: Any, texts: Sequence[str], longest: int) -> torch.Tensor:
    """Return the feature (n, d) of each text by a model that has ``get_text_features``, of any length.

    Args:
        model: of transformers.
        tokenizer: its own.
        texts: what is longer than the model can read is cut off.
        longest: that many tokens the model can read.
    """
    read = text_tokens(tokenizer, texts, longest, model.device)
    return model.get_text_features(input_ids=read["input_ids"], attention_mask=read["attention_mask"]).pooler_output
