"""LSeg as a backend: the published computation on a tiny checkpoint in the published layout."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from slow_lseg import picture_features
from tiny.lseg import Sizes, lseg_layout, random_weights, write_checkpoint, write_lseg

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, find
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.protocols import BatchPixelEncoder, ScaledEncoder
from avlmaps_models.paper.clip_tokens import clip_tokens
from avlmaps_models.paper.lseg import LSegPixels, read_network
from avlmaps_models.paper.lseg_windows import every_nth
from avlmaps_models.paper.prompts import AREA_PROMPTS, THING_PROMPTS, VOCABULARY

CKPT = "demo_e200.ckpt"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("models")
    write_lseg(made)
    return made


@pytest.fixture(scope="module")
def loaded(folder: Path) -> LSegPixels:
    with using_models(ModelSettings(folder=folder, device="cpu", precision="float32", offline=True)):
        return LSegPixels(CKPT)


@pytest.fixture
def lseg(loaded: LSegPixels, folder: Path) -> Iterator[LSegPixels]:
    with using_models(ModelSettings(folder=folder, device="cpu", precision="float32", offline=True)):
        yield loaded


@pytest.fixture(scope="module")
def weights() -> dict[str, torch.Tensor]:
    return random_weights(lseg_layout(Sizes()), half=("clip_pretrained.",))


def test_it_keeps_what_pixel_encoders_promise(lseg: LSegPixels) -> None:
    check(Kind.PIXELS, lseg)
    assert isinstance(lseg, BatchPixelEncoder)
    assert isinstance(lseg, ScaledEncoder)


def test_every_pixel_has_what_the_published_code_computes(lseg: LSegPixels, weights: dict[str, torch.Tensor]) -> None:
    rgb = example_frame(seed=3, width=128, height=90).rgb
    ours, slow = lseg.published(rgb), picture_features(weights, rgb).numpy()
    assert ours.shape == slow.shape == (32, 366, 520)
    cosine = (ours * slow).sum(0) / np.linalg.norm(ours, axis=0) / np.linalg.norm(slow, axis=0)
    assert cosine.min() > 0.99999
    np.testing.assert_allclose(ours, slow, atol=0.016)  # half precision is 1/128 there
    assert 5.0 < np.linalg.norm(ours, axis=0).max() < 14.3


def test_the_grid_has_every_second_pixel_of_the_published_features_at_unit_length(lseg: LSegPixels) -> None:
    frame = example_frame(seed=1, width=64, height=101)
    published = lseg.published(frame.rgb).transpose(1, 2, 0)
    rows, columns = every_nth(published.shape[:2], 2)
    chosen = published[rows][:, columns]
    np.testing.assert_allclose(
        lseg.encode(frame), chosen / np.linalg.norm(chosen, axis=-1, keepdims=True), rtol=0.0, atol=1e-5
    )
    assert lseg.encode(frame).shape == (260, 165, 32)


def test_all_of_them_are_given_where_that_is_asked_for(lseg: LSegPixels) -> None:
    frame = example_frame(seed=2)
    whole = LSegPixels(CKPT, every=1)
    assert whole.encode(frame).shape == (347, 520, 32)
    assert whole.card.checksum != lseg.card.checksum


def test_a_batch_gives_what_its_frames_give_alone(lseg: LSegPixels, folder: Path) -> None:
    frames = [example_frame(0), example_frame(1, width=64, height=96), example_frame(2)]
    settings = ModelSettings(folder=folder, device="cpu", precision="float32", offline=True, batch=2)
    with using_models(settings):
        assert lseg.batch == 2
        together = lseg.encode_batch(frames)
    for frame, features in zip(frames, together, strict=True):
        np.testing.assert_allclose(features, lseg.encode(frame), rtol=0.0, atol=1e-4)
    assert lseg.encode_batch([]) == []


def test_a_word_is_the_mean_of_its_sentences(lseg: LSegPixels, folder: Path) -> None:
    tower = read_network(folder / CKPT).clip_pretrained
    rows = []
    for prompt in THING_PROMPTS:
        (tokens,) = clip_tokens().encode([prompt.replace("{}", "tv monitor")])
        with torch.no_grad():
            row = tower(torch.tensor([[*tokens, *[0] * (77 - len(tokens))]]))[0].numpy()
        rows.append(row / np.linalg.norm(row))
    mean = np.mean(rows, axis=0)
    found = lseg.encode_words(["tv monitor", "", " TV  Monitor "])
    np.testing.assert_allclose(found[0], mean / np.linalg.norm(mean), atol=1e-5)
    assert not found[1].any()
    np.testing.assert_allclose(found[0], found[2], atol=1e-5)
    assert (lseg.understood(" "), lseg.understood("Red Chair")) == ("", "red chair")


def test_the_sentences_and_the_names_are_as_many_as_published() -> None:
    assert len(THING_PROMPTS) == len(set(THING_PROMPTS)) == 63
    assert sum("picture of of" in prompt for prompt in THING_PROMPTS) == 3
    assert all(prompt.count("{}") == 1 for prompt in THING_PROMPTS)
    assert AREA_PROMPTS == ("{}",)
    assert len(VOCABULARY) == 38
    assert {"wall", "chest of drawers", "clothes"} < set(VOCABULARY)


def test_the_card_tells_what_is_needed_to_compare(lseg: LSegPixels) -> None:
    card = lseg.card
    assert (card.id, card.dim, card.licence, card.prompts) == (CKPT, 32, "MIT", THING_PROMPTS)
    assert lseg.vocabulary == VOCABULARY
    entry = find(Kind.PIXELS, "lseg")
    assert (entry.target, entry.model) == ("avlmaps_models.paper.lseg:LSegPixels", CKPT)


def test_a_flat_dictionary_of_the_same_weights_does_as_well(
    lseg: LSegPixels, models: Path, weights: dict[str, torch.Tensor]
) -> None:
    torch.save(weights, models / "lseg_minimal_e200.ckpt")
    frame = example_frame()
    np.testing.assert_allclose(LSegPixels("lseg_minimal_e200.ckpt").encode(frame), lseg.encode(frame), atol=1e-5)


def test_a_head_for_logits_is_left_aside(models: Path, weights: dict[str, torch.Tensor]) -> None:
    head = {f"scratch.head_block.depthwise.depthwise.{end}": torch.zeros(1) for end in ("weight", "bias")}
    write_checkpoint(models / CKPT, {**weights, **head})
    assert LSegPixels(CKPT).card.dim == 32


def changed(weights: dict[str, torch.Tensor], change: str) -> Any:
    state = dict(weights)
    if change == "missing":
        del state["scratch.head1.bias"]
    elif change == "unknown":
        state["scratch.head2.bias"] = torch.zeros(3)
    elif change == "shape":
        state["scratch.refinenet2.out_conv.bias"] = torch.zeros(3)
    elif change == "idle":
        del state["clip_pretrained.visual.proj"]
    elif change == "another":
        return {"net.backbone.weight": torch.zeros(3)}
    return state


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("missing", "scratch.head1.bias"),
        ("unknown", "scratch.head2.bias"),
        ("shape", "scratch.refinenet2.out_conv.bias"),
        ("idle", "clip_pretrained.visual.proj"),
        ("another", "not a checkpoint of LSeg"),
    ],
)
def test_a_checkpoint_of_another_network_is_refused(
    models: Path, weights: dict[str, torch.Tensor], change: str, told: str
) -> None:
    write_checkpoint(models / CKPT, changed(weights, change))
    with pytest.raises(BackendError, match=told) as fault:
        LSegPixels(CKPT)
    assert "gdown" in str(fault.value)


def test_a_file_that_is_not_there_or_damaged_is_told_of(models: Path) -> None:
    with pytest.raises(BackendError, match=r"demo_e200\.ckpt is not here .* gdown"):
        LSegPixels(CKPT)
    write_lseg(models)
    whole = (models / CKPT).read_bytes()
    (models / CKPT).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BackendError, match="damaged, cut short"):
        LSegPixels(CKPT)
