"""Tiny random models in the layout of timm/PE-Core-B-16 and its like: open_clip_config.json and one safetensors."""

import json
from pathlib import Path
from typing import Any

import torch

SCALE = 100.0
# A Perception Encoder needs an architecture of timm's; the smallest has 6 million weights. The text tower is tiny.
PERCEPTION = {
    "embed_dim": 24,
    "vision_cfg": {
        "image_size": 384, "timm_model_name": "vit_pe_core_tiny_patch16_384", "timm_model_pretrained": False,
        "timm_pool": "map", "timm_proj": None,
    },
    "text_cfg": {"context_length": 32, "vocab_size": 49408, "width": 32, "heads": 2, "layers": 2},
    "custom_text": True,
}  # fmt: skip
PLAIN = {
    "embed_dim": 24,
    "vision_cfg": {"image_size": 48, "layers": 2, "width": 64, "head_width": 32, "patch_size": 16},
    "text_cfg": {"context_length": 77, "vocab_size": 49408, "width": 32, "heads": 2, "layers": 2},
}
HALVES = {"mean": [0.5] * 3, "std": [0.5] * 3, "interpolation": "bilinear", "resize_mode": "squash"}


def write_open_clip_views(folder: Path, model: str = "timm/PE-Core-B-16", plain: bool = False) -> None:
    """Write the checkpoint where ``model_folder`` finds it.

    Args:
        folder: of models.
        model: hub id.
        plain: a plain CLIP with a vision transformer of open_clip's own; a hundred times quicker.
    """
    from safetensors.torch import save_file

    place = folder / model
    place.mkdir(parents=True)
    config = PLAIN if plain else PERCEPTION
    whole = {"model_cfg": config, "preprocess_cfg": HALVES}
    (place / "open_clip_config.json").write_text(json.dumps(whole), encoding="utf-8")
    save_file(
        {name: row.contiguous() for name, row in random_model(config).state_dict().items()},
        place / "open_clip_model.safetensors",
        metadata={"format": "pt"},
    )


def random_model(config: dict[str, Any]) -> torch.nn.Module:
    """Return a model with those sizes and random weights."""
    from open_clip import CLIP, CustomTextCLIP

    config = json.loads(json.dumps(config))
    torch.manual_seed(7)
    made = CustomTextCLIP(**config) if config.pop("custom_text", False) else CLIP(**config)
    generator = torch.Generator().manual_seed(7)
    with torch.no_grad():
        for name, values in made.named_parameters():
            if values.ndim < 2 and "norm" not in name and "ln" not in name:
                values.copy_(0.1 * torch.randn(values.shape, generator=generator))
        made.logit_scale.fill_(torch.log(torch.tensor(SCALE)))
    return made.eval()
