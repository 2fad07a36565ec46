"""TIPSv2's dense features: the published computation, on the published names of the weights."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file
from tiny.tipsv2 import HEADS, IMAGE, PATCH, WIDTH, write_tipsv2

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import BatchPixelEncoder, ScaledEncoder
from avlmaps_models.common.prompts import TIPS_PROMPTS
from avlmaps_models.foundation.tipsv2 import TipsPixels

HUB_ID = "google/tipsv2-b14"
Weights = dict[str, torch.Tensor]


@pytest.fixture
def tips(models: Path) -> TipsPixels:
    write_tipsv2(models)
    return TipsPixels(short_side=IMAGE)


def weights_of(models: Path, model: str = HUB_ID) -> Weights:
    return load_file(models / model / "model.safetensors")


def norm(x: torch.Tensor, weights: Weights, name: str, eps: float = 1e-6) -> torch.Tensor:
    return torch.nn.functional.layer_norm(x, x.shape[-1:], weights[f"{name}.weight"], weights[f"{name}.bias"], eps)


def linear(x: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    return x @ weights[f"{name}.weight"].T + weights[f"{name}.bias"]


def published_block(x: torch.Tensor, weights: Weights, number: int, values_only: bool) -> torch.Tensor:
    """One block of the published vision transformer, written from its formula."""
    name = f"vision_encoder.blocks.{number}"
    q, k, v = linear(norm(x, weights, f"{name}.norm1"), weights, f"{name}.attn.qkv").chunk(3, dim=-1)
    heads = []
    for query, key, value in zip(q.chunk(HEADS, -1), k.chunk(HEADS, -1), v.chunk(HEADS, -1), strict=True):
        share = torch.softmax(query @ key.transpose(-1, -2) / query.shape[-1] ** 0.5, dim=-1)
        heads.append(value if values_only else share @ value)
    x = x + weights[f"{name}.ls1.gamma"] * linear(torch.cat(heads, -1), weights, f"{name}.attn.proj")
    hidden = torch.nn.functional.gelu(linear(norm(x, weights, f"{name}.norm2"), weights, f"{name}.mlp.c_fc"))
    return x + weights[f"{name}.ls2.gamma"] * linear(hidden, weights, f"{name}.mlp.c_proj")


def published_tokens(rgb: np.ndarray, weights: Weights, values_only: bool) -> torch.Tensor:
    """Patch tokens (n, d) of a picture of the training size: no position is interpolated."""
    pixels = torch.from_numpy(rgb).permute(2, 0, 1)[None].float() / 255.0
    stem = "vision_encoder.patch_embed.proj"
    patches = torch.nn.functional.conv2d(pixels, weights[f"{stem}.weight"], weights[f"{stem}.bias"], stride=PATCH)
    x = torch.cat([weights["vision_encoder.cls_token"], patches.flatten(2).transpose(1, 2)], dim=1)
    x = x + weights["vision_encoder.pos_embed"]
    x = torch.cat([x[:, :1], weights["vision_encoder.register_tokens"], x[:, 1:]], dim=1)
    for number in range(3):
        x = published_block(x, weights, number, values_only and number == 2)
    return norm(x, weights, "vision_encoder.norm")[0, 2:]


def unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@pytest.mark.parametrize("way", ["", "#last"])
def test_patches_are_the_published_ones(models: Path, way: str) -> None:
    write_tipsv2(models)
    frame = example_frame(seed=3, width=IMAGE, height=IMAGE)
    found = TipsPixels(HUB_ID + way, short_side=IMAGE).encode(frame)
    expected = unit(published_tokens(frame.rgb, weights_of(models), values_only=not way).numpy())
    np.testing.assert_allclose(found.reshape(-1, WIDTH), expected, atol=2e-5)


def test_the_last_way_is_what_transformers_returns_for_a_wide_picture(models: Path) -> None:
    from transformers import AutoModel

    write_tipsv2(models)
    frame = example_frame(seed=4, width=2 * IMAGE, height=IMAGE)
    pixels = torch.from_numpy(frame.rgb).permute(2, 0, 1)[None].float() / 255.0
    model = AutoModel.from_pretrained(models / HUB_ID).eval()
    with torch.no_grad():
        expected = unit(model.get_image_features(pixels).last_hidden_state[0, 2:].numpy())
    found = TipsPixels(f"{HUB_ID}#last", short_side=IMAGE).encode(frame)
    assert found.shape == (IMAGE // PATCH, 2 * IMAGE // PATCH, WIDTH)
    np.testing.assert_allclose(found.reshape(-1, WIDTH), expected, atol=2e-5)


def test_words_are_the_mean_direction_of_the_published_sentences(models: Path, tips: TipsPixels) -> None:
    from transformers import AutoModel, Tipsv2ImageProcessor, Tipsv2Processor, Tipsv2Tokenizer

    tokens = Tipsv2Tokenizer.from_pretrained(models / HUB_ID)
    processor = Tipsv2Processor(Tipsv2ImageProcessor(), tokens)
    model = AutoModel.from_pretrained(models / HUB_ID).eval()
    texts = [prompt.format("office chair") for prompt in TIPS_PROMPTS]
    asked = processor(text=texts, return_tensors="pt")
    assert asked["input_ids"].shape == (len(TIPS_PROMPTS), 64)  # the published padding, which a mask hides
    with torch.no_grad():
        rows = unit(model.get_text_features(**asked).pooler_output.numpy())
    found = tips.encode_words(["Office  chair", " "])
    np.testing.assert_allclose(found[0], unit(rows.mean(axis=0)), atol=2e-5)
    assert not found[1].any()


def test_conforms(models: Path, tips: TipsPixels) -> None:
    assert isinstance(tips, BatchPixelEncoder)
    assert isinstance(tips, ScaledEncoder)
    assert tips.logit_scale == pytest.approx(200.0)
    check(Kind.PIXELS, load(Kind.PIXELS, "tipsv2"))
    assert tips.understood(" Red Chair ") == "red chair"
    assert tips.understood("  ") == ""


def test_a_batch_gives_what_single_frames_give(tips: TipsPixels) -> None:
    sizes = [(96, 64), (96, 64), (64, 96), (96, 64)]
    frames = [example_frame(seed, width, height) for seed, (width, height) in enumerate(sizes)]
    together = tips.encode_batch(frames)
    for frame, features in zip(frames, together, strict=True):
        np.testing.assert_allclose(features, tips.encode(frame), atol=1e-5)


def test_the_shape_of_a_picture_is_kept(models: Path) -> None:
    write_tipsv2(models)
    assert TipsPixels().encode(example_frame(width=640, height=480)).shape == (32, 43, WIDTH)


def test_the_gated_mlp_of_the_giant_model_is_taken(models: Path) -> None:
    write_tipsv2(models, "google/tipsv2-g14", swiglu=True)
    giant = TipsPixels("google/tipsv2-g14", short_side=IMAGE)
    features = giant.encode(example_frame(width=IMAGE, height=IMAGE))
    np.testing.assert_allclose(np.linalg.norm(features, axis=-1), 1.0, atol=1e-5)
    assert giant.card.id == "google/tipsv2-g14"


def test_the_card_tells_features_apart(models: Path, tips: TipsPixels) -> None:
    last = TipsPixels(f"{HUB_ID}#last", short_side=IMAGE)
    larger = TipsPixels(short_side=2 * IMAGE)
    assert len({tips.card.checksum, last.card.checksum, larger.card.checksum}) == 3
    assert (tips.card.id, last.card.id) == (HUB_ID, f"{HUB_ID}#last")
    assert tips.card.prompts == TIPS_PROMPTS


@pytest.mark.parametrize(
    ("weight", "said"), [("vision_encoder.blocks.1.norm1.weight", "norm1"), ("decoder.weight", r"decoder\.weight")]
)
def test_a_missing_and_a_foreign_weight_are_told(models: Path, weight: str, said: str) -> None:
    write_tipsv2(models)
    path = models / HUB_ID / "model.safetensors"
    weights = load_file(path)
    if weights.pop(weight, None) is None:
        weights[weight] = torch.zeros(2)
    save_file(weights, path, metadata={"format": "pt"})
    with pytest.raises(BackendError, match=said):
        TipsPixels()


def test_a_size_that_does_not_fit_is_told(models: Path) -> None:
    write_tipsv2(models)
    path = models / HUB_ID / "config.json"
    config = json.loads(path.read_text(encoding="utf-8"))
    config["vision_config"]["hidden_size"] = config["text_config"]["hidden_size"] = 48
    path.write_text(json.dumps(config), encoding="utf-8")
    with pytest.raises(BackendError, match="hf download"):
        TipsPixels()


def test_what_is_not_here_is_told(models: Path) -> None:
    with pytest.raises(BackendError, match="hf download google/tipsv2-b14"):
        TipsPixels()


def test_an_unknown_way_is_told(models: Path) -> None:
    with pytest.raises(BackendError, match="values, last"):
        TipsPixels(f"{HUB_ID}#keys")
