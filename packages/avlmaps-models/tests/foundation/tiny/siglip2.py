"""A tiny random SigLIP 2 in the layouts of google/siglip2-base-patch16-224 (a fixed size) and -naflex."""

import json
from pathlib import Path

import torch

WIDTH, LAYERS, HEADS, PATCH, IMAGE, PLACES = 32, 2, 4, 16, 64, 64
SCALE, BIAS = 112.0, -16.6


def write_siglip2(folder: Path, model: str = "google/siglip2-base-patch16-224", naflex: bool = False) -> None:
    """Write the checkpoint where ``model_folder`` finds it.

    Args:
        folder: of models.
        model: hub id.
        naflex: keeps a picture's shape, as ``google/siglip2-base-patch16-naflex``.
    """
    from transformers import Siglip2Config, Siglip2Model, SiglipConfig, SiglipModel

    place = folder / model
    place.mkdir(parents=True)
    vocabulary = write_gemma_tokens(place)
    sizes = {
        "hidden_size": WIDTH, "intermediate_size": 2 * WIDTH, "num_hidden_layers": LAYERS, "num_attention_heads": HEADS,
    }  # fmt: skip
    text = {**sizes, "vocab_size": vocabulary, "max_position_embeddings": PLACES}
    if naflex:
        vision = {**sizes, "patch_size": PATCH, "num_patches": 16}
        made = Siglip2Model(Siglip2Config(text_config=text, vision_config=vision))
        kind = {"image_processor_type": "Siglip2ImageProcessorFast", "patch_size": PATCH, "max_num_patches": 16}
    else:
        vision = {**sizes, "patch_size": PATCH, "image_size": IMAGE}
        made = SiglipModel(SiglipConfig(text_config=text, vision_config=vision))
        kind = {"image_processor_type": "SiglipImageProcessor", "size": {"height": IMAGE, "width": IMAGE}}
    shake(made)
    with torch.no_grad():
        made.logit_scale.fill_(torch.log(torch.tensor(SCALE)))
        made.logit_bias.fill_(BIAS)
    made.save_pretrained(place)
    prepared = {
        **kind, "do_convert_rgb": None, "do_normalize": True, "do_rescale": True, "do_resize": True, "resample": 2,
        "image_mean": [0.5] * 3, "image_std": [0.5] * 3, "processor_class": "SiglipProcessor",
        "rescale_factor": 1 / 255,
    }  # fmt: skip
    (place / "preprocessor_config.json").write_text(json.dumps(prepared), encoding="utf-8")


def shake(module: torch.nn.Module, seed: int = 5, amount: float = 0.2) -> None:
    """Give every weight a random value, so that each of them matters for the output."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for name, values in module.named_parameters():
            noise = torch.randn(values.shape, generator=generator)
            is_scale = values.ndim == 1 and "norm" in name and name.endswith("weight")
            values.copy_(1.0 + 0.2 * noise if is_scale else amount * noise)


def write_gemma_tokens(place: Path) -> int:
    """Write a small tokenizer as the published one is built: byte pairs, an end token behind; return its size."""
    from tokenizers import Tokenizer, decoders, models, normalizers, pre_tokenizers, processors

    special = ["<pad>", "<eos>", "<bos>", "<unk>", "<mask>"]
    letters = ["▁", *"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.,'-"]
    merges = [("o", "f"), ("▁", "a"), ("▁", "of"), ("k", "i"), ("ki", "t")]
    pieces = [*special, *letters, *("".join(pair) for pair in merges)]
    vocabulary = {piece: number for number, piece in enumerate(pieces)}
    tokenizer = Tokenizer(models.BPE(vocab=vocabulary, merges=merges, unk_token="<unk>", fuse_unk=True))
    tokenizer.normalizer = normalizers.Replace(" ", "▁")
    tokenizer.pre_tokenizer = pre_tokenizers.Split(" ", "merged_with_previous")
    tokenizer.post_processor = processors.TemplateProcessing(single="$A <eos>", special_tokens=[("<eos>", 1)])
    tokenizer.decoder = decoders.Sequence([decoders.Replace("▁", " "), decoders.Fuse()])
    tokenizer.add_special_tokens(special)
    tokenizer.save(str(place / "tokenizer.json"))
    config = {
        "tokenizer_class": "GemmaTokenizer", "eos_token": "<eos>", "pad_token": "<pad>", "unk_token": "<unk>",
        "bos_token": "<bos>", "add_eos_token": True, "add_bos_token": False, "padding_side": "right",
        "model_input_names": ["input_ids"], "model_max_length": PLACES,
    }  # fmt: skip
    (place / "tokenizer_config.json").write_text(json.dumps(config), encoding="utf-8")
    return len(pieces)
