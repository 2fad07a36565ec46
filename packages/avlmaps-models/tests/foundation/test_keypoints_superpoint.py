"""SuperPoint: transformers' network at full size, held against a slow formula of the published post-processing."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.torch import load_file, save_file
from tiny.superpoint import FOLDER, write_superpoint

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check
from avlmaps_models.paper.superpoint import SuperPointKeypoints
from helpers.picture_room import painting


@pytest.fixture
def encoder(models: Path) -> Any:
    write_superpoint(models)
    return load(Kind.LOCAL, "superpoint")


def picture(width: int = 112, height: int = 88, seed: int = 0) -> np.ndarray:
    return painting(np.random.default_rng(seed), height, width, shapes=100)


def convolved(state: dict[str, torch.Tensor], name: str, x: torch.Tensor) -> torch.Tensor:
    kernel = state[f"{name}.weight"]
    return torch.nn.functional.conv2d(x, kernel, state[f"{name}.bias"], padding=kernel.shape[-1] // 2)


def published(state: dict[str, torch.Tensor], grey: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the score of each pixel before suppression, and the descriptors' map, by the published layers."""
    x = torch.from_numpy(grey.astype(np.float32))[None, None] / 255.0
    for block in range(4):
        for half in "ab":
            x = convolved(state, f"encoder.conv_blocks.{block}.conv_{half}", x).relu()
        x = torch.nn.functional.max_pool2d(x, 2) if block < 3 else x
    cells = convolved(state, "keypoint_decoder.conv_score_a", x).relu()
    cells = convolved(state, "keypoint_decoder.conv_score_b", cells).softmax(1)[0, :-1]
    score = cells.reshape(8, 8, *x.shape[2:]).permute(2, 0, 3, 1).reshape(8 * x.shape[2], 8 * x.shape[3])
    dense = convolved(state, "descriptor_decoder.conv_descriptor_a", x).relu()
    dense = convolved(state, "descriptor_decoder.conv_descriptor_b", dense)
    return score.numpy(), torch.nn.functional.normalize(dense, dim=1)[0].numpy()


def suppressed(score: np.ndarray, radius: int = 4) -> np.ndarray:
    """Return which pixels are maxima: three rounds, each among what no maximum of an earlier round is near to."""

    def window_max(values: np.ndarray) -> np.ndarray:
        padded = np.pad(values, radius, constant_values=-np.inf)
        windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * radius + 1, 2 * radius + 1))
        return windows.max(axis=(2, 3))

    maxima = score == window_max(score)
    for _ in range(2):
        near = window_max(maxima.astype(float)) > 0
        left = np.where(near, 0.0, score)
        maxima |= (left == window_max(left)) & ~near
    return maxima


def test_it_conforms(encoder: SuperPointKeypoints) -> None:
    check(Kind.LOCAL, encoder)


def test_its_card_tells_that_it_is_not_free(encoder: SuperPointKeypoints) -> None:
    assert encoder.card.id == FOLDER and encoder.card.dim == 256
    assert "NonCommercial" in encoder.card.licence and "non-commercial" in encoder.card.note


@pytest.mark.parametrize("width, height", [(112, 88), (107, 93)])
def test_keypoints_are_those_of_the_published_code_at_full_size(
    encoder: SuperPointKeypoints, models: Path, width: int, height: int
) -> None:
    rgb = picture(width, height)
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    score, dense = published(load_file(models / FOLDER / "model.safetensors"), grey)
    inside = np.zeros_like(score, bool)
    inside[4:-4, 4:-4] = True
    y, x = np.nonzero(suppressed(score) & (score > 0.005) & inside)
    found = encoder.encode(rgb)
    assert len(x) > 20
    np.testing.assert_allclose(found.xy, np.stack([x, y], axis=1) + 0.5, atol=1e-3)
    np.testing.assert_allclose(found.score, score[y, x], rtol=1e-3, atol=1e-6)
    assert found.size == (width, height)
    for row in range(0, len(x), 7):
        # The middle of the first 8x8 cell is at 3.5; the published code stretches the rest a little (8 w - 4.5).
        u, v = (
            np.clip((at - 3.5) / (8 * size - 4.5) * (size - 1), 0.0, size - 1.0)
            for at, size in ((x[row], dense.shape[2]), (y[row], dense.shape[1]))
        )
        i, j = min(int(u), dense.shape[2] - 2), min(int(v), dense.shape[1] - 2)
        mixed = sum(
            dense[:, j + b, i + a] * (1 - abs(u - i - a)) * (1 - abs(v - j - b)) for a in (0, 1) for b in (0, 1)
        )
        likeness = float(mixed @ found.descriptors[row] / np.linalg.norm(mixed))
        assert likeness > 0.99999, (x[row], y[row])


