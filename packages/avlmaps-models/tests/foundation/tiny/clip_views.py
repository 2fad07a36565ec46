"""A tiny random CLIP for the paper's areas: in the hub's layout, and in OpenAI's own."""

from pathlib import Path

import torch

from tiny.clip import write_clip
from tiny.lseg import Sizes, clip_layout, random_weights

OPENAI = Sizes(dim=24, text_width=64, text_layers=2, image_width=128, image_layers=2)
PATCH, SIDE = 14, 56


def write_clip_views(folder: Path) -> None:
    """Write ``openai/clip-vit-large-patch14`` where ``model_folder`` finds it, unless it is there."""
    if not (folder / "openai/clip-vit-large-patch14").exists():
        write_clip(folder)


def openai_weights() -> dict[str, torch.Tensor]:
    """Return what a file of OpenAI's holds: the weights, on a GPU in half precision, and three numbers beside them."""
    state = {key: value.half() for key, value in random_weights(clip_layout(OPENAI, PATCH, SIDE), seed=5).items()}
    numbers = {"input_resolution": SIDE, "context_length": 77, "vocab_size": 49408}
    return {**state, **{key: torch.tensor(value) for key, value in numbers.items()}}


def write_openai_clip(path: Path) -> None:
    """Write such weights as a flat dictionary."""
    torch.save(openai_weights(), path)
