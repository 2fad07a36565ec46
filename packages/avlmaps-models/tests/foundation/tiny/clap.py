"""A tiny random CLAP in the layout of laion/larger_clap_general (without fusion) or laion/clap-htsat-fused."""

from pathlib import Path

MODEL = "laion/larger_clap_general"


def write_clap(folder: Path, model: str = MODEL, fused: bool = False) -> None:
    """Write config.json, model.safetensors, preprocessor_config.json and the files of a RoBERTa tokenizer."""
    import torch
    from transformers import ClapConfig, ClapFeatureExtractor, ClapModel

    torch.manual_seed(1)
    place = folder / model
    config = ClapConfig(
        projection_dim=32,
        text_config={
            "vocab_size": 300,
            "hidden_size": 32,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "intermediate_size": 48,
            "max_position_embeddings": 82,
        },
        audio_config={
            "hidden_size": 64,
            "patch_embeds_hidden_size": 8,
            "depths": [1, 1, 1, 1],
            "num_attention_heads": [1, 2, 2, 2],
            "enable_fusion": fused,
            "fusion_type": "aff_2d" if fused else None,
        },
        initializer_factor=8.0,  # features of different sounds and words differ
    )
    made = ClapModel(config).eval()
    with torch.no_grad():
        bounds = made.audio_model.audio_encoder.batch_norm
        bounds.running_mean.fill_(-30.0)  # decibels, about as training leaves them
        bounds.running_var.fill_(400.0)
        for weights in made.text_model.parameters():
            weights.mul_(6.0 if weights.ndim > 1 else 1.0)  # words differ, too
    made.save_pretrained(place)
    ClapFeatureExtractor(
        frequency_min=50, frequency_max=14000, truncation="fusion" if fused else "rand_trunc"
    ).save_pretrained(place)
    write_roberta_tokenizer(place)


def write_roberta_tokenizer(place: Path) -> None:
    """Write a byte-level tokenizer without merges: every letter is a token."""
    from tokenizers.pre_tokenizers import ByteLevel
    from transformers import RobertaTokenizer

    letters = sorted(ByteLevel.alphabet())
    vocabulary = {token: i for i, token in enumerate(("<s>", "<pad>", "</s>", "<unk>", *letters, "<mask>"))}
    RobertaTokenizer(vocab=vocabulary, merges=[], model_max_length=512).save_pretrained(place)