@pytest.mark.parametrize("corner", [0, 3, 4, 7])
def test_no_keypoint_is_at_a_border_also_not_at_the_right_and_lower_ones(models: Path, corner: int) -> None:
    """Weights that find the same pixel of each 8x8 cell; transformers alone would keep 4 to 7 in the last cell."""
    write_superpoint(models)
    state = load_file(models / FOLDER / "model.safetensors")
    state["keypoint_decoder.conv_score_b.weight"].zero_()
    state["keypoint_decoder.conv_score_b.bias"][9 * corner] = 5.0
    save_file(state, models / FOLDER / "model.safetensors", {"format": "pt"})
    found = SuperPointKeypoints().encode(picture(64, 48))
    first, last = (0, -1) if corner > 3 else (1, None)
    x, y = (np.arange(corner, size, 8)[first:last] + 0.5 for size in (64, 48))
    expected = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(found.xy, expected, atol=1e-4)


def test_the_colour_does_not_matter_but_for_its_grey(encoder: SuperPointKeypoints) -> None:
    rgb = picture()
    grey = np.repeat(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)[:, :, None], 3, axis=2)
    a, b = encoder.encode(rgb), encoder.encode(grey)
    np.testing.assert_allclose(a.xy, b.xy, atol=1e-3)
    red = rgb.copy()
    red[:, :, 0] = 255 - red[:, :, 0]
    other = encoder.encode(red).descriptors
    assert other.shape != a.descriptors.shape or np.abs(other - a.descriptors).max() > 1e-3


def test_its_settings_are_the_papers_whatever_the_folder_says(encoder: SuperPointKeypoints, models: Path) -> None:
    before = encoder.encode(picture())
    path = models / FOLDER / "config.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "max_keypoints": 5, "keypoint_threshold": 0.5}))
    np.testing.assert_allclose(SuperPointKeypoints().encode(picture()).xy, before.xy, atol=1e-3)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(width=st.integers(1, 100), height=st.integers(1, 100))
def test_pictures_of_any_size_have_keypoints_inside_or_none(
    encoder: SuperPointKeypoints, width: int, height: int
) -> None:
    rgb = np.random.default_rng(width).integers(0, 256, (height, width, 3)).astype(np.uint8)
    found = encoder.encode(rgb)
    assert found.descriptors.shape == (len(found.xy), 256) and found.size == (width, height)
    assert ((found.xy > 4) & (found.xy < (width - 4, height - 4))).all()


def test_another_models_folder_is_one_sentence(models: Path) -> None:
    write_superpoint(models)
    state = load_file(models / FOLDER / "model.safetensors")
    state["decoder.more"] = state.pop("keypoint_decoder.conv_score_b.bias")
    save_file(state, models / FOLDER / "model.safetensors", {"format": "pt"})
    with pytest.raises(BackendError, match=r"lacks keypoint_decoder\.conv_score_b\.bias; nothing takes decoder\.more"):
        load(Kind.LOCAL, "superpoint")


def test_where_it_is_not_here_the_command_is_told(models: Path) -> None:
    with pytest.raises(BackendError, match="hf download magic-leap-community/superpoint"):
        load(Kind.LOCAL, "superpoint")
