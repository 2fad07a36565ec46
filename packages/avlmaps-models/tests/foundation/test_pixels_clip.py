"""CLIP's patches: the last block's values, against slow formulas on the published names of the weights."""

from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file
from tiny.clip_patches import DIM, HEADS, IMAGE, PATCH, SCALE, WIDTH, write_clip_patches

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import BatchPixelEncoder, ScaledEncoder
from avlmaps_models.common.prompts import CLIP_PROMPTS
from avlmaps_models.foundation.clip_patches import ClipPatches

HUB_ID = "openai/clip-vit-base-patch16"
MEAN, DEVIATION = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
ROWS = IMAGE // PATCH
Weights = dict[str, torch.Tensor]


@pytest.fixture
def weights(models: Path) -> Weights:
    write_clip_patches(models)
    return load_file(models / HUB_ID / "model.safetensors")


def norm(x: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    values = weights[f"vision_model.{name}.weight"], weights[f"vision_model.{name}.bias"]
    return torch.nn.functional.layer_norm(x, x.shape[-1:], *values, 1e-5)


def linear(x: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    return x @ weights[f"vision_model.{name}.weight"].T + weights[f"vision_model.{name}.bias"]


def quick_gelu(x: torch.Tensor) -> torch.Tensor:
    return x * torch.sigmoid(1.702 * x)


def mlp(x: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    hidden = quick_gelu(linear(norm(x, weights, f"{name}.layer_norm2"), weights, f"{name}.mlp.fc1"))
    return linear(hidden, weights, f"{name}.mlp.fc2")


def attended(x: torch.Tensor, weights: Weights, name: str, way: str) -> torch.Tensor:
    """What the attention of a block adds, for tokens (n, d)."""
    q, k, v = (linear(norm(x, weights, f"{name}.layer_norm1"), weights, f"{name}.self_attn.{p}_proj") for p in "qkv")
    heads = []
    for query, key, value in zip(q.chunk(HEADS, -1), k.chunk(HEADS, -1), v.chunk(HEADS, -1), strict=True):
        if way == "whole":
            score = query @ key.T / (WIDTH / HEADS) ** 0.5
        else:
            score = key @ key.T / (WIDTH / HEADS) ** 0.5
            for i in range(1, len(x)):
                for j in range(1, len(x)):
                    (a, b), (c, d) = divmod(i - 1, ROWS), divmod(j - 1, ROWS)
                    score[i, j] += np.exp(-((a - c) ** 2 + (b - d) ** 2) / (2 * 5.0**2))
        heads.append(value if way in ("value", "maskclip") else torch.softmax(score, dim=-1) @ value)
    return linear(torch.cat(heads, -1), weights, f"{name}.self_attn.out_proj")


def published(rgb: np.ndarray, weights: Weights, way: str) -> np.ndarray:
    """Features (1 + n, d) of a picture of the training size, class token first."""
    pixels = (torch.from_numpy(rgb).float() / 255.0 - torch.tensor(MEAN)) / torch.tensor(DEVIATION)
    stem = weights["vision_model.embeddings.patch_embedding.weight"]
    patches = torch.nn.functional.conv2d(pixels.permute(2, 0, 1)[None], stem, stride=PATCH)[0].flatten(1).T
    x = torch.cat([weights["vision_model.embeddings.class_embedding"][None], patches])
    x = norm(x + weights["vision_model.embeddings.position_embedding.weight"], weights, "pre_layrnorm")
    x = x + attended(x, weights, "encoder.layers.0", "whole")
    x = x + mlp(x, weights, "encoder.layers.0")
    own = attended(x, weights, "encoder.layers.1", way)
    if way in ("whole", "maskclip"):
        own = own + x
        own = own + mlp(own, weights, "encoder.layers.1")
    out = norm(own, weights, "post_layernorm") @ weights["visual_projection.weight"].T
    return unit(out.numpy())


def unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def test_the_formulas_of_this_test_are_those_of_the_whole_clip(models: Path, weights: Weights) -> None:
    from transformers import CLIPModel, CLIPProcessor

    rgb = example_frame(seed=1, width=IMAGE, height=IMAGE).rgb
    pixels = CLIPProcessor.from_pretrained(models / HUB_ID).image_processor(rgb, return_tensors="pt")["pixel_values"]
    with torch.no_grad():
        whole = CLIPModel.from_pretrained(models / HUB_ID).eval().get_image_features(pixels).pooler_output.numpy()
    np.testing.assert_allclose(published(rgb, weights, "whole")[:1], unit(whole), atol=2e-5)


@pytest.mark.parametrize("way", ["value", "maskclip", "neighbours"])
def test_patches_are_what_the_papers_say(weights: Weights, way: str) -> None:
    frame = example_frame(seed=2, width=IMAGE, height=IMAGE)
    found = ClipPatches(f"{HUB_ID}#{way}", short_side=IMAGE).encode(frame)
    assert found.shape == (ROWS, ROWS, DIM)
    np.testing.assert_allclose(found.reshape(-1, DIM), published(frame.rgb, weights, way)[1:], atol=2e-5)


@pytest.mark.usefixtures("weights")
def test_the_first_way_is_the_values_alone() -> None:
    frame = example_frame()
    np.testing.assert_allclose(ClipPatches().encode(frame), ClipPatches(f"{HUB_ID}#value").encode(frame), atol=1e-5)


@pytest.mark.usefixtures("weights")
def test_a_patch_is_where_its_pixels_are() -> None:
    """Rows stay rows: in a wide picture only the patches near what changed change much by values alone."""
    encoder = ClipPatches(short_side=IMAGE)
    frame = example_frame(width=3 * IMAGE, height=IMAGE)
    before = encoder.encode(frame)
    assert before.shape == (ROWS, 3 * ROWS, DIM)
    frame.rgb[-PATCH:, -PATCH:] = 255 - frame.rgb[-PATCH:, -PATCH:]
    change = np.linalg.norm(encoder.encode(frame) - before, axis=-1)
    assert np.unravel_index(change.argmax(), change.shape) == (ROWS - 1, 3 * ROWS - 1)


@pytest.mark.usefixtures("weights")
@pytest.mark.parametrize("way", ["value", "maskclip", "neighbours"])
def test_conforms(way: str) -> None:
    encoder = load(Kind.PIXELS, f"clip-patches@{HUB_ID}#{way}")
    assert isinstance(encoder, BatchPixelEncoder)
    assert isinstance(encoder, ScaledEncoder)
    assert encoder.logit_scale == pytest.approx(SCALE, rel=1e-5)
    check(Kind.PIXELS, encoder)


@pytest.mark.usefixtures("weights")
def test_a_batch_gives_what_single_frames_give() -> None:
    encoder = ClipPatches(f"{HUB_ID}#neighbours", short_side=IMAGE)
    frames = [example_frame(seed) for seed in range(3)]
    for frame, features in zip(frames, encoder.encode_batch(frames), strict=True):
        np.testing.assert_allclose(features, encoder.encode(frame), atol=1e-5)


def test_words_are_those_of_clip(models: Path, weights: Weights) -> None:
    from transformers import CLIPModel, CLIPTokenizer

    assert weights
    texts = [prompt.format("dog bark") for prompt in CLIP_PROMPTS]
    tokenizer = CLIPTokenizer.from_pretrained(models / HUB_ID)
    tokens = tokenizer(texts, padding="max_length", max_length=77, truncation=True, return_tensors="pt")
    with torch.no_grad():
        rows = CLIPModel.from_pretrained(models / HUB_ID).eval().get_text_features(**tokens).pooler_output.numpy()
    np.testing.assert_allclose(ClipPatches().encode_words(["dog bark"])[0], unit(unit(rows).mean(0)), atol=2e-5)


def test_other_patch_sizes(models: Path) -> None:
    write_clip_patches(models, "openai/clip-vit-base-patch32", patch=32)
    encoder = ClipPatches("openai/clip-vit-base-patch32")
    assert encoder.encode(example_frame(width=640, height=480)).shape == (14, 19, DIM)
    assert (encoder.card.id, encoder.card.licence) == ("openai/clip-vit-base-patch32", "MIT")


@pytest.mark.usefixtures("weights")
def test_the_card_tells_ways_and_sizes_apart() -> None:
    cards = [ClipPatches(HUB_ID + way, short_side=side).card for way in ("", "#neighbours") for side in (64, 128)]
    assert len({card.checksum for card in cards}) == 4


def test_a_missing_weight_is_told(models: Path, weights: Weights) -> None:
    weights.pop("visual_projection.weight")
    save_file(weights, models / HUB_ID / "model.safetensors", metadata={"format": "pt"})
    with pytest.raises(BackendError, match="visual_projection"):
        ClipPatches()


def test_a_model_without_a_tokenizer_is_told(models: Path) -> None:
    write_clip_patches(models)
    for name in ("tokenizer.json", "tokenizer_config.json"):
        (models / HUB_ID / name).unlink()
    with pytest.raises(BackendError, match="CLIPTokenizer"):
        ClipPatches()
