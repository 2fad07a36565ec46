"""Checkpoints of the published sizes with random weights, for timing: no hub is queried, and no answer means anything.

The sizes are those of the published ``config.json`` (or of the published code, for files that bring none); the layouts
are the tests' (``packages/avlmaps-models/tests/foundation/tiny``). Vocabularies of the tokenizers are small, tables of
tokens are not.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "packages/avlmaps-models/tests/foundation"))

Writer = Callable[[Path], None]
CLIP_B16, CLIP_B32 = "openai/clip-vit-base-patch16", "openai/clip-vit-base-patch32"
CLIP_L14 = "openai/clip-vit-large-patch14"
# Width, layers and heads of the text and of the picture tower, patch, numbers a feature.
CLIPS = {
    CLIP_B16: ((512, 12, 8), (768, 12, 12), 16, 512),
    CLIP_B32: ((512, 12, 8), (768, 12, 12), 32, 512),
    CLIP_L14: ((768, 12, 12), (1024, 24, 16), 14, 768),
}


def write_clip(folder: Path, model: str = CLIP_L14) -> None:
    """CLIP as transformers stores it."""
    from tiny.clip import write_clip_tokens
    from transformers import CLIPConfig, CLIPImageProcessorPil, CLIPModel

    place = folder / model
    place.mkdir(parents=True, exist_ok=True)
    write_clip_tokens(place)
    text, picture, patch, dim = CLIPS[model]
    config = CLIPConfig(
        text_config={**_tower(*text), "eos_token_id": 2, "bos_token_id": 0},
        vision_config={**_tower(*picture), "patch_size": patch, "image_size": 224},
        projection_dim=dim,
    )
    CLIPModel(config).save_pretrained(place)
    CLIPImageProcessorPil().save_pretrained(place)


def write_tipsv2(folder: Path) -> None:
    """TIPSv2 B/14: transformers' defaults."""
    from tiny.tipsv2 import without_temperature, write_tips_tokens
    from transformers import Tipsv2Config, Tipsv2Model

    place = folder / "google/tipsv2-b14"
    place.mkdir(parents=True)
    Tipsv2Model(Tipsv2Config()).save_pretrained(place)
    without_temperature(place / "model.safetensors")
    write_tips_tokens(place)


def write_siglip2(folder: Path) -> None:
    """SigLIP 2 B/16 for 224 x 224; most of its weights are the table of 256,000 tokens."""
    from tiny.siglip2 import write_gemma_tokens
    from transformers import SiglipConfig, SiglipModel

    place = folder / "google/siglip2-base-patch16-224"
    place.mkdir(parents=True)
    write_gemma_tokens(place)
    text = {**_tower(768, 12, 12), "vocab_size": 256_000, "max_position_embeddings": 64}
    vision = {**_tower(768, 12, 12), "patch_size": 16, "image_size": 224}
    SiglipModel(SiglipConfig(text_config=text, vision_config=vision)).save_pretrained(place)
    prepared = {
        "image_processor_type": "SiglipImageProcessor", "size": {"height": 224, "width": 224}, "resample": 2,
        "do_resize": True, "do_rescale": True, "rescale_factor": 1 / 255, "do_normalize": True,
        "image_mean": [0.5] * 3, "image_std": [0.5] * 3,
    }  # fmt: skip
    (place / "preprocessor_config.json").write_text(json.dumps(prepared), encoding="utf-8")


def write_clap(folder: Path) -> None:
    """CLAP with the larger of the two networks that hear (HTSAT-base), as in larger_clap_general."""
    from tiny.clap import write_roberta_tokenizer
    from transformers import ClapConfig, ClapFeatureExtractor, ClapModel

    place = folder / "laion/larger_clap_general"
    audio = {"patch_embeds_hidden_size": 128, "hidden_size": 1024, "depths": [2, 2, 12, 2]}
    ClapModel(ClapConfig(audio_config=audio)).save_pretrained(place)
    ClapFeatureExtractor(frequency_min=50, frequency_max=14000, truncation="rand_trunc").save_pretrained(place)
    write_roberta_tokenizer(place)


def write_clap_unfused(folder: Path) -> None:
    """CLAP with the smaller of the two networks that hear (HTSAT-tiny), as in clap-htsat-unfused."""
    from tiny.clap import write_roberta_tokenizer
    from transformers import ClapConfig, ClapFeatureExtractor, ClapModel

    place = folder / "laion/clap-htsat-unfused"
    ClapModel(ClapConfig()).save_pretrained(place)
    ClapFeatureExtractor(frequency_min=50, frequency_max=14000, truncation="rand_trunc").save_pretrained(place)
    write_roberta_tokenizer(place)


def write_pe_a_frame(folder: Path) -> None:
    """PE-A-Frame base; the text model is ModernBERT's large one."""
    from tiny.pe_a_frame import letters
    from transformers import PeAudioConfig, PeAudioFeatureExtractor, PeAudioFrameLevelModel, PeAudioProcessor

    place = folder / "facebook/pe-a-frame-base"
    audio = {
        "hidden_size": 1024, "intermediate_size": 2752, "num_hidden_layers": 16, "num_attention_heads": 8,
        "head_dim": 128, "dac_config": {"sampling_rate": 48_000},
    }  # fmt: skip
    PeAudioFrameLevelModel(PeAudioConfig(audio_config=audio)).save_pretrained(place)
    PeAudioProcessor(PeAudioFeatureExtractor(), letters()).save_pretrained(place)


def _tower(width: int, layers: int, heads: int) -> dict[str, Any]:
    """Return the sizes of a transformer whose MLP is four times as wide."""
    names = ("hidden_size", "intermediate_size", "num_hidden_layers", "num_attention_heads")
    return dict(zip(names, (width, 4 * width, layers, heads), strict=True))


def _tests_writer(module: str, function: str, **sizes: Any) -> Writer:
    """Return a writer of the tests, with the published sizes."""

    def write(folder: Path) -> None:
        import importlib

        getattr(importlib.import_module(f"tiny.{module}"), function)(folder, **sizes)

    return write


def _lseg(folder: Path) -> None:
    from tiny.lseg import PUBLISHED, write_lseg

    write_lseg(folder, PUBLISHED)


WRITERS: dict[str, Writer] = {
    "tipsv2": write_tipsv2,
    "clip-patches": lambda folder: write_clip(folder, CLIP_B16),
    "siglip2": write_siglip2,
    "clip": write_clip,
    "clap": write_clap,
    "pe-a-frame": write_pe_a_frame,
    "disk": _tests_writer("disk", "write_disk"),
    "aliked": _tests_writer("aliked", "write_aliked"),
    "megaloc": _tests_writer("megaloc", "write_megaloc", tiny=False),
    "lightglue-disk": _tests_writer("lightglue", "write_lightglue", random=True),
    "lightglue-aliked": _tests_writer("lightglue", "write_lightglue", keypoints="aliked", random=True),
    "lseg": _lseg,
    "clip-paper": write_clip,
    "audioclip": _tests_writer("audioclip", "write_audioclip", tiny=False),
    "superpoint": _tests_writer("superpoint", "write_superpoint"),
    "netvlad": _tests_writer("netvlad", "write_netvlad", tiny=False),
    "superglue": _tests_writer("superglue", "write_superglue", random=True, layers=18),
}
"""By the backend's name, what writes its default model where a folder of models holds it."""
LEFT_OUT = {"regions": "its time hangs on how many regions it finds, and random weights find none that mean anything"}
