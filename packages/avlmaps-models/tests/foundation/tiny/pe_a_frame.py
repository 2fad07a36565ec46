"""A tiny random PE-A-Frame in the layout of facebook/pe-a-frame-base."""

from pathlib import Path
from typing import Any

MODEL = "facebook/pe-a-frame-base"


def write_pe_a_frame(folder: Path, model: str = MODEL) -> None:
    """Write config.json, model.safetensors, processor_config.json and the files of the tokenizer."""
    import torch
    from transformers import PeAudioConfig, PeAudioFeatureExtractor, PeAudioFrameLevelModel, PeAudioProcessor

    torch.manual_seed(1)
    place = folder / model
    config = PeAudioConfig(
        text_config={
            "model_type": "modernbert",
            "vocab_size": 264,
            "hidden_size": 32,
            "intermediate_size": 48,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "pad_token_id": 2,
            "bos_token_id": 0,
            "eos_token_id": 1,
            "cls_token_id": 0,
            "sep_token_id": 1,
        },
        audio_config={
            "hidden_size": 48,
            "intermediate_size": 64,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "head_dim": 16,
            "dac_config": {"encoder_hidden_size": 1, "codebook_dim": 8, "sampling_rate": 48000},
        },
    )
    made = PeAudioFrameLevelModel(config)
    with torch.no_grad():
        for name, weights in made.named_parameters():
            if weights.ndim > 1:
                weights.mul_(12.0 if "text_model" in name else 5.0)  # different sounds and words differ
        made.text_model.final_norm.weight.uniform_(0.2, 2.0)  # learnt ones are far from one
        made.text_audio_logit_scale.fill_(0.7)
        made.text_audio_logit_bias.fill_(-2.0)
    made.save_pretrained(place)
    PeAudioProcessor(PeAudioFeatureExtractor(), letters()).save_pretrained(place)


def letters() -> Any:
    """Return a byte-level tokenizer without merges, with ModernBERT's special tokens."""
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers, processors
    from transformers import PreTrainedTokenizerFast

    special = ("[CLS]", "[SEP]", "[PAD]", "[UNK]", "[MASK]")
    vocabulary = {token: i for i, token in enumerate((*special, *sorted(pre_tokenizers.ByteLevel.alphabet())))}
    made = Tokenizer(models.BPE(vocabulary, [], unk_token="[UNK]"))
    made.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    made.decoder = decoders.ByteLevel()
    made.post_processor = processors.TemplateProcessing(
        single="[CLS] $A [SEP]", special_tokens=[("[CLS]", 0), ("[SEP]", 1)]
    )
    names = dict(zip(("cls_token", "sep_token", "pad_token", "unk_token", "mask_token"), special, strict=True))
    return PreTrainedTokenizerFast(tokenizer_object=made, model_max_length=8192, **names)
