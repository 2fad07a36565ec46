"""DINOv2 for places: the published computation on a tiny random checkpoint in the published layout."""

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from tiny.clip import write_clip
from tiny.dinov2 import WIDTH, write_dinov2

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import LocalFeatures
from avlmaps_models.foundation.dinov2 import DinoPlaces
from avlmaps_models.foundation.whole_pictures import imagenet_picture, size_with_short_side

MODEL, REGISTERS = "facebook/dinov2-small", "facebook/dinov2-with-registers-small"
NOTHING = LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 8), np.float32))


@pytest.mark.parametrize(("model", "registers"), [(MODEL, 0), (REGISTERS, 4)])
def test_it_conforms(models: Path, model: str, registers: int) -> None:
    write_dinov2(models, model, registers)
    for way, dim in (("", 2 * WIDTH), ("#class", WIDTH), ("#mean", WIDTH)):
        places = DinoPlaces(model + way)
        check(Kind.PLACE, places)
        assert places.card.id == model + way and places.card.dim == dim
    with pytest.raises(BackendError, match=r"choose one of: both, class, mean"):
        DinoPlaces(f"{model}#other")


@pytest.mark.parametrize(("model", "registers"), [(MODEL, 0), (REGISTERS, 4)])
def test_it_is_the_class_token_and_the_generalised_mean_of_the_patches(
    models: Path, model: str, registers: int
) -> None:
    from transformers import AutoModel

    write_dinov2(models, model, registers)
    picture = example_frame(2, width=280, height=224).rgb  # 20 x 16 patches: not resized
    network = AutoModel.from_pretrained(models / model).eval()
    mean, deviation = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])
    values = torch.from_numpy(((picture / 255.0 - mean) / deviation).astype(np.float32)).permute(2, 0, 1)[None]
    with torch.no_grad():
        tokens = network(values).last_hidden_state[0].double().numpy()
    assert len(tokens) == 1 + registers + 16 * 20
    pooled = np.cbrt((tokens[1 + registers :] ** 3).mean(axis=0))
    first, second = tokens[0] / np.linalg.norm(tokens[0]), pooled / np.linalg.norm(pooled)
    found = DinoPlaces(model).encode(picture, NOTHING, {})
    np.testing.assert_allclose(found, np.concatenate([first, second]) / np.sqrt(2.0), atol=2e-5)
    np.testing.assert_allclose(DinoPlaces(f"{model}#class").encode(picture, NOTHING, {}), first, atol=2e-5)
    np.testing.assert_allclose(DinoPlaces(f"{model}#mean").encode(picture, NOTHING, {}), second, atol=2e-5)


@given(st.integers(1, 3000), st.integers(1, 3000))
def test_sides_are_whole_patches_and_the_shape_is_kept(height: int, width: int) -> None:
    rows, columns = size_with_short_side(height, width, 224, 14)
    assert rows % 14 == columns % 14 == 0 and min(rows, columns) == 224
    assert max(rows, columns) <= 4 * 224
    if max(height, width) <= 4 * min(height, width):
        assert rows / columns == pytest.approx(height / width, rel=7.5 / 224)


def test_resizing_neither_shifts_nor_aliases() -> None:
    """A ramp stays a ramp, and a pattern that is too fine for the small picture becomes its mean."""
    cpu = torch.device("cpu")
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 64, axis=0).repeat(3, axis=2)
    small = imagenet_picture(ramp, (16, 64), cpu)[0, 0, 8] * 0.229 + 0.485
    np.testing.assert_allclose(small[4:-4] * 255.0, np.arange(64)[4:-4] * 4 + 1.5, atol=0.6)
    stripes = np.zeros((64, 256, 3), np.uint8)
    stripes[:, ::2] = 200
    for way in ("bilinear", "bicubic"):
        flat = imagenet_picture(stripes, (16, 64), cpu, way)[0, 0, 8] * 0.229 + 0.485
        np.testing.assert_allclose(flat[4:-4] * 255.0, 100.0, atol=12.0)


def test_a_checkpoint_of_another_model_is_refused(models: Path) -> None:
    write_clip(models)
    with pytest.raises(BackendError, match=r"holds a model of the type 'clip', expected is 'dinov2' or"):
        DinoPlaces("openai/clip-vit-large-patch14")
