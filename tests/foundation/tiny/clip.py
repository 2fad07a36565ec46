"""A tiny random CLIP in the layout of openai/clip-vit-large-patch14."""

from pathlib import Path

import torch

from tiny.siglip2 import shake

WIDTH, LAYERS, HEADS, PATCH, IMAGE, PLACES, DIM, SCALE = 32, 2, 4, 14, 56, 77, 24, 100.0


def write_clip(folder: Path, model: str = "openai/clip-vit-large-patch14") -> None:
    """Write the checkpoint where ``model_folder`` finds it."""
    from transformers import CLIPConfig, CLIPImageProcessorPil, CLIPModel

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
    CLIPImageProcessorPil(
        size={"shortest_edge": IMAGE}, crop_size={"height": IMAGE, "width": IMAGE}, resample=3, do_center_crop=True
    ).save_pretrained(place)


def write_clip_tokens(place: Path) -> int:
    """Write a small tokenizer as the published one is built; return its highest number, the end of a text."""
    from transformers import CLIPTokenizer

    letters = [chr(c) for c in range(ord("!"), ord("~") + 1)]
    merges = [("o", "f</w>"), ("t", "h"), ("th", "e</w>"), ("k", "i"), ("ki", "t")]
    pieces = [*letters, *(letter + "</w>" for letter in letters), *("".join(pair) for pair in merges)]
    vocabulary = {piece: number for number, piece in enumerate([*pieces, "<|startoftext|>", "<|endoftext|>"])}
    CLIPTokenizer(vocab=vocabulary, merges=merges).save_pretrained(place)
    return len(vocabulary) - 1
