"""A tiny random CLIP in the layout of openai/clip-vit-base-patch16."""

from pathlib import Path

import torch

from tiny.clip import write_clip_tokens
from tiny.tipsv2 import shake

WIDTH, LAYERS, HEADS, PATCH, IMAGE, DIM, SCALE = 32, 2, 4, 16, 64, 24, 100.0


def write_clip_patches(folder: Path, model: str = "openai/clip-vit-base-patch16", patch: int = PATCH) -> None:
    """Write the checkpoint where ``model_folder`` finds it; over the same one that lies there already, too.

    Args:
        folder: of models.
        model: hub id.
        patch: edge of a patch, pixels.
    """
    from transformers import CLIPConfig, CLIPImageProcessorPil, CLIPModel

    place = folder / model
    place.mkdir(parents=True, exist_ok=True)
    last = write_clip_tokens(place)
    sizes = {
        "hidden_size": WIDTH, "intermediate_size": 48, "num_hidden_layers": LAYERS, "num_attention_heads": HEADS,
    }  # fmt: skip
    text = {**sizes, "vocab_size": last + 1, "max_position_embeddings": 77, "eos_token_id": 2, "bos_token_id": 0}
    vision = {**sizes, "patch_size": patch, "image_size": IMAGE}
    made = CLIPModel(CLIPConfig(text_config=text, vision_config=vision, projection_dim=DIM))
    shake(made, 7)
    with torch.no_grad():
        made.logit_scale.fill_(torch.log(torch.tensor(SCALE)))
    made.save_pretrained(place)
    CLIPImageProcessorPil(size={"shortest_edge": IMAGE}, crop_size={"height": IMAGE, "width": IMAGE}).save_pretrained(
        place
    )
