"""A tiny random CLIP in the layout of openai/clip-vit-large-patch14."""

import json
from pathlib import Path

import torch

from tiny.siglip2 import shake

WIDTH, LAYERS, HEADS, PATCH, IMAGE, PLACES, DIM, SCALE = 32, 2, 4, 14, 56, 77, 24, 100.0


def write_clip(folder: Path, model: str = "openai/clip-vit-large-patch14") -> None:
    """Write the checkpoint where ``model_folder`` finds it."""
    from transformers import CLIPConfig, CLIPModel

    place = folder / model
    place.mkdir(parents=True)
    last = write_clip_tokens(place)
    sizes = {
        "hidden_size": WIDTH, "intermediate_size": 4 * WIDTH, "num_hidden_layers": LAYERS, "num_attention_heads": HEADS,
    }  # fmt: skip
    # As published, the configuration names another end token than the one in use; then the highest number ends a text.
    text = {**sizes, "vocab_size": last + 1, "max_position_embeddings": PLACES, "eos_token_id": 2, "bos_token_id": 0}
    vision = {**sizes, "patch_size": PATCH, "image_size": IMAGE}
    made = CLIPModel(CLIPConfig(text_config=text, vision_config=vision, projection_dim=DIM))
    shake(made)
    with torch.no_grad():
        made.logit_scale.fill_(torch.log(torch.tensor(SCALE)))
    made.save_pretrained(place)
    # The published file is of an old release: other names, and sizes as single numbers.
    prepared = {
        "crop_size": IMAGE, "do_center_crop": True, "do_normalize": True, "do_resize": True,
        "feature_extractor_type": "CLIPFeatureExtractor", "image_mean": [0.48145466, 0.4578275, 0.40821073],
        "image_std": [0.26862954, 0.26130258, 0.27577711], "resample": 3, "size": IMAGE,
    }  # fmt: skip
    (place / "preprocessor_config.json").write_text(json.dumps(prepared), encoding="utf-8")


def write_clip_tokens(place: Path) -> int:
    """Write a small tokenizer as the published one is built; return its highest number, the end of a text."""
    from transformers import CLIPTokenizer

    letters = [chr(c) for c in range(ord("!"), ord("~") + 1)]
    merges = [("o", "f</w>"), ("t", "h"), ("th", "e</w>"), ("k", "i"), ("ki", "t")]
    pieces = [*letters, *(letter + "</w>" for letter in letters), *("".join(pair) for pair in merges)]
    vocabulary = {piece: number for number, piece in enumerate([*pieces, "<|startoftext|>", "<|endoftext|>"])}
    CLIPTokenizer(vocab=vocabulary, merges=merges).save_pretrained(place)
    return len(vocabulary) - 1
