"""A tiny random TIPSv2 in the layout of google/tipsv2-b14: the published names of the weights, a small tokenizer."""

import json
from pathlib import Path

import torch

WIDTH, HEADS, LAYERS, PATCH, IMAGE, TOKENS = 24, 3, 3, 14, 56, 64
_PIECES = ["<pad>", "<unk>", "▁", *"abcdefghijklmnopqrstuvwxyz'.-", "▁a", "▁the", "▁of", "▁photo"]
_MERGES = [("▁", "a"), ("▁", "t"), ("▁t", "h"), ("▁th", "e"), ("▁", "o"), ("▁o", "f")]


def write_tipsv2(folder: Path, model: str = "google/tipsv2-b14", swiglu: bool = False) -> None:
    """Write the checkpoint where ``model_folder`` finds it.

    Args:
        folder: of models.
        model: hub id.
        swiglu: as the giant one: a gated MLP.
    """
    from transformers import Tipsv2Config, Tipsv2Model, Tipsv2TextConfig, Tipsv2VisionConfig

    vision = Tipsv2VisionConfig(
        hidden_size=WIDTH, num_hidden_layers=LAYERS, num_attention_heads=HEADS, image_size=IMAGE, use_swiglu_ffn=swiglu
    )
    text = Tipsv2TextConfig(
        hidden_size=WIDTH, intermediate_size=32, num_hidden_layers=2, num_attention_heads=HEADS, vocab_size=64
    )
    config = Tipsv2Config(text_config=text, vision_config=vision, temperature_init_value=0.005)
    made = Tipsv2Model(config)
    shake(made, 3)
    place = folder / model
    place.mkdir(parents=True)
    made.save_pretrained(place)
    without_temperature(place / "model.safetensors")
    write_tips_tokens(place)


def shake(module: torch.nn.Module, seed: int, amount: float = 0.3) -> None:
    """Give every weight a random value, so that each of them matters for the output."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for name, values in module.named_parameters():
            noise = torch.randn(values.shape, generator=generator)
            is_scale = values.ndim == 1 and ("norm" in name or "scale" in name) and name.endswith(("weight", "lambda1"))
            if values.ndim:
                values.copy_(1.0 + 0.2 * noise if is_scale else amount * noise)


def without_temperature(path: Path) -> None:
    """Take out the one weight that the published files do not have."""
    from safetensors.torch import load_file, save_file

    weights = load_file(path)
    weights.pop("temperature")
    save_file(weights, path, metadata={"format": "pt"})


def write_tips_tokens(place: Path) -> None:
    """Write a small tokenizer as the published one is built."""
    from transformers.models.tipsv2.tokenization_tipsv2 import Tipsv2Tokenizer

    pieces = [*_PIECES, "▁t", "▁th", "▁o"]
    vocabulary = {piece: number for number, piece in enumerate(dict.fromkeys(pieces))}
    Tipsv2Tokenizer(vocab=vocabulary, merges=_MERGES).save_pretrained(place)
    kept = json.loads((place / "tokenizer_config.json").read_text(encoding="utf-8"))
    assert kept["tokenizer_class"] == "Tipsv2Tokenizer"
